"""The real hand-eye sets of the bench: corners by OpenCV, the same for every method, and the published robot poses."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import cv2
import kr5
import numpy as np
import yaml
from kr5 import calibration


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
    size = lambda p: blobs[int(np.argmin(np.linalg.norm(centres - p, axis=1)))].size
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
    x, y, z, w = np.array([p["qx"], p["qy"], p["qz"], p["qw"]]) / np.linalg.norm(
        [p[k] for k in ("qx", "qy", "qz", "qw")]
    )
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = p["x"], p["y"], p["z"]
    return T


def views_of(files: list[tuple[Path, np.ndarray]], find) -> tuple[list, tuple[int, int]]:
    views = []
    for file, pose in files:
        image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        found = find(image)
        if found is not None:
            view = kr5.View(
                name=file.name, points=found[0], pixels=found[1].astype(float), ids=list(range(found[0].shape[1]))
            )
            views.append(calibration.HandEyeView(T_base_flange=pose, view=view))
    return views, image.shape[::-1]


def franka(folder: Path, find) -> tuple[list, kr5.Pinhole]:
    files = [(folder / f"franka_image-{i}.png", visp_pose(folder / f"franka_pose_rPe_{i}.yaml")) for i in range(1, 9)]
    views, (width, height) = views_of(files, find)
    model = ElementTree.parse(folder / "franka_camera.xml").getroot().findall("camera/model")[0]
    px, py, u0, v0 = (float(model.findtext(k, "")) for k in ("px", "py", "u0", "v0"))
    return views, kr5.Pinhole(width=width, height=height, fx=px, fy=py, cx=u0, cy=v0)


def own_camera(views: list, size: tuple[int, int]) -> kr5.Pinhole:
    """OpenCV's camera from the same corners: the published one is nominal, and the same for all methods anyway."""
    points = [np.ascontiguousarray(v.view.points.T, np.float32) for v in views]
    pixels = [np.ascontiguousarray(v.view.pixels.T, np.float32) for v in views]
    _, K, D, *_ = cv2.calibrateCamera(points, pixels, size, None, None, flags=cv2.CALIB_FIX_K3)
    k1, k2, p1, p2 = D.ravel()[:4]
    return kr5.Pinhole(
        width=size[0], height=size[1], fx=K[0, 0], fy=K[1, 1], cx=K[0, 2], cy=K[1, 2], k1=k1, k2=k2, p1=p1, p2=p2
    )


def industrial(folder: Path, find) -> tuple[list, kr5.Pinhole]:
    count = len(list((folder / "images").glob("*.png")))
    files = [(folder / "images" / f"{i}.png", quaternion_pose(folder / "poses" / f"{i}.yaml")) for i in range(count)]
    views, size = views_of(files, find)
    return views, own_camera(views, size)


def real_sets(reference: Path) -> dict:
    visp, ros = reference / "data/handeye_visp_franka", reference / "data/handeye_industrial_calibration"
    return {
        "franka, eye in hand": ("eye_in_hand", *franka(visp / "eye-in-hand", chessboard)),
        "franka, eye to hand": ("eye_to_hand", *franka(visp / "eye-to-hand", april_tag)),
        "10 x 10 dots, eye in hand": ("eye_in_hand", *industrial(ros / "test_set_10x10", circles)),
        "ChArUco, eye to hand": ("eye_to_hand", *industrial(ros / "test_set_charuco", charuco)),
    }
