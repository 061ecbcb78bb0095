"""Rooms, corridors and doorways of a floor."""
import dataclasses

import numpy as np

from strata.arrays import Array
from strata.floors import BLOCK, bits
from strata.v1 import planning_pb2

_KINDS = {planning_pb2.PLACE_KIND_ROOM: "room", planning_pb2.PLACE_KIND_CORRIDOR: "corridor",
          planning_pb2.PLACE_KIND_DOORWAY: "doorway"}
NO_PLACE = -1
"""Value of Places.grid where no robot can be."""


@dataclasses.dataclass(frozen=True)
class Place:
    """Free cells of one kind that hang together."""

    kind: str
    """"room", "corridor" or "doorway"."""
    area: float
    """Of the free cells [m²]."""
    low: Array
    """(2,) lower corner of the box around the free cells, map frame [m]."""
    high: Array
    """(2,) its upper corner."""
    middle: Array
    """(2,) a place to stand, near the middle."""
    neighbours: tuple[int, ...]
    """Indices into Places.places of those that it touches, rising."""


@dataclasses.dataclass(frozen=True)
class Places:
    """The places of one floor, the largest first."""

    places: list[Place]
    floor: int | None
    """Number of the floor; None: the map has none."""
    grid: Array | None
    """(ny, nx) int32: index of the place of each cell or NO_PLACE, row 0 the lowest y; None unless cells were asked for."""
    origin: tuple[float, float] | None
    """(x, y) of the grid's lower left corner, map frame [m]."""
    cell_size: float
    """Of the map and of the grid [m]."""
    epoch: int
    """Of which the answer is."""
    commit_sequence: int
    """The state of the map that the answer is of."""
    message: str = ""
    """For people: what is to be known of what was inferred; else empty."""


def _grid(message: planning_pb2.ListPlacesResponse) -> tuple[Array, tuple[float, float]] | tuple[None, None]:
    blocks = [(b.x, b.y, b.cells, number) for number, place in enumerate(message.places) for b in place.blocks]
    if not blocks:
        return None, None
    x0, y0 = min(b[0] for b in blocks), min(b[1] for b in blocks)
    nx, ny = max(b[0] for b in blocks) - x0 + 1, max(b[1] for b in blocks) - y0 + 1
    grid = np.full((ny * BLOCK, nx * BLOCK), NO_PLACE, np.int32)
    for x, y, cells, number in blocks:
        row, column = (y - y0) * BLOCK, (x - x0) * BLOCK
        grid[row:row + BLOCK, column:column + BLOCK][bits(cells)] = number
    return grid, (x0 * BLOCK * message.cell_size_m, y0 * BLOCK * message.cell_size_m)


def from_proto(message: planning_pb2.ListPlacesResponse) -> Places:
    grid, origin = _grid(message)
    return Places(
        places=[Place(kind=_KINDS.get(place.kind, "unknown"), area=place.area_m2,
                      low=np.array([place.low.x, place.low.y]), high=np.array([place.high.x, place.high.y]),
                      middle=np.array([place.middle.x, place.middle.y]), neighbours=tuple(place.neighbours))
                for place in message.places],
        floor=message.floor if message.HasField("floor") else None,
        grid=grid, origin=origin, cell_size=message.cell_size_m, epoch=message.epoch,
        commit_sequence=message.commit_sequence, message=message.message)
