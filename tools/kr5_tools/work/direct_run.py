"""`kr5 run` without a link: the job in the simulated cell, as fast as that can."""

from pathlib import Path

import kr5.sim
import kr5.work

from kr5_tools.work.job_loop import follow_job, save_cell
from kr5_tools.work.live_view import LiveView

CYCLES = 20  # between two looks at a job: Ctrl-C is heard


def work(
    runner: kr5.work.JobRunner,
    cell: kr5.sim.WorkCell,
    pellets: int,
    file: Path | None,
    live: LiveView | None,
) -> kr5.work.JobRun:
    """Until the job ends, or the program."""
    if not runner.runs:
        return runner.result()
    try:
        follow_job(runner, lambda: runner.step(CYCLES), pellets, live)
    finally:
        save_cell(file, cell.state)
    return runner.result()
