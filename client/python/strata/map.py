"""One map: upload, fetch, plan, watch, jobs."""
import dataclasses
import math
import secrets
import threading
import time as clock

import numpy as np

from strata import errors, exploration, floors, heights, job, mesh, objects, places, plan, planes, poses, scan, shape, tracking
from strata.tiles import SURFACE, TILE_CELLS, TileKey, decode_tile
from strata.v1 import (geometry_pb2, jobs_pb2, jobs_pb2_grpc, maps_pb2, maps_pb2_grpc, models_pb2, models_pb2_grpc,
                       objects_pb2, objects_pb2_grpc, planning_pb2, planning_pb2_grpc, posegraph_pb2_grpc, scans_pb2, scans_pb2_grpc, tiles_pb2, tiles_pb2_grpc)

_MAX_PLACES = 10_000
_TILE_LIMIT = 1 << 31


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
    box: np.ndarray
    """(2, 3) lower and upper corner of the box around all surfaces, map frame [m]."""
    tiles_prepared: int
    """Of the tiles, those kept ready for plans of the default robot."""
    surface_spread_m: float
    """Of heights in level surfaces around their mean, root of the mean square: how crisp the map is."""


@dataclasses.dataclass(frozen=True)
class ScanChange:
    """Where a scan is now."""

    trajectory: str
    sequence: int
    state: str
    pose: np.ndarray
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
    scans: list
    """Of ScanChange."""
    tiles: dict
    """Version of the content by TileKey; None of a tile that is gone."""
    whole: bool
    """This and what follows is all there is: what was known before is void."""


