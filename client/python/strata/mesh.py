"""The surface of a map as triangles: `strata map mesh`, by the program `strata`, which must be installed."""
import dataclasses
import os
import tempfile

import numpy as np

from strata.arrays import Array, ArrayLike
from strata.connection import Connection
from strata import program as strata_program

_METHODS = ("tsdf", "contour", "alpha")


@dataclasses.dataclass(frozen=True)
class Mesh:
    """Triangles that face outwards."""

    vertices: Array  # (n, 3) float64, map frame [m]
    normals: Array  # (n, 3) float32, unit
    triangles: Array  # (m, 3) uint32, indices of vertices, counter-clockwise seen from outside
    area_m2: float
    closed: bool  # without a border
    boundary_edges: int


def read_ply(path: str | os.PathLike[str]) -> tuple[Array, Array, Array]:
    """(vertices, normals, triangles) of a binary PLY file that strata wrote."""
    with open(path, "rb") as file:
        data = file.read()
    header, _, body = data.partition(b"end_header\n")
    counts: dict[str, int] = {}
    columns: list[tuple[str, str]] = []
    for line in header.decode().splitlines():
        words = line.split()
        if words[0] == "element":
            counts[words[1]] = int(words[2])
        elif words[0] == "property" and words[1] != "list" and "face" not in counts:
            columns.append((words[2], {"double": "<f8", "float": "<f4", "uchar": "u1"}[words[1]]))
    rows = np.frombuffer(body, dtype=columns, count=counts["vertex"])
    faces = np.frombuffer(body, dtype=[("count", "u1"), ("indices", "<u4", 3)], offset=rows.nbytes, count=counts["face"])
    vertices = np.stack([rows[axis] for axis in "xyz"], axis=1).astype(np.float64)
    normals = np.stack([rows["n" + axis] for axis in "xyz"], axis=1)
    return vertices, normals, faces["indices"].copy()


def mesh(connection: Connection, name: str, region: ArrayLike | None, *, voxel: float, method: str,
         of_class: str | int | None, simplify: int | None, program: str) -> Mesh:
    if method not in _METHODS:
        raise ValueError(f"method {method!r}; expected one of {', '.join(_METHODS)}")
    arguments = ["--voxel", repr(float(voxel)), "--method", method]
    if region is not None:
        low, high = np.asarray(region, dtype=float)
        numbers = [*low[:2], *high[:2]] + ([low[2], high[2]] if len(low) == 3 else [])
        arguments.append("--region=" + ",".join(repr(float(number)) for number in numbers))
    if of_class is not None:
        arguments += ["--class", str(of_class)]
    if simplify is not None:
        arguments += ["--simplify", str(int(simplify))]
    options, environment = connection.program_options()
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "mesh.ply")
        answer = strata_program.run(program, ["map", "mesh", name, path, *arguments, *options], environment)
        vertices, normals, triangles = read_ply(path)
    return Mesh(vertices, normals, triangles, answer["area_m2"], answer["closed"], answer["boundary_edges"])
