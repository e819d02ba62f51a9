"""A diagnosis that people may watch."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import kr5.arm_log
import kr5.cell
import kr5.gap

from kr5_tools.cli import terminal


@contextmanager
def progress_of_diagnosis() -> Iterator[Callable[[str, float], None] | None]:
    """What a diagnosis tells its stage and the part that is done: a bar for people at a terminal."""
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    if not terminal.errors.is_terminal:
        yield None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with terminal.progress_bar(*columns) as bars:
        bar = bars.add_task("reading", total=1.0)

        def progress(stage: str, fraction: float) -> None:
            bars.update(bar, description=stage, completed=fraction)

        yield progress


def run_diagnosis(
    recording: kr5.cell.Recording, simulator: kr5.cell.Simulator, options: kr5.gap.DiagnoseOptions
) -> kr5.gap.Diagnosis:
    """The diagnosis, with a bar for people at a terminal."""
    with progress_of_diagnosis() as progress:
        return kr5.arm_log.diagnose(recording, simulator, options, progress)
