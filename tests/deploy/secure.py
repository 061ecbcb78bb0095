"""A stratad with TLS, tokens, metrics and a door for browsers, as deploy/README.md tells to make it."""
import os
import pathlib
import socket
import subprocess

import strata
from support import Stratad


def openssl(*arguments):
    subprocess.run(["openssl", *map(str, arguments)], check=True, capture_output=True)


def authority(folder, name):
    """A certificate authority of its own: its certificate."""
    openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "30", "-keyout",
            folder / f"{name}.key", "-out", folder / f"{name}.crt", "-subj", f"/CN={name}")
    return folder / f"{name}.crt"


def certificate(folder, ca, name):
    """A key and a certificate for this machine, by that authority."""
    key, made = folder / f"{name}.key", folder / f"{name}.crt"
    names = folder / "names"
    names.write_text("subjectAltName=DNS:localhost,IP:127.0.0.1")
    openssl("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout", key, "-out", folder / "csr",
            "-subj", "/CN=localhost")
    openssl("x509", "-req", "-in", folder / "csr", "-CA", ca, "-CAkey", ca.with_suffix(".key"), "-CAcreateserial", "-days", "2",
            "-out", made, "-extfile", names)
    return key, made


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


class SecureStratad:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.ca = authority(self.folder, "ca")
        self.key, self.certificate = certificate(self.folder, self.ca, "server")
        self.tokens = self.folder / "tokens"
        self.token = self.new_token("owner", "--right", "admin", "--all-maps")
        metrics = f"127.0.0.1:{free_port()}"
        self.metrics_url = f"http://{metrics}/metrics"
        self._server = Stratad(self.folder / "maps", "--tls-cert", self.certificate, "--tls-key", self.key, "--tokens", self.tokens,
                               "--metrics", metrics)
        self._server.start()
        self.address = self._server.address

    def token_command(self, verb, name, *arguments):
        return subprocess.run([os.environ["STRATA_STRATAD"], "token", verb, "--tokens", self.tokens, name, *arguments], check=True,
                              capture_output=True, text=True).stdout

    def new_token(self, name, *arguments):
        """Its secret."""
        return self.token_command("add", name, *arguments).split()[-1]

    def connect(self, token=None, ca=None, **options):
        return strata.connect(self.address, ca=ca or self.ca, token=token or self.token, **options)

    def stop(self):
        self._server.stop()
