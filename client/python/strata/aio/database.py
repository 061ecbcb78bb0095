"""A server of maps."""
import asyncio
import os
from collections.abc import Mapping
from types import TracebackType
from typing import Any

from strata import plan
from strata.aio.connection import AsyncioConnection
from strata.aio.map import Map
from strata.connection import Connection, Options
from strata.errors import AlreadyExists
from strata.v1 import maps_pb2, maps_pb2_grpc


async def connect(target: str = "127.0.0.1:50051", *, token: str | None = None,
                  ca: str | os.PathLike[str] | bool | None = None, certificate: str | os.PathLike[str] | None = None,
                  key: str | os.PathLike[str] | None = None, timeout: float | None = None,
                  patience: float = 60.0) -> "Database":
    """The Database at target, HOST:PORT or several with commas between them; as strata.connect, for `async with`."""
    options = Options(target, token, ca, certificate, key, timeout, patience)
    connection = AsyncioConnection(options, await asyncio.to_thread(options.address))
    await connection.ready()
    return Database(connection)


class Database:
    """An asynchronous context manager: leaving it closes the connection."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._stub = maps_pb2_grpc.MapsStub(connection.stubs)

    async def __aenter__(self) -> "Database":
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        trace: TracebackType | None) -> None:
        await self.close()

    @property
    def channel(self) -> Any:
        """gRPC's channel, for the stubs of strata.v1; calls on it carry no token by themselves."""
        return self._connection.channel

    async def close(self) -> None:
        """Ends all calls, with Cancelled."""
        await self._connection.close()

    async def create_map(self, name: str, *, cell_size: float | None = None, gap_size: float | None = None,
                         thickness: float | None = None, profile: Mapping[str, float] | None = None,
                         keep_points: bool = True, fade_after: int = 0, exist_ok: bool = False) -> Map:
        """A new, empty map.

        cell_size, gap_size, thickness: of its surfaces [m]; None: 0.1, 1 and 0.1. profile: {"radius": 0.3, …} of the
        robot whose traversability the tiles carry, see Map.plan. keep_points False: points are dropped once a scan is
        in the tiles. fade_after: later scans that must have looked through a place for what was there to fade by itself;
        0: nothing does. exist_ok: a map of that name is taken as it is. Raises AlreadyExists, InvalidArgument.
        """
        mls = {"cell_size_m": cell_size, "gap_size_m": gap_size, "thickness_m": thickness}
        parameters = maps_pb2.MapParameters(
            mls=maps_pb2.MlsParameters(**{field: value for field, value in mls.items() if value is not None}),
            default_profile=plan.profile_to_proto(profile or {}), keep_points=keep_points,
            fade_after=fade_after)
        request = maps_pb2.CreateMapRequest(name=name, parameters=parameters)
        call = self._connection.unary if exist_ok else self._connection.once
        try:
            await call(self._stub.Create, request)
        except AlreadyExists:
            if not exist_ok:
                raise
        return await self.map(name)

    async def map(self, name: str) -> Map:
        """The map of that name; NotFound."""
        answer = await self._connection.unary(self._stub.Get, maps_pb2.GetMapRequest(name=name))
        return Map(self._connection, name, answer.map.parameters.mls.cell_size_m)

    async def maps(self) -> list[str]:
        """Names of all maps, sorted."""
        answer = await self._connection.unary(self._stub.List, maps_pb2.ListMapsRequest())
        return [info.name for info in answer.maps]

    async def delete_map(self, name: str) -> None:
        """Deletes the map with all it holds, for good."""
        await self._connection.once(self._stub.Delete, maps_pb2.DeleteMapRequest(name=name))
