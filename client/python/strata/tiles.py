"""Tiles of surfaces out of their bytes: the surface tile `SST1` of core/codec/FORMAT.md, into numpy arrays.

Numbers of a surface are told relative to those of surfaces beside it, which come before it. Kinds decide which column
a number is in, so they are read one by one. All else is read at once, and the differences are added up in waves: the
surfaces of the cells with equal x + 2 y depend on earlier waves only.
"""
import dataclasses
import operator
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xxhash

from strata import native
from strata.arrays import Array
from strata.columns import ByteReader, numbers_of
from strata.errors import DataLoss, Unimplemented
from strata.v1 import tiles_pb2

SURFACE = np.dtype([
    ("x", "f8"), ("y", "f8"),  # middle of the cell, map frame [m]
    ("z", "f4"),  # height, map frame [m]
    ("sigma", "f4"),  # standard deviation of the height [m]
    ("depth", "f4"),  # length of a vertical interval below z [m]; 0: horizontal
    ("cost", "f4"),  # path cost factor of the default profile; inf: never
    ("traversability", "u1"),  # for the default profile: UNKNOWN, TRAVERSABLE, NON_TRAVERSABLE, or UNDERSIDE
    ("class_id", "u1"),  # with the most votes; 0: none
    ("confidence", "u1"),  # share of the votes that class_id has [%]
    ("rgb", "u1", (3,)),  # red, green, blue, the mean of the points'; all 0: none known, black is 1, 1, 1
])
UNKNOWN, TRAVERSABLE, NON_TRAVERSABLE, UNDERSIDE = 0, 1, 2, 3  # UNDERSIDE: seen from below only, no ground

TILE_CELLS = 256  # along an edge
MAX_LEVEL = 12
_CELLS = TILE_CELLS * TILE_CELLS
_MAX_SURFACES = 1 << 22
_READER_VERSION = 4
_VERSION_WITH_CONFIDENCE = 2
_VERSION_WITH_UNDERSIDES = 3
_VERSION_WITH_COLOURS = 4
_OVERHEAD_BYTES = 20

# Columns, see FORMAT.md.
_SAME_KIND, _KIND, _CLASS, _HEIGHT, _DEPTH, _SIGMA, _COST, _CONFIDENCE = 0, 4, 5, 6, 10, 12, 14, 17
_COLOURED, _GREEN, _RED, _BLUE = 18, 19, 20, 21
_COLUMN_COUNT = {1: 17, 2: 18, 3: 18, 4: 22}  # by version
_MAX_SHADE = 63
_MAX_HEIGHT = (1 << 24) - 1
_NOBODY = -1  # index of a surface beside that is not there


class TileKey(NamedTuple):
    """Address of a tile."""

    level: int
    """Level of detail; 0 (finest) to 12."""
    x: int
    """Column, growing with x."""
    y: int
    """Row, growing with y."""

    def __str__(self) -> str:
        return f"{self.level}/{self.x}/{self.y}"


@dataclasses.dataclass(frozen=True)
class Tile:
    """What robots see of 256 × 256 cells of a map."""

    key: TileKey
    version: int
    """Commit sequence of the content; same key and version, same content."""
    cell_size: float
    """Edge of a cell of this level [m]."""
    surfaces: Array
    """(n,) of dtype SURFACE, by cell (rows of growing y, x grows along a row), lowest first."""


@dataclasses.dataclass(frozen=True)
class TileInfo:
    """A tile in a listing."""

    version: int
    """Commit sequence of the content."""
    bytes: int
    """Size as served."""
    surfaces: int


def key_from_proto(message: tiles_pb2.TileKey) -> TileKey:
    return TileKey(message.level, message.x, message.y)


def key_to_proto(key: TileKey) -> tiles_pb2.TileKey:
    return tiles_pb2.TileKey(level=key.level, x=key.x, y=key.y)


def _opened(blob: bytes | memoryview) -> tuple[int, memoryview]:
    """Version and body of a blob."""
    data = memoryview(blob)
    if len(data) < _OVERHEAD_BYTES:
        raise DataLoss(f"surface tile: {len(data)} bytes, fewer than an empty one has")
    if bytes(data[:4]) != b"SST1":
        raise DataLoss("surface tile: does not begin with its magic number")
    size = int.from_bytes(data[8:12], "little")
    if size != len(data) - _OVERHEAD_BYTES:
        raise DataLoss(f"surface tile: announces {size} bytes of content, has {len(data) - _OVERHEAD_BYTES}")
    if xxhash.xxh3_64_intdigest(data[:-8]) != int.from_bytes(data[-8:], "little"):
        raise DataLoss("surface tile: checksum does not match")
    oldest_reader = int.from_bytes(data[6:8], "little")
    if oldest_reader > _READER_VERSION:
        raise Unimplemented(f"surface tile: needs a reader of version {oldest_reader}, "
                            f"this one has version {_READER_VERSION}")
    return oldest_reader, data[12:-8]


