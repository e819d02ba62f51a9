"""What `kr5 run` prints and writes of a job."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from kr5.files import writing

from kr5_tools.cli import tables, terminal
from kr5_tools.work import job_tables, journal_tables

if TYPE_CHECKING:
    import kr5.job
    import kr5.sim
    import kr5.work

    from kr5_tools.cli.terminal import Console
    from kr5_tools.work.job_cell import JobSetup


def print_job(
    done: "kr5.work.JobRun", truth: "kr5.work.JobTruth", pellets: int, file: Path | None, to: "Console"
) -> None:
    """How the job stands, then its figures, then what is so."""
    to.print(job_tables.ending_text(done, pellets, file), style="bold", soft_wrap=True, markup=False)
    s = done.statistics
    if s.pellets:
        to.print(tables.make_table("\nPellets", job_tables.PELLET_COLUMNS, job_tables.pellet_rows(s), text=(1,)))
    if s.phases:
        to.print(tables.make_table("\nPhases", journal_tables.PHASE_COLUMNS, journal_tables.phase_rows(s)))
    if s.attempts:
        rows = journal_tables.attempt_rows(s)
        to.print(tables.make_table("\nAttempts to insert", journal_tables.ATTEMPT_COLUMNS, rows))
    to.print(f"\n{job_tables.truth_text(truth)}", soft_wrap=True, markup=False)


def publish(told: list[str], to: "Console") -> None:
    """Puts the files in their places, and says what is there."""
    writing.publish()
    for text in told:
        to.print(text, soft_wrap=True, markup=False)


def write_log(done: "kr5.work.JobRun", log: Path) -> str:
    """The log of the joints; what is said of it once it is there."""
    from kr5_tools.work.job_log import write_job_log

    write_job_log(done.rows, log)
    return f"{log}: {len(done.rows)} rows."


def write_plots(
    done: "kr5.work.JobRun",
    records: "Sequence[kr5.job.JobRecord]",
    link: "kr5.work.LinkedRun | None",
    folder: Path,
) -> str:
    """The plots of the page as files; what is said of them once they are there."""
    from kr5_tools.pages.rendering import write_drawn
    from kr5_tools.work.run_page import job_plots

    files = write_drawn(lambda: job_plots(done, records, link), folder)
    return f"{folder}: {', '.join(file.name for file in files)}."


def write_page(
    done: "kr5.work.JobRun",
    truth: "kr5.work.JobTruth",
    records: "Sequence[kr5.job.JobRecord]",
    cell: "kr5.sim.WorkCell",
    setup: "JobSetup",
    source: Path,
    link: "kr5.work.LinkedRun | None",
    report: Path,
) -> str:
    """The page of a job that has moved; what is said of it once it is there."""
    from kr5_tools.work.run_page import job_page

    with terminal.spinner("drawing"):
        writing.write_text(job_page(done, truth, records, cell, setup, source, link), report)
    return f"{report}: open it in a browser."
