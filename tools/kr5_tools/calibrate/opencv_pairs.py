"""Pairs of poses in OpenCV's FileStorage, as cv::calibrateHandEye takes them."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kr5
import numpy as np
from kr5.files.opencv_storage import is_matrix

NUMBERED = re.compile(r"(.*?)_?\d+")
EXPECTED = (
    "two families of as many poses, numbered or in lists, such as T1_0 … of the hand in the base, and T2_0 … of the"
    " target in the camera; or rotations and translations, such as R_gripper2base, t_gripper2base, R_target2cam,"
    " t_target2cam"
)
OF_CAMERA = re.compile(r"target|marker|board|cam|object|tag|pattern", re.IGNORECASE)
OF_ROBOT = re.compile(r"gripper|hand|base|robot|flange|tool|effector|world", re.IGNORECASE)
FROM_FRAME = {"robot": ("base", "world"), "camera": ("cam",)}  # of which a name such as base2gripper is the inverse


@dataclass
class StoredPairs:
    """Poses in pairs, 4x4 each [m]. robot: of the hand in the base; seen: of the target in the camera."""

    robot: list[np.ndarray]
    seen: list[np.ndarray]


def pairs_of_storage(data: object, file: Path) -> StoredPairs:
    """The pairs of a FileStorage; the hand stands before the target where names do not tell them apart."""
    families = _families(data, file)
    poses = {name: [_pose(m) for m in family] for name, family in families.items() if _is_pose(family)}
    poses |= _joined(families, file)
    if len(poses) != 2 or len({len(family) for family in poses.values()}) != 1:
        found = ", ".join(f"{len(family)} named {name}…" for name, family in poses.items()) or "none"
        raise kr5.FileError(file, f"found the poses {found}; expected {EXPECTED}")
    first, second = poses
    swapped = _is_of_camera(first) and not _is_of_camera(second)
    robot, seen = (second, first) if swapped else (first, second)
    return StoredPairs(_forwards(robot, "robot", poses), _forwards(seen, "camera", poses))


def _families(data: object, file: Path) -> dict[str, list[np.ndarray]]:
    """Matrices in lists, or with numbered names."""
    out: dict[str, list[np.ndarray]] = {}
    for key, value in data.items() if isinstance(data, dict) else ():
        if is_matrix(value) and (match := NUMBERED.fullmatch(str(key))):
            out.setdefault(match[1], []).append(_matrix(value, str(key), file))
        elif isinstance(value, list) and value and all(map(is_matrix, value)):
            out[str(key)] = [_matrix(one, f"{key}[{i}]", file) for i, one in enumerate(value)]
    return out


def _matrix(value: dict[str, Any], name: str, file: Path) -> np.ndarray:
    rows, cols = value["rows"], value["cols"]
    try:
        return np.array(value["data"], float).reshape(int(rows), int(cols))
    except (TypeError, ValueError):
        raise kr5.FileError(
            file, f"found {str(value['data'])[:40]}…, expected {rows} x {cols} numbers", field=name
        ) from None


def _is_pose(family: list[np.ndarray]) -> bool:
    return all(m.shape in ((4, 4), (3, 4)) for m in family)


def _pose(matrix: np.ndarray) -> np.ndarray:
    return matrix if matrix.shape == (4, 4) else np.vstack([matrix, [0.0, 0.0, 0.0, 1.0]])


def _joined(families: dict[str, list[np.ndarray]], file: Path) -> dict[str, list[np.ndarray]]:
    """Poses of rotations (matrices, or vectors) with the translations of the same name."""
    out = {}
    for name, family in families.items():
        if not re.match(r"r(?!obot)|.*rvec|.*rot", name, re.IGNORECASE):
            continue
        if not all(m.shape == (3, 3) or m.size == 3 for m in family):
            continue
        partner = next((t for t in families if t != name and _same_but_kind(name, t)), None)
        if partner is None:
            continue
        if len(families[partner]) != len(family):
            raise kr5.FileError(file, f"found {len(family)} {name}, but {len(families[partner])} {partner}")
        out[name] = [_of_parts(R, t) for R, t in zip(family, families[partner], strict=True)]
    return out


def _same_but_kind(rotation: str, translation: str) -> bool:
    """Whether names differ in the word for rotation and translation alone: R_target2cam and t_target2cam."""
    replaced = ((r"^R", "t"), (r"^r", "t"), (r"rvec", "tvec"), (r"rotations?", "translations?"), (r"rot", "(trans|t)"))
    return any(
        re.search(word, rotation) and re.fullmatch(re.sub(word, other, rotation, count=1), translation, re.IGNORECASE)
        for word, other in replaced
    )


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


def _forwards(name: str, whose: str, poses: dict[str, list[np.ndarray]]) -> list[np.ndarray]:
    """Poses of a family, inverted where its name says so, as base2gripper does."""
    inverse = any(re.search(rf"{frame}\w*2", name, re.IGNORECASE) for frame in FROM_FRAME[whose])
    return [np.linalg.inv(T) for T in poses[name]] if inverse else poses[name]
