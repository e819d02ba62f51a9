"""Uncertainty of points projected back by a camera matrix that was estimated from noisy corners of a board on two
planes (Hayat et al. 2022, section 3.4.2, Tables 3.4 and 3.5)."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kr5
import numpy as np
import numpy.typing as npt
from kr5.files.documents import read_document
from kr5.logs.units import UNITS

from kr5_tools.uncertainty.documents import BOOK, CameraMatrixFile

MAGNIFIED = 20  # of ellipses across the board
SQUARES = (2e-4, 1.0)  # side of a square that a board may have [m]
NEAREST, FARTHEST = 0.5, 200.0  # distance of the camera, over the size of the board


@dataclass(frozen=True)
class Scene:
    """The board, its corners and their pixels; the plane that is projected back on is Y = 0."""

    document: CameraMatrixFile
    points: np.ndarray  # 3 x n [m]
    pixels: np.ndarray  # 2 x n
    plane: Any


def load_scene(file: Path | None, distance: float | None, columns: int | None, rows: int | None) -> Scene:
    source = file or BOOK / "camera_matrix.yaml"
    document = read_document(source, CameraMatrixFile, "a camera before a board")
    factor = document.length_factor
    if columns or rows:
        board = document.board.model_copy(update={k: v for k, v in (("columns", columns), ("rows", rows)) if v})
        document = document.model_copy(update={"board": board})
    if distance:
        document = document.model_copy(update={"distance": distance / factor})
    points = board_corners(document.board.columns, document.board.rows, factor * document.board.square)
    check_magnitudes(document, points, distance, source)
    camera = kr5.Pinhole(**document.camera.model_dump())
    M = kr5.projection_matrix(camera, look_at(points.mean(axis=1), factor * document.distance))
    seen = M @ np.vstack([points, np.ones(points.shape[1])])
    return Scene(document, points, seen[:2] / seen[2], kr5.Plane(normal=[0, 1, 0], distance=0.0))


def check_magnitudes(document: CameraMatrixFile, points: np.ndarray, given: float | None, source: Path) -> None:
    """Refuses a square or a distance [m] that is none of a camera before a board, with the unit it may be in; `given`:
    distance of the command line, in mm there."""
    size = float(np.linalg.norm(np.ptp(points, axis=1)))
    unit = document.length
    square = document.length_factor * document.board.square
    _check_length(f"{source}: board.square", square, unit, SQUARES, "of a board")
    distance = document.length_factor * document.distance if given is None else given
    name, shown = (f"{source}: distance", unit) if given is None else ("--distance", "mm")
    of = f"before a board of {size / UNITS['length'][shown]:.3g} {shown}"
    _check_length(name, distance, shown, (NEAREST * size, FARTHEST * size), of)


def _check_length(name: str, value: float, unit: str, limits: tuple[float, float], of: str) -> None:
    """Complains of a length [m] outside its limits, in the unit in which it was given."""
    low, high = limits
    if low <= value <= high:
        return
    factor = UNITS["length"][unit]
    fits = [u for u, f in UNITS["length"].items() if low <= value / factor * f <= high]
    hint = f"; is it in {' or '.join(fits)}?" if fits else ""
    raise kr5.InvalidArgument(
        f"{name}: found {value / factor:g} {unit}, expected {low / factor:.3g} to {high / factor:.3g} {unit} {of}{hint}"
    )


def board_corners(columns: int, rows: int, square: float) -> np.ndarray:
    """Corners of the planes Y = 0 and X = 0, which meet in the Z axis: 3 x n."""
    across, up = np.meshgrid(np.arange(1, columns + 1), np.arange(1, rows + 1))
    zero = np.zeros(across.size)
    first = [across.ravel(), zero, up.ravel()]
    second = [zero, across.ravel(), up.ravel()]
    return square * np.hstack([first, second])


def look_at(target: np.ndarray, distance: float) -> np.ndarray:
    """T_camera_grid of a camera that sees both planes alike, from above."""
    z = -np.array([1.0, 1.0, 0.7]) / np.linalg.norm([1.0, 1.0, 0.7])
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    T[:3, 3] = target - distance * z
    return np.asarray(np.linalg.inv(T))


def camera_matrix_result(scene: Scene, draws: int, seed: int, noisy_pixel: bool, confidence: float) -> dict[str, Any]:
    """Parts of the page, verdict and numbers, for every noise."""
    found = []
    for noise in scene.document.noise:
        options = kr5.BackProjectionOptions(sigma_pixel=noise, draws=draws, seed=seed, noisy_pixel=noisy_pixel)
        found.append(kr5.back_projection_uncertainty(scene.points, scene.pixels, scene.plane, options))
    middle = middle_corner(found[0].corners)
    largest = max(range(len(found)), key=lambda k: scene.document.noise[k])
    tables = [noise_table(scene, found, middle)]
    if scene.document.printed:
        tables.append(printed_table(scene, found, middle))
    tables.append(corner_table(found[largest], scene.document.noise[largest]))
    per_pixel = [
        1e3 * np.sqrt(np.diag(found[0].corners[middle].covariance))[k] / scene.document.noise[0] for k in (0, 2)
    ]
    text = f"{per_pixel[0]:.3g} and {per_pixel[1]:.3g} mm in X and Z per pixel of noise at the middle corner"
    parts = [
        {
            "title": "Corners projected back",
            "texts": texts_of(scene, found[largest], scene.document.noise[largest]),
            "tables": tables,
            "ellipses": [corner_ellipses(found[largest], scene.document.noise[largest], confidence)],
            "lines": [noise_lines(scene, found, middle)],
        }
    ]
    result = {
        "noise": scene.document.noise,
        "corner": found[0].corners[middle].point,
        "results": found,
        "mm_per_pixel": per_pixel,
    }
    return {"verdict": {"word": "good", "text": text}, "parts": parts, "result": result}


def middle_corner(corners: list[kr5.BackProjectedCorner]) -> int:
    places = np.array([c.point for c in corners])
    return int(np.argmin(np.linalg.norm(places - places.mean(axis=0), axis=1)))


def deviations(covariance: npt.ArrayLike) -> tuple[float, float]:
    """Of X and Z [mm]."""
    sigma = 1e3 * np.sqrt(np.maximum(np.diag(np.asarray(covariance)), 0))
    return float(sigma[0]), float(sigma[2])


def pair(covariance: npt.ArrayLike) -> str:
    return " / ".join(f"{x:.4f}" if x < 10 else f"{x:.3g}" for x in deviations(covariance))


def noise_table(scene: Scene, found: list[kr5.BackProjectionResult], corner: int) -> dict[str, Any]:
    rows = []
    for noise, result in zip(scene.document.noise, found):
        one = result.corners[corner]
        rows.append([f"{noise:g}", pair(one.simulated), pair(one.covariance), pair(one.approximate)])
    return {
        "title": "Standard deviations of X / Z at the middle corner [mm]",
        "columns": ["noise [px]", "simulated", "exact Jacobian", "eq. 3.56"],
        "rows": rows,
        "texts": [
            "Eq. 3.56 takes the entries of the camera matrix as equally uncertain and independent, and leaves out the"
            " scale lambda: it follows the noise, but its size means nothing (in another unit of length it is another)."
        ],
    }


def printed_table(scene: Scene, found: list[kr5.BackProjectionResult], corner: int) -> dict[str, Any]:
    """Beside Table 3.5, by pixel of noise: what the book's board and distance must have been is not known."""
    printed = scene.document.printed
    assert printed is not None
    rows = []
    for noise, x, z in zip(printed.noise, printed.sigma_x, printed.sigma_z):
        k = next((i for i, own in enumerate(scene.document.noise) if abs(own - noise) < 1e-9), None)
        own = pair(found[k].corners[corner].covariance / noise**2) if k is not None else "–"
        rows.append([f"{noise:g}", f"{x:g} / {z:g}", f"{x / noise:.3f} / {z / noise:.3f}", own])
    per = [deviations(found[0].corners[corner].covariance)[k] / scene.document.noise[0] for k in (0, 1)]
    last = (printed.sigma_x[-1] / printed.noise[-1], printed.sigma_z[-1] / printed.noise[-1])
    ratios = " and ".join(f"{theirs / own:.3g}" if own > 0 else "–" for theirs, own in zip(last, per))
    return {
        "title": "Table 3.5 of the book",
        "columns": ["noise [px]", "printed X / Z [mm]", "printed [mm/px]", "exact, here [mm/px]"],
        "rows": rows,
        "texts": [
            f"Both are linear in the noise. The size is {ratios} times that of"
            f" this board: the book gives squares of 12 mm and a lens of 8 mm, but neither the number of squares"
            " nor the distance, which set the size."
        ],
    }


