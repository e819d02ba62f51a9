"""Kinematic calibration of real arms on postures that were not fitted, beside plain least squares of every parameter.

    python tools/benchmarks/kinematics.py [--quick]

UR5 and WAM under a laser tracker, Pandas and a KUKA iiwa with a ball in sockets, UR10 before a camera and TIAGo under
motion capture. The peer under the tracker is scipy's least squares of all DH parameters (Hayati's angle too), base and
tool, without a prior and without a loss, on the same postures. Sockets of one place are fitted, those of the others
judge. UR10 and TIAGo are predicted posture by posture beside FIGAROH itself, at the best of its settings.
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
import figaroh_peer
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
    T = [result.T_world_base @ result.flange(p.q, p.torques) for p in postures]
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
            figure=f"{name} DH",
            ratio=theirs.mean() / ours.mean(),
        )
    ]


def compare_residual_parts(data: Path) -> comparison.Row:
    """What the error of the WAM is made of: models compared on the postures left out. The torques of gravity are those
    of a load at the tip, since the data hold no masses; the compliances take their size."""
    chain = dh_arm(sets.NOMINAL["WAM"][0])
    grid, random = tracker("WAM", "grid", data), tracker("WAM", "random", data)
    bodies = [kinematics.Body(mass=0.0, com=[0, 0, 0], inertia=[0] * 6) for _ in chain.joints]
    bodies[-1] = kinematics.Body(mass=1.0, com=[0, 0, 0], inertia=[0] * 6)
    dynamics = kinematics.Dynamics(chain, bodies)
    for posture in grid + random:
        posture.torques = dynamics.gravity_torques(posture.q)
    models = {
        "nominal": NOMINAL_ONLY,
        "DH": calibration.KinematicsOptions(joint_errors=False),
        "with compliance under gravity": calibration.KinematicsOptions(joint_errors=False, elasticity=True),
        "with joint errors, too": calibration.KinematicsOptions(elasticity=True),
    }
    error, fitted, shift = {}, 0.0, 0.0
    for name, options in models.items():
        result = calibration.calibrate_kinematics(chain, grid, options=options)
        error[name] = 1e3 * errors(our_places(result, random), random)
        fitted = float(1e3 * errors(our_places(result, grid), grid).mean())
        off = our_places(result, random) - np.array([p.points for p in random])
        shift = float(1e3 * np.linalg.norm(off.mean(axis=0)))
    d = comparison.mean_difference(error["with joint errors, too"], error["DH"])
    return comparison.Row(
        f"WAM, models compared: mean error on {len(random)} others",
        ", ".join(f"{name} {e.mean():.2f} mm" for name, e in error.items()),
        "all parts below DH alone",
        d.high < 0,
        f"fitted postures {fitted:.2f} mm; the {len(random)} are shifted as a whole by {shift:.2f} mm",
        d.text("mm"),
        figure="WAM DH",
    )


def compare_choice(data: Path, draws: int) -> comparison.Row:
    """Sixty postures chosen among the grid, before any of them is measured."""
    rows, tool = sets.NOMINAL["UR5"]
    chain = dh_arm(rows)
    grid, random = tracker("UR5", "grid", data), tracker("UR5", "random", data)
    wanted = calibration.PostureChoiceOptions(point=[0, 0, tool])
    chosen = [grid[i] for i in calibration.choose_postures(chain, [p.q for p in grid], wanted).chosen]
    error = 1e3 * errors(our_places(calibration.calibrate_kinematics(chain, chosen), random), random)
    dice = np.random.default_rng(1)
    blind = []
    for _ in range(draws):
        some = [grid[i] for i in dice.choice(len(grid), len(chosen), replace=False)]
        blind.append(1e3 * errors(our_places(calibration.calibrate_kinematics(chain, some), random), random).mean())
    return comparison.Row(
        f"UR5, {len(chosen)} postures chosen of {len(grid)}: mean error on {len(random)} others",
        f"{error.mean():.4f} mm",
        "0.105 mm",
        bool(error.mean() <= 0.105),
        f"as many at random {np.median(blind):.4f} mm (median of {draws})",
        comparison.mean_interval(error).text("mm", ".3g"),
        figure="UR5 DH",
        ratio=np.median(blind) / error.mean(),
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
        comparison.mean_interval(error).text("mm", ".3g"),
        figure="socket self-calibration",
        ratio=wanted / error.mean(),
    )


def ur10_postures(data: Path) -> tuple[Any, Postures]:
    """Poses of a camera's target on the flange of a UR10."""
    folder = data / "geo_ur10_figaroh"
    chain = cell.import_urdf(folder / "ur10_robot.urdf", tip="wrist_3_link").cell.nominal_chain()
    log = np.genfromtxt(folder / "calibration.csv", delimiter=",", skip_header=1)
    T = calibration.to_poses(log[:, :6], calibration.PoseFormat(rotation="rpy"))
    return chain, [calibration.ArmPosture(name=str(i), q=r[6:12], T_world_tool=T[i]) for i, r in enumerate(log)]


