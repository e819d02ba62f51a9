"""Hand-eye calibration beside OpenCV's five solvers and ViSP's: the same corners and the same target poses for all.

    python tools/benchmarks/hand_eye.py [--reference FOLDER] [--trials 300] [--json FILE]

Real sets: every view is left out in turn and its board pose predicted (evaluate_hand_eye: one judge for all methods).
Synthetic sets: 3 mm and 0.3 degree of robot-pose noise per axis, error of the camera's pose against the truth.
Ratios below 1 are in our favour; intervals are bootstrapped over views (real) or trials (synthetic), 95 %. Beside the
synthetic errors stands the Cramer-Rao bound: what no unbiased method, however good, stays below on these views.
Needs opencv-contrib-python-headless<5.
"""

import json
from pathlib import Path

import cv2
import kr5
import numpy as np
from kr5 import calibration, vision

import arguments
import comparison
from hand_eye_sets import grid, real_sets

METHODS = ("tsai", "park", "horaud", "andreff", "daniilidis", "visp")
POSITION_NOISE, ROTATION_NOISE, PIXEL_NOISE = 0.003, np.deg2rad(0.3), 0.2


# Methods -------------------------------------------------------------------------------------------------------------


def peer_method(method: str, mount: str):
    def solve(views: list, targets: list) -> np.ndarray:
        samples = [
            vision.HandEyeSample(
                T_base_flange=v.T_base_flange if mount == "eye_in_hand" else np.linalg.inv(v.T_base_flange),
                T_camera_target=M,
            )
            for v, M in zip(views, targets)
        ]
        return vision.closed_form_hand_eye(samples, vision.HandEyeMethod(method))

    return solve


def error_row(
    name: str, position: np.ndarray, rotation: np.ndarray, ours: tuple[np.ndarray, np.ndarray] | np.ndarray | None
) -> dict:
    solved = np.isfinite(position)  # a method that finds no pose is compared where it finds one
    position, rotation = position[solved], rotation[solved]
    if ours is not None:
        ours = (ours[0][solved], ours[1][solved])
    out = {
        "method": name,
        "position_mm": float(1e3 * np.sqrt((position**2).mean())),
        "rotation_deg": float(np.rad2deg(np.sqrt((rotation**2).mean()))),
    }
    if ours is not None:
        for i, (name, theirs, unit, scale) in enumerate(
            (("position", position, "mm", 1e3), ("rotation", rotation, "deg", 180 / np.pi))
        ):
            out[f"{name}_ratio"] = list(vars(comparison.rms_ratio(ours[i], theirs)).values())
            out[f"{name}_difference_{unit}"] = list(vars(comparison.rms_difference(ours[i], theirs, scale)).values())
    return out


def print_errors(title: str, rows: list[dict]) -> None:
    print(f"\n{title}\n{'method':12}  mm       deg      ours/theirs mm [95 %]     ours/theirs deg [95 %]")
    for r in rows:
        text = "".join(
            f"   {r[k][0]:.2f} [{r[k][1]:.2f}, {r[k][2]:.2f}]       "
            for k in ("position_ratio", "rotation_ratio")
            if k in r
        )
        print(f"{r['method']:12} {r['position_mm']:7.3f}  {r['rotation_deg']:7.4f}  {text}")


def compared_rows(what: str, rows: list[dict], wanted: str, reached, relative: bool) -> list[comparison.Row]:
    """One line a quantity: ours, the best peer, what is wanted, and whether that is reached beside all of them."""
    ours, *peers = rows
    lines = []
    for quantity, unit in (("position", "mm"), ("rotation", "deg")):
        key = f"{quantity}_{unit}"
        best = min(peers, key=lambda r: r[key])
        ratio = comparison.Difference(*best[f"{quantity}_ratio"])
        interval = (
            ratio.text("times", ".2f")
            if relative
            else comparison.Difference(*best[f"{quantity}_difference_{unit}"]).text(unit)
        )
        lines.append(
            comparison.Row(
                f"{what}, {quantity}",
                f"{ours[key]:.4g} {unit}",
                wanted,
                all(reached(r, quantity, unit) for r in peers),
                f"{best['method']} {best[key]:.4g} {unit}",
                interval,
            )
        )
    return lines


