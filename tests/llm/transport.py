"""Scenarios of the faulty server below HTTP, and of redirects and proxies: 4 to 9, 11, 12, 14, 15
(1, 2, 3, 10 and 13 need no scenario). See scenarios.py."""

import gzip
import json
import time

from answers import completion, good, named, scenario


@scenario
def f04_reset(connection, number):
    connection.reset()


@scenario
def f05_reset_in_body(connection, number):
    connection.head("200 OK", {"Content-Type": "application/json", "Content-Length": 1000})
    connection.send(b'{"id": "half')
    time.sleep(0.05)  # a reset may overtake what was sent
    connection.reset()


@scenario
def f06_silent(connection, number):
    connection.hold()


@scenario
def f07_slow_headers(connection, number):
    connection.trickle(b"HTTP/1.1 200 OK\r\nX-Long: " + b"x" * 10000, 0.05)


@scenario
def f07_endless_headers(connection, number):
    connection.send(b"HTTP/1.1 200 OK\r\n")
    while True:
        connection.send(b"X-More: " + b"y" * 1000 + b"\r\n")


@scenario
def f07_endless_interim(connection, number):
    while True:
        connection.send(b"HTTP/1.1 100 Continue\r\n\r\n" * 20)


@scenario
def f08_slow_body(connection, number):
    body = json.dumps(completion()).encode()
    connection.head("200 OK", {"Content-Type": "application/json", "Content-Length": len(body)})
    connection.trickle(body, 1.0)


@scenario
def f09_length_too_long(connection, number):
    body = json.dumps(completion()).encode()
    connection.answer("200 OK", body, {"Content-Length": len(body) + 10})


@scenario
def f09_length_too_short(connection, number):
    body = json.dumps(completion()).encode()
    connection.answer("200 OK", body, {"Content-Length": len(body) - 10})


@scenario
def f09_broken_chunks(connection, number):
    connection.head("200 OK", {"Content-Type": "application/json", "Transfer-Encoding": "chunked"})
    connection.send(b"10\r\n0123456789abcdef\r\nnot a length\r\nxx\r\n")


@scenario
def f09_chunks_break_off(connection, number):
    connection.head("200 OK", {"Content-Type": "application/json", "Transfer-Encoding": "chunked"})
    connection.send(b"ffff\r\n{")


def no_http(connection, number):
    connection.send(b"\x00\x01\x02 this is not HTTP\r\n\r\n")


named("f09_no_http", no_http)


@scenario
def f14_gzip_bomb(connection, number):
    packed = gzip.compress(b'{"a": "' + b" " * (64 << 20) + b'"}', 6)
    connection.answer("200 OK", packed, {"Content-Encoding": "gzip"})


@scenario
def f14_gzip(connection, number):
    packed = gzip.compress(json.dumps(completion()).encode())
    connection.answer("200 OK", packed, {"Content-Encoding": "gzip"})


@scenario
def f14_wrong_encoding(connection, number):
    connection.answer("200 OK", completion(), {"Content-Encoding": "gzip"})


@scenario
def f15_large_body(connection, number):
    connection.head("200 OK", {"Content-Type": "application/json", "Content-Length": 100 << 20})
    for _ in range(100):
        connection.send(b"x" * (1 << 20))


@scenario
def f15_endless_body(connection, number):
    connection.head("200 OK", {"Content-Type": "application/json", "Transfer-Encoding": "chunked"})
    while True:
        connection.send(b"4000\r\n" + b"x" * 0x4000 + b"\r\n")


def stream(connection, events, pause):
    connection.head("200 OK", {"Content-Type": "text/event-stream"})
    for _ in range(events):
        connection.send(b'data: {"choices": [{"delta": {"content": "a"}}]}\n\n')
        time.sleep(pause)


named("f15_endless_events", lambda connection, number: stream(connection, 10 ** 9, 0.01))
named("f15_events", lambda connection, number: stream(connection, 3, 0))


# ---- redirects and proxies: 11, 12 ---------------------------------------------------------------

TARGET = "/f11_target/v1/chat/completions"


def redirect(connection, status, place):
    connection.answer("%d Moved" % status, b"", {"Location": place})


for code in (301, 302, 303, 307, 308):
    named("f11_redirect_%d" % code, lambda connection, number, code=code: redirect(
        connection, code, "http://" + connection.headers["host"] + TARGET))


@scenario
def f11_redirect_host(connection, number):
    port = connection.headers["host"].split(":")[1]
    redirect(connection, 307, "http://localhost:%s%s" % (port, TARGET))


@scenario
def f11_redirect_loop(connection, number):
    redirect(connection, 308, "/f11_redirect_loop/v1/chat/completions")


named("f11_target", lambda connection, number: good(connection))
PAGE = b"<!DOCTYPE html>\n<html><head><title>502 Bad Gateway</title></head></html>\n"


def page(connection, status):
    connection.answer(status, PAGE, {"Content-Type": "text/html"})


named("f12_proxy_page", lambda connection, number: page(connection, "502 Bad Gateway"))
named("f12_proxy_login", lambda connection, number: page(connection, "200 OK"))
