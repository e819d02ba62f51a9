"""The journal of a job as tables for people, and as plain values for JSON."""

from collections.abc import Sequence
from typing import Any

from kr5 import job

PELLET_COLUMNS = ["pellet", "state", "picks", "insertions", "time [s]"]
PHASE_COLUMNS = ["phase", "times", "total [s]", "longest [s]"]
ATTEMPT_COLUMNS = ["attempt", "pellets", "inserted"]


def pellet_rows(statistics: job.JobStatistics) -> list[list[object]]:
    return [[p.number, _words(p.state), p.picks, p.insertions, f"{p.time:.1f}"] for p in statistics.pellets]


def phase_rows(statistics: job.JobStatistics) -> list[list[object]]:
    return [[_words(p.phase), p.count, f"{p.total:.1f}", f"{p.max:.1f}"] for p in statistics.phases]


def attempt_rows(statistics: job.JobStatistics) -> list[list[object]]:
    return [[a.attempt, a.tried, a.inserted] for a in statistics.attempts]


def standing(journal: job.Journal) -> str:
    """How the job stands, in words."""
    belief = journal.belief()
    if not belief.begun:
        return f"Job {journal.job}: not begun."
    text = f"Job {journal.job}: {belief.inserted} inserted of {len(belief.pellets)} tried; phase {_words(belief.phase)}"
    if belief.pellet:
        text += f", pellet {belief.pellet}"
    if belief.stop != job.StopReason.None_:
        return f"{text}. Stopped by {_words(belief.stop)}; a person releases it with `kr5 job release`."
    return f"{text}."


def laid_down(records: Sequence[job.JobRecord]) -> list[int]:
    """Numbers of the pellets that were laid down before they stood; the others stood up at once."""
    return sorted({record.pellet for record in records if record.station.visits > 1})


def as_dict(journal: job.Journal, statistics: job.JobStatistics) -> dict[str, Any]:
    return {
        "job": journal.job,
        "released_by": journal.released_by or None,
        "laid_down": laid_down(journal.records()),
        "belief": journal.belief().to_dict(),
        "statistics": statistics.to_dict(),
    }


def _words(value: object) -> str:
    return str(value).replace("_", " ")
