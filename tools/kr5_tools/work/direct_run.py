"""`kr5 run` without a link: the job in the simulated cell, as fast as that can."""

from pathlib import Path

import kr5.job
import kr5.sim
import kr5.work

from kr5_tools.work.job_loop import StateFile, follow_job
from kr5_tools.work.live_view import LiveView

CYCLES = 20  # between two looks at a job: Ctrl-C is heard, and the state of the cell written where records are new


def work(
    runner: kr5.work.JobRunner,
    cell: kr5.sim.WorkCell,
    pellets: int,
    journal: kr5.job.Journal,
    file: Path | None,
    live: LiveView | None,
) -> kr5.work.JobRun:
    """Until the job ends, or the program; the state of the cell is never older than the last record."""
    if not runner.runs:
        return runner.result()
    state_of_cell = StateFile(file, lambda: journal.last_number, cell.state)
    try:
        follow_job(runner, lambda: runner.step(CYCLES), pellets, state_of_cell, live)
    finally:
        state_of_cell.write()
    return runner.result()
