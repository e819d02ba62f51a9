"""Poses of a table. Which columns hold them, in which form and units, is the law of the library
(kr5/calibration/pose_columns.hpp)."""

import numpy as np

import kr5
from kr5 import calibration
from kr5.logs.log import Log
from kr5.tables.checks import check_finite
from kr5.tables.column_search import ColumnSearch
from kr5.tables.roles import PoseRole, Units
from kr5.tables.table import Table

SHORT_FORMS = {"quaternion": "quaternion_xyzw", "kuka": "kuka_abc"}  # of --convention, beside the names of the library
CONVENTIONS = ("quaternion", "rotation_vector", "rpy", "kuka", "quaternion_wxyz", "matrix")
ROTATIONS = (("qx", "qy", "qz", "qw"), ("rx", "ry", "rz"), ("roll", "pitch", "yaw"), ("a", "b", "c"))


def rotation_form(convention: str) -> str:
    """The form of the library that --convention names."""
    form = SHORT_FORMS.get(convention, convention)
    if form not in _forms():
        raise kr5.InvalidArgument(f"--convention: found {convention}, expected one of {', '.join(CONVENTIONS)}")
    return form


def _forms() -> list[str]:
    return [str(form) for form in calibration.RotationForm.__members__.values()]


def add_poses(
    table: Table, log: Log, role: PoseRole, search: ColumnSearch, convention: str | None, units: Units
) -> None:
    """Poses of a role, where its columns are there."""
    found = _columns_of(log, role, search, convention)
    if found is None:
        return
    form, columns = found
    for name in columns:
        if name in log.text_columns:
            raise kr5.IoError(log.unreadable(name))
    rows = log.stacked(columns)
    check_finite(log, columns, rows)
    position, angle = _stated_units(search, columns, units)
    table.names[role.name], table.pose_rows[role.name] = columns, rows
    read_as = table.pose_formats[role.name] = format_of_rows(
        str(log.file), rows, form, position, angle, role.strict, role.guess_units
    )
    usual = calibration.usual_format(_form(form))
    guessed = [u for u, stated, other in _units(read_as, position, angle, usual) if u != other and not stated]
    if guessed:
        table.notes.append(
            f"{log.file.name}: {role.prefix}x to {columns[-1]} is read in {' and '.join(guessed)}, as the size of the"
            " numbers tells"
        )
    try:
        table.poses[role.name] = list(calibration.to_poses(rows, read_as))
    except kr5.InvalidArgument as error:
        bad = next(k for k in range(len(rows)) if not _is_readable(rows[k : k + 1], read_as))
        shown = f"{columns[0]} to {columns[-1]} read as {form}"
        raise kr5.FileError(log.file, f"{log.row(bad)}: {shown}: {error}", remedy="see --convention") from None


def _is_readable(rows: np.ndarray, read_as: calibration.PoseFormat) -> bool:
    try:
        calibration.to_poses(rows, read_as)
    except kr5.InvalidArgument:
        return False
    return True


def _units(
    read_as: calibration.PoseFormat, position: str | None, angle: str | None, usual: calibration.PoseFormat
) -> list[tuple[str, str | None, str]]:
    turned = str(read_as.rotation) in ("rotation_vector", "rpy", "kuka_abc")
    out = [(str(read_as.position), position, str(usual.position))]
    return [*out, (str(read_as.angle), angle, str(usual.angle))] if turned else out


def _columns_of(log: Log, role: PoseRole, search: ColumnSearch, convention: str | None) -> tuple[str, list[str]] | None:
    """Form of the rotation and columns in its order; None where there are none and none are needed."""
    columns = log.names()
    plain = [search.name_of(c).plain for c in columns]
    others = [r for r in search.roles if r.needed and r is not role]
    if not log.named and not others:
        return _unnamed(log, role, search, convention)
    named = calibration.find_rotation_form(plain, role.prefix)
    form = rotation_form(convention) if convention else None if named is None else str(named)
    if form is None:
        if role.needed:
            p = role.prefix
            spelled = ", or ".join(" ".join(p + name for name in names) for names in ROTATIONS)
            wanted = f"{p}x, {p}y, {p}z and an orientation: {spelled}"
            raise kr5.IoError(search.missing([wanted], "--convention", role.what))
        return None
    names = [spellings[0] for spellings in calibration.pose_column_names(_form(form))]
    at = calibration.find_pose_columns(plain, _form(form), role.prefix)
    found = [columns[k] if k >= 0 else "" for k in at]
    if role.name in search.given:
        found[:3] = search.given[role.name].split(",")
    elif not role.needed and not convention and "" in found:
        return None
    if lacking := [role.prefix + n for n, c in zip(names, found, strict=True) if not c]:
        raise kr5.IoError(search.missing(lacking, "--convention"))
    return form, found


def _unnamed(log: Log, role: PoseRole, search: ColumnSearch, convention: str | None) -> tuple[str, list[str]] | None:
    """All columns of a table without names, where they are as many as a pose has numbers."""
    columns = log.names()
    form = rotation_form(convention) if convention else calibration.rotation_form_of_length(len(columns))
    fits = form is not None and len(columns) in (
        calibration.row_length(_form(str(form))),
        16 if str(form) == "matrix" else 0,
    )
    if fits:
        return str(form), columns
    if role.needed:
        raise kr5.IoError(search.missing(["x, y, z and an orientation"], "--convention"))
    return None


def _stated_units(search: ColumnSearch, columns: list[str], units: Units) -> tuple[str | None, str | None]:
    """Units of positions and angles, as options or the names of the columns say them."""
    first, last = search.name_of(columns[0]).unit, search.name_of(columns[-1]).unit
    return units.length or (first if first in ("m", "cm", "mm") else None), units.angle or (
        last if last in ("rad", "deg") else None
    )


def format_of_rows(
    file: str, rows: np.ndarray, form: str, position: str | None, angle: str | None, strict: bool, guess_units: bool
) -> calibration.PoseFormat:
    """The format of rows with the units that are stated, else such as the numbers allow; strict: numbers that speak
    against it are refused."""
    usual = calibration.usual_format(_form(form))
    said = {"position": position or str(usual.position), "rotation": form, "angle": angle or str(usual.angle)}
    stated = calibration.PoseFormat.from_dict(said)
    found = None
    if guess_units:
        found = calibration.find_pose_units(
            rows,
            _form(form),
            None if position is None else calibration.LengthUnit(position),
            None if angle is None else calibration.AngleUnit(angle),
        )
    if found is not None or not strict:
        return found or stated
    if objections := calibration.format_objections(rows, stated):
        raise kr5.IoError(
            f"{file}: read as {stated.position}, {form}, {stated.angle}: {'; '.join(objections)}; see --convention,"
            " --length-unit, --angle-unit"
        )
    return stated


def _form(name: str) -> calibration.RotationForm:
    return calibration.RotationForm(name)
