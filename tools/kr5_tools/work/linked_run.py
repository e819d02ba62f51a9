"""`kr5 run --through-rsi`: the job in real time through an RSI link to an emulated controller, and its faults."""

import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import kr5.cell
import kr5.sim
import kr5.work
from kr5 import rsi

from kr5_tools.cli import tables, terminal
from kr5_tools.rsi.timing_table import TIMING_COLUMNS, timing_rows
from kr5_tools.work.job_cell import JobSetup, work_cell_options
from kr5_tools.work.job_loop import follow_job, save_cell
from kr5_tools.work.live_view import LiveView
from kr5_tools.work.remedies import words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from kr5_tools.cli.terminal import Console

PAUSE = 0.002  # [s] between two looks at what the job asks for
FAULT_COLUMNS = [
    "fault",
    "trials",
    "went on",
    "stopped",
    "still moving",
    "done after release",
    "peak force [N]",
    "over limit",
    "pellets astray",
]


def make_options(
    options: kr5.work.WorkOptions, cell: kr5.sim.WorkCell, controller: str, port: int | None
) -> kr5.work.LinkedOptions:
    """Both ends of the link on this computer."""
    linked = kr5.work.linked_options(options, cell.believed, rsi.Controller(controller))
    if port is not None:
        layout = linked.layout
        layout.port = port
        linked.layout = layout
    return linked


def work(
    linked_job: kr5.work.LinkedJob, pellets: int, file: Path | None, live: LiveView | None = None
) -> kr5.work.LinkedRun:
    """Until the job ends, or the program."""

    def advance() -> None:
        linked_job.serve()
        time.sleep(PAUSE)

    try:
        follow_job(linked_job, advance, pellets, live)
        return linked_job.run()  # until the arm stands
    except KeyboardInterrupt:
        linked_job.stop_by_operator()
        linked_job.run()
        raise
    finally:
        linked_job.end()
        save_cell(file, linked_job.cell_state)


def print_link(done: kr5.work.LinkedRun, layout: rsi.TelegramLayout, to: "Console") -> None:
    """What both ends of the link saw."""
    link, controller = done.link, done.controller
    c = controller.controller
    text = f"\nLink: {c.answered} of {c.answered + c.missing} cycles answered in time, {link.lost} telegrams lost"
    if controller.overruns:
        text += f", {controller.overruns} cycles that this computer missed"
    if c.stop.reason not in (rsi.ProgramStopReason.None_, rsi.ProgramStopReason.Asked):
        text += f"; the controller stopped: {rsi.stop_message(layout.controller, c.stop)}"
    to.print(f"{text}.", soft_wrap=True, markup=False)
    rows = timing_rows(period=link.period, answer=link.answer)
    if rows:
        to.print(tables.make_table("\nTimes of the link", TIMING_COLUMNS, rows))


def run_faults(cell: kr5.cell.Cell, setup: JobSetup, trials: int) -> "Sequence[kr5.work.FaultRow]":
    """Each fault so often, while a pellet of a bin with these errors is inserted."""
    options = kr5.work.FaultTrialOptions(trials=trials, seed=setup.seed)
    with tempfile.TemporaryDirectory(prefix="kr5-") as folder, terminal.share_bar("faults") as tell:
        return kr5.work.run_fault_trials(
            cell, work_cell_options(cell, setup), folder, options, progress=lambda _, share: tell(share)
        )


def fault_rows(rows: "Sequence[kr5.work.FaultRow]") -> list[list[object]]:
    return [
        [
            words(r.fault),
            r.trials,
            r.continued,
            r.stopped,
            r.moving,
            r.resumed,
            f"{r.max_force:.1f}",
            r.over_limit,
            r.astray,
        ]
        for r in rows
    ]


def sound(rows: "Sequence[kr5.work.FaultRow]") -> bool:
    """Whether no fault did harm: the arm went on or stood, no force beyond the limit, every pellet accounted for."""
    return not any(r.moving or r.over_limit or r.astray or r.continued + r.stopped < r.trials for r in rows)
