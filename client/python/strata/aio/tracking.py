"""A robot followed through a map by its odometry and its scans."""
from collections.abc import AsyncGenerator
from types import TracebackType

import numpy as np

from strata import errors, poses, scan, tracking
from strata.arrays import Array, ArrayLike
from strata.connection import Pipe
from strata.poses import PoseLike
from strata.v1 import posegraph_pb2


class Tracking:
    """A robot that is followed; made by Map.follow. An asynchronous context manager. One step at a time."""

    def __init__(self, pipe: Pipe[posegraph_pb2.TrackRequest],
                 answers: AsyncGenerator[posegraph_pb2.TrackResponse, None]) -> None:
        self._pipe = pipe
        self._answers = answers

    async def __aenter__(self) -> "Tracking":
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        trace: TracebackType | None) -> None:
        await self.close()

    async def begin(self, start: posegraph_pb2.TrackStart) -> None:
        """Once, before any step."""
        self._pipe.put(posegraph_pb2.TrackRequest(start=start))
        await self._answer()

    async def close(self) -> None:
        """Ends it; again: nothing."""
        self._pipe.end()
        await self._answers.aclose()

    async def _answer(self) -> posegraph_pb2.TrackResponse:
        async for answer in self._answers:
            return answer
        raise errors.Cancelled("the robot is not followed any more")

    async def step(self, points: ArrayLike | None, odometry: PoseLike, *, covariance: ArrayLike | None = None,
                   sensor_origin: ArrayLike | None = None) -> tracking.TrackedPose:
        """Where the robot is at its next moment → TrackedPose. Being lost is an answer; after an error begin again, with
        the last pose as the guess.

        points: as of Map.upload; None: odometry alone. odometry: where it says that the scan was taken, in a frame of its
        own that does not jump, as every pose. covariance: (6, 6) of the motion since the step before, rotation before
        translation; None: as a robot's wheels err.
        """
        message = posegraph_pb2.TrackStep(odometry=poses.to_proto(poses.matrix(odometry)))
        origin: Array = np.zeros(3)
        upload = None
        if points is not None:
            upload = scan.Upload(points, odometry, sensor_origin=sensor_origin)
            header = upload.header
            origin = (np.linalg.inv(poses.matrix(odometry)) @ poses.from_proto(header.pose))[:3, 3]
            message = posegraph_pb2.TrackStep(odometry=header.pose, point_count=header.point_count, rows=header.rows,
                                              columns=header.columns, sensor_origin=header.sensor_origin)
        if covariance is not None:
            message.motion_covariance.extend(poses.six_by_six(covariance, "covariance"))
        self._pipe.put(posegraph_pb2.TrackRequest(step=message))
        for chunk in upload.chunks() if upload else ():
            self._pipe.put(posegraph_pb2.TrackRequest(chunk=chunk))
        return tracking.from_proto(await self._answer(), origin)
