"""Paths, and what robots are."""
import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from strata import poses
from strata.arrays import Array, ArrayLike
from strata.tiles import TileKey, key_from_proto
from strata.v1 import geometry_pb2, planning_pb2, robot_profile_pb2


@dataclasses.dataclass(frozen=True)
class Path:
    """A path, or the reason why there is none; true if there is one."""

    reason: str
    """found, start_not_on_surface, goal_not_on_surface, blocked, unknown_ground or search_limit."""
    message: str
    """The same for people, with numbers."""
    points: Array
    """(n, 3) on the surfaces, map frame [m]; empty unless found."""
    length: float
    """Along the points [m]."""
    cost: float
    """Sum of length · (1 + danger) · factor of the class [m]."""
    gaps: list[tuple[Array, Array]]
    """[(from, to)] where the path bridges unobserved cells, each (3,), map frame [m]."""
    epoch: int
    """Of which the answer is."""
    tiles: list[TileKey]
    """TileKeys that the path stands on."""
    where: Array | None
    """(3,) where the trouble is, map frame [m]; None if found."""
    obstruction: str
    """Of what kind it is: step, slope, clearance, drop, obstacle, roughness, unknown, class; "" if none."""
    obstruction_value: float
    """How much of it [m, or rad of a slope]."""
    nearest: Array | None
    """(3,) start or goal not on a surface: the nearest place where this robot could stand."""
    inferred: bool = False
    """Nobody measured what is there: it was inferred."""

    def __bool__(self) -> bool:
        return self.reason == "found"


def _name(enum: Any, value: int, prefix: str) -> str:
    return str(enum.Name(value)).removeprefix(prefix).lower()


def _maybe(message: planning_pb2.PlanPathResponse | planning_pb2.PathCheck, field: str) -> Array | None:
    return poses.array3(getattr(message, field)) if message.HasField(field) else None


def _obstruction(value: int) -> str:
    name = _name(planning_pb2.Obstruction, value, "OBSTRUCTION_")
    return "" if name == "unspecified" else name


def from_proto(message: planning_pb2.PlanPathResponse) -> Path:
    return Path(
        reason=_name(planning_pb2.PlanReason, message.reason, "PLAN_REASON_"),
        message=message.message,
        points=np.array([(p.x, p.y, p.z) for p in message.waypoints]).reshape(-1, 3),
        length=message.length_m,
        cost=message.cost,
        gaps=[(poses.array3(getattr(gap, "from")), poses.array3(gap.to)) for gap in message.gaps],
        epoch=message.epoch,
        tiles=[key_from_proto(key) for key in message.tiles],
        where=_maybe(message, "where"),
        obstruction=_obstruction(message.obstruction),
        obstruction_value=message.obstruction_value,
        nearest=_maybe(message, "nearest"),
        inferred=message.inferred)


def endpoint(place: ArrayLike) -> planning_pb2.PlanEndpoint:
    """(x, y): the lowest surface; (x, y, z): the one nearest in height to z."""
    numbers: list[float] = np.asarray(place, dtype=float).ravel().tolist()
    if len(numbers) not in (2, 3):
        raise ValueError(f"place {place!r}; expected (x, y) or (x, y, z)")
    return planning_pb2.PlanEndpoint(x_m=numbers[0], y_m=numbers[1], z_m=numbers[2] if len(numbers) == 3 else None)


_PROFILE_FIELDS: dict[str, str] = {field.name.removesuffix("_m").removesuffix("_rad"): field.name
                   for field in robot_profile_pb2.RobotProfile.DESCRIPTOR.fields}


def profile_to_proto(profile: Mapping[str, float]) -> robot_profile_pb2.RobotProfile:
    """A robot from {"radius": 0.3, "height": 1, "max_step": 0.15, …}; what is absent takes its default."""
    unknown = sorted(set(profile) - set(_PROFILE_FIELDS))
    if unknown:
        raise ValueError(f"profile has no {', '.join(unknown)}; it has {', '.join(_PROFILE_FIELDS)}")
    return robot_profile_pb2.RobotProfile(**{_PROFILE_FIELDS[name]: value for name, value in profile.items()})


def profile_from_proto(message: robot_profile_pb2.RobotProfile) -> dict[str, float]:
    return {name: getattr(message, field) for name, field in _PROFILE_FIELDS.items()}


def class_costs(costs: Mapping[int, float | None] | None) -> list[planning_pb2.ClassCost]:
    """{class id: factor ≥ 1, or None where the robot must not go}."""
    return [planning_pb2.ClassCost(class_id=of, forbidden=True) if cost is None
            else planning_pb2.ClassCost(class_id=of, factor=cost) for of, cost in (costs or {}).items()]


@dataclasses.dataclass(frozen=True)
class PathCheck:
    """Whether a path may be driven as it is; true if so."""

    valid: bool
    message: str
    """The same for people, with numbers."""
    valid_length: float
    """Along it, as far as it holds [m]."""
    length: float
    """Of all of it [m]."""
    where: Array | None
    """(3,) what is in the way behind that, map frame [m]; None if it holds."""
    obstruction: str
    """Of what kind, as of a Path; "" if none."""
    obstruction_value: float
    """How much of it [m, or rad of a slope]."""
    epoch: int
    """Of which the answer is."""
    commit_sequence: int
    """The state of the map that the answer is of."""
    proto: planning_pb2.PathCheck = dataclasses.field(repr=False, compare=False)
    """As it came; for check_path(known=…)."""
    inferred: bool = False
    """Nobody measured what is there: it was inferred."""

    def __bool__(self) -> bool:
        return self.valid


def check_from_proto(message: planning_pb2.PathCheck) -> PathCheck:
    return PathCheck(
        valid=message.valid, message=message.message, valid_length=message.valid_m, length=message.length_m,
        where=_maybe(message, "where"), obstruction=_obstruction(message.obstruction),
        obstruction_value=message.obstruction_value, epoch=message.epoch, commit_sequence=message.commit_sequence,
        proto=message, inferred=message.inferred)


def inferred_as(word: str) -> planning_pb2.InferredAs:
    """"ignore" or "obstacle"."""
    if word not in ("ignore", "obstacle"):
        raise ValueError(f"inferred {word!r}; expected 'ignore' or 'obstacle'")
    return planning_pb2.INFERRED_AS_OBSTACLE if word == "obstacle" else planning_pb2.INFERRED_AS_IGNORE


def waypoints(way: Path | ArrayLike) -> list[geometry_pb2.Vector3]:
    """Of a Path, or places (n, 3)."""
    places = np.asarray(way.points if isinstance(way, Path) else way, dtype=float)
    if places.ndim != 2 or places.shape[1] != 3:
        raise ValueError(f"a way of shape {places.shape}; expected places (n, 3)")
    return [poses.vector3(place) for place in places]
