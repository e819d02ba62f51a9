"""`kr5 rsi emulate`: a KUKA controller without a robot, for anybody's RSI client."""

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import kr5
import kr5.cell
import kr5.robot
import typer
from kr5 import rsi
from kr5.files import writing
from rich.markup import escape

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.interruption import shielded
from kr5_tools.cli.link_options import SettingsOption, settled_layout
from kr5_tools.cli.numbers import format_count
from kr5_tools.cli.terminal import Console
from kr5_tools.rsi import emulation_tables, emulator_setup
from kr5_tools.rsi.emulator_setup import Action

PERIOD = 0.1  # [s] between looks at the emulator

CellFile = Annotated[Path, typer.Argument(metavar="CELL", help="Cell whose arm the controller moves.")]
Kind = Annotated[
    Literal[emulator_setup.CONTROLLERS] | None,  # type: ignore[valid-type]
    typer.Option("--controller", help="Controller to play; by default that of --layout, else krc4."),
]
Layout = Annotated[
    Path | None,
    typer.Option(
        "--layout",
        metavar="ETHERNET.xml",
        help="Sensor configuration of the controller; by default the usual elements.",
    ),
]
Corrections = Annotated[
    Literal["axes", "cartesian"], typer.Option("--corrections", help="What answers correct, without --layout.")
]
Mode = Annotated[Literal["absolute", "relative"], typer.Option("--mode", help="Corrections of the program.")]
Frame = Annotated[Literal["base", "tool"], typer.Option("--frame", help="Axes of Cartesian corrections.")]
Address = Annotated[str, typer.Option("--address", help="Address of the client's computer.")]
Port = Annotated[
    int | None,
    typer.Option("--port", min=1, max=65535, help="Port that the client listens on; by default as --layout."),
]
TransportOption = Annotated[
    Literal["udp", "tcp"] | None, typer.Option("--transport", help="Transport; TCP is that of a KR C2 alone.")
]
OwnPort = Annotated[
    int, typer.Option("--own-port", min=0, max=65535, help="UDP port to send from; 0: any that is free.")
]
Timeout = Annotated[
    int | None,
    typer.Option(
        "--timeout", metavar="CYCLES", min=1, help="Cycles without an answer, with the last of which it stops."
    ),
]
AxisLimit = Annotated[
    float | None,
    typer.Option("--axis-limit", metavar="DEG", help="Limit of corrections of an axis or rotation \\[deg]."),
]
TranslationLimit = Annotated[
    float | None, typer.Option("--translation-limit", metavar="MM", help="Limit along X, Y and Z \\[mm].")
]
Strict = Annotated[
    bool,
    typer.Option("--strict", help="Count missing answers from the first telegram on, not from the first answer on."),
]
Places = Annotated[
    list[str] | None,
    typer.Option(
        "--path",
        metavar="J1,J2,...",
        help="Place that the program goes to, joint values of the cell \\[deg; mm of a slide]; repeatable, one after"
        " the other; by default it stands.",
    ),
]
PathSpeed = Annotated[
    float, typer.Option("--path-speed", metavar="DEG/S", help="Speed on the path of the joint with the longest way.")
]
Rule = Annotated[
    list[str] | None,
    typer.Option(
        "--rule",
        metavar="NAME=VALUE",
        help="Rule of the controller other than usual, a field of rsi.ControllerRules in SI, as"
        " override_scales_corrections=true or idle_limit=60; repeatable.",
    ),
]
Restart = Annotated[
    float | None,
    typer.Option("--restart", metavar="SECONDS", help="Time after which an ended program is started again \\[s]."),
]
Faulty = Annotated[
    Literal["telegrams", "answers", "both"],
    typer.Option("--faults-of", help="Messages that have the faults of the network."),
]
Fault = Annotated[
    list[str] | None,
    typer.Option("--fault", metavar="KIND@SECONDS[xCOUNT]", help="Fault at a time, as lose@1.5x10; repeatable."),
]
Do = Annotated[
    list[str] | None,
    typer.Option(
        "--do",
        metavar="WHAT@SECONDS",
        help="drives_off, drives_on, emergency_stop, reset or override=PERCENT at a time; repeatable.",
    ),
]


