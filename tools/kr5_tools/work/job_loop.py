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


class StateFile:
    """The state of the cell beside its journal, written where records are new. `journal`: none where nothing is kept;
    `last_record`: number of the last one."""

    def __init__(
        self, journal: Path | None, last_record: Callable[[], int], cell_state: Callable[[], kr5.sim.WorkCellState]
    ) -> None:
        self.journal, self.last_record, self.cell_state = journal, last_record, cell_state
        self.written = -1

    def follow(self) -> None:
        """Writes it where there are records that it does not hold."""
        if self.journal is not None and self.last_record() != self.written:
            self.written = self.last_record()
            self.write()

    def write(self) -> None:
        if self.journal is not None:
            self.cell_state().save(state_file(self.journal))


def follow_job(
    job: RunningJob, advance: Callable[[], None], pellets: int, state_of_cell: StateFile, live: LiveView | None
) -> None:
    """Until the job ends. `advance`: lets it go on until the next look at it."""
    with terminal.progress_bar() as bar:
        task = bar.add_task("", total=pellets)
        while not job.finished:
            advance()
            state = job.state
            bar.update(task, completed=state.inserted, description=f"{words(state.phase)}, pellet {state.pellet}")
            if live:
                live.show(state, job.reading)
            state_of_cell.follow()
