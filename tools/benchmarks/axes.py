"""Axes and Denavit-Hartenberg parameters from joints that turn one at a time.

    python tools/benchmarks/axes.py [--trials 40] [--arms 400]

Exact axes of arms drawn at random, with skew, intersecting, parallel, nearly parallel and opposed neighbours, must give
the arm back. Then the noise study of `kr5 identify study` on the arm of the book, repeated with other seeds: its
devices, arcs and noises are those of Hayat et al. 2022, Table 4.2.
"""

from pathlib import Path
from typing import Any

import kr5
import numpy as np
from kr5 import cell, kinematics

import arguments
import comparison
from kr5_tools.identify import study

CELL = Path(__file__).resolve().parents[2] / "share/cells/kr5_arc.yaml"
NEIGHBOURS = ("skew", "intersecting", "parallel", "nearly parallel", "opposed")
TRIALS_EACH = 2  # identifications with one seed, whose mean square is one value of the interval
# What the book reports, by device and arc [deg]: lengths [mm] and angles [deg], RMS.
BOOK = {("camera", 50.0): (2.4, 0.08), ("laser_tracker", 20.0): (0.45, 0.12), ("laser_tracker", 50.0): (0.45, 0.12)}


def draw_arm(random: np.random.Generator, neighbours: str) -> Any:
    """Six joints, the first two or the second and third axis related as said."""
    joints = []
    for k in range(6):
        joint = kinematics.DhJoint(
            b=random.uniform(-0.5, 0.5),
            theta_offset=random.uniform(-3, 3),
            a=0.0 if neighbours == "intersecting" and k % 2 else random.uniform(0.1, 0.6),
            alpha=random.uniform(0.3, 2.8) * (1 if k % 2 else -1),
        )
        if k == 1 and neighbours in ("parallel", "nearly parallel", "opposed"):
            joint.alpha = {"parallel": 0.0, "nearly parallel": 0.01, "opposed": np.pi}[neighbours]
            joint.beta = -0.02 if neighbours == "nearly parallel" else 0.0
        joints.append(joint)
    return kinematics.DhChain(joints, kr5.to_pose(random.normal(0, 0.8, 6)))


def worst_error(arm: Any, random: np.random.Generator) -> tuple[float, float]:
    """Largest error of the flange in postures other than that of the axes [m, rad], where the free place along and turn
    about the last axis are those of the first posture."""
    q = random.normal(size=6)
    found = kinematics.chain_from_axes(kinematics.axes_of(arm, q), q, arm.flange(q))
    T_found_flange = np.linalg.inv(found.flange(q)) @ arm.flange(q)
    off = []
    for _ in range(5):
        other = random.normal(0, 1.5, 6)
        off.append(kr5.pose_difference(arm.flange(other), found.flange(other) @ T_found_flange))
    errors = np.array(off)
    return float(np.linalg.norm(errors[:, :3], axis=1).max()), float(np.linalg.norm(errors[:, 3:], axis=1).max())


def compare_exact(arms: int) -> comparison.Row:
    random = np.random.default_rng(1)
    errors = [worst_error(draw_arm(random, n), random) for n in NEIGHBOURS for _ in range(arms // len(NEIGHBOURS))]
    length, angle = np.array(errors).max(axis=0)
    return comparison.Row(
        f"{len(errors)} arms from exact axes ({', '.join(NEIGHBOURS)}): largest error in other postures",
        f"{length:.0e} m, {angle:.0e} rad",
        "1e-9 m, 1e-9 rad",
        bool(length <= 1e-9 and angle <= 1e-9),
        "book 1e-6",
        f"largest of {5 * len(errors)} postures",
        figure="dual-vector DH",
    )


def rms_interval(values: np.ndarray) -> comparison.Difference:
    """Root of the mean of squares of independent runs, with Student's interval of that mean."""
    d = comparison.mean_interval(values**2)
    return comparison.Difference(*(float(np.sqrt(max(v, 0.0))) for v in (d.mean, d.low, d.high)))


def compare_devices(trials: int) -> list[comparison.Row]:
    believed = cell.load_cell(CELL)
    chain = believed.nominal_chain()
    limits = believed.robot.limits
    assert limits is not None
    home = np.mean([limits.lower, limits.upper], axis=0)
    rows = []
    for (name, arc), (length, angle) in comparison.progress(list(BOOK.items()), "Devices"):
        found = []
        for seed in range(max(trials // TRIALS_EACH, 2)):
            device = study.make_devices_of(believed, chain.flange(home), 2e-4, seed + 1)[name]
            case = study.simulate(
                chain, home, device, np.radians(arc), device.noise, device.samples, TRIALS_EACH, 1000 * (seed + 1)
            )
            found.append((case["length_rms_mm"], case["angle_rms_deg"], case["refused"]))
        lengths, angles, refused = np.array(found).T
        ours = rms_interval(lengths), rms_interval(angles)
        reached = ours[0].high <= length and ours[1].high <= angle and not refused.any()
        count = TRIALS_EACH * len(found)
        rows.append(
            comparison.Row(
                f"{device.label}, arcs of {arc:.0f} deg, {device.noise:g} {device.unit}, {count} simulated: RMS",
                f"{ours[0].mean:.2f} mm, {ours[1].mean:.3f} deg",
                f"{length:g} mm, {angle:g} deg",
                reached,
                f"book {length:g} mm, {angle:g} deg",
                f"[{ours[0].low:.2f}, {ours[0].high:.2f}] mm, [{ours[1].low:.3f}, {ours[1].high:.3f}] deg",
                figure="camera DH, 50° arc",
                ratio=length / ours[0].mean,
            )
        )
    return rows


def main() -> None:
    parser = arguments.parser(__doc__)
    parser.add_argument("--trials", type=int, default=40, help="identifications of each device and arc")
    parser.add_argument("--arms", type=int, default=400, help="arms from exact axes")
    given = parser.parse_args()
    comparison.print_comparisons([compare_exact(given.arms), *compare_devices(given.trials)], "Axes, one at a time")


if __name__ == "__main__":
    main()
