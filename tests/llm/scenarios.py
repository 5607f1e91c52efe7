"""The ways in which the faulty server misbehaves, by name: fNN_what, where NN is the number of the
fault in the suite llm_faults.lua. Each takes the connection, whose request has been read, and the
number of this request to it, from 1. Here are those of HTTP and of answers."""

import base64
import json
import urllib.parse

from answers import ALL, GOOD, completion, error, good, named, scenario
from transport import page

SOON = "Fri, 31 Dec 2100 23:59:59 GMT"
PAST = "Wed, 21 Oct 2015 07:28:00 GMT"


# ---- HTTP: 17 to 25 ------------------------------------------------------------------------------


def first(connection, number, count, status, body, headers=None):
    """This answer to the first requests, then a good one."""
    if number <= count:
        connection.answer("%d First" % status, body, headers)
    else:
        good(connection)


# name: status, headers; once
for name, (status, headers) in {
    "f17_retry_after_seconds": (429, {"Retry-After": "3"}),
    "f17_retry_after_float": (429, {"Retry-After": "0.7"}),
    "f17_retry_after_date": (503, {"Retry-After": SOON}),
    "f17_retry_after_past": (429, {"Retry-After": PAST}),
    "f17_retry_after_zero": (429, {"Retry-After": "0"}),
    "f17_retry_after_negative": (429, {"Retry-After": "-7"}),
    "f17_retry_after_abc": (429, {"Retry-After": "abc"}),
    "f17_retry_after_86400": (429, {"Retry-After": "86400"}),
    "f17_retry_after_ms": (429, {"retry-after-ms": "250", "Retry-After": "9"}),
    "f17_retry_after_minute": (503, {"Retry-After": "60"}),
    "f17_retry_real": (503, {"Retry-After": "0.3"}),
    "f17_should_retry": (400, {"x-should-retry": "true"}),
    "f17_should_not_retry": (503, {"x-should-retry": "false"}),
}.items():
    named(name, lambda connection, number, status=status, headers=headers: first(
        connection, number, 1, status, error("slow down"), headers))

# name: status, body; always
for name, (status, body) in {
    "f18_quota": (429, error("You exceeded your current quota", type="insufficient_quota",
                             code="insufficient_quota")),
    "f18_quota_words": (429, error("INSUFFICIENT QUOTA: tokens per minute", type="rate_limit",
                                   code=None)),
    "f19_500_always": (500, error("oops")),
    "f20_busy": (503, error("server busy, please try again.  maximum pending requests exceeded")),
    "f22_context": (400, error("the request exceeds the available context size", code=400,
                               type="exceed_context_size_error", n_prompt_tokens=9000,
                               n_ctx=4096)),
    "f18_quota_403": (403, error("used up", code="insufficient_quota")),
    "f18_quota_402": (402, error("Insufficient Balance")),
    "f23_403": (403, error("this model is not yours")),
    "f23_error_in_list": (400, [error("API key not valid", code=400, status="INVALID_ARGUMENT")]),
    "f23_404": (404, error("The model `m` does not exist", code="model_not_found")),
    "f23_404_page": (404, b"404 page not found\n"),
    "f23_422": (422, {"detail": [{"loc": ["body", "messages"], "msg": "field required",
                                  "type": "value_error"}]}),
    "f24_error_object": (200, error("upstream broke")),
    "f24_error_text": (200, {"error": "model 'm' not found"}),
    "f24_error_null": (200, completion(error=None)),
    "f24_error_empty": (200, completion(error="")),
    "f24_error_in_choice": (200, completion(choices=[{
        "index": 0, "finish_reason": "error", "message": {"content": ""},
        "error": {"message": "provider lost"}}])),
    "f24_error_status": (200, error("provider busy", code=503)),
    "f25_empty_204": (204, b""),
    "f25_empty_200": (200, b""),
    "f25_list": (200, b"[1, 2]"),
    "f26_no_choices": (200, {"id": "x", "object": "chat.completion"}),
    "f26_empty_choices": (200, completion(choices=[])),
    "f26_choices_object": (200, completion(choices={"0": {}})),
    "f26_choices_numbers": (200, completion(choices=[7])),
    "f26_no_message": (200, completion(choices=[{"index": 0}])),
    "f27_content_null": (200, completion(message={"content": None})),
    "f27_content_empty": (200, completion(content="")),
    "f27_content_number": (200, completion(content=7)),
    "f27_parts": (200, completion(content=[
        {"type": "text", "text": '{"mutation_'}, {"type": "image_url", "image_url": "x"},
        {"type": "text", "text": 'rate": 0.2}'}, 5])),
    "f27_parts_empty": (200, completion(content=[])),
    "f28_refusal": (200, completion(message={
        "content": None, "refusal": "I cannot\nhelp \x1b[31mwith that"})),
    "f28_filter_400": (400, error("The prompt triggered the content policy",
                                  code="content_filter", param="prompt")),
    "f28_filter": (200, completion(content="", finish="content_filter")),
    "f29_length": (200, completion(content='{"mutation_rate": 0.', finish="length")),
    "f29_length_empty": (200, completion(content="", finish="length")),
    "f29_tool_calls": (200, completion(finish="tool_calls", message={
        "content": None, "tool_calls": [{"id": "1", "type": "function", "function": {
            "name": "shell", "arguments": "{}"}}]})),
    "f29_unknown": (200, completion(finish="because")),
    "f29_no_finish": (200, completion(finish=None)),
    "f30_reasoning_only": (200, completion(message={
        "content": "", "reasoning_content": GOOD})),
    "f30_reasoning_field": (200, completion(message={"content": None, "reasoning": GOOD})),
    "f30_think": (200, completion(content='<think>{"mutation_rate": 9}</think>' + GOOD)),
    "f31_no_usage": (200, {k: v for k, v in completion().items() if k != "usage"}),
    "f31_usage_negative": (200, completion(usage={
        "prompt_tokens": -1, "completion_tokens": 5})),
    "f31_usage_text": (200, completion(usage={
        "prompt_tokens": "40", "completion_tokens": "8"})),
    "f31_usage_list": (200, completion(usage=[1])),
    "f31_other_model": (200, completion(model="another-model")),
    "f32_cut_prompt": (200, completion(usage={"prompt_tokens": 900, "completion_tokens": 8})),
    "f33_two_choices": (200, completion(choices=[
        {"index": 0, "finish_reason": "stop", "message": {"content": GOOD}},
        {"index": 1, "finish_reason": "stop", "message": {"content": '{"mutation_rate": 0.3}'}}])),
}.items():
    named(name, lambda connection, number, status=status, body=body: connection.answer(
        "%d Said" % status, body))

