"""Pairs of poses for a hand-eye calibration: a table, two files of poses, or what other programs save."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import kr5
import numpy as np
import numpy.typing as npt
from kr5 import calibration
from kr5.files.documents import OpenDocument, PoseMatrix, parse_json, parse_yaml, read_text, validate_document
from kr5.files.opencv_storage import parse_storage
from kr5.logs.log_file import TABLE_ENDINGS
from kr5.tables.options import TableOptions
from kr5.tables.read_table import column_names
from kr5.tables.roles import OPTIONAL_TIME, PoseRole
from pydantic import AfterValidator, Field

from kr5_tools.calibrate.opencv_pairs import pairs_of_storage

EXPECTED = (
    "pairs of poses: a table with the columns robot_x … camera_x …, samples of MoveIt (effector_wrt_world,"
    " object_wrt_sensor) or of easy_handeye (robot, tracking), or matrices of OpenCV in"
    " YAML, XML or JSON (T1_0 …, T2_0 …; R_gripper2base, t_gripper2base …)"
)
PREFIXES = (("robot_", "camera_"), ("flange_", "target_"))
MOUNTS = {"eye_in_hand": "eye_in_hand", "eye_on_hand": "eye_in_hand", "eye_on_base": "eye_to_hand"}


@dataclass
class PosePairs:
    """Robot poses as rows of a convention, and poses of the target in the camera."""

    source: str
    rows: np.ndarray
    convention: Any
    T_camera_target: list[np.ndarray]
    names: list[str]
    times: list[float] = field(default_factory=list)
    mount: Any = None  # where the file says it


class Vector(OpenDocument):
    x: float
    y: float
    z: float


class Quaternion(Vector):
    w: float


class Transform(OpenDocument):
    translation: Vector
    rotation: Quaternion


class StampedTransform(OpenDocument):
    transform: Transform


AnyTransform = Transform | StampedTransform


def _is_matrix(values: list[float]) -> list[float]:
    if len(values) != 16:
        raise ValueError("16 numbers of a 4 x 4 matrix, row by row")
    return values


Matrix = Annotated[list[float], AfterValidator(_is_matrix)] | PoseMatrix


class MoveItSample(OpenDocument):
    effector_wrt_world: Matrix
    object_wrt_sensor: Matrix


class MatrixPair(OpenDocument):
    pair: list[PoseMatrix] = Field(min_length=2, max_length=2, description="the robot's pose and the target's")


class EasySample(OpenDocument):
    robot: Transform | StampedTransform
    tracking: Transform | StampedTransform | None = None
    optical: Transform | StampedTransform | None = None


class EasyParameters(OpenDocument):
    calibration_type: str = ""
    eye_on_hand: bool | None = None


class EasyFile(OpenDocument):
    samples: list[EasySample]
    parameters: EasyParameters = EasyParameters()


class TransformArray(OpenDocument):
    transforms: list[Transform]


class EasyLists(OpenDocument):
    """The lists of easy_handeye, as its service reports them."""

    hand_world_samples: TransformArray | list[Transform]
    camera_marker_samples: TransformArray | list[Transform]


def check_holds_no_pairs(folder: Path) -> None:
    """Complains of a folder that is read as one of images, where one of its files is a table of pairs of poses."""
    for file in sorted(folder.glob("*.csv")):
        try:
            columns = set(column_names(file))
        except kr5.Error:
            continue
        if any({part + axis for part in parts for axis in "xyz"} <= columns for parts in PREFIXES):
            raise kr5.FileError(
                folder,
                f"holds pairs of poses: kr5 calibrate hand-eye {shlex.quote(str(file))} --mount eye_in_hand"
                " (or eye_to_hand)",
            )


def read_pairs_file(
    file: Path, camera_poses: Path | None = None, wanted: TableOptions | None = None, mount: str | None = None
) -> PosePairs:
    """The pairs of a file in any of the forms, or of two files of poses; `mount`, where it is known, says what
    easy_handeye meant."""
    wanted = wanted or TableOptions()
    for source in (file, camera_poses):
        if source is not None and not source.exists():
            raise kr5.FileError(source, f"no such file; expected {EXPECTED}")
    if camera_poses:
        return _two_files(file, camera_poses, wanted)
    if file.suffix.lower().lstrip(".") in TABLE_ENDINGS:
        return _table(file, wanted)
    if given := [
        flag
        for flag, v in (
            *(("--columns", wanted.columns), ("--convention", wanted.convention)),
            *(("--length-unit", wanted.length), ("--angle-unit", wanted.angle)),
        )
        if v
    ]:
        raise kr5.InvalidArgument(
            f"{', '.join(given)}: only with a table; samples of MoveIt and easy_handeye are in m, with quaternions"
        )
    text = read_text(file, EXPECTED)
    if (stored := parse_storage(text, file, EXPECTED)) is not None:
        found = pairs_of_storage(stored, file)
        return _from_matrices("OpenCV", file, found.robot, found.seen)
    data = (parse_json if file.suffix.lower() == ".json" else parse_yaml)(text, file, EXPECTED)
    if isinstance(data, list):
        return _moveit(file, data, text)
    if isinstance(data, dict) and isinstance(data.get("samples"), dict):
        data = data["samples"]
    if isinstance(data, dict) and "hand_world_samples" in data:
        return _easy_lists(file, validate_document(data, EasyLists, file, text), mount)
    if isinstance(data, dict) and "samples" in data:
        return _easy(file, validate_document(data, EasyFile, file, text), mount)
    raise kr5.FileError(file, f"found no pairs of poses; expected {EXPECTED}")


def _table(file: Path, wanted: TableOptions) -> PosePairs:
    """Units that nothing states are judged by the diagnosis, which sees both poses of a pair."""
    columns = column_names(file, wanted.columns)
    prefixes = next((p for p in PREFIXES if all(f"{part}x" in columns for part in p)), PREFIXES[0])
    stated = bool(wanted.length or wanted.angle)
    roles = [PoseRole(part, prefix=part, strict=stated, guess_units=False) for part in prefixes]
    table = wanted.read(file, [*roles, OPTIONAL_TIME])
    robot, camera = prefixes
    names = [table.row_name(i) for i in range(table.rows)]
    times = [float(t) for t in table["t"]] if "t" in table else []
    rows, form = table.pose_rows[robot], table.pose_formats[robot]
    return PosePairs("CSV", rows, form, table.poses[camera], names, times)


def _checked(file: Path, rows: np.ndarray, form: calibration.PoseFormat, what: str) -> None:
    """Refuses rows that cannot be read so."""
    try:
        calibration.to_poses(rows, form)
    except kr5.InvalidArgument as error:
        raise kr5.FileError(file, f"{what}… read as {form.rotation}: {error}") from error


def _two_files(file: Path, camera: Path, wanted: TableOptions) -> PosePairs:
    stated = bool(wanted.length or wanted.angle)
    robot, seen = (wanted.read_poses(f, strict=stated, guess_units=False) for f in (file, camera))
    if len(robot.rows) != len(seen.rows):
        raise kr5.InvalidArgument(
            f"{camera}: found {len(seen.rows)} poses of the target for {len(robot.rows)} robot poses in {file};"
            " expected one for each, in the same order"
        )
    return PosePairs("two files of poses", robot.rows, robot.format, seen.poses, robot.names)


def _from_matrices(source: str, file: Path, robot: Sequence[npt.ArrayLike], seen: Sequence[npt.ArrayLike]) -> PosePairs:
    form = calibration.PoseFormat(rotation="matrix")
    rows, marks = (np.array([np.ravel(T) for T in poses], float).reshape(-1, 16) for poses in (robot, seen))
    _checked(file, rows, form, "robot poses ")
    _checked(file, marks, form, "camera poses ")
    names = [f"sample {i + 1}" for i in range(len(rows))]
    return PosePairs(source, rows, form, list(calibration.to_poses(marks, form)), names)


def _moveit(file: Path, data: list[object], text: str) -> PosePairs:
    """Samples of MoveIt's plugin: a list of maps, or in JSON a list of pairs of matrices."""
    if all(isinstance(sample, list) for sample in data) and data:
        pairs = [validate_document({"pair": s}, MatrixPair, file, text, at=(i,)).pair for i, s in enumerate(data)]
        return _from_matrices("MoveIt", file, [p[0] for p in pairs], [p[1] for p in pairs])
    samples = [validate_document(s, MoveItSample, file, text, at=(i,)) for i, s in enumerate(data)]
    return _from_matrices(
        "MoveIt", file, [s.effector_wrt_world for s in samples], [s.object_wrt_sensor for s in samples]
    )


