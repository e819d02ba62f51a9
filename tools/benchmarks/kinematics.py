"""Kinematic calibration of real arms on postures that were not fitted, beside plain least squares of every parameter.

    python tools/benchmarks/kinematics.py

UR5 and WAM under a laser tracker, Pandas and a KUKA iiwa with a ball in sockets. The peer under the tracker is scipy's
least squares of all DH parameters (Hayati's angle too), base and tool, without a prior and without a loss, on the same
postures. Sockets of one place are fitted, those of the others judge.
"""

import itertools
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import kr5
import numpy as np
from kr5 import calibration, cell, kinematics
from scipy.optimize import least_squares

import arguments
import comparison
import real_arms_sets as sets

Postures = list[Any]
NOMINAL_ONLY = calibration.KinematicsOptions(tolerance_length=1e-9, tolerance_angle=1e-9, joint_errors=False)


def tracker(name: str, part: str, data: Path) -> Postures:
    """Commanded joint angles with the tracked place: target plus difference."""
    log = np.genfromtxt(
        data / f"geo_ur5_wam_lasertracker/3D_{name}_uncalibrated_{part}_cleaned.csv", delimiter=",", names=True
    )
    n = len(sets.NOMINAL[name][0])
    q = np.radians(np.column_stack([log[f"joint_{k + 1}"] for k in range(n)]))
    seen = 1e-3 * np.column_stack([log[f"{a}_t"] + log[f"{a}_dif"] for a in "xyz"])
    return [calibration.ArmPosture(name=str(i), q=q[i], points=seen[i][:, None]) for i in range(len(q))]


def dh_arm(rows: list[tuple[float, float, float]]) -> Any:
    return kinematics.DhChain([kinematics.DhJoint(b=b, a=a, alpha=alpha) for b, a, alpha in rows])


def plain_fit(chain: Any, postures: Postures) -> Callable[[Any], np.ndarray]:
    """Least squares of all parameters; where the fitted points of a posture are [world, n x 3]."""
    n = len(chain.joints)
    q = np.array([p.q for p in postures])
    seen = np.array([p.points for p in postures])  # N x 3 x markers
    markers = seen.shape[2]

    def build(x: np.ndarray) -> Any:
        joints = [
            kinematics.DhJoint(
                type=j.type,
                b=j.b + d[0],
                theta_offset=j.theta_offset + d[1],
                a=j.a + d[2],
                alpha=j.alpha + d[3],
                beta=j.beta + d[4],
            )
            for j, d in zip(chain.joints, x[: 5 * n].reshape(n, 5), strict=True)
        ]
        return kinematics.DhChain(joints, chain.T_base_0)

    def places(x: np.ndarray, values: np.ndarray) -> np.ndarray:
        T = build(x).flanges(values)
        points = x[5 * n + 6 :].reshape(3, markers)
        on_base = T[:, :3, :3] @ points + T[:, :3, 3:]
        base = kr5.to_pose(x[5 * n : 5 * n + 6])
        return np.asarray(base[:3, :3] @ on_base + base[:3, 3:])

    first = calibration.calibrate_kinematics(
        chain,
        postures,
        options=calibration.KinematicsOptions(tolerance_length=1e-9, tolerance_angle=1e-9, joint_errors=False),
    )
    start = np.concatenate([np.zeros(5 * n), kr5.to_vector(first.T_world_base), first.points.ravel()])
    found = least_squares(lambda x: np.nan_to_num(places(x, q) - seen).ravel(), start, method="trf", x_scale="jac")
    return lambda some: np.asarray(places(found.x, np.array([p.q for p in some])))


def errors(places: np.ndarray, postures: Postures) -> np.ndarray:
    """Mean distance of the points of each posture [m]."""
    seen = np.array([p.points for p in postures])
    return np.nanmean(np.linalg.norm(places - seen, axis=1), axis=1)


def our_places(result: Any, postures: Postures) -> np.ndarray:
    T = [result.T_world_base @ result.flange(p.q) for p in postures]
    return np.array([t[:3, :3] @ result.points + t[:3, 3:] for t in T])


def compare_tracker(name: str, data: Path) -> list[comparison.Row]:
    """All postures of the grid, judged on the random ones."""
    chain = dh_arm(sets.NOMINAL[name][0])
    grid, random = tracker(name, "grid", data), tracker(name, "random", data)
    result = calibration.calibrate_kinematics(chain, grid)
    ours = 1e3 * errors(our_places(result, random), random)
    theirs = 1e3 * errors(plain_fit(chain, grid)(random), random)
    d = comparison.mean_difference(ours, theirs)
    return [
        comparison.Row(
            f"{name}, {len(grid)} tracked postures: mean error on {len(random)} others",
            f"{ours.mean():.4f} mm",
            "below least squares",
            d.high < 0,
            f"least squares {theirs.mean():.4f} mm",
            d.text("mm"),
        )
    ]


