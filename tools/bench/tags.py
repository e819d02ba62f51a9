"""Tags found in the AprilTag reference images, and the speed on a rendered 5 Mpx image with 35 tags, beside OpenCV.

    python tools/bench/tags.py [--repeat N]

Peers come from PyPI: pip install 'opencv-contrib-python-headless<5'. The images are those of KR5_REFERENCE_DIR, by
default the folder `shared` beside the checkout. All run on one thread.
"""

import re
import time

import cv2
import numpy as np

import arguments
import kr5
from kr5 import vision

DATA = arguments.REFERENCE / "data" / "tags_apriltag"


def opencv_detector():
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), parameters)


def by_kr5(image):
    return [(t.id, t.corners.mean(axis=1)) for t in vision.find_tags(image)]


def by_opencv(image):
    corners, ids, _ = opencv_detector().detectMarkers(image)
    return [] if ids is None else [(int(i), c[0].mean(axis=0)) for i, c in zip(ids.ravel(), corners)]


def compare(find):
    hits = false = expected = 0
    for file in sorted(DATA.glob("*.jpg")):
        truth = []
        for line in file.with_suffix(".txt").read_text().splitlines():
            numbers = [float(x) for x in re.findall(r"[-\d.]+", line)]
            truth.append((int(numbers[0]), np.reshape(numbers[1:], (4, 2)).mean(axis=0)))
        expected += len(truth)
        for tag, middle in find(vision.load_image(str(file))):
            near = [t for t in truth if t[0] == tag and np.linalg.norm(t[1] - middle) < 5]
            hits += bool(near)
            false += not near
            if near:
                truth = [t for t in truth if t is not near[0]]
    return f"{hits} of {expected}, {false} false"


def main():
    parser = arguments.parser(__doc__)
    parser.add_argument("--repeat", type=int, default=7)
    repeat = parser.parse_args().repeat
    cv2.setNumThreads(1)
    camera = kr5.Pinhole(width=2592, height=1944, fx=2600, fy=2600, cx=1295.5, cy=971.5)
    T = np.eye(4)
    T[:3, :3] = kr5.exp_rotation([0.3, 0.2, 0.0])
    T[:3, 3] = -0.13, -0.1, 0.45
    board = vision.PlacedTarget(target=vision.parse_target("grid:36h11:5x7:0.03:0.01"), T_camera_target=T)
    image = vision.render([board], camera, vision.RenderOptions(blur=0.8, noise=2, clutter=10))
    print(f"{'detector':10} {'reference images':>22} {'found in 5 Mpx':>15} {'median [ms]':>12}")
    for name, find in (("kr5", by_kr5), ("OpenCV", by_opencv)):
        seen, times = find(image), []
        for _ in range(repeat):
            start = time.perf_counter()
            find(image)
            times.append(1e3 * (time.perf_counter() - start))
        print(f"{name:10} {compare(find):>22} {len(seen):>15} {np.median(times):12.0f}")


if __name__ == "__main__":
    main()
