"""Six simulators of a Kinova MICO2 beside motion capture (`data/simreal_kinova_mico`): where each is wrong, which is
closest.

Of the difference in the path of the hand three parts are taken away one after the other, fitted to the first runs and
judged on the others: the marker sits beside the simulated link (a constant vector), the real arm starts later, and it
moves at another speed. What is left is the path itself; how far the hand hangs too low or too high where it rests is
told apart."""

from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from kr5_tools.cli.tables import make_table

SIMULATORS = ("Mujoco", "PyBullet", "VRepBullet278", "VRepBullet283", "VRepNewton", "VRepVortex")
EXPERIMENTS = {1: ("one joint", 5), 2: ("two joints", 4), 3: ("pushing a cube", 4)}
STEP = 0.05  # [s]


def load(file: Path) -> dict[str, np.ndarray]:
    log = np.genfromtxt(file, delimiter=",", names=True)
    return {name: log[name] for name in log.dtype.names or ()}


def points(log: dict[str, np.ndarray], body: str, scale: float) -> np.ndarray:
    return scale * np.column_stack([log[f"{body}_{axis}"] for axis in "xyz"])


def real_run(folder: Path, experiment: int, run: int) -> tuple[np.ndarray, np.ndarray]:
    """Hand at every step [m], and how far the cube came."""
    log = load(folder / f"real/experiment{experiment}/run{run:02d}.csv")
    hand, cube = points(log, "ee", 1e-3), points(log, "cube", 1e-3)
    t = np.arange(log["t"][0], log["t"][-1], STEP)
    return np.column_stack([np.interp(t, log["t"], x) for x in hand.T]), np.median(cube[-50:], 0) - np.median(
        cube[:50], 0
    )


def replayed(path: np.ndarray, rows: int, start: float, speed: float) -> np.ndarray:
    """A simulated path, begun `start` later and run at `speed`, at the steps of a real run; it rests before and
    after."""
    t = STEP * np.arange(len(path))
    when = speed * (STEP * np.arange(rows) - start)
    return np.column_stack([np.interp(when, t, x) for x in path.T])


def rms(difference: np.ndarray) -> float:
    return float(np.sqrt((difference**2).sum(1).mean()))


def errors(runs: list[np.ndarray], path: np.ndarray, mark: np.ndarray, start: float, speed: float) -> list[float]:
    """RMS distance [m] of each run."""
    return [rms(run - replayed(path, len(run), start, speed) - mark) for run in runs]


def aligned(runs: list[np.ndarray], path: np.ndarray, with_speed: bool) -> tuple[float, float]:
    """Start and speed that fit the runs best, by trying; each run may begin at its own instant."""
    best = (np.inf, 0.0, 1.0)
    mark = np.mean([run[:5].mean(0) for run in runs], axis=0) - path[0]
    for speed in np.arange(0.6, 1.41, 0.01) if with_speed else [1.0]:
        for start in np.arange(0.0, 3.5, STEP):
            error = float(np.mean(errors(runs, path, mark, start, speed)))
            best = min(best, (error, float(start), float(speed)))
    return best[1], best[2]


def begun_together(runs: list[np.ndarray]) -> list[np.ndarray]:
    """Runs cut so that all are 50 mm on their way at the same step: operators started them by hand."""
    first = [int(np.argmax(np.linalg.norm(run - run[:5].mean(0), axis=1) > 0.05)) for run in runs]
    least = min(first)
    return [run[k - least :] for run, k in zip(runs, first)]


def at_rest(run: np.ndarray) -> np.ndarray:
    """Steps at which the hand rests: within 2 mm a step for half a second."""
    moves = np.linalg.norm(np.diff(run, axis=0, prepend=run[:1]), axis=1)
    return np.convolve(moves > 0.001, np.ones(11), "same") == 0


