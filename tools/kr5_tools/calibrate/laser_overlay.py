"""Profile points on an image of the laser line: a picture, and how far they lie from the line that is seen."""

from dataclasses import dataclass
from pathlib import Path

import kr5
import kr5.calibration
import numpy as np
from kr5 import calibration
from kr5.files.writing import beside
from PIL import Image, ImageDraw

REACH = 40.0  # how far from a projected point the line is looked for, across it [px]
LEAST_CONTRAST = 6.0  # of the line, in deviations of what is around it
PROJECTED, SEEN = (0, 158, 115), (213, 94, 0)


@dataclass
class Overlay:
    """Projected profile points (n x 2), the line that is seen beside each (NaN where none), and distances [px]."""

    projected: np.ndarray
    seen: np.ndarray
    distance: np.ndarray
    expected: float

    def figures(self) -> dict[str, float]:
        found = self.distance[np.isfinite(self.distance)]
        out = {"points": len(self.projected), "points_with_line": len(found), "expected_std_px": self.expected}
        if len(found) >= 0.3 * len(self.projected) and len(found) >= 5:
            out |= {"rms_px": float(np.sqrt((found**2).mean())), "mean_px": float(found.mean())}
        return out


def overlay_profile(
    image: np.ndarray,
    camera: kr5.Pinhole,
    T_flange_camera: kr5.UncertainPose,
    T_flange_scanner: kr5.UncertainPose,
    profile: kr5.calibration.LineProfile,
) -> Overlay:
    """Projects a profile into an image that was taken with the flange at the same pose; the poses are UncertainPose."""
    T = calibration.camera_scanner(T_flange_camera, T_flange_scanner)
    seen = np.isfinite(profile.x) & np.isfinite(profile.z)
    points = np.column_stack([profile.x[seen], np.zeros(seen.sum()), profile.z[seen]])
    pixels = _project(camera, T.T, points)
    inside = (pixels >= 0).all(axis=1) & (pixels < [camera.width - 1, camera.height - 1]).all(axis=1)
    if inside.sum() < 5:
        raise kr5.InvalidArgument(
            "the profile lies outside the image: look at the camera, at T_flange_camera and at which profile belongs to"
            " the image"
        )
    points, pixels = points[inside], pixels[inside]
    normals = _normals(pixels)
    grey = image.astype(float).max(axis=2) if image.ndim == 3 else image.astype(float)
    smooth = _away_from_steps(pixels)
    offset = np.array([_line_offset(grey, p, n) for p, n in zip(pixels, normals, strict=True)])
    offset[~smooth] = np.nan
    return Overlay(pixels, pixels + offset[:, None] * normals, offset, _expected_std(camera, T, points, normals))


def _project(camera: kr5.Pinhole, T: np.ndarray, points: np.ndarray) -> np.ndarray:
    there = points @ T[:3, :3].T + T[:3, 3]
    out = np.full((len(points), 2), -1.0)
    front = there[:, 2] > 1e-6
    out[front] = np.asarray(camera.project(kr5.points_from_rows(there[front]))).T
    return out


def _normals(pixels: np.ndarray) -> np.ndarray:
    along = np.gradient(pixels, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    return np.column_stack([-along[:, 1], along[:, 0]])


def _away_from_steps(pixels: np.ndarray) -> np.ndarray:
    """Points at which the line is not broken, so that it has a direction."""
    gap = np.linalg.norm(np.diff(pixels, axis=0), axis=1)
    smooth = np.ones(len(pixels), bool)
    for k in np.flatnonzero(gap > 2 * np.median(gap)):
        smooth[max(0, k - 1) : k + 3] = False
    return smooth


def _line_offset(grey: np.ndarray, at: np.ndarray, normal: np.ndarray) -> float:
    """Where the nearest bright spot across the line lies [px]; NaN where nothing stands out."""
    steps = np.arange(-REACH, REACH + 1)
    places = at + steps[:, None] * normal
    height, width = grey.shape
    inside = (places >= 0).all(axis=1) & (places < [width - 1, height - 1]).all(axis=1)
    if inside.sum() < 9:
        return float("nan")
    steps, places = steps[inside], places[inside]
    corner = np.floor(places).astype(int)
    u, v = (places - corner).T
    x, y = corner.T
    bright = (
        (1 - u) * (1 - v) * grey[y, x]
        + u * (1 - v) * grey[y, x + 1]
        + (1 - u) * v * grey[y + 1, x]
        + u * v * grey[y + 1, x + 1]
    )
    floor = np.median(bright)
    deviation = max(1.4826 * float(np.median(np.abs(bright - floor))), 1.0)
    if bright.max() - floor < LEAST_CONTRAST * deviation:
        return float("nan")
    high = floor + 0.5 * (bright.max() - floor)
    inner = bright[1:-1]
    peaks = 1 + np.flatnonzero((inner >= high) & (inner >= bright[:-2]) & (inner >= bright[2:]))
    if not len(peaks):
        return float("nan")
    near = np.abs(steps - steps[peaks[np.abs(steps[peaks]).argmin()]]) <= 4
    weight = np.maximum(bright[near] - floor - 0.2 * (bright.max() - floor), 0.0)
    return float((weight * steps[near]).sum() / weight.sum())


def _expected_std(camera: kr5.Pinhole, T: kr5.UncertainPose, points: np.ndarray, normals: np.ndarray) -> float:
    """RMS standard deviation across the line that the covariance of the pose gives [px]."""
    step = 1e-5
    before = _project(camera, T.T, points)
    J = np.stack(
        [
            ((_project(camera, T.T @ kr5.to_pose(step * np.eye(6)[k]), points) - before) * normals).sum(1) / step
            for k in range(6)
        ],
        axis=1,
    )
    return float(np.sqrt(np.mean(np.einsum("ni,ij,nj->n", J, np.asarray(T.covariance), J))))


def draw_overlay(image: np.ndarray, overlay: Overlay, file: Path) -> None:
    """The picture: what is projected in green, what is seen of the line in orange."""
    picture = Image.fromarray(image).convert("RGB")
    pen = ImageDraw.Draw(picture)
    size = max(1.5, picture.width / 700)
    for points, colour, radius in ((overlay.seen, SEEN, 0.8 * size), (overlay.projected, PROJECTED, size)):
        for u, v in points[np.isfinite(points).all(axis=1)]:
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
