"""What moves in a replay: the postures of the arm, or the poses of the peg, of each experiment over its time."""

import math
from dataclasses import dataclass, field
from typing import Any

import kr5.cell
import kr5.io
import numpy as np

from kr5_tools.cli import terminal
from kr5_tools.replay.signals import Signal, experiment_signals, page_signal, points_for

HOLD = 0.8  # [s] from one static posture to the next
# Where the peg of an experiment without joint columns moves.
STANDS = {"step": "air", "press": "bench", "profile": "tube"}


@dataclass
class Run:
    """One entry of a replay's list of experiments."""

    name: str
    t: np.ndarray  # [s]
    q: np.ndarray | None = None  # postures, a row a time [rad or m]
    peg: np.ndarray | None = None  # x, y, z, tilt and its azimuth, in the frame of `stand`; a row a time [m, rad]
    stand: str = ""  # where the peg moves: air, bench or tube
    hold: float | None = None  # [s] from one posture to the next, where none is a motion
    notes: list[list[Any]] = field(default_factory=list)  # [time, what begins then]
    remark: str = ""  # what there is to say about the signals
    signals: list[Signal] = field(default_factory=list)
    first: list[str] = field(default_factory=list)  # names of the signals to show first; by default the widest gaps

    def as_page(self, points: int) -> dict[str, Any]:
        """For the script of a page."""
        return {
            "name": self.name,
            "t": self.t.round(4).tolist(),
            "q": None if self.q is None else self.q.round(6).tolist(),
            "peg": None if self.peg is None else self.peg.round(6).tolist(),
            "stand": self.stand,
            "hold": self.hold,
            "notes": self.notes,
            "remark": self.remark,
            "first": self.first,
            "signals": [page_signal(signal, points) for signal in self.signals],
        }


@dataclass
class Skipped:
    """An experiment that a replay does not show."""

    name: str
    reason: str


def page_runs(runs: list[Run]) -> list[dict[str, Any]]:
    """All of them, with as many points of their signals as a page may hold."""
    points = points_for(sum(len(run.signals) for run in runs))
    return [run.as_page(points) for run in runs]


def experiment_runs(
    cell: kr5.cell.Cell, experiments: list[kr5.cell.Experiment], simulator: kr5.cell.Simulator | None, most: int
) -> tuple[list[Run], list[Skipped]]:
    """Of each experiment: its runs, with postures thinned out to `most`, and what cannot be shown."""
    runs: list[Run] = []
    skipped: list[Skipped] = []
    for experiment in terminal.track(experiments, "simulating"):
        name = f"{experiment.name} ({experiment.kind})"
        predicted, remark = simulated_columns(cell, experiment, simulator)
        kind = str(experiment.kind)
        if kind == "motion":
            found = [_motion(cell, experiment, predicted)]
        elif kind in STANDS:
            found = _peg_runs(cell, experiment, predicted)
        else:
            found = [_postures(cell, experiment, predicted, most)]
        for run in found:
            if isinstance(run, str):
                skipped.append(Skipped(name, f"{run}; {remark}" if remark else run))
                continue
            run.name, run.remark = name + run.name, f"{remark[:1].upper()}{remark[1:]}." if remark else ""
            runs.append(thinned_run(run, most))
    return runs, skipped


def simulated_columns(
    cell: kr5.cell.Cell, experiment: kr5.cell.Experiment, simulator: kr5.cell.Simulator | None
) -> tuple[kr5.io.Table | None, str]:
    """What the simulator predicts of an experiment; or nothing, and why."""
    import kr5

    if simulator is None:
        return None, ""
    try:
        return simulator.predict(cell, experiment), ""
    except kr5.Error as error:
        return None, f"not simulated: {error}"


def _motion(cell: kr5.cell.Cell, experiment: kr5.cell.Experiment, predicted: kr5.io.Table | None) -> Run | str:
    """A motion, drawn at its measured positions; where there are none, at those simulated or commanded."""
    n, data = cell.robot.joints, experiment.data
    sources = [(data, "q"), (predicted, "q"), (data, "qc")]
    found = [
        (table, letter)
        for table, letter in sources
        if table is not None and all(f"{letter}{i + 1}" in table for i in range(n))
    ]
    if not found:
        return f"no joint columns q1..q{n}, in which the arm could be drawn"
    table, letter = found[0]
    q = np.column_stack([table[f"{letter}{i + 1}"] for i in range(n)])
    rows = np.flatnonzero(np.all(np.isfinite(q), axis=1))
    if len(rows) < 2:
        return f"{len(rows)} rows with numbers in q1..q{n}, expected at least 2"
    t = _times(experiment, rows)
    if isinstance(t, str):
        return t
    return Run("", t, q=q[rows], signals=experiment_signals(cell, experiment, t, rows, predicted))


