"""The channel to a server, and calls that are made again while it is away or busy."""
import random
import threading
import time

import grpc

from strata import errors

_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.1, 5.0
_CONNECT_TIMEOUT_S = 10.0
_SYSTEM_ROOTS = "/etc/ssl/certs/ca-certificates.crt"
_CHANNEL_OPTIONS = [
    ("grpc.max_receive_message_length", 64 << 20),
    ("grpc.max_reconnect_backoff_ms", 1000),
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.enable_retries", 0),  # Backoff repeats; beside it, gRPC 1.51's own lost a call made while a server ended
    ("grpc.primary_user_agent", "strata-python"),
]


class Backoff:
    """Pauses between the attempts of one call, until `patience` seconds have passed since its first failure or the
    event `closed` is set."""

    def __init__(self, patience, closed):
        self._patience = patience
        self._closed = closed
        self._pause = _FIRST_PAUSE_S
        self._until = None

    def wait(self, failure):
        """Sleeps if `failure` may be gone after a while; raises it otherwise."""
        busy = isinstance(failure, errors.ResourceExhausted) and failure.retry_delay is not None
        # A server that ends cancels what comes in last.
        gone = isinstance(failure, (errors.Unavailable, errors.Cancelled))
        if self._closed.is_set() or not (busy or gone):
            raise failure
        now = time.monotonic()
        self._until = self._until or now + self._patience
        pause = max(self._pause * random.uniform(0.5, 1.0), failure.retry_delay or 0.0)
        if now + pause > self._until:
            raise failure
        if self._closed.wait(pause):
            raise failure
        self._pause = min(2 * self._pause, _LONGEST_PAUSE_S)


def _read(path):
    with open(path, "rb") as file:
        return file.read()


def open_channel(target, ca, certificate, key):
    if ca is None:
        if certificate is not None or key is not None:
            raise ValueError("certificate and key are for TLS: name the roots to trust as ca")
        return grpc.insecure_channel(target, _CHANNEL_OPTIONS)
    if (certificate is None) != (key is None):
        raise ValueError("certificate and key go together: one of them is missing")
    credentials = grpc.ssl_channel_credentials(
        None if ca is True else _read(ca), _read(key) if key else None, _read(certificate) if certificate else None)
    return grpc.secure_channel(target, credentials, _CHANNEL_OPTIONS)


class Connection:
    """Calls on one channel. Thread-safe."""

    def __init__(self, target, *, token=None, ca=None, certificate=None, key=None, timeout=None, patience=60.0):
        self._program = [target, token, ca, certificate, key]
        self._metadata = (("authorization", f"Bearer {token}"),) if token else ()
        self._timeout = timeout
        self._patience = patience
        self._closed = threading.Event()
        self.channel = open_channel(target, ca, certificate, key)
        connect_timeout = min(_CONNECT_TIMEOUT_S, timeout or _CONNECT_TIMEOUT_S)
        try:
            grpc.channel_ready_future(self.channel).result(timeout=connect_timeout)
        except grpc.FutureTimeoutError:
            self.channel.close()
            raise errors.Unavailable(f"no server answers at {target} within {connect_timeout:g} s; "
                                     "is stratad running there, with or without TLS as here?") from None

    def program_options(self):
        """What makes the program `strata` speak to the same server as the same user: options, and its environment."""
        target, token, ca, certificate, key = self._program
        files = {"--tls-ca": _SYSTEM_ROOTS if ca is True else ca, "--tls-cert": certificate, "--tls-key": key}
        options = ["--server", target]
        for option, file in files.items():
            options += [option, str(file)] if file else []
        # Whoever gave a token here without TLS has accepted that it can be read.
        options += ["--insecure"] if token and ca is None else []
        return options, {"STRATA_TOKEN": token} if token else {}

    def close(self):
        """Ends all calls, with Cancelled."""
        self._closed.set()
        self.channel.close()

    def new_backoff(self):
        return Backoff(self._patience, self._closed)

    def once(self, method, request):
        """One attempt of a call with one answer; `request` is a message, or an iterator of messages."""
        try:
            return method(request, timeout=self._timeout, metadata=self._metadata)
        except grpc.RpcError as error:
            raise errors.from_rpc(error) from None

    def repeated(self, attempt):
        """What attempt() returns, which is made again after trouble that may pass."""
        backoff = self.new_backoff()
        while True:
            try:
                return attempt()
            except errors.StrataError as failure:
                backoff.wait(failure)

    def unary(self, method, request):
        return self.repeated(lambda: self.once(method, request))

    def stream(self, method, request, *, endless=False):
        """Generator over the answers of one attempt; leaving it ends the call. `endless`: no timeout."""
        call = method(request, timeout=None if endless else self._timeout, metadata=self._metadata)
        try:
            yield from call
        except grpc.RpcError as error:
            raise errors.from_rpc(error) from None
        finally:
            call.cancel()

    def collected(self, method, request):
        """All answers of a stream."""
        return self.repeated(lambda: list(self.stream(method, request)))
