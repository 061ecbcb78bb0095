"""Where scans are, and what holds them there."""
import dataclasses
from collections.abc import Iterable

import numpy as np

from strata import errors, poses, scan
from strata.arrays import Array
from strata.poses import PoseLike
from strata.v1 import posegraph_pb2, scans_pb2

_ORIGINS = {posegraph_pb2.CONSTRAINT_ORIGIN_INGEST: "ingest", posegraph_pb2.CONSTRAINT_ORIGIN_PERSON: "person",
            posegraph_pb2.CONSTRAINT_ORIGIN_OPTIMIZE: "optimize"}
_KINDS = {posegraph_pb2.PLANE_KIND_WALL: "wall", posegraph_pb2.PLANE_KIND_LEVEL: "level",
          posegraph_pb2.PLANE_KIND_SLOPED: "sloped"}

POSE = np.dtype([
    ("trajectory", "U100"), ("sequence", "u8"),
    ("time", "f8"),  # seconds since 1970, UTC
    ("T_map_scan", "f8", (4, 4)),  # in the current epoch; the uploaded one until integrated
])


@dataclasses.dataclass(frozen=True)
class Node:
    """A scan in the pose graph."""

    trajectory: str
    sequence: int
    time: float
    """Seconds since 1970, UTC."""
    state: str
    """pending, integrated or failed."""
    uploaded: Array
    """(4, 4) T_map_scan as uploaded."""
    pose: Array
    """(4, 4) T_map_scan in this epoch."""


@dataclasses.dataclass(frozen=True)
class Constraint:
    """What is known about the relative pose of two scans, or of one in the map."""

    id: int
    """Unique in the map, among planes too."""
    i: tuple[str, int] | None
    """(trajectory, sequence) of the scan whose frame `pose` maps into; None: the map."""
    j: tuple[str, int]
    pose: Array
    """(4, 4) T_i_j."""
    information: Array
    """(6, 6) of a step on its right, rotation before translation [rad⁻², m⁻²]."""
    origin: str
    """ingest, person or optimize: who says so."""
    enabled: bool
    note: str
    may_be_false: bool


@dataclasses.dataclass(frozen=True)
class GlobalPlane:
    """The points x with normal · x = distance, held against many scans."""

    id: int
    normal: Array
    """(3,) unit."""
    distance: float
    kind: str
    """wall, level or sloped."""
    from_edges: bool
    enabled: bool
    scans: dict[tuple[str, int], float]
    """Area [m²], or length of edges [m], by which each scan supports it."""
    note: str


@dataclasses.dataclass(frozen=True)
class PoseGraph:
    """Scans, and what holds them where they are."""

    epoch: int
    nodes: list[Node]
    """In commit order."""
    constraints: list[Constraint]
    """By id."""
    planes: list[GlobalPlane]
    """By id."""

    def poses(self) -> Array:
        """(n,) of dtype POSE."""
        return poses_of(self.nodes)


@dataclasses.dataclass(frozen=True)
class ScanPose:
    """Where a scan is; true if that is known."""

    known: bool
    message: str
    """Why not, for people."""
    pose: Array
    """(4, 4) T_map_scan; the uploaded one unless known."""
    epoch: int

    def __bool__(self) -> bool:
        return self.known


@dataclasses.dataclass(frozen=True)
class Candidate:
    """A place where a scan could have been taken."""

    pose: Array
    """(4, 4) T_map_scan."""
    place: tuple[str, int]
    """(trajectory, sequence) of the scan of the map that it was matched to."""
    overlap: float
    """Share of the scan's features with a partner there."""
    rms_m: float
    confidence: float
    """How sure; in [0, 1]."""


@dataclasses.dataclass(frozen=True)
class Localization:
    """Where a scan was taken; true if a place is good enough."""

    found: bool
    message: str
    """For people, with numbers."""
    best: Candidate | None
    covariance: Array
    """(6, 6) of a step on the right of the best pose, rotation before translation [rad², m²]; zero unless found."""
    others: list[Candidate]
    """Places that look alike, best first."""
    epoch: int

    def __bool__(self) -> bool:
        return self.found


def poses_of(scans: "Iterable[scan.Scan | Node]") -> Array:
    """Poses of scans, as Map.scans() and Map.pose_graph().nodes have them: (n,) of dtype POSE."""
    return np.array([(one.trajectory, one.sequence, one.time, one.pose) for one in scans], POSE)


def _id(message: scans_pb2.ScanId) -> tuple[str, int]:
    return message.trajectory, message.sequence


def constraint_from_proto(message: posegraph_pb2.Constraint) -> Constraint:
    return Constraint(
        id=message.id, i=_id(message.i) if message.HasField("i") else None, j=_id(message.j),
        pose=poses.from_proto(message.pose), information=np.array(message.information).reshape(6, 6),
        origin=_ORIGINS.get(message.origin, "unknown"), enabled=message.enabled or not message.HasField("enabled"),
        note=message.note, may_be_false=message.may_be_false)


def _plane(message: posegraph_pb2.GlobalPlane) -> GlobalPlane:
    return GlobalPlane(
        id=message.id, normal=poses.array3(message.plane.normal), distance=message.plane.distance,
        kind=_KINDS.get(message.kind, "unknown"), from_edges=message.from_edges, enabled=message.enabled,
        scans={_id(support.scan): support.weight for support in message.supports}, note=message.note)


def _node(message: posegraph_pb2.PoseNode) -> Node:
    return Node(message.id.trajectory, message.id.sequence, message.time.seconds + message.time.nanos * 1e-9,
                scan.state_name(message.state), poses.from_proto(message.uploaded), poses.from_proto(message.current))


def from_proto(answers: list[posegraph_pb2.GetPoseGraphResponse]) -> PoseGraph:
    if not answers:
        raise errors.DataLoss("the answer ended before its first message")
    return PoseGraph(
        epoch=answers[0].epoch,
        nodes=[_node(node) for answer in answers for node in answer.nodes],
        constraints=[constraint_from_proto(one) for answer in answers for one in answer.constraints],
        planes=[_plane(plane) for answer in answers for plane in answer.planes])


def start_of(map_name: str, upload: scan.Upload, guess: PoseLike, guess_radius: float) -> posegraph_pb2.LocalizeStart:
    """The points travel relative to an origin of their own, if they lie far off: the guess is moved there."""
    header = upload.header
    start = posegraph_pb2.LocalizeStart(map=map_name, point_count=header.point_count, rows=header.rows,
                                        columns=header.columns, sensor_origin=header.sensor_origin,
                                        guess_radius_m=guess_radius)
    if guess is not None:
        start.guess.CopyFrom(poses.to_proto(poses.matrix(guess) @ poses.from_proto(header.pose)))
    return start


def _candidate(message: posegraph_pb2.LocalizeCandidate, origin: Array) -> Candidate:
    pose = poses.from_proto(message.pose)
    pose[:3, 3] -= pose[:3, :3] @ origin
    return Candidate(pose, _id(message.place), message.overlap, message.rms_m, message.confidence)


def localization_from_proto(answer: posegraph_pb2.LocalizeResponse, origin: Array) -> Localization:
    return Localization(
        found=answer.found, message=answer.message, best=_candidate(answer.best, origin) if answer.found else None,
        covariance=np.array(answer.covariance).reshape(6, 6) if answer.covariance else np.zeros((6, 6)),
        others=[_candidate(other, origin) for other in answer.others], epoch=answer.epoch)
