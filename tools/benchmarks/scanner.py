"""Line scanner on the flange, and repeatability after ISO 9283.

    python tools/benchmarks/scanner.py [--arms 25] [--trials 2000]

Scanner: three points without noise; a tip before an arm that is off by millimetres, with the arm nominal and refined
in the same solve, each arm drawn anew (Hayat et al. 2022, section 2.2.4); the error against stand-off as
`kr5 calibrate laser-study` finds it (section 3.5). Repeatability: how often its bounds hold the true figure
(appendix B.4).
"""

from pathlib import Path
from typing import Any

import kr5
import numpy as np
from kr5 import calibration, cell, kinematics
from scipy.optimize import least_squares

import arguments
import comparison

CELL = Path(__file__).resolve().parents[2] / "share/cells/kr5_arc.yaml"
SCANNER = kr5.to_pose([0.114, 0.046, 0.340, 3.0, 0.2, -0.5])
HOME = np.array([0.0, 0.02, -2.75, 0.0, -0.3, 1.571])
NOISE = 2e-5  # of the tip in a profile [m]
FITTED, JUDGED = 100, 25  # profiles of one arm
STAND_OFFS = (0.185, 0.190, 0.195, 0.200)  # [m]
SCAN_SPEED = 0.01  # [m/s]
ISO_POINTS, ISO_RETURNS = 5, 30
LIMIT = 1e-3  # of the error at these stand-offs [m]


def compare_three_points(trials: int = 200) -> comparison.Row:
    random = np.random.default_rng(1)
    errors = []
    for _ in range(trials):
        T = kr5.to_pose([*random.normal(0, 0.2, 3), *random.normal(0, 1, 3)])
        seen = np.array([random.uniform(-0.03, 0.03, 3), random.uniform(0.16, 0.22, 3)])
        on_flange = T[:3, :3] @ np.array([seen[0], np.zeros(3), seen[1]]) + T[:3, 3:]
        found = calibration.scanner_from_points(seen, on_flange)
        if found.fit.usable:  # three points may lie on a line
            errors.append(np.linalg.norm(kr5.pose_difference(T, found.T_flange_scanner)))
    return comparison.Row(
        f"Scanner from three exact points, {len(errors)} of {trials} draws not on a line: largest error",
        f"{max(errors):.0e}",
        "1e-9 m and rad",
        bool(max(errors) < 1e-9) and len(errors) >= 0.98 * trials,
        figure="line scanner",
    )


def deviated(chain: Any, random: np.random.Generator) -> Any:
    """An arm that is off by millimetres and milliradians."""
    joints = [
        kinematics.DhJoint(
            type=joint.type,
            b=joint.b + random.normal(0, 1e-3),
            theta_offset=joint.theta_offset + random.normal(0, 2e-3),
            a=joint.a + random.normal(0, 1e-3),
            alpha=joint.alpha + random.normal(0, 2e-3),
        )
        for joint in chain.joints
    ]
    return kinematics.DhChain(joints, chain.T_base_0)


def tip_views(nominal: Any, real: Any, tip: np.ndarray, count: int, random: np.random.Generator) -> list[Any]:
    """Profiles of a tip, with the flange where the nominal arm believes it."""
    views: list[Any] = []
    while len(views) < count:
        wrist = HOME[3:] + random.normal(0, 0.35, 3)
        wanted = np.array([random.uniform(-0.015, 0.015), 0.0, random.uniform(0.18, 0.2)])

        def miss(arm: np.ndarray, wrist: np.ndarray = wrist, wanted: np.ndarray = wanted) -> np.ndarray:
            T = np.linalg.inv(real.flange(np.append(arm, wrist)) @ SCANNER)
            return np.asarray((T @ np.append(tip, 1))[:3] - wanted)

        found = least_squares(miss, HOME[:3], xtol=1e-14, gtol=1e-14)
        q = np.append(found.x, wrist)
        if np.abs(found.fun).max() > 1e-10 or np.abs(q - HOME).max() > 2:
            continue
        x, z = wanted[[0, 2]] + random.normal(0, NOISE, 2)
        feature = calibration.ProfileFeature()
        feature.points = np.array([[x], [z]])
        feature.covariance = NOISE**2 * np.eye(2)
        feature.fit.status = kr5.FitStatus.Converged
        views.append(
            calibration.ScannerView(
                name=str(len(views)), target="pin", q=q, T_base_flange=nominal.flange(q), feature=feature
            )
        )
    return views