def corner_table(result: kr5.BackProjectionResult, noise: float) -> dict[str, Any]:
    places = np.array([c.point for c in result.corners])
    away = np.linalg.norm(places - places.mean(axis=0), axis=1)
    rows = []
    for k in np.argsort(away, kind="stable"):
        corner = result.corners[int(k)]
        x, _, z = 1e3 * np.asarray(corner.point)
        rows.append([f"{x:.0f}, {z:.0f}", f"{1e3 * away[k]:.1f}", pair(corner.simulated), pair(corner.covariance)])
    return {
        "title": f"Corners at {noise:g} px, from the middle of the plane outward",
        "columns": ["X, Z [mm]", "from the middle [mm]", "simulated [mm]", "exact [mm]"],
        "rows": rows,
        "texts": ["As in Table 3.4, the deviations are least near the middle."],
    }


def texts_of(scene: Scene, result: kr5.BackProjectionResult, noise: float) -> list[str]:
    board = scene.document.board
    return [
        f"{scene.points.shape[1]} corners of {board.square:g} {scene.document.length} squares on two planes,"
        f" {board.columns} x {board.rows} on each, {scene.document.distance:g} {scene.document.length} from the camera."
        f" The camera matrix is estimated from noisy corners; true pixels are projected back on the plane Y = 0.",
        f"RMS deviation of the entries of the camera matrix at {noise:g} px: {result.sigma_matrix:.3g} (at the scale at"
        " which lambda is the depth in mm; the book says 6.6 at 0.5 px, in a scale that it does not state).",
    ]