def compare_simulator(
    folder: Path, experiment: int, runs: list[np.ndarray], cubes: np.ndarray, name: str
) -> dict[str, Any]:
    log = load(folder / f"sim/experiment{experiment}/{name}.csv")
    path, cube = points(log, "ee", 1.0), points(log, "cube", 1.0)
    fit, check = runs[:2], runs[2:]
    mark = np.mean([run[:5].mean(0) for run in fit], axis=0) - path[0]
    late, _ = aligned(fit, path, False)
    start, speed = aligned(fit, path, True)
    steps = [float(np.mean(errors(check, path, mark, *a))) for a in ((0.0, 1.0), (late, 1.0), (start, speed))]
    hang = []
    for run in check:
        rest = at_rest(run) & at_rest(moved := replayed(path, len(run), start, speed))
        hang.append(float(np.mean((moved + mark - run)[rest, 2])) if rest.any() else np.nan)
    push = float(np.linalg.norm(cube[-1] - cube[0])) if experiment == 3 else np.nan
    return {
        "simulator": name,
        "experiment": experiment,
        "as given": steps[0],
        "started later": steps[1],
        "and at another speed": steps[2],
        "start": start,
        "speed": speed,
        "rests too high": float(np.mean(hang)),
        "cube pushed": push,
        "cube really": float(np.linalg.norm(cubes.mean(0))) if experiment == 3 else np.nan,
    }


def compare_all(folder: Path) -> list[dict[str, Any]]:
    out = []
    for experiment, (_, count) in EXPERIMENTS.items():
        loaded = [real_run(folder, experiment, k) for k in range(1, count + 1)]
        runs = begun_together([hand for hand, _ in loaded])
        rows = min(map(len, runs))
        spread = float(np.mean([rms(runs[0][:rows] - run[:rows]) for run in runs[1:]]))
        for name in SIMULATORS:
            out.append(
                {
                    **compare_simulator(folder, experiment, runs, np.array([c for _, c in loaded]), name),
                    "spread of real runs": spread,
                }
            )
    return out


def main_error(row: dict[str, Any]) -> str:
    """What its error is made of, largest part first."""
    squares = [
        row["as given"] ** 2,
        row["started later"] ** 2,
        row["and at another speed"] ** 2,
        row["spread of real runs"] ** 2,
    ]
    parts = {
        "starts too early": squares[0] - squares[1],
        f"speed (real {row['speed']:.2f})": squares[1] - squares[2],
        "path": squares[2] - squares[3],
    }
    names = [
        f"{n} {100 * p / squares[0]:.0f} %"
        for n, p in sorted(parts.items(), key=lambda x: -x[1])
        if p > 0.02 * squares[0]
    ]
    if abs(row["rests too high"]) > 0.015:
        names.append(
            f"rests {1e3 * abs(row['rests too high']):.0f} mm too {'high' if row['rests too high'] > 0 else 'low'}"
        )
    if row["cube pushed"] < 0.5 * row["cube really"]:
        names.append("does not push the cube")
    return ", ".join(names)


def print_rows(rows: list[dict[str, Any]]) -> None:
    columns = [
        "experiment",
        "simulator",
        "as given [mm]",
        "started later [mm]",
        "and at another speed [mm]",
        "real runs differ [mm]",
        "rests too high [mm]",
        "cube pushed [mm]",
        "wrong in",
    ]
    mm = lambda x: "–" if np.isnan(x) else f"{1e3 * x:.1f}"
    lines = []
    for r in rows:
        push = f"{mm(r['cube pushed'])} of {mm(r['cube really'])}" if r["experiment"] == 3 else "–"
        lines.append(
            [
                f"{r['experiment']}: {EXPERIMENTS[r['experiment']][0]}",
                r["simulator"],
                mm(r["as given"]),
                mm(r["started later"]),
                mm(r["and at another speed"]),
                mm(r["spread of real runs"]),
                mm(r["rests too high"]),
                push,
                main_error(r),
            ]
        )
    out = make_table(
        "Simulators beside motion capture of a Kinova MICO2, RMS of the hand on runs not fitted",
        columns,
        lines,
        text=(1, len(columns) - 1),
    )
    Console(width=200).print(out)
    mean = {name: np.mean([r["and at another speed"] for r in rows if r["simulator"] == name]) for name in SIMULATORS}
    raw = {name: np.mean([r["as given"] for r in rows if r["simulator"] == name]) for name in SIMULATORS}
    order = sorted(mean, key=lambda name: mean[name])
    print(
        "Closest path, mean of the experiments: "
        + ", ".join(f"{n} {1e3 * mean[n]:.1f} mm" for n in order)
        + f"; as given {min(raw, key=lambda name: raw[name])} is closest, {1e3 * min(raw.values()):.1f} mm."
    )
