"""Hand-eye calibration beside OpenCV's five solvers and ViSP's: the same corners and the same target poses for all.

    python tools/bench/hand_eye.py [--reference FOLDER] [--trials 300] [--json FILE]

Real sets: every view is left out in turn and its board pose predicted (evaluate_hand_eye: one judge for all methods).
Synthetic sets: 3 mm and 0.3 degree of robot-pose noise per axis, error of the camera's pose against the truth.
Ratios below 1 are in our favour; intervals are bootstrapped over views (real) or trials (synthetic), 95 %.
Needs opencv-contrib-python-headless<5.
"""

import json
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import cv2
import numpy as np
import yaml
from scipy import stats

import arguments
import kr5
from kr5 import calibration, vision

METHODS = ("tsai", "park", "horaud", "andreff", "daniilidis", "visp")
POSITION_NOISE, ROTATION_NOISE = 0.003, np.deg2rad(0.3)


def grid(rows: int, cols: int, size: float) -> np.ndarray:
    points = np.zeros((3, rows * cols))
    points[:2] = np.mgrid[0:cols, 0:rows].T.reshape(-1, 2).T * size
    return points


# Corners: OpenCV's, the same for every method ------------------------------------------------------------------------


def chessboard(image: np.ndarray) -> tuple | None:
    found, pixels = cv2.findChessboardCorners(image, (9, 6))
    if not found:
        return None
    pixels = cv2.cornerSubPix(image, pixels, (5, 5), (-1, -1), (3, 60, 1e-5))
    return grid(6, 9, 0.0236), pixels.reshape(-1, 2).T


def april_tag(image: np.ndarray) -> tuple | None:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(image)
    if ids is None or 10 not in ids:
        return None
    half = 0.024
    points = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]]).T
    return points, corners[list(ids.ravel()).index(10)].reshape(4, 2).T


def circles(image: np.ndarray) -> tuple | None:
    """The 10 x 10 dots; the largest dot is a corner and tells which way the symmetric grid lies."""
    parameters = cv2.SimpleBlobDetector_Params()
    parameters.maxArea, parameters.minArea, parameters.minRepeatability = 5000, 25, 3
    detector = cv2.SimpleBlobDetector_create(parameters)
    found, pixels = cv2.findCirclesGrid(image, (10, 10), flags=cv2.CALIB_CB_SYMMETRIC_GRID, blobDetector=detector)
    if not found:
        return None
    pixels = pixels.reshape(10, 10, 2)
    blobs = detector.detect(image)
    centres = np.array([b.pt for b in blobs])
    size = lambda p: blobs[int(np.argmin(np.linalg.norm(centres - p, axis=1)))].size  # noqa: E731
    neighbours = [((0, 0), (1, 1)), ((0, -1), (1, -2)), ((-1, -1), (-2, -2)), ((-1, 0), (-2, 1))]
    turns = int(np.argmax([size(pixels[c]) / size(pixels[n]) for c, n in neighbours]))
    pixels = np.rot90(pixels, turns)
    a, b = pixels[0, -1] - pixels[0, 0], pixels[-1, 0] - pixels[0, 0]
    if a[0] * b[1] - a[1] * b[0] < 0:  # the grid came mirrored
        pixels = pixels.transpose(1, 0, 2)
    return grid(10, 10, 0.0254), pixels.reshape(-1, 2).T


def charuco(image: np.ndarray) -> tuple | None:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
    board = cv2.aruco.CharucoBoard((5, 7), 0.036195, 0.018256, dictionary)
    for legacy in (True, False):
        board.setLegacyPattern(legacy)
        pixels, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(image)
        if ids is not None and len(ids) >= 8:
            return board.getChessboardCorners()[ids.ravel()].T.astype(float), pixels.reshape(-1, 2).T
    return None


# Data sets -----------------------------------------------------------------------------------------------------------


def visp_pose(file: Path) -> np.ndarray:
    """ViSP's own YAML, which no YAML reader takes: six numbers in brackets, tx ty tz and the rotation vector."""
    numbers = [float(line.split("[")[1].split("]")[0]) for line in file.read_text().splitlines() if "[" in line]
    return kr5.to_pose(np.array(numbers))


