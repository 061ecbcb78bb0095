"""Shapes of robots, arms and loads along a way."""
import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np

from strata import plan, poses
from strata.arrays import Array, ArrayLike
from strata.v1 import planning_pb2


@dataclasses.dataclass(frozen=True)
class Contact:
    """A stretch of the way where the shape touches something."""

    begin: float
    """Along the way, of the shape's origin [m]."""
    end: float
    """Along the way [m]."""
    where: Array
    """(3,) where it is deepest, map frame [m]."""
    depth: float
    """How deep it is there [m]; of unknown ground 0."""
    class_id: int
    """Of the surface there; 0: none."""
    unknown: bool
    """Nothing but unknown ground."""
    inferred: bool = False
    """Nobody measured what is there: it was inferred."""


@dataclasses.dataclass(frozen=True)
class ShapeCheck:
    """Whether a shape touches anything along its way; true if it does not."""

    free: bool
    message: str
    """The same for people, with numbers."""
    free_length: float
    """Along the way, up to the first contact [m]."""
    length: float
    """Of the way [m]."""
    contacts: list[Contact]
    """In order along the way."""
    looks: int
    """Poses looked at."""
    epoch: int
    """Of which the answer is."""

    def __bool__(self) -> bool:
        return self.free


def _part(kind: planning_pb2.ShapeKind, size: ArrayLike, pose: ArrayLike) -> planning_pb2.ShapePart:
    return planning_pb2.ShapePart(kind=kind, size=poses.vector3(size), pose=poses.to_proto(_matrix(pose)))


def _matrix(pose: ArrayLike) -> Array:
    """A (4, 4) pose, or one that is only a place (3,)."""
    pose = np.asarray(pose, dtype=float)
    if pose.shape != (3,):
        return pose
    matrix = np.eye(4)
    matrix[:3, 3] = pose
    return matrix


def box(size: ArrayLike, pose: ArrayLike = (0, 0, 0)) -> planning_pb2.ShapePart:
    """A box of edges `size` (3,) with its middle at pose, a place (3,) or (4, 4) T_shape_part."""
    return _part(planning_pb2.SHAPE_KIND_BOX, size, pose)


def cylinder(radius: float, height: float, pose: ArrayLike = (0, 0, 0)) -> planning_pb2.ShapePart:
    """A cylinder along z with its middle at pose."""
    return _part(planning_pb2.SHAPE_KIND_CYLINDER, (radius, 0, height), pose)


def sphere(radius: float, place: ArrayLike = (0, 0, 0)) -> planning_pb2.ShapePart:
    """A sphere around a place."""
    return _part(planning_pb2.SHAPE_KIND_SPHERE, (radius, 0, 0), place)


def _add_mesh(mesh: Sequence[ArrayLike], message: planning_pb2.CollisionShape) -> None:
    vertices, triangles = np.asarray(mesh[0], dtype=np.float32), np.asarray(mesh[1])
    if vertices.ndim != 2 or vertices.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError(f"a mesh of shapes {vertices.shape} and {triangles.shape}; expected (n, 3) and (m, 3)")
    if triangles.size and (triangles.min() < 0 or triangles.max() >= len(vertices)):
        raise ValueError(f"a triangle has a vertex beyond the {len(vertices)} there are")
    message.xyz.extend(vertices.ravel().tolist())
    message.triangles.extend(triangles.ravel().tolist())


def to_proto(name: str, way: plan.Path | ArrayLike, mesh: Sequence[ArrayLike] | None,
             parts: Iterable[planning_pb2.ShapePart], clearance: float, ground: float,
             unknown: str) -> planning_pb2.CheckShapeRequest:
    if unknown not in ("ignore", "blocked"):
        raise ValueError(f'unknown is {unknown!r}; expected "ignore" or "blocked"')
    request = planning_pb2.CheckShapeRequest(map=name, clearance_m=clearance, ground_m=ground,
                                             unknown_blocks=unknown == "blocked")
    if mesh is not None:
        _add_mesh(mesh, request.shape)
    request.shape.parts.extend(parts)
    way = np.asarray(way.points if isinstance(way, plan.Path) else way, dtype=float)
    if way.ndim == 3 and way.shape[1:] == (4, 4):
        request.poses.extend(poses.to_proto(pose) for pose in way)
    elif way.ndim == 2 and way.shape[1] == 3:
        request.waypoints.extend(poses.vector3(place) for place in way)
    else:
        raise ValueError(f"a way of shape {way.shape}; expected places (n, 3) or poses (n, 4, 4)")
    return request


def from_proto(message: planning_pb2.CheckShapeResponse) -> ShapeCheck:
    return ShapeCheck(
        free=message.free,
        message=message.message,
        free_length=message.free_m,
        length=message.length_m,
        contacts=[Contact(begin=c.from_m, end=c.to_m, where=poses.array3(c.where), depth=c.depth_m, class_id=c.class_id,
                          unknown=c.unknown, inferred=c.inferred) for c in message.contacts],
        looks=message.looks,
        epoch=message.epoch)
