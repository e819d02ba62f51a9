"""Models of robots, whichever file they stand in."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import kr5
from kr5 import cell as kr5_cell
from kr5.models.kinds import Kind, kind_of_file


@dataclass
class Model:
    """A robot that was read from a file."""

    file: Path
    kind: Kind
    cell: Any  # kr5.cell.Cell
    joints: list[str]  # names, from the base
    base: str = ""  # link or body that is the base of the cell; empty for a cell file
    tip: str = ""  # link, body or site that is its tool tip
    notes: list[str] = field(default_factory=list)  # what the cell cannot hold, or what was assumed, in words
    command_ranges: dict[int, tuple[float, float]] = field(default_factory=dict)  # of joints from 0 [rad or m]


def read_model(path: Path | str, base: str = "", tip: str = "") -> Model:
    """The robot in a URDF, an MJCF or a cell file, which the content tells, not the ending.

    base, tip: links (URDF) or bodies (MJCF, where the tip may be a site) of the arm; by default the root and the only
    end. The cell of a URDF or MJCF has a tool, without mass where the file has none, on which a payload may sit. Raises
    kr5.IoError, of one line with the remedy, for a file that holds no such arm.
    """
    file = Path(path)
    kind = kind_of_file(file)
    if kind == Kind.CELL:
        return _read_cell(file, base, tip)
    if kind == Kind.SDF:
        raise kr5.IoError(f"{file}: is an SDF, which is written but not read; give the URDF of the robot")
    model = _read_urdf(file, base, tip) if kind == Kind.URDF else _read_mjcf(file, base, tip)
    if model.cell.tool is None:
        model.cell.tool = kr5_cell.Tool()
    return model


def _read_cell(file: Path, base: str, tip: str) -> Model:
    if base or tip:
        option = "--base" if base else "--tip"
        raise kr5.IoError(f"{file}: {option}: only for a URDF or an MJCF; a cell has one arm, from B to E")
    cell = kr5_cell.load_cell(file)
    names = list(cell.robot.joint_names) or [f"joint{k + 1}" for k in range(cell.robot.joints)]
    return Model(file, Kind.CELL, cell, names)


def _read_urdf(file: Path, base: str, tip: str) -> Model:
    found = kr5_cell.import_urdf(file, base, tip)
    return Model(file, Kind.URDF, found.cell, list(found.joints), found.base, found.tip, list(found.notes))


def _read_mjcf(file: Path, base: str, tip: str) -> Model:
    from kr5.models.mjcf_actuators import command_ranges
    from kr5.models.mjcf_arm import cell_of_mjcf, notes_of
    from kr5.models.mjcf_loading import load_mjcf

    arm = load_mjcf(file, base, tip)
    held = {arm.joints.index(joint): span for joint, span in command_ranges(arm.model, arm.joints).items()}
    return Model(file, Kind.MJCF, cell_of_mjcf(arm), arm.names, arm.base, arm.tip, notes_of(arm), held)