class Map:
    """A map on a server; made by Database.map and Database.create_map. Thread-safe."""

    def __init__(self, connection, name, cell_size):
        self.name = name
        self.cell_size = cell_size
        """Edge of a cell [m]."""
        self.trajectory = f"run-{clock.strftime('%Y%m%dT%H%M%SZ', clock.gmtime())}-{secrets.token_hex(3)}"
        """Of uploads that name none; this object's own."""
        self._connection = connection
        self._maps = maps_pb2_grpc.MapsStub(connection.channel)
        self._scans = scans_pb2_grpc.ScansStub(connection.channel)
        self._tiles = tiles_pb2_grpc.TilesStub(connection.channel)
        self._planning = planning_pb2_grpc.PlanningStub(connection.channel)
        self._jobs = jobs_pb2_grpc.JobsStub(connection.channel)
        self._models = models_pb2_grpc.ModelsStub(connection.channel)
        self._objects = objects_pb2_grpc.ObjectsStub(connection.channel)
        self._posegraph = posegraph_pb2_grpc.PoseGraphStub(connection.channel)
        self._lock = threading.Lock()
        self._last_sequence = {}

    def __repr__(self):
        return f"<strata.Map {self.name}>"

    # Scans

    def upload(self, points, pose=None, *, trajectory=None, sequence=None, time=None, intensity=None, rgb=None,
               labels=None, sensor_origin=None, align=True):
        """Sends a scan and returns its Ack once it is durable. The same scan sent again changes nothing.

        points: (n, 3) in the scan frame [m], or (rows, columns, 3) of an organised scan, NaN without a return.
        pose: T_map_scan, roughly: (4, 4), or (translation (3,), quaternion (x, y, z, w)); None: the identity.
        trajectory: name of this run of this robot; None: self.trajectory. sequence: place of the scan in it; None: the
        one after the last. Together they name the scan: another one of that name is refused (AlreadyExists).
        time: seconds since 1970, or a datetime. intensity: (n,). rgb: (n, 3), 0 to 255. labels: (n,) class ids of the
        map, 0: none. sensor_origin: (3,) where the sensor stood, in the scan frame [m]; None: its zero.
        align: False takes the pose as it is.

        Coordinates travel in single precision. Where all points lie kilometres to one side of zero, their rounded
        middle is taken off them and put into the pose first, so that nothing is lost: the scan frame that the map knows
        is then the one moved there.
        """
        upload = scan.Upload(points, pose, time=time, intensity=intensity, rgb=rgb, labels=labels,
                             sensor_origin=sensor_origin, align=align)
        trajectory = trajectory or self.trajectory
        if sequence is None:
            sequence = self._next_sequence(trajectory)
        upload.header.id.CopyFrom(scans_pb2.ScanId(trajectory=trajectory, sequence=sequence))
        answer = self._connection.repeated(
            lambda: self._connection.once(self._scans.Upload, upload.messages(self.name)))
        return scan.Ack(trajectory, sequence, answer.ack.commit_sequence, answer.ack.already_present)

    def _next_sequence(self, trajectory):
        with self._lock:
            if trajectory not in self._last_sequence:
                self._last_sequence[trajectory] = self.last_sequence(trajectory)
            self._last_sequence[trajectory] += 1
            return self._last_sequence[trajectory]

    def last_sequence(self, trajectory):
        """Highest committed sequence of a trajectory, where a robot goes on; 0 if it has none."""
        return self._connection.unary(
            self._scans.GetUploadState,
            scans_pb2.GetUploadStateRequest(map=self.name, trajectory=trajectory)).last_sequence

    def scans(self, trajectory=None, box=None):
        """All Scans in the order of acknowledgement; of one trajectory, or that meet a box (x0, y0, x1, y1) [m]."""
        request = scans_pb2.ListScansRequest(map=self.name, trajectory=trajectory)
        if box is not None:
            x0, y0, x1, y1 = (float(number) for number in box)
            request.box.CopyFrom(geometry_pb2.Box2(min=geometry_pb2.Vector2(x=x0, y=y0),
                                                   max=geometry_pb2.Vector2(x=x1, y=y1)))
        answers = self._connection.collected(self._scans.List, request)
        return [scan.from_proto(info) for answer in answers for info in answer.scans]

    def points(self, which):
        """Points of a scan: of a Scan, an Ack or (trajectory, sequence)."""
        request = scans_pb2.GetScanPointsRequest(map=self.name, id=scan.id_of(which))
        answers = self._connection.collected(self._scans.GetPoints, request)
        return scan.points_from_proto([answer.chunk for answer in answers])

    def faded(self, which):
        """(n,) uint16: for each point of a scan how many later scans looked through the place where it was, 0 if it has
        not faded; empty if none of them has."""
        request = scans_pb2.GetFadedPointsRequest(map=self.name, id=scan.id_of(which))
        answers = self._connection.collected(self._scans.GetFaded, request)
        return np.frombuffer(b"".join(answer.scans for answer in answers), "<u2")

    def delete_scan(self, which):
        """Takes a scan, its points and its contribution out of the map."""
        self._connection.once(self._scans.Delete,
                              scans_pb2.DeleteScanRequest(map=self.name, id=scan.id_of(which)))

    def follow(self, guess=None, *, guess_radius=20.0):
        """Follows a robot by its odometry and its scans → Tracking, a context manager: what step() is given comes back as
        poses in the map, with covariance and score. guess: roughly where the first scan is taken, as every pose; None:
        anywhere. guess_radius: not farther from it than that [m]."""
        return tracking.Tracking(self._connection, self._posegraph.Track, tracking.start_of(self.name, guess, guess_radius))

    def stats(self):
        """Stats of the current epoch."""
        s = self._connection.unary(self._maps.Stats, maps_pb2.GetMapStatsRequest(name=self.name)).stats
        return Stats(s.scans, s.scans_pending, s.scans_failed, s.points, s.patches, s.tiles, s.epoch,
                     s.commit_sequence, s.content_digest, np.array([poses.array3(s.box_min), poses.array3(s.box_max)]),
                     s.tiles_prepared, s.surface_spread_m)

    def origin(self):
        """Where the map's origin is on earth (WGS 84): (latitude [°], longitude [°], altitude [m]); None: not said."""
        info = self._connection.unary(self._maps.Get, maps_pb2.GetMapRequest(name=self.name)).map
        if not info.parameters.HasField("origin"):
            return None
        origin = info.parameters.origin
        return math.degrees(origin.latitude_rad), math.degrees(origin.longitude_rad), origin.altitude_m

    def set_origin(self, latitude, longitude, altitude):
        """Says where the map's origin is on earth [°, °, m], x pointing east and y north; its coordinates stay.

        Raises InvalidArgument for a place that is not on earth.
        """
        origin = maps_pb2.GeodeticOrigin(latitude_rad=math.radians(latitude), longitude_rad=math.radians(longitude),
                                         altitude_m=altitude)
        self._connection.unary(self._maps.SetOrigin, maps_pb2.SetMapOriginRequest(name=self.name, origin=origin))

    def wait(self, timeout=None):
        """Returns Stats once every scan is integrated or has failed; TimeoutError after `timeout` seconds."""
        until = math.inf if timeout is None else clock.monotonic() + timeout
        pause = 0.01
        while (stats := self.stats()).scans_pending:
            if clock.monotonic() > until:
                raise TimeoutError(f"{stats.scans_pending} scans are not integrated after {timeout:g} s")
            clock.sleep(pause)
            pause = min(1.5 * pause, 0.5)
        return stats

    # Surfaces

    def fetch(self, area=None, *, held=None, level=0):
        """Tiles by TileKey, with everything that a robot sees of an area.

        area: (x0, y0, x1, y1) in the map frame [m]; None: all. level: of detail; each doubles the edge of a cell.
        held: what an earlier fetch returned; only what changed since then is sent, and the rest is taken from it. It
        should be of the same area: of tiles outside nothing is heard. A tile that is damaged on the server stays as it
        was held, or missing; Map.job("rebuild") mends it.
        """
        tiles = dict(held or {})
        for key, tile in self.changes(area, held=held, level=level):
            if tile is None:
                tiles.pop(key, None)
            else:
                tiles[key] = tile
        return tiles

    def changes(self, area=None, *, held=None, level=0):
        """Generator over (TileKey, Tile) of what is new or changed against `held`, and (TileKey, None) of what is
        gone; as fetch, one tile at a time. A stream that breaks off goes on where it was."""
        versions = {key: tile.version for key, tile in (held or {}).items()}
        backoff = self._connection.new_backoff()
        while True:
            request = tiles_pb2.FetchTilesRequest(map=self.name, area=self._area(area, level), held=[
                tiles_pb2.HeldTile(key=tiles_pb2.TileKey(level=key.level, x=key.x, y=key.y), version=version)
                for key, version in versions.items()])
            try:
                for answer in self._connection.stream(self._tiles.Fetch, request):
                    backoff = self._connection.new_backoff()
                    key = TileKey(answer.tile.key.level, answer.tile.key.x, answer.tile.key.y)
                    if answer.kind == tiles_pb2.FetchTilesResponse.KIND_GONE:
                        versions.pop(key, None)
                        yield key, None
                    elif answer.kind != tiles_pb2.FetchTilesResponse.KIND_DAMAGED:
                        versions[key] = answer.tile.version
                        yield key, decode_tile(answer.tile.bytes, self.cell_size)
                return
            except errors.StrataError as failure:
                backoff.wait(failure)

    def _area(self, area, level):
        message = tiles_pb2.TileArea(level=level)
        if area is not None:
            edge = TILE_CELLS * self.cell_size * 2.0**level
            x0, y0, x1, y1 = (min(max(math.floor(float(number) / edge), -_TILE_LIMIT), _TILE_LIMIT - 1)
                              for number in area)
            message.x_min, message.y_min, message.x_max, message.y_max = x0, y0, x1 + 1, y1 + 1
        return message

    def mesh(self, region=None, *, voxel=0.05, method="tsdf", of_class=None, simplify=None, program="strata"):
        """The surface of the map's scans as triangles → Mesh; by the program `strata`, which must be installed.

        region: (2, 2) or (2, 3) lower and upper corner of the part that is meshed [m]; None: all. voxel: edge of a voxel
        [m]. method: "tsdf", "contour" or "alpha", see `strata map mesh --help`. of_class: points of this class only, its
        name or id. simplify: at most so many triangles. Raises ValueError, StrataError, and FileNotFoundError where
        `program` is not installed.
        """
        return mesh.mesh(self._connection, self.name, region, voxel=voxel, method=method, of_class=of_class,
                         simplify=simplify, program=program)

    def heights(self, surface="highest", region=None, *, profile=None, level=0, program="strata"):
        """One height a cell → Heights; by the program `strata`, which must be installed.

        surface: "highest"; "kalman", all of a cell fused; or "ground", the lowest that the robot of the map's `profile`
        (its name) can drive on, so that underpasses stay open. region: (2, 2) or (2, 3) lower and upper corner [m]; None:
        all. level: of detail; each doubles the edge of a cell. Raises ValueError, StrataError, and FileNotFoundError where
        `program` is not installed.
        """
        return heights.heights(self._connection, self.name, surface, region, profile=profile, level=level, program=program)

    def surfaces(self, places):
        """All levels at places (n, 2) or (n, 3), map frame [m]: a list of arrays of dtype SURFACE, lowest first."""
        places = np.asarray(places, dtype=float)
        if places.ndim != 2 or places.shape[1] not in (2, 3):
            raise ValueError(f"places of shape {places.shape}; expected (n, 2)")
        columns = []
        for begin in range(0, len(places), _MAX_PLACES):
            request = planning_pb2.SampleSurfacesRequest(map=self.name)
            for x, y in places[begin:begin + _MAX_PLACES, :2].tolist():
                request.places.add(x=x, y=y)
            columns += self._connection.unary(self._planning.SampleSurfaces, request).columns
        return [np.array([(column.x_m, column.y_m, s.z_m, s.sigma_m, s.depth_m, s.cost, s.traversability, s.class_id,
                           s.confidence, tuple(s.colour.to_bytes(3, "big"))) for s in column.surfaces], SURFACE)
                for column in columns]

    # Planning

    def plan(self, start, goal, *, profile=None, class_costs=None, max_expanded=None):
        """A Path from start to goal for a robot; without one it is false and says why.

        start, goal: (x, y) stands for the lowest surface there, (x, y, z) for the one nearest in height; map frame [m].
        profile: name of one of the map's profiles, or {"radius": 0.3, "height": 1, "max_step": 0.15, "max_slope": 0.35,
        "max_gap": 0.3, "max_roughness": 0.08} [m, rad], of which what is absent takes that default; None: all of them.
        class_costs: {class id: factor ≥ 1, or None where the robot must not go}. max_expanded: patches to look at.
        """
        if isinstance(profile, str):
            profile = self._named_profile(profile)
        request = planning_pb2.PlanPathRequest(
            map=self.name, to=plan.endpoint(goal), profile=plan.profile_to_proto(profile or {}),
            max_expanded=max_expanded, class_costs=[plan.class_cost(*item) for item in (class_costs or {}).items()],
            **{"from": plan.endpoint(start)})
        return plan.from_proto(self._connection.unary(self._planning.PlanPath, request))

    def floors(self, at=None, *, profile=None, min_area=10.0, cells=False):
        """Floors: what a robot can drive in one go without ever being above itself, and the links between them.

        at: (x, y, z) or (x, y), map frame [m]: whose floor is Floors.at. profile: as for plan. min_area: smaller ones are
        left out [m²]. cells: also the grid of the floor at `at`, or of all of them.
        """
        if isinstance(profile, str):
            profile = self._named_profile(profile)
        request = planning_pb2.ListFloorsRequest(
            map=self.name, at=None if at is None else plan.endpoint(at), profile=plan.profile_to_proto(profile or {}),
            min_area_m2=min_area, cells=cells)
        return floors.from_proto(self._connection.unary(self._planning.ListFloors, request))

    def places(self, floor=None, *, at=None, profile=None, cells=False):
        """Places: rooms, corridors and doorways of one floor, the largest first, and which of them touch.

        floor: its number as floors() has them; at: (x, y, z) or (x, y) on it [m]; without both, the largest. profile: as for
        plan. cells: also which cell is of which place. NotFound: no such floor. ResourceExhausted: it is too large.
        """
        if isinstance(profile, str):
            profile = self._named_profile(profile)
        request = planning_pb2.ListPlacesRequest(
            map=self.name, floor=floor, at=None if at is None else plan.endpoint(at),
            profile=plan.profile_to_proto(profile or {}), cells=cells)
        return places.from_proto(self._connection.unary(self._planning.ListPlaces, request))

    def explore(self, start, *, count=5, profile=None, class_costs=None, region=None, **query):
        """Exploration: where a robot at `start` should look next, as views of space that no scan has seen.

            for view in campus.explore((3, -1, 0.4), count=3, max_range=15):
                drive_to(view.place)

        start, profile, class_costs: as for plan. region: (2, 3) lower and upper corner [m] of what is to be learnt; None:
        what the sensor may see. query: budget [m], resolution [m], sensor_height [m], bits_per_m, horizon, min_bits; of the
        sensor up, down, width [rad], rows, columns, max_range [m]; what is absent takes its default, see
        `strata explore --help`. Raises ValueError and StrataError.
        """
        if isinstance(profile, str):
            profile = self._named_profile(profile)
        request = exploration.to_proto(self.name, count, region, query)
        getattr(request, "from").CopyFrom(plan.endpoint(start))
        request.profile.CopyFrom(plan.profile_to_proto(profile or {}))
        request.class_costs.extend(plan.class_cost(of, cost) for of, cost in (class_costs or {}).items())
        return exploration.from_proto(self._connection.unary(self._planning.Explore, request))

    def check_shape(self, way, mesh=None, *, parts=(), clearance=0.0, ground=0.15, unknown="ignore"):
        """ShapeCheck: whether a shape touches anything along a way, where and how deep; true if it does not.

            campus.check_shape(campus.plan(start, goal), (vertices, triangles))
            campus.check_shape(path, parts=[strata.shape.box((1.2, 0.6, 1.0), (0, 0, 0.5))], clearance=0.05)

        way: a Path, or places (n, 3) on the ground, along which the shape is turned and pitched as they lead, or poses
        (n, 4, 4) T_map_shape; swept between them. mesh: (vertices (n, 3), triangles (m, 3)) in the shape's frame: x forward,
        z up from the ground. parts: solids, of shape.box, shape.cylinder and shape.sphere. clearance: to be kept from
        everything [m]. ground: what is no higher over the ground that the shape stands on is ground [m]. unknown: "ignore"
        or "blocked", cells below it where nothing was measured. Raises ValueError and StrataError.
        """
        request = shape.to_proto(self.name, way, mesh, parts, clearance, ground, unknown)
        return shape.from_proto(self._connection.unary(self._planning.CheckShape, request))

    def planes(self):
        """PlaneModel: the walls, floors and slopes that the last job "planes" found; NotFound before there was one.

            campus.job("planes", min_area_m2=4)
            walls = [plane for plane in campus.planes().planes if plane.kind == "wall"]
        """
        request = models_pb2.GetPlaneModelRequest(map=self.name)
        return planes.from_proto(self._connection.collected(self._models.GetPlaneModel, request))

    def objects(self, class_id=0, region=None, kind=""):
        """Entities: the things that the last job "objects" found; NotFound before there was one.

        class_id: only those of this class; 0: of every class. region: only those that reach into (x0, y0, x1, y1) or
        (x0, y0, z0, x1, y1, z1), map frame [m]. kind: only those of this kind, by name or first digits of its id.

            campus.job("objects", **{"class": "car"})
            long = [car for car in campus.objects() if car.size[0] > 5]
        """
        request = objects_pb2.ListEntitiesRequest(map=self.name, class_id=class_id, region=objects.box_to_proto(region),
                                                  kind=kind)
        return objects.from_proto(self._connection.collected(self._objects.ListEntities, request))

    def kinds(self):
        """The kinds of things that the map knows, without their shapes: its library, then those found, without names."""
        answer = self._connection.unary(self._objects.ListKinds, objects_pb2.ListKindsRequest(map=self.name))
        return [objects.kind_from_proto(kind) for kind in answer.kinds]

    def kind(self, kind):
        """One of them with its shape, by name or first digits of its id; NotFound."""
        answer = self._connection.unary(self._objects.GetKind, objects_pb2.GetKindRequest(map=self.name, kind=kind))
        return objects.kind_from_proto(answer.kind, answer.shape)

    def rename_kind(self, kind, name):
        """Names a kind; it is in the map's library from then on, and later jobs recognise things of it."""
        answer = self._connection.once(self._objects.RenameKind, objects_pb2.RenameKindRequest(
            map=self.name, kind=kind, name=name))
        return objects.kind_from_proto(answer.kind)

    def import_kind(self, name, class_name, points, vertices=None, triangles=None):
        """Puts a kind into the library: (n, 3) points of its surface, and its mesh if there is one; z up [m].

            golf = campus.kind("golf")
            harbour.import_kind("golf", "car", golf.points)
        """
        answer = self._connection.once(self._objects.ImportKind, objects_pb2.ImportKindRequest(
            map=self.name, name=name, class_name=class_name,
            shape=objects.shape_to_proto(points, vertices, triangles)))
        return objects.kind_from_proto(answer.kind)

    def delete_kind(self, kind):
        """Takes a kind out of the library; things of it are of none then."""
        self._connection.once(self._objects.DeleteKind, objects_pb2.DeleteKindRequest(map=self.name, kind=kind))

    def inferred(self, class_id=0, region=None, kind=""):
        """What the last job "complete" inferred of things by others of their kinds, by entity: where nobody looked.

        Arguments as of objects(). NotFound where nothing was inferred since the last job "objects".

            campus.job("complete")
            for part in campus.inferred():
                print(part.entity, len(part.points))
        """
        request = objects_pb2.ListInferredRequest(map=self.name, class_id=class_id, region=objects.box_to_proto(region),
                                                  kind=kind)
        answers = self._connection.collected(self._objects.ListInferred, request)
        return objects.inferred_from_proto(answers)

    def _named_profile(self, name):
        profiles = self.profiles()
        if name not in profiles:
            raise errors.NotFound(f"profile {name!r} of map {self.name}; it has {', '.join(sorted(profiles))}")
        return profiles[name]

    def profiles(self):
        """All profiles by name, "default" among them, each as Map.plan takes it."""
        answer = self._connection.unary(self._planning.ListProfiles,
                                        planning_pb2.ListProfilesRequest(map=self.name))
        return {name: plan.profile_from_proto(profile) for name, profile in answer.profiles.items()}

    def set_profile(self, name, profile):
        """Makes or replaces a profile; that named "default" re-annotates the tiles."""
        self._connection.unary(self._planning.SetProfile, planning_pb2.SetProfileRequest(
            map=self.name, name=name, profile=plan.profile_to_proto(profile)))

    # Changes and jobs

    def watch(self, since=0, *, epoch=0, trajectory=None, tiles=True, once=False):
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
                for answer in self._connection.stream(self._maps.Watch, request, endless=True):
                    request.since, request.epoch = answer.commit_sequence, answer.epoch
                    backoff = self._connection.new_backoff()
                    yield _change(answer)
                return
            except errors.StrataError as failure:
                backoff.wait(failure)

    def start_job(self, kind, **parameters):
        """Queues a Job of a kind that `strata job start --help` lists, with its parameters."""
        answer = self._connection.once(self._jobs.Start, jobs_pb2.StartJobRequest(
            map=self.name, kind=kind, parameters=job.parameters(parameters)))
        return job.from_proto(answer.job)

    def follow_job(self, which, progress=None):
        """The Job once it has ended; progress(job) is called at every change, some ten times a second at most.

        Raises FailedPrecondition if it failed or was cancelled.
        """
        request = jobs_pb2.WatchJobRequest(map=self.name, id=which.id)
        backoff = self._connection.new_backoff()
        while not which.ended:
            try:
                for answer in self._connection.stream(self._jobs.Watch, request, endless=True):
                    which = job.from_proto(answer.job)
                    backoff = self._connection.new_backoff()
                    if progress is not None:
                        progress(which)
            except errors.StrataError as failure:
                backoff.wait(failure)
        if which.state not in ("succeeded", "proposed"):
            raise errors.FailedPrecondition(f"{which.kind} job {which.id} {which.state}: {which.message}")
        return which

    def job(self, kind, *, progress=None, **parameters):
        """Starts a Job and follows it to its end: map.job("optimize", rounds=3)."""
        return self.follow_job(self.start_job(kind, **parameters), progress)

    def optimize(self, *, progress=None, **parameters):
        """Makes all poses globally consistent; map.job("optimize", …)."""
        return self.job("optimize", progress=progress, **parameters)

    def jobs(self):
        """All Jobs, by id."""
        answer = self._connection.unary(self._jobs.List, jobs_pb2.ListJobsRequest(map=self.name))
        return [job.from_proto(message) for message in answer.jobs]

    def cancel_job(self, which):
        """Asks a Job to end."""
        answer = self._connection.unary(self._jobs.Cancel, jobs_pb2.CancelJobRequest(map=self.name, id=which.id))
        return job.from_proto(answer.job)

    def accept_job(self, which):
        """Makes what is proposed real; the Job, queued again."""
        answer = self._connection.once(self._jobs.Accept, jobs_pb2.AcceptJobRequest(map=self.name, id=which.id))
        return job.from_proto(answer.job)

    def revert_job(self, which):
        """Forgets a proposal, or undoes what a Job did; the Job that is cancelled, or the new one that undoes."""
        answer = self._connection.once(self._jobs.Revert, jobs_pb2.RevertJobRequest(map=self.name, id=which.id))
        return job.from_proto(answer.job)


def _change(answer):
    scans = [ScanChange(change.id.trajectory, change.id.sequence, scan.state_name(change.state),
                        poses.from_proto(change.pose), change.gone) for change in answer.scans]
    tiles = {TileKey(tile.key.level, tile.key.x, tile.key.y): None if tile.gone else tile.version
             for tile in answer.tiles}
    return Change(answer.commit_sequence, answer.epoch, answer.epoch_reason, scans, tiles, answer.whole)
