"""Sensitivity of an arm's pose to its Denavit-Hartenberg parameters: at one pose, and over the workspace (Hayat et al.
2022, section 3.3)."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import kr5.kinematics
import numpy as np
from kr5.files.paths import SHIPPED_CELL, find_shipped

from kr5_tools.sensitivity.analysis import Analysis
from kr5_tools.sensitivity.inputs_file import Quantity
from kr5_tools.sensitivity.model import ArmModel
from kr5_tools.sweep.sweep_file import cell_text

PRINTED_ARM = Path("share/cells/kr5_arc_printed.yaml")
HOME = (0.0, 70.0, 12.0, 0.0, 0.0, 0.0)  # [deg], of case 1
OUTPUTS = (*(Quantity(name, "mm") for name in ("X", "Y", "Z")), *(Quantity(name, "deg") for name in ("RX", "RY", "RZ")))
ROUNDING = 1e-12  # [m, rad]
GROUPS = {
    "all": "all parameters",
    "errors": "errors of all parameters",
    "lengths": "lengths b and a alone",
    "angles": "angles theta and alpha alone",
}


@dataclass(frozen=True)
class Arm:
    """The nominal arm, where it stands, and its limits where the analysis is of the whole workspace."""

    name: str
    cell: str  # text
    chain: Any
    posture: tuple[float, ...]  # [rad or m]
    limits: tuple[tuple[float, float], ...] | None  # [rad or m]


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of lengths [m] and angles [rad], and where both are cut off [-]."""

    length: float
    angle: float
    truncation: float


def load_arm(file: Path | None, pose: str | None, workspace: bool) -> Arm:
    """The arm of a cell, by default that of Table 3.1."""
    from kr5.cell import load_cell

    path = file or find_shipped(PRINTED_ARM)
    if path is None:
        raise kr5.InvalidArgument(f"--cell: is missing, and there is no {PRINTED_ARM} here; specify a cell")
    cell = load_cell(path)
    chain = cell.nominal_chain()
    if pose is None and len(chain.joints) != len(HOME):
        raise kr5.InvalidArgument(
            f"--pose: is missing; the arm of {path} has {len(chain.joints)} joints, give their values"
        )
    posture = parse_posture(pose, chain) if pose else tuple(np.radians(HOME).tolist())
    limits = joint_limits(cell, path, file is None)
    if workspace and limits is None:
        raise kr5.FileError(
            path,
            f"is missing; the workspace needs the limits of the joints, as in {SHIPPED_CELL}",
            field="robot.limits",
        )
    if limits and file is not None:
        outside = [k + 1 for k, (q, (low, high)) in enumerate(zip(posture, limits)) if not low <= q <= high]
        if outside and not workspace:
            names = ", ".join(f"joint {k}" for k in outside)
            warnings.warn(f"the pose lies outside the limits of {names}", kr5.Caution, stacklevel=2)
    return Arm(cell.name or path.stem, cell_text(cell), chain, posture, limits if workspace else None)


def joint_limits(cell: kr5.cell.Cell, path: Path, printed: bool) -> tuple[tuple[float, float], ...] | None:
    """Those of the cell; of the printed table, whose limits (Table 3.2) are lost, those of the KR5 that ships."""
    from kr5.cell import load_cell

    if cell.robot.limits is None and printed and (shipped := find_shipped(SHIPPED_CELL)):
        cell = load_cell(shipped)
    limits = cell.robot.limits
    return None if limits is None else tuple(zip(map(float, limits.lower), map(float, limits.upper)))


