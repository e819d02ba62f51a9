"""Pairs of poses in OpenCV's FileStorage, as cv::calibrateHandEye takes them."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kr5
import numpy as np
from kr5.files.opencv_storage import is_matrix

NUMBERED = re.compile(r"(.*?)_?([0-9]{1,9})")
MOST_ROWS = 1 << 20  # and columns, of a matrix
EXPECTED = (
    "two families of as many poses, numbered or in lists, such as T1_0 … of the hand in the base, and T2_0 … of the"
    " target in the camera; or rotations and translations, such as R_gripper2base, t_gripper2base, R_target2cam,"
    " t_target2cam"
)
OF_CAMERA = re.compile(r"target|marker|board|cam|object|tag|pattern", re.IGNORECASE)
OF_ROBOT = re.compile(r"gripper|hand|base|robot|flange|tool|effector|world", re.IGNORECASE)
FROM_FRAME = {"robot": ("base", "world"), "camera": ("cam",)}  # of which a name such as base2gripper is the inverse

Family = dict[int, np.ndarray]  # matrices by the numbers in their names, or by their places in a list


@dataclass
class StoredPairs:
    """Poses in pairs, 4x4 each [m]. robot: of the hand in the base; seen: of the target in the camera."""

    robot: list[np.ndarray]
    seen: list[np.ndarray]


def pairs_of_storage(data: object, file: Path) -> StoredPairs:
    """The pairs of a FileStorage; the hand stands before the target where names do not tell them apart."""
    families = _families(data, file)
    poses = {name: _poses(family, name, file) for name, family in families.items() if _is_pose(family)}
    poses |= _joined(families, file)
    if len(poses) != 2 or len({len(family) for family in poses.values()}) != 1:
        found = ", ".join(f"{len(family)} named {name}…" for name, family in poses.items()) or "none"
        raise kr5.FileError(file, f"found the poses {found}; expected {EXPECTED}")
    first, second = poses
    _check_numbers(first, poses[first], second, poses[second], file)
    swapped = _is_of_camera(first) and not _is_of_camera(second)
    robot, seen = (second, first) if swapped else (first, second)
    return StoredPairs(_forwards(robot, "robot", poses, file), _forwards(seen, "camera", poses, file))


def _families(data: object, file: Path) -> dict[str, Family]:
    """Matrices in lists, or with numbered names."""
    out: dict[str, Family] = {}
    for key, value in data.items() if isinstance(data, dict) else ():
        if is_matrix(value) and (match := NUMBERED.fullmatch(str(key))):
            family, number = out.setdefault(match[1], {}), int(match[2])
            if number in family:
                raise kr5.FileError(
                    file, f"found number {number} of {match[1]}… twice, expected it once", field=str(key)
                )
            family[number] = _matrix(value, str(key), file)
        elif isinstance(value, list) and value and all(map(is_matrix, value)):
            out[str(key)] = {i: _matrix(one, f"{key}[{i}]", file) for i, one in enumerate(value)}
    return {name: dict(sorted(family.items())) for name, family in out.items()}


def _matrix(value: dict[str, Any], name: str, file: Path) -> np.ndarray:
    try:
        rows, cols = int(value["rows"]), int(value["cols"])
    except (TypeError, ValueError, OverflowError):
        rows, cols = -1, -1
    if not (0 <= rows <= MOST_ROWS and 0 <= cols <= MOST_ROWS):
        raise kr5.FileError(file, f"rows and cols: expected whole numbers from 0 to {MOST_ROWS}", field=name)
    try:
        numbers = np.array(value["data"], float)
    except (TypeError, ValueError, OverflowError):  # of a number that is larger than any that is calculated with
        raise kr5.FileError(
            file, f"data: found something that is no number, expected {rows} x {cols} numbers", field=name
        ) from None
    if numbers.size != rows * cols:
        raise kr5.FileError(file, f"data: found {numbers.size}, expected {rows} x {cols} numbers", field=name)
    return numbers.reshape(rows, cols)


def _check_numbers(first: str, one: Family, second: str, other: Family, file: Path) -> None:
    """Complains of matrices that have no partner of their number: pairs by place alone would be of other instants."""
    if one.keys() == other.keys():
        return
    lonely = [
        f"{', '.join(map(str, sorted(mine.keys() - its.keys())[:5]))} of {name}… alone"
        for name, mine, its in ((first, one, other), (second, other, one))
        if mine.keys() - its.keys()
    ]
    raise kr5.FileError(
        file,
        f"found the numbers {' and '.join(lonely)}, expected those of {first}… and {second}… to be the same",
        remedy="remove the matrices that have no partner",
    )


def _check_finite(family: Family, name: str, file: Path) -> None:
    for number, matrix in family.items():
        if not np.isfinite(matrix).all():
            raise kr5.FileError(
                file, f"number {number} holds infinity or no number, expected finite numbers", field=f"{name}…"
            )


def _check_translations(family: Family, name: str, file: Path) -> None:
    for number, t in family.items():
        if t.size != 3:
            found = " x ".join(map(str, t.shape))
            raise kr5.FileError(
                file, f"number {number} is {found}, expected the three numbers of a translation", field=f"{name}…"
            )


def _is_pose(family: Family) -> bool:
    return all(m.shape in ((4, 4), (3, 4)) for m in family.values())


def _poses(family: Family, name: str, file: Path) -> Family:
    _check_finite(family, name, file)
    last = [0.0, 0.0, 0.0, 1.0]
    return {number: m if m.shape == (4, 4) else np.vstack([m, last]) for number, m in family.items()}


def _joined(families: dict[str, Family], file: Path) -> dict[str, Family]:
    """Poses of rotations (matrices, or vectors) with the translations of the same name."""
    out = {}
    for name, family in families.items():
        if not re.match(r"r(?!obot)|.*rvec|.*rot", name, re.IGNORECASE):
            continue
        if not all(m.shape == (3, 3) or m.size == 3 for m in family.values()):
            continue
        partner = next((t for t in families if t != name and _same_but_kind(name, t)), None)
        if partner is None:
            continue
        places = families[partner]
        if len(places) != len(family):
            raise kr5.FileError(file, f"found {len(family)} {name}, but {len(places)} {partner}")
        _check_numbers(name, family, partner, places, file)
        _check_finite(family, name, file)
        _check_finite(places, partner, file)
        _check_translations(places, partner, file)
        out[name] = {number: _of_parts(R, places[number]) for number, R in family.items()}
    return out


def _same_but_kind(rotation: str, translation: str) -> bool:
    """Whether names differ in the word for rotation and translation alone: R_target2cam and t_target2cam."""
    replaced = ((r"^R", "t"), (r"^r", "t"), (r"rvec", "tvec"), (r"rotations?", "translations?"), (r"rot", "(trans|t)"))
    for word, other in replaced:
        if (found := re.search(word, rotation)) is None:
            continue
        before, behind = (re.escape(part) for part in (rotation[: found.start()], rotation[found.end() :]))
        if re.fullmatch(f"{before}(?:{other}){behind}", translation, re.IGNORECASE):
            return True
    return False


def _of_parts(rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    if rotation.shape == (3, 3):
        T[:3, :3] = rotation
    else:
        T = kr5.to_pose([0.0, 0.0, 0.0, *rotation.ravel()])
    T[:3, 3] = translation.ravel()
    return T


def _is_of_camera(name: str) -> bool:
    return bool(OF_CAMERA.search(name)) and not OF_ROBOT.search(name)


def _forwards(name: str, whose: str, poses: dict[str, Family], file: Path) -> list[np.ndarray]:
    """Poses of a family, inverted where its name says so, as base2gripper does."""
    if not any(re.search(rf"{frame}\w*2", name, re.IGNORECASE) for frame in FROM_FRAME[whose]):
        return list(poses[name].values())
    out = []
    for number, T in poses[name].items():
        try:
            out.append(np.linalg.inv(T))
        except np.linalg.LinAlgError:
            raise kr5.FileError(
                file, f"number {number} has no inverse, expected the matrix of a pose", field=f"{name}…"
            ) from None
    return out