def tiago_postures(data: Path) -> tuple[Any, Postures]:
    """Three markers on the hand of a TIAGo; the fourth repeats the third."""
    urdf = data / "dyn_tiago_figaroh/tiago_no_hand.urdf"
    chain = cell.import_urdf(urdf, tip="arm_7_link").cell.nominal_chain()
    file = data / "geo_tiago_mocap_figaroh/qualysis_base_hand_calibration.csv"
    log = np.genfromtxt(file, delimiter=",", skip_header=1)
    return chain, [
        calibration.ArmPosture(name=str(i), q=r[12:20], points=kr5.points_from_rows(r[:9].reshape(3, 3)))
        for i, r in enumerate(log)
    ]


def place_errors(result: Any, posture: Any) -> float:
    """Distance of the tool, or mean distance of the points, from where it was measured [m]."""
    T = result.T_world_base @ result.flange(posture.q)
    if posture.T_world_tool is not None:
        return float(np.linalg.norm((T @ result.T_flange_tool)[:3, 3] - posture.T_world_tool[:3, 3]))
    return float(np.linalg.norm(T[:3, :3] @ result.points + T[:3, 3:] - posture.points, axis=0).mean())


def ur10_figaroh(data: Path) -> figaroh_peer.Setup:
    folder = data / "geo_ur10_figaroh"
    return figaroh_peer.Setup(
        folder / "ur10_robot.urdf",
        folder / "calibration.csv",
        tool_frame="wrist_3_link",
        reference_joint="wrist_3_joint",
        markers=1,
        poses=True,
        outlier_threshold=0.02,
        example=figaroh_peer.Settings("full_params", "structural"),
    )


def tiago_figaroh(data: Path) -> figaroh_peer.Setup:
    return figaroh_peer.Setup(
        data / "dyn_tiago_figaroh/tiago_no_hand.urdf",
        data / "geo_tiago_mocap_figaroh/qualysis_base_hand_calibration.csv",
        tool_frame="arm_7_link",
        reference_joint="arm_7_joint",
        markers=3,
        poses=False,
        outlier_threshold=0.022,
        example=figaroh_peer.Settings("joint_offset", "structural"),
    )


def figaroh_errors(setup: figaroh_peer.Setup, postures: Postures, tried: list[int]) -> dict[str, np.ndarray]:
    """Error of each posture predicted from all others [m], by the settings of FIGAROH."""
    out = {}
    for settings in figaroh_peer.SETTINGS:
        errors = []
        for i in comparison.progress(tried, f"FIGAROH, {settings.name}"):
            posture = postures[i]
            with figaroh_peer.quiet():
                shown = figaroh_peer.fit(setup, settings, [i])(posture.q)
            seen = posture.points if posture.T_world_tool is None else posture.T_world_tool[:3, 3:]
            errors.append(np.linalg.norm(shown - seen, axis=0).mean())
        out[settings.name] = np.array(errors)
    return out


def compare_figaroh(
    name: str, chain: Any, postures: Postures, setup: figaroh_peer.Setup, tried: list[int]
) -> list[comparison.Row]:
    """Each posture predicted from all others, beside FIGAROH with the settings of its own example of the arm, and with
    the best of its settings as judged by these predictions, which favours it."""
    ours = []
    for i in comparison.progress(tried, name):
        result = calibration.calibrate_kinematics(
            chain, postures[:i] + postures[i + 1 :], options=calibration.KinematicsOptions(joint_errors=False)
        )
        ours.append(1e3 * place_errors(result, postures[i]))
    theirs = {key: 1e3 * values for key, values in figaroh_errors(setup, postures, tried).items()}
    best = min(theirs, key=lambda key: theirs[key].mean())
    rows = []
    for which, key in (("as in its example", setup.example.name), (f"best of {len(theirs)} settings", best)):
        d = comparison.mean_difference(np.array(ours), theirs[key])
        rows.append(
            comparison.Row(
                f"{name}, {len(tried)} of {len(postures)} postures left out one by one: mean error",
                f"{np.mean(ours):.3f} mm",
                f"below FIGAROH's fit, {which}",
                d.high < 0,
                f"FIGAROH {figaroh_peer.version()}, {key}: {theirs[key].mean():.3f} mm",
                d.text("mm"),
                figure="pose calibration",
                ratio=theirs[key].mean() / np.mean(ours),
            )
        )
    return rows


