"""The server's own decoder of tiles, where it can be loaded: a library that is built with the package, for the machine and the
Debian that it was built on. Elsewhere the decoder in numpy does the same, slower."""
import ctypes
import pathlib
from typing import Any

import numpy as np

from strata.arrays import Array
from strata.errors import DataLoss, ResourceExhausted, StrataError, Unimplemented

_MESSAGE_BYTES = 1000
_KINDS: dict[int, type[StrataError]] = {8: ResourceExhausted, 12: Unimplemented, 15: DataLoss}  # by canonical code


class Tile(ctypes.Structure):
    """The beginning of a decoded tile."""

    _fields_ = [("level", ctypes.c_int32), ("x", ctypes.c_int32), ("y", ctypes.c_int32), ("version", ctypes.c_uint64),
                ("surface_count", ctypes.c_uint64)]


_TileAddress = ctypes.POINTER(Tile)


def _load() -> Any:
    try:
        library = ctypes.CDLL(str(pathlib.Path(__file__).with_name("_tiles.so")))
    except OSError:  # none was built, or a library that it needs is not here
        return None
    library.StrataDecodeTile.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.POINTER(_TileAddress), ctypes.c_char_p,
                                         ctypes.c_size_t]
    library.StrataTileRows.argtypes = [_TileAddress, ctypes.c_double, ctypes.c_void_p]
    library.StrataTileRows.restype = None
    library.StrataFreeTile.argtypes = [_TileAddress]
    library.StrataFreeTile.restype = None
    return library


LIBRARY = _load()
"""None where it cannot be loaded."""


def decode(data: bytes | memoryview, cell_size: float, dtype: np.dtype[Any]) -> tuple[tuple[int, int, int], int, Array]:
    """Key, version and surfaces of a tile; cell_size: of level 0 [m], dtype: SURFACE."""
    content = np.frombuffer(data, np.uint8)
    tile = _TileAddress()
    message = ctypes.create_string_buffer(_MESSAGE_BYTES)
    code = LIBRARY.StrataDecodeTile(content.ctypes.data, content.size, ctypes.byref(tile), message, _MESSAGE_BYTES)
    if code != 0:
        raise _KINDS.get(code, StrataError)(message.value.decode(errors="replace"))
    try:
        of = tile.contents
        surfaces = np.empty(of.surface_count, dtype)
        LIBRARY.StrataTileRows(tile, cell_size * 2.0**of.level, surfaces.ctypes.data)
        return (of.level, of.x, of.y), of.version, surfaces
    finally:
        LIBRARY.StrataFreeTile(tile)
