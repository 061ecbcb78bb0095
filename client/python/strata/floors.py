"""Floors of a map for a robot."""
import dataclasses
from collections.abc import Sequence

import numpy as np

from strata import poses
from strata.arrays import Array
from strata.v1 import planning_pb2

UNKNOWN, FREE, GROUND, OCCUPIED = 0, 1, 2, 3
"""Values of Floor.grid; GROUND was seen, and nothing stands there, but the robot's centre cannot be there."""

BLOCK = 8


@dataclasses.dataclass(frozen=True)
class Floor:
    """Places to stand, connected by moves; of each cell one at most."""

    area: float
    """Of the free cells [m²]."""
    low: Array
    """(3,) lower corner of the box around the free cells, map frame [m]."""
    high: Array
    """(3,) its upper corner."""
    mean_z: float
    """Mean height of the free cells [m]."""
    place: Array
    """(3,) a place to stand, near the middle."""
    grid: Array | None
    """(ny, nx) uint8 of the values above, row 0 the lowest y; None unless cells were asked for."""
    origin: tuple[float, float] | None
    """(x, y) of the grid's lower left corner, map frame [m]."""


@dataclasses.dataclass(frozen=True)
class Link:
    """Where one drives from one floor to another."""

    floors: tuple[int, int]
    """(a, b): indices into Floors.floors."""
    place: Array
    """(3,) in the middle of the border, map frame [m]."""
    width: float
    """Of the border [m]."""
    slope: float
    """Of the ground across it [rad]."""


@dataclasses.dataclass(frozen=True)
class Floors:
    """The floors of a map, the largest first."""

    floors: list[Floor]
    links: list[Link]
    at: int | None
    """Index of the floor that was asked for; None: there is none, or none was."""
    cell_size: float
    """Of the map and of grids [m]."""
    epoch: int
    """Of which the answer is."""
    commit_sequence: int
    """The state of the map that the answer is of."""
    message: str = ""
    """For people: what is to be known of what was inferred; else empty."""


def bits(mask: int) -> Array:
    """(8, 8) bool, row 0 the lowest y."""
    cells = np.unpackbits(np.frombuffer(int(mask).to_bytes(8, "little"), np.uint8), bitorder="little").reshape(8, 8)
    result: Array = cells == 1
    return result


def _grid(blocks: Sequence[planning_pb2.FloorBlock], cell_size: float) \
        -> tuple[Array, tuple[float, float]] | tuple[None, None]:
    if not blocks:
        return None, None
    x0, y0 = min(b.x for b in blocks), min(b.y for b in blocks)
    nx, ny = max(b.x for b in blocks) - x0 + 1, max(b.y for b in blocks) - y0 + 1
    grid = np.full((ny * BLOCK, nx * BLOCK), UNKNOWN, np.uint8)
    for block in blocks:
        row, column = (block.y - y0) * BLOCK, (block.x - x0) * BLOCK
        cells = grid[row:row + BLOCK, column:column + BLOCK]
        for mask, value in ((block.ground, GROUND), (block.occupied, OCCUPIED), (block.free, FREE)):
            cells[bits(mask)] = value
    return grid, (x0 * BLOCK * cell_size, y0 * BLOCK * cell_size)


def _floor(message: planning_pb2.Floor, cell_size: float) -> Floor:
    grid, origin = _grid(message.blocks, cell_size)
    return Floor(area=message.area_m2, low=poses.array3(message.low), high=poses.array3(message.high),
                 mean_z=message.mean_z_m, place=poses.array3(message.place), grid=grid, origin=origin)


def from_proto(message: planning_pb2.ListFloorsResponse) -> Floors:
    return Floors(
        floors=[_floor(floor, message.cell_size_m) for floor in message.floors],
        links=[Link(floors=(link.a, link.b), place=poses.array3(link.place), width=link.width_m, slope=link.slope_rad)
               for link in message.links],
        at=message.at if message.HasField("at") else None,
        cell_size=message.cell_size_m,
        epoch=message.epoch,
        commit_sequence=message.commit_sequence, message=message.message)
