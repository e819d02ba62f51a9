"""Tags found in the AprilTag reference images, and the speed on a rendered 5 Mpx image with 35 tags, beside the
AprilTag library, OpenCV and ViSP.

    python tools/benchmarks/tags.py BUILD [--repeat N]

Peers come from PyPI: pip install 'opencv-contrib-python-headless<5' pupil-apriltags. ViSP is called from C++: BUILD is
a folder of a build with -DKR5_BUILD_BENCH=ON. The images are those of KR5_REFERENCE_DIR, by default the folder `shared`
beside the checkout. All run on one thread; times are of the processor, which neighbours on the machine disturb least.
"""

import json
import re
import subprocess
import time
from pathlib import Path

import cv2
import kr5
import numpy as np
import pupil_apriltags
from kr5 import vision

import arguments
import comparison

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


APRILTAG = pupil_apriltags.Detector(families="tag36h11", nthreads=1)  # its defaults else


def by_apriltag(image):
    return [(t.tag_id, t.corners.mean(axis=0)) for t in APRILTAG.detect(np.ascontiguousarray(image))]


def beside_visp(build: Path, repeat: int):
    """Processor time of ViSP over ours, median, and how many of the 35 tags it finds."""
    program = build / "tools/benchmarks/detect_speed"
    if not program.exists():
        raise SystemExit(f"error: {program}: not built; configure with -DKR5_BUILD_BENCH=ON")
    done = subprocess.run([program, str(repeat)], capture_output=True, text=True, check=True)
    methods = {m["name"]: m for m in json.loads(done.stdout.splitlines()[-1])["methods"]}
    return methods["ViSP"]["ratio"], methods["ViSP"]["found"]


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
    return hits, expected, false


def made_image():
    """A picture of 35 markers with noise, of 5 Mpx."""
    camera = kr5.Pinhole(width=2592, height=1944, fx=2600, fy=2600, cx=1295.5, cy=971.5)
    T = np.eye(4)
    T[:3, :3] = kr5.exp_rotation([0.3, 0.2, 0.0])
    T[:3, 3] = -0.13, -0.1, 0.45
    board = vision.PlacedTarget(target=kr5.parse_target("grid:36h11:5x7:0.03:0.01"), T_camera_target=T)
    return vision.render([board], camera, vision.RenderOptions(blur=0.8, noise=2, clutter=10))


def processor_times(finders, image, repeat):
    """Of each finder [ms]; in turns, so that what slows the machine slows all."""
    times = {name: [] for name in finders}
    for _ in comparison.progress(range(repeat), "Timing"):
        for name, find in finders.items():
            start = time.process_time()
            find(image)
            times[name].append(1e3 * (time.process_time() - start))
    return times


def main():
    parser = arguments.parser(__doc__)
    parser.add_argument("build", type=Path, help="folder of a C++ build with KR5_BUILD_BENCH")
    parser.add_argument("--repeat", type=int, default=7)
    given = parser.parse_args()
    cv2.setNumThreads(1)
    image = made_image()
    finders = {"kr5": by_kr5, "AprilTag": by_apriltag, "OpenCV": by_opencv}
    seen = {name: len(find(image)) for name, find in finders.items()}
    times = processor_times(finders, image, given.repeat)
    found = {name: compare(find) for name, find in finders.items()}
    text = {name: "{} of {}, {} false".format(*f) for name, f in found.items()}
    hits, expected, false = found["kr5"]
    slower = {name: comparison.mean_difference(times["kr5"], times[name]) for name in ("AprilTag", "OpenCV")}
    median = {name: f"{np.median(t):.0f} ms" for name, t in times.items()}
    visp_ratio, visp_found = beside_visp(given.build, given.repeat)
    comparison.print_comparisons(
        [
            comparison.Row(
                "tags in the AprilTag photographs",
                text["kr5"],
                "all, none false",
                hits == expected and not false,
                f"AprilTag {text['AprilTag']}; OpenCV {text['OpenCV']}",
            ),
            comparison.Row(
                "tags found in a 5 Mpx image of 35",
                str(seen["kr5"]),
                "35",
                seen["kr5"] == 35,
                f"AprilTag {seen['AprilTag']}; OpenCV {seen['OpenCV']}; ViSP {visp_found}",
            ),
            *(
                comparison.Row(
                    f"its processor time on one thread beside {name}, median",
                    median["kr5"],
                    "not slower at equal finds",
                    slower[name].low <= 0 and seen["kr5"] >= seen[name],
                    median[name],
                    slower[name].text("ms", "+.0f"),
                )
                for name in slower
            ),
            comparison.Row(
                "its processor time beside ViSP (C++)",
                "1",
                "not slower",
                visp_ratio >= 1,
                f"ViSP {visp_ratio:.1f} times",
            ),
        ],
        "Tags",
    )


if __name__ == "__main__":
    main()
