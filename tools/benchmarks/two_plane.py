"""The camera in the hand from one image of a grid on two planes, beside OpenCV's EPnP on the same corners.

    python tools/benchmarks/two_plane.py [--trials 40]

Rendered images (our renderer, blur 0.8 px, noise 3 grey), error of the camera's pose against the truth.
Needs opencv-contrib-python-headless<5.
"""

import cv2
import kr5
import numpy as np
from kr5 import vision

import arguments
import comparison

CAMERA = kr5.Pinhole(width=1280, height=960, fx=1100, fy=1100, cx=639.5, cy=479.5)
SHEETS = [kr5.parse_target(f"grid:{family}:3x3:0.03:0.01") for family in ("36h11", "25h9")]
T_FLANGE_SHEET = [kr5.to_pose(np.array(v)) for v in ([-0.12, -0.055, 0.5, 0, 0.7, 0], [0.02, -0.055, 0.58, 0, -0.8, 0])]


def seen_views(truth: np.ndarray, seed: int) -> list:
    """Views of the sheets in one rendered image, their points in the flange frame."""
    placed = [
        vision.PlacedTarget(target=s, T_camera_target=np.linalg.inv(truth) @ T) for s, T in zip(SHEETS, T_FLANGE_SHEET)
    ]
    image = np.asarray(vision.render(placed, CAMERA, vision.RenderOptions(blur=0.8, noise=3, seed=seed)))
    views = []
    for sheet, T in zip(SHEETS, T_FLANGE_SHEET):
        found = vision.find_target(image, sheet)
        if found.found:
            views.append(
                kr5.View(points=T[:3, :3] @ found.view.points + T[:3, 3:], pixels=found.view.pixels, ids=found.view.ids)
            )
    return views


def epnp(views: list) -> np.ndarray:
    points, pixels = (np.ascontiguousarray(np.hstack([getattr(v, k) for v in views]).T) for k in ("points", "pixels"))
    K = np.array([[CAMERA.fx, 0, CAMERA.cx], [0, CAMERA.fy, CAMERA.cy], [0, 0, 1]])
    _, rotation, translation = cv2.solvePnP(points, pixels, K, None, flags=cv2.SOLVEPNP_EPNP)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = cv2.Rodrigues(rotation)[0], translation.ravel()
    return np.linalg.inv(T)


def main() -> None:
    parser = arguments.parser(__doc__)
    parser.add_argument("--trials", type=int, default=40)
    trials = parser.parse_args().trials
    random = np.random.default_rng(1)
    errors: dict[str, list] = {"kr5": [], "OpenCV EPnP": []}
    for seed in comparison.progress(range(trials), "Images"):
        truth = kr5.to_pose(random.normal(0, [0.015] * 3 + [0.05] * 3))
        views = seen_views(truth, seed)
        if len(views) < 2:
            continue
        for name, T in (
            ("kr5", kr5.calibrate_single_image(views, CAMERA).T_flange_camera),
            ("OpenCV EPnP", epnp(views)),
        ):
            apart = kr5.pose_difference(truth, T)
            errors[name].append((1e3 * np.linalg.norm(apart[:3]), np.degrees(np.linalg.norm(apart[3:]))))
    ours, theirs = (np.array(e).T for e in errors.values())
    lines = []
    for what, unit, a, b in (("position", "mm", ours[0], theirs[0]), ("rotation", "deg", ours[1], theirs[1])):
        d, rms = comparison.rms_difference(a, b), [f"{np.sqrt((e**2).mean()):.4g} {unit}" for e in (a, b)]
        lines.append(
            comparison.Row(
                f"RMS {what} of the camera",
                rms[0],
                "not significantly above",
                d.low <= 0,
                f"EPnP {rms[1]}",
                d.text(unit),
            )
        )
    comparison.print_comparisons(lines, f"{trials} images, both sheets seen in {len(ours[0])}")


if __name__ == "__main__":
    main()
