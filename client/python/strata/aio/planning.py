"""Where robots can go on a map, and what to look at next."""
import contextlib
from collections.abc import AsyncGenerator, Iterable, Mapping, Sequence

from strata import errors, exploration, floors, places, plan, shape
from strata.aio.calls import MapCalls
from strata.arrays import ArrayLike
from strata.exploration import Exploration
from strata.floors import Floors
from strata.places import Places
from strata.plan import Path, PathCheck
from strata.shape import ShapeCheck
from strata.v1 import planning_pb2, robot_profile_pb2

ProfileLike = str | Mapping[str, float] | None
"""Name of one of the map's profiles, or what is not as usual about the robot, see Map.plan."""
ClassCosts = Mapping[int, float | None] | None
"""{class id: factor ≥ 1, or None where the robot must not go}."""


class Planning(MapCalls):
    async def plan(self, start: ArrayLike, goal: ArrayLike, *, profile: ProfileLike = None,
                   class_costs: ClassCosts = None, max_expanded: int | None = None,
                   inferred: str = "ignore") -> Path:
        """A Path from start to goal for a robot; without one it is false and says why.

        start, goal: (x, y) stands for the lowest surface there, (x, y, z) for the one nearest in height; map frame [m].
        profile: name of one of the map's profiles, or {"radius": 0.3, "height": 1, "max_step": 0.15, "max_slope": 0.35,
        "max_gap": 0.3, "max_roughness": 0.08} [m, rad], of which what is absent takes that default; None: all of them.
        class_costs: {class id: factor ≥ 1, or None where the robot must not go}. max_expanded: patches to look at.
        inferred: "ignore" or "obstacle": keep out of what Map.inferred() has, which nobody saw.
        """
        request = planning_pb2.PlanPathRequest(
            map=self.name, to=plan.endpoint(goal), profile=await self._profile(profile),
            max_expanded=max_expanded, class_costs=plan.class_costs(class_costs), inferred=plan.inferred_as(inferred), **{"from": plan.endpoint(start)})
        return plan.from_proto(await self._connection.unary(self._planning.PlanPath, request))

    async def check_path(self, way: Path | ArrayLike, *, profile: ProfileLike = None, class_costs: ClassCosts = None,
                         known: PathCheck | None = None, inferred: str = "ignore") -> PathCheck:
        """PathCheck: whether a path holds, and where it does not; true if it does.

        way: a Path, or places (n, 3) on the surfaces, map frame [m]. profile, class_costs: as for plan; of the costs only
        what is forbidden counts. known: the answer to the same question before, given again where nothing changed since.
        inferred: as for plan.
        """
        request = planning_pb2.CheckPathRequest(
            map=self.name, waypoints=plan.waypoints(way), profile=await self._profile(profile),
            class_costs=plan.class_costs(class_costs), known=None if known is None else known.proto,
            inferred=plan.inferred_as(inferred))
        return plan.check_from_proto((await self._connection.unary(self._planning.CheckPath, request)).check)

    async def watch_path(self, way: Path | ArrayLike, *, profile: ProfileLike = None,
                         class_costs: ClassCosts = None,
                         inferred: str = "ignore") -> AsyncGenerator[PathCheck, None]:
        """Generator over PathChecks: how a path stands, at once and whenever it stops to hold or holds again, until it is
        left. Comes back to a server that was away; the same may be told twice then. Arguments as of check_path."""
        request = planning_pb2.WatchPathRequest(
            map=self.name, waypoints=plan.waypoints(way), profile=await self._profile(profile),
            class_costs=plan.class_costs(class_costs), inferred=plan.inferred_as(inferred))
        backoff = self._connection.new_backoff()
        while True:
            try:
                async with contextlib.aclosing(
                        self._connection.stream(self._planning.WatchPath, request, endless=True)) as answers:
                    async for answer in answers:
                        backoff = self._connection.new_backoff()
                        yield plan.check_from_proto(answer.check)
                return
            except errors.StrataError as failure:
                await self._connection.wait(backoff, failure)

    async def floors(self, at: ArrayLike | None = None, *, profile: ProfileLike = None, min_area: float = 10.0,
                     cells: bool = False, inferred: str = "ignore") -> Floors:
        """Floors: what a robot can drive in one go without ever being above itself, and the links between them.

        at: (x, y, z) or (x, y), map frame [m]: whose floor is Floors.at. profile: as for plan. min_area: smaller ones are
        left out [m²]. cells: also the grid of the floor at `at`, or of all of them. inferred: as for plan; "obstacle" is
        OCCUPIED in grids.
        """
        request = planning_pb2.ListFloorsRequest(
            map=self.name, at=None if at is None else plan.endpoint(at), profile=await self._profile(profile),
            min_area_m2=min_area, cells=cells, inferred=plan.inferred_as(inferred))
        return floors.from_proto(await self._connection.unary(self._planning.ListFloors, request))

    async def places(self, floor: int | None = None, *, at: ArrayLike | None = None, profile: ProfileLike = None,
                     cells: bool = False, inferred: str = "ignore") -> Places:
        """Places: rooms, corridors and doorways of one floor, the largest first, and which of them touch.

        floor: its number as floors() has them; at: (x, y, z) or (x, y) on it [m]; without both, the largest. profile: as for
        plan. cells: also which cell is of which place. inferred: as for plan. NotFound: no such floor. ResourceExhausted: it is too large.
        """
        request = planning_pb2.ListPlacesRequest(
            map=self.name, floor=floor, at=None if at is None else plan.endpoint(at),
            profile=await self._profile(profile), cells=cells, inferred=plan.inferred_as(inferred))
        return places.from_proto(await self._connection.unary(self._planning.ListPlaces, request))

    async def explore(self, /, start: ArrayLike, *, count: int = 5, profile: ProfileLike = None,
                      class_costs: ClassCosts = None, region: ArrayLike | None = None,
                      inferred: str = "ignore", **query: float) -> Exploration:
        """Exploration: where a robot at `start` should look next, as views of space that no scan has seen.

            for view in campus.explore((3, -1, 0.4), count=3, max_range=15):
                drive_to(view.place)

        start, profile, class_costs, inferred: as for plan. region: (2, 3) lower and upper corner [m] of what is to be learnt; None:
        what the sensor may see. query: budget [m], resolution [m], sensor_height [m], bits_per_m, horizon, min_bits; of the
        sensor up, down, width [rad], rows, columns, max_range [m]; what is absent takes its default, see
        `strata explore --help`. Raises ValueError and StrataError.
        """
        request = exploration.to_proto(self.name, count, region, query)
        getattr(request, "from").CopyFrom(plan.endpoint(start))
        request.profile.CopyFrom(await self._profile(profile))
        request.class_costs.extend(plan.class_costs(class_costs))
        request.inferred = plan.inferred_as(inferred)
        return exploration.from_proto(await self._connection.unary(self._planning.Explore, request))

    async def check_shape(self, way: Path | ArrayLike, mesh: Sequence[ArrayLike] | None = None, *,
                          parts: Iterable[planning_pb2.ShapePart] = (), clearance: float = 0.0, ground: float = 0.15,
                          unknown: str = "ignore", inferred: str = "ignore") -> ShapeCheck:
        """ShapeCheck: whether a shape touches anything along a way, where and how deep; true if it does not.

            campus.check_shape(campus.plan(start, goal), (vertices, triangles))
            campus.check_shape(path, parts=[strata.shape.box((1.2, 0.6, 1.0), (0, 0, 0.5))], clearance=0.05)

        way: a Path, or places (n, 3) on the ground, along which the shape is turned and pitched as they lead, or poses
        (n, 4, 4) T_map_shape; swept between them. mesh: (vertices (n, 3), triangles (m, 3)) in the shape's frame: x forward,
        z up from the ground. parts: solids, of shape.box, shape.cylinder and shape.sphere. clearance: to be kept from
        everything [m]. ground: what is no higher over the ground that the shape stands on is ground [m]. unknown: "ignore"
        or "blocked", cells below it where nothing was measured. inferred: as for plan. Raises ValueError and StrataError.
        """
        request = shape.to_proto(self.name, way, mesh, parts, clearance, ground, unknown)
        request.inferred = plan.inferred_as(inferred)
        return shape.from_proto(await self._connection.unary(self._planning.CheckShape, request))

    async def _profile(self, profile: ProfileLike) -> robot_profile_pb2.RobotProfile:
        if isinstance(profile, str):
            profiles = await self.profiles()
            if profile not in profiles:
                raise errors.NotFound(f"profile {profile!r} of map {self.name}; it has {', '.join(sorted(profiles))}")
            profile = profiles[profile]
        return plan.profile_to_proto(profile or {})

    async def profiles(self) -> dict[str, dict[str, float]]:
        """All profiles by name, "default" among them, each as Map.plan takes it."""
        answer = await self._connection.unary(self._planning.ListProfiles,
                                              planning_pb2.ListProfilesRequest(map=self.name))
        return {name: plan.profile_from_proto(profile) for name, profile in answer.profiles.items()}

    async def set_profile(self, name: str, profile: Mapping[str, float]) -> None:
        """Makes or replaces a profile; that named "default" re-annotates the tiles."""
        await self._connection.unary(self._planning.SetProfile, planning_pb2.SetProfileRequest(
            map=self.name, name=name, profile=plan.profile_to_proto(profile)))
