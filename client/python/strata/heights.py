"""One height a cell: `strata map export --format asc`, by the program `strata`, which must be installed."""
import dataclasses
import os
import tempfile

import numpy as np

from strata.arrays import Array, ArrayLike
from strata.connection import Connection
from strata import program as strata_program

_SURFACES = ("highest", "kalman", "ground")
TRAVERSABLE, NON_TRAVERSABLE, VERTICAL, GAP = 1, 2, 3, 4  # GAP: traversable below or above something


@dataclasses.dataclass(frozen=True)
class Heights:
    """A grid seen from above: row 0 in the south, column 0 in the west; NaN where nothing is known."""

    z: Array  # (rows, columns) [m]; of the map, or above the ellipsoid where the map has an origin on earth
    sigma: Array  # (rows, columns), standard deviation of z [m]
    classes: Array | None  # (rows, columns) of uint8, 0 where nothing is known; None but of ground
    origin: Array  # (2,), lower left corner, map frame [m]
    cell_size: float  # [m]
    projection: str | None  # where that is on earth, WKT of a map with an origin there; else None


def read_asc(path: str | os.PathLike[str]) -> tuple[Array, Array, float]:
    """(values, corner, cell size) of an ESRI ASCII grid that strata wrote."""
    with open(path, encoding="ascii") as file:
        head = dict(file.readline().split() for _ in range(6))
        values = np.fromstring(file.read(), sep=" ")
    values = values.reshape(int(head["nrows"]), int(head["ncols"]))[::-1]
    values = np.where(values == float(head["NODATA_value"]), np.nan, values)
    return values, np.array([float(head["xllcorner"]), float(head["yllcorner"])]), float(head["cellsize"])


def heights(connection: Connection, name: str, surface: str, region: ArrayLike | None, *, profile: str | None,
            level: int, program: str) -> Heights:
    if surface not in _SURFACES:
        raise ValueError(f"surface {surface!r}; expected one of {', '.join(_SURFACES)}")
    arguments = ["--format", "asc", "--surface", surface, "--level", str(int(level))]
    if region is not None:
        low, high = np.asarray(region, dtype=float)
        numbers = [*low[:2], *high[:2]] + ([low[2], high[2]] if len(low) == 3 else [])
        arguments.append("--region=" + ",".join(repr(float(number)) for number in numbers))
    if profile is not None:
        arguments += ["--profile", profile]
    options, environment = connection.program_options()
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "z.asc")
        answer = strata_program.run(program, ["map", "export", name, "--out", path, *arguments, *options], environment)
        z, origin, cell_size = read_asc(path)
        sigma = read_asc(os.path.join(folder, "z-sigma.asc"))[0]
        classes = None
        if surface == "ground":
            classes = np.nan_to_num(read_asc(os.path.join(folder, "z-class.asc"))[0]).astype(np.uint8)
    return Heights(z, sigma, classes, origin, cell_size, answer.get("projection"))
