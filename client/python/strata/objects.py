"""The things in a map."""
import collections.abc
import dataclasses

import numpy as np

from strata import errors, poses
from strata.v1 import geometry_pb2

_ANY_HEIGHT = 1e7


@dataclasses.dataclass(frozen=True)
class Entity:
    """Points of one class that lie together: a car, a window, a bench. Its box stands upright."""

    id: int
    """Counts from 1, by class and falling number of points; of this job only."""
    class_id: int
    centre: np.ndarray
    """(3,) of the box, map frame [m]."""
    size: np.ndarray
    """(3,) length, width and height of the box [m]."""
    yaw: float
    """Of the length, from x to y, in [0, pi) [rad]."""
    radius: float
    """Largest distance of a point from the middle of its points [m]."""
    points: int
    scans: dict
    """(trajectory, sequence) of each scan that saw it: how many points it saw."""


@dataclasses.dataclass(frozen=True)
class Entities(collections.abc.Sequence):
    """Entities by id; a sequence of them."""

    entities: list
    epoch: int
    """Whose poses they stand on."""
    job: int
    """That found them."""
    distances: dict
    """By class id, how near points are one entity [m]."""

    def __len__(self):
        return len(self.entities)

    def __getitem__(self, index):
        return self.entities[index]


def box_to_proto(region):
    if region is None:
        return None
    numbers = [float(number) for number in region]
    if len(numbers) == 4:
        numbers = [*numbers[:2], -_ANY_HEIGHT, *numbers[2:], _ANY_HEIGHT]
    if len(numbers) != 6:
        raise ValueError(f"region takes 4 or 6 numbers, got {len(numbers)}")
    low, high = (geometry_pb2.Vector3(x=x, y=y, z=z) for x, y, z in (numbers[:3], numbers[3:]))
    return geometry_pb2.Box3(min=low, max=high)


def _entity(message):
    return Entity(
        id=message.id, class_id=message.class_id, centre=poses.array3(message.box.centre),
        size=poses.array3(message.box.size), yaw=message.box.yaw_rad, radius=message.radius_m, points=message.points,
        scans={(seen.scan.trajectory, seen.scan.sequence): seen.points for seen in message.scans})


def from_proto(answers):
    if not answers or not answers[-1].HasField("search"):
        raise errors.DataLoss("the answer ended before its last message")
    search = answers[-1].search
    return Entities(entities=[_entity(answer.entity) for answer in answers[:-1]], epoch=search.epoch, job=search.job,
                    distances={reach.class_id: reach.distance_m for reach in search.reaches})
