"""What is seen of the arm at rest: by a tracker, its camera and its line scanner."""

from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import Rotation

from .arm import flange
from .truth import Truth, pose_matrix


def encoder_readings(d: dict, n: int) -> np.ndarray:
    return np.column_stack([d[f"q{i + 1}"] for i in range(n)])


def per_stop(truth: Truth, d: dict, key: str) -> np.ndarray:
    """Flange of every row, computed once a stop."""
    _, first, back = np.unique(d[key], return_index=True, return_inverse=True)
    return flange(truth, encoder_readings(d, truth.joints)[first], d["t"][first])[back]


def simulate_poses(truth: Truth, d: dict) -> dict:
    T = flange(truth, encoder_readings(d, truth.joints), d["t"]) @ pose_matrix(truth.cell["tool"]["T_F_E"])
    q = Rotation.from_matrix(T[:, :3, :3]).as_quat(scalar_first=True)
    return dict(zip(("x", "y", "z", "qw", "qx", "qy", "qz"), np.column_stack([T[:, :3, 3], q]).T, strict=True))


def board_points(board: dict, marker, corner) -> np.ndarray:
    r, c = np.divmod(marker.astype(int), board["cols"])
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * board["marker"]
    p = np.column_stack([c, r]) * (board["marker"] + board["gap"]) + square[corner.astype(int)]
    return np.column_stack([p, np.zeros(len(p)), np.ones(len(p))])


def project(truth: Truth, s: SimpleNamespace) -> None:
    """s.u, s.v of the points s.p (in the camera)."""
    cam = truth.cell["camera"]
    k1, k2, p1, p2, k3 = cam["distortion"]
    x, y = s.p[:, 0] / s.p[:, 2], s.p[:, 1] / s.p[:, 2]
    r2 = x * x + y * y
    s.r2, g = r2, 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    s.x = x * g + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    s.y = y * g + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    truth.bend("lens", s)
    s.u, s.v = cam["fx"] * s.x + cam["cx"], cam["fy"] * s.y + cam["cy"]


def simulate_views(truth: Truth, d: dict) -> dict:
    tool, cam = truth.cell["tool"], truth.cell["camera"]
    T_flange_camera = pose_matrix(tool.get("nominal_T_F_E", tool["T_F_E"])) @ pose_matrix(cam["T_E_C"])
    T_camera_target = np.linalg.inv(per_stop(truth, d, "view") @ T_flange_camera) @ pose_matrix(
        truth.cell["board"]["T_B_W"]
    )
    s = SimpleNamespace(d=d, truth=truth)
    s.p = np.einsum("kij,kj->ki", T_camera_target, board_points(truth.cell["board"], d["marker"], d["corner"]))[:, :3]
    project(truth, s)
    truth.bend("pixel", s)
    return {"u": s.u, "v": s.v}


def simulate_scan(truth: Truth, d: dict) -> dict:
    tool, target = truth.cell["tool"], truth.cell["laser"]["target"]
    T_flange_scanner = pose_matrix(tool.get("nominal_T_F_E", tool["T_F_E"])) @ pose_matrix(truth.cell["laser"]["T_E_L"])
    T = per_stop(truth, d, "line") @ T_flange_scanner
    s = SimpleNamespace(d=d, x=d["x"].copy(), truth=truth)
    truth.bend("fan", s)
    o = T[:, :3, 3] + T[:, :3, 0] * s.x[:, None] - T[:, :3, 1] * (truth.laser_lag * d["speed"])[:, None]
    ray = T[:, :3, 2]
    plane = (target["plane"] - o[:, 2]) / ray[:, 2]
    m = o - np.array(target["sphere"], float)
    b = np.sum(ray * m, 1)
    disc = b * b - np.sum(m * m, 1) + target["radius"] ** 2
    near = -b - np.sqrt(np.maximum(disc, 0))
    s.hit = (disc > 0) & (near > 0) & (near < plane)
    s.z = np.where(s.hit, near, plane)
    # How steeply the ray meets the surface: cosine of the angle to its normal.
    s.steep = np.where(s.hit, np.sqrt(np.maximum(disc, 0)) / target["radius"], np.abs(ray[:, 2]))
    truth.bend("range", s)
    return {"z": s.z, "sphere": s.hit.astype(float)}
