"""Returns of an arm to points, and where it was sent: from CSVs, or from images of a target."""

import csv
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import kr5
import numpy as np
from kr5 import calibration, io, vision
from kr5.files.camera import load_camera
from kr5.files.documents import read_text
from kr5.files.images import IMAGE_ENDINGS
from kr5.files.results import read_result

from kr5_tools.calibrate.conventions import CONVENTIONS
from kr5_tools.targets.sightings import find_in_images, load_target

POINT_COLUMNS = ("point", "point_id", "id", "p")
COMMANDED = "commanded_"
FARTHEST = 20.0  # of a measured pose [m]


def read_returns(
    file: Path, point: str | None, convention: str | None, length: str | None, angle: str | None
) -> tuple[list[Any], list[Any]]:
    """Returns of a CSV, and commanded poses where it has columns of them."""
    names, lines, table = _named_table(file, point)
    columns = [c.lower() for c in table.columns]
    T = _poses(file, table, columns, "", convention, length, angle)
    returns = [
        calibration.PoseReturn(point=p, T=pose, name=f"{file.name}:{line}")
        for p, pose, line in zip(names, T, lines, strict=True)
    ]
    if not any(c.startswith(COMMANDED) for c in columns):
        return returns, []
    commands: dict[str, np.ndarray] = {}
    for p, pose, line in zip(
        names, _poses(file, table, columns, COMMANDED, convention, length, angle), lines, strict=True
    ):
        if p in commands and not np.allclose(commands[p], pose, atol=1e-9):
            raise kr5.FileError(
                file, f"point {p} has another commanded pose than on an earlier line; expected one a point", line=line
            )
        commands[p] = pose
    return returns, [calibration.CommandedPose(point=p, T=pose) for p, pose in commands.items()]


def read_commanded(
    file: Path, point: str | None, convention: str | None, length: str | None, angle: str | None
) -> list[Any]:
    """Commanded poses of a CSV, one row a point."""
    names, _, table = _named_table(file, point)
    twice = next((name for name, n in Counter(names).items() if n > 1), None)
    if twice is not None:
        raise kr5.FileError(file, f"point {twice} stands twice; expected one commanded pose a point")
    T = _poses(file, table, [c.lower() for c in table.columns], "", convention, length, angle)
    return [calibration.CommandedPose(point=p, T=pose) for p, pose in zip(names, T, strict=True)]


def _named_table(file: Path, point: str | None) -> tuple[list[str], list[int], Any]:
    """The names of the points, which may be words, the line of each row, and the table of the other columns, which are
    numbers."""
    expected = "a CSV with the columns point, x, y, z and an orientation"
    try:
        rows = [[cell.strip() for cell in row] for row in csv.reader(read_text(file, expected).splitlines())]
    except csv.Error as error:
        raise kr5.FileError(file, f"is no CSV ({error}); expected {expected}") from error
    header = next((row for row in rows if any(row)), [])
    wanted = [point.lower()] if point else list(POINT_COLUMNS)
    at = next((k for name in wanted for k, c in enumerate(header) if c.lower() == name), None)
    if at is None:
        raise kr5.FileError(
            file,
            f"found the columns {', '.join(header) or '(none)'}, expected one named {wanted[0]} that says to"
            " which point each row belongs (see --point)",
        )
    names, lines, rest = [], [], []
    for number, row in enumerate(rows, start=1):
        if not any(row):
            rest.append("")
            continue
        others = row[:at] + row[at + 1 :]
        if row is not header:
            if len(row) <= at or not row[at]:
                raise kr5.FileError(file, f"{header[at]}: is missing; expected the name of a point", line=number)
            if not any(others):
                raise kr5.FileError(file, "found a point without a pose", line=number)
            names.append(row[at])
            lines.append(number)
        rest.append(",".join(others))
    return names, lines, io.parse_csv("\n".join(rest) + "\n", str(file))


def _poses(
    file: Path,
    table: Any,
    columns: list[str],
    prefix: str,
    convention: str | None,
    length: str | None,
    angle: str | None,
) -> list[np.ndarray]:
    found = (n for n, (want, *_) in CONVENTIONS.items() if {prefix + c for c in want} <= set(columns))
    name = convention or next(found, None)
    if name not in CONVENTIONS:
        raise kr5.FileError(
            file,
            f"found {convention or ', '.join(table.columns)}, expected one of"
            f" {', '.join(CONVENTIONS)} with their columns",
            field="convention",
        )
    rotation, form, unit = CONVENTIONS[name]
    wanted = [prefix + c for c in ("x", "y", "z", *rotation)]
    if missing := [c for c in wanted if c not in columns]:
        raise kr5.FileError(file, f"found the columns {', '.join(table.columns)}; missing: {', '.join(missing)}")
    rows = np.asarray(table.values)[:, [columns.index(c) for c in wanted]]
    used = {"position": length or ("mm" if name == "kuka" else "m"), "rotation": form, "angle": angle or unit}
    read_as = calibration.PoseFormat.from_dict(used)
    if objections := calibration.format_objections(rows, read_as):
        raise kr5.FileError(
            file,
            f"read as {used['position']}, {used['rotation']}, {used['angle']}: {'; '.join(objections)}; see"
            " --convention, --length, --angle",
        )
    return list(calibration.to_poses(rows, read_as))


def see_returns(folder: Path, target: str, camera: Path, hand_eye: Path | None) -> list[Any]:
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
