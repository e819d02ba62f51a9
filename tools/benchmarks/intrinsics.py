"""Camera calibration beside OpenCV's: the same corners for all.

    python tools/benchmarks/intrinsics.py [--reference FOLDER] [--splits 10] [--json FILE]

Held-out error: of each camera's 13 views, 7 drawn at random calibrate and 6 judge. A judged view is cut into two halves
like the colours of a chessboard; the pose from one half predicts the other (all by OpenCV, the same for every camera).
Needs opencv-contrib-python-headless<5.
"""

import json
import time
from pathlib import Path

import cv2
import kr5
import numpy as np
from kr5 import vision

import arguments
import comparison

ROWS, COLS, SQUARE = 6, 9, 0.025
LENSES = {
    "none": cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "k1k2": cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "brown4": cv2.CALIB_FIX_K3,
    "brown5": 0,
    "rational8": cv2.CALIB_RATIONAL_MODEL,
}
PRECISE = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 300, 1e-13)


def board_points() -> np.ndarray:
    points = np.zeros((3, ROWS * COLS))
    points[:2] = np.mgrid[0:COLS, 0:ROWS].T.reshape(-1, 2).T * SQUARE
    return points


def corners(folder: Path, side: str) -> tuple[list, tuple[int, int]]:
    """OpenCV's corners, refined by OpenCV: neither calibration has its own."""
    views = []
    for file in sorted(folder.glob(f"{side}[0-9]*.jpg")):
        image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        found, pixels = cv2.findChessboardCorners(image, (COLS, ROWS))
        assert found, file
        pixels = cv2.cornerSubPix(image, pixels, (5, 5), (-1, -1), (3, 60, 1e-5)).reshape(-1, 2).T
        views.append(
            kr5.View(name=file.name, points=board_points(), pixels=pixels.astype(float), ids=list(range(ROWS * COLS)))
        )
    return views, image.shape[::-1]


def calibrate_opencv(views: list, size: tuple[int, int], lens: str) -> tuple[float, np.ndarray, np.ndarray]:
    points = [np.ascontiguousarray(v.points.T, np.float32) for v in views]
    pixels = [np.ascontiguousarray(v.pixels.T, np.float32) for v in views]
    rms, K, D, *_ = cv2.calibrateCamera(points, pixels, size, None, None, flags=LENSES[lens], criteria=PRECISE)
    return rms, K, D.ravel()[:8]


def calibrate_ours(
    views: list, size: tuple[int, int], **options
) -> tuple[vision.CameraCalibration, np.ndarray, np.ndarray]:
    result = vision.calibrate_camera(views, *size, vision.CameraOptions(**options))
    c = result.camera
    K = np.array([[c.fx, 0, c.cx], [0, c.fy, c.cy], [0, 0, 1]])
    return result, K, np.array([c.k1, c.k2, c.p1, c.p2, c.k3, c.k4, c.k5, c.k6])


def as_built(result: vision.CameraCalibration) -> np.ndarray:
    """The board's points with the bow, stretch and shear that the calibration found."""
    points = board_points()
    centre = points.mean(axis=1, keepdims=True)
    half = np.abs(points - centre).max()
    x, y, _ = (points - centre) / half
    a = result.target_shape
    return points + half * np.array(
        [a[3] * x + a[4] * y, -a[3] * y + a[4] * x, a[0] * x * x + a[1] * x * y + a[2] * y * y]
    )


