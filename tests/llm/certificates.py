"""Certificates for the TLS scenarios, made by the program openssl in a folder that the caller
removes."""

import os
import shutil
import ssl
import subprocess

AUTHORITY = "authority.pem"


class Missing(Exception):
    """openssl is missing, or cannot do this."""


# for `openssl ca`; dates are on its command line
CONFIGURATION = """
[ca]
default_ca = own
[own]
database = {folder}/index.txt
new_certs_dir = {folder}
serial = {folder}/serial
default_md = sha256
policy = any
x509_extensions = names
unique_subject = no
[any]
commonName = supplied
[names]
subjectAltName = {names}
"""

# name: names in the certificate, from, to
SIGNED = {
    "good": ("IP:127.0.0.1,DNS:localhost", "20200101000000Z", "20990101000000Z"),
    "expired": ("IP:127.0.0.1,DNS:localhost", "20200101000000Z", "20200102000000Z"),
    "wrong_host": ("DNS:elsewhere.example.org", "20200101000000Z", "20990101000000Z"),
}


def _run(*words):
    done = subprocess.run(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, check=False)
    if done.returncode != 0:
        raise Missing("openssl: " + done.stdout.decode(errors="replace")[-300:])


def _context(folder, name):
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    base = os.path.join(folder, name)
    context.load_cert_chain(base + ".pem", base + ".key")
    return lambda peer: context.wrap_socket(peer, server_side=True)


def make(folder):
    """{ name: a function that begins TLS on a socket }: good, expired, wrong_host, self_signed."""
    program = shutil.which("openssl")
    if program is None:
        raise Missing("openssl, which makes the certificates, is missing")

    def path(name):
        return os.path.join(folder, name)

    key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes")
    own = (program, "req", "-x509", *key, "-days", "2")
    _run(*own, "-keyout", path("authority.key"), "-out", path(AUTHORITY),
         "-subj", "/CN=limax test authority", "-addext", "basicConstraints=critical,CA:TRUE")
    _run(*own, "-keyout", path("self_signed.key"), "-out", path("self_signed.pem"),
         "-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1")
    with open(path("index.txt"), "w", encoding="ascii"):
        pass
    with open(path("serial"), "w", encoding="ascii") as file:
        file.write("01\n")
    for name, (names, start, end) in SIGNED.items():
        with open(path(name + ".cnf"), "w", encoding="ascii") as file:
            file.write(CONFIGURATION.format(folder=folder, names=names))
        _run(program, "req", "-new", *key, "-keyout", path(name + ".key"),
             "-out", path(name + ".csr"), "-subj", "/CN=" + name)
        _run(program, "ca", "-batch", "-notext", "-config", path(name + ".cnf"),
             "-cert", path(AUTHORITY), "-keyfile", path("authority.key"),
             "-in", path(name + ".csr"), "-out", path(name + ".pem"),
             "-startdate", start, "-enddate", end)
    return {name: _context(folder, name) for name in ["self_signed", *SIGNED]}
