"""`kr5 run` without a link: the job in the simulated cell, as fast as that can."""

from pathlib import Path

import kr5.job
import kr5.sim
import kr5.work

from kr5_tools.cli import terminal
from kr5_tools.work.job_cell import state_file
from kr5_tools.work.live_view import LiveView
from kr5_tools.work.remedies import words

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
    written = -1
    with terminal.progress_bar() as bar:
        task = bar.add_task("", total=pellets)
        try:
            while not runner.finished:
                runner.step(CYCLES)
                state = runner.state
                bar.update(task, completed=state.inserted, description=f"{words(state.phase)}, pellet {state.pellet}")
                if live:
                    live.show(state, runner.reading)
                if file is not None and journal.last_number != written:
                    written = journal.last_number
                    cell.state().save(state_file(file))
        finally:
            if file is not None:
                cell.state().save(state_file(file))
    return runner.result()