def not_worse(peer: dict, quantity: str, unit: str) -> bool:
    return peer[f"{quantity}_difference_{unit}"][1] <= 0


def fifth_lower(peer: dict, quantity: str, unit: str) -> bool:
    return peer[f"{quantity}_ratio"][2] <= 0.8


def bench_real(reference: Path, lines: list[comparison.Row]) -> dict:
    out = {}
    for name, (mount, views, camera) in comparison.progress(list(real_sets(reference).items()), "Real sets"):
        errors = lambda e: (np.array([v.position for v in e.views]), np.array([v.rotation for v in e.views]))
        ours = errors(calibration.evaluate_hand_eye(views, camera, calibration.HandEyeOptions(mount=mount)))
        rows = [error_row("kr5", *ours, None)]
        for method in METHODS:
            theirs = errors(calibration.evaluate_hand_eye_method(views, camera, peer_method(method, mount), mount))
            rows.append(error_row(method, *theirs, ours))
        title = f"{name}: {len(views)} views, each left out in turn"
        print_errors(title, rows)
        lines += compared_rows(name, rows, "not significantly worse than any", not_worse, False)
        out[name] = {"views": len(views), "rows": rows}
    return out


# Synthetic -----------------------------------------------------------------------------------------------------------


def synthetic(rng: np.random.Generator, mount: str, count: int = 15) -> tuple:
    camera = kr5.Pinhole(width=1280, height=960, fx=1100, fy=1098, cx=645, cy=478, k1=-0.12, k2=0.05)
    points = grid(6, 9, 0.03)
    around = lambda middle: kr5.to_pose(np.array(middle)) @ kr5.to_pose(rng.normal(0, [0.03] * 3 + [0.1] * 3))
    if mount == "eye_in_hand":
        X, Z = around([0.05, -0.03, 0.08, 0.1, -0.15, 1.6]), around([0.7, 0.1, 0.05, 3.1, 0.05, 0.4])
    else:
        X, Z = around([1.2, 0.3, 0.6, -1.8, 0.1, 1.2]), around([0.02, -0.04, 0.09, 0.1, 0.05, -0.7])
    views: list = []
    while len(views) < count:
        way, tilt, z = rng.uniform(0, 2 * np.pi), 0.6 * np.sqrt(rng.uniform()), rng.uniform(0.45, 0.8)
        M = np.eye(4)
        M[:3, :3] = kr5.exp_rotation(tilt * np.array([np.cos(way), np.sin(way), 0])) @ kr5.exp_rotation(
            np.array([0, 0, rng.uniform(-2.5, 2.5)])
        )
        M[:3, 3] = np.array([rng.uniform(-0.3, 0.3) * z, rng.uniform(-0.25, 0.25) * z, z]) - M[:3, :3] @ points.mean(1)
        pixels = camera.project((M[:3, :3] @ points) + M[:3, 3:])
        if pixels.min() < 5 or pixels[0].max() > 1274 or pixels[1].max() > 954:
            continue
        S = Z @ np.linalg.inv(M) @ np.linalg.inv(X)
        T = S if mount == "eye_in_hand" else np.linalg.inv(S)
        T = T @ kr5.to_pose(rng.normal(0, [POSITION_NOISE] * 3 + [ROTATION_NOISE] * 3))
        view = kr5.View(
            name=str(len(views)),
            points=points,
            pixels=pixels + rng.normal(0, PIXEL_NOISE, pixels.shape),
            ids=list(range(54)),
        )
        views.append(calibration.HandEyeView(T_base_flange=T, view=view))
    return views, camera, X


def target_pose(view: kr5.View, camera: kr5.Pinhole) -> np.ndarray:
    K = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    lens = np.array([camera.k1, camera.k2, camera.p1, camera.p2])
    _, rotation, translation = cv2.solvePnP(
        np.ascontiguousarray(view.points.T), np.ascontiguousarray(view.pixels.T), K, lens
    )
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = cv2.Rodrigues(rotation)[0], translation.ravel()
    return T


def adjoint(T: np.ndarray) -> np.ndarray:
    """Moves a right perturbation of the identity behind T: exp(adjoint(T) x) T = T exp(x)."""
    x, y, z = T[:3, 3]
    out = np.kron(np.eye(2), T[:3, :3])
    out[:3, 3:] = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ T[:3, :3]
    return out