def compare_choice(data: Path) -> comparison.Row:
    """Sixty postures chosen among the grid, before any of them is measured."""
    rows, tool = sets.NOMINAL["UR5"]
    chain = dh_arm(rows)
    grid, random = tracker("UR5", "grid", data), tracker("UR5", "random", data)
    wanted = calibration.PostureChoiceOptions(point=[0, 0, tool])
    chosen = [grid[i] for i in calibration.choose_postures(chain, [p.q for p in grid], wanted).chosen]
    error = 1e3 * errors(our_places(calibration.calibrate_kinematics(chain, chosen), random), random)
    draws = np.random.default_rng(1)
    blind = []
    for _ in range(10):
        some = [grid[i] for i in draws.choice(len(grid), len(chosen), replace=False)]
        blind.append(1e3 * errors(our_places(calibration.calibrate_kinematics(chain, some), random), random).mean())
    return comparison.Row(
        f"UR5, {len(chosen)} postures chosen of {len(grid)}: mean error on {len(random)} others",
        f"{error.mean():.4f} mm",
        "0.105 mm",
        bool(error.mean() <= 0.105),
        f"as many at random {np.median(blind):.4f} mm (median of 10)",
    )


def sockets(robot: str, places: list[str], data: Path) -> Postures:
    """Joint values with the ball in a socket, by place and hole."""
    out = []
    for place, hole in itertools.product(places, (0, 1)):
        q = np.loadtxt(data / f"geo_socket_panda_iiwa/{robot}/{place}/hole_{hole}.csv", delimiter=",")
        out += [calibration.ArmPosture(name=f"{place}:{i}", q=row, socket=f"{place}/{hole}") for i, row in enumerate(q)]
    return out


def socket_distances(places: list[str]) -> list[Any]:
    return [calibration.SocketDistance(first=f"{p}/0", second=f"{p}/1", distance=0.05) for p in places]


def socket_errors(places: list[np.ndarray], postures: Postures) -> np.ndarray:
    """Distance of each computed ball from the mean of its socket [m]."""
    names = np.array([p.socket for p in postures])
    out = np.empty(len(postures))
    for name in set(names):
        ball = np.array(places)[names == name]
        out[names == name] = np.linalg.norm(ball - ball.mean(0), axis=1)
    return out


def ball_places(result: Any, postures: Postures) -> list[np.ndarray]:
    return [(result.flange(p.q) @ np.append(result.points[:, 0], 1))[:3] for p in postures]


def compare_sockets(
    robot: str, model: str, fit: list[str], test: list[str], wanted: float, data: Path
) -> comparison.Row:
    chain = cell.import_urdf(data / f"geo_socket_panda_iiwa/{model}.urdf", tip="ball_link").cell.nominal_chain()
    postures = sockets(robot, fit, data)
    result = calibration.calibrate_kinematics(chain, postures, socket_distances(fit))
    others = sockets(robot, test, data)
    error = 1e3 * socket_errors(ball_places(result, others), others)
    nominal = 1e3 * socket_errors([chain.flange(p.q)[:3, 3] for p in others], others)
    return comparison.Row(
        f"{robot}, ball in sockets at {', '.join(fit)}: mean error at {', '.join(test)}",
        f"{error.mean():.3f} mm (nominal {nominal.mean():.2f})",
        f"below {wanted} mm",
        bool(error.mean() < wanted),
        f"published {wanted} mm",
    )


def compare_time(data: Path) -> comparison.Row:
    """A thousand postures, thirty parameters."""
    chain = dh_arm(sets.NOMINAL["UR5"][0])
    grid = tracker("UR5", "grid", data)
    times = []
    for _ in range(5):
        start = time.perf_counter()
        calibration.calibrate_kinematics(chain, grid, options=calibration.KinematicsOptions(joint_errors=False))
        times.append(time.perf_counter() - start)
    start = time.perf_counter()
    plain_fit(chain, grid)
    peer = time.perf_counter() - start
    ours = float(np.median(times))
    return comparison.Row(
        f"{len(grid)} postures, noise and spread estimated: time",
        f"{ours:.2f} s",
        "0.3 s",
        ours <= 0.3,
        f"least squares with numerical derivatives {peer / ours:.0f} times",
    )


def main() -> None:
    given = arguments.parser(__doc__, reference=True).parse_args()
    data = given.reference / "data"
    lines = [*compare_tracker("UR5", data), compare_choice(data), *compare_tracker("WAM", data)]
    lines += [
        compare_sockets("panda_1", "panda", ["front"], ["right", "back-high"], 0.347, data),
        compare_sockets("panda_6", "panda", ["front"], ["left", "right"], 0.254, data),
        compare_sockets("kuka_14", "iiwa14", ["front"], ["left_back", "raised_left"], 0.26, data),
        compare_time(data),
    ]
    comparison.print_comparisons(lines, "Kinematic calibration")


if __name__ == "__main__":
    main()
