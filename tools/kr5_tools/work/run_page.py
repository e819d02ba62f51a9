"""The page of a job: the cell in motion with its phases, the time line, forces and attempts by pellet."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import kr5
import kr5.cell
import numpy as np
import numpy.typing as npt
from kr5 import job
from matplotlib.ticker import MaxNLocator

from kr5_tools.calibrate.plots import Plot
from kr5_tools.cli.numbers import format_count
from kr5_tools.pages.plot_style import BLUE, STYLE, WIDE, plt
from kr5_tools.pages.rendering import embed_plot
from kr5_tools.replay.page import make_page
from kr5_tools.replay.runs import Run, thinned_run
from kr5_tools.replay.signals import signal_of
from kr5_tools.rsi.timing_plot import timing_plot
from kr5_tools.work import job_tables, journal_tables
from kr5_tools.work.remedies import words

if TYPE_CHECKING:
    import kr5.sim
    import kr5.work

    from kr5_tools.work.job_cell import JobSetup

MOST_POSTURES = 4000
MOST_POINTS = 6000
# Signals of the replay: label, unit and quantity.
SIGNALS = {
    "fx": ("force along x of the base", "N", "force"),
    "fy": ("force along y of the base", "N", "force"),
    "fz": ("force along z of the base", "N", "force"),
    "tool_x": ("position x of the tool", "m", "tool"),
    "tool_y": ("position y of the tool", "m", "tool"),
    "tool_z": ("position z of the tool", "m", "tool"),
}
COLOURS = {
    "check_cell": "#999999",
    "look": "#3A86B7",
    "scan": "#56B4E9",
    "pick": "#E69F00",
    "stand": "#009E73",
    "regrip": "#CC79A7",
    "approach": "#7B61C9",
    "search": "#D55E00",
    "insert": "#B00020",
    "next": "#777777",
}


def job_page(
    done: "kr5.work.JobRun",
    truth: "kr5.work.JobTruth",
    records: Sequence[job.JobRecord],
    cell: "kr5.sim.WorkCell",
    setup: "JobSetup",
    source: Path,
    link: "kr5.work.LinkedRun | None" = None,
) -> str:
    """The HTML."""
    good = done.done and truth.in_tube == setup.pellets
    with plt.rc_context(STYLE):
        drawn = job_plots(done, records, link)
    try:
        return make_page(
            cell.believed,
            [replay_run(done)],
            source,
            made_by="kr5 run",
            title=f"Job of {format_count(setup.pellets, 'pellet')}",
            solids=plates_of(cell),
            T_base_actual=np.asarray(cell.truth().T_base_tubes[0]),
            template="job.html",
            look="good" if good else "unusable",
            icon="✓" if good else "✗",
            ending=job_tables.ending_text(done, setup.pellets, None),
            truth=job_tables.truth_text(truth),
            given=[
                ("seed", str(setup.seed)),
                ("errors", setup.errors),
                ("clearance", f"{1e3 * setup.clearance:g} mm"),
                ("tilt", f"{np.degrees(setup.tilt):.3g}°"),
            ],
            plots=[embed_plot(plot) for plot in drawn],
            tables=[
                ("Pellets", job_tables.PELLET_COLUMNS, job_tables.pellet_rows(done.statistics)),
                ("Phases", journal_tables.PHASE_COLUMNS, journal_tables.phase_rows(done.statistics)),
                ("Attempts to insert", journal_tables.ATTEMPT_COLUMNS, journal_tables.attempt_rows(done.statistics)),
            ],
        )
    finally:
        for plot in drawn:
            plt.close(plot.figure)


def job_plots(
    done: "kr5.work.JobRun", records: Sequence[job.JobRecord], link: "kr5.work.LinkedRun | None"
) -> list[Plot]:
    """Time line and forces; of a job through a link its times, too."""
    times = link and timing_plot(period=link.link.period, answer=link.link.answer, lateness=link.link.lateness)
    return [_time_line(records), _forces(done), *([times] if times else [])]


def plates_of(cell: "kr5.sim.WorkCell") -> list["kr5.cell.PlacedObject"]:
    """The stand, and floor and walls of the bin."""
    stand, box = cell.options.stand, cell.options.bin
    x, y, z = (float(v) for v in box.size)
    T = np.asarray(box.T_base_bin)
    out = [_plate("stand", stand.size[0], stand.size[1], stand.T_base_stand), _plate("floor", x, y, T)]
    quarter = np.pi / 2
    for sign in (-1, 1):
        out.append(_plate("wall", z, y, T @ kr5.to_pose([sign * x / 2, 0, z / 2, 0, sign * quarter, 0])))
        out.append(_plate("wall", x, z, T @ kr5.to_pose([0, sign * y / 2, z / 2, -sign * quarter, 0, 0])))
    return out


def _plate(name: str, width: float, height: float, T: npt.ArrayLike) -> "kr5.cell.PlacedObject":
    plate = kr5.cell.PlacedObject(kind="plate", name=name, width=float(width), height=float(height))
    plate.T_base_object = np.asarray(T)
    return plate


def replay_run(done: "kr5.work.JobRun") -> Run:
    """Postures over time, thinned out, with the phase that begins at each time, and the signals."""
    rows = done.rows
    t = np.asarray(rows["time"])
    t = t - t[0]
    joints = sum(name[0] == "q" for name in rows.columns)
    q = np.column_stack([rows[f"q{i + 1}"] for i in range(joints)])
    phase, pellet = np.asarray(rows["phase"]).astype(int), np.asarray(rows["pellet"]).astype(int)
    begins = np.flatnonzero(np.append(True, (np.diff(phase) != 0) | (np.diff(pellet) != 0)))
    notes = [[round(float(t[k]), 4), _note(phase[k], pellet[k])] for k in begins]
    signals = [signal_of(name, *meaning, t, rows[name]) for name, meaning in SIGNALS.items()]
    return thinned_run(Run("job", t, q=q, notes=notes, signals=signals, first=["fz", "tool_z"]), MOST_POSTURES)


def _note(phase: int, pellet: int) -> str:
    name = words(job.Phase(int(phase)))
    return f"pellet {pellet}: {name}" if pellet else name


def phase_spans(records: Sequence[job.JobRecord]) -> list[tuple[int, str, float, float]]:
    """Pellet, phase, begin and duration [s] of each stay in a phase, within one program."""
    spans = []
    for record, following in zip(records, records[1:]):
        if record.kind == job.RecordKind.Begin or following.kind in (job.RecordKind.Begin, job.RecordKind.Release):
            continue
        if record.kind not in (job.RecordKind.Stop, job.RecordKind.Release) and following.time > record.time:
            spans.append((record.pellet, str(record.phase), record.time, following.time - record.time))
    return spans


def _time_line(records: Sequence[job.JobRecord]) -> Plot:
    """A line a pellet, its phases one after the other."""
    spans = phase_spans(records)
    pellets = max((span[0] for span in spans), default=0)
    figure, axes = plt.subplots(figsize=(WIDE, max(2.0, 0.6 + 0.2 * (pellets + 1))))
    shown: set[str] = set()
    for pellet, phase, begin, duration in spans:
        label = "_" if phase in shown else words(phase)
        shown.add(phase)
        axes.barh(pellet, duration, left=begin, height=0.8, color=COLOURS.get(phase, "#999999"), label=label)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("pellet; 0: none")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.invert_yaxis()
    if shown:
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=5, fontsize=7)
    text = "Phases of each pellet by the journal; times between programs are left out."
    return Plot("time_line", "Time line", text, figure, True)


def _forces(done: "kr5.work.JobRun") -> Plot:
    """Size of the measured force over time: the largest of each part of the job."""
    rows = done.rows
    force = np.sqrt(sum(np.asarray(rows[name]) ** 2 for name in ("fx", "fy", "fz")))
    t = np.asarray(rows["time"])
    size = max(1, len(t) // MOST_POINTS)
    n = len(t) // size * size
    figure, axes = plt.subplots(figsize=(WIDE, 2.4))
    axes.plot(t[:n:size], force[:n].reshape(-1, size).max(axis=1), color=BLUE, linewidth=0.8)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("force [N]")
    text = "Force of the environment on the tool as measured, with the inertia of the tool while the arm speeds up."
    return Plot("force", "Force", text, figure, True)
