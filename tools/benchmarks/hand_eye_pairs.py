"""Hand-eye from pairs of poses beside OpenCV's five solvers and ViSP's: the same poses for all, without images.

    python tools/benchmarks/hand_eye_pairs.py [--reference FOLDER]

The target's poses are those of OpenCV's solvePnP on the corners of the real sets. Every pair is left out in turn and
the pose of its target predicted; of a solver that gives the camera alone, the target is the mean over the other pairs.
Ratios below 1 are in our favour; intervals are bootstrapped over pairs, 95 %.
"""

import kr5
import numpy as np
from kr5 import calibration

import arguments
import comparison
from hand_eye import METHODS, compared_rows, error_row, not_worse, peer_method, print_errors, target_pose
from hand_eye_sets import real_sets


def predicted(T_mount_camera: np.ndarray, T_fixed_target: np.ndarray, T: np.ndarray, mount: str) -> np.ndarray:
    """T_camera_target at a pose of the flange."""
    to_mount = np.linalg.inv(T) if mount == "eye_in_hand" else T
    return np.asarray(np.linalg.inv(T_mount_camera) @ to_mount @ T_fixed_target)


def peer(method: str, views: list, targets: list, mount: str) -> tuple[np.ndarray, np.ndarray]:
    X = peer_method(method, mount)(views, targets)
    poses = [(v.T_base_flange if mount == "eye_in_hand" else np.linalg.inv(v.T_base_flange)) for v in views]
    return X, kr5.mean_pose([T @ X @ M for T, M in zip(poses, targets)])


def ours(views: list, targets: list, mount: str) -> tuple[np.ndarray, np.ndarray]:
    pairs = [calibration.PosePair(T_base_flange=v.T_base_flange, T_camera_target=M) for v, M in zip(views, targets)]
    result = calibration.calibrate_hand_eye_pairs(pairs, calibration.HandEyePairsOptions(mount=mount))
    return result.T_mount_camera, result.T_fixed_target


def left_out(solve, views: list, targets: list, mount: str) -> tuple[np.ndarray, np.ndarray]:
    """Errors of every pair, predicted from the others [m, rad]."""
    errors = []
    for i, (view, M) in enumerate(zip(views, targets)):
        X, Z = solve(views[:i] + views[i + 1 :], targets[:i] + targets[i + 1 :], mount)
        d = kr5.pose_difference(M, predicted(X, Z, view.T_base_flange, mount)) if np.isfinite(X).all() else [np.nan] * 6
        errors.append((np.linalg.norm(d[:3]), np.linalg.norm(d[3:])))
    position, rotation = np.array(errors).T
    return position, rotation


def main() -> None:
    parser = arguments.parser(__doc__, reference=True)
    given = parser.parse_args()
    lines: list[comparison.Row] = []
    for name, (mount, views, camera) in comparison.progress(list(real_sets(given.reference).items()), "Real sets"):
        targets = [target_pose(view.view, camera) for view in views]
        found = left_out(ours, views, targets, mount)
        rows = [error_row("kr5", *found, None)]
        for method in METHODS:
            solve = lambda v, t, m, method=method: peer(method, v, t, m)
            rows.append(error_row(method, *left_out(solve, views, targets, mount), found))
        print_errors(f"{name}: {len(views)} pairs, each left out in turn", rows)
        lines += compared_rows(f"pairs, {name}", rows, "not significantly worse than any", not_worse, False)
    comparison.print_comparisons(lines, "Hand-eye from pairs of poses, ours beside the best other")


if __name__ == "__main__":
    main()