for code in (408, 409, 500, 502, 503, 504, 529):
    named("f19_%d_once" % code, lambda connection, number, code=code: first(
        connection, number, 1, code, error("once")))

named("f20_loading_503", lambda connection, number: first(
    connection, number, 2, 503, error("Loading model", code=503, type="unavailable_error")))
named("f20_loading_500", lambda connection, number: first(
    connection, number, 1, 500, {"error": "llm server loading model"}))
named("f25_html", lambda connection, number: page(connection, "200 OK"))
named("f25_plain_type", lambda connection, number: connection.answer(
    "200 OK", completion(), {"Content-Type": "text/plain"}))

WHOLE = json.dumps(completion()).encode()
for name, body in {
    "f25_bom": b"\xef\xbb\xbf" + WHOLE,
    "f25_not_utf8": b'{"choices": "\xff\xfe"}',
    "f25_deep": b'{"a":' + b"[" * 5000 + b"]" * 5000 + b"}",
    "f25_half": WHOLE[:-20],
}.items():
    named(name, lambda connection, number, body=body: connection.answer("200 OK", body))


def refuse(connection, refused):
    """400 while the request has one of these fields, in these words."""
    request = connection.request()
    form = request.get("response_format", {}).get("type")
    for name, body in refused:
        if name in request or name == form:
            connection.answer("400 Bad Request", body)
            return
    good(connection)


# name: field (or response_format's type), the body of its refusal
for name, refused in {
    "f21_max_tokens": [("max_tokens", error(
        "Unsupported parameter: 'max_tokens' is not supported with this model. Use "
        "'max_completion_tokens' instead.", param="max_tokens", code="unsupported_parameter"))],
    "f21_temperature": [("temperature", error(
        "Unsupported value: 'temperature' does not support 0.3 with this model.",
        param="temperature", code="unsupported_value"))],
    "f21_response_format": [("json_schema", error(
        "Invalid parameter: 'response_format' of type 'json_schema' is not supported with this "
        "model.", param="response_format"))],
    "f21_no_form": [
        ("json_schema", error("'response_format.type' must be 'text'")),
        ("json_object", error("'response_format.type' must be 'json_schema' or 'text'"))],
    "f21_seed": [("seed", {"object": "error", "message": {"detail": [
        {"type": "extra_forbidden", "loc": ["body", "seed"],
         "msg": "Extra inputs are not permitted"}]}})],
    "f21_grammar": [("json_schema", error(
        "Failed to parse grammar", code=400, type="invalid_request_error"))],
}.items():
    named(name, lambda connection, number, refused=refused: refuse(connection, refused))


@scenario
def f21_json_word(connection, number):
    request = connection.request()
    form = request.get("response_format", {}).get("type")
    said = any("json" in message["content"].lower() for message in request["messages"])
    if form == "json_schema":
        connection.answer("400 Bad Request", error("no", param="response_format.type"))
    elif form == "json_object" and not said:
        connection.answer("400 Bad Request", error(
            "'messages' must contain the word 'json' in some form, to use 'response_format' of "
            "type 'json_object'.", param="messages"))
    else:
        good(connection)


# ---- a key that comes back -----------------------------------------------------------------------


@scenario
def f23_401(connection, number):
    said = "Incorrect API key provided: %s. You can find yours at /account" % connection.key()
    connection.answer("401 Unauthorized", error(said, code="invalid_api_key"),
                      {"x-request-id": "req-" + connection.key()})


@scenario
def f49_echo(connection, number):
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
def f49_echo_reset(connection, number):
    connection.send(("HTTP/1.1 200 OK\r\nContent-Length: 9999\r\n\r\n" + connection.key()).encode())


# ---- chance --------------------------------------------------------------------------------------


@scenario
def unreliable(connection, number):
    """Fails two times of ten, by status and reset, and talks nonsense once; by the request's
    number, so that it repeats."""
    turn = number * 7 % 10
    if turn == 0:
        connection.answer("503 Busy", error("busy"))
    elif turn == 1:
        connection.reset()
    elif turn == 2:
        good(connection, content="no JSON here")
    else:
        good(connection)
