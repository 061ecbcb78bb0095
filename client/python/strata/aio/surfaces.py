"""What a map looks like: tiles, surfaces at places, meshes, heights; and what of it changes."""
import contextlib
import functools
import math
from collections.abc import AsyncGenerator, Mapping
from typing import TypeVar

import numpy as np

from strata import errors, heights, maps, mesh
from strata.aio.calls import MapCalls
from strata.arrays import Array, ArrayLike
from strata.heights import Heights
from strata.maps import Change
from strata.mesh import Mesh
from strata.tiles import SURFACE, TILE_CELLS, Tile, TileInfo, TileKey, decode_tile, key_from_proto, key_to_proto
from strata.v1 import maps_pb2, planning_pb2, tiles_pb2

T = TypeVar("T")

_MAX_PLACES = 10_000
_TILE_LIMIT = 1 << 31


class Surfaces(MapCalls):
    async def fetch(self, area: ArrayLike | None = None, *, held: Mapping[TileKey, Tile] | None = None,
                    level: int = 0) -> dict[TileKey, Tile]:
        """Tiles by TileKey, with everything that a robot sees of an area.

        area: (x0, y0, x1, y1) in the map frame [m]; None: all. level: of detail; each doubles the edge of a cell.
        held: what an earlier fetch returned; only what changed since then is sent, and the rest is taken from it. It
        should be of the same area: of tiles outside nothing is heard. A tile that is damaged on the server stays as it
        was held, or missing; Map.job("rebuild") mends it.
        """
        tiles = dict(held or {})
        async with contextlib.aclosing(self.changes(area, held=held, level=level)) as changes:
            async for key, tile in changes:
                if tile is None:
                    tiles.pop(key, None)
                else:
                    tiles[key] = tile
        return tiles

    async def changes(self, area: ArrayLike | None = None, *, held: Mapping[TileKey, Tile] | None = None,
                      level: int = 0) -> AsyncGenerator[tuple[TileKey, Tile | None], None]:
        """Generator over (TileKey, Tile) of what is new or changed against `held`, and (TileKey, None) of what is
        gone; as fetch, one tile at a time. A stream that breaks off goes on where it was."""
        versions = {key: tile.version for key, tile in (held or {}).items()}
        backoff = self._connection.new_backoff()
        while True:
            request = tiles_pb2.FetchTilesRequest(map=self.name, area=self._area(area, level), held=[
                tiles_pb2.HeldTile(key=key_to_proto(key), version=version) for key, version in versions.items()])
            try:
                async with contextlib.aclosing(self._connection.stream(self._tiles.Fetch, request)) as answers:
                    async for answer in answers:
                        backoff = self._connection.new_backoff()
                        key = key_from_proto(answer.tile.key)
                        if answer.kind == tiles_pb2.FetchTilesResponse.KIND_GONE:
                            versions.pop(key, None)
                            yield key, None
                        elif answer.kind != tiles_pb2.FetchTilesResponse.KIND_DAMAGED:
                            versions[key] = answer.tile.version
                            yield key, await self._decoded(answer.tile)
                return
            except errors.StrataError as failure:
                await self._connection.wait(backoff, failure)

    async def _decoded(self, tile: tiles_pb2.EncodedTile) -> Tile:
        return await self._connection.work(functools.partial(decode_tile, tile.bytes, self.cell_size))

    async def tile(self, key: TileKey) -> Tile:
        """One tile; NotFound where the map has nothing, DataLoss of one that is damaged."""
        answer = await self._connection.unary(self._tiles.Get, tiles_pb2.GetTileRequest(
            map=self.name, key=key_to_proto(key)))
        return await self._decoded(answer.tile)

    async def tiles(self, area: ArrayLike | None = None, *, level: int = 0) -> dict[TileKey, TileInfo]:
        """What there is in an area, without the surfaces: TileInfo by TileKey. Arguments as of fetch."""
        request = tiles_pb2.ListTilesRequest(map=self.name, area=self._area(area, level))
        answers = await self._connection.collected(self._tiles.List, request)
        return {key_from_proto(tile.key): TileInfo(tile.version, tile.bytes, tile.patches)
                for answer in answers for tile in answer.tiles}

    def _area(self, area: ArrayLike | None, level: int) -> tiles_pb2.TileArea:
        message = tiles_pb2.TileArea(level=level)
        if area is not None:
            edge = TILE_CELLS * self.cell_size * 2.0**level
            x0, y0, x1, y1 = (min(max(math.floor(number / edge), -_TILE_LIMIT), _TILE_LIMIT - 1)
                              for number in np.asarray(area, dtype=float).tolist())
            message.x_min, message.y_min, message.x_max, message.y_max = x0, y0, x1 + 1, y1 + 1
        return message

    async def surfaces(self, places: ArrayLike) -> list[Array]:
        """All levels at places (n, 2) or (n, 3), map frame [m]: a list of arrays of dtype SURFACE, lowest first."""
        places = np.asarray(places, dtype=float)
        if places.ndim != 2 or places.shape[1] not in (2, 3):
            raise ValueError(f"places of shape {places.shape}; expected (n, 2)")
        columns: list[planning_pb2.SurfaceColumn] = []
        for begin in range(0, len(places), _MAX_PLACES):
            request = planning_pb2.SampleSurfacesRequest(map=self.name)
            for x, y in places[begin:begin + _MAX_PLACES, :2].tolist():
                request.places.add(x=x, y=y)
            columns += (await self._connection.unary(self._planning.SampleSurfaces, request)).columns
        return [np.array([(column.x_m, column.y_m, s.z_m, s.sigma_m, s.depth_m, s.cost, s.traversability, s.class_id,
                           s.confidence, tuple(s.colour.to_bytes(3, "big"))) for s in column.surfaces], SURFACE)
                for column in columns]

    async def mesh(self, region: ArrayLike | None = None, *, voxel: float = 0.05, method: str = "tsdf",
                   of_class: str | int | None = None, simplify: int | None = None, program: str = "strata") -> Mesh:
        """The surface of the map's scans as triangles → Mesh; by the program `strata`, which must be installed.

        region: (2, 2) or (2, 3) lower and upper corner of the part that is meshed [m]; None: all. voxel: edge of a voxel
        [m]. method: "tsdf", "contour" or "alpha", see `strata map mesh --help`. of_class: points of this class only, its
        name or id. simplify: at most so many triangles. Raises ValueError, StrataError, and FileNotFoundError where
        `program` is not installed.
        """
        return await self._connection.work(lambda: mesh.mesh(
            self._connection, self.name, region, voxel=voxel, method=method, of_class=of_class, simplify=simplify,
            program=program))

    async def heights(self, surface: str = "highest", region: ArrayLike | None = None, *, profile: str | None = None,
                      level: int = 0, program: str = "strata") -> Heights:
        """One height a cell → Heights; by the program `strata`, which must be installed.

        surface: "highest"; "kalman", all of a cell fused; or "ground", the lowest that the robot of the map's `profile`
        (its name) can drive on, so that underpasses stay open. region: (2, 2) or (2, 3) lower and upper corner [m]; None:
        all. level: of detail; each doubles the edge of a cell. Raises ValueError, StrataError, and FileNotFoundError where
        `program` is not installed.
        """
        return await self._connection.work(lambda: heights.heights(
            self._connection, self.name, surface, region, profile=profile, level=level, program=program))

    async def watch(self, since: int = 0, *, epoch: int = 0, trajectory: str | None = None, tiles: bool = True,
                    once: bool = False) -> AsyncGenerator[Change, None]:
        """Generator over Changes, until it is left, or all is told with `once`. The first comes at once.

        since: commit sequence that is known; 0: nothing is, and all is told. epoch: that is known. trajectory: scans of
        this one only. tiles: False, scans and epochs only. Comes back to a server that was away; the same may be told
        twice then.
        """
        request = maps_pb2.WatchMapRequest(name=self.name, since=since, epoch=epoch, trajectory=trajectory or "",
                                           tiles=tiles, once=once)
        backoff = self._connection.new_backoff()
        while True:
            try:
                async with contextlib.aclosing(self._connection.stream(self._maps.Watch, request, endless=True)) as answers:
                    async for answer in answers:
                        request.since, request.epoch = answer.commit_sequence, answer.epoch
                        backoff = self._connection.new_backoff()
                        yield maps.change_from_proto(answer)
                return
            except errors.StrataError as failure:
                await self._connection.wait(backoff, failure)
