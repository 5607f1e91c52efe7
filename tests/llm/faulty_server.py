#!/usr/bin/env python3
"""A language model's server that misbehaves on purpose: POST /NAME/v1/chat/completions plays the
scenario NAME of scenarios.py. It listens on the loopback interface only, on ports that the system
chooses, prints them as one line of JSON, and ends when its standard input does: with its parent.
With a folder as its argument it also speaks TLS, with certificates that it writes there.

GET /_counts answers { name: { requests, keys } }: how many requests a scenario had, and how many of
them carried a key. GET /_names answers all names.
"""

import json
import os
import socket
import struct
import sys
import threading
import time

sys.dont_write_bytecode = True  # the source tree stays as it is

import certificates
import scenarios

LOOPBACK = "127.0.0.1"
LONGEST_REQUEST = 4 << 20  # bytes
TLS_HANDSHAKE = 0x16  # the first byte of a TLS connection
PATIENCE = 60  # s: no connection outlives it

lock = threading.Lock()
counts = {}


class Closed(Exception):
    """The client has gone."""


class Connection:
    """One connection with one request."""

    def __init__(self, peer):
        self.peer = peer
        self.body = b""
        self.headers = {}
        peer.settimeout(PATIENCE)

    def read_request(self):
        """Reads a whole request; returns its method and path."""
        data = b""
        while b"\r\n\r\n" not in data:
            more = self.peer.recv(65536)
            if not more or len(data) > LONGEST_REQUEST:
                raise Closed
            data += more
            if data[0] == TLS_HANDSHAKE:
                self.answer("400 Bad Request", b"this port speaks no TLS")
                raise Closed
        head, self.body = data.split(b"\r\n\r\n", 1)
        lines = head.decode("latin-1").split("\r\n")
        for line in lines[1:]:
            name, _, value = line.partition(":")
            self.headers[name.strip().lower()] = value.strip()
        length = int(self.headers.get("content-length", "0"))
        while len(self.body) < length:
            more = self.peer.recv(65536)
            if not more:
                raise Closed
            self.body += more
        method, target, _ = lines[0].split(" ", 2)
        # a proxy is asked for a whole URL
        if "://" in target:
            target = "/" + target.split("://", 1)[1].partition("/")[2]
        return method, target

    def key(self):
        """The key that the client sent, "" where it sent none."""
        bearer = self.headers.get("authorization", "").replace("Bearer ", "", 1)
        return self.headers.get("api-key") or bearer

    def send(self, data):
        """Bytes as they are."""
        self.peer.sendall(data)

    def trickle(self, data, pause):
        """Bytes one by one, `pause` seconds apart."""
        for byte in data:
            self.send(bytes([byte]))
            time.sleep(pause)

    def head(self, status, headers):
        """The lines before a body."""
        lines = ["HTTP/1.1 %s" % status, "Connection: close"]
        lines += ["%s: %s" % pair for pair in headers.items()]
        self.send(("\r\n".join(lines) + "\r\n\r\n").encode("latin-1"))

    def answer(self, status, body, headers=None):
        """A whole answer; a body other than bytes is sent as JSON."""
        fields = {"Content-Type": "application/json"}
        if not isinstance(body, bytes):
            body = json.dumps(body).encode()
        fields["Content-Length"] = len(body)
        fields.update(headers or {})
        self.head(status, fields)
        self.send(body)

    def hold(self):
        """Sends nothing until the client closes the connection."""
        while self.peer.recv(65536):
            pass

    def reset(self):
        """Ends the connection with a reset."""
        self.peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))


def serve(peer):
    """Reads one request and plays its scenario."""
    connection = Connection(peer)
    try:
        method, target = connection.read_request()
        parts = target.split("?")[0].strip("/").split("/")
        if method == "GET" and parts[0] == "_counts":
            with lock:
                connection.answer("200 OK", counts)
            return
        if method == "GET" and parts[0] == "_names":
            connection.answer("200 OK", sorted(scenarios.ALL))
            return
        name = parts[0]
        with lock:
            entry = counts.setdefault(name, {"requests": 0, "keys": 0})
            entry["requests"] += 1
            entry["keys"] += 1 if connection.key() else 0
            number = entry["requests"]
        play = scenarios.ALL.get(name)
        if play is None:
            connection.answer("404 Not Found", {"error": {"message": "no scenario " + name}})
        else:
            play(connection, number)
    except (Closed, OSError):
        pass
    finally:
        try:
            peer.close()
        except OSError:
            pass


def accept(listener, wrap=None):
    """Serves each connection on its own thread; `wrap` starts TLS."""

    def begin(peer):
        try:
            serve(wrap(peer) if wrap else peer)
        except OSError:  # a handshake that failed
            peer.close()

    while True:
        peer, _ = listener.accept()
        threading.Thread(target=begin, args=(peer,), daemon=True).start()


def listen(wrap=None):
    """A listener on the loopback interface; returns its port."""
    listener = socket.create_server((LOOPBACK, 0), backlog=64)
    threading.Thread(target=accept, args=(listener, wrap), daemon=True).start()
    return listener.getsockname()[1]


KEPT = []  # sockets that stay open


def refuse():
    """A port that is bound and does not listen: connections are refused."""
    taken = socket.socket()
    taken.bind((LOOPBACK, 0))
    KEPT.append(taken)
    return taken.getsockname()[1]


def swallow(family, host, port):
    """A port whose queue is full: further connections are neither accepted nor refused."""
    listener = socket.socket(family)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind((host, port))
    listener.listen(0)
    KEPT.append(listener)
    for _ in range(4):
        waiting = socket.socket(family)
        waiting.setblocking(False)
        waiting.connect_ex(listener.getsockname()[:2])
        KEPT.append(waiting)
    return listener.getsockname()[1]


def main():
    ports = {
        "port": listen(),
        "refused": refuse(),
        "blackhole": swallow(socket.AF_INET, LOOPBACK, 0),
    }
    try:
        # the same port over IPv6 leads nowhere
        swallow(socket.AF_INET6, "::1", ports["port"])
        ports["ipv6"] = True
    except OSError as problem:
        ports["ipv6_missing"] = str(problem)
    if len(sys.argv) > 1:
        try:
            made = certificates.make(sys.argv[1])
            ports["tls"] = {name: listen(context) for name, context in made.items()}
            ports["ca_file"] = os.path.join(sys.argv[1], certificates.AUTHORITY)
        except certificates.Missing as problem:
            ports["tls_missing"] = str(problem)
    print(json.dumps(ports), flush=True)
    sys.stdin.buffer.read()
    os._exit(0)


if __name__ == "__main__":
    main()
