"""The flat surfaces of a map as polygons."""
import dataclasses
from collections.abc import Sequence

import numpy as np

from strata import errors, poses
from strata.arrays import Array
from strata.v1 import models_pb2, posegraph_pb2

_KINDS = {posegraph_pb2.PLANE_KIND_WALL: "wall", posegraph_pb2.PLANE_KIND_LEVEL: "level",
          posegraph_pb2.PLANE_KIND_SLOPED: "sloped"}


@dataclasses.dataclass(frozen=True)
class Hole:
    """What a polygon leaves out."""

    ring: Array
    """(n, 3) closed line, map frame [m]; the last point is joined to the first."""
    seen_open: bool
    """Rays passed through most of it: a window or a door. False: nothing is known about it."""


@dataclasses.dataclass(frozen=True)
class Polygon:
    """A connected piece of a plane's surface."""

    outer: Array
    """(n, 3) closed line, counterclockwise when looked at against the normal, map frame [m]."""
    holes: list[Hole]
    area: float
    """Without the holes [m²]."""


@dataclasses.dataclass(frozen=True)
class Plane:
    """The points x with normal · x = distance."""

    id: int
    normal: Array
    """(3,) unit, to where the plane was seen from."""
    distance: float
    kind: str
    """wall, level or sloped."""
    direction: int | None
    """Index into PlaneModel.directions; None: it has none."""
    area: float
    """Of its polygons; without any, of flat surface measured in it [m²]."""
    rms: float
    """Of its points' distances to it [m]."""
    polygons: list[Polygon]
    """By falling area."""
    rgb: tuple[int, ...] | None
    """Mean colour of its points, 0 to 255; None unless the job told planes apart by colours (colour=1)."""


@dataclasses.dataclass(frozen=True)
class PlaneModel:
    """The planes of a map by falling area, and their main directions by falling number of planes."""

    planes: list[Plane]
    directions: Array
    """(k, 3) unit vectors."""
    epoch: int
    """Whose poses they stand on."""
    job: int
    """That found them."""


def _ring(message: models_pb2.PlaneRing) -> Array:
    return np.asarray(message.xyz, dtype=float).reshape(-1, 3)


def _plane(message: models_pb2.ModelPlane) -> Plane:
    return Plane(
        id=message.id, normal=poses.array3(message.plane.normal), distance=message.plane.distance,
        kind=_KINDS[message.kind], direction=message.direction if message.HasField("direction") else None,
        area=message.area_m2, rms=message.rms_m,
        rgb=tuple(message.colour.to_bytes(3, "big")) if message.HasField("colour") else None,
        polygons=[Polygon(outer=_ring(polygon.outer), area=polygon.area_m2,
                          holes=[Hole(ring=_ring(hole.ring), seen_open=hole.seen_open) for hole in polygon.holes])
                  for polygon in message.polygons])


def from_proto(answers: Sequence[models_pb2.GetPlaneModelResponse]) -> PlaneModel:
    if not answers or not answers[-1].HasField("model"):
        raise errors.DataLoss("the answer ended before its last message")
    model = answers[-1].model
    return PlaneModel(planes=[_plane(answer.plane) for answer in answers[:-1]],
                      directions=np.array([poses.array3(one.direction) for one in model.directions]).reshape(-1, 3),
                      epoch=model.epoch, job=model.job)
