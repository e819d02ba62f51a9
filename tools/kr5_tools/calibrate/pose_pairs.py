"""Pairs of poses for a hand-eye calibration: a CSV, two files of poses, or what MoveIt, easy_handeye and easy_handeye2
save."""

import shlex
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import kr5
import numpy as np
from kr5 import calibration, io
from kr5.files.documents import OpenDocument, PoseMatrix, parse_json, parse_yaml, read_text, validate_document
from pydantic import AfterValidator, Field

from kr5_tools.calibrate.conventions import CONVENTIONS

EXPECTED = (
    "pairs of poses: a CSV with the columns robot_x … camera_x …, samples of MoveIt (effector_wrt_world,"
    " object_wrt_sensor) or of easy_handeye (robot, tracking)"
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
    """Complains of a folder that is read as one of images, where one of its files is a CSV of pairs of poses."""
    for file in sorted(folder.glob("*.csv")):
        try:
            columns = {c.lower() for c in io.load_csv(file).columns}
        except kr5.Error:
            continue
        if any({part + axis for part in parts for axis in "xyz"} <= columns for parts in PREFIXES):
            raise kr5.FileError(
                folder,
                f"holds pairs of poses: kr5 calibrate hand-eye {shlex.quote(str(file))} --mount eye_in_hand"
                " (or eye_to_hand)",
            )


def read_pairs_file(
    file: Path,
    camera_poses: Path | None = None,
    convention: str | None = None,
    length: str | None = None,
    angle: str | None = None,
    mount: Any = None,
) -> PosePairs:
    """The pairs of a file in any of the forms, or of two files of poses; `mount`, where it is known, says what
    easy_handeye meant."""
    if camera_poses:
        return _two_files(file, camera_poses, convention, length, angle)
    if file.suffix.lower() == ".csv":
        return _table(file, convention, length, angle)
    if given := [flag for flag, v in (("--convention", convention), ("--length", length), ("--angle", angle)) if v]:
        raise kr5.InvalidArgument(
            f"{', '.join(given)}: only with a CSV; samples of MoveIt and easy_handeye are in m, with quaternions"
        )
    text = read_text(file, EXPECTED)
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


def _form(name: str, length: str | None, angle: str | None) -> Any:
    _, rotation, unit = CONVENTIONS[name]
    position = length or ("mm" if name == "kuka" else "m")
    return calibration.PoseFormat.from_dict({"position": position, "rotation": rotation, "angle": angle or unit})


def _convention(file: Path, name: str | None, columns: list[str], prefix: str) -> str:
    found = name or next((n for n, (want, *_) in CONVENTIONS.items() if {prefix + c for c in want} <= set(columns)), "")
    if found not in CONVENTIONS:
        raise kr5.FileError(
            file,
            f"found the columns {', '.join(columns)}, expected {prefix}x {prefix}y {prefix}z and an orientation"
            f" such as {prefix}qx {prefix}qy {prefix}qz {prefix}qw, and the same of the camera; --convention is one of"
            f" {', '.join(CONVENTIONS)}",
        )
    return found


def _table(file: Path, convention: str | None, length: str | None, angle: str | None) -> PosePairs:
    table = io.load_csv(file)
    columns, values = [c.lower() for c in table.columns], np.asarray(table.values)
    prefixes = next((p for p in PREFIXES if all(f"{part}x" in columns for part in p)), PREFIXES[0])
    rows = []
    for prefix in prefixes:
        name = _convention(file, convention, columns, prefix)
        wanted = [prefix + c for c in ("x", "y", "z", *CONVENTIONS[name][0])]
        if missing := [c for c in wanted if c not in columns]:
            raise kr5.FileError(file, f"found the columns {', '.join(columns)}; missing: {', '.join(missing)}")
        found = values[:, [columns.index(c) for c in wanted]]
        rows.append(_checked(file, found, _form(name, length, angle), prefix, bool(length or angle)))
    (robot, form), (camera, seen) = rows
    times = next((list(values[:, columns.index(c)]) for c in ("t", "time", "stamp") if c in columns), [])
    names = [f"{file.name}:{i + 2}" for i in range(len(robot))]
    return PosePairs("CSV", robot, form, list(calibration.to_poses(camera, seen)), names, times)


def _checked(file: Path, rows: np.ndarray, form: Any, what: str, stated: bool = False) -> tuple[np.ndarray, Any]:
    """Refuses rows that cannot be read so, or whose size contradicts a stated unit; without, the diagnosis judges."""
    if stated and (objections := calibration.format_objections(rows, form)):
        raise kr5.FileError(
            file,
            f"{what}… read as {form.position}, {form.angle}: {'; '.join(objections)}",
            remedy="see --length, --angle",
        )
    try:
        calibration.to_poses(rows, form)
    except kr5.InvalidArgument as error:
        raise kr5.FileError(file, f"{what}… read as {form.rotation}: {error}") from error
    return rows, form


def _two_files(file: Path, camera: Path, convention: str | None, length: str | None, angle: str | None) -> PosePairs:
    name = convention or "quaternion"
    if name not in CONVENTIONS:
        raise kr5.InvalidArgument(f"--convention: found {name}, expected one of {', '.join(CONVENTIONS)}")
    form = _form(name, length, angle)
    robot, seen = (calibration.load_poses(str(f), form.rotation) for f in (file, camera))
    if len(robot) != len(seen):
        raise kr5.InvalidArgument(
            f"{camera}: found {len(seen)} poses of the target for {len(robot)} robot poses in {file};"
            " expected one for each, in the same order"
        )
    stated = bool(length or angle)
    _checked(file, robot, form, "", stated), _checked(camera, seen, form, "", stated)
    names = [f"{file.name}:{i + 1}" for i in range(len(robot))]
    return PosePairs("two files of poses", robot, form, list(calibration.to_poses(seen, form)), names)


def _from_matrices(source: str, file: Path, robot: list[Any], seen: list[Any]) -> PosePairs:
    form = calibration.PoseFormat(rotation="matrix")
    rows, marks = (np.array([np.ravel(T) for T in poses], float).reshape(-1, 16) for poses in (robot, seen))
    _checked(file, rows, form, "robot poses "), _checked(file, marks, form, "camera poses ")
    names = [f"sample {i + 1}" for i in range(len(rows))]
    return PosePairs(source, rows, form, list(calibration.to_poses(marks, form)), names)


def _moveit(file: Path, data: list[Any], text: str) -> PosePairs:
    """Samples of MoveIt's plugin: a list of maps, or in JSON a list of pairs of matrices."""
    if all(isinstance(sample, list) for sample in data) and data:
        pairs = [validate_document({"pair": s}, MatrixPair, file, text, at=(i,)).pair for i, s in enumerate(data)]
        return _from_matrices("MoveIt", file, [p[0] for p in pairs], [p[1] for p in pairs])
    samples = [validate_document(s, MoveItSample, file, text, at=(i,)) for i, s in enumerate(data)]
    return _from_matrices(
        "MoveIt", file, [s.effector_wrt_world for s in samples], [s.object_wrt_sensor for s in samples]
    )


def _row(T: Transform | StampedTransform) -> list[float]:
    inner = T.transform if isinstance(T, StampedTransform) else T
    p, q = inner.translation, inner.rotation
    return [p.x, p.y, p.z, q.x, q.y, q.z, q.w]


def _from_transforms(source: str, file: Path, robot: list[Any], seen: list[Any], mount: str | None) -> PosePairs:
    """easy_handeye saves the flange in the base for a camera on the hand, but the base in the flange for one on the
    base."""
    form = calibration.PoseFormat(meaning="T_flange_base" if mount == "eye_to_hand" else "T_base_flange")
    rows, marks = (np.array([_row(T) for T in poses], float).reshape(-1, 7) for poses in (robot, seen))
    _checked(file, rows, form, "robot "), _checked(file, marks, form, "tracking ")
    names = [f"sample {i + 1}" for i in range(len(rows))]
    found = list(calibration.to_poses(marks, calibration.PoseFormat()))
    return PosePairs(source, rows, form, found, names, mount=mount)


def _easy(file: Path, data: EasyFile, mount: str | None) -> PosePairs:
    said = data.parameters
    mount = mount or MOUNTS.get(said.calibration_type)
    if not mount and said.eye_on_hand is not None:
        mount = "eye_in_hand" if said.eye_on_hand else "eye_to_hand"
    seen = [s.tracking or s.optical for s in data.samples]
    if missing := [i for i, T in enumerate(seen) if T is None]:
        raise kr5.FileError(
            file, f"samples[{missing[0]}]: tracking: is missing; expected the pose of the marker in the camera"
        )
    return _from_transforms("easy_handeye", file, [s.robot for s in data.samples], seen, mount)


def _easy_lists(file: Path, data: EasyLists, mount: str | None) -> PosePairs:
    lists = (data.hand_world_samples, data.camera_marker_samples)
    robot, seen = (part.transforms if isinstance(part, TransformArray) else part for part in lists)
    if len(robot) != len(seen):
        raise kr5.FileError(file, f"found {len(robot)} hand_world_samples, but {len(seen)} camera_marker_samples")
    return _from_transforms("easy_handeye", file, list(robot), list(seen), mount)
