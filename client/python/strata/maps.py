"""What a map says of itself."""
import contextlib
import dataclasses
import math
import os
import tempfile
from collections.abc import Iterator
from typing import IO

import numpy as np
import xxhash

from strata import errors, poses, scan
from strata.arrays import Array
from strata.tiles import TileKey, key_from_proto
from strata.v1 import maps_pb2


@dataclasses.dataclass(frozen=True)
class Stats:
    """Counts of a map's current epoch."""

    scans: int
    scans_pending: int
    scans_failed: int
    points: int
    patches: int
    tiles: int
    epoch: int
    commit_sequence: int
    content_digest: str
    """Hash of what the map is made of; equal worlds have equal digests."""
    box: Array
    """(2, 3) lower and upper corner of the box around all surfaces, map frame [m]."""
    tiles_prepared: int
    """Of the tiles, those kept ready for plans of the default robot."""
    surface_spread_m: float
    """Of heights in level surfaces around their mean, root of the mean square: how crisp the map is."""


@dataclasses.dataclass(frozen=True)
class Epoch:
    """One globally consistent state of poses and tiles."""

    epoch: int
    time: float
    """When it became current, by the server's clock: seconds since 1970, UTC."""
    reason: str
    """What made it, for people."""
    job: int
    """That made it; 0: none."""
    decided: int
    """Scans that got a pose in it."""
    current: bool
    kept: bool
    """False: its poses are no longer all known."""


@dataclasses.dataclass(frozen=True)
class MapClass:
    """What a label means."""

    id: int
    """In [1, 255]; for ever."""
    name: str
    rgb: tuple[int, int, int]
    """In pictures, 0 to 255."""


@dataclasses.dataclass(frozen=True)
class ScanChange:
    """Where a scan is now."""

    trajectory: str
    sequence: int
    state: str
    pose: Array
    """(4, 4) T_map_scan; the uploaded one until integrated."""
    gone: bool
    """The scan was deleted; state and pose mean nothing."""


@dataclasses.dataclass(frozen=True)
class Change:
    """What changed since the last one."""

    commit_sequence: int
    """Resume from here."""
    epoch: int
    epoch_reason: str
    """What made the epoch, if this is another than before; else ""."""
    scans: list[ScanChange]
    tiles: dict[TileKey, int | None]
    """Version of the content; None of a tile that is gone."""
    whole: bool
    """This and what follows is all there is: what was known before is void."""
    inferred: bool = False
    """What Map.inferred() gives may be another than before."""


def stats_from_proto(s: maps_pb2.MapStats) -> Stats:
    return Stats(s.scans, s.scans_pending, s.scans_failed, s.points, s.patches, s.tiles, s.epoch,
                 s.commit_sequence, s.content_digest, np.array([poses.array3(s.box_min), poses.array3(s.box_max)]),
                 s.tiles_prepared, s.surface_spread_m)


def epoch_from_proto(message: maps_pb2.Epoch) -> Epoch:
    return Epoch(message.epoch, message.created.seconds + message.created.nanos * 1e-9, message.reason, message.job,
                 message.decided, message.current, message.kept)


def class_from_proto(message: maps_pb2.MapClass) -> MapClass:
    red, green, blue = message.colour.to_bytes(3, "big")
    return MapClass(message.id, message.name, (red, green, blue))


def change_from_proto(answer: maps_pb2.WatchMapResponse) -> Change:
    scans = [ScanChange(change.id.trajectory, change.id.sequence, scan.state_name(change.state),
                        poses.from_proto(change.pose), change.gone) for change in answer.scans]
    tiles = {key_from_proto(tile.key): None if tile.gone else tile.version for tile in answer.tiles}
    return Change(answer.commit_sequence, answer.epoch, answer.epoch_reason, scans, tiles, answer.whole,
                  answer.inferred)


def origin_from_proto(parameters: maps_pb2.MapParameters) -> tuple[float, float, float] | None:
    """(latitude [°], longitude [°], altitude [m])."""
    if not parameters.HasField("origin"):
        return None
    origin = parameters.origin
    return math.degrees(origin.latitude_rad), math.degrees(origin.longitude_rad), origin.altitude_m


class BackupFile:
    """A file that appears under its name once all of it is there and has the hash that the server says."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._hash = xxhash.xxh3_128()
        self._announced = ""

    def write(self, part: maps_pb2.BackupMapResponse) -> None:
        self._file.write(part.bytes)
        self._hash.update(part.bytes)
        self._announced = part.content_hash or self._announced

    def check(self) -> None:
        if self._hash.hexdigest() != self._announced:
            raise errors.DataLoss(f"the backup came with hash {self._hash.hexdigest()}, the server says "
                                  f"{self._announced or 'nothing'}; take it once more")
        self._file.flush()
        os.fsync(self._file.fileno())


@contextlib.contextmanager
def backup_file(path: str | os.PathLike[str], force: bool) -> Iterator[BackupFile]:
    """A BackupFile to write to. Raises FileExistsError unless `force`."""
    path = os.path.abspath(path)
    if os.path.exists(path) and not force:
        raise FileExistsError(f"{path} is there already; force=True replaces it")
    with tempfile.NamedTemporaryFile(dir=os.path.dirname(path), prefix=".strata-backup-", delete=False) as file:
        try:
            made = BackupFile(file)
            yield made
            made.check()
            os.replace(file.name, path)
        except BaseException:
            os.unlink(file.name)
            raise
