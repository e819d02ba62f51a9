"""Sobol's indices beside SALib and OpenTURNS, and the uncertainty cases of the book.

    python tools/benchmarks/sensitivity.py

The model is the KR5 of Hayat et al. 2022, Table 3.1, with all 24 Denavit-Hartenberg parameters off at the pose of their
case 1. SALib's chain is its sample, forward kinematics in NumPy over all samples at once, and its analysis; the same
samples go through kr5. One core each. How often intervals hold the truth is counted on Ishigami's function.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from kr5 import cell, kinematics, uncertainty
from SALib.analyze import sobol as salib_analysis
from SALib.sample import sobol as salib_sample

import arguments
import comparison
from kr5_tools.uncertainty.camera_matrix import camera_matrix_result, load_scene

SHARE = Path(__file__).resolve().parents[2] / "share"
HOME = np.radians([0, 70, 12, 0, 0, 0])
SIGMA = {True: 1e-3, False: np.radians(1.0)}  # of lengths [m] and angles [rad]
SAMPLES = 16384
Array = np.ndarray[Any, np.dtype[np.float64]]


def printed_arm() -> Any:
    chain = cell.load_cell(SHARE / "cells/kr5_arc_printed.yaml").nominal_chain()
    return kinematics.DeviatedArm(nominal=chain, parameters=kinematics.joint_parameters(chain), q=HOME)


def arm_inputs(arm: Any) -> list[Any]:
    return [uncertainty.UncertainInput(name=p.label, sigma=SIGMA[p.is_length]) for p in arm.parameters]


def numpy_errors(arm: Any, deviations: Array) -> Array:
    """Errors of the flange, N x 6, in NumPy: 4 x 4 matrices of all samples, joint by joint."""
    from scipy.spatial.transform import Rotation

    def flanges(d: Array) -> Array:
        T = np.broadcast_to(np.asarray(arm.nominal.T_base_0), (len(d), 4, 4))
        for k, joint in enumerate(arm.nominal.joints):
            b, theta, a, alpha = (
                value + d[:, 4 * k + i]
                for i, value in enumerate((joint.b, joint.theta_offset + HOME[k], joint.a, joint.alpha))
            )
            ct, st, ca, sa, zero = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha), np.zeros(len(d))
            rows = [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [zero, sa, ca, b]]
            link = np.moveaxis(np.array([*rows, [zero, zero, zero, zero + 1]]), 2, 0)
            T = T @ link
        return np.asarray(T)

    nominal = flanges(np.zeros((1, deviations.shape[1])))[0]
    T = flanges(deviations)
    turns = Rotation.from_matrix(T[:, :3, :3] @ nominal[:3, :3].T).as_rotvec()
    return np.hstack([T[:, :3, 3] - nominal[:3, 3], turns])


def salib_problem(inputs: list[Any]) -> dict[str, Any]:
    bounds = [[i.mean - i.truncation * i.sigma, i.mean + i.truncation * i.sigma, i.mean, i.sigma] for i in inputs]
    return {
        "num_vars": len(inputs),
        "names": [i.name for i in inputs],
        "bounds": bounds,
        "dists": ["truncnorm"] * len(inputs),
    }


def salib_indices(problem: dict[str, Any], outputs: Array) -> dict[str, Array]:
    found = [salib_analysis.analyze(problem, y, calc_second_order=False, seed=1) for y in outputs.T]
    return {key: np.column_stack([f[key] for f in found]) for key in ("S1", "ST", "S1_conf", "ST_conf")}


def timed(call: Callable[[], Any], count: int = 1) -> tuple[Any, float]:
    """The result and the median of some times [s]."""
    times = []
    for _ in range(count):
        start = time.perf_counter()
        found = call()
        times.append(time.perf_counter() - start)
    return found, float(np.median(times))


def worst_difference(ours: Any, theirs: dict[str, Array]) -> float:
    """Largest difference of an index, over half of both intervals together."""
    worst = 0.0
    for value, high, key in ((ours.first, ours.first_high, "S1"), (ours.total, ours.total_high, "ST")):
        half = np.hypot(high - value, theirs[f"{key}_conf"])
        worst = max(worst, float((np.abs(value - theirs[key]) / np.maximum(half, 1e-6)).max()))
    return worst


def compare_salib(samples: int) -> list[comparison.Row]:
    arm = printed_arm()
    inputs = arm_inputs(arm)
    options = uncertainty.SobolOptions(samples=samples, resolution=1e-12)
    problem = salib_problem(inputs)
    X, sampling = timed(lambda: salib_sample.sample(problem, samples, calc_second_order=False, seed=1))
    outputs, evaluation = timed(lambda: numpy_errors(arm, X))
    theirs, analysis = timed(lambda: salib_indices(problem, outputs))
    own_outputs, own_evaluation = timed(lambda: arm.errors(X), 3)
    same, own_analysis = timed(lambda: uncertainty.sobol_estimate(own_outputs, inputs, options), 3)
    own, own_all = timed(lambda: uncertainty.sobol_indices(arm.errors, inputs, options), 3)
    on_same = max(float(np.abs(same.first - theirs["S1"]).max()), float(np.abs(same.total - theirs["ST"]).max()))
    ratio = (evaluation + analysis) / (own_evaluation + own_analysis)
    whole = (sampling + evaluation + analysis) / own_all
    apart = worst_difference(own, theirs)
    what = f"KR5, 24 parameters, 6 outputs, N = {samples}"
    return [
        comparison.Row(
            f"{what}: largest difference of an index on the same samples",
            f"{on_same:.1e}",
            "below 1e-6",
            on_same < 1e-6,
            f"SALib; outputs differ by {np.abs(outputs - own_outputs).max():.0e} m or rad",
            figure="Sobol of 24 KR5 parameters",
        ),
        comparison.Row(
            f"{what}: largest difference of an index on samples of its own, over both intervals",
            f"{apart:.2f}",
            "288 differences, each above 1 in 1 of 20: below 2",
            apart < 2,
            "SALib",
            figure="Sobol of 24 KR5 parameters",
        ),
        comparison.Row(
            f"{what}: evaluation and indices, the same samples",
            f"{own_evaluation + own_analysis:.2f} s",
            "30 times SALib + NumPy",
            ratio >= 30,
            f"{evaluation:.1f} + {analysis:.1f} s, {ratio:.0f} times",
            figure="Sobol of 24 KR5 parameters",
            ratio=ratio,
        ),
        comparison.Row(
            f"{what}: samples, evaluation and indices",
            f"{own_all:.2f} s",
            "30 times SALib + NumPy",
            whole >= 30,
            f"{sampling + evaluation + analysis:.1f} s, {whole:.0f} times",
            figure="Sobol of 24 KR5 parameters",
            ratio=whole,
        ),
        *compare_openturns(arm, inputs, own, own_all, samples),
    ]


def compare_openturns(arm: Any, inputs: list[Any], own: Any, own_time: float, samples: int) -> list[comparison.Row]:
    import openturns as ot

    normals = [
        ot.TruncatedNormal(i.mean, i.sigma, i.mean - i.truncation * i.sigma, i.mean + i.truncation * i.sigma)
        for i in inputs
    ]

    def run() -> tuple[dict[str, Array], Any]:
        design = ot.SobolIndicesExperiment(ot.JointDistribution(normals), samples, False).generate()
        outputs = numpy_errors(arm, np.array(design))
        found = ot.SaltelliSensitivityAlgorithm(design, ot.Sample(outputs), samples)
        found.setUseAsymptoticDistribution(True)
        first, total = (
            np.column_stack([np.array(get(k)) for k in range(6)])
            for get in (found.getFirstOrderIndices, found.getTotalOrderIndices)
        )
        return {"S1": first, "ST": total}, found

    (theirs, _), seconds = timed(run)
    # OpenTURNS gives intervals of the mean over the outputs; random rows would scatter by sqrt(2 S / N) at most.
    spread = 1.96 * np.sqrt(2.0 / samples)
    apart = worst_difference(own, {**theirs, "S1_conf": spread, "ST_conf": spread})
    return [
        comparison.Row(
            f"KR5, 24 parameters, 6 outputs, N = {samples}: OpenTURNS, own samples",
            f"{apart:.2f} of both intervals; {own_time:.2f} s",
            "below 2",
            apart < 2,
            f"{seconds:.1f} s, {seconds / own_time:.0f} times",
            figure="Sobol of 24 KR5 parameters",
            ratio=seconds / own_time,
        )
    ]


def ishigami(x: Array) -> Array:
    return np.asarray((np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0]))[:, None])


def compare_coverage(trials: int) -> list[comparison.Row]:
    """How often intervals of Ishigami's indices hold the truth, and how wide they are."""
    V = 49 / 8 + 0.1 * np.pi**4 / 5 + 0.01 * np.pi**8 / 18 + 0.5
    both = 0.01 * np.pi**8 * (1 / 18 - 1 / 50) / V
    first = np.array([0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2 / V, 49 / 8 / V, 0.0])
    truth = np.concatenate([first, first + np.array([both, 0, both])])
    inputs = [uncertainty.UncertainInput(name=f"x{k}", law="uniform", low=-np.pi, high=np.pi) for k in range(3)]
    problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[-np.pi, np.pi]] * 3}
    hits, theirs, widths = 0, 0, []
    for trial in comparison.progress(range(trials), "Ishigami"):
        k = trial % 6  # one of them each time: those of one run are not independent
        own = uncertainty.sobol_indices(ishigami, inputs, uncertainty.SobolOptions(samples=1024, seed=trial + 1))
        value = np.concatenate([own.first[:, 0], own.total[:, 0]])
        half = np.concatenate([own.first_high[:, 0], own.total_high[:, 0]]) - value
        hits += int(abs(value[k] - truth[k]) <= half[k])
        X = salib_sample.sample(problem, 1024, calc_second_order=False, seed=trial + 1)
        peer = salib_analysis.analyze(problem, ishigami(X)[:, 0], calc_second_order=False, seed=trial + 1)
        at = np.concatenate([peer["S1"], peer["ST"]]), np.concatenate([peer["S1_conf"], peer["ST_conf"]])
        theirs += int(abs(at[0][k] - truth[k]) <= at[1][k])
        widths.append(half[k] / at[1][k])
    low, high = comparison.exact_interval(hits, trials)
    return [
        comparison.Row(
            f"Ishigami, N = 1024, {trials} trials: 95 % intervals that hold the truth",
            f"{hits / trials:.3f}",
            "0.93 to 0.97",
            low <= 0.97 and high >= 0.93 and 0.92 <= hits / trials <= 0.98,
            f"SALib {comparison.format_rate(theirs, trials)}; ours are {np.median(widths):.2f} times as wide",
            comparison.format_rate(hits, trials),
            figure="coverage",
        )
    ]


