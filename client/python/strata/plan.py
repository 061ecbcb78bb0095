"""Paths, and what robots are."""
import dataclasses

import numpy as np

from strata import poses
from strata.tiles import TileKey
from strata.v1 import planning_pb2, robot_profile_pb2


@dataclasses.dataclass(frozen=True)
class Path:
    """A path, or the reason why there is none; true if there is one."""

    reason: str
    """found, start_not_on_surface, goal_not_on_surface, blocked, unknown_ground or search_limit."""
    message: str
    """The same for people, with numbers."""
    points: np.ndarray
    """(n, 3) on the surfaces, map frame [m]; empty unless found."""
    length: float
    """Along the points [m]."""
    cost: float
    """Sum of length · (1 + danger) · factor of the class [m]."""
    gaps: list
    """[(from, to)] where the path bridges unobserved cells, each (3,), map frame [m]."""
    epoch: int
    """Of which the answer is."""
    tiles: list
    """TileKeys that the path stands on."""
    where: np.ndarray | None
    """(3,) where the trouble is, map frame [m]; None if found."""
    obstruction: str
    """Of what kind it is: step, slope, clearance, drop, obstacle, roughness, unknown, class; "" if none."""
    obstruction_value: float
    """How much of it [m, or rad of a slope]."""
    nearest: np.ndarray | None
    """(3,) start or goal not on a surface: the nearest place where this robot could stand."""

    def __bool__(self):
        return self.reason == "found"


def _name(enum, value, prefix):
    return enum.Name(value).removeprefix(prefix).lower()


def _maybe(message, field):
    return poses.array3(getattr(message, field)) if message.HasField(field) else None


def from_proto(message):
    obstruction = _name(planning_pb2.Obstruction, message.obstruction, "OBSTRUCTION_")
    return Path(
        reason=_name(planning_pb2.PlanReason, message.reason, "PLAN_REASON_"),
        message=message.message,
        points=np.array([(p.x, p.y, p.z) for p in message.waypoints]).reshape(-1, 3),
        length=message.length_m,
        cost=message.cost,
        gaps=[(poses.array3(getattr(gap, "from")), poses.array3(gap.to)) for gap in message.gaps],
        epoch=message.epoch,
        tiles=[TileKey(key.level, key.x, key.y) for key in message.tiles],
        where=_maybe(message, "where"),
        obstruction="" if obstruction == "unspecified" else obstruction,
        obstruction_value=message.obstruction_value,
        nearest=_maybe(message, "nearest"))


def endpoint(place):
    """(x, y): the lowest surface; (x, y, z): the one nearest in height to z."""
    numbers = [float(number) for number in place]
    if len(numbers) not in (2, 3):
        raise ValueError(f"place {place}; expected (x, y) or (x, y, z)")
    return planning_pb2.PlanEndpoint(**dict(zip(("x_m", "y_m", "z_m"), numbers)))


_PROFILE_FIELDS = {field.name.removesuffix("_m").removesuffix("_rad"): field.name
                   for field in robot_profile_pb2.RobotProfile.DESCRIPTOR.fields}


def profile_to_proto(profile):
    """A robot from {"radius": 0.3, "height": 1, "max_step": 0.15, …}; what is absent takes its default."""
    unknown = sorted(set(profile) - set(_PROFILE_FIELDS))
    if unknown:
        raise ValueError(f"profile has no {', '.join(unknown)}; it has {', '.join(_PROFILE_FIELDS)}")
    return robot_profile_pb2.RobotProfile(**{_PROFILE_FIELDS[name]: value for name, value in profile.items()})


def profile_from_proto(message):
    return {name: getattr(message, field) for name, field in _PROFILE_FIELDS.items()}


def class_cost(class_id, cost):
    """cost: a factor ≥ 1, or None where the robot must not go."""
    given = {"forbidden": True} if cost is None else {"factor": cost}
    return planning_pb2.ClassCost(class_id=class_id, **given)