def quaternion_pose(file: Path) -> np.ndarray:
    p = yaml.safe_load(file.read_text())
    x, y, z, w = np.array([p["qx"], p["qy"], p["qz"], p["qw"]]) / np.linalg.norm([p[k] for k in ("qx", "qy", "qz", "qw")])
    T = np.eye(4)
    T[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    T[:3, 3] = p["x"], p["y"], p["z"]
    return T


def views_of(files: list[tuple[Path, np.ndarray]], find) -> tuple[list, tuple[int, int]]:
    views = []
    for file, pose in files:
        image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        found = find(image)
        if found is not None:
            view = kr5.View(name=file.name, points=found[0], pixels=found[1].astype(float), ids=list(range(found[0].shape[1])))
            views.append(calibration.HandEyeView(T_base_flange=pose, view=view))
    return views, image.shape[::-1]


def franka(folder: Path, find) -> tuple[list, kr5.Pinhole]:
    files = [(folder / f"franka_image-{i}.png", visp_pose(folder / f"franka_pose_rPe_{i}.yaml")) for i in range(1, 9)]
    views, (width, height) = views_of(files, find)
    model = ElementTree.parse(folder / "franka_camera.xml").find("camera/model")
    px, py, u0, v0 = (float(model.find(k).text) for k in ("px", "py", "u0", "v0"))
    return views, kr5.Pinhole(width=width, height=height, fx=px, fy=py, cx=u0, cy=v0)


def own_camera(views: list, size: tuple[int, int]) -> kr5.Pinhole:
    """OpenCV's camera from the same corners: the published one is nominal, and the same for all methods anyway."""
    points = [np.ascontiguousarray(v.view.points.T, np.float32) for v in views]
    pixels = [np.ascontiguousarray(v.view.pixels.T, np.float32) for v in views]
    _, K, D, *_ = cv2.calibrateCamera(points, pixels, size, None, None, flags=cv2.CALIB_FIX_K3)
    k1, k2, p1, p2 = D.ravel()[:4]
    return kr5.Pinhole(width=size[0], height=size[1], fx=K[0, 0], fy=K[1, 1], cx=K[0, 2], cy=K[1, 2], k1=k1, k2=k2, p1=p1, p2=p2)


def industrial(folder: Path, find) -> tuple[list, kr5.Pinhole]:
    count = len(list((folder / "images").glob("*.png")))
    files = [(folder / "images" / f"{i}.png", quaternion_pose(folder / "poses" / f"{i}.yaml")) for i in range(count)]
    views, size = views_of(files, find)
    return views, own_camera(views, size)


def real_sets(reference: Path) -> dict:
    visp, ros = reference / "data/handeye_visp_franka", reference / "data/handeye_industrial_calibration"
    return {"franka, eye in hand": ("eye_in_hand", *franka(visp / "eye-in-hand", chessboard)),
            "franka, eye to hand": ("eye_to_hand", *franka(visp / "eye-to-hand", april_tag)),
            "10 x 10 dots, eye in hand": ("eye_in_hand", *industrial(ros / "test_set_10x10", circles)),
            "ChArUco, eye to hand": ("eye_to_hand", *industrial(ros / "test_set_charuco", charuco))}


# Methods -------------------------------------------------------------------------------------------------------------


def peer(method: str, mount: str):
    def solve(views: list, targets: list) -> np.ndarray:
        samples = [vision.HandEyeSample(T_base_flange=v.T_base_flange if mount == "eye_in_hand" else np.linalg.inv(v.T_base_flange),
                                        T_camera_target=M) for v, M in zip(views, targets)]
        return vision.closed_form_hand_eye(samples, method)
    return solve


def interval(ours: np.ndarray, theirs: np.ndarray, seed: int = 1) -> list[float]:
    """95 % of the ratio of RMS errors, views or trials drawn again with replacement, in pairs."""
    rng = np.random.default_rng(seed)
    draws = rng.integers(len(ours), size=(4000, len(ours)))
    ratio = np.sqrt((ours[draws] ** 2).mean(1) / (theirs[draws] ** 2).mean(1))
    return [float(x) for x in np.quantile(ratio, [0.025, 0.975])]


def difference(ours: np.ndarray, theirs: np.ndarray, scale: float) -> list[float]:
    """Mean of the paired differences of squared errors, as one of RMS, with Student's 95 % interval: 0 inside means level."""
    d = ours**2 - theirs**2
    half = stats.t.ppf(0.975, len(d) - 1) * d.std(ddof=1) / np.sqrt(len(d))
    per = scale / (np.sqrt((ours**2).mean()) + np.sqrt((theirs**2).mean()))  # a^2 - b^2 = (a - b) (a + b)
    return [float(per * x) for x in (d.mean(), d.mean() - half, d.mean() + half)]


def row(name: str, position: np.ndarray, rotation: np.ndarray, ours: tuple | None) -> dict:
    out = {"method": name, "position_mm": float(1e3 * np.sqrt((position ** 2).mean())),
           "rotation_deg": float(np.rad2deg(np.sqrt((rotation ** 2).mean())))}
    if ours is not None:
        out["position_ratio"] = [float(np.sqrt((ours[0] ** 2).mean() / (position ** 2).mean())), *interval(ours[0], position)]
        out["rotation_ratio"] = [float(np.sqrt((ours[1] ** 2).mean() / (rotation ** 2).mean())), *interval(ours[1], rotation)]
        out["position_difference_mm"] = difference(ours[0], position, 1e3)
        out["rotation_difference_deg"] = difference(ours[1], rotation, 180 / np.pi)
    return out


def show(title: str, rows: list[dict]) -> None:
    print(f"\n{title}\n{'method':12}  mm       deg      ours/theirs mm [95 %]     ours/theirs deg [95 %]")
    for r in rows:
        text = "".join(f"   {r[k][0]:.2f} [{r[k][1]:.2f}, {r[k][2]:.2f}]       " for k in ("position_ratio", "rotation_ratio") if k in r)
        print(f"{r['method']:12} {r['position_mm']:7.3f}  {r['rotation_deg']:7.4f}  {text}")


def judge(what: str, rows: list[dict], wanted: str, reached) -> None:
    """One line a quantity: ours, the best peer, what is wanted, and whether that is reached."""
    ours, *peers = rows
    for quantity, unit in (("position", "mm"), ("rotation", "deg")):
        key = f"{quantity}_{unit}"
        best = min(peers, key=lambda r: r[key])
        d = best[f"{quantity}_difference_{unit}"]
        print(f"{what}, {quantity}: kr5 {ours[key]:.4g} {unit}, best peer {best['method']} {best[key]:.4g} {unit}, "
              f"difference {d[0]:+.3g} [{d[1]:+.3g}, {d[2]:+.3g}] {unit}; wanted: {wanted}; "
              f"{'reached' if all(reached(r, quantity, unit) for r in peers) else 'NOT reached'}")


def not_worse(peer: dict, quantity: str, unit: str) -> bool:
    return peer[f"{quantity}_difference_{unit}"][1] <= 0


def fifth_lower(peer: dict, quantity: str, unit: str) -> bool:
    return peer[f"{quantity}_ratio"][0] <= 0.8


def bench_real(reference: Path) -> dict:
    out = {}
    for name, (mount, views, camera) in real_sets(reference).items():
        errors = lambda e: (np.array([v.position for v in e.views]), np.array([v.rotation for v in e.views]))  # noqa: E731
        ours = errors(calibration.evaluate_hand_eye(views, camera, calibration.HandEyeOptions(mount=mount)))
        rows = [row("kr5", *ours, None)]
        for method in METHODS:
            theirs = errors(calibration.evaluate_hand_eye_method(views, camera, peer(method, mount), mount))
            rows.append(row(method, *theirs, ours))
        title = f"{name}: {len(views)} views, each left out in turn"
        show(title, rows)
        judge(name, rows, "not significantly worse than any (95 %)", not_worse)
        out[name] = {"views": len(views), "rows": rows}
    return out


# Synthetic -----------------------------------------------------------------------------------------------------------


def synthetic(rng: np.random.Generator, mount: str, count: int = 15) -> tuple:
    camera = kr5.Pinhole(width=1280, height=960, fx=1100, fy=1098, cx=645, cy=478, k1=-0.12, k2=0.05)
    points = grid(6, 9, 0.03)
    around = lambda middle: kr5.to_pose(np.array(middle)) @ kr5.to_pose(rng.normal(0, [0.03] * 3 + [0.1] * 3))  # noqa: E731
    if mount == "eye_in_hand":
        X, Z = around([0.05, -0.03, 0.08, 0.1, -0.15, 1.6]), around([0.7, 0.1, 0.05, 3.1, 0.05, 0.4])
    else:
        X, Z = around([1.2, 0.3, 0.6, -1.8, 0.1, 1.2]), around([0.02, -0.04, 0.09, 0.1, 0.05, -0.7])
    views = []
    while len(views) < count:
        way, tilt, z = rng.uniform(0, 2 * np.pi), 0.6 * np.sqrt(rng.uniform()), rng.uniform(0.45, 0.8)
        M = np.eye(4)
        M[:3, :3] = kr5.exp_rotation(tilt * np.array([np.cos(way), np.sin(way), 0])) @ kr5.exp_rotation(np.array([0, 0, rng.uniform(-2.5, 2.5)]))
        M[:3, 3] = np.array([rng.uniform(-0.3, 0.3) * z, rng.uniform(-0.25, 0.25) * z, z]) - M[:3, :3] @ points.mean(1)
        pixels = camera.project((M[:3, :3] @ points) + M[:3, 3:])
        if pixels.min() < 5 or pixels[0].max() > 1274 or pixels[1].max() > 954:
            continue
        S = Z @ np.linalg.inv(M) @ np.linalg.inv(X)
        T = S if mount == "eye_in_hand" else np.linalg.inv(S)
        T = T @ kr5.to_pose(rng.normal(0, [POSITION_NOISE] * 3 + [ROTATION_NOISE] * 3))
        view = kr5.View(name=str(len(views)), points=points, pixels=pixels + rng.normal(0, 0.2, pixels.shape), ids=list(range(54)))
        views.append(calibration.HandEyeView(T_base_flange=T, view=view))
    return views, camera, X


def target_pose(view: kr5.View, camera: kr5.Pinhole) -> np.ndarray:
    K = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    lens = np.array([camera.k1, camera.k2, camera.p1, camera.p2])
    _, rotation, translation = cv2.solvePnP(np.ascontiguousarray(view.points.T), np.ascontiguousarray(view.pixels.T), K, lens)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = cv2.Rodrigues(rotation)[0], translation.ravel()
    return T


def bench_synthetic(trials: int) -> dict:
    out = {}
    for mount in ("eye_in_hand", "eye_to_hand"):
        errors = {name: [] for name in ("kr5", *METHODS)}
        for trial in range(trials):
            views, camera, X = synthetic(np.random.default_rng(trial), mount)
            found = {"kr5": calibration.calibrate_hand_eye(views, camera, calibration.HandEyeOptions(mount=mount)).T_mount_camera}
            targets = [target_pose(v.view, camera) for v in views]
            found |= {m: peer(m, mount)(views, targets) for m in METHODS}
            for name, T in found.items():
                d = kr5.pose_difference(X, T)
                errors[name].append((np.linalg.norm(d[:3]), np.linalg.norm(d[3:])))
        arrays = {name: np.array(e).T for name, e in errors.items()}
        rows = [row(name, *a, None if name == "kr5" else arrays["kr5"]) for name, a in arrays.items()]
        title = f"synthetic, {mount}: 15 views, 3 mm and 0.3 deg robot noise, {trials} trials, error of the camera pose"
        show(title, rows)
        judge(f"synthetic, {mount}", rows, "at least 20 % lower than each", fifth_lower)
        out[mount] = {"trials": trials, "rows": rows}
    return out


def main() -> None:
    parser = arguments.parser(__doc__, reference=True, json=True)
    parser.add_argument("--trials", type=int, default=300)
    given = parser.parse_args()
    result = {"real": bench_real(given.reference), "synthetic": bench_synthetic(given.trials)}
    if given.json:
        given.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
