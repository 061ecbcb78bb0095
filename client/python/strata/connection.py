"""Calls on a channel to a server, made again while it is away or busy. Everything here is asynchronous in form; whether a
call blocks the thread or the task is settled by two small classes below Connection: strata.blocking.BlockingConnection and
strata.aio.connection.AsyncioConnection. See docs/decisions/0203."""
import abc
import dataclasses
import os
import random
import socket
import time
from collections.abc import AsyncGenerator, Awaitable, Callable, Iterable
from typing import Any, Protocol, TypeVar

import grpc

from strata import errors, routes
from strata.methods import A, Q, StreamStream, StreamUnary, UnaryStream, UnaryUnary

T = TypeVar("T")

_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.1, 5.0
_NEXT_SERVER_S = 0.001
CONNECTING_S, _AWAY_S = 2.0, 5.0  # a server that was named; its name may mean nothing here
_CONNECT_TIMEOUT_S = 10.0
_SYSTEM_ROOTS = "/etc/ssl/certs/ca-certificates.crt"
_MAX_MESSAGE_BYTES = 64 << 20
CHANNEL_OPTIONS = [
    ("grpc.max_receive_message_length", _MAX_MESSAGE_BYTES),
    ("grpc.max_reconnect_backoff_ms", 1000),
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.enable_retries", 0),  # Backoff repeats; beside it, gRPC 1.51's own lost a call made while a server ended
    ("grpc.primary_user_agent", "strata-python"),
    # A machine that lost its power says nothing: a server is asked after so long, and then given up.
    ("grpc.keepalive_time_ms", 20_000),
    ("grpc.keepalive_timeout_ms", 10_000),
    ("grpc.http2.max_pings_without_data", 0),
]


def is_passing(failure: errors.StrataError) -> bool:
    """The same call may succeed after a while."""
    busy = isinstance(failure, errors.ResourceExhausted) and failure.retry_delay is not None
    # A server that ends cancels what comes in last.
    return busy or isinstance(failure, (errors.Unavailable, errors.Cancelled))


class Backoff:
    """Pauses between the attempts of one call, until `patience` seconds have passed since its first failure. `servers`: that
    may have what one has not."""

    def __init__(self, patience: float, servers: int = 1) -> None:
        self._patience = patience
        self._servers = servers
        self._elsewhere = 0  # servers in a row that had not the map
        self._pause = _FIRST_PAUSE_S
        self._until: float | None = None

    def note_server_named(self) -> None:
        """The next attempt goes to a server that the one before has named."""
        self._servers = max(self._servers, 2)

    def next_pause(self, failure: errors.StrataError) -> float:
        """Seconds to wait if `failure` may be gone then; raises it otherwise."""
        if not is_passing(failure):
            raise failure
        # Calls go round the servers, those of other threads too: twice round finds the one that has it.
        if failure.owner is not None and self._elsewhere < 2 * (self._servers - 1):
            self._elsewhere += 1
            return _NEXT_SERVER_S
        self._elsewhere = 0
        now = time.monotonic()
        self._until = self._until or now + self._patience
        pause = max(self._pause * random.uniform(0.5, 1.0), failure.retry_delay or 0.0)
        if now + pause > self._until:
            raise failure
        self._pause = min(2 * self._pause, _LONGEST_PAUSE_S)
        return pause


def _ipv4_of(server: str) -> str:
    """The first IPv4 address of HOST:PORT, with its port."""
    host, colon, port = server.rpartition(":")
    if not (host and colon and port.isdigit()):
        raise ValueError(f"server {server!r}; expected HOST:PORT, of several servers with commas between them")
    try:
        found = socket.getaddrinfo(host, None, socket.AF_INET, socket.SOCK_STREAM)
    except OSError:
        raise errors.Unavailable(f"no IPv4 address is known of {server}") from None
    return f"{found[0][4][0]}:{port}"


def _read(path: str | os.PathLike[str]) -> bytes:
    with open(path, "rb") as file:
        return file.read()


