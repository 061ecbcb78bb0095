"""Where one scan is in the frame of another, without a map or a server: `strata scan register`, which must be installed."""
import dataclasses
import os
import pathlib
import tempfile
from typing import Any

import numpy as np

from strata import poses
from strata.arrays import Array, ArrayLike
from strata.poses import PoseLike
from strata import program as strata_program

_METHODS = ("mls", "icp", "plane", "trimmed", "gicp")


@dataclasses.dataclass(frozen=True)
class Registration:
    """Where a scan was found to be."""

    T_target_source: Array  # 4 × 4
    converged: bool
    termination: str  # why it ended, in words
    overlap: float  # share of the source that lies on the target, in [0, 1]
    rms_m: float  # of the pairs that count
    sigma_m: float  # standard deviation along the least certain axis; 0 where one is open
    sigma_rad: float
    undetermined_directions: int  # of six, in which the pairs say nothing
    iterations: int


PointsLike = ArrayLike | os.PathLike[str]
"""(N, 3), or a file."""


def _file(points: PointsLike, folder: str, name: str) -> str:
    """The path of a scan: its own, or that of a PCD file of an N × 3 array."""
    if isinstance(points, (str, os.PathLike)):
        return os.fspath(points)
    xyz = np.asarray(points)
    if xyz.ndim != 2 or xyz.shape[1] != 3 or not len(xyz):
        raise ValueError(f"{name} of shape {xyz.shape}; expected (N, 3) or a file")
    path = os.path.join(folder, name + ".pcd")
    with open(path, "wb") as file:
        file.write(f"VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(xyz)}\nHEIGHT 1\n"
                   f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(xyz)}\nDATA binary\n".encode())
        file.write(np.ascontiguousarray(xyz, dtype="<f8").tobytes())
    return path


def _guess(pose: PoseLike) -> str:
    """x,y,z,qx,qy,qz,qw: what a command line takes, without losing a digit."""
    message = poses.to_proto(poses.matrix(pose))
    t, q = message.translation, message.rotation
    return ",".join(repr(number) for number in (t.x, t.y, t.z, q.x, q.y, q.z, q.w))


def register(source: PointsLike, target: PointsLike, guess: PoseLike = None, *, method: str = "mls",
             picture: str | os.PathLike[str] | None = None, max_distance: float | None = None,
             program: str = "strata") -> Registration:
    """Where `source` is in the frame of `target` → Registration; both N × 3 arrays of metres, or files that
    `strata scan import` reads.

    `guess`: T_target_source roughly, as every pose; None: where it says. `method`: "mls", as maps are aligned; of points
    "icp", "plane", "trimmed" or "gicp". `max_distance`: farther pairs are none [m]. `picture`: a PNG of both is written
    there. Raises ValueError, StrataError, and FileNotFoundError where `program` is not installed.
    """
    if method not in _METHODS:
        raise ValueError(f"method {method!r}; expected one of {', '.join(_METHODS)}")
    with tempfile.TemporaryDirectory() as folder:
        arguments = ["scan", "register", _file(source, folder, "source"), _file(target, folder, "target"), "--method",
                     method, "--guess", _guess(guess)]
        if max_distance is not None:
            arguments += ["--max-distance", repr(float(max_distance))]
        if picture is not None:
            arguments += ["--picture", os.fspath(pathlib.Path(picture).absolute())]
        answer = strata_program.run(program, arguments)
    fields: dict[str, Any] = {field.name: answer[field.name] for field in dataclasses.fields(Registration)}
    pose = fields["T_target_source"]
    fields["T_target_source"] = poses.matrix((pose[:3], pose[3:]))
    return Registration(**fields)
