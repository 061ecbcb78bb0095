"""Strata, a map database for robots in 3D: its client for Python.

    with strata.connect("127.0.0.1:50051") as db:
        campus = db.create_map("campus")
        campus.upload(points, pose)

Metres, radians, seconds; right-handed, z up. T_a_b maps coordinates in frame b into frame a: p_a = T_a_b · p_b.
strata.aio has the same for asyncio.
"""
from strata import aio, convert, shape
from strata.classifiers import Classifier
from strata.database import Database, connect
from strata.errors import (AlreadyExists, Cancelled, DataLoss, DeadlineExceeded, FailedPrecondition, InvalidArgument,
                           NotFound, PermissionDenied, ResourceExhausted, StrataError, Unauthenticated, Unavailable,
                           Unimplemented)
from strata.exploration import Exploration, View
from strata.floors import Floors
from strata.heights import Heights
from strata.job import Job
from strata.map import Map, Tracking
from strata.maps import Change, Epoch, MapClass, ScanChange, Stats
from strata.mesh import Mesh
from strata.objects import Entities, Entity, Kind
from strata.places import Places
from strata.plan import Path, PathCheck
from strata.planes import PlaneModel
from strata.posegraph import POSE, Constraint, Localization, PoseGraph, ScanPose, poses_of
from strata.registration import Registration, register
from strata.scan import POINT, Ack, Points, Scan
from strata.shape import Contact, ShapeCheck
from strata.tiles import (NON_TRAVERSABLE, SURFACE, TRAVERSABLE, UNDERSIDE, UNKNOWN, Tile, TileInfo, TileKey,
                          decode_tile)
from strata.tracking import TrackedPose

__all__ = [
    "AlreadyExists", "Cancelled", "DataLoss", "DeadlineExceeded", "FailedPrecondition", "InvalidArgument", "NotFound",
    "PermissionDenied", "ResourceExhausted", "StrataError", "Unauthenticated", "Unavailable", "Unimplemented",
    "Ack", "Change", "Classifier", "Constraint", "Contact", "Database", "Entities", "Entity", "Epoch", "Exploration",
    "Floors", "Heights", "Job", "Kind", "Localization", "Map", "MapClass", "Mesh", "NON_TRAVERSABLE", "POINT", "POSE",
    "Path", "PathCheck", "Places", "PlaneModel", "Points", "PoseGraph", "Registration", "SURFACE", "Scan", "ScanChange",
    "ScanPose", "ShapeCheck", "Stats", "TRAVERSABLE", "Tile", "TileInfo", "TileKey", "TrackedPose", "Tracking",
    "UNDERSIDE", "UNKNOWN", "View", "aio", "connect", "convert", "decode_tile", "poses_of", "register", "shape",
]