def _counts(reader: ByteReader) -> Array:
    """(65536,) numbers of surfaces by cell."""
    blocks = reader.column(_CELLS // 4)
    if len(blocks) != _CELLS // 4:
        raise DataLoss(f"occupancy of {4 * len(blocks)} cells")
    blocks = blocks.reshape(TILE_CELLS // 2, TILE_CELLS // 2)
    counts: Array = np.empty((TILE_CELLS, TILE_CELLS), np.int64)
    for shift, (y, x) in ((0, (0, 0)), (2, (0, 1)), (4, (1, 0)), (6, (1, 1))):
        counts[y::2, x::2] = blocks >> shift & 3
    counts = counts.ravel()
    rest = ByteReader(reader.column(5 * _CELLS).data)
    for cell in np.flatnonzero(counts == 3):
        counts[cell] += min(rest.varint(), _MAX_SURFACES)
    if rest.remaining:
        raise DataLoss("occupancy: bytes left over")
    if counts.sum() > _MAX_SURFACES:
        raise DataLoss(f"more than {_MAX_SURFACES} surfaces")
    return counts


def _beside(cells: Array, counts: Array) -> Array:
    """(n, 4) indices of the surfaces left, up, up right and up left of each; _NOBODY where none is."""
    first = np.cumsum(counts) - counts
    layer = np.arange(len(cells)) - first[cells]
    x, y = cells % TILE_CELLS, cells // TILE_CELLS
    beside = np.empty((len(cells), 4), np.int32)
    for column, (dx, dy) in enumerate(((-1, 0), (0, -1), (1, -1), (-1, -1))):
        inside = (x + dx >= 0) & (x + dx < TILE_CELLS) & (y + dy >= 0)
        other = np.where(inside, cells + dx + TILE_CELLS * dy, 0)
        found = inside & (counts[other] > 0)
        beside[:, column] = np.where(found, first[other] + np.minimum(layer, counts[other] - 1), _NOBODY)
    return beside


def _kinds(beside: Array, columns: Sequence[Array]) -> Array:
    """(n,) kinds: traversability · 2 + vertical."""
    same = [iter(np.unpackbits(column, bitorder="little").tobytes()) for column in columns[_SAME_KIND:_KIND]]
    told = iter(columns[_KIND].tobytes())
    nobody = 255
    kinds = bytearray(len(beside) + 1)
    kinds[_NOBODY] = nobody
    i = 0
    try:
        for rows in np.array_split(beside, len(beside) // _CELLS + 1):  # lists take ten times the memory
            for left, up, up_right, up_left in rows.tolist():
                expected = kinds[left]
                if expected == nobody:
                    expected = kinds[up]
                if expected == nobody:
                    expected = others = 0
                else:
                    others = (kinds[up] == expected) + (kinds[up_left] == expected) + (kinds[up_right] == expected)
                kind = expected if next(same[others]) else next(told)
                if kind > 2 * UNDERSIDE + 1:
                    raise DataLoss(f"surface tile: surface {i} is out of range")
                kinds[i] = kind
                i += 1
    except StopIteration:
        raise DataLoss("column: fewer numbers than the tile needs") from None
    if any(operator.length_hint(bits) >= 8 for bits in same) or operator.length_hint(told):
        raise DataLoss("column: more numbers than the tile needs")
    return np.frombuffer(kinds, np.uint8)[:-1]


def _scattered(columns: Mapping[int, Array], route: Array) -> Array:
    """(n,) bytes, each the next of the column that `route` names; 0 where that is _NOBODY."""
    result = np.zeros(len(route), np.uint8)
    for index, column in columns.items():
        places = np.flatnonzero(route == index)
        if len(places) != len(column):
            raise DataLoss(f"column: {len(column)} numbers, the tile needs {len(places)}")
        result[places] = column
    return result


def _check(good: object, what: str = "surface tile: a surface is out of range") -> None:
    if not good:
        raise DataLoss(what)


class _Surroundings:
    """Which of the surfaces beside tell what to expect of a surface: (n, 4) indices, and how many they are."""

    def __init__(self, beside: Array, kinds: Array) -> None:
        vertical, traversability = kinds & 1, kinds >> 1
        nobody = 255
        same_shape = np.append(vertical, nobody)[beside] == vertical[:, None]
        same_cost = np.append(traversability, nobody)[beside] == traversability[:, None]
        self.alike = same_shape.sum(axis=1)
        self.shape_of = np.where(same_shape, beside, _NOBODY)
        left, up = beside[:, 0], beside[:, 1]
        self.shape_of[:, 0] = np.where(self.alike == 0, np.where(left == _NOBODY, up, left), self.shape_of[:, 0])
        self.shape_count = np.maximum(self.alike, 1)
        self.cost_of = np.where(same_cost, beside, _NOBODY)
        self.cost_count = np.maximum(same_cost.sum(axis=1), 1)


def _waves(cells: Array) -> tuple[Array, Array, list[slice]]:
    """The order of surfaces in which they depend on earlier waves only, their places in it, and each wave's slice."""
    n = len(cells)
    wave = cells % TILE_CELLS + 2 * (cells // TILE_CELLS)
    order = np.argsort(wave, kind="stable")
    rank = np.empty(n + 1, np.int32)
    rank[order] = np.arange(n)
    rank[_NOBODY] = n  # a row of zeros
    ends = np.append(np.flatnonzero(np.diff(wave[order])) + 1, n) if n else np.empty(0, int)
    return order, rank, [slice(begin, end) for begin, end in zip([0, *ends.tolist()], ends.tolist())]


def _summed(cells: Array, around: _Surroundings, vertical: Array, differences: Array) -> Array:
    """(n, 4) codes of height, depth, sigma and cost out of their differences to what is expected."""
    n = len(cells)
    order, rank, waves = _waves(cells)
    shape_of, cost_of = rank[around.shape_of[order]], rank[around.cost_of[order]]
    shape_count, cost_count = around.shape_count[order, None], around.cost_count[order]
    expects_depth = (vertical & (around.alike > 0))[order]
    differences = differences[order]
    codes = np.zeros((n + 1, 4), np.int64)
    for now in waves:
        count = shape_count[now]
        mean = (codes[shape_of[now]].sum(axis=1) + (count >> 1)) // count
        mean[:, 1] = expects_depth[now] * (mean[:, 1] + differences[now, 0])  # undersides continue
        count = cost_count[now]
        mean[:, 3] = (codes[cost_of[now], 3].sum(axis=1) + (count >> 1)) // count
        codes[now] = mean + differences[now]
    result = np.empty((n, 4), np.int64)
    result[order] = codes[:n]
    return result


def _colours(cells: Array, counts: Array, columns: Sequence[Array]) -> Array:
    """(n, 3) colours; zeros where none is known."""
    n = len(cells)
    if len(columns) <= _COLOURED:
        return np.zeros((n, 3), np.uint8)
    _check(len(columns[_COLOURED]) == (n + 7) // 8, "column: colours of other surfaces than the tile has")
    known = np.unpackbits(columns[_COLOURED], bitorder="little", count=n).astype(bool)
    differences = np.zeros((n, 3), np.int64)  # green, red, blue
    for k in range(3):
        differences[:, k] = _scattered({0: columns[_GREEN + k]}, np.where(known, 0, _NOBODY))
    _check(differences.max(initial=0) <= _MAX_SHADE)
    beside = _beside(cells, counts)
    of = np.where(np.append(known, False)[beside], beside, _NOBODY)
    count = np.maximum((of != _NOBODY).sum(axis=1), 1)
    order, rank, waves = _waves(cells)
    of, count, differences = rank[of[order]], count[order, None], differences[order]
    coloured = known[order, None]
    codes = np.zeros((n + 1, 3), np.int64)
    for now in waves:
        mean = (codes[of[now]].sum(axis=1) + (count[now] >> 1)) // count[now]
        green = (mean[:, 0] + differences[now, 0]) & _MAX_SHADE
        mean[:, 1:] = np.clip(mean[:, 1:] + (green - mean[:, 0])[:, None], 0, _MAX_SHADE)
        codes[now] = coloured[now] * ((mean + differences[now]) & _MAX_SHADE)
    colours = np.zeros((n, 3), np.uint8)
    colours[order] = (codes[:n, [1, 0, 2]] * 255 + _MAX_SHADE // 2) // _MAX_SHADE
    colours[known & ~colours.any(axis=1)] = 1  # black
    return colours


def _checked(codes: Array, vertical: Array) -> Array:
    height, depth, sigma, cost = codes.T
    _check((np.abs(height) <= _MAX_HEIGHT).all())
    _check(((depth >= vertical) & (depth <= _MAX_HEIGHT)).all())
    _check(((sigma >= 0) & (sigma <= 255) & (cost >= 0) & (cost <= 255)).all())
    return codes


def _codes(cells: Array, counts: Array, columns: Sequence[Array], raw: Array) -> tuple[Array, Array, Array, Array]:
    """kinds, classes, confidences, and (n, 4) codes of height, depth, sigma and cost."""
    beside = _beside(cells, counts)
    kinds = _kinds(beside, columns)
    vertical = (kinds & 1).astype(bool)
    around = _Surroundings(beside, kinds)
    classes = columns[_CLASS]
    _check(len(classes) == len(cells), "column: classes of other surfaces than the tile has")
    confidences = np.zeros(len(cells), np.uint8)
    if len(columns) > _CONFIDENCE:
        confidences = _scattered({_CONFIDENCE: columns[_CONFIDENCE]}, np.where(classes > 0, _CONFIDENCE, _NOBODY))
        _check(confidences.max(initial=0) <= 100)
    heights = np.where(vertical, _HEIGHT + 1, np.where(around.alike == 1, _HEIGHT + 2, _HEIGHT + 3))
    routes = (
        np.where(around.alike == 0, _HEIGHT, heights),
        np.where(vertical, _DEPTH + (around.alike > 0), _NOBODY),
        _SIGMA + vertical,
        np.where(kinds >> 1 == UNDERSIDE, _NOBODY, _COST + (kinds >> 1)),
    )
    bounds = (_HEIGHT, _DEPTH, _SIGMA, _COST, _CONFIDENCE)
    tokens = np.empty((len(cells), 4), np.uint8)
    for field, route in enumerate(routes):
        tokens[:, field] = _scattered({c: columns[c] for c in range(bounds[field], bounds[field + 1])}, route)
    differences = numbers_of(tokens.ravel(), raw).reshape(-1, 4)
    return kinds, classes, confidences, _checked(_summed(cells, around, vertical, differences), vertical)


# What codes stand for. Doubles, rounded once, are floats as the server's own.
_STEPS = np.arange(256, dtype=np.float32)
_SIGMA_M = np.exp2((_STEPS / np.float32(7.5) - np.float32(24)).astype(float)).astype(np.float32)
_COSTS = np.stack([np.exp2((_STEPS / np.float32(k)).astype(float)).astype(np.float32) - np.float32(1)
                   for k in (2, 6, 2, 2)])  # by traversability
_COSTS[:, 255] = np.inf


def decode_tile(data: bytes | memoryview, cell_size: float) -> Tile:
    """The tile that `data` holds (as served, or written by `strata tile get --out`).

    cell_size: that of the map [m]. Raises DataLoss for bytes that are no intact tile, Unimplemented for those of a
    later format. By the server's own decoder where it is installed (strata.native), else by numpy; both say the same.
    """
    if native.LIBRARY is None:
        return decode_tile_in_numpy(data, cell_size)
    key, version, surfaces = native.decode(data, cell_size, SURFACE)
    return Tile(TileKey(*key), version, cell_size * 2.0**key[0], surfaces)


def decode_tile_in_numpy(data: bytes | memoryview, cell_size: float) -> Tile:
    """decode_tile without any library of our own."""
    oldest_reader, body = _opened(data)
    reader = ByteReader(body)
    key = TileKey(reader.fixed(1), reader.fixed(4, signed=True), reader.fixed(4, signed=True))
    _check(key.level <= MAX_LEVEL, f"tile: level {key.level}")
    version = reader.fixed(8)
    counts = _counts(reader)
    cells = np.repeat(np.arange(_CELLS, dtype=np.int32), counts)
    columns = [reader.column(len(cells))
               for _ in range(_COLUMN_COUNT.get(oldest_reader, _CONFIDENCE))]
    raw = np.frombuffer(reader.take(reader.varint()), np.uint8)
    _check(not reader.remaining, "surface tile: bytes left over")
    kinds, classes, confidences, codes = _codes(cells, counts, columns, raw)
    colours = _colours(cells, counts, columns)
    undersides = (kinds >> 1 == UNDERSIDE).any()
    needed = (_VERSION_WITH_COLOURS if colours.any() else _VERSION_WITH_UNDERSIDES if undersides
              else _VERSION_WITH_CONFIDENCE if confidences.any() else 1)
    _check(oldest_reader == needed, "surface tile: of another version than what it holds")
    size = cell_size * 2.0**key.level
    surfaces = np.empty(len(cells), SURFACE)
    surfaces["x"] = (key.x * TILE_CELLS + cells % TILE_CELLS + 0.5) * size
    surfaces["y"] = (key.y * TILE_CELLS + cells // TILE_CELLS + 0.5) * size
    surfaces["z"] = codes[:, 0].astype(np.float32) / np.float32(512)
    surfaces["depth"] = codes[:, 1].astype(np.float32) / np.float32(512)
    surfaces["sigma"] = _SIGMA_M[codes[:, 2]]
    surfaces["traversability"] = kinds >> 1
    surfaces["cost"] = _COSTS[kinds >> 1, codes[:, 3]]
    surfaces["class_id"], surfaces["confidence"] = classes, confidences
    surfaces["rgb"] = colours
    return Tile(key, version, size, surfaces)
