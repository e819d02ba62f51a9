"""Makes share/data/demo: an eye-in-hand cell whose truth is known. `python tools/make_demo_data.py [FOLDER] [--seed N]`

The arm is the KUKA KR5 Arc of share/cells/kr5_arc.yaml. It reports the poses that its nominal kinematics give; where it
really stands differs by small errors of its links and by its repeatability. Images come from kr5's own renderer. In one
view the robot was bumped after its pose had been read.
"""

import argparse
import copy
import csv
import itertools
from pathlib import Path

import kr5
import kr5.kinematics
import kr5.vision
import numpy as np
import yaml
from scipy.optimize import least_squares

ROOT = Path(__file__).resolve().parent.parent
ROBOT = yaml.safe_load((ROOT / "share/cells/kr5_arc.yaml").read_text())["robot"]
TARGET = "grid:36h11:5x7:0.03:0.01"
CAMERA = {
    "width": 960,
    "height": 720,
    "fx": 913.2,
    "fy": 915.4,
    "cx": 491.8,
    "cy": 354.9,
    "k1": -0.2018,
    "k2": 0.0904,
    "p1": 2e-4,
    "p2": -1e-4,
}
VIEWS, BUMPED = 16, 11
REPEATABILITY = 6e-5, 1e-4  # per axis [m, rad]
LINK_ERROR = 2e-5, 3e-5  # lengths [m], angles [rad]
BUMP = [2.1e-3, -1.4e-3, 0.9e-3, 0.004, 0.003, -0.002]
DATASET = f"""\
format: kr5-dataset/1
images: images/*.png
poses: poses.csv       # as the controller shows them: X Y Z in mm, A B C in degrees
pairing: order
convention: {{position: mm, rotation: kuka_abc, angle: deg, meaning: T_base_flange}}
mount: eye_in_hand
target: {TARGET}
camera: camera.yaml
"""


def arm(rng: np.random.Generator | None = None) -> kr5.kinematics.DhChain:
    """The KR5 Arc; with `rng`, as it was really built. An error of the last joint would be one of the camera's
    place."""
    joints = copy.deepcopy(ROBOT["dh"])
    if rng is not None:
        for joint in joints[:-1]:
            for key, sigma in (
                ("b", LINK_ERROR[0]),
                ("a", LINK_ERROR[0]),
                ("theta_offset", LINK_ERROR[1]),
                ("alpha", LINK_ERROR[1]),
            ):
                joint[key] += rng.normal(0, sigma)
    return kr5.kinematics.DhChain([kr5.kinematics.DhJoint(**joint) for joint in joints])


def looking_at(point: np.ndarray, eye: np.ndarray, roll: float) -> np.ndarray:
    """T_base_camera with the optical axis through `point`."""
    z = (point - eye) / np.linalg.norm(point - eye)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([x, np.cross(z, x), z]) @ kr5.exp_rotation([0, 0, roll])
    T[:3, 3] = eye
    return T


def inverse(chain: kr5.kinematics.DhChain, T_base_flange: np.ndarray, limits: dict[str, list[float]]) -> np.ndarray:
    """Joint angles within the limits that reach a flange pose; of several the ones nearest to the usual posture."""
    usual, found = np.array([0.0, 0.2, -2.9, 0.0, -1.0, 0.0]), []
    weight = [1, 1, 1, 0.3, 0.3, 0.3]
    for shoulder, elbow, wrist in itertools.product((-0.8, 0.0, 0.8), (-2.2, -3.2, -4.0), (-2.0, -0.5)):
        start = np.array([0.0, shoulder, elbow, 0.0, wrist, 0.0])
        answer = least_squares(
            lambda q: kr5.pose_difference(chain.flange(q), T_base_flange) * weight,
            start,
            xtol=1e-14,
            ftol=1e-14,
            bounds=(limits["lower"], limits["upper"]),
        )
        if answer.cost < 1e-16:
            found.append(answer.x)
    if not found:
        raise RuntimeError(f"the arm does not reach {T_base_flange[:3, 3]}")
    return min(found, key=lambda q: np.linalg.norm(q - usual))


