"""Scans: what goes up, and what comes back."""
import dataclasses
import datetime
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from strata import poses
from strata.arrays import Array, ArrayLike
from strata.poses import PoseLike
from strata.v1 import scans_pb2

MAX_CHUNK_POINTS = 40_000
_MAX_PIECE_BYTES = 1 << 20
_FAR_M, _ORIGIN_STEP_M = 1000.0, 100.0
_STATES = {scans_pb2.SCAN_STATE_PENDING: "pending", scans_pb2.SCAN_STATE_INTEGRATED: "integrated",
           scans_pb2.SCAN_STATE_FAILED: "failed"}


@dataclasses.dataclass(frozen=True)
class Ack:
    """The scan is durable."""

    trajectory: str
    sequence: int
    commit_sequence: int
    """Order of acknowledgement in the map."""
    already_present: bool
    """The same scan was there; nothing changed."""


@dataclasses.dataclass(frozen=True)
class Scan:
    """A scan as the map knows it."""

    trajectory: str
    sequence: int
    time: float
    """Seconds since 1970, UTC."""
    state: str
    """pending, integrated or failed."""
    message: str
    """Why it failed, or what was left out; "" if all is well."""
    pose: Array
    """(4, 4) T_map_scan in the current epoch; the uploaded one until integrated."""
    uploaded_pose: Array
    """(4, 4) T_map_scan as stored at upload, see Map.upload."""
    aligned: bool
    """The pose was found by registration."""
    point_count: int
    faded_points: int
    """Points that later scans looked through, so that they are not in the tiles (job "fade")."""
    commit_sequence: int
    """Order of acknowledgement in the map."""
    content_hash: str


POINT = np.dtype([
    ("x", "f4"), ("y", "f4"), ("z", "f4"),  # in the scan frame [m]; NaN where an organised scan has no return
    ("intensity", "f4"),  # NaN where the scan has none
    ("rgb", "u1", (3,)),  # all 0 where the scan has none
    ("label", "u2"),  # class id; 0: none
])


@dataclasses.dataclass(frozen=True)
class Points:
    """Points of a scan, in the order of upload; a column is None unless the scan has it."""

    xyz: Array
    """(n, 3) float32 in the scan frame [m]; NaN where an organised scan has no return."""
    intensity: Array | None
    """(n,) float32."""
    rgb: Array | None
    """(n, 3) uint8."""
    labels: Array | None
    """(n,) uint16 class ids, 0: none."""

    def structured(self) -> Array:
        """All columns in one: (n,) of dtype POINT."""
        result = np.zeros(len(self.xyz), POINT)
        for axis, name in enumerate("xyz"):
            result[name] = self.xyz[:, axis]
        result["intensity"] = np.nan if self.intensity is None else self.intensity
        result["rgb"] = 0 if self.rgb is None else self.rgb
        result["label"] = 0 if self.labels is None else self.labels
        return result


ScanLike = Scan | Ack | tuple[str, int]
"""What names a scan."""


def state_name(state: scans_pb2.ScanState) -> str:
    return _STATES.get(state, "unknown")


def id_of(scan: ScanLike) -> scans_pb2.ScanId:
    """A Scan, an Ack, or (trajectory, sequence) as a message."""
    trajectory, sequence = scan if isinstance(scan, tuple) else (scan.trajectory, scan.sequence)
    return scans_pb2.ScanId(trajectory=trajectory, sequence=sequence)


def ack_from_proto(of: scans_pb2.ScanId, ack: scans_pb2.ScanAck) -> Ack:
    return Ack(of.trajectory, of.sequence, ack.commit_sequence, ack.already_present)


def pieces(content: bytes) -> Iterator[bytes]:
    """Of at most 1 MiB."""
    for begin in range(0, len(content), _MAX_PIECE_BYTES):
        yield content[begin:begin + _MAX_PIECE_BYTES]


def from_proto(info: scans_pb2.ScanInfo) -> Scan:
    header = info.header
    return Scan(header.id.trajectory, header.id.sequence, header.time.seconds + header.time.nanos * 1e-9,
                state_name(info.state), info.message, poses.from_proto(info.pose),
                poses.from_proto(header.pose), info.alignment.aligned, header.point_count, info.faded_points,
                info.commit_sequence, info.content_hash)


def points_from_proto(chunks: Sequence[scans_pb2.PointChunk]) -> Points:
    """Points out of the chunks of a scan."""
    def column(name: str, dtype: str, width: int = 1) -> Array:
        parts = [np.frombuffer(getattr(chunk, name), dtype) for chunk in chunks]
        whole: Array = np.concatenate(parts) if parts else np.empty(0, dtype)
        return whole.reshape(-1, width) if width > 1 else whole

    def optional(name: str, dtype: str, width: int = 1) -> Array | None:
        values = column(name, dtype, width)
        return values if len(values) else None

    return Points(column("xyz", "<f4", 3), optional("intensity", "<f4"), optional("rgb", "u1", 3),
                  optional("label", "<u2"))


def _local_origin(points: Array) -> Array:
    """(3,) what to take off far-away coordinates so that single precision keeps them: along an axis where all lie on
    one side of zero and their middle beyond 1 km, that middle, rounded to 100 m; else 0. As `strata scan import`."""
    finite = points[~np.isnan(points[:, 0])]
    if not len(finite):
        raise ValueError(f"no finite point among {len(points)}")
    low, high = finite.min(axis=0), finite.max(axis=0)
    middle = 0.5 * low + 0.5 * high
    far = ((low > 0) | (high < 0)) & (np.abs(middle) > _FAR_M)
    return np.where(far, np.round(middle / _ORIGIN_STEP_M) * _ORIGIN_STEP_M, 0.0)


