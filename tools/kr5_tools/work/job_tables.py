"""What a job did, in tables and sentences for people."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from kr5 import job

from kr5_tools.work.journal_tables import laid_down
from kr5_tools.work.remedies import refusal_text, stop_text, words

if TYPE_CHECKING:
    from collections.abc import Sequence

    import kr5.work

    from kr5_tools.work.job_cell import JobSetup

PELLET_COLUMNS = [
    "pellet",
    "state",
    "picks",
    "insertions",
    "time [s]",
    "peak force [N]",
    "impulse [N s]",
    "jerk [m/s³]",
]


def pellet_rows(statistics: job.JobStatistics) -> list[list[object]]:
    return [
        [
            p.number,
            words(p.state),
            p.picks,
            p.insertions,
            f"{p.time:.1f}",
            f"{p.peak_force:.1f}",
            f"{p.impulse:.1f}",
            f"{p.peak_jerk:.0f}",
        ]
        for p in statistics.pellets
    ]


def mean_time(statistics: job.JobStatistics) -> float | None:
    """From the pick of a pellet until the tool has left it in the tube [s]."""
    times = [p.time for p in statistics.pellets if p.state == job.PelletState.Inserted]
    return sum(times) / len(times) if times else None


def ending_text(done: "kr5.work.JobRun", pellets: int, file: Path | None) -> str:
    """How the job stands."""
    decision, statistics = done.decision, done.statistics
    if decision.status == job.RestartStatus.Finished:
        return f"The job is done: {decision.inserted} inserted."
    if not job.goes_on(decision.status):
        return refusal_text(decision, file)
    text = f"{statistics.inserted} of {pellets} pellets inserted in {statistics.time:.1f} s"
    if (mean := mean_time(statistics)) is not None:
        text += f", {mean:.1f} s each from pick to place; peak force {statistics.peak_force:.1f} N"
    if statistics.programs > 1:
        text += f"; in {statistics.programs} programs"
    if done.state.stop != job.StopReason.None_:
        return f"{text}. {stop_text(done.state, file)}"
    return f"{text}."


def truth_text(truth: "kr5.work.JobTruth") -> str:
    """What is so, which no controller knows."""
    parts = [
        (truth.in_tube, "in the tube"),
        (truth.on_stand, "on the stand"),
        (truth.in_bin, "in the bin"),
        (truth.loose, "held or in motion"),
        (truth.lost, "elsewhere"),
    ]
    return "In truth: " + ", ".join(f"{count} {where}" for count, where in parts if count) + "."


def as_dict(
    job_id: str,
    setup: "JobSetup",
    done: "kr5.work.JobRun",
    truth: "kr5.work.JobTruth",
    records: "Sequence[job.JobRecord]",
    link: "kr5.work.LinkedRun | None" = None,
) -> dict[str, Any]:
    ends = {} if link is None else {"link": link.link.to_dict(), "controller": link.controller.to_dict()}
    return {
        "job": job_id,
        "clearance": setup.clearance,
        "tilt": setup.tilt,
        "done": done.done,
        "decision": done.decision.to_dict(),
        "state": done.state.to_dict(),
        "mean_time": mean_time(done.statistics),
        "statistics": done.statistics.to_dict(),
        "laid_down": laid_down(records),
        "truth": truth.to_dict(),
        **ends,
    }