def compare_tip(arms: int) -> list[comparison.Row]:
    nominal = cell.load_cell(CELL).nominal_chain()
    before, after = [], []
    for number in comparison.progress(range(arms), "Arms"):
        random = np.random.default_rng([2, number])
        real = deviated(nominal, random)
        tip = (real.flange(HOME) @ SCANNER @ [0, 0, 0.19, 1])[:3]
        fitted, judged = (tip_views(nominal, real, tip, n, random) for n in (FITTED, JUDGED))
        targets = [calibration.ScanTarget(name="pin", kind="tip", position=tip)]
        plain = calibration.calibrate_scanner(fitted, targets)
        refined = calibration.calibrate_scanner(fitted, targets, arm=nominal)
        off = []
        for result, arm in ((plain, nominal), (refined, refined.arm)):
            shown = [
                (arm.flange(v.q) @ result.T_flange_scanner @ [v.feature.points[0, 0], 0, v.feature.points[1, 0], 1])[:3]
                for v in judged
            ]
            off.append(1e3 * np.linalg.norm(np.array(shown) - tip, axis=1).mean())
        before.append(off[0])
        after.append(off[1])
    gain = comparison.mean_difference(before, after)
    return [
        comparison.Row(
            f"{arms} deviated arms, tip in {JUDGED} further profiles: mean error with the arm refined",
            f"{np.mean(after):.3f} mm",
            "below the nominal arm's",
            gain.low > 0,
            f"nominal arm {np.mean(before):.3f} mm; the book gains 1.5 mm",
            comparison.mean_difference(after, before).text("mm"),
            figure="line scanner",
            ratio=np.mean(before) / np.mean(after),
        )
    ]


def compare_stand_off() -> comparison.Row:
    scanned = cell.load_cell(CELL)
    options = calibration.ScanErrorOptions(bias=2e-4, delay=6e-3, passes=12, seed=1)
    found = [calibration.simulate_scan_error(scanned, at, SCAN_SPEED, options) for at in STAND_OFFS]
    error = max(one.as_stamped.centre for one in found)
    return comparison.Row(
        "Place of a simulated sphere at stand-offs of 185 to 200 mm: largest error",
        f"{1e3 * error:.3f} mm",
        "1 mm",
        error < LIMIT,
        "book 1 mm",
        figure="line scanner",
        ratio=LIMIT / error,
    )


def compare_repeatability(trials: int) -> comparison.Row:
    """RP of five points together, a scatter of 0.1 mm per axis (Maxwell's distribution)."""
    sigma = 1e-4
    truth = sigma * (2 * np.sqrt(2 / np.pi) + 3 * np.sqrt(3 - 8 / np.pi))
    options = calibration.RepeatabilityOptions(simulations=600)
    hits, values = 0, []
    for trial in comparison.progress(range(trials), "Repeatability"):
        random = np.random.default_rng([3, trial])
        returns = [
            calibration.PoseReturn(point=f"P{p}", T=kr5.to_pose(np.append(random.normal(0, sigma, 3), [0, 0, 0.1 * p])))
            for p in range(ISO_POINTS)
            for _ in range(ISO_RETURNS)
        ]
        found = calibration.measure_repeatability(returns, options=options).overall.RP
        hits += found.low <= truth <= found.high
        values.append(1e3 * found.value)
    low, high = comparison.exact_interval(hits, trials)
    rate = hits / trials
    return comparison.Row(
        f"RP of {ISO_POINTS} x {ISO_RETURNS} returns, true {1e3 * truth:.4f} mm, {trials} trials: bounds hold it",
        f"{rate:.3f}; mean RP {np.mean(values):.4f} mm",
        "0.93 to 0.97",
        0.93 <= rate <= 0.97 if trials >= 2000 else low <= 0.97 and high >= 0.93,
        interval=comparison.format_rate(hits, trials),
        figure="ISO 9283 repeatability",
    )


def main() -> None:
    parser = arguments.parser(__doc__)
    parser.add_argument("--arms", type=int, default=25, help="deviated arms")
    parser.add_argument("--trials", type=int, default=2000, help="tests of repeatability")
    given = parser.parse_args()
    rows = [compare_three_points(), *compare_tip(given.arms), compare_stand_off(), compare_repeatability(given.trials)]
    comparison.print_comparisons(rows, "Line scanner and repeatability")


if __name__ == "__main__":
    main()
