"""The loop of `kr5 run` over a job, with a link and without: what people see of it, and the state of the cell on the
disk."""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import kr5.job
import kr5.robot
import kr5.sim

from kr5_tools.cli import terminal
from kr5_tools.work.job_cell import state_file
from kr5_tools.work.live_view import LiveView
from kr5_tools.work.remedies import words


class RunningJob(Protocol):
    """What the loop looks at."""

    @property
    def finished(self) -> bool: ...
    @property
    def state(self) -> kr5.job.JobState: ...
    @property
    def reading(self) -> kr5.robot.RobotReading: ...


def save_cell(journal: Path | None, cell_state: Callable[[], kr5.sim.WorkCellState]) -> None:
    """The cell as a program leaves it, that ends by itself."""
    if journal is not None:
        cell_state().save(state_file(journal))


def follow_job(job: RunningJob, advance: Callable[[], None], pellets: int, live: LiveView | None) -> None:
    """Until the job ends. `advance`: lets it go on until the next look at it."""
    with terminal.progress_bar() as bar:
        task = bar.add_task("", total=pellets)
        while not job.finished:
            advance()
            state = job.state
            bar.update(task, completed=state.inserted, description=f"{words(state.phase)}, pellet {state.pellet}")
            if live:
                live.show(state, job.reading)
