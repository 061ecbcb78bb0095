"""Floors of a map for a robot."""
import dataclasses

import numpy as np

from strata import poses

UNKNOWN, FREE, GROUND, OCCUPIED = 0, 1, 2, 3
"""Values of Floor.grid; GROUND was seen, and nothing stands there, but the robot's centre cannot be there."""

_BLOCK = 8


@dataclasses.dataclass(frozen=True)
class Floor:
    """Places to stand, connected by moves; of each cell one at most."""

    area: float
    """Of the free cells [m²]."""
    low: np.ndarray
    """(3,) lower corner of the box around the free cells, map frame [m]."""
    high: np.ndarray
    """(3,) its upper corner."""
    mean_z: float
    """Mean height of the free cells [m]."""
    place: np.ndarray
    """(3,) a place to stand, near the middle."""
    grid: np.ndarray | None
    """(ny, nx) uint8 of the values above, row 0 the lowest y; None unless cells were asked for."""
    origin: tuple | None
    """(x, y) of the grid's lower left corner, map frame [m]."""


@dataclasses.dataclass(frozen=True)
class Link:
    """Where one drives from one floor to another."""

    floors: tuple
    """(a, b): indices into Floors.floors."""
    place: np.ndarray
    """(3,) in the middle of the border, map frame [m]."""
    width: float
    """Of the border [m]."""
    slope: float
    """Of the ground across it [rad]."""


@dataclasses.dataclass(frozen=True)
class Floors:
    """The floors of a map, the largest first."""

    floors: list
    links: list
    at: int | None
    """Index of the floor that was asked for; None: there is none, or none was."""
    cell_size: float
    """Of the map and of grids [m]."""
    epoch: int
    """Of which the answer is."""
    commit_sequence: int
    """The state of the map that the answer is of."""


def _bits(mask):
    """(8, 8) bool, row 0 the lowest y."""
    return np.unpackbits(np.frombuffer(int(mask).to_bytes(8, "little"), np.uint8), bitorder="little").reshape(8, 8) == 1


def _grid(blocks, cell_size):
    if not blocks:
        return None, None
    x0, y0 = min(b.x for b in blocks), min(b.y for b in blocks)
    nx, ny = max(b.x for b in blocks) - x0 + 1, max(b.y for b in blocks) - y0 + 1
    grid = np.full((ny * _BLOCK, nx * _BLOCK), UNKNOWN, np.uint8)
    for block in blocks:
        row, column = (block.y - y0) * _BLOCK, (block.x - x0) * _BLOCK
        cells = grid[row:row + _BLOCK, column:column + _BLOCK]
        for mask, value in ((block.ground, GROUND), (block.occupied, OCCUPIED), (block.free, FREE)):
            cells[_bits(mask)] = value
    return grid, (x0 * _BLOCK * cell_size, y0 * _BLOCK * cell_size)


def _floor(message, cell_size):
    grid, origin = _grid(message.blocks, cell_size)
    return Floor(area=message.area_m2, low=poses.array3(message.low), high=poses.array3(message.high),
                 mean_z=message.mean_z_m, place=poses.array3(message.place), grid=grid, origin=origin)


def from_proto(message):
    return Floors(
        floors=[_floor(floor, message.cell_size_m) for floor in message.floors],
        links=[Link(floors=(link.a, link.b), place=poses.array3(link.place), width=link.width_m, slope=link.slope_rad)
               for link in message.links],
        at=message.at if message.HasField("at") else None,
        cell_size=message.cell_size_m,
        epoch=message.epoch,
        commit_sequence=message.commit_sequence)