@dataclasses.dataclass(frozen=True)
class Options:
    """How to reach a server, as strata.connect describes it."""

    target: str
    token: str | None = None
    ca: str | os.PathLike[str] | bool | None = None
    certificate: str | os.PathLike[str] | None = None
    key: str | os.PathLike[str] | None = None
    timeout: float | None = None
    patience: float = 60.0

    @property
    def servers(self) -> list[str]:
        return self.target.split(",")

    def address(self) -> str:
        """The target as gRPC takes it: names of several servers are looked up, which takes its time."""
        return self.target if len(self.servers) == 1 else "ipv4:" + ",".join(map(_ipv4_of, self.servers))

    def channel_options(self, named: bool = False) -> list[tuple[str, Any]]:
        """`named`: of a server that one of the target has named. With TLS all show a certificate for the first."""
        options = [*CHANNEL_OPTIONS]
        if len(self.servers) > 1:
            options.append(("grpc.lb_policy_name", "round_robin"))
        if (named or len(self.servers) > 1) and self.ca not in (None, False):
            options.append(("grpc.ssl_target_name_override", self.servers[0].rpartition(":")[0]))
        return options

    def may_go_to(self, owner: str) -> bool:
        """Whether a server that was named is asked: several servers are asked in their turn, a name may be no address, and
        a token goes in plain text to nobody who was not given it."""
        host, _, port = owner.rpartition(":")
        secret = self.token is not None and self.ca in (None, False) and host not in ("localhost", "127.0.0.1", "[::1]")
        return len(self.servers) == 1 and bool(host) and port.isdigit() and 0 < int(port) < 65536 and not secret

    def credentials(self) -> Any:
        """Of a TLS channel; None: no TLS."""
        if self.ca is None or self.ca is False:
            if self.certificate is not None or self.key is not None:
                raise ValueError("certificate and key are for TLS: name the roots to trust as ca")
            return None
        if (self.certificate is None) != (self.key is None):
            raise ValueError("certificate and key go together: one of them is missing")
        return grpc.ssl_channel_credentials(
            None if self.ca is True else _read(self.ca), _read(self.key) if self.key else None,
            _read(self.certificate) if self.certificate else None)

    @property
    def connect_timeout(self) -> float:
        """Seconds."""
        return min(_CONNECT_TIMEOUT_S, self.timeout or _CONNECT_TIMEOUT_S)

    def nobody_answers(self) -> errors.Unavailable:
        return errors.Unavailable(f"no server answers at {self.target} within {self.connect_timeout:g} s; "
                                  "is stratad running there, with or without TLS as here?")


Sent = TypeVar("Sent", contravariant=True)


class Pipe(Protocol[Sent]):
    """Requests of a stream, given one by one."""

    @property
    def requests(self) -> Any:
        """What gRPC takes as the requests."""

    def put(self, request: Sent) -> None: ...

    def end(self) -> None: ...