def stops(rng: np.random.Generator, middle: np.ndarray) -> list[np.ndarray]:
    """Camera poses over half a sphere about the board, near and far, turned about the optical axis too."""
    out = []
    for k in range(VIEWS):
        azimuth, tilt = 2 * np.pi * k * 0.382, np.radians(8 + 30 * np.sqrt((k + 0.5) / VIEWS))
        distance, roll = rng.uniform(0.34, 0.46), rng.uniform(-0.6, 0.6)
        direction = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
        aim = middle + np.append(rng.uniform(-0.05, 0.05, 2), 0.0)
        out.append(looking_at(aim, middle + distance * direction, roll))
    return out


def kuka_row(T: np.ndarray) -> list[float]:
    """X Y Z [mm] A B C [deg], rounded as a controller's display does."""
    x, y, z, roll, pitch, yaw = kr5.to_xyzrpy(T)
    return [round(1e3 * v, 3) for v in (x, y, z)] + [round(float(np.degrees(v)), 4) for v in (yaw, pitch, roll)]


def write(folder: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    nominal, built = arm(), arm(rng)
    camera, target = kr5.Pinhole(**CAMERA), kr5.parse_target(TARGET)
    T_flange_camera = kr5.from_xyzrpy([0.0113, 0.0667, 0.1286, 0.0262, -0.0117, 1.5641])
    T_base_target = kr5.from_xyzrpy([0.9352, -0.0968, 0.2985, np.pi - 0.004, 0.006, 3.1236])
    points, _ = kr5.target_points(target)
    middle = T_base_target[:3, :3] @ points.mean(axis=1) + T_base_target[:3, 3]
    (folder / "images").mkdir(parents=True, exist_ok=True)
    rows, angles = [], []
    for k, T_base_camera in enumerate(stops(rng, middle), start=1):
        q = np.round(inverse(nominal, T_base_camera @ np.linalg.inv(T_flange_camera), ROBOT["limits"]), 5)
        stands = built.flange(q) @ kr5.to_pose(
            np.append(rng.normal(0, REPEATABILITY[0], 3), rng.normal(0, REPEATABILITY[1], 3))
        )
        if k == BUMPED:
            stands = stands @ kr5.to_pose(BUMP)
        placed = kr5.vision.PlacedTarget(
            target=target, T_camera_target=np.linalg.inv(stands @ T_flange_camera) @ T_base_target
        )
        options = kr5.vision.RenderOptions(
            blur=0.7,
            noise=1.3,
            clutter=14,
            background=95,
            gradient_x=rng.uniform(-0.2, 0.2),
            gradient_y=rng.uniform(-0.2, 0.2),
            vignetting=0.25,
            brightness=rng.uniform(0.8, 1.0),
            seed=seed + k,
        )
        kr5.vision.save_image(
            kr5.vision.render([placed], camera, options), str(folder / "images" / f"view_{k:02d}.png")
        )
        rows.append(kuka_row(nominal.flange(q)))
        angles.append([float(v) for v in q])
    with (folder / "poses.csv").open("w", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows([["x", "y", "z", "a", "b", "c"], *rows])
    (folder / "dataset.yaml").write_text(DATASET)
    (folder / "camera.yaml").write_text(yaml.safe_dump(CAMERA, sort_keys=False))
    truth = {
        "seed": seed,
        "T_flange_camera": T_flange_camera.tolist(),
        "T_base_target": T_base_target.tolist(),
        "camera": CAMERA,
        "bumped": f"view_{BUMPED:02d}.png",
        "repeatability": {"position": REPEATABILITY[0], "rotation": REPEATABILITY[1]},
        "joint_angles": angles,
    }
    (folder / "truth.yaml").write_text(
        "# What the images were made with [m, rad, px]; joint angles as reported.\n"
        + yaml.safe_dump(truth, sort_keys=False, default_flow_style=None, width=120)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "share/data/demo")
    parser.add_argument("--seed", type=int, default=5)
    arguments = parser.parse_args()
    write(arguments.folder, arguments.seed)


if __name__ == "__main__":
    main()
