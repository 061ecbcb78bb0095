"""The things in a map."""
import collections.abc
import dataclasses
import typing
from collections.abc import Sequence

import numpy as np

from strata import errors, poses
from strata.arrays import Array, ArrayLike
from strata.v1 import geometry_pb2, objects_pb2

_ANY_HEIGHT = 1e7
_ORIGINS = {objects_pb2.KIND_ORIGIN_FOUND: "found", objects_pb2.KIND_ORIGIN_NAMED: "named",
            objects_pb2.KIND_ORIGIN_IMPORTED: "imported"}


@dataclasses.dataclass(frozen=True)
class Kind:
    """A kind of things, of which a map may have several entities."""

    id: str
    """Twelve hexadecimal digits of its shape, the same in every map."""
    name: str
    """Empty: nobody has named it."""
    class_id: int
    origin: str
    """"found" by the last job, "named" by a person, or "imported"; found ones are not in the library."""
    size: Array
    """(3,) length, width and height of the box around its points [m]."""
    entities: int
    """Of the map that are of it; 0 where they were not counted."""
    points: Array | None = None
    """(n, 3) of its shape, in its own frame [m]; None where it was not asked for."""
    vertices: Array | None = None
    """(n, 3) of its surface, or None."""
    triangles: Array | None = None
    """(n, 3) of vertices, or None."""


@dataclasses.dataclass(frozen=True)
class EntityKind:
    """Which kind of thing an entity is."""

    id: str
    name: str
    """Empty: nobody has named it."""
    pose: Array
    """(4, 4) from the kind's frame into the map's."""
    residual: float
    """RMS distance of the entity's points that lie on the kind from its surface [m]."""
    overlap: float
    """Their share of the entity's points."""


@dataclasses.dataclass(frozen=True)
class Entity:
    """Points of one class that lie together: a car, a window, a bench. Its box stands upright."""

    id: int
    """Counts from 1, by class and falling number of points; of this job only."""
    class_id: int
    centre: Array
    """(3,) of the box, map frame [m]."""
    size: Array
    """(3,) length, width and height of the box [m]."""
    yaw: float
    """Of the length, from x to y, in [0, pi) [rad]."""
    radius: float
    """Largest distance of a point from the middle of its points [m]."""
    points: int
    scans: dict[tuple[str, int], int]
    """(trajectory, sequence) of each scan that saw it: how many points it saw."""
    kind: EntityKind | None = None
    """None: it is like no other, or too little of it was seen."""


@dataclasses.dataclass(frozen=True)
class Entities(collections.abc.Sequence[Entity]):
    """Entities by id; a sequence of them."""

    entities: list[Entity]
    epoch: int
    """Whose poses they stand on."""
    job: int
    """That found them."""
    distances: dict[int, float]
    """By class id, how near points are one entity [m]."""

    def __len__(self) -> int:
        return len(self.entities)

    @typing.overload
    def __getitem__(self, index: int) -> Entity: ...

    @typing.overload
    def __getitem__(self, index: slice) -> list[Entity]: ...

    def __getitem__(self, index: int | slice) -> Entity | list[Entity]:
        return self.entities[index]


@dataclasses.dataclass(frozen=True)
class InferredPart:
    """What nobody saw of one entity, by what others of its kind look like."""

    entity: int
    """Its id."""
    kind: str
    """Its kind's id."""
    points: Array
    """(n, 3) where no ray went, map frame [m]."""
    agreeing: int
    """Voxels of its kind's shape where it was measured."""
    contradicting: int
    """Voxels of its kind's shape that rays went through."""


def box_to_proto(region: ArrayLike | None) -> geometry_pb2.Box3 | None:
    if region is None:
        return None
    numbers: list[float] = np.asarray(region, dtype=float).ravel().tolist()
    if len(numbers) == 4:
        numbers = [*numbers[:2], -_ANY_HEIGHT, *numbers[2:], _ANY_HEIGHT]
    if len(numbers) != 6:
        raise ValueError(f"region takes 4 or 6 numbers, got {len(numbers)}")
    low, high = (geometry_pb2.Vector3(x=x, y=y, z=z) for x, y, z in (numbers[:3], numbers[3:]))
    return geometry_pb2.Box3(min=low, max=high)


def kind_from_proto(message: objects_pb2.KindInfo, shape: objects_pb2.KindShape | None = None) -> Kind:
    arrays: dict[str, Array] = {}
    if shape is not None:
        arrays = {"points": np.reshape(np.asarray(shape.points, dtype=np.float32), (-1, 3)),
                  "vertices": np.reshape(np.asarray(shape.vertices, dtype=np.float32), (-1, 3)),
                  "triangles": np.reshape(np.asarray(shape.triangles, dtype=np.uint32), (-1, 3))}
    return Kind(id=f"{message.id:012x}", name=message.name, class_id=message.class_id,
                origin=_ORIGINS.get(message.origin, "unknown"), size=poses.array3(message.size),
                entities=message.entities, **arrays)


def shape_to_proto(points: ArrayLike, vertices: ArrayLike | None = None,
                   triangles: ArrayLike | None = None) -> objects_pb2.KindShape:
    def flat(given: ArrayLike | None, dtype: type) -> typing.Any:
        array: Array = np.asarray([] if given is None else given, dtype=dtype)
        if array.size and (array.ndim != 2 or array.shape[1] != 3):
            raise ValueError(f"array of shape {array.shape}; expected (n, 3)")
        return array.ravel().tolist()
    return objects_pb2.KindShape(points=flat(points, np.float32), vertices=flat(vertices, np.float32),
                                 triangles=flat(triangles, np.uint32))


def _entity_kind(message: objects_pb2.EntityKind) -> EntityKind:
    return EntityKind(id=f"{message.id:012x}", name=message.name, pose=poses.from_proto(message.t_map_kind),
                      residual=message.residual_m, overlap=message.overlap)


def _entity(message: objects_pb2.Entity) -> Entity:
    return Entity(
        id=message.id, class_id=message.class_id, centre=poses.array3(message.box.centre),
        size=poses.array3(message.box.size), yaw=message.box.yaw_rad, radius=message.radius_m, points=message.points,
        scans={(seen.scan.trajectory, seen.scan.sequence): seen.points for seen in message.scans},
        kind=_entity_kind(message.kind) if message.HasField("kind") else None)


def from_proto(answers: Sequence[objects_pb2.ListEntitiesResponse]) -> Entities:
    if not answers or not answers[-1].HasField("search"):
        raise errors.DataLoss("the answer ended before its last message")
    search = answers[-1].search
    return Entities(entities=[_entity(answer.entity) for answer in answers[:-1]], epoch=search.epoch, job=search.job,
                    distances={reach.class_id: reach.distance_m for reach in search.reaches})


def inferred_from_proto(answers: Sequence[objects_pb2.ListInferredResponse]) -> list[InferredPart]:
    if not answers or not answers[-1].HasField("search"):
        raise errors.DataLoss("the answer ended before its last message")
    parts = [answer.inferred for answer in answers[:-1]]
    return [InferredPart(entity=part.entity, kind=f"{part.kind:012x}", agreeing=part.agreeing,
                         contradicting=part.contradicting,
                         points=poses.array3(part.middle) + np.reshape(np.asarray(part.points, dtype=float), (-1, 3)))
            for part in parts]
