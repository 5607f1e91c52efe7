#!/usr/bin/env python3
"""A language model's server that misbehaves on purpose: a request of /NAME/v1/chat/completions, or
of another path below /NAME, plays the scenario NAME of scenarios.py. It listens on the loopback
interface only, on ports that the system chooses, prints them as one line of JSON, and ends when its
standard input does: with its parent. With a folder as its argument it also speaks TLS, with
certificates that it writes there.

GET /_counts answers { name: { requests, keys } }: how many requests a scenario had, and how many of
them carried a key. GET /_names answers all names.
"""

import http.server
import json
import os
import socket
import ssl
import struct
import subprocess
import sys
import threading
import time
import urllib.parse

sys.dont_write_bytecode = True  # the source tree stays as it is

import scenarios

LOOPBACK = "127.0.0.1"
PATIENCE = 60  # s: no connection outlives it

lock = threading.Lock()
counts = {}


class Handler(http.server.BaseHTTPRequestHandler):
    """One connection with one request."""

    timeout = PATIENCE

    def log_message(self, *_):
        """Standard error is for this server's own faults."""

    def name(self):
        """The first part of the path; a proxy is asked for a whole URL."""
        return urllib.parse.urlsplit(self.path).path.strip("/").split("/")[0]

    def do_GET(self):
        """Answers what the tests ask about the server, or plays a scenario."""
        with lock:
            facts = {"_counts": counts, "_names": sorted(scenarios.ALL)}.get(self.name())
        if facts is None:
            self.do_POST()
        else:
            self.connection.sendall(scenarios.answer("200 OK", facts))

    def do_POST(self):
        """Plays a scenario."""
        bearer = self.headers.get("authorization", "").replace("Bearer ", "", 1)
        self.key = self.headers.get("api-key") or bearer
        self.host = self.headers["host"]
        self.body = self.rfile.read(int(self.headers.get("content-length", "0")))
        name = self.name()
        with lock:
            entry = counts.setdefault(name, {"requests": 0, "keys": 0})
            entry["requests"] += 1
            entry["keys"] += 1 if self.key else 0
            self.number = entry["requests"]
        missing = [scenarios.error("404 Not Found", "no scenario " + name)]
        try:
            for step in scenarios.ALL.get(name, lambda _: missing)(self):
                self.take(step)
        except OSError:  # the client has gone
            pass

    def take(self, step):
        """One step of a scenario."""
        if step == scenarios.HOLD:
            while self.connection.recv(65536):
                pass
        elif step == scenarios.RESET:
            self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER,
                                       struct.pack("ii", 1, 0))
            self.connection.close()
        elif isinstance(step, bytes):
            self.connection.sendall(step)
        else:
            time.sleep(step)


class Server(http.server.ThreadingHTTPServer):
    """Serves each connection on its own thread."""

    def handle_error(self, *_):
        """A handshake that failed, or a client that has gone."""


def listen(context=None):
    """A server on the loopback interface, with TLS where there is a context; returns its port."""
    server = Server((LOOPBACK, 0), Handler)
    if context:
        server.socket = context.wrap_socket(server.socket, server_side=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server.server_address[1]


def certificates(folder):
    """{ name: the file of a certificate that is signed by itself }."""
    names = {"expired": "IP:127.0.0.1", "good": "IP:127.0.0.1,DNS:localhost",
             "wrong_host": "DNS:elsewhere.example.org"}
    made = {name: os.path.join(folder, name + ".pem") for name in names}
    for name, path in made.items():
        for words in (
                ("req", "-new", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
                 "-nodes", "-subj", "/CN=limax test", "-addext", "subjectAltName=" + names[name],
                 "-keyout", path + ".key", "-out", path + ".csr"),
                ("x509", "-req", "-in", path + ".csr", "-signkey", path + ".key", "-out", path,
                 "-copy_extensions", "copy", "-days", "-1" if name == "expired" else "2")):
            subprocess.run(("openssl", *words), check=True, capture_output=True)
    return made


def main():
    """Prints the ports and serves until the parent ends."""
    refused = socket.socket()  # bound, but does not listen
    refused.bind((LOOPBACK, 0))
    ports = {"port": listen(), "refused": refused.getsockname()[1]}
    if len(sys.argv) > 1:
        try:
            ports["tls"], ports["certificates"] = {}, certificates(sys.argv[1])
            for name, path in ports["certificates"].items():
                context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
                context.load_cert_chain(path, path + ".key")
                ports["tls"][name] = listen(context)
        except (OSError, subprocess.CalledProcessError) as problem:
            ports["tls_missing"] = "openssl, which makes the certificates: %s" % problem
    print(json.dumps(ports), flush=True)
    sys.stdin.buffer.read()
    os._exit(0)


if __name__ == "__main__":
    main()
