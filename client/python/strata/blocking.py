"""Asynchronous methods as blocking ones: a coroutine that never waits for anything but gRPC's blocking calls runs to its
end in one step."""
import functools
import inspect
import queue
import threading
import types
import typing
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Coroutine, Iterable, Iterator
from typing import Any, Concatenate, ParamSpec, TypeVar

import grpc

from strata import errors
from strata.connection import CONNECTING_S, Connection, Options, Pipe
from strata.methods import A, Q, StreamStream, StreamUnary, UnaryStream, UnaryUnary

P = ParamSpec("P")
T = TypeVar("T")
Made = TypeVar("Made")


def run(coroutine: Coroutine[Any, Any, T]) -> T:
    """What a coroutine over a BlockingConnection returns."""
    try:
        coroutine.send(None)
    except StopIteration as done:
        return typing.cast(T, done.value)
    coroutine.close()
    raise RuntimeError("a coroutine of a blocking connection waits for an event loop")


async def _next(stream: AsyncIterator[T]) -> T:
    return await stream.__anext__()


async def _close(stream: AsyncGenerator[Any, None]) -> None:
    await stream.aclose()


def iterate(stream: AsyncGenerator[T, None]) -> Iterator[T]:
    """What an asynchronous generator over a BlockingConnection yields; leaving it closes it."""
    try:
        while True:
            try:
                item = run(_next(stream))
            except StopAsyncIteration:
                return
            yield item
    finally:
        run(_close(stream))


def blocking(method: Callable[Concatenate[Any, P], Coroutine[Any, Any, T]]) -> Callable[Concatenate[Any, P], T]:
    """The same method of a class that holds the asynchronous object as `_asynchronous`."""
    @functools.wraps(method)
    def call(self: Any, /, *arguments: P.args, **named: P.kwargs) -> T:
        return run(method(self._asynchronous, *arguments, **named))

    return call


def blocking_made(method: Callable[Concatenate[Any, P], Coroutine[Any, Any, T]], make: Callable[[T], Made]) \
        -> Callable[Concatenate[Any, P], Made]:
    """The same of a method whose result is itself asynchronous: `make` makes it blocking."""
    @functools.wraps(method)
    def call(self: Any, /, *arguments: P.args, **named: P.kwargs) -> Made:
        return make(run(method(self._asynchronous, *arguments, **named)))

    setattr(call, "__signature__", inspect.signature(method).replace(return_annotation=make))
    return call


def blocking_stream(method: Callable[Concatenate[Any, P], AsyncGenerator[T, None]]) \
        -> Callable[Concatenate[Any, P], Iterator[T]]:
    """The same of an asynchronous generator: a generator."""
    @functools.wraps(method)
    def call(self: Any, /, *arguments: P.args, **named: P.kwargs) -> Iterator[T]:
        return iterate(method(self._asynchronous, *arguments, **named))

    signature = inspect.signature(method)
    items = types.GenericAlias(Iterator, typing.get_args(signature.return_annotation)[:1])
    setattr(call, "__signature__", signature.replace(return_annotation=items))
    return call


class _QueuedRequests(Pipe[Q]):
    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Q | None] = queue.SimpleQueue()
        self._requests = iter(self._queue.get, None)

    @property
    def requests(self) -> Any:
        return self._requests

    def put(self, request: Q) -> None:
        self._queue.put(request)

    def end(self) -> None:
        self._queue.put(None)


class BlockingConnection(Connection):
    """Calls that block their thread. Thread-safe."""

    def __init__(self, options: Options) -> None:
        self._credentials = options.credentials()
        super().__init__(options, self._open(options.address(), options.channel_options()))
        self._closed = threading.Event()
        try:
            grpc.channel_ready_future(self.channel).result(timeout=options.connect_timeout)
        except grpc.FutureTimeoutError:
            self.channel.close()
            raise options.nobody_answers() from None

    def _open(self, address: str, arguments: list[tuple[str, Any]]) -> Any:
        return (grpc.secure_channel(address, self._credentials, arguments) if self._credentials
                else grpc.insecure_channel(address, arguments))

    def _channel_to(self, address: str) -> Any:
        return self._open(address, self.options.channel_options(named=True))

    async def _connects(self, channel: Any) -> bool:
        try:
            grpc.channel_ready_future(channel).result(timeout=CONNECTING_S)
        except grpc.FutureTimeoutError:
            return False
        return True

    async def close(self) -> None:
        self._closed.set()
        for channel in (self.channel, *self._owners.values()):
            channel.close()

    def _answer(self, method: Any, request: Any) -> Any:
        try:
            return self.here(method)(request, timeout=self.options.timeout, metadata=self.metadata)
        except grpc.RpcError as error:
            raise errors.from_rpc(error) from None

    async def attempt(self, method: UnaryUnary[Q, A], request: Q) -> A:
        return typing.cast(A, self._answer(method, request))

    async def send(self, method: StreamUnary[Q, A], requests: Iterable[Q]) -> A:
        return typing.cast(A, self._answer(method, iter(requests)))

    async def _answers(self, method: Any, request: Any, timeout: float | None) -> AsyncGenerator[Any, None]:
        call = self.here(method)(request, timeout=timeout, metadata=self.metadata)
        try:
            for answer in call:
                yield answer
        except grpc.RpcError as error:
            raise errors.from_rpc(error) from None
        finally:
            call.cancel()

    def stream(self, method: UnaryStream[Q, A], request: Q, *, endless: bool = False) -> AsyncGenerator[A, None]:
        return self._answers(method, request, None if endless else self.options.timeout)

    def pipe(self, method: StreamStream[Q, A]) -> tuple[Pipe[Q], AsyncGenerator[A, None]]:
        pipe: Pipe[Q] = _QueuedRequests()
        return pipe, self._answers(method, pipe.requests, None)

    async def sleep(self, seconds: float) -> bool:
        return self._closed.wait(seconds)

    async def work(self, function: Callable[[], T]) -> T:
        return function()
