"""A list of poses: a table, or a form without columns that the library reads (kr5/calibration/pose_file.hpp)."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import kr5
from kr5 import calibration
from kr5.logs.log_file import TABLE_ENDINGS
from kr5.logs.npz_file import parse_npy
from kr5.tables.pose_columns import format_of_rows, rotation_form
from kr5.tables.read_table import read_table
from kr5.tables.roles import OPTIONAL_TIME, PoseRole, Units

MAX_BYTES = 64 << 20
BRACKETS = str.maketrans("[](),;", "      ")
LAST_ROW = 1e-6  # what rounding may leave of 0 0 0 1
FORMS = ("quaternion_xyzw", "rotation_vector", "rpy", "kuka_abc", "matrix")


@dataclass
class PoseList:
    """Poses as the rows state them, with the numbers and their format."""

    file: Path
    rows: np.ndarray
    format: calibration.PoseFormat
    poses: list[np.ndarray]
    names: list[str]  # of the rows, such as poses.csv:2
    times: list[float] = field(default_factory=list)  # [s]
    notes: list[str] = field(default_factory=list)


def read_pose_list(
    file: Path,
    units: Units | None = None,
    convention: str | None = None,
    columns: str | None = None,
    *,
    strict: bool = True,
    guess_units: bool = True,
) -> PoseList:
    """Poses of any table that `read_table` reads; of YAML and JSON with named numbers, lists or matrices; and of texts
    in which a pose stands on several lines. strict: numbers that contradict the units are refused; guess_units: units
    that nothing states are found."""
    units = units or Units()
    if columns is None and (matrices := _matrices(file)) is not None:
        return _of_rows(file, matrices, "matrix", units, strict, guess_units)
    if file.suffix.lower().lstrip(".") not in TABLE_ENDINGS or _has_poses_over_lines(file):
        return _without_columns(file, units, convention, strict, guess_units)
    table = read_table(
        file, [PoseRole(strict=strict, guess_units=guess_units), OPTIONAL_TIME], units, convention, columns=columns
    )
    return PoseList(
        file,
        table.pose_rows["pose"],
        table.pose_formats["pose"],
        table.poses["pose"],
        [table.row_name(k) for k in range(table.rows)],
        [] if "t" not in table else [float(t) for t in table["t"]],
        table.notes,
    )


def _matrices(file: Path) -> np.ndarray | None:
    """N x 16 of a file of 4 x 4 matrices: an array of NumPy, or a text with a row of a matrix on each line; nothing for
    any other."""
    if not file.is_file() or file.stat().st_size > MAX_BYTES:
        return None
    if file.suffix.lower() == ".npy":
        return _matrices_of_array(file)
    if file.suffix.lower() not in (".txt", ".csv", ".dat", ".tsv"):
        return None
    text = file.read_text(encoding="utf-8-sig", errors="replace")
    cells = (line.split("#")[0].translate(BRACKETS).split() for line in text.splitlines())
    lines = [words for words in cells if words]
    if len(lines) < 4 or len(lines) % 4 or any(len(words) != 4 for words in lines):
        return None
    try:
        rows = np.array(lines, float)
    except ValueError:
        return None
    return rows.reshape(-1, 16) if np.allclose(rows[3::4], [0, 0, 0, 1], atol=LAST_ROW) else None


def _matrices_of_array(file: Path) -> np.ndarray | None:
    try:
        array = parse_npy(file.read_bytes(), file.name)
    except Exception as error:  # what the parser of headers raises at damaged bytes is no closed list
        why = str(error).split("\n")[0][:200] or type(error).__name__
        raise kr5.FileError(
            file, f"cannot be read as NPY: {why}; expected an array of numbers saved with numpy.save"
        ) from error
    shape = array.shape
    if array.ndim == 3 and array.shape[1:] in ((3, 4), (4, 4)):
        array = array.reshape(len(array), shape[1] * shape[2])
    if array.dtype.kind not in "fiu":
        raise kr5.FileError(file, f"found an array of {array.dtype}, expected numbers")
    if array.ndim != 2 or array.shape[1] not in (12, 16) or not len(array):
        raise kr5.FileError(
            file, f"found an array of shape {shape}, expected N x 4 x 4, a matrix a pose, and at least one pose"
        )
    last = np.tile([0.0, 0.0, 0.0, 1.0], (len(array), 1))
    return np.asarray(array if array.shape[1] == 16 else np.hstack([array, last]), float)


def _has_poses_over_lines(file: Path) -> bool:
    """Whether a text is of one pose with fewer numbers on a line than a pose has."""
    if file.suffix.lower() != ".txt" or not file.is_file():
        return False
    lines = [line.split("#")[0].split() for line in file.read_text(encoding="utf-8-sig", errors="replace").splitlines()]
    widths = {len(line) for line in lines if line}
    return len(widths) == 1 and widths <= {1, 2, 3, 4}


def _without_columns(file: Path, units: Units, convention: str | None, strict: bool, guess_units: bool) -> PoseList:
    """Numbers in the order of their form, or by the names that a document gives them."""
    tried: list[str] = []
    for form in [rotation_form(convention)] if convention else FORMS:
        try:
            rows = calibration.load_poses(str(file), calibration.RotationForm(form))
        except kr5.IoError as error:
            tried.append(str(error))
            continue
        if not convention and rows.shape[1] == 6 and file.suffix.lower() == ".txt":
            raise kr5.IoError(
                f"{file}: found six numbers a pose, whose rotation may be of several forms; specify it with"
                " --convention (rotation_vector, rpy or kuka)"
            )
        return _of_rows(file, rows, form, units, strict, guess_units)
    raise kr5.IoError(tried[0])


def _of_rows(file: Path, rows: np.ndarray, form: str, units: Units, strict: bool, guess_units: bool) -> PoseList:
    read_as = format_of_rows(str(file), rows, form, units.length, units.angle, strict, guess_units)
    poses = list(calibration.to_poses(rows, read_as))
    return PoseList(file, rows, read_as, poses, [f"{file.name}:{k + 1}" for k in range(len(rows))])
