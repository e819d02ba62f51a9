"""Datasets of a hand-eye calibration: description, camera, target and residuals."""

import json
from pathlib import Path
from typing import Any

import kr5
import numpy as np
from kr5 import calibration, vision
from kr5.files.camera import load_camera
from kr5.files.images import MOST_CAMERA_VIEWS, thinned

from kr5_tools.calibrate.pose_pairs import check_holds_no_pairs
from kr5_tools.cli.terminal import spinner
from kr5_tools.targets.sightings import Sightings, load_target


def read_dataset(folder: Path, description: Path | None) -> Any:
    """The data set in a folder."""
    if not folder.is_dir():
        raise kr5.FileError(folder, "no such file or folder; expected images and robot poses, or pairs of poses")
    if not any(folder.iterdir()):
        raise kr5.FileError(folder, "the folder is empty; expected images and robot poses")
    file = description or folder / "dataset.yaml"
    if not file.exists():
        check_holds_no_pairs(folder)
        raise kr5.FileError(
            file,
            f"no such file; write one, or let `kr5 dataset guess {folder} -o {file}` propose it",
        )
    return calibration.load_dataset(str(file), str(folder))


def target_of(text: str, where: Path) -> Any:
    """A target from its short form or from the JSON of its fields."""
    if not text:
        raise kr5.IoError(
            f"{where}: target: found nothing, expected e.g. 'chessboard:6x9:0.0236'; or give it with --target"
        )
    return kr5.Target.from_dict(json.loads(text)) if text.startswith("{") else load_target(text)


def camera_of(text: str, seen: Sightings) -> tuple[Any, str]:
    """The camera named by a file or by its values; without either, calibrated from the same images."""
    if text.startswith("{"):
        values = {"width": seen.width, "height": seen.height, **json.loads(text)}
        return kr5.Pinhole.from_dict(values), "values of the data set"
    if text:
        return load_camera(text, seen.size), text
    views = [view for view in seen.views if view.pixels.shape[1] >= 6]
    if not views:
        raise kr5.InvalidArgument(
            "camera: is missing, and views of fewer than 6 points cannot calibrate one;"
            " specify a camera file with --camera"
        )
    views = [views[i] for i in thinned(len(views), MOST_CAMERA_VIEWS)]
    with spinner("Calibrating the camera"):
        found = vision.calibrate_camera(
            views, seen.width, seen.height, vision.CameraOptions(correlation=max(seen.correlation))
        )
    if not found.fit.usable:
        raise kr5.InvalidArgument(
            f"camera: is missing, and these images do not determine one: {found.fit.message}; name one with --camera"
        )
    return found.camera, "calibrated from the same images"


def residuals_of(view: kr5.View, camera: kr5.Pinhole, T: np.ndarray) -> dict[str, Any]:
    """Seen minus predicted pixels of a view whose target is at T in the camera."""
    points = T[:3, :3] @ view.points + T[:3, 3:]
    d = view.pixels - camera.project(points) if (points[2] > 0).all() else np.full_like(view.pixels, np.nan)
    return {"view": view.name, "u": view.pixels[0], "v": view.pixels[1], "du": d[0], "dv": d[1]}
