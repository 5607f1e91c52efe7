"""The ways in which the faulty server misbehaves, by name: functions of a request (number from 1,
key, body, host) that return the steps of the answer: bytes to send, seconds to wait, RESET or HOLD.
What an answer's JSON may contain is tested without a server, in the suite llm_reply.lua."""

import gzip
import itertools
import json

RESET = "reset"  # end the connection with a reset
HOLD = "hold"  # send nothing until the client closes the connection
GOOD = '{"mutation_rate": 0.2}'


def head(status="200 OK", **headers):
    """The lines before a body; underscores in the names of headers are dashes."""
    lines = ["HTTP/1.1 " + status, "Connection: close"]
    lines += ["%s: %s" % (name.replace("_", "-"), value) for name, value in headers.items()]
    return ("\r\n".join(lines) + "\r\n\r\n").encode("latin-1")


def answer(status, body, **headers):
    """A whole answer; a body other than bytes is sent as JSON."""
    body = body if isinstance(body, bytes) else json.dumps(body).encode()
    return head(status, **{"Content_Type": "application/json", "Content_Length": len(body),
                           **headers}) + body


def completion(content=GOOD, tokens=40, finish="stop", **fields):
    """The body of a good answer, with fields changed."""
    return {
        "id": "cmpl-1", "object": "chat.completion", "created": 1, "model": "played-1",
        "system_fingerprint": "fp-1", "choices": [{
            "index": 0, "finish_reason": finish,
            "message": {"role": "assistant", "content": content}}],
        "usage": {"prompt_tokens": tokens, "completion_tokens": 8}, **fields}


def good(request, content=GOOD):
    """A good answer with a plausible number of tokens."""
    return answer("200 OK", completion(content, len(request.body) // 4))


def error(status, message, code=None, **headers):
    """OpenAI's form of an error."""
    return answer(status, {"error": {"message": message, "code": code}}, **headers)


def unreliable(request):
    """Fails three requests of ten, by status, reset and nonsense."""
    failures = {0: error("503 Busy", "busy"), 1: RESET, 2: good(request, "no JSON here")}
    return [failures.get(request.number * 7 % 10, good(request))]


def trickle(data, pause):
    """Bytes one by one, `pause` seconds apart."""
    for byte in data:
        yield bytes([byte])
        yield pause


def endless(first, data, pause=0):
    """The same bytes again and again."""
    yield first
    for _ in itertools.count():
        yield data
        yield pause


def echo(request):
    """The key in every part of an answer, in its id with escaped letters."""
    key = request.key
    body = json.dumps(completion("your key: " + key, finish=key, id="ESCAPED", model=key))
    body = body.replace("ESCAPED", "".join("\\u%04x" % ord(letter) for letter in key))
    return [answer("200 OK", body.encode(), x_request_id=key, Retry_After=key)]


WHOLE = json.dumps(completion()).encode()
CHUNKED = head(Transfer_Encoding="chunked")

ALL = {
    "good": lambda r: [good(r)],
    "varied": lambda r: [good(r, '{"mutation_rate": %.2f}' % (0.05 + r.number % 10 / 50))],
    "unreliable": unreliable,
    "mirror": lambda r: [answer("201 Created", {
        "line": r.requestline, "headers": dict(r.headers), "body": r.body.decode()},
                                X_Two="a", x_two="b")],
    # connections and bodies that break off or never end; a reset may overtake what was sent
    "reset": lambda r: [RESET],
    "silent": lambda r: [HOLD],
    "slow_body": lambda r: itertools.chain([head(Content_Length=len(WHOLE))], trickle(WHOLE, 1)),
    "endless_headers": lambda r: endless(b"HTTP/1.1 200 OK\r\n", b"X-More: %s\r\n" % (b"y" * 1000)),
    "endless_body": lambda r: endless(CHUNKED, b"4000\r\n" + b"x" * 0x4000 + b"\r\n"),
    "length_too_long": lambda r: [answer("200 OK", WHOLE, Content_Length=len(WHOLE) + 10)],
    "no_http": lambda r: [b"\x00\x01\x02 this is not HTTP\r\n\r\n"],
    "gzip_bomb": lambda r: [answer(
        "200 OK", gzip.compress(b'{"a": "' + b" " * (64 << 20) + b'"}', 1),
        Content_Encoding="gzip")],
    "gzip_good": lambda r: [answer("200 OK", gzip.compress(WHOLE), Content_Encoding="gzip")],
    # statuses, redirects and proxies
    "retry_after": lambda r: [
        error("503 Busy", "slow down", Retry_After="0.3") if r.number == 1 else good(r)],
    "retry_after_minute": lambda r: [error("503 Busy", "slow down", Retry_After="60")],
    "redirect": lambda r: [answer(
        "307 Moved", b"", Location="http://%s/redirect_target/v1/chat/completions" % r.host)],
    "proxy_page": lambda r: [answer(
        "502 Bad Gateway", b"<!DOCTYPE html>\n<html></html>\n", Content_Type="text/html")],
    # a key that comes back
    "unauthorized": lambda r: [error(
        "401 Unauthorized", "Incorrect API key provided: %s. You can find yours at /account"
        % r.key, "invalid_api_key", x_request_id="req-" + r.key)],
    "echo": echo,
    "echo_reset": lambda r: [
        ("HTTP/1.1 200 OK\r\nContent-Length: 9999\r\n\r\n" + r.key).encode()],
}
