"""One map: upload, fetch, plan, watch, jobs. What each method does, and how, stands in strata.aio."""
from types import TracebackType

from strata import aio
from strata.blocking import blocking, blocking_made, blocking_stream


class Tracking:
    """A robot that is followed; made by Map.follow. A context manager. One thread at a time."""

    def __init__(self, asynchronous: aio.Tracking) -> None:
        self._asynchronous = asynchronous

    def __enter__(self) -> "Tracking":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    step = blocking(aio.Tracking.step)
    close = blocking(aio.Tracking.close)


class Map:
    """A map on a server; made by Database.map and Database.create_map. Thread-safe."""

    def __init__(self, asynchronous: aio.Map) -> None:
        self._asynchronous = asynchronous

    def __repr__(self) -> str:
        return f"<strata.Map {self.name}>"

    @property
    def name(self) -> str:
        return self._asynchronous.name

    @property
    def cell_size(self) -> float:
        """Edge of a cell [m]."""
        return self._asynchronous.cell_size

    @property
    def trajectory(self) -> str:
        """Of uploads that name none; this object's own."""
        return self._asynchronous.trajectory

    # Scans

    upload = blocking(aio.Map.upload)
    ingest = blocking_stream(aio.Map.ingest)
    upload_local_map = blocking(aio.Map.upload_local_map)
    last_sequence = blocking(aio.Map.last_sequence)
    scan = blocking(aio.Map.scan)
    scans = blocking(aio.Map.scans)
    points = blocking(aio.Map.points)
    faded = blocking(aio.Map.faded)
    set_labels = blocking(aio.Map.set_labels)
    delete_scan = blocking(aio.Map.delete_scan)
    follow = blocking_made(aio.Map.follow, Tracking)

    # Surfaces and changes

    fetch = blocking(aio.Map.fetch)
    changes = blocking_stream(aio.Map.changes)
    tile = blocking(aio.Map.tile)
    tiles = blocking(aio.Map.tiles)
    surfaces = blocking(aio.Map.surfaces)
    mesh = blocking(aio.Map.mesh)
    heights = blocking(aio.Map.heights)
    watch = blocking_stream(aio.Map.watch)

    # Planning

    plan = blocking(aio.Map.plan)
    check_path = blocking(aio.Map.check_path)
    watch_path = blocking_stream(aio.Map.watch_path)
    floors = blocking(aio.Map.floors)
    places = blocking(aio.Map.places)
    explore = blocking(aio.Map.explore)
    check_shape = blocking(aio.Map.check_shape)
    profiles = blocking(aio.Map.profiles)
    set_profile = blocking(aio.Map.set_profile)

    # Things, planes, classifiers

    planes = blocking(aio.Map.planes)
    objects = blocking(aio.Map.objects)
    kinds = blocking(aio.Map.kinds)
    kind = blocking(aio.Map.kind)
    rename_kind = blocking(aio.Map.rename_kind)
    import_kind = blocking(aio.Map.import_kind)
    delete_kind = blocking(aio.Map.delete_kind)
    inferred = blocking(aio.Map.inferred)
    classifiers = blocking(aio.Map.classifiers)
    classifier = blocking(aio.Map.classifier)
    delete_classifier = blocking(aio.Map.delete_classifier)
    export_classifier = blocking(aio.Map.export_classifier)
    import_classifier = blocking(aio.Map.import_classifier)

    # Pose graph

    pose_graph = blocking(aio.Map.pose_graph)
    lookup_pose = blocking(aio.Map.lookup_pose)
    set_pose = blocking(aio.Map.set_pose)
    add_constraint = blocking(aio.Map.add_constraint)
    remove_constraint = blocking(aio.Map.remove_constraint)
    enable_constraint = blocking(aio.Map.enable_constraint)
    localize = blocking(aio.Map.localize)

    # Jobs

    start_job = blocking(aio.Map.start_job)
    find_job = blocking(aio.Map.find_job)
    follow_job = blocking(aio.Map.follow_job)
    job = blocking(aio.Map.job)
    optimize = blocking(aio.Map.optimize)
    jobs = blocking(aio.Map.jobs)
    cancel_job = blocking(aio.Map.cancel_job)
    accept_job = blocking(aio.Map.accept_job)
    revert_job = blocking(aio.Map.revert_job)

    # The map itself

    stats = blocking(aio.Map.stats)
    history = blocking(aio.Map.history)
    classes = blocking(aio.Map.classes)
    set_class = blocking(aio.Map.set_class)
    backup = blocking(aio.Map.backup)
    origin = blocking(aio.Map.origin)
    set_origin = blocking(aio.Map.set_origin)
    wait = blocking(aio.Map.wait)