def held_out(view: kr5.View, K: np.ndarray, D: np.ndarray, board: np.ndarray) -> np.ndarray:
    """Squared error of each point, predicted from the pose of the other half of the view."""
    ids = np.asarray(view.ids)
    colour = (ids // COLS + ids % COLS) % 2
    points, pixels = np.ascontiguousarray(board.T), np.ascontiguousarray(view.pixels.T)
    errors = np.empty(len(ids))
    for half in (0, 1):
        fit, test = colour == half, colour != half
        _, w, t = cv2.solvePnP(points[fit], pixels[fit], K, D)
        w, t = cv2.solvePnPRefineLM(points[fit], pixels[fit], K, D, w, t, PRECISE)
        errors[test] = ((cv2.projectPoints(points[test], w, t, K, D)[0].reshape(-1, 2) - pixels[test]) ** 2).sum(axis=1)
    return errors


def compare_fits(data: dict) -> list[dict]:
    rows = []
    for side, (views, size) in data.items():
        for lens in LENSES:
            rms, *_ = calibrate_opencv(views, size, lens)
            result, *_ = calibrate_ours(
                views,
                size,
                lens=lens,
                square_pixels=False,
                bent_target=False,
                robust=False,
                reject_views=False,
                folds=0,
            )
            rows.append({"camera": side, "lens": lens, "ours_px": result.rms_px, "opencv_px": rms})
    return rows


def all_methods(views: list, size: tuple[int, int]) -> dict[str, tuple]:
    """Every method's camera and board."""
    result, K, D = calibrate_ours(views, size)
    nominal = board_points()
    return {
        "kr5, board as found": (K, D, as_built(result)),
        "kr5, board as named": (K, D, nominal),
        "OpenCV default": (*calibrate_opencv(views, size, "brown5")[1:], nominal),
        "OpenCV rational": (*calibrate_opencv(views, size, "rational8")[1:], nominal),
    }


def paired_difference(ours: list[float], peer: list[float]) -> dict:
    """Ours less the peer's, paired, with Student's 95 % interval."""
    d, by_split = comparison.mean_difference(ours, peer), np.array(ours) - np.array(peer)
    return {
        "mean_px": d.mean,
        "interval_px": [d.low, d.high],
        "median_px": float(np.median(by_split)),
        "ours_lower": int((by_split < 0).sum()),
        "of": len(by_split),
    }


def compared_rows(out: dict) -> list[comparison.Row]:
    lines = [
        comparison.Row(
            f"RMS of the fit, {r['camera']}, {r['lens']}",
            f"{r['ours_px']:.5f} px",
            "no worse",
            r["ours_px"] <= r["opencv_px"] * (1 + 1e-5),
            f"OpenCV {r['opencv_px']:.5f} px",
        )
        for r in out["fit"]
    ]
    rms = out["held_out"]["mean_rms_px"]
    for mine in (n for n in rms if n.startswith("kr5")):
        for peer in (n for n in rms if n.startswith("OpenCV")):
            d = out["held_out"][f"{mine} - {peer}"]
            interval = comparison.Difference(d["mean_px"], *d["interval_px"])
            lines.append(
                comparison.Row(
                    f"held out, {mine.removeprefix('kr5, ')}",
                    f"{rms[mine]:.4f} px",
                    "below",
                    interval.high < 0,
                    f"{peer} {rms[peer]:.4f} px",
                    interval.text("px", "+.4f"),
                )
            )
    for name, ms in out["milliseconds"].items():
        if name.endswith("ours"):
            lens = name.removesuffix(": ours")
            theirs = out["milliseconds"][f"{lens}: OpenCV"]
            lines.append(
                comparison.Row(
                    f"processor time, 24 views x 140 corners, {lens}",
                    f"{ms:.1f} ms",
                    "50 ms",
                    ms <= 50,
                    f"OpenCV {theirs:.1f} ms",
                )
            )
    return lines


def compare_held_out(data: dict, splits: int, seed: int = 1) -> dict:
    """RMS over the judged points of each split and camera."""
    random = np.random.default_rng(seed)
    rms: dict[str, list[float]] = {}
    for _ in comparison.progress(range(splits), "Splits"):
        for views, size in data.values():
            order = random.permutation(len(views))
            for name, camera in all_methods([views[i] for i in order[:7]], size).items():
                errors = np.concatenate([held_out(views[i], *camera) for i in order[7:]])
                rms.setdefault(name, []).append(float(np.sqrt(errors.mean())))
    out: dict = {"mean_rms_px": {name: float(np.mean(values)) for name, values in rms.items()}}
    for mine in (n for n in rms if n.startswith("kr5")):
        for peer in (n for n in rms if n.startswith("OpenCV")):
            out[f"{mine} - {peer}"] = paired_difference(rms[mine], rms[peer])
    return out


def synthetic(count: int = 24, rows: int = 10, cols: int = 14, seed: int = 3) -> tuple[list, tuple[int, int]]:
    random = np.random.default_rng(seed)
    camera = kr5.Pinhole(width=1280, height=960, fx=1100, fy=1100, cx=655, cy=470, k1=-0.21, k2=0.09, p1=3e-4)
    points = np.zeros((3, rows * cols))
    points[:2] = np.mgrid[0:cols, 0:rows].T.reshape(-1, 2).T * 0.02
    views: list = []
    while len(views) < count:
        T = kr5.to_pose(np.concatenate([[0, 0, 0], random.uniform(-0.5, 0.5, 3)]))
        T[:3, 3] = [*random.uniform(-0.12, 0.12, 2), random.uniform(0.3, 0.6)] - T[:3, :3] @ points.mean(axis=1)
        pixels = camera.project(T[:3, :3] @ points + T[:3, 3:])
        if (pixels > 1).all() and (pixels.T < [1278, 958]).all():
            noisy = pixels + random.normal(0, 0.2, pixels.shape)
            views.append(kr5.View(name=str(len(views)), points=points, pixels=noisy, ids=list(range(rows * cols))))
    return views, (1280, 960)


def compare_speed(repeats: int = 15) -> dict:
    views, size = synthetic()
    best = {}
    for lens in ("brown4", "brown5", "rational8"):
        jobs = {
            "ours": lambda lens=lens: calibrate_ours(
                views,
                size,
                lens=lens,
                square_pixels=False,
                bent_target=False,
                robust=False,
                reject_views=False,
                folds=0,
            ),
            "ours, robust": lambda lens=lens: calibrate_ours(
                views, size, lens=lens, square_pixels=False, bent_target=False, folds=0
            ),
            "OpenCV": lambda lens=lens: calibrate_opencv(views, size, lens),
        }
        for name, job in jobs.items():
            times = []
            for _ in range(repeats):
                start = time.process_time()
                job()
                times.append(time.process_time() - start)
            best[f"{lens}: {name}"] = 1e3 * float(np.median(times))
    return best


def main() -> None:
    parser = arguments.parser(__doc__, reference=True, json=True)
    parser.add_argument("--splits", type=int, default=10)
    given = parser.parse_args()
    folder = given.reference / "data" / "camera_opencv_stereo"
    data = {side: corners(folder, side) for side in ("left", "right")}
    out = {"fit": compare_fits(data), "held_out": compare_held_out(data, given.splits), "milliseconds": compare_speed()}
    comparison.print_comparisons(compared_rows(out), f"Intrinsics, {given.splits} splits of both cameras")
    if given.json:
        given.json.write_text(json.dumps(out, indent=1))


if __name__ == "__main__":
    main()