def _postures(
    cell: kr5.cell.Cell, experiment: kr5.cell.Experiment, predicted: kr5.io.Table | None, most: int
) -> Run | str:
    """Static postures, each shown for a moment; the rows of one are spread about it."""
    n, data = cell.robot.joints, experiment.data
    if any(f"q{i + 1}" not in data for i in range(n)):
        return f"no joint columns q1..q{n}, in which the arm could be drawn"
    q = np.column_stack([data[f"q{i + 1}"] for i in range(n)])
    rows = np.flatnonzero(np.all(np.isfinite(q), axis=1))
    if not len(rows):
        return f"no row with numbers in q1..q{n}"
    q = q[rows]
    starts = np.flatnonzero(np.append(True, np.any(np.diff(q, axis=0) != 0, axis=1)))  # a posture has many rows
    count = np.diff(np.append(starts, len(q)))
    number = np.repeat(np.arange(len(starts)), count)
    within = (np.arange(len(q)) - starts[number] + 0.5) / count[number] - 0.5
    hold = HOLD * min(1.0, most / len(starts))  # shorter where some of many are left out
    signals = experiment_signals(cell, experiment, hold * (number + within), rows, predicted)
    return Run("", hold * np.arange(len(starts)), q=q[starts], hold=hold, signals=signals)


def _peg_runs(cell: kr5.cell.Cell, experiment: kr5.cell.Experiment, predicted: kr5.io.Table | None) -> list[Run | str]:
    """Experiments without joint columns: the peg, or the tool, at its height, one run after the other."""
    data, kind = experiment.data, str(experiment.kind)
    source = data if "z" in data else predicted
    if source is None or "z" not in source:
        return ["no column z, recorded or simulated, at whose height the tool could be drawn"]
    z = np.asarray(source["z"], dtype=float)
    place = ("cx", "cy", "z", "tilt", "alpha") if kind == "profile" else ("", "", "z", "", "")
    pose = np.column_stack(
        [z if name == "z" else np.asarray(data[name], dtype=float) if name else np.zeros(len(z)) for name in place]
    )
    numbers = np.unique(data["run"])
    out: list[Run | str] = []
    for index, number in enumerate(numbers):
        rows = np.flatnonzero((np.asarray(data["run"]) == number) & np.all(np.isfinite(pose), axis=1))
        if len(rows) < 2:
            out.append(f"{len(rows)} rows with numbers in run {number:g}, expected at least 2")
            continue
        t = _times(experiment, rows)
        if isinstance(t, str):
            out.append(t if len(numbers) == 1 else f"run {number:g}: {t}")
            continue
        signals = experiment_signals(cell, experiment, t, rows, predicted)
        name = f", run {index + 1} of {len(numbers)}" if len(numbers) > 1 else ""
        out.append(Run(name, t, peg=pose[rows], stand=STANDS[kind], signals=signals))
    return out


def _times(experiment: kr5.cell.Experiment, rows: np.ndarray) -> np.ndarray | str:
    """Times of the rows from the first on; or that they do not increase."""
    t = np.asarray(experiment["t"], dtype=float)[rows]
    if np.any(~(np.diff(t) > 0)):
        return "t: found times that do not increase, expected each row later than the previous one"
    return np.asarray(t - t[0])


def thinned_run(run: Run, most: int) -> Run:
    """With no more than so many postures or poses; signals are left as they are."""
    keep = np.unique(np.linspace(0, len(run.t) - 1, min(len(run.t), most)).round().astype(int))
    run.t = run.t[keep]
    run.q = None if run.q is None else run.q[keep]
    run.peg = None if run.peg is None else run.peg[keep]
    return run


def joint_by_joint(cell: kr5.cell.Cell) -> Run:
    """A tour from the rest posture: each joint to both sides, within its limits."""
    from kr5_tools.cell.frames import is_slide
    from kr5_tools.cell.rest_posture import rest_posture

    rest, limits = rest_posture(cell, None), cell.robot.limits
    t, q = [], []
    for joint in range(cell.robot.joints):
        reach = 0.1 if is_slide(cell, joint) else math.radians(35)
        low = max(rest[joint] - reach, limits.lower[joint]) if limits else rest[joint] - reach
        high = min(rest[joint] + reach, limits.upper[joint]) if limits else rest[joint] + reach
        for k in range(40):
            swing = math.sin(2 * math.pi * k / 40)
            to = rest[joint] + swing * ((high - rest[joint]) if swing > 0 else (rest[joint] - low))
            t.append(3 * joint + 3 * k / 40)
            q.append([to if i == joint else x for i, x in enumerate(rest)])
    return Run("each joint in turn", np.array([*t, 3.0 * cell.robot.joints]), q=np.array([*q, rest]))
