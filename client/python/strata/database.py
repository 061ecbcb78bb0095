"""A server of maps."""
import os
from types import TracebackType
from typing import Any

from strata import aio
from strata.blocking import BlockingConnection, blocking, blocking_made
from strata.connection import Options
from strata.map import Map


def connect(target: str = "127.0.0.1:50051", *, token: str | None = None,
            ca: str | os.PathLike[str] | bool | None = None, certificate: str | os.PathLike[str] | None = None,
            key: str | os.PathLike[str] | None = None, timeout: float | None = None,
            patience: float = 60.0) -> "Database":
    """The Database at target, HOST:PORT. A context manager: leaving it closes the connection.

    target: several HOST:PORT with commas between them are servers on one store: calls go to one after the other, and to the
    next where one is gone or has not the map. Names are looked up once; with TLS all show a certificate for the first.
    token: the bearer token that the server's owner gave you. Without TLS anybody on the way can read it.
    ca: file of the root certificates to trust, PEM, or True for those of the system; None: no TLS.
    certificate, key: files of this client's own certificate and its key, PEM, for servers that ask for it.
    timeout: seconds that a single call may take, uploads and this one included; None: as long as it takes.
    patience: seconds for which a call that may be repeated puts up with a server that is away or busy.

    Raises Unavailable if nobody answers within ten seconds, or `timeout`.
    """
    return Database(aio.Database(BlockingConnection(Options(target, token, ca, certificate, key, timeout, patience))))


class Database:
    """Thread-safe."""

    def __init__(self, asynchronous: aio.Database) -> None:
        self._asynchronous = asynchronous

    def __enter__(self) -> "Database":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    @property
    def channel(self) -> Any:
        """gRPC's channel, for the stubs of strata.v1; calls on it carry no token by themselves."""
        return self._asynchronous.channel

    create_map = blocking_made(aio.Database.create_map, Map)
    map = blocking_made(aio.Database.map, Map)
    close = blocking(aio.Database.close)
    maps = blocking(aio.Database.maps)
    delete_map = blocking(aio.Database.delete_map)
