"""Where a robot should look next."""
import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from strata import poses
from strata.arrays import Array, ArrayLike
from strata.v1 import planning_pb2


@dataclasses.dataclass(frozen=True)
class View:
    """From where to look."""

    pose: Array
    """(4, 4) T_map_sensor, upright."""
    place: Array
    """(3,) below it, on the surface, map frame [m]."""
    gain_bits: float
    """Expected to be learnt, after the views before; ground that nobody has seen counts ten times."""
    volume: float
    """Unknown space that is known then [m³]."""
    cost: float
    """Of the way there from the view before, as Path.cost [m]."""
    utility_bits: float
    """gain_bits less bits_per_m · cost."""


@dataclasses.dataclass(frozen=True)
class Exploration:
    """Views in the order in which to drive to them; true if there are any, and iterates over them."""

    reason: str
    """views, explored or start_not_on_surface."""
    message: str
    """The same for people, with numbers."""
    views: list[View]
    stands: int
    """Places that were compared."""
    region: Array | None
    """(2, 3) lower and upper corner of what was looked at, map frame [m]; None: the start is on no surface."""
    known_volume: float
    """Of the region, free or occupied [m³]."""
    region_volume: float
    """Of the region [m³]."""
    scans: int
    """Whose rays it is known by."""
    scans_left_out: int
    """That may have seen it, but whose points are gone or damaged."""
    nearest: Array | None
    """(3,) start not on a surface: the nearest place where this robot could stand."""
    epoch: int
    """Of which the answer is."""

    def __bool__(self) -> bool:
        return bool(self.views)

    def __iter__(self) -> Iterator[View]:
        return iter(self.views)

    def __len__(self) -> int:
        return len(self.views)


def _numbers(message: Any, skip: set[str]) -> dict[str, str]:
    return {field.name.removesuffix("_m").removesuffix("_rad"): field.name
            for field in message.DESCRIPTOR.fields if field.type != field.TYPE_MESSAGE and field.name not in skip}


_QUERY = _numbers(planning_pb2.ExploreRequest, {"map", "count"}) | {"bits_per_m": "bits_per_m"}
_QUERY.pop("bits_per", None)
_SENSOR = _numbers(planning_pb2.FieldOfView, set())


def to_proto(name: str, count: int, region: ArrayLike | None, query: Mapping[str, float]) -> planning_pb2.ExploreRequest:
    """What is no number of the query or its sensor is a ValueError."""
    unknown = sorted(set(query) - set(_QUERY) - set(_SENSOR))
    if unknown:
        raise ValueError(f"explore has no {', '.join(unknown)}; it has {', '.join([*_QUERY, *_SENSOR])}")
    request = planning_pb2.ExploreRequest(map=name, count=count)
    for key, value in query.items():
        if key in _QUERY:
            setattr(request, _QUERY[key], value)
        else:
            setattr(request.sensor, _SENSOR[key], value)
    if region is not None:
        region = np.asarray(region, dtype=float)
        if region.shape != (2, 3):
            raise ValueError(f"region of shape {region.shape}; expected (2, 3)")
        for corner, numbers in (("region_min", region[0]), ("region_max", region[1])):
            target = getattr(request, corner)
            target.x, target.y, target.z = numbers.tolist()
    return request


def from_proto(message: planning_pb2.ExploreResponse) -> Exploration:
    has_region = message.HasField("region_min") and message.HasField("region_max")
    return Exploration(
        reason=planning_pb2.ExploreReason.Name(message.reason).removeprefix("EXPLORE_REASON_").lower(),
        message=message.message,
        views=[View(pose=poses.from_proto(view.pose), place=poses.array3(view.place), gain_bits=view.gain_bits,
                    volume=view.volume_m3, cost=view.cost_m, utility_bits=view.utility_bits) for view in message.views],
        stands=message.stands,
        region=np.array([poses.array3(message.region_min), poses.array3(message.region_max)]) if has_region else None,
        known_volume=message.known_m3,
        region_volume=message.region_m3,
        scans=message.scans,
        scans_left_out=message.scans_left_out,
        nearest=poses.array3(message.nearest) if message.HasField("nearest") else None,
        epoch=message.epoch)
