"""Corner error on rendered tags with known truth, ours beside AprilTag's and OpenCV's.

    python tools/benchmarks/corners.py [--trials N]

Peers come from PyPI: pip install 'opencv-contrib-python-headless<5'. AprilTag's own corners are those of the library
(refine_edges on), through `refine="none"`; OpenCV starts from the same marker with each of its refinements.
"""

import itertools

import cv2
import kr5
import numpy as np
from kr5 import vision

import arguments
import comparison

OPENCV = {
    "OpenCV none": cv2.aruco.CORNER_REFINE_NONE,
    "OpenCV subpix": cv2.aruco.CORNER_REFINE_SUBPIX,
    "OpenCV contour": cv2.aruco.CORNER_REFINE_CONTOUR,
    "OpenCV apriltag": cv2.aruco.CORNER_REFINE_APRILTAG,
}


def scene(rng, side, blur, noise, camera, target):
    axis, tilt = rng.uniform(0, 2 * np.pi), rng.uniform(0, 0.9)
    turn = kr5.exp_rotation(tilt * np.array([np.cos(axis), np.sin(axis), 0])) @ kr5.exp_rotation(
        [0, 0, rng.uniform(-3, 3)]
    )
    T = np.eye(4)
    T[:3, :3] = turn
    T[:3, 3] = 0, 0, target.size * camera.fx / side
    T[:2, 3] = rng.uniform(-0.5, 0.5, 2) / camera.fx * T[2, 3]  # not always in the middle of a pixel
    options = vision.RenderOptions(blur=blur, noise=noise, seed=int(rng.integers(1 << 30)))
    image = vision.render([vision.PlacedTarget(target=target, T_camera_target=T)], camera, options)
    return image, vision.visible_points(target, T, camera).pixels


def best_errors(corners, truth):
    """Errors under the turn of the corners that fits best: OpenCV numbers those of AprilTags otherwise."""
    return min((np.roll(corners, k, axis=1) - truth for k in range(4)), key=lambda e: np.square(e).sum())


def seen_by_all(image, truth, camera):
    seen = {}
    for name, refine in (("kr5", "model"), ("AprilTag", "none")):
        tags = vision.find_tags(image, vision.TagOptions(refine=refine))
        if len(tags) == 1:
            seen[name] = best_errors(tags[0].corners, truth)
    for name, method in OPENCV.items():
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = method
        detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), parameters)
        found, ids, _ = detector.detectMarkers(image)
        if ids is not None and len(ids) == 1:
            seen[name] = best_errors(found[0][0].T.astype(float), truth)
    return seen


def main():
    parser = arguments.parser(__doc__)
    parser.add_argument("--trials", type=int, default=10, help="images for each size, blur and noise")
    trials = parser.parse_args().trials
    camera = kr5.Pinhole(width=320, height=280, fx=500, fy=500, cx=159.5, cy=139.5)
    rng = np.random.default_rng(1)
    names = ["kr5", "AprilTag", *OPENCV]
    total, missed, images = {n: [] for n in names}, dict.fromkeys(names, 0), 0
    cases = list(itertools.product((25, 50, 100, 150), (0.5, 1.0, 2.0), (0.0, 4.0, 8.0)))
    for side, blur, noise in comparison.progress(cases, "Sizes, blurs and noises"):
        for _ in range(trials):
            target = kr5.parse_target(f"tag:36h11:{rng.integers(587)}:0.05")
            seen = seen_by_all(*scene(rng, side, blur, noise, camera, target), camera)
            images += 1
            for n in names:
                missed[n] += n not in seen
            if len(seen) == len(names):  # all on the same images
                for n in names:
                    total[n].append(seen[n])
    # A peer may count pixels from another corner of the pixel: its best constant shift is forgiven.
    shift = {n: np.mean([e.mean(axis=1) for e in total[n]], axis=0) for n in names}
    of_image = {
        n: np.sqrt(np.mean(np.square([e - shift[n][:, None] for e in total[n]]), axis=(1, 2))) for n in names[1:]
    }
    of_image["kr5"] = np.sqrt(np.mean(np.square(total["kr5"]), axis=(1, 2)))
    rms = {n: float(np.sqrt(np.mean(e**2))) for n, e in of_image.items()}
    lines = []
    for n in names[1:]:
        d = comparison.rms_difference(of_image["kr5"], of_image[n])
        lines.append(
            comparison.Row(
                f"RMS corner error beside {n}",
                f"{rms['kr5']:.4f} px, missed {missed['kr5']}",
                "below",
                d.high < 0,
                f"{rms[n]:.4f} px, missed {missed[n]}",
                d.text("px"),
            )
        )
    comparison.print_comparisons(
        lines, f"{images} images, {len(total['kr5'])} of them found by all; constant shifts of the others forgiven"
    )


if __name__ == "__main__":
    main()
