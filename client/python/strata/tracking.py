"""A robot followed through a map by its odometry and its scans."""
import dataclasses
import queue

import numpy as np

from strata import errors, poses, scan
from strata.v1 import posegraph_pb2

_STATES = {posegraph_pb2.TRACK_STATE_TRACKED: "tracked", posegraph_pb2.TRACK_STATE_PREDICTED: "predicted",
           posegraph_pb2.TRACK_STATE_LOST: "lost"}


@dataclasses.dataclass(frozen=True)
class TrackedPose:
    """Where a robot is at one of its steps."""

    state: str
    """"tracked": the scan agrees with the map there; "predicted": by odometry alone; "lost"."""
    T_map_scan: np.ndarray | None
    """4 × 4; of a robot that is lost what odometry makes of the last pose, None before it was found for the first time."""
    covariance: np.ndarray
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


class Tracking:
    """A robot that is followed; made by Map.follow. A context manager. One thread at a time."""

    def __init__(self, connection, method, start):
        self._requests = queue.SimpleQueue()
        self._requests.put(posegraph_pb2.TrackRequest(start=start))
        self._answers = connection.stream(method, iter(self._requests.get, None), endless=True)
        self._answer()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Ends it; again: nothing."""
        self._requests.put(None)
        self._answers.close()

    def _answer(self):
        try:
            return next(self._answers)
        except StopIteration:
            raise errors.Cancelled("the robot is not followed any more") from None

    def step(self, points, odometry, *, covariance=None, sensor_origin=None):
        """Where the robot is at its next moment → TrackedPose. Being lost is an answer; after an error begin again, with
        the last pose as the guess.

        points: as of Map.upload; None: odometry alone. odometry: where it says that the scan was taken, in a frame of its
        own that does not jump, as every pose. covariance: (6, 6) of the motion since the step before, rotation before
        translation; None: as a robot's wheels err.
        """
        message = posegraph_pb2.TrackStep(odometry=poses.to_proto(poses.matrix(odometry)))
        origin, chunks = np.zeros(3), []
        if points is not None:
            upload = scan.Upload(points, odometry, time=None, intensity=None, rgb=None, labels=None,
                                 sensor_origin=sensor_origin, align=True)
            header = upload.header
            moved = np.linalg.inv(poses.matrix(odometry)) @ poses.from_proto(header.pose)
            origin = moved[:3, 3]
            message = posegraph_pb2.TrackStep(odometry=header.pose, point_count=header.point_count, rows=header.rows,
                                              columns=header.columns, sensor_origin=header.sensor_origin)
            chunks = [part.chunk for part in upload.messages("") if part.HasField("chunk")]
        if covariance is not None:
            covariance = np.asarray(covariance, dtype=float)
            if covariance.shape != (6, 6):
                raise ValueError(f"covariance of shape {covariance.shape}; expected (6, 6)")
            message.motion_covariance.extend(covariance.ravel())
        self._requests.put(posegraph_pb2.TrackRequest(step=message))
        for chunk in chunks:
            self._requests.put(posegraph_pb2.TrackRequest(chunk=chunk))
        return _from_proto(self._answer(), origin)


def _from_proto(answer, origin):
    T_map_scan = None
    if answer.known:
        T_map_scan = poses.from_proto(answer.pose)
        T_map_scan[:3, 3] -= T_map_scan[:3, :3] @ origin
    return TrackedPose(_STATES.get(answer.state, "lost"), T_map_scan, np.array(answer.covariance).reshape(6, 6), answer.score,
                       answer.overlap, answer.contradiction, answer.rms_m, answer.found, answer.epoch, answer.message)


def start_of(map_name, guess, guess_radius):
    start = posegraph_pb2.TrackStart(map=map_name, guess_radius_m=guess_radius)
    if guess is not None:
        start.guess.CopyFrom(poses.to_proto(poses.matrix(guess)))
    return start
