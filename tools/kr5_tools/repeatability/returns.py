"""Returns of an arm to points, and where it was sent: from tables, or from images of a target."""

import warnings
from collections import Counter
from pathlib import Path

import kr5
import numpy as np
from kr5 import calibration, vision
from kr5.files.camera import load_camera
from kr5.files.images import IMAGE_ENDINGS
from kr5.files.results import read_result
from kr5.tables.options import TableOptions
from kr5.tables.roles import PoseRole, TextRole

from kr5_tools.targets.sightings import find_in_images, load_target

POINT = TextRole("point", "the name of a point", ("point_id", "id", "p"), option="--point")
COMMANDED = "commanded_"
FARTHEST = 20.0  # of a measured pose [m]


def read_returns(
    file: Path, wanted: TableOptions
) -> tuple[list[calibration.PoseReturn], list[calibration.CommandedPose]]:
    """Returns of a table, and commanded poses where it has columns of them."""
    table = wanted.read(file, [POINT, PoseRole(), PoseRole("commanded", prefix=COMMANDED, needed=False)])
    names, where = table.words["point"], [table.row_name(k) for k in range(table.rows)]
    returns = [
        calibration.PoseReturn(point=p, T=pose, name=name)
        for p, pose, name in zip(names, table.poses["pose"], where, strict=True)
    ]
    commands: dict[str, np.ndarray] = {}
    for p, pose, name in zip(names, table.poses.get("commanded", []), where, strict=False):
        if p in commands and not np.allclose(commands[p], pose, atol=1e-9):
            raise kr5.InvalidArgument(
                f"{name}: point {p} has another commanded pose than on an earlier line; expected one a point"
            )
        commands[p] = pose
    return returns, [calibration.CommandedPose(point=p, T=pose) for p, pose in commands.items()]


def read_commanded(file: Path, wanted: TableOptions) -> list[calibration.CommandedPose]:
    """Commanded poses of a table, one row a point."""
    table = wanted.read(file, [POINT, PoseRole()])
    names = table.words["point"]
    twice = next((name for name, n in Counter(names).items() if n > 1), None)
    if twice is not None:
        raise kr5.FileError(file, f"point {twice} stands twice; expected one commanded pose a point")
    return [calibration.CommandedPose(point=p, T=pose) for p, pose in zip(names, table.poses["pose"], strict=True)]


def see_returns(folder: Path, target: str, camera: Path, hand_eye: Path | None) -> list[calibration.PoseReturn]:
    """Returns from images: a folder a point. Measured is the flange (camera on the flange), the target (camera beside
    the arm), or without a hand-eye calibration the camera, each in the frame that stands still."""
    points = sorted(f for f in folder.iterdir() if f.is_dir())
    if not points:
        raise kr5.FileError(folder, "found no folders; expected one a point, with an image a return")
    wanted = load_target(target)
    T_mount_camera, in_hand = _mounted(hand_eye)
    returns, lens = [], None
    for point in points:
        files = sorted(f for f in point.iterdir() if f.suffix.lower() in IMAGE_ENDINGS)
        if not files:
            raise kr5.FileError(point, f"the folder contains no image ({', '.join(IMAGE_ENDINGS)})")
        seen = find_in_images(files, wanted, least=1, points=4)
        lens = lens or load_camera(camera, seen.size)
        for lost in seen.lost:
            warnings.warn(f"{point.name}/{lost['name']} is not used: {lost['message']}", kr5.Caution, stacklevel=2)
        for view, correlation in zip(seen.views, seen.correlation, strict=True):
            found = vision.estimate_target_pose(view, lens, vision.TargetPoseOptions(correlation=correlation))
            if not found.fit.usable:
                raise kr5.InvalidArgument(f"{point.name}/{view.name}: {found.fit.message}")
            M = np.asarray(found.T_camera_target)
            T = np.linalg.inv(T_mount_camera @ M) if in_hand else T_mount_camera @ M
            returns.append(calibration.PoseReturn(point=point.name, T=T, name=f"{point.name}/{view.name}"))
    return returns


def _mounted(hand_eye: Path | None) -> tuple[np.ndarray, bool]:
    if hand_eye is None:
        return np.eye(4), True
    result = read_result(hand_eye, "kr5-hand-eye/1").get("result", {})
    try:
        T = np.array(result["T_mount_camera"], float)
        kr5.pose_difference(T, T)
        return T, str(result["mount"]) == "eye_in_hand"
    except (KeyError, ValueError, TypeError, kr5.InvalidArgument):
        raise kr5.FileError(
            hand_eye, "found no T_mount_camera and mount; expected a result of kr5 calibrate hand-eye", field="result"
        ) from None
