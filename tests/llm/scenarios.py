"""The ways in which the faulty server misbehaves, by name. Each takes the connection, whose request
has been read, and the number of this request to it, from 1. What an answer's JSON may contain is
tested without a server, in the suite llm_reply.lua."""

import base64
import gzip
import json
import time
import urllib.parse

ALL = {}
GOOD = '{"mutation_rate": 0.2}'
JSON = {"Content-Type": "application/json"}
CHUNKED = {**JSON, "Transfer-Encoding": "chunked"}


def scenario(play):
    """Enters a scenario under its function's name."""
    ALL[play.__name__] = play
    return play


def completion(content=GOOD, finish="stop", usage=None, **fields):
    """The body of a good answer, with fields changed."""
    body = {
        "id": "cmpl-1", "object": "chat.completion", "created": 1, "model": "played-1",
        "system_fingerprint": "fp-1",
        "choices": [{"index": 0, "finish_reason": finish,
                     "message": {"role": "assistant", "content": content}}],
        "usage": usage or {"prompt_tokens": 40, "completion_tokens": 8},
    }
    body.update(fields)
    return body


WHOLE = json.dumps(completion()).encode()


def good(connection, number=0, **changed):
    """A good answer with a plausible number of tokens."""
    usage = {"prompt_tokens": len(connection.body) // 4, "completion_tokens": 8}
    connection.answer("200 OK", completion(usage=usage, **changed))


def error(message, **fields):
    """OpenAI's form of an error."""
    return {"error": {"message": message, **fields}}


ALL["good"] = good


@scenario
def varied(connection, number):
    good(connection, content='{"mutation_rate": %.2f}' % (0.05 + number % 10 / 50))


@scenario
def unreliable(connection, number):
    """Fails three requests of ten, by status, reset and nonsense."""
    turn = number * 7 % 10
    if turn == 0:
        connection.answer("503 Busy", error("busy"))
    elif turn == 1:
        connection.reset()
    else:
        good(connection, content="no JSON here" if turn == 2 else GOOD)


# ---- connections and bodies that break off or never end ------------------------------------------


@scenario
def reset(connection, number):
    connection.reset()


@scenario
def reset_in_body(connection, number):
    connection.head("200 OK", {**JSON, "Content-Length": 1000})
    connection.send(b'{"id": "half')
    time.sleep(0.05)  # a reset may overtake what was sent
    connection.reset()


@scenario
def silent(connection, number):
    connection.hold()


@scenario
def slow_headers(connection, number):
    connection.trickle(b"HTTP/1.1 200 OK\r\nX-Long: " + b"x" * 10000, 0.05)


@scenario
def slow_body(connection, number):
    connection.head("200 OK", {**JSON, "Content-Length": len(WHOLE)})
    connection.trickle(WHOLE, 1.0)


@scenario
def endless_headers(connection, number):
    connection.send(b"HTTP/1.1 200 OK\r\n")
    while True:
        connection.send(b"X-More: " + b"y" * 1000 + b"\r\n")


@scenario
def endless_interim(connection, number):
    while True:
        connection.send(b"HTTP/1.1 100 Continue\r\n\r\n" * 20)


@scenario
def endless_body(connection, number):
    connection.head("200 OK", CHUNKED)
    while True:
        connection.send(b"4000\r\n" + b"x" * 0x4000 + b"\r\n")


@scenario
def endless_events(connection, number):
    connection.head("200 OK", {"Content-Type": "text/event-stream"})
    while True:
        connection.send(b'data: {"choices": [{"delta": {"content": "a"}}]}\n\n')
        time.sleep(0.01)


@scenario
def length_too_long(connection, number):
    connection.answer("200 OK", WHOLE, {"Content-Length": len(WHOLE) + 10})


@scenario
def length_too_short(connection, number):
    connection.answer("200 OK", WHOLE, {"Content-Length": len(WHOLE) - 10})


@scenario
def broken_chunks(connection, number):
    connection.head("200 OK", CHUNKED)
    connection.send(b"10\r\n0123456789abcdef\r\nnot a length\r\nxx\r\n")


@scenario
def chunks_break_off(connection, number):
    connection.head("200 OK", CHUNKED)
    connection.send(b"ffff\r\n{")


@scenario
def no_http(connection, number):
    connection.send(b"\x00\x01\x02 this is not HTTP\r\n\r\n")


@scenario
def gzip_bomb(connection, number):
    packed = gzip.compress(b'{"a": "' + b" " * (64 << 20) + b'"}', 1)
    connection.answer("200 OK", packed, {"Content-Encoding": "gzip"})


@scenario
def gzip_good(connection, number):
    connection.answer("200 OK", gzip.compress(WHOLE), {"Content-Encoding": "gzip"})


@scenario
def gzip_wrong(connection, number):
    connection.answer("200 OK", WHOLE, {"Content-Encoding": "gzip"})


# ---- statuses, redirects and proxies -------------------------------------------------------------


@scenario
def retry_after(connection, number):
    if number == 1:
        connection.answer("503 Busy", error("slow down"), {"Retry-After": "0.3"})
    else:
        good(connection)


@scenario
def retry_after_minute(connection, number):
    connection.answer("503 Busy", error("slow down"), {"Retry-After": "60"})


@scenario
def redirect(connection, number):
    connection.answer("307 Moved", b"", {
        "Location": "http://" + connection.headers["host"] + "/redirect_target/v1/chat/completions"})


@scenario
def proxy_page(connection, number):
    connection.answer("502 Bad Gateway", b"<!DOCTYPE html>\n<html></html>\n",
                      {"Content-Type": "text/html"})


# ---- an echoed key -------------------------------------------------------------------------------


@scenario
def unauthorized(connection, number):
    text = "Incorrect API key provided: %s. You can find yours at /account" % connection.key()
    connection.answer("401 Unauthorized", error(text, code="invalid_api_key"),
                      {"x-request-id": "req-" + connection.key()})


@scenario
def echo(connection, number):
    key = connection.key()
    forms = [key, key[:12] + "****", base64.b64encode(key.encode()).decode(),
             urllib.parse.quote(key, safe=""), base64.b64encode(b"user:" + key.encode()).decode(),
             key.encode().hex()]
    body = completion(content=" ".join(forms), id=key, model=key, finish=key)
    body["echo"] = forms
    escaped = "".join("\\u%04x" % ord(letter) for letter in key)
    text = json.dumps(body).replace('"echo"', '"%s"' % escaped)
    connection.answer("200 OK", text.encode(), {"x-request-id": key, "Retry-After": key})


@scenario
def echo_reset(connection, number):
    connection.send(("HTTP/1.1 200 OK\r\nContent-Length: 9999\r\n\r\n" + connection.key()).encode())
