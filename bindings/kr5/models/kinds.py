"""Kinds of model files: what a file holds, and what the name of a new one asks for."""

import enum
import re
from pathlib import Path

import kr5
from kr5.files.documents import MAX_BYTES


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
    """Text of a model file. Raises IoError where there is none."""
    try:
        data = file.read_bytes()
        if len(data) > MAX_BYTES:
            raise kr5.IoError(f"{file}: is larger than {MAX_BYTES >> 20} MiB; expected {EXPECTED}")
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise kr5.IoError(f"{file}: is not UTF-8 text (byte {error.start}); expected {EXPECTED}") from None
    except OSError as error:
        raise kr5.IoError(f"{file}: {error.strerror or error}; expected {EXPECTED}") from None


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
    rest = re.sub(r"^\s*(<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>]*>|\s+)*", "", text, flags=re.DOTALL)
    found = re.match(r"<([\w:.-]+)", rest)
    return found.group(1) if found else None
