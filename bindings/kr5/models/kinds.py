"""Kinds of model files: what a file holds, and what the name of a new one asks for."""

import enum
import re
from pathlib import Path

import kr5
from kr5.files.documents import read_text


class Kind(enum.StrEnum):
    """A kind of model, by the word that results have for it."""

    URDF = "urdf"
    MJCF = "mjcf"
    SDF = "sdf"
    DRAKE = "drake"
    ISAAC = "isaac"
    CELL = "cell"


ENDINGS = {
    ".urdf": Kind.URDF,
    ".xml": Kind.MJCF,
    ".mjcf": Kind.MJCF,
    ".sdf": Kind.SDF,
    ".yaml": Kind.CELL,
    ".yml": Kind.CELL,
}
# Of files that are written and not read; the longer ending counts.
WRITTEN_ENDINGS = {**ENDINGS, ".drake.sdf": Kind.DRAKE, ".py": Kind.ISAAC}
NAMES = {
    Kind.URDF: "a URDF",
    Kind.MJCF: "an MJCF",
    Kind.SDF: "an SDF",
    Kind.DRAKE: "an SDF of Drake",
    Kind.ISAAC: "an actuator configuration of Isaac Lab",
    Kind.CELL: "a cell",
}
ROOTS = {"robot": Kind.URDF, "mujoco": Kind.MJCF, "sdf": Kind.SDF}
# What may stand before the first element of an XML text. A declaration of its type may hold others in brackets.
# Each part begins by a letter of its own and is never tried twice, so that no text takes long.
COMMENT, QUOTED = "<!--.*?-->", """"[^"]*"|'[^']*'"""
INNER = rf"""\[(?:{COMMENT}|{QUOTED}|[^\]"'<]|<(?!!--))*+\]"""
BEFORE_ROOT = rf"""\s|<\?.*?\?>|{COMMENT}|<!DOCTYPE(?:{QUOTED}|{INNER}|[^\[\]>"'])*+>"""
EXPECTED = "a URDF (<robot>), an MJCF (<mujoco>) or a cell file (YAML)"


def kind_of_file(file: Path) -> Kind:
    """What a file holds, whatever its ending. Raises IoError for XML of another kind."""
    root = _root_element(model_text(file))
    if root is None and file.suffix and file.suffix.lower() not in ENDINGS:
        raise kr5.IoError(f"{file}: found the ending '{file.suffix}' and no XML, expected {EXPECTED}")
    if root is None:
        return Kind.CELL
    if root not in ROOTS:
        hint = "; name the file that includes it" if root == "mujocoinclude" else ""
        raise kr5.IoError(f"{file}: found <{root}>, expected {EXPECTED}{hint}")
    return ROOTS[root]


def model_text(file: Path) -> str:
    """Text of a model file. Raises kr5.FileError where there is none."""
    return read_text(file, EXPECTED)


def kind_of_output(file: Path) -> Kind:
    """What the ending of a new file asks for."""
    found = [ending for ending in WRITTEN_ENDINGS if file.name.lower().endswith(ending)]
    if not found:
        raise kr5.IoError(
            f"{file}: found the ending '{file.suffix}', expected .urdf, .xml (MJCF of MuJoCo), .sdf (Gazebo),"
            " .drake.sdf (Drake), .py (actuators of Isaac Lab) or .yaml (cell)"
        )
    return WRITTEN_ENDINGS[max(found, key=len)]


def _root_element(text: str) -> str | None:
    """Name of the first element of an XML text; nothing where it is none."""
    found = re.match(rf"(?:{BEFORE_ROOT})*+<([\w:.-]+)", text, flags=re.DOTALL)
    return found.group(1) if found else None
