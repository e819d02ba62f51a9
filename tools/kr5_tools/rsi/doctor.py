"""`kr5 rsi doctor`: what is wrong with a link."""

import time
from pathlib import Path
from typing import Annotated, Any

import typer
from kr5 import rsi
from kr5.files import writing
from rich.markup import escape

from kr5_tools.cli import arguments, tables, terminal
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
from kr5_tools.cli.terminal import Console
from kr5_tools.rsi.axis_mapping import (
    MAPPING_COLUMNS,
    find_mapping,
    is_as_joints,
    mapping_rows,
    mapping_sentence,
    mapping_text,
    settings_text,
)
from kr5_tools.rsi.findings import finding_words, verdict_sentence
from kr5_tools.rsi.timing_table import TIMING_COLUMNS, timing_rows

PERIOD = 0.1  # [s] between two looks at what came
COLOURS = {"sound": "green", "undecided": "yellow", "faulty": "red"}


def add_to(app: typer.Typer) -> None:
    app.command("doctor", epilog="Example: kr5 rsi doctor my_cell_ethernet.xml --for 10 --cell cell.yaml")(doctor)


@options_from(rsi.DiagnosisOptions, skip=("model",))
def doctor(
    layout_file: LayoutArgument,
    options: rsi.DiagnosisOptions,
    port: PortOption = None,
    settings: SettingsOption = None,
    seconds: Annotated[
        float, typer.Option("--for", metavar="SECONDS", min=0.5, max=600, help=r"Time of listening \[s].")
    ] = 10.0,
    cell: Annotated[
        Path | None,
        typer.Option("--cell", metavar="CELL.yaml", help="Cell whose arm the axis values and the pose are to fit."),
    ] = None,
    move: Annotated[
        bool,
        typer.Option(
            "--move",
            help="Move each axis by 0.1 degrees, or the tool by 0.5 mm and 0.1 degrees, there and back, to see whether"
            " corrections have the right sign, unit and axis. The arm must be free and someone at the stop.",
        ),
    ] = False,
    passive: PassiveOption = False,
    listen: ListenOption = "0.0.0.0",
    png: arguments.PngOption = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Diagnosis of the link to a controller: listens for some seconds and says what is wrong, and the remedy.

    The controller is answered without correction, unless --move or --passive is given. Exit code 0 where the link is
    sound, 1 where it is not or too little came, 2 for bad input.
    """
    writing.check_writable(json_file, inputs=[layout_file, settings, cell])
    layout = read_layout(layout_file, settings)
    if cell:
        import kr5.cell

        options.model = kr5.cell.load_cell(cell).sensor_model()
    motion = _test_motion(seconds, passive or layout.only_send) if move else None
    link = link_options(layout, options, listen, passive)
    recorder = rsi.LinkRecorder(listening_layout(layout, port), link, motion)
    seen = observe(recorder, seconds)
    diagnosis = rsi.examine_link(seen, layout, options)
    to = terminal.console(json_file)
    print_diagnosis(diagnosis, seen, layout, to)
    if png:
        from kr5_tools.rsi.timing_plot import write_timing_plot

        write_timing_plot(png, to, period=diagnosis.period, answer=diagnosis.answer)
    if move and (recorder.aborted or not diagnosis.motion_compared):
        terminal.print_note("the test motion was not made to its end; its part of the diagnosis is not complete.")
    if not diagnosis.pose_compared and cell:
        terminal.print_note("the layout tells no axis values or no pose, so that they were not compared with the cell.")
    mapping = find_mapping(seen, layout, options.model) if options.model else None
    if mapping:
        print_mapping(mapping, diagnosis, to)
    out = as_dict(diagnosis, seen, layout)
    out["axis_mapping"] = mapping_dict(mapping) if mapping else None
    writing.write_json(out, json_file)
    if str(diagnosis.verdict) != "sound":
        raise typer.Exit(1)


def _test_motion(seconds: float, silent: bool) -> rsi.TestMotionOptions:
    motion = rsi.TestMotionOptions()
    if silent:
        terminal.fail("--move: an arm is moved by answers; leave out --passive, and ONLYSEND of the layout")
    if seconds < motion.total + 1:
        terminal.fail(f"--for: the test motion takes {motion.total:.1f} s; listen for {motion.total + 1:.0f} s or more")
    return motion


def observe(recorder: rsi.LinkRecorder, seconds: float) -> rsi.LinkObservations:
    """What comes within a time."""
    seen = recorder.take()
    with terminal.share_bar(f"listening on port {recorder.port}") as show:
        begun = time.monotonic()
        while (since := time.monotonic() - begun) < seconds:
            time.sleep(min(PERIOD, seconds - since))
            seen.append(recorder.take())
            show(min(since / seconds, 1.0))
    return seen


def print_diagnosis(
    diagnosis: rsi.LinkDiagnosis, seen: rsi.LinkObservations, layout: rsi.TelegramLayout, to: Console
) -> None:
    """Verdict, findings with remedies, times."""
    word = str(diagnosis.verdict)
    sentence = escape(verdict_sentence(diagnosis, seen))
    to.print(f"[bold {COLOURS[word]}]{word.capitalize()}:[/] {sentence}", soft_wrap=True, markup=True)
    for finding in diagnosis.findings:
        text, remedy = finding_words(finding, layout)
        name = str(finding.kind).replace("_", " ")
        to.print(f"  - [bold]{name}[/] ({finding.severity}): {escape(text)}.", soft_wrap=True, markup=True)
        to.print(f"    Remedy: {escape(remedy)}.", soft_wrap=True, markup=True)
    if rows := timing_rows(period=diagnosis.period, answer=diagnosis.answer):
        to.print(tables.make_table("\nTimes", TIMING_COLUMNS, rows))


def print_mapping(result: rsi.AxisMappingResult, diagnosis: rsi.LinkDiagnosis, to: Console) -> None:
    """How the controller counts its axes, where that is not as the cell says."""
    differs = any(str(finding.kind) == "pose_mismatch" for finding in diagnosis.findings)
    if not differs or (result.mappings and is_as_joints(result.mappings[0])):
        return
    to.print(f"\nAxes of the controller: {mapping_sentence(result)}.", soft_wrap=True, markup=False)
    for mapping in result.mappings:
        misfit = f"{1e3 * mapping.position_misfit:.2g} mm, {mapping.rotation_misfit:.2g} rad"
        to.print(tables.make_table(f"\nMisfit at most {misfit}", MAPPING_COLUMNS, mapping_rows(mapping), text=(1,)))
        to.print(settings_text(mapping), soft_wrap=True, markup=False)


def mapping_dict(result: rsi.AxisMappingResult) -> dict[str, Any]:
    """What the JSON holds of the axes."""
    out = result.to_dict()
    out["sentence"] = mapping_sentence(result)
    for entry, mapping in zip(out["mappings"], result.mappings):
        entry["text"] = mapping_text(mapping)
    return out


def as_dict(diagnosis: rsi.LinkDiagnosis, seen: rsi.LinkObservations, layout: rsi.TelegramLayout) -> dict[str, Any]:
    """What the JSON holds: fields of the library, and the words made of them."""
    out = {**seen.to_dict(), **diagnosis.to_dict()}
    for entry, finding in zip(out["findings"], diagnosis.findings):
        entry["text"], entry["remedy"] = finding_words(finding, layout)
    return out
