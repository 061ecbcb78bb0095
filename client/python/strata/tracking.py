"""A robot followed through a map by its odometry and its scans."""
import dataclasses
from types import TracebackType

import numpy as np

from strata import poses
from strata.arrays import Array
from strata.v1 import posegraph_pb2

_STATES = {posegraph_pb2.TRACK_STATE_TRACKED: "tracked", posegraph_pb2.TRACK_STATE_PREDICTED: "predicted",
           posegraph_pb2.TRACK_STATE_LOST: "lost"}


@dataclasses.dataclass(frozen=True)
class TrackedPose:
    """Where a robot is at one of its steps."""

    state: str
    """"tracked": the scan agrees with the map there; "predicted": by odometry alone; "lost"."""
    T_map_scan: Array | None
    """4 × 4; of a robot that is lost what odometry makes of the last pose, None before it was found for the first time."""
    covariance: Array
    """6 × 6, of a step on the right of the pose, rotation before translation [rad², m²]; 0 where there is none."""
    score: float
    """How well the scan agrees with the map, in [0, 1]; 0 unless tracked."""
    overlap: float
    contradiction: float
    rms_m: float
    found: bool
    """Among all places, by this scan."""
    epoch: int
    message: str


def from_proto(answer: posegraph_pb2.TrackResponse, origin: Array) -> TrackedPose:
    """`origin`: of the points as they were sent, in the scan's frame [m]."""
    T_map_scan = None
    if answer.known:
        T_map_scan = poses.from_proto(answer.pose)
        T_map_scan[:3, 3] -= T_map_scan[:3, :3] @ origin
    return TrackedPose(_STATES.get(answer.state, "lost"), T_map_scan, np.array(answer.covariance).reshape(6, 6), answer.score,
                       answer.overlap, answer.contradiction, answer.rms_m, answer.found, answer.epoch, answer.message)
