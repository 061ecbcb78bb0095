"""What maps hold as objects of other libraries, which are imported only here: Open3D's clouds and meshes, xarray's grids.

    cloud = strata.convert.open3d_cloud(campus.fetch())
    grid = strata.convert.xarray_surfaces(campus.fetch(), campus.cell_size)
    grid.z.isel(layer=0).plot()
"""
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from strata.arrays import Array, ArrayLike
from strata.heights import Heights
from strata.mesh import Mesh
from strata.scan import Points
from strata.tiles import SURFACE, TRAVERSABLE, UNDERSIDE, UNKNOWN, Tile, TileKey

Surfaces = Mapping[TileKey, Tile] | Tile | Array
"""What Map.fetch returns, one of its Tiles, or an array of dtype SURFACE."""

_KIND_COLOURS = np.array([[0.6, 0.6, 0.6], [0.2, 0.63, 0.17], [0.84, 0.37, 0.0], [0.4, 0.4, 0.7]])
"""By traversability; told apart by colour-blind people too."""
_MAX_CELLS = 1 << 28
_LAYERED = ("z", "sigma", "depth", "cost", "traversability", "class_id", "confidence")
_MEANINGS = {"z": "height, map frame", "sigma": "standard deviation of the height",
             "depth": "length of a vertical interval below z; 0: horizontal", "cost": "path cost factor of the default profile",
             "traversability": f"{UNKNOWN}: unknown, {TRAVERSABLE}: traversable, 2: not, {UNDERSIDE}: seen from below only",
             "class_id": "class with the most votes; 0: none", "confidence": "share of the votes that class_id has [%]"}
_METRES = ("z", "sigma", "depth")


def surfaces_of(surfaces: Surfaces) -> Array:
    """All surfaces in one array of dtype SURFACE."""
    if isinstance(surfaces, Tile):
        return surfaces.surfaces
    if isinstance(surfaces, Mapping):
        return np.concatenate([tile.surfaces for tile in surfaces.values()]) if surfaces else np.empty(0, SURFACE)
    if surfaces.dtype != SURFACE:
        raise ValueError(f"an array of {surfaces.dtype}; expected dtype strata.SURFACE, tiles, or a tile")
    return surfaces


def xyz(array: Array) -> Array:
    """(n, 3) float64 of an array with the columns x, y and z: of dtype SURFACE or POINT."""
    columns: Array = np.stack([array["x"], array["y"], array["z"]], axis=-1).astype(float)
    return columns


def colours_of(surfaces: Surfaces) -> Array:
    """(n, 3) in [0, 1]: the points' own where any is known, else by traversability."""
    array = surfaces_of(surfaces)
    by_kind: Array = _KIND_COLOURS[np.minimum(array["traversability"], UNDERSIDE)]
    known = array["rgb"].any(axis=1)
    result: Array = np.where(known[:, None], array["rgb"] / 255, by_kind)
    return result


def open3d_cloud(of: Surfaces | Points, pose: ArrayLike | None = None) -> Any:
    """An open3d.geometry.PointCloud of surfaces (their tops, coloured as colours_of), or of a scan's Points (without those that
    have no return; `pose`: (4, 4) T_map_scan puts them into the map). ImportError where Open3D is not installed."""
    import open3d
    cloud = open3d.geometry.PointCloud()
    if isinstance(of, Points):
        finite = np.isfinite(of.xyz).all(axis=1)
        cloud.points = open3d.utility.Vector3dVector(of.xyz[finite].astype(float))
        if of.rgb is not None:
            cloud.colors = open3d.utility.Vector3dVector(of.rgb[finite] / 255)
    else:
        cloud.points = open3d.utility.Vector3dVector(xyz(surfaces_of(of)))
        cloud.colors = open3d.utility.Vector3dVector(colours_of(of))
    return cloud if pose is None else cloud.transform(np.asarray(pose, dtype=float))


def open3d_mesh(mesh: Mesh) -> Any:
    """An open3d.geometry.TriangleMesh of what Map.mesh returns. ImportError where Open3D is not installed."""
    import open3d
    made = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(mesh.vertices),
                                        open3d.utility.Vector3iVector(mesh.triangles.astype(np.int32)))
    made.vertex_normals = open3d.utility.Vector3dVector(mesh.normals.astype(float))
    return made


def _cells(values: Array, cell_size: float) -> tuple[Array, Array]:
    """Index of the cell of each coordinate from the lowest on, and the middles of all cells between."""
    cells = np.floor(values / cell_size + 1e-6).astype(np.int64)
    first, last = cells.min(), cells.max()
    return cells - first, (np.arange(first, last + 1) + 0.5) * cell_size


def _layers(column: Array, row: Array, z: Array) -> tuple[Array, Array]:
    """The order by cell and height, and which of its cell each is, lowest first."""
    order = np.lexsort((z, column, row))
    keys = np.stack([row[order], column[order]])
    begins = np.r_[True, (np.diff(keys) != 0).any(axis=0)]
    first = np.maximum.accumulate(np.where(begins, np.arange(len(z)), 0))
    return order, np.arange(len(z)) - first


def xarray_surfaces(surfaces: Surfaces, cell_size: float, names: Iterable[str] = _LAYERED) -> Any:
    """An xarray.Dataset over (layer, y, x): the surfaces of every cell, layer 0 the lowest; NaN, or 0 of whole numbers, where
    there is none. cell_size: of the tiles' level [m]. names: which columns. ValueError for nothing, or more than 2^28 cells.
    ImportError where xarray is not installed."""
    import xarray
    array = surfaces_of(surfaces)
    if not len(array):
        raise ValueError("no surfaces: nothing to make a grid of")
    column, x = _cells(array["x"], cell_size)
    row, y = _cells(array["y"], cell_size)
    order, layer = _layers(column, row, array["z"])
    shape = (int(layer.max()) + 1, len(y), len(x))
    if np.prod(shape, dtype=float) > _MAX_CELLS:
        raise ValueError(f"a grid of {shape} cells; fetch a smaller area, or a coarser level")
    data = {}
    for name in names:
        column_values = array[name][order]
        grid: Array = np.full(shape, np.nan if column_values.dtype.kind == "f" else 0, column_values.dtype)
        grid[layer, row[order], column[order]] = column_values
        data[name] = (("layer", "y", "x"), grid,
                      {"long_name": _MEANINGS[name], **({"units": "m"} if name in _METRES else {})})
    return xarray.Dataset(data, coords={"layer": np.arange(shape[0]), "y": ("y", y, {"units": "m"}),
                                        "x": ("x", x, {"units": "m"})})


def xarray_heights(heights: Heights) -> Any:
    """An xarray.Dataset over (y, x) of what Map.heights returns: z and sigma [m], classes of the ground, and as an attribute
    the projection, WKT, of a map that has an origin on earth. ImportError where xarray is not installed."""
    import xarray
    rows, columns = heights.z.shape
    data = {"z": (("y", "x"), heights.z, {"units": "m"}), "sigma": (("y", "x"), heights.sigma, {"units": "m"})}
    if heights.classes is not None:
        data["classes"] = (("y", "x"), heights.classes, {})
    middle = heights.origin + 0.5 * heights.cell_size
    return xarray.Dataset(data, coords={
        "y": ("y", middle[1] + heights.cell_size * np.arange(rows), {"units": "m"}),
        "x": ("x", middle[0] + heights.cell_size * np.arange(columns), {"units": "m"})},
        attrs={} if heights.projection is None else {"crs_wkt": heights.projection})
