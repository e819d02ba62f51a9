"""Postures of an arm with what was measured of them: from a CSV, from files of sockets, or from a recording."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kr5
import numpy as np
from kr5 import calibration, io

from kr5_tools.calibrate.conventions import CONVENTIONS

LENGTHS = {"m": 1.0, "mm": 1e-3}
ANGLES = {"rad": 1.0, "deg": np.pi / 180}


@dataclass
class Columns:
    """Names of the columns of a CSV, separated by commas, and their units; None: the usual names."""

    joints: str | None = None
    position: str | None = None
    convention: str | None = None
    length: str = "m"
    angle: str = "rad"

    def joint_names(self, count: int) -> list[str]:
        """Names of the joints' columns; of a pattern as many as are asked for."""
        pattern = self.joints or "q{}"
        if "{}" in pattern and "," not in pattern:
            return [pattern.replace("{}", str(k + 1)) for k in range(count)]
        return pattern.split(",")


def read_postures(source: Path, joints: list[Any], wanted: Columns) -> list[Any]:
    """Postures of a CSV."""
    table = io.load_csv(source)
    q = joint_values(source, table, joints, wanted)
    return [
        calibration.ArmPosture(name=f"{source.name}:{i + 2}", q=row, **seen)  # the line in the file
        for i, (row, seen) in enumerate(zip(q, measured(source, table, wanted), strict=True))
    ]


def measured(file: Path, table: Any, wanted: Columns) -> list[dict[str, Any]]:
    """What each row tells: the pose of the tool where the table has orientations, else the points on it; named as the
    fields of ArmPosture and of JointSample."""
    position = position_columns(table, wanted)
    T = orientation_of(file, table, position, wanted) if len(position) == 1 else None
    if T is not None:
        return [{"T_world_tool": pose} for pose in T]
    points = np.stack([values_of(file, table, names) * LENGTHS[wanted.length] for names in position], axis=1)
    return [{"points": kr5.points_from_rows(row)} for row in points]


def read_socket(name: str, file: Path, joints: list[Any], wanted: Columns) -> list[Any]:
    """Postures whose tip rests in one socket: joint values alone, with or without a header."""
    try:
        empty = not file.read_text(encoding="utf-8").strip()
        q = np.empty((0, 0)) if empty else np.atleast_2d(np.loadtxt(file, delimiter=","))
    except (OSError, UnicodeDecodeError) as error:
        raise kr5.FileError(file, f"cannot be read ({error})") from error
    except ValueError:
        q = joint_values(file, io.load_csv(file), joints, wanted)
    else:
        if empty:
            raise kr5.FileError(file, "is empty; expected a row of joint values for each touch")
        if q.shape[1] != len(joints):
            raise kr5.FileError(file, f"found {q.shape[1]} columns, expected the {len(joints)} joint values of the arm")
        q = q * _joint_scale(joints, wanted)
    return [calibration.ArmPosture(name=f"{file.name}:{i + 1}", q=row, socket=name) for i, row in enumerate(q)]


def recorded_postures(recording: Any, split: str, joints: int) -> list[Any]:
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


def values_of(file: Path, table: Any, names: list[str]) -> np.ndarray:
    """Columns of a table by their names."""
    columns = list(table.columns)
    if missing := [name for name in names if name not in columns]:
        raise kr5.FileError(
            file, f"found the columns {', '.join(columns)}; missing: {', '.join(missing)} (see --joints and --position)"
        )
    return np.asarray(np.asarray(table.values)[:, [columns.index(name) for name in names]], float)


def _joint_scale(joints: list[Any], wanted: Columns) -> np.ndarray:
    """Of a joint's value: an angle, or for a prismatic joint a length."""
    return np.array(
        [LENGTHS[wanted.length] if str(j.type) == "prismatic" else ANGLES[wanted.angle] for j in joints], float
    )


def joint_values(file: Path, table: Any, joints: list[Any], wanted: Columns) -> np.ndarray:
    names = wanted.joint_names(len(joints))
    if len(names) != len(joints):
        raise kr5.InvalidArgument(
            f"--joints: found {len(names)} names, expected {len(joints)}, one a joint, or a pattern such as joint_{{}}"
        )
    q: np.ndarray = values_of(file, table, names) * _joint_scale(joints, wanted)
    check_angles(file, names, q[:, [str(j.type) != "prismatic" for j in joints]])
    return q


def check_angles(file: Path, names: list[str], q: np.ndarray) -> None:
    """Refuses joint angles that no revolute joint has."""
    if (most := np.abs(q).max(initial=0.0)) > 4 * np.pi:
        raise kr5.FileError(
            file, f"{names[0]} …: joint angles of up to {most:.0f} rad; are they in degrees? (--angle deg)"
        )


def position_columns(table: Any, wanted: Columns) -> list[list[str]]:
    """Three columns a point."""
    names = wanted.position.split(",") if wanted.position else []
    if not names:
        columns = list(table.columns)
        numbered = [[f"{a}{k}" for a in "xyz"] for k in range(1, 100) if f"x{k}" in columns]
        return numbered or [["x", "y", "z"]]
    if len(names) % 3:
        raise kr5.InvalidArgument(
            f"--position: found {len(names)} names, expected three a point, e.g. x,y,z or x1,y1,z1,x2,y2,z2"
        )
    return [names[i : i + 3] for i in range(0, len(names), 3)]


def orientation_of(file: Path, table: Any, position: list[list[str]], wanted: Columns) -> list[Any] | None:
    """Whole poses where the table has orientations."""
    columns = list(table.columns)
    name = wanted.convention or next((n for n, (want, *_) in CONVENTIONS.items() if set(want) <= set(columns)), None)
    if name is None:
        return None
    if name not in CONVENTIONS:
        raise kr5.InvalidArgument(f"--convention: found {name}, expected one of {', '.join(CONVENTIONS)}")
    rotation, form, unit = CONVENTIONS[name]
    rows = np.hstack([values_of(file, table, position[0]), values_of(file, table, list(rotation))])
    form_of = {"position": wanted.length, "rotation": form, "angle": unit}
    return list(calibration.to_poses(rows, calibration.PoseFormat.from_dict(form_of)))
