"""Calls that leave the event loop free."""
import asyncio
import typing
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Iterable
from typing import Any, TypeVar

import grpc
import grpc.aio

from strata import errors
from strata.connection import CONNECTING_S, Connection, Options, Pipe
from strata.methods import A, Q, StreamStream, StreamUnary, UnaryStream, UnaryUnary

T = TypeVar("T")


class _QueuedRequests(Pipe[Q]):
    def __init__(self) -> None:
        self._queue: asyncio.Queue[Q | None] = asyncio.Queue()

    @property
    def requests(self) -> Any:
        return self._taken()

    async def _taken(self) -> AsyncIterator[Q]:
        while (request := await self._queue.get()) is not None:
            yield request

    def put(self, request: Q) -> None:
        self._queue.put_nowait(request)

    def end(self) -> None:
        self._queue.put_nowait(None)


class AsyncioConnection(Connection):
    """Calls of the tasks of one event loop."""

    def __init__(self, options: Options, address: str) -> None:
        self._credentials = options.credentials()
        super().__init__(options, self._open(address, options.channel_options()))
        self._closed = asyncio.Event()
        self._calls: set[Any] = set()  # under way; gRPC 1.51 itself does not find all that it should end

    def _open(self, address: str, arguments: list[tuple[str, Any]]) -> Any:
        return (grpc.aio.secure_channel(address, self._credentials, arguments) if self._credentials
                else grpc.aio.insecure_channel(address, arguments))

    def _channel_to(self, address: str) -> Any:
        return self._open(address, self.options.channel_options(named=True))

    async def _connects(self, channel: Any) -> bool:
        try:
            await asyncio.wait_for(channel.channel_ready(), CONNECTING_S)
        except asyncio.TimeoutError:
            return False
        return True

    async def ready(self) -> None:
        """Waits for the server; Unavailable."""
        try:
            await asyncio.wait_for(self.channel.channel_ready(), self.options.connect_timeout)
        except asyncio.TimeoutError:
            await self.channel.close()
            raise self.options.nobody_answers() from None

    async def close(self) -> None:
        self._closed.set()
        for call in tuple(self._calls):
            call.cancel()
        for channel in (self.channel, *self._owners.values()):
            await channel.close()

    def _closed_by_us(self) -> bool:
        task = asyncio.current_task()
        return self._closed.is_set() and not (task and task.cancelling())

    async def _answer(self, method: Any, request: Any) -> Any:
        call = self.here(method)(request, timeout=self.options.timeout, metadata=self.metadata)
        self._calls.add(call)
        try:
            return await call
        except grpc.RpcError as error:
            raise errors.from_rpc(error) from None
        except asyncio.CancelledError:
            if self._closed_by_us():
                raise errors.Cancelled("the connection was closed") from None
            raise
        finally:
            self._calls.discard(call)

    async def attempt(self, method: UnaryUnary[Q, A], request: Q) -> A:
        return typing.cast(A, await self._answer(method, request))

    async def send(self, method: StreamUnary[Q, A], requests: Iterable[Q]) -> A:
        return typing.cast(A, await self._answer(method, iter(requests)))

    async def _answers(self, method: Any, request: Any, timeout: float | None) -> AsyncGenerator[Any, None]:
        call = self.here(method)(request, timeout=timeout, metadata=self.metadata)
        self._calls.add(call)
        try:
            async for answer in call:
                yield answer
        except grpc.RpcError as error:
            raise errors.from_rpc(error) from None
        except asyncio.CancelledError:
            if self._closed_by_us():
                raise errors.Cancelled("the connection was closed") from None
            raise
        finally:
            self._calls.discard(call)
            call.cancel()

    def stream(self, method: UnaryStream[Q, A], request: Q, *, endless: bool = False) -> AsyncGenerator[A, None]:
        return self._answers(method, request, None if endless else self.options.timeout)

    def pipe(self, method: StreamStream[Q, A]) -> tuple[Pipe[Q], AsyncGenerator[A, None]]:
        pipe: Pipe[Q] = _QueuedRequests()
        return pipe, self._answers(method, pipe.requests, None)

    async def sleep(self, seconds: float) -> bool:
        try:
            return await asyncio.wait_for(self._closed.wait(), seconds)
        except asyncio.TimeoutError:
            return False

    async def work(self, function: Callable[[], T]) -> T:
        return await asyncio.to_thread(function)