def _row(T: AnyTransform) -> list[float]:
    inner = T.transform if isinstance(T, StampedTransform) else T
    p, q = inner.translation, inner.rotation
    return [p.x, p.y, p.z, q.x, q.y, q.z, q.w]


def _from_transforms(
    source: str, file: Path, robot: Sequence[AnyTransform], seen: Sequence[AnyTransform], mount: str | None
) -> PosePairs:
    """easy_handeye saves the flange in the base for a camera on the hand, but the base in the flange for one on the
    base."""
    form = calibration.PoseFormat(meaning="T_flange_base" if mount == "eye_to_hand" else "T_base_flange")
    rows, marks = (np.array([_row(T) for T in poses], float).reshape(-1, 7) for poses in (robot, seen))
    _checked(file, rows, form, "robot ")
    _checked(file, marks, form, "tracking ")
    names = [f"sample {i + 1}" for i in range(len(rows))]
    found = list(calibration.to_poses(marks, calibration.PoseFormat()))
    return PosePairs(source, rows, form, found, names, mount=mount)


def _easy(file: Path, data: EasyFile, mount: str | None) -> PosePairs:
    said = data.parameters
    mount = mount or MOUNTS.get(said.calibration_type)
    if not mount and said.eye_on_hand is not None:
        mount = "eye_in_hand" if said.eye_on_hand else "eye_to_hand"
    seen: list[AnyTransform] = []
    for i, sample in enumerate(data.samples):
        T = sample.tracking or sample.optical
        if T is None:
            raise kr5.FileError(
                file, f"samples[{i}]: tracking: is missing; expected the pose of the marker in the camera"
            )
        seen.append(T)
    return _from_transforms("easy_handeye", file, [s.robot for s in data.samples], seen, mount)


def _easy_lists(file: Path, data: EasyLists, mount: str | None) -> PosePairs:
    lists = (data.hand_world_samples, data.camera_marker_samples)
    robot, seen = (part.transforms if isinstance(part, TransformArray) else part for part in lists)
    if len(robot) != len(seen):
        raise kr5.FileError(file, f"found {len(robot)} hand_world_samples, but {len(seen)} camera_marker_samples")
    return _from_transforms("easy_handeye", file, list(robot), list(seen), mount)
