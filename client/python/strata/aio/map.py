"""One map: upload, fetch, plan, watch, jobs."""
import contextlib
import math
import os
import time

from strata import maps
from strata.aio.jobs import Jobs
from strata.aio.objects import Objects
from strata.aio.planning import Planning
from strata.aio.posegraph import PoseGraphCalls
from strata.aio.scans import Scans
from strata.aio.surfaces import Surfaces
from strata.v1 import maps_pb2


class Map(Scans, Surfaces, Planning, Objects, PoseGraphCalls, Jobs):
    """A map on a server; made by Database.map and Database.create_map. Of one event loop."""

    def __repr__(self) -> str:
        return f"<strata.aio.Map {self.name}>"

    async def stats(self) -> maps.Stats:
        """Stats of the current epoch."""
        answer = await self._connection.unary(self._maps.Stats, maps_pb2.GetMapStatsRequest(name=self.name))
        return maps.stats_from_proto(answer.stats)

    async def history(self) -> list[maps.Epoch]:
        """The map's Epochs, newest first."""
        answer = await self._connection.unary(self._maps.History, maps_pb2.GetMapHistoryRequest(name=self.name))
        return [maps.epoch_from_proto(epoch) for epoch in answer.epochs]

    async def classes(self) -> list[maps.MapClass]:
        """What labels mean: the MapClasses that have a name, by id."""
        answer = await self._connection.unary(self._maps.ListClasses, maps_pb2.ListMapClassesRequest(name=self.name))
        return [maps.class_from_proto(one) for one in answer.classes]

    async def set_class(self, id: int, name: str, rgb: tuple[int, int, int]) -> None:  # noqa: A002, as in MapClass
        """Names a class, or gives it another name or colour (0 to 255). AlreadyExists: another id has the name."""
        red, green, blue = bytes(rgb)
        message = maps_pb2.MapClass(id=id, name=name, colour=red << 16 | green << 8 | blue)
        await self._connection.unary(self._maps.SetClass, maps_pb2.SetMapClassRequest(name=self.name, map_class=message))

    async def backup(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Writes the map's file as it is now to `path`, checked, all at once; uploads go on meanwhile.

        force: replaces what is there; else FileExistsError. Raises DataLoss if it came damaged, OSError of the disk.
        """
        request = maps_pb2.BackupMapRequest(name=self.name)
        with maps.backup_file(path, force) as file:
            async def attempt() -> None:
                async with contextlib.aclosing(self._connection.stream(self._maps.Backup, request)) as answers:
                    async for answer in answers:
                        file.write(answer)

            await self._connection.where_the_map_is(attempt)

    async def origin(self) -> tuple[float, float, float] | None:
        """Where the map's origin is on earth (WGS 84): (latitude [°], longitude [°], altitude [m]); None: not said."""
        answer = await self._connection.unary(self._maps.Get, maps_pb2.GetMapRequest(name=self.name))
        return maps.origin_from_proto(answer.map.parameters)

    async def set_origin(self, latitude: float, longitude: float, altitude: float) -> None:
        """Says where the map's origin is on earth [°, °, m], x pointing east and y north; its coordinates stay.

        Raises InvalidArgument for a place that is not on earth.
        """
        origin = maps_pb2.GeodeticOrigin(latitude_rad=math.radians(latitude), longitude_rad=math.radians(longitude),
                                         altitude_m=altitude)
        await self._connection.unary(self._maps.SetOrigin, maps_pb2.SetMapOriginRequest(name=self.name, origin=origin))

    async def wait(self, timeout: float | None = None) -> maps.Stats:
        """Returns Stats once every scan is integrated or has failed; TimeoutError after `timeout` seconds."""
        until = math.inf if timeout is None else time.monotonic() + timeout
        pause = 0.01
        while (stats := await self.stats()).scans_pending:
            if time.monotonic() > until:
                raise TimeoutError(f"{stats.scans_pending} scans are not integrated after {timeout:g} s")
            await self._connection.sleep(pause)
            pause = min(1.5 * pause, 0.5)
        return stats