def target_covariance(view: kr5.View, camera: kr5.Pinhole, M: np.ndarray) -> np.ndarray:
    """Of the target's pose in the camera, from the pixel noise alone; right perturbation."""

    def pixels(step: np.ndarray) -> np.ndarray:
        T = M @ kr5.to_pose(step)
        return camera.project(T[:3, :3] @ view.points + T[:3, 3:]).ravel()

    J = np.array([(pixels(step) - pixels(-step)) / 2e-6 for step in 1e-6 * np.eye(6)]).T
    return PIXEL_NOISE**2 * np.linalg.inv(J.T @ J)


def min_covariance(views: list, camera: kr5.Pinhole, X: np.ndarray, targets: list, mount: str) -> np.ndarray:
    """Cramer-Rao bound of the camera's pose: noise levels known, the fixed target's pose unknown."""
    robot = np.diag([POSITION_NOISE**2] * 3 + [ROTATION_NOISE**2] * 3)
    sign = 1 if mount == "eye_in_hand" else -1
    Z = np.linalg.inv(views[0].T_base_flange) @ X @ targets[0]  # of the target on the flange; used eye to hand only
    information = np.zeros((12, 12))
    for v, M in zip(views, targets):
        of_target = adjoint(X @ M) if sign > 0 else adjoint(Z)
        of_camera = adjoint(X) if sign > 0 else adjoint(Z @ np.linalg.inv(M))
        noise = robot + of_target @ target_covariance(v.view, camera, M) @ of_target.T
        J = np.hstack([-sign * of_camera, sign * of_target])
        information += J.T @ np.linalg.solve(noise, J)
    return np.linalg.inv(information)[:6, :6]


def bench_synthetic(trials: int, lines: list[comparison.Row]) -> dict:
    out = {}
    for mount in ("eye_in_hand", "eye_to_hand"):
        errors: dict[str, list] = {name: [] for name in ("kr5", *METHODS)}
        least = []
        for trial in comparison.progress(range(trials), f"Synthetic, {mount}"):
            views, camera, X = synthetic(np.random.default_rng(trial), mount)
            found = {
                "kr5": calibration.calibrate_hand_eye(
                    views, camera, calibration.HandEyeOptions(mount=mount)
                ).T_mount_camera
            }
            targets = [target_pose(v.view, camera) for v in views]
            found |= {m: peer_method(m, mount)(views, targets) for m in METHODS}
            least.append(np.diag(min_covariance(views, camera, X, targets, mount)))
            for name, T in found.items():
                d = kr5.pose_difference(X, T) if np.isfinite(T).all() else np.full(6, np.nan)
                errors[name].append((np.linalg.norm(d[:3]), np.linalg.norm(d[3:])))
        arrays = {name: np.array(e).T for name, e in errors.items()}
        rows = [error_row(name, a[0], a[1], None if name == "kr5" else arrays["kr5"]) for name, a in arrays.items()]
        title = f"synthetic, {mount}: 15 views, 3 mm and 0.3 deg robot noise, {trials} trials, error of the camera pose"
        bound = np.sqrt(np.mean(least, axis=0).reshape(2, 3).sum(1)) * (1e3, 180 / np.pi)
        rows.append({"method": "bound", "position_mm": bound[0], "rotation_deg": bound[1]})
        print_errors(title, rows)
        rows, what = rows[:-1], f"synthetic, {mount}: no method below {bound[0]:.3g} mm, {bound[1]:.3g} deg"
        lines += compared_rows(what, rows, "20 % lower than each: ratio at most 0.8", fifth_lower, True)
        out[mount] = {"trials": trials, "rows": rows, "bound": {"position_mm": bound[0], "rotation_deg": bound[1]}}
    return out


def main() -> None:
    parser = arguments.parser(__doc__, reference=True, json=True)
    parser.add_argument("--trials", type=int, default=300)
    given = parser.parse_args()
    lines: list[comparison.Row] = []
    result = {"real": bench_real(given.reference, lines), "synthetic": bench_synthetic(given.trials, lines)}
    comparison.print_comparisons(lines, "Hand-eye, ours beside the best other")
    if given.json:
        given.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