def compare_book() -> list[comparison.Row]:
    scene = load_scene(None, None, None, None)
    found = camera_matrix_result(scene, 1000, 1, False, 0.95)["result"]
    x, z = found["mm_per_pixel"]
    slopes = [
        np.sqrt(np.diag(next(c for c in r.corners if np.allclose(c.point, found["corner"])).simulated))[[0, 2]] / noise
        for r, noise in zip(found["results"], found["noise"])
    ]
    bend = float(np.abs(np.array(slopes) / slopes[0] - 1).max())
    axes, _ = uncertainty.confidence_ellipsoid(np.eye(3), 0.95)
    return [
        comparison.Row(
            "Camera matrix, 0.05 to 1 px: deviation per pixel, change over the noise",
            f"{100 * bend:.2f} %",
            "linear: below 2 %",
            bend < 0.02,
            "Table 3.5: 1.4 %",
        ),
        comparison.Row(
            "Camera matrix: X / Z at the middle corner, per pixel",
            f"{x:.4f} / {z:.4f} mm",
            "1.40 / 1.26 mm (Table 3.5; board and distance not given)",
            abs(x - 1.4) < 0.07 and abs(z - 1.26) < 0.07,
            "book 1.40 / 1.26 mm",
        ),
        comparison.Row(
            "Ellipsoid of three coordinates at 95 %: standard deviations",
            f"{axes[0]:.4f}",
            "2.7955",
            abs(axes[0] - 2.7955) < 1e-4,
            "eq. 3.15",
        ),
    ]


def main() -> None:
    parser = arguments.parser(__doc__)
    parser.add_argument("--samples", type=int, default=SAMPLES, help="rows of the sample matrices, a power of two")
    parser.add_argument("--trials", type=int, default=2000, help="of the coverage")
    given = parser.parse_args()
    lines = [*compare_salib(given.samples), *compare_coverage(given.trials), *compare_book()]
    comparison.print_comparisons(lines, "Sensitivity and uncertainty")


if __name__ == "__main__":
    main()