def corner_ellipses(result: kr5.BackProjectionResult, noise: float, confidence: float) -> dict[str, Any]:
    pick = np.ix_([0, 2], [0, 2])
    return {
        "name": "corners",
        "title": f"Corners projected back, {noise:g} px",
        "text": f"Regions that hold a point with a probability of {100 * confidence:g} %, {MAGNIFIED} times as large.",
        "axes": ["X [mm]", "Z [mm]"],
        "confidence": confidence,
        "ellipses": [
            {
                "name": "",
                "centre": [1e3 * float(c.point[0]), 1e3 * float(c.point[2])],
                "covariance": MAGNIFIED**2 * 1e6 * np.asarray(c.covariance)[pick],
            }
            for c in result.corners
        ],
    }


def noise_lines(scene: Scene, found: list[kr5.BackProjectionResult], corner: int) -> dict[str, Any]:
    noise = list(scene.document.noise)
    lines = []
    for name, kind in (("simulated", "simulated"), ("exact", "covariance")):
        for k, axis in enumerate("XZ"):
            y = [deviations(getattr(r.corners[corner], kind))[k] for r in found]
            lines.append({"name": f"{axis}, {name}", "x": noise, "y": y})
    return {
        "name": "noise",
        "title": "Deviation over noise, middle corner",
        "text": "The simulation lies on the line of the exact Jacobian: the error is linear in the noise.",
        "axes": ["noise [px]", "standard deviation [mm]"],
        "lines": lines,
    }