def parse_posture(text: str, chain: kr5.kinematics.DhChain) -> tuple[float, ...]:
    """Joint values as typed, in degrees, of prismatic joints in mm."""
    try:
        values = [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise kr5.InvalidArgument(
            f"--pose: found {text!r}, expected {len(chain.joints)} numbers [deg; mm of prismatic joints]"
        ) from None
    if len(values) != len(chain.joints) or not np.isfinite(values).all():
        raise kr5.InvalidArgument(
            f"--pose: found {len(values)} numbers, expected {len(chain.joints)} that are finite"
            " [deg; mm of prismatic joints]"
        )
    return tuple(
        1e-3 * value if is_prismatic(joint) else float(np.radians(value)) for joint, value in zip(chain.joints, values)
    )


def is_prismatic(joint: kr5.kinematics.DhJoint) -> bool:
    return str(joint.type) == "prismatic"


def arm_analysis(arm: Arm, group: str, tolerances: Tolerances) -> Analysis:
    """The analysis of a group of parameters: of `all` with the joint values over the workspace as inputs, of the
    others with the errors of the parameters, averaged over the workspace."""
    from kr5.kinematics import joint_parameters
    from kr5.uncertainty import UncertainInput

    parameters = [p for p in joint_parameters(arm.chain) if in_group(p, group, arm)]
    averaged = arm.limits is not None and group != "all"
    inputs, units = [], []
    for p in parameters:
        moved = str(p.parameter) == ("b" if is_prismatic(arm.chain.joints[p.joint]) else "theta")
        units.append(Quantity(p.label, "mm" if p.is_length else "deg"))
        if moved and arm.limits is not None and group == "all":
            low, high = (end - arm.posture[p.joint] for end in arm.limits[p.joint])
            inputs.append(UncertainInput(name=p.label, law="uniform", low=low, high=high))
        else:
            sigma = tolerances.length if p.is_length else tolerances.angle
            inputs.append(UncertainInput(name=p.label, sigma=sigma, truncation=tolerances.truncation))
    if averaged and arm.limits is not None:
        for k, (low, high) in enumerate(arm.limits):
            unit = "mm" if is_prismatic(arm.chain.joints[k]) else "deg"
            units.append(Quantity(f"q{k + 1}", unit))
            inputs.append(UncertainInput(name=f"q{k + 1}", law="uniform", low=low, high=high, averaged=True))
    model = ArmModel(
        arm.cell, tuple((p.joint, str(p.parameter)) for p in parameters), arm.posture, joints_vary=averaged
    )
    words = group_words(group)
    return Analysis(
        name=group.replace(",", "-"),
        title=f"{arm.name}, {words}, {where_text(arm, averaged)}",
        text=explanation(arm, group, averaged, tolerances),
        model=model,
        inputs=tuple(inputs),
        units=tuple(units),
        outputs=OUTPUTS,
        resolution=ROUNDING,
    )


def group_words(group: str) -> str:
    return GROUPS.get(group, f"{group} alone")


def where_text(arm: Arm, averaged: bool) -> str:
    if arm.limits is None:
        shown = (
            f"{1e3 * q:g} mm" if is_prismatic(j) else f"{np.degrees(q):.4g}°"
            for j, q in zip(arm.chain.joints, arm.posture)
        )
        return f"at [{', '.join(shown)}]"
    return "averaged over the workspace" if averaged else "over the workspace"


def explanation(arm: Arm, group: str, averaged: bool, tolerances: Tolerances) -> str:
    """What varies, in a sentence or two."""
    sizes = f"{1e3 * tolerances.length:g} mm and {np.degrees(tolerances.angle):g}°"
    normal = f"with standard deviations of {sizes}, cut off at {tolerances.truncation:g} of them"
    if arm.limits is None:
        return f"Parameters are normal {normal}."
    if averaged:
        return (
            f"Parameters are normal {normal}; joint values are uniform between their limits, and an index is the"
            " share of the variance at a posture, averaged over the postures."
        )
    return (
        f"Joint values are uniform between their limits and are inputs like the other parameters, which are normal"
        f" {normal}: the motion of the joints takes nearly all of the variance. What errors of the parameters do"
        " over the workspace, the other groups tell."
    )


def in_group(parameter: kr5.kinematics.JointParameter, group: str, arm: Arm) -> bool:
    if group in ("all", "errors"):
        return True
    if group in ("lengths", "angles"):
        return bool(parameter.is_length) == (group == "lengths")
    return parameter.label in group.split(",")


def check_group(group: str, arm: Arm) -> str:
    """A group as it is typed: one of GROUPS, or names of parameters."""
    from kr5.kinematics import joint_parameters

    if group in GROUPS:
        return group
    known = [p.label for p in joint_parameters(arm.chain)]
    names = [name.strip() for name in group.split(",")]
    if unknown := [name for name in names if name not in known]:
        raise kr5.InvalidArgument(
            f"--group: found {unknown[0]!r}, expected {', '.join(GROUPS)}, or parameters out of {', '.join(known)}"
        )
    return ",".join(name for name in known if name in names)
