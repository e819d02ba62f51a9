"""Profile points on an image of the laser line: a picture, and how far they lie from the line that is seen."""

from pathlib import Path
from typing import TYPE_CHECKING

import kr5
import kr5.calibration
import numpy as np
from kr5 import calibration
from kr5.files.writing import beside
from PIL import Image, ImageDraw

if TYPE_CHECKING:
    import kr5.vision

PROJECTED, SEEN = (0, 158, 115), (213, 94, 0)


def overlay_profile(
    image: np.ndarray,
    camera: kr5.Pinhole,
    T_flange_camera: kr5.UncertainPose,
    T_flange_scanner: kr5.UncertainPose,
    profile: kr5.calibration.LineProfile,
) -> "kr5.vision.LaserLineComparison":
    """Projects a profile into an image, grey or RGB, that was taken with the flange at the same pose."""
    from kr5 import vision

    T = calibration.camera_scanner(T_flange_camera, T_flange_scanner)
    points = kr5.points_from_columns(np.vstack([profile.x, np.zeros(len(profile.x)), profile.z]))
    grey = np.ascontiguousarray(image.max(axis=2)) if image.ndim == 3 else image
    found = vision.compare_laser_line(grey, camera, T, points)
    if not found.projected.size:
        raise kr5.InvalidArgument(
            f"{found.fit.message}; look at the camera, at T_flange_camera and at which profile belongs to the image"
        )
    return found


def overlay_figures(shown: "kr5.vision.LaserLineComparison") -> dict[str, float]:
    """Keys of a result file."""
    out = {
        "points": len(shown.distance),
        "points_with_line": shown.with_line,
        "expected_std_px": shown.expected_std,
    }
    return out | {"rms_px": shown.rms_px, "mean_px": shown.mean_px} if shown.fit.usable else out


def draw_overlay(image: np.ndarray, overlay: "kr5.vision.LaserLineComparison", file: Path) -> None:
    """The picture: what is projected in green, what is seen of the line in orange."""
    picture = Image.fromarray(image).convert("RGB")
    pen = ImageDraw.Draw(picture)
    size = max(1.5, picture.width / 700)
    for points, colour, radius in ((overlay.seen, SEEN, 0.8 * size), (overlay.projected, PROJECTED, size)):
        for u, v in points[:, np.isfinite(points).all(axis=0)].T:
            pen.ellipse((u - radius, v - radius, u + radius, v + radius), fill=colour)
    with beside(file) as new:
        picture.save(new, format="PNG")


def read_image(file: Path) -> np.ndarray:
    """An image as 8-bit numbers, grey or RGB."""
    try:
        with Image.open(file) as image:
            return np.asarray(image.convert("L" if image.mode in ("L", "I", "I;16", "1") else "RGB"))
    except (OSError, ValueError, SyntaxError) as error:
        raise kr5.FileError(file, f"is no image that can be read ({error})") from error
