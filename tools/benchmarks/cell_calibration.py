"""Camera, hand-eye and marker map in one solve, beside one after another, on rendered cells whose truth is known.

    python tools/benchmarks/cell_calibration.py [--cells 40]

Each cell is drawn at random: camera and its lens, where it sits, twelve glued markers that are not quite where they
should be, robot noise, grey-level noise. calibrate_cell stands beside two sequences: camera, then hand-eye, with the
markers where they should be; and camera and marker map from the images alone, in one adjustment, then hand-eye. Ends
with the time for 1000 views of 35 tags.
"""

import resource
import time
from typing import Any

import kr5
import numpy as np
from kr5 import calibration, vision

import arguments
import comparison

FAMILY = "36h11"
SIZE = 0.04  # of a marker [m]
VIEWS = 14


def draw_cell(random: np.random.Generator) -> dict:
    """Everything of a cell that its images depend on."""
    focal = random.uniform(900, 1300)
    camera = kr5.Pinhole(
        width=1024,
        height=768,
        fx=focal,
        fy=focal * random.uniform(0.997, 1.003),
        cx=512 + random.normal(0, 12),
        cy=384 + random.normal(0, 12),
        k1=random.uniform(-0.25, -0.05),
        k2=random.uniform(0, 0.1),
    )
    nominal, glued = [], []
    for k in range(12):
        T = np.eye(4)
        T[:3, 3] = [0.07 * (k % 4), 0.07 * (k // 4), 0.0]
        off = np.r_[random.normal(0, 5e-4, 3), random.normal(0, 5e-3, 3)] if k else np.zeros(6)
        nominal.append(kr5.MapMarker(id=k, size=SIZE, T_target_marker=T))
        glued.append(kr5.MapMarker(id=k, size=SIZE, T_target_marker=T @ kr5.to_pose(off)))
    return {
        "camera": camera,
        "nominal": nominal,
        "glued": glued,
        "T_flange_camera": kr5.from_xyzrpy(np.r_[random.normal(0, 0.05, 2), 0.1, random.uniform(-0.3, 0.3, 2), 1.5]),
        "T_base_target": kr5.from_xyzrpy([0.8, random.normal(0, 0.1), 0.05, 3.1, 0.05, random.uniform(-1, 1)]),
        "robot": (10 ** random.uniform(-4.5, -3.5), 10 ** random.uniform(-4.5, -3.5)),  # [m], [rad]
        "grey": random.uniform(1, 4),
    }


def random_pose(random: np.random.Generator, camera: kr5.Pinhole, points: np.ndarray) -> np.ndarray:
    """Pose of the markers in the camera with every one of them in the image."""
    middle = points.mean(axis=1)
    while True:
        direction = random.uniform(0, 2 * np.pi)
        tilt = random.uniform(0, 0.7) * np.array([np.cos(direction), np.sin(direction), 0])
        T = kr5.to_pose(np.r_[0, 0, 0, tilt]) @ kr5.to_pose([0, 0, 0, 0, 0, random.uniform(-np.pi, np.pi)])
        z = random.uniform(0.35, 0.6)
        T[:3, 3] = np.array([random.uniform(-0.15, 0.15) * z, random.uniform(-0.1, 0.1) * z, z]) - T[:3, :3] @ middle
        pixels = camera.project(T[:3, :3] @ points + T[:3, 3:])
        size = np.array([[camera.width], [camera.height]])
        if ((pixels > 12) & (pixels < size - 12)).all():
            return T


def corners_of(markers: list) -> np.ndarray:
    square = SIZE / 2 * np.array([[-1, 1, 1, -1], [-1, -1, 1, 1], [0, 0, 0, 0]], float)
    return np.hstack([m.T_target_marker[:3, :3] @ square + m.T_target_marker[:3, 3:] for m in markers])


def see_cell(cell: dict, random: np.random.Generator) -> list:
    """Stops with what was seen, on the nominal map, and the reported robot poses."""
    everywhere = corners_of(cell["glued"])
    board = kr5.Target(kind="marker_map", family=FAMILY, map=cell["nominal"])
    stops = []
    for k in range(VIEWS):
        M = random_pose(random, cell["camera"], everywhere)
        placed = [
            vision.PlacedTarget(
                target=kr5.parse_target(f"tag:{FAMILY}:{m.id}:{SIZE}"), T_camera_target=M @ m.T_target_marker
            )
            for m in cell["glued"]
        ]
        options = vision.RenderOptions(noise=cell["grey"], seed=int(random.integers(1 << 30)))
        found = vision.find_target(vision.render(placed, cell["camera"], options), board)
        T = cell["T_base_target"] @ np.linalg.inv(M) @ np.linalg.inv(cell["T_flange_camera"])
        noise = np.r_[random.normal(0, cell["robot"][0], 3), random.normal(0, cell["robot"][1], 3)]
        found.view.name = f"view {k}"
        stops.append(
            calibration.CellStop(
                view=calibration.HandEyeView(
                    T_base_flange=T @ kr5.to_pose(noise), view=found.view, correlation=found.correlation
                )
            )
        )
    return stops


def on_map(view: Any, markers: list) -> Any:
    """A view with its corners where a map has them."""
    place = {4 * m.id + c: p for m in markers for c, p in enumerate(corners_of([m]).T)}
    return kr5.View(name=view.name, points=np.array([place[i] for i in view.ids]).T, pixels=view.pixels, ids=view.ids)


def calibrate_both(cell: dict, stops: list) -> tuple:
    """Hand-eye with camera and map of the images alone, and all in one solve."""
    views = [s.view.view for s in stops]
    start = vision.calibrate_camera(
        views, cell["camera"].width, cell["camera"].height, vision.CameraOptions(lens="k1k2", folds=0)
    ).camera
    begin = calibration.CellGeometry(camera=start, markers=cell["nominal"])
    unknown_robot = calibration.CellCalibrationOptions(sigma_robot_position=1.0, sigma_robot_rotation=1.0)
    images = calibration.calibrate_cell(stops, begin, unknown_robot).cell
    separate = calibration.calibrate_hand_eye(
        [
            calibration.HandEyeView(
                T_base_flange=s.view.T_base_flange,
                view=on_map(s.view.view, images.markers),
                correlation=s.view.correlation,
            )
            for s in stops
        ],
        images.camera,
    )
    return separate, calibration.calibrate_cell(stops, begin)


def accuracy(cells: int) -> list[comparison.Row]:
    """Errors of the camera on the flange, paired by cell."""
    nominal, separate, together, stated = [], [], [], 0
    for seed in comparison.progress(range(cells), "rendered cells"):
        random = np.random.default_rng(7000 + seed)
        cell = draw_cell(random)
        one, other = calibrate_both(cell, see_cell(cell, random))
        truth = cell["T_flange_camera"]
        nominal.append(1e3 * np.linalg.norm((np.linalg.inv(truth) @ other.start.T_mount_camera)[:3, 3]))
        separate.append(1e3 * np.linalg.norm((np.linalg.inv(truth) @ one.T_mount_camera)[:3, 3]))
        together.append(1e3 * np.linalg.norm((np.linalg.inv(truth) @ other.T_mount_camera)[:3, 3]))
        off = kr5.pose_difference(truth, other.T_mount_camera)
        stated += bool(off @ np.linalg.solve(other.covariance, off) < 12.592)  # 95 % of a chi-square of six
    peers = (
        ("camera, then hand-eye, both on the nominal layout", nominal),
        ("camera and map of the images in one adjustment, then hand-eye", separate),
    )
    low, high = comparison.exact_interval(stated, cells)
    rows = []
    for what, errors in peers:
        difference = comparison.mean_difference(together, errors)
        rows.append(
            comparison.Row(
                f"camera on the flange, {cells} rendered cells, mean error, beside {what}",
                f"{np.mean(together):.3f} mm",
                "better, interval without 0",
                difference.high < 0,
                f"{np.mean(errors):.3f} mm",
                difference.text("mm"),
                figure="camera + hand-eye + map together",
                ratio=np.mean(errors) / np.mean(together),
            )
        )
    return [
        *rows,
        comparison.Row(
            "its 95 % region holds the truth",
            f"{stated} of {cells}",
            "93 to 97 %",
            low <= 0.97 and high >= 0.93,
            interval=comparison.format_rate(stated, cells),
            figure="camera + hand-eye + map together",
        ),
    ]


def many_views(count: int = 1000) -> comparison.Row:
    """Time from detections of 35 tags to camera and hand-eye, in this process."""
    random = np.random.default_rng(5)
    cell = draw_cell(random)
    points = np.array(kr5.target_points(kr5.parse_target(f"grid:{FAMILY}:5x7:0.03:0.01"))[0])
    stops = []
    for k in range(count):
        M = random_pose(random, cell["camera"], points)
        pixels = cell["camera"].project(M[:3, :3] @ points + M[:3, 3:]) + random.normal(0, 0.1, (2, points.shape[1]))
        T = cell["T_base_target"] @ np.linalg.inv(M) @ np.linalg.inv(cell["T_flange_camera"])
        noise = np.r_[random.normal(0, 1e-4, 3), random.normal(0, 1e-4, 3)]
        view = kr5.View(name=str(k), points=points, pixels=pixels, ids=list(range(points.shape[1])))
        stops.append(
            calibration.CellStop(view=calibration.HandEyeView(T_base_flange=T @ kr5.to_pose(noise), view=view))
        )
    begin = time.perf_counter()
    some = [s.view.view for s in stops[:: max(1, count // 100)]]
    camera = vision.calibrate_camera(
        some, cell["camera"].width, cell["camera"].height, vision.CameraOptions(lens="k1k2", folds=0)
    ).camera
    calibration.calibrate_cell(stops, calibration.CellGeometry(camera=camera))
    seconds = time.perf_counter() - begin
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20  # [GiB]
    return comparison.Row(
        f"{count} views of 35 tags (projected, 0.1 px): camera, then all together",
        f"{seconds:.1f} s, {memory:.2f} GiB",
        "10 s, 2 GiB",
        seconds <= 10 and memory <= 2,
        figure="1000 views of 35 tags",
    )


def main() -> None:
    parser = arguments.parser(__doc__)
    parser.add_argument("--cells", type=int, default=40)
    wanted = parser.parse_args()
    comparison.print_comparisons([*accuracy(wanted.cells), many_views()])


if __name__ == "__main__":
    main()