def _column(name: str, given: ArrayLike | None, rows: int, width: int, dtype: np.dtype[Any]) -> Array | None:
    """Bytes of an optional column, row by row."""
    if given is None:
        return None
    values = np.asarray(given)
    if values.size != rows * width:
        raise ValueError(f"{name} of shape {values.shape}; expected {width} for each of {rows} points")
    if np.issubdtype(dtype, np.integer):
        top = np.iinfo(dtype).max
        if values.dtype.kind not in "iub" or values.size and not 0 <= values.min() <= values.max() <= top:
            raise ValueError(f"{name} of {values.dtype}; expected whole numbers from 0 to {top}")
    return np.ascontiguousarray(values.reshape(rows, width), dtype)


def label_bytes(labels: ArrayLike) -> bytes:
    """(n,) class ids as they travel."""
    column = _column("labels", labels, np.size(labels), 1, np.dtype("<u2"))
    return b"" if column is None else column.tobytes()


class Upload:
    """A scan ready to be sent, as often as needed. Arguments as those of Map.upload; ValueError if they are wrong."""

    header: scans_pb2.ScanHeader

    def __init__(self, given: ArrayLike, pose: PoseLike, *, time: float | datetime.datetime | None = None,
                 intensity: ArrayLike | None = None, rgb: ArrayLike | None = None, labels: ArrayLike | None = None,
                 sensor_origin: ArrayLike | None = None, align: bool = True) -> None:
        points = np.asarray(given)
        if points.ndim not in (2, 3) or points.shape[-1] != 3 or points.dtype.kind not in "fiu":
            raise ValueError(f"points of shape {points.shape} and {points.dtype}; expected numbers, (n, 3) or "
                             "(rows, columns, 3)")
        grid = points.shape[:2] if points.ndim == 3 else (0, 0)
        points = points.reshape(-1, 3).astype(float)
        broken = ~np.isfinite(points).all(axis=1)
        if points.shape[0] and grid == (0, 0) and broken.any():
            raise ValueError(f"{broken.sum()} of {len(points)} points are not finite; leave them out, or keep the "
                             "shape (rows, columns, 3) of an organised scan")
        points[broken] = np.nan
        origin = _local_origin(points)
        T_map_scan = poses.matrix(pose)
        T_map_scan[:3, 3] += T_map_scan[:3, :3] @ origin
        if sensor_origin is None:  # no sensor stood at a zero that is kilometres away
            sensor_origin = origin
        self._columns: dict[str, Array | None] = {
            "xyz": np.ascontiguousarray(points - origin, "<f4"),
            "intensity": _column("intensity", intensity, len(points), 1, np.dtype("<f4")),
            "rgb": _column("rgb", rgb, len(points), 3, np.dtype("u1")),
            "label": _column("labels", labels, len(points), 1, np.dtype("<u2")),
        }
        self.header = scans_pb2.ScanHeader(
            pose=poses.to_proto(T_map_scan),
            sensor_origin=poses.vector3(np.asarray(sensor_origin, dtype=float) - origin),
            alignment=scans_pb2.ALIGNMENT_ON if align else scans_pb2.ALIGNMENT_OFF,
            point_count=len(points), rows=grid[0], columns=grid[1], has_intensity=intensity is not None,
            has_colour=rgb is not None, has_label=labels is not None)
        if time is not None:
            self._set_time(time)

    @classmethod
    def of_header(cls, pose: PoseLike, *, time: float | datetime.datetime | None, align: bool) -> "Upload":
        """A scan without points of its own."""
        upload = cls.__new__(cls)
        upload._columns = {}
        upload.header = scans_pb2.ScanHeader(pose=poses.to_proto(poses.matrix(pose)),
                                             alignment=scans_pb2.ALIGNMENT_ON if align else scans_pb2.ALIGNMENT_OFF)
        if time is not None:
            upload._set_time(time)
        return upload

    def _set_time(self, time: float | datetime.datetime) -> None:
        seconds = time.timestamp() if isinstance(time, datetime.datetime) else float(time)
        if not math.isfinite(seconds):
            raise ValueError(f"time {seconds}; expected seconds since 1970")
        whole, microseconds = divmod(round(seconds * 1e6), 1_000_000)
        self.header.time.seconds, self.header.time.nanos = whole, microseconds * 1000

    def chunks(self) -> Iterator[scans_pb2.PointChunk]:
        """Its points in pieces."""
        for begin in range(0, self.header.point_count, MAX_CHUNK_POINTS):
            end = begin + MAX_CHUNK_POINTS
            yield scans_pb2.PointChunk(**{name: values[begin:end].tobytes() for name, values in self._columns.items()
                                          if values is not None})

    def messages(self, map_name: str) -> Iterator[scans_pb2.UploadScanRequest]:
        """Generator over the messages of Scans.Upload."""
        yield scans_pb2.UploadScanRequest(start=scans_pb2.ScanStart(map=map_name, header=self.header))
        for chunk in self.chunks():
            yield scans_pb2.UploadScanRequest(chunk=chunk)
