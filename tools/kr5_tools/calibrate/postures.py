"""Postures of an arm with what was measured of them: from a table, from files of sockets, or from a recording."""

from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import kr5.kinematics
import numpy as np
from kr5 import calibration
from kr5.tables.options import TableOptions
from kr5.tables.roles import PointsRole, PoseRole, joints_role
from kr5.tables.table import Table

POSE = PoseRole(needed=False, strict=False)
POINTS = PointsRole(instead="pose", option="--position")


def read_postures(
    source: Path, joints: list[kr5.kinematics.DhJoint], wanted: TableOptions
) -> list[calibration.ArmPosture]:
    """Postures of a table."""
    table = wanted.read(source, [joints_role(joints), POSE, POINTS], len(joints))
    return [
        calibration.ArmPosture(name=table.row_name(i), q=row, **seen)
        for i, (row, seen) in enumerate(zip(table["q"], measured(table), strict=True))
    ]


def measured(table: Table) -> list[dict[str, Any]]:
    """What each row tells: the pose of the tool where the table has orientations, else the points on it; named as the
    fields of ArmPosture and of JointSample."""
    points = table.get("points")
    if "pose" in table and (points is None or points.shape[1] == 1):
        return [{"T_world_tool": pose} for pose in table.poses["pose"]]
    assert points is not None, "needed where there are no poses"
    return [{"points": kr5.points_from_rows(row)} for row in points]


def read_joint_values(file: Path, joints: list[kr5.kinematics.DhJoint], wanted: TableOptions) -> np.ndarray:
    """Rows of joint values alone, with or without names of columns."""
    return wanted.read(file, [joints_role(joints)], len(joints))["q"]


def read_socket(
    name: str, file: Path, joints: list[kr5.kinematics.DhJoint], wanted: TableOptions
) -> list[calibration.ArmPosture]:
    """Postures whose tip rests in one socket."""
    table = wanted.read(file, [joints_role(joints)], len(joints))
    return [calibration.ArmPosture(name=table.row_name(i), q=row, socket=name) for i, row in enumerate(table["q"])]


def recorded_postures(recording: kr5.cell.Recording, split: str, joints: int) -> list[Any]:
    """The postures of a recording's `poses`: the tool in the base."""
    postures = []
    for experiment in recording.experiments:
        if str(experiment.kind) != "poses" or str(experiment.split) != split:
            continue
        q = np.column_stack([experiment[f"q{k + 1}"] for k in range(joints)])
        xyz = np.column_stack([experiment[a] for a in "xyz"])
        quaternion = np.column_stack([experiment[a] for a in ("qx", "qy", "qz", "qw")])
        T = calibration.to_poses(np.hstack([xyz, quaternion]), calibration.PoseFormat(rotation="quaternion_xyzw"))
        postures += [
            calibration.ArmPosture(name=f"{experiment.name}:{i + 1}", q=q[i], T_world_tool=T[i]) for i in range(len(q))
        ]
    return postures
