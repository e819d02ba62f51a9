"""Cylinders of a cloud refined by an image, where the cloud alone is not enough."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kr5
import kr5.picking
import numpy as np
from kr5 import picking
from kr5.files.camera import load_camera
from kr5.files.documents import parse_json, parse_yaml, read_text

POSE_KEY = "T_base_camera"
# Uncertainty of a cylinder's place above which an image is asked; below, the calibration of the camera is no better.
REFINED_ABOVE = 0.00015


@dataclass
class CameraView:
    """An image and the camera that took it, with the uncertainty of its pose."""

    image: np.ndarray
    camera: Any
    T_camera_base: Any  # kr5.UncertainPose


@dataclass
class Refined:
    """What the image said of a cylinder."""

    status: str
    moved: float  # of the centre [m]


def read_view(
    image: Path, camera: Path, pose: np.ndarray | None, sigma_position: float, sigma_rotation: float
) -> CameraView:
    """The image, with its camera and pose; the pose in the base stands in the camera's file where none is given."""
    from PIL import Image, UnidentifiedImageError

    if not image.is_file():
        raise kr5.FileError(image, "No such file")
    try:
        with Image.open(image) as opened:
            grey = np.asarray(opened.convert("L"))
    except (UnidentifiedImageError, OSError, ValueError) as error:
        raise kr5.FileError(image, f"cannot be read as an image: {error}") from error
    lens = load_camera(camera, (grey.shape[1], grey.shape[0]), image)
    T_base_camera = pose if pose is not None else _pose_of(camera)
    for name, sigma in (("--camera-position-std", sigma_position), ("--camera-rotation-std", sigma_rotation)):
        if not (np.isfinite(sigma) and sigma > 0):
            raise kr5.InvalidArgument(f"{name}: found {sigma:g}, expected a positive number")
    covariance = np.diag([sigma_position] * 3 + [sigma_rotation] * 3) ** 2
    in_base = kr5.UncertainPose(T=T_base_camera, covariance=covariance)
    return CameraView(grey, lens, in_base.inverse())


def _pose_of(file: Path) -> np.ndarray:
    text = read_text(file)
    if text.lstrip().startswith("<"):
        data: Any = {}
    else:
        data = parse_json(text, file, "a camera") if text.lstrip().startswith("{") else parse_yaml(text, file)
    value = data.get(POSE_KEY) if isinstance(data, dict) else None
    if value is None:
        raise kr5.FileError(
            file,
            f"{POSE_KEY} is missing: the pose of the camera in the base; write it into the file as x y z roll"
            " pitch yaw [m, rad], or give --camera-pose",
        )
    given = np.asarray(value, float) if _is_numbers(value) else np.zeros(0)
    if given.shape == (6,) and np.isfinite(given).all():
        return np.asarray(kr5.from_xyzrpy(given))
    if given.shape == (4, 4) and np.isfinite(given).all():
        return given
    raise kr5.FileError(
        file, f"{POSE_KEY}: found {value!r:.80}, expected six numbers x y z roll pitch yaw, or a 4 x 4 matrix"
    )


def _is_numbers(value: object) -> bool:
    try:
        np.asarray(value, float)
    except (TypeError, ValueError):
        return False
    return True


def refine(pellets: list[picking.Pellet], view: CameraView, above: float) -> tuple[list[picking.Pellet], list[Refined]]:
    """The cylinders, those refined of which the cloud does not tell the place to `above` [m], fused with the image by
    covariance."""
    out, said = [], []
    for pellet in pellets:
        if place_uncertainty(pellet) <= above:
            out.append(pellet)
            said.append(Refined("not_needed", 0.0))
            continue
        found = picking.refine_pellet(view.image, view.camera, view.T_camera_base, pellet, pellets)
        moved = np.linalg.norm(np.subtract(found.pellet.centre, pellet.centre))
        out.append(found.pellet)
        said.append(Refined(str(found.status), float(moved)))
    return out, said


def require_seen(said: list[Refined]) -> None:
    """Ends with an error when the image shows none of the cylinders that it was asked for."""
    asked = [s for s in said if s.status != "not_needed"]
    if asked and all(s.status == "outside_image" for s in asked):
        raise kr5.InvalidArgument(
            "--image: shows none of the cylinders that were to be refined; is the camera's pose in the base"
            f" ({POSE_KEY}) right, and Z of the camera the direction it looks in?"
        )


def place_uncertainty(pellet: kr5.picking.Pellet) -> float:
    """Standard deviation of the centre in its worst direction [m]."""
    return float(np.sqrt(np.linalg.eigvalsh(np.asarray(pellet.covariance)[:3, :3]).max()))