def compare_time(data: Path, quick: bool) -> list[comparison.Row]:
    """A thousand postures, thirty parameters. Least squares with numerical derivatives takes a minute and more."""
    chain = dh_arm(sets.NOMINAL["UR5"][0])
    grid = tracker("UR5", "grid", data)
    times = []
    for _ in range(5):
        start = time.perf_counter()
        calibration.calibrate_kinematics(chain, grid, options=calibration.KinematicsOptions(joint_errors=False))
        times.append(time.perf_counter() - start)
    ours = float(np.median(times))
    peers = {}
    if not quick:
        start = time.perf_counter()
        plain_fit(chain, grid)
        peers["least squares with numerical derivatives"] = time.perf_counter() - start
    if (by_pybotics := pybotics_time(chain, grid)) is not None:
        peers["pybotics"] = by_pybotics
    judge = peers.get("pybotics", 0.0)
    text = ", ".join(f"{name} {seconds:.1f} s, {seconds / ours:.0f} times" for name, seconds in peers.items())
    what = f"{len(grid)} postures, noise and spread estimated: time"
    spread = f"[{min(times):.2f}, {max(times):.2f}] s of 5 runs"
    return [
        comparison.Row(what, f"{ours:.2f} s", "0.3 s", ours <= 0.3, text, spread, figure="refinement"),
        comparison.Row(
            f"{what}, against pybotics",
            f"{ours:.2f} s",
            "10 times faster",
            judge >= 10 * ours,
            text if judge else "pybotics is not installed (pip install --no-deps pybotics attrs)",
            figure="refinement",
            ratio=judge / ours if judge else None,
        ),
    ]


def pybotics_time(chain: Any, postures: Postures) -> float | None:
    """Time of pybotics' own fit of lengths, angles, tool and world frame to the same positions [s]; None where it is
    not installed (it asks for NumPy before 2: pip install --no-deps pybotics attrs)."""
    try:
        from pybotics.kinematic_chain import MDHKinematicChain
        from pybotics.optimization import OptimizationHandler, optimize_accuracy
        from pybotics.robot import Robot
    except ImportError:
        return None
    # Modified rows hold a and alpha of the link before.
    before = [0.0, *(j.a for j in chain.joints[:-1])], [0.0, *(j.alpha for j in chain.joints[:-1])]
    rows = [[alpha, a, 0.0, j.b] for alpha, a, j in zip(before[1], before[0], chain.joints, strict=True)]
    robot = Robot(kinematic_chain=MDHKinematicChain.from_parameters(1e3 * np.array(rows) * [1e-3, 1, 1e-3, 1]))
    handler = OptimizationHandler(
        robot=robot, kinematic_chain_mask=True, tool_mask=[True] * 3 + [False] * 3, world_mask=True
    )
    seen = 1e3 * np.array([p.points[:, 0] for p in postures])
    start = time.perf_counter()
    least_squares(
        optimize_accuracy,
        handler.generate_optimization_vector(),
        args=(handler, np.array([p.q for p in postures]), seen),
        max_nfev=10,
    )
    return time.perf_counter() - start


def main() -> None:
    parser = arguments.parser(__doc__, reference=True)
    parser.add_argument("--quick", action="store_true", help="every eighth posture beside FIGAROH, three random draws")
    given = parser.parse_args()
    data, step = given.reference / "data", 8 if given.quick else 1
    lines = [
        *compare_tracker("UR5", data),
        compare_choice(data, 3 if given.quick else 10),
        *compare_tracker("WAM", data),
        compare_residual_parts(data),
        compare_sockets("panda_1", "panda", ["front"], ["right", "back-high"], 0.347, data),
        compare_sockets("panda_6", "panda", ["front"], ["left", "right"], 0.254, data),
        compare_sockets("kuka_14", "iiwa14", ["front"], ["left_back", "raised_left"], 0.26, data),
    ]
    for name, (chain, postures), setup in (
        ("UR10 before a camera", ur10_postures(data), ur10_figaroh(data)),
        ("TIAGo under motion capture", tiago_postures(data), tiago_figaroh(data)),
    ):
        lines += compare_figaroh(name, chain, postures, setup, list(range(0, len(postures), step)))
    lines += compare_time(data, given.quick)
    comparison.print_comparisons(lines, "Kinematic calibration")


if __name__ == "__main__":
    main()
