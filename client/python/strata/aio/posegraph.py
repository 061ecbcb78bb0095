"""Where scans are, and what holds them there."""
from strata import posegraph, poses, scan
from strata.aio.calls import MapCalls
from strata.arrays import ArrayLike
from strata.poses import PoseLike
from strata.scan import ScanLike
from strata.v1 import posegraph_pb2


class PoseGraphCalls(MapCalls):
    async def pose_graph(self) -> posegraph.PoseGraph:
        """PoseGraph: all scans with their poses, and the constraints and planes that hold them."""
        request = posegraph_pb2.GetPoseGraphRequest(map=self.name)
        return posegraph.from_proto(await self._connection.collected(self._posegraph.Get, request))

    async def lookup_pose(self, which: ScanLike) -> posegraph.ScanPose:
        """ScanPose: where a scan is, or why that is not known yet; true if it is known. NotFound."""
        answer = await self._connection.unary(self._posegraph.LookupPose, posegraph_pb2.LookupPoseRequest(
            map=self.name, id=scan.id_of(which)))
        return posegraph.ScanPose(answer.known, answer.message, poses.from_proto(answer.pose), answer.epoch)

    async def set_pose(self, which: ScanLike, pose: PoseLike) -> None:
        """Moves a scan by hand to T_map_scan; its tiles are new when this returns. FailedPrecondition while it is pending."""
        await self._connection.unary(self._posegraph.SetPose, posegraph_pb2.SetPoseRequest(
            map=self.name, id=scan.id_of(which), pose=poses.to_proto(poses.matrix(pose))))

    async def add_constraint(self, j: ScanLike, pose: PoseLike, information: ArrayLike, *, i: ScanLike | None = None,
                             note: str = "", may_be_false: bool = False) -> posegraph.Constraint:
        """Records what a person knows about the pose of scan j; the next job "optimize" uses it. Each call adds another.

        i: the scan in whose frame that is; None: the map, as of a landmark or GPS. pose: T_i_j, or T_map_j. information:
        (6, 6) inverse of the covariance of a step on the right of it, rotation [rad⁻²] before translation [m⁻²];
        directions with zeros are free. may_be_false: "optimize" may reject it if everything else contradicts it.
        Raises InvalidArgument, NotFound.
        """
        constraint = posegraph_pb2.Constraint(
            i=None if i is None else scan.id_of(i), j=scan.id_of(j), pose=poses.to_proto(poses.matrix(pose)),
            information=poses.six_by_six(information, "information"), note=note, may_be_false=may_be_false)
        answer = await self._connection.once(self._posegraph.AddConstraint, posegraph_pb2.AddConstraintRequest(
            map=self.name, constraint=constraint))
        return posegraph.constraint_from_proto(answer.constraint)

    async def remove_constraint(self, constraint: int) -> None:
        """Takes a constraint out, by its id. NotFound; FailedPrecondition for a plane that a job found: disable it."""
        await self._connection.once(self._posegraph.RemoveConstraint, posegraph_pb2.RemoveConstraintRequest(
            map=self.name, id=constraint))

    async def enable_constraint(self, constraint: int, enabled: bool = True) -> None:
        """Switches a constraint or a plane, by its id, on or off for the jobs to come. NotFound."""
        await self._connection.unary(self._posegraph.EnableConstraint, posegraph_pb2.EnableConstraintRequest(
            map=self.name, id=constraint, enabled=enabled))

    async def localize(self, points: ArrayLike, guess: PoseLike = None, *, guess_radius: float = 20.0,
                       sensor_origin: ArrayLike | None = None) -> posegraph.Localization:
        """Localization: where in the map a scan was taken, or why no place is good enough; true if there is one.

        points, sensor_origin: as of upload; at most 2,000,000. guess: roughly where, as every pose; None: anywhere.
        guess_radius: not farther from it than that [m].
        """
        upload = scan.Upload(points, None, sensor_origin=sensor_origin)
        start = posegraph.start_of(self.name, upload, guess, guess_radius)
        requests = [posegraph_pb2.LocalizeRequest(start=start)]
        requests += [posegraph_pb2.LocalizeRequest(chunk=chunk) for chunk in upload.chunks()]

        async def attempt() -> posegraph_pb2.LocalizeResponse:
            return await self._connection.send(self._posegraph.Localize, requests)

        answer = await self._connection.repeated(attempt)
        return posegraph.localization_from_proto(answer, poses.from_proto(upload.header.pose)[:3, 3])
