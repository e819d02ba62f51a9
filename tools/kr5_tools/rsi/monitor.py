"""`kr5 rsi monitor`: a link as it runs."""

import contextlib
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer
from kr5 import rsi
from kr5.files import writing
from kr5.logs.row_log import Put, check_ending, row_log
from rich.console import Group, RenderableType
from rich.live import Live
from rich.text import Text

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.interruption import shielded, take_as_end
from kr5_tools.cli.link_options import (
    LayoutArgument,
    ListenOption,
    PassiveOption,
    PortOption,
    SettingsOption,
    link_options,
    listening_layout,
    read_layout,
)
from kr5_tools.cli.options import options_from
from kr5_tools.rsi.timing_table import TIMING_COLUMNS, timing_rows

PERIOD = 0.1  # [s] between two looks at what came
SHOWN_FAULTS = 5
COUNTS = {  # fields of the statistics
    "answered": "answers sent",
    "late": "answers after the deadline",
    "late_packets": "late by the controller",
    "lost": "telegrams lost",
    "repeated": "telegrams repeated",
    "reordered": "telegrams overtaken",
    "strangers": "of a second sender",
    "sessions": "sessions",
}
NOT_HERE = ("jitter", "clock_jump", "min_telegrams", "model", "position_tolerance", "gain_tolerance", "silence")


def add_to(app: typer.Typer) -> None:
    app.command("monitor", epilog="Example: kr5 rsi monitor my_cell_ethernet.xml --log monday.csv")(monitor)


@options_from(rsi.DiagnosisOptions, skip=(*NOT_HERE, "deadline", "mode", "frame"))
def monitor(
    layout_file: LayoutArgument,
    options: rsi.DiagnosisOptions,
    port: PortOption = None,
    settings: SettingsOption = None,
    log: Annotated[
        Path | None,
        typer.Option("--log", metavar="FILE", help="Log of what the controller tells, in SI: FILE.csv or FILE.mcap."),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option("--for", metavar="SECONDS", min=0.1, help=r"Time of listening; by default until Ctrl-C \[s]."),
    ] = None,
    passive: PassiveOption = False,
    listen: ListenOption = "0.0.0.0",
    png: arguments.PngOption = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Live state of the link to a controller: times, losses, last faulty telegrams, until Ctrl-C.

    The controller is answered without correction, unless --passive is given. The log is one that `kr5 recording
    import` and `kr5 gap diagnose` read. Needs no rights of an administrator. Exit code 1 where no telegram came.
    """
    check_ending(log)
    writing.check_writable(log, json_file, inputs=[layout_file, settings])
    layout = listening_layout(read_layout(layout_file, settings), port)
    reader = rsi.LinkRowReader(layout)
    recorder = rsi.LinkRecorder(layout, link_options(layout, options, listen, passive))
    for remedy in rsi.real_time_remedies(recorder.real_time):
        terminal.print_note(remedy)
    faulty: deque[rsi.FaultyTelegram] = deque(maxlen=SHOWN_FAULTS)
    with contextlib.ExitStack() as ending:  # once it is stopped, nothing is to break what is left to be done
        with row_log(log, reader.names, "rsi") as put:
            rows = _watch(recorder, reader, put, faulty, seconds)
            ending.enter_context(shielded())
        statistics = recorder.statistics()
        writing.write_json({**statistics.to_dict(), "rows": rows, "faulty": [f.to_dict() for f in faulty]}, json_file)
        to = terminal.console(json_file)
        to.print(state_view(statistics, faulty))
        if png:
            from kr5_tools.rsi.timing_plot import write_timing_plot

            s = statistics
            write_timing_plot(png, to, period=s.period, answer=s.answer, lateness=s.lateness)
        writing.publish()
        if log:
            to.print(f"{log}: {rows} rows.", soft_wrap=True, markup=False)
    if statistics.telegrams.good == 0:
        terminal.print_note(f"no good telegram came; kr5 rsi doctor {layout_file} says why.")
        raise typer.Exit(1)


def _watch(
    recorder: rsi.LinkRecorder,
    reader: rsi.LinkRowReader,
    put: Put,
    faulty: deque[rsi.FaultyTelegram],
    seconds: float | None,
) -> int:
    """Shows and logs what comes until the time is over or Ctrl-C; the number of rows."""
    count = 0

    def look() -> None:
        nonlocal count
        rows = reader.read(recorder.take())
        put(rows.values)
        count += len(rows.values)
        faulty.extend(rows.faulty)

    with _live() as live:
        end = None if seconds is None else time.monotonic() + seconds
        try:
            while end is None or time.monotonic() < end:
                time.sleep(PERIOD if end is None else max(min(PERIOD, end - time.monotonic()), 0.0))
                with shielded():
                    look()
                    if live:
                        live.update(state_view(recorder.statistics(), faulty), refresh=True)
        except KeyboardInterrupt:
            take_as_end()
        with shielded():
            look()
    return count


@contextlib.contextmanager
def _live() -> Iterator[Live | None]:
    """A part of the terminal that is drawn anew; none where nobody watches."""
    if not terminal.errors.is_terminal:
        yield None
        return
    with (
        terminal.sign_of_life.held(),
        Live(console=terminal.errors, auto_refresh=False, transient=True) as live,
    ):
        yield live


def state_view(statistics: rsi.LinkStatistics, faulty: deque[rsi.FaultyTelegram]) -> RenderableType:
    """State, times, counts and last faulty telegrams of a link."""
    parts: list[Any] = [Text(f"Link {statistics.state}, {statistics.telegrams.good} good telegrams", style="bold")]
    times = timing_rows(period=statistics.period, answer=statistics.answer, lateness=statistics.lateness)
    if times:
        parts.append(tables.make_table("", TIMING_COLUMNS, times))
    rows = [[text, f"{getattr(statistics, name):.0f}"] for name, text in COUNTS.items()]
    rows.append(["faulty telegrams", str(statistics.telegrams.faulty())])
    parts.append(tables.make_table("", ["what", "number [-]"], rows))
    if faulty:
        last = [[str(f.fault), f"{f.time:.2f}", f.sender] for f in faulty]
        parts.append(tables.make_table("Last faulty telegrams", ["fault", "after [s]", "sender"], last, text=(2,)))
    return Group(*parts)
