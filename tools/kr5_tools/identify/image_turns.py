"""Turns of a joint from images: poses of a target, or of the camera before it."""

from pathlib import Path
from typing import Any, Literal

import kr5
import numpy as np
from kr5 import calibration, vision
from kr5.files.camera import load_camera
from kr5.files.images import image_files

from kr5_tools.targets.sightings import find_in_images, load_target

Mount = Literal["eye_in_hand", "eye_to_hand"]
LEAST = 4  # images of a turn


def image_turn(folder: Path, camera: Path | None, target: str | None, mount: str) -> tuple[list[Any], list[str]]:
    """Samples of one joint from the images of a folder, in the order of their names, and those names."""
    if not folder.is_dir():
        raise kr5.FileError(folder, "found no folder; expected one folder of images a joint, as the first input is one")
    if camera is None or target is None:
        missing = "--camera" if camera is None else "--target"
        raise kr5.FileError(
            folder, f"is a folder of images: {missing} is missing, e.g. --camera camera.json --target map.json"
        )
    seen = find_in_images(image_files([folder]), load_target(target), least=LEAST, points=4)
    lens = load_camera(camera, (seen.width, seen.height))
    samples, labels = [], []
    for view, correlation in zip(seen.views, seen.correlation, strict=True):
        pose = vision.estimate_target_pose(view, lens, vision.TargetPoseOptions(correlation=max(1.0, correlation)))
        if not pose.fit.usable or pose.ambiguous:
            continue
        T = np.asarray(pose.T_camera_target)
        samples.append(calibration.JointSample(T_world_tool=np.linalg.inv(T) if mount == "eye_in_hand" else T))
        labels.append(f"{folder.name}/{view.name}")
    if len(samples) < LEAST:
        raise kr5.FileError(
            folder,
            f"{len(samples)} of {len(seen.views)} images give a unique pose of the target, expected at least {LEAST}",
            remedy="use a larger target or one that is not flat",
        )
    return samples, labels
