"""Strata, a map database for robots in 3D: its client for Python.

    with strata.connect("127.0.0.1:50051") as db:
        campus = db.create_map("campus")
        campus.upload(points, pose)

Metres, radians, seconds; right-handed, z up. T_a_b maps coordinates in frame b into frame a: p_a = T_a_b · p_b.
"""
from strata.database import Database, connect
from strata.errors import (AlreadyExists, Cancelled, DataLoss, DeadlineExceeded, FailedPrecondition, InvalidArgument,
                           NotFound, PermissionDenied, ResourceExhausted, StrataError, Unauthenticated, Unavailable,
                           Unimplemented)
from strata.exploration import Exploration, View
from strata.heights import Heights
from strata.job import Job
from strata.map import Change, Map, ScanChange, Stats
from strata.mesh import Mesh
from strata.plan import Path
from strata.registration import Registration, register
from strata.scan import Ack, Points, Scan
from strata.shape import Contact, ShapeCheck
from strata.tiles import NON_TRAVERSABLE, SURFACE, TRAVERSABLE, UNDERSIDE, UNKNOWN, Tile, TileKey, decode_tile
from strata.tracking import TrackedPose, Tracking

__all__ = [
    "AlreadyExists", "Cancelled", "DataLoss", "DeadlineExceeded", "FailedPrecondition", "InvalidArgument", "NotFound",
    "PermissionDenied", "ResourceExhausted", "StrataError", "Unauthenticated", "Unavailable", "Unimplemented",
    "Ack", "Change", "Contact", "Database", "Exploration", "Heights", "Job", "Map", "Mesh", "NON_TRAVERSABLE", "Path", "Points", "Registration", "SURFACE", "Scan",
    "ScanChange", "ShapeCheck", "Stats", "TRAVERSABLE", "Tile", "TileKey", "TrackedPose", "Tracking", "UNDERSIDE", "UNKNOWN", "View", "connect", "decode_tile", "register",
]
