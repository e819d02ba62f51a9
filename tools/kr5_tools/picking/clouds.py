"""Clouds of points in the formats that scanners and other programs write: NPZ, NPY, PCD, PLY, text."""

import warnings
from dataclasses import dataclass
from pathlib import Path

import kr5
import numpy as np
import numpy.typing as npt
from kr5.logs.log_file import read_text_form
from kr5.logs.units import UNITS
from kr5.tables.column_units import read_name
from kr5.tables.roles import LARGEST

ENDINGS = ".npz, .npy, .pcd, .ply, .csv, .txt or .xyz"
POINT_KEYS = ("points", "xyz", "cloud", "pts")
ORIGIN_KEYS = ("origins", "origin", "viewpoint", "sensor")
MAX_POINTS = 50_000_000
PROFILE_KEYS = "profile_x, profile_z, times, T_base_flange and T_flange_scanner"


@dataclass
class CloudFile:
    """Points of a file, n x 3 [m], NaN where nothing was measured, and the origins of their rays where it has them."""

    points: np.ndarray
    origins: np.ndarray | None = None
    unit: str | None = None  # of the numbers in the file, where their names tell it


def read_cloud(file: Path, delay: float | None = None, unit: str | None = None) -> CloudFile:
    """Reads a cloud. Arrays may be organised (rows x columns x 3); normals and colours are not used.

    An NPZ of profiles becomes a cloud by the poses of the arm; `delay` [s] stands in place of its own. `unit`: of the
    points; without it as the names of columns tell, else m, unless they spread too far for a bin.
    """
    if file.suffix.lower() == ".npz" and file.is_file():
        from kr5_tools.picking.profiles import read_profiles

        scanned = read_profiles(file, delay)
        if scanned is not None:
            if unit == "mm":
                raise kr5.InvalidArgument(f"--length-unit: {file} holds profiles, which are in metres")
            return CloudFile(*scanned)
    if delay is not None:
        raise kr5.InvalidArgument(
            f"--delay: {file} holds no profiles, whose stamps could be late; expected {PROFILE_KEYS} in an NPZ"
        )
    readers = {".npz": _npz, ".npy": _npy, ".pcd": _pcd, ".ply": _ply, ".csv": _text, ".txt": _text, ".xyz": _text}
    reader = readers.get(file.suffix.lower())
    if reader is None:
        raise kr5.FileError(file, f"no cloud that can be read; expected a file that ends in {ENDINGS}")
    if not file.is_file():
        raise kr5.FileError(file, "No such file")
    try:
        cloud = reader(file)
    except (MemoryError, OSError, kr5.Error):
        raise
    except Exception as error:  # the readers raise what they like on damaged files
        raise kr5.FileError(
            file, f"is damaged or no {file.suffix[1:].upper()} file: {' '.join(str(error).split())[:200]}"
        ) from error
    cloud.points = _as_points(file, "points", cloud.points)
    if cloud.origins is not None:
        cloud.origins = _as_points(file, "origins", cloud.origins)
        if len(cloud.origins) not in (1, len(cloud.points)):
            raise kr5.FileError(
                file,
                f"found {len(cloud.origins)} rows, expected 1 or {len(cloud.points)}, one a point",
                field="origins",
            )
    factor = _factor(file, cloud, unit)
    return CloudFile(factor * cloud.points, None if cloud.origins is None else factor * cloud.origins)


def _factor(file: Path, cloud: CloudFile, stated: str | None) -> float:
    """From the unit of the numbers to metres."""
    unit = stated or cloud.unit
    if unit is not None:
        return UNITS["length"][unit]
    finite = cloud.points[np.isfinite(cloud.points).all(axis=1)]
    spread = float(np.ptp(np.percentile(finite, [1, 99], axis=0), axis=0).max()) if len(finite) else 0.0
    if spread <= LARGEST["length"]:
        return 1.0
    text = f"{file}: the points are read in mm: in m they would spread over {spread:.3g} m; --length-unit m keeps them"
    warnings.warn(text, kr5.Caution, stacklevel=3)
    return UNITS["length"]["mm"]


def _as_points(file: Path, name: str, array: npt.ArrayLike) -> np.ndarray:
    values = np.asarray(array)
    if values.dtype.kind not in "fiu":
        raise kr5.FileError(file, f"found values of type {values.dtype}, expected numbers", field=name)
    if values.ndim == 1 and values.size == 3:
        values = values.reshape(1, 3)
    if values.ndim not in (2, 3) or values.shape[-1] != 3:
        shape = " x ".join(str(n) for n in values.shape)
        raise kr5.FileError(file, f"found an array of {shape}, expected n x 3, or rows x columns x 3", field=name)
    values = values.reshape(-1, 3).astype(float)
    if len(values) > MAX_POINTS:
        raise kr5.FileError(file, f"found {len(values)} points, expected at most {MAX_POINTS}", field=name)
    values[~np.isfinite(values).all(axis=1)] = np.nan
    return values


def _npz(file: Path) -> CloudFile:
    with np.load(file, allow_pickle=False) as data:
        points = next((key for key in POINT_KEYS if key in data), None)
        if points is None:
            raise kr5.FileError(
                file, f"found the arrays {', '.join(data) or 'none'}, expected one named {' or '.join(POINT_KEYS)}"
            )
        origins = next((key for key in ORIGIN_KEYS if key in data), None)
        return CloudFile(data[points], data[origins] if origins else None)


def _npy(file: Path) -> CloudFile:
    return CloudFile(np.load(file, allow_pickle=False))


def _pcd(file: Path) -> CloudFile:
    from pypcd4 import PointCloud

    cloud = PointCloud.from_path(file)
    missing = [name for name in "xyz" if name not in cloud.fields]
    if missing:
        raise kr5.FileError(file, f"has no field {missing[0]}; found {', '.join(cloud.fields)}")
    view = np.asarray(cloud.metadata.viewpoint, float)[:3]
    # The default (0, 0, 0) says nothing: most programs write it whatever the frame.
    return CloudFile(cloud.numpy(("x", "y", "z")), view if view.any() else None)


def _ply(file: Path) -> CloudFile:
    from kr5_tools.picking.ply import read_vertices

    return CloudFile(read_vertices(file))


def _text(file: Path) -> CloudFile:
    """Points of a text in any of the forms of tables; read by rows of numbers, since scans have millions."""
    form = read_text_form(file)
    columns = [read_name(name) for name in form.names]
    places = {column.plain: i for i, column in enumerate(columns)}
    named = set("xyz") <= set(places)
    chosen = tuple(places[n] for n in "xyz") if named else (0, 1, 2)
    units = {columns[i].unit for i in chosen} if named else {None}
    if len(units) > 1 or not units <= {None, *UNITS["length"]}:
        told = ", ".join(columns[i].column for i in chosen)
        raise kr5.FileError(file, f"found the columns {told}, expected x, y, z in one unit of length: m or mm")
    with file.open(encoding="utf-8-sig") as stream:
        lines = (line.replace(",", ".") for line in stream) if form.decimal_commas else stream
        points = np.loadtxt(lines, delimiter=form.delimiter, skiprows=form.rows_before, usecols=chosen, ndmin=2)
    return CloudFile(points, unit=units.pop())