class Connection(abc.ABC):
    """Calls on one channel. Methods of stubs go in, and messages; StrataErrors come out."""

    def __init__(self, options: Options, channel: Any) -> None:
        self.options = options
        self.channel = channel
        self.stubs = routes.RoutedChannel(channel)
        """What stubs are made with."""
        self._owners: dict[str, Any] = {}  # channels to servers that were named
        self._answered: set[str] = set()  # those that have taken a connection
        self._away: dict[str, float] = {}  # until when those that did not answer are left alone
        self._owner: str | None = None  # to whom calls go; None: to the connection's own
        self.metadata = (("authorization", f"Bearer {options.token}"),) if options.token else ()

    @abc.abstractmethod
    def _channel_to(self, address: str) -> Any:
        """A channel to one more server."""

    def here(self, method: Any) -> Any:
        """gRPC's callable of a stub's method, where calls go now."""
        return method.on(self._owners.get(self._owner) if self._owner else None)

    @abc.abstractmethod
    async def _connects(self, channel: Any) -> bool:
        """Whether somebody answers on a channel within CONNECTING_S."""

    async def _follow(self, failure: errors.StrataError, backoff: Backoff) -> None:
        """To the server that has the map, if `failure` names it, and back from one that is away."""
        if self._owner is not None and failure.owner is None:
            self._away[self._owner] = time.monotonic() + _AWAY_S
        owner, self._owner = failure.owner, None
        if owner is None or not self.options.may_go_to(owner) or time.monotonic() < self._away.get(owner, 0):
            return
        if owner not in self._owners:
            self._owners[owner] = self._channel_to(owner)
        if owner not in self._answered and not await self._connects(self._owners[owner]):
            self._away[owner] = time.monotonic() + _AWAY_S
            return
        self._answered.add(owner)
        self._owner = owner
        backoff.note_server_named()

    @abc.abstractmethod
    async def attempt(self, method: UnaryUnary[Q, A], request: Q) -> A:
        """One attempt of a call."""

    @abc.abstractmethod
    async def send(self, method: StreamUnary[Q, A], requests: Iterable[Q]) -> A:
        """One attempt of a call with many requests."""

    @abc.abstractmethod
    def stream(self, method: UnaryStream[Q, A], request: Q, *, endless: bool = False) -> AsyncGenerator[A, None]:
        """The answers of one attempt; leaving it ends the call. `endless`: no timeout."""

    @abc.abstractmethod
    def pipe(self, method: StreamStream[Q, A]) -> tuple[Pipe[Q], AsyncGenerator[A, None]]:
        """Requests and answers of one attempt, without timeout."""

    @abc.abstractmethod
    async def sleep(self, seconds: float) -> bool:
        """Whether the connection was closed meanwhile."""

    @abc.abstractmethod
    async def work(self, function: Callable[[], T]) -> T:
        """What a function returns that may take its time."""

    @abc.abstractmethod
    async def close(self) -> None:
        """Ends all calls, with Cancelled."""

    def new_backoff(self) -> Backoff:
        return Backoff(self.options.patience, len(self.options.servers))

    async def wait(self, backoff: Backoff, failure: errors.StrataError) -> None:
        """Sleeps until the next attempt; raises `failure` if there should be none."""
        await self._follow(failure, backoff)
        if await self.sleep(backoff.next_pause(failure)):
            raise failure

    async def repeated(self, attempt: Callable[[], Awaitable[T]]) -> T:
        """What attempt() returns, which is made again after trouble that may pass."""
        backoff = self.new_backoff()
        while True:
            try:
                return await attempt()
            except errors.StrataError as failure:
                await self.wait(backoff, failure)

    async def where_the_map_is(self, attempt: Callable[[], Awaitable[T]]) -> T:
        """What attempt() returns, which is made again only where another server has the map: nothing has happened then."""
        backoff = self.new_backoff()
        while True:
            try:
                return await attempt()
            except errors.StrataError as failure:
                if failure.owner is None:
                    raise
                await self.wait(backoff, failure)

    async def once(self, method: UnaryUnary[Q, A], request: Q) -> A:
        """A call that must not happen twice."""
        return await self.where_the_map_is(lambda: self.attempt(method, request))

    async def unary(self, method: UnaryUnary[Q, A], request: Q) -> A:
        return await self.repeated(lambda: self.attempt(method, request))

    async def collected(self, method: UnaryStream[Q, A], request: Q) -> list[A]:
        """All answers of a stream."""
        async def attempt() -> list[A]:
            return [answer async for answer in self.stream(method, request)]

        return await self.repeated(attempt)

    def program_options(self) -> tuple[list[str], dict[str, str]]:
        """What makes the program `strata` speak to the same server as the same user: options, and its environment."""
        of = self.options
        files = {"--tls-ca": _SYSTEM_ROOTS if of.ca is True else of.ca, "--tls-cert": of.certificate, "--tls-key": of.key}
        options = ["--server", of.target]
        for option, file in files.items():
            options += [option, str(file)] if file else []
        # Whoever gave a token here without TLS has accepted that it can be read.
        options += ["--insecure"] if of.token and of.ca is None else []
        return options, {"STRATA_TOKEN": of.token} if of.token else {}