def share_option(flag: str, what: str) -> Any:
    return typer.Option(flag, metavar="SHARE", min=0, max=1, help=f"Share of the messages that {what} \\[-].")


def add_to(app: typer.Typer) -> None:
    app.command(
        "emulate",
        epilog="Example: kr5 rsi emulate share/cells/kr5_arc.yaml --controller krc4 --port 49152 --lose 0.01 --for 60",
    )(emulate)


def emulate(
    cell_file: CellFile,
    controller: Kind = None,
    layout_file: Layout = None,
    settings: SettingsOption = None,
    corrections: Corrections = "axes",
    mode: Mode = "absolute",
    frame: Frame = "base",
    address: Address = "127.0.0.1",
    port: Port = None,
    transport: TransportOption = None,
    own_port: OwnPort = 0,
    timeout: Timeout = None,
    axis_limit: AxisLimit = None,
    translation_limit: TranslationLimit = None,
    strict: Strict = False,
    places: Places = None,
    path_speed: PathSpeed = 10.0,
    rule: Rule = None,
    restart: Restart = None,
    late: Annotated[float, share_option("--late", "come late by --delay")] = 0.0,
    lose: Annotated[float, share_option("--lose", "are lost")] = 0.0,
    double: Annotated[float, share_option("--double", "come twice")] = 0.0,
    reorder: Annotated[float, share_option("--reorder", "the next one overtakes")] = 0.0,
    truncate: Annotated[float, share_option("--truncate", "come in part")] = 0.0,
    delay: Annotated[float, typer.Option(metavar="MS", help="By how much a late message is late \\[ms].")] = 20.0,
    jitter: Annotated[float, typer.Option(metavar="MS", help="Every message is late by up to this \\[ms].")] = 0.0,
    faults_of: Faulty = "telegrams",
    fault: Fault = None,
    do: Do = None,
    seed: Annotated[int, typer.Option(min=0, help="Random seed of faults and noise.")] = 1,
    seconds: Annotated[
        float | None,
        typer.Option("--for", metavar="SECONDS", min=0.1, help="Time to run \\[s]; by default until Ctrl-C."),
    ] = None,
    everything: arguments.AllOption = False,
    png: arguments.PngOption = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """A KUKA controller without a robot: sends the telegrams of the sensor interface at its fixed rate to anybody's
    client, moves the simulated arm of a cell by the answers, and keeps the rules of the controller: late, lost and
    faulty answers count, and limits stop the program.

    Exit code 1 when the program was ended or no client answered, 2 for bad input.
    """
    writing.check_writable(json_file, inputs=[cell_file, layout_file, settings])
    layout = emulator_setup.make_layout(layout_file, controller, corrections, address, port, transport)
    layout = emulator_setup.with_current_units(settled_layout(layout, settings))
    rules = emulator_setup.make_rules(layout.controller, timeout, axis_limit, translation_limit, rule or ())
    shares = {"late": late, "lose": lose, "doubled": double, "reorder": reorder, "truncate": truncate}
    telegram_faults, answer_faults = emulator_setup.make_faults(faults_of, shares, delay, jitter, fault or (), seed)
    actions = sorted((emulator_setup.parse_action(text) for text in do or ()), key=lambda action: action.time)
    cell = kr5.cell.load_cell(cell_file)
    program = rsi.EmulationOptions(rules=rules, mode=mode, frame=frame, count_from="telegram" if strict else "answer")
    program.path = [emulator_setup.parse_place(text, cell.robot) for text in places or ()]
    program.path_speed = math.radians(path_speed)
    if any(action.overrides for action in actions) and not (places or rules.override_scales_corrections):
        terminal.print_note("an override slows the path alone, and there is none: add --path.")
    if cell.robot.limits is not None:
        program.axis_speeds = cell.robot.limits.velocity
    options = rsi.EmulatorOptions(
        controller=program,
        own_port=own_port,
        restart=restart,
        telegram_faults=telegram_faults,
        answer_faults=answer_faults,
        real_time={"priority": 0, "lock_memory": False},
    )
    robot = make_robot(cell_file, cell, rules.cycle, seed)
    emulator = rsi.Emulator(layout, cell.sensor_model(), options, robot)
    to = terminal.console(json_file)
    try:
        with live_line() as show:
            watch(emulator, layout, seconds, actions, restart is not None, show)
    except KeyboardInterrupt:
        with shielded():
            conclude(emulator, layout, to, json_file, everything, png)
            writing.publish()
        raise
    if conclude(emulator, layout, to, json_file, everything, png):
        raise typer.Exit(1)


def make_robot(file: Path, cell: kr5.cell.Cell, cycle: float, seed: int) -> kr5.robot.Robot:
    import kr5.sim  # DART, which the other commands of this group do without

    try:
        return kr5.sim.CellRobot(cell, kr5.sim.CellRobotOptions(cycle=cycle, seed=seed))
    except kr5.InvalidArgument as error:
        raise kr5.FileError(file, str(error)) from None


@contextlib.contextmanager
def live_line() -> Iterator[Callable[[str], None]]:
    """Shows one line that changes, to people at a terminal."""
    if not terminal.errors.is_terminal:
        yield lambda text: None
        return
    with terminal.sign_of_life.held(), terminal.errors.status("") as status:
        yield lambda text: status.update(escape(text))


def watch(
    emulator: rsi.Emulator,
    layout: rsi.TelegramLayout,
    seconds: float | None,
    actions: Sequence[Action],
    restarts: bool,
    show: Callable[[str], None],
) -> None:
    """Until the time is over, or nothing more can happen."""
    begun = time.monotonic()
    coming = list(actions)
    while True:
        passed = time.monotonic() - begun
        while coming and coming[0].time <= passed:
            coming.pop(0).do(emulator)
        statistics = emulator.statistics()
        show(emulation_tables.status_line(statistics, layout))
        ended = statistics.controller.phase == rsi.ControllerPhase.Ended and not restarts and not coming
        if ended or statistics.failure or (seconds is not None and passed >= seconds):
            return
        time.sleep(PERIOD if seconds is None else min(PERIOD, max(seconds - passed, 0.0)))


def conclude(
    emulator: rsi.Emulator,
    layout: rsi.TelegramLayout,
    to: Console,
    json_file: Path | None,
    everything: bool,
    png: Path | None,
) -> bool:
    """Prints and writes what there was; whether the program was ended, or never answered."""
    statistics, events = emulator.statistics(), emulator.events()
    if statistics.failure:
        terminal.fail(f"the emulated arm could not go on: {statistics.failure}")
    to.print(emulation_tables.verdict_sentence(statistics, layout), style="bold", soft_wrap=True, markup=False)
    rows = emulation_tables.count_rows(statistics, layout)
    to.print(tables.make_table("", emulation_tables.COUNT_COLUMNS, rows, text=(2,)))
    if times := emulation_tables.time_rows(statistics):
        to.print(tables.make_table("", emulation_tables.TIME_COLUMNS, times))
    if png:
        from kr5_tools.rsi.timing_plot import write_timing_plot

        s = statistics
        write_timing_plot(png, to, period=s.period, answer=s.answer, lateness=s.lateness)
    shown = events if everything else emulation_tables.rare_events(events)
    to.print(
        tables.make_table("", emulation_tables.EVENT_COLUMNS, emulation_tables.event_rows(shown, layout), text=(1, 2))
    )
    if len(shown) < len(events):
        to.print(f"{format_count(len(events) - len(shown), 'more event')}; --all lists them.", soft_wrap=True)
    if statistics.overruns:
        terminal.print_note("this computer was late itself at times: not every missing answer is the client's fault.")
    writing.write_json(as_dict(statistics, events, layout), json_file)
    stopped = statistics.controller.stop.reason not in (rsi.ProgramStopReason.None_, rsi.ProgramStopReason.Asked)
    return stopped or statistics.controller.answered == 0


def as_dict(
    statistics: rsi.EmulatorStatistics, events: Sequence[rsi.ControllerEvent], layout: rsi.TelegramLayout
) -> dict[str, Any]:
    return {
        "controller": str(layout.controller),
        "address": layout.address,
        "port": layout.port,
        "transport": str(layout.transport),
        "message": rsi.stop_message(layout.controller, statistics.controller.stop),
        "statistics": statistics.to_dict(),
        "events": [event.to_dict() for event in events],
    }
