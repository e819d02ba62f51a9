"""`kr5 gap diagnose`: why simulation and cell disagree."""

import json
from pathlib import Path
from typing import Annotated, Any

import kr5.gap
import typer
from rich.markup import escape

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.numbers import format_number
from kr5_tools.cli.options import options_from
from kr5_tools.files import results, writing

Folder = Annotated[Path, typer.Argument(metavar="RECORDING", help="The folder of a recording (recording.yaml).")]
Report = Annotated[
    Path | None,
    typer.Option(
        "--report",
        metavar="PAGE.html",
        help=(
            "Page of the diagnosis: map of the cell, causes with evidence for and against, residuals before and after."
        ),
    ),
]
WriteCell = Annotated[
    Path | None, typer.Option("--write-cell", metavar="CELL.yaml", help="Cell file with the causes added.")
]
WORDS = {
    "no_gap": ("green", "the nominal cell explains what the recording can show"),
    "explained": ("green", "with the causes below, no structure remains"),
    "partly_explained": ("yellow", "causes were found, but a structured gap remains"),
    "unknown": ("red", "no effect of the catalogue explains the gap above the floor"),
}


def add_to(app: typer.Typer) -> None:
    app.command(
        "diagnose", epilog="Example: kr5 gap diagnose recordings/monday --report gap.html --write-cell tuned.yaml"
    )(diagnose)


@options_from(kr5.gap.DiagnoseOptions)
def diagnose(
    folder: Folder,
    options: kr5.gap.DiagnoseOptions,
    write_cell: WriteCell = None,
    report: Report = None,
    full: arguments.FullOption = False,
    json_file: arguments.JsonOption = None,
    output: arguments.ResultOption = None,
) -> None:
    """Diagnosis of a gap: where it lies, which effects cause it, how far they reduce it, and what remains unexplained.

    Effects are fitted on the `fit` experiments of the recording and evaluated on its `check` experiments.
    """
    import kr5.cell

    options.validate()
    writing.check_writable(
        write_cell, report, output, json_file, inputs=[folder / "recording.yaml", folder / "cell.yaml"]
    )
    recording = kr5.cell.load_recording(folder)
    found = run_diagnosis(recording, arguments.make_simulator(full), options)
    data = json.loads(found.to_json())
    keys = {key: value for key, value in data.items() if key != "format"}
    result = results.write_result(
        output, "kr5-gap/1", **keys, input={"recording": str(folder.resolve())}, seconds=found.seconds
    )
    writing.write_json(data, json_file)
    if write_cell:
        with writing.beside(write_cell) as new:
            kr5.cell.save_cell(found.cell, new)
    print_diagnosis(found, terminal.console(json_file))
    if report:
        from kr5_tools.gap_report.page import write_gap_report

        write_gap_report(result, output or folder, report)
        terminal.console(json_file).print(f"report: {report}", soft_wrap=True)


def run_diagnosis(recording: Any, simulator: Any, options: Any) -> Any:
    """The diagnosis, with a bar for people at a terminal."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    if not terminal.errors.is_terminal:
        return kr5.gap.diagnose(recording, simulator, options)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=terminal.errors, transient=True) as bars:
        bar = bars.add_task("reading", total=1.0)

        def progress(stage: str, fraction: float) -> None:
            bars.update(bar, description=stage, completed=fraction)

        return kr5.gap.diagnose(recording, simulator, options, progress)


def print_diagnosis(found: Any, to: Any) -> None:
    """The diagnosis for people."""
    word = str(found.verdict)
    colour, text = WORDS[word]
    to.print(f"[bold {colour}]{word}[/]: {text}.", soft_wrap=True, markup=True)
    for limit in found.scope:
        to.print(f"[yellow]limit:[/yellow] {escape(limit)}.", soft_wrap=True, markup=True)
    for warning in found.warnings:
        to.print(f"[yellow]note:[/yellow] {escape(warning)}.", soft_wrap=True, markup=True)
    if found.scatter:
        to.print(
            f"Masses and torque constants are uncertain by about {100 * found.scatter:.1f} %,"
            " friction by twice as much; this is not a cause."
        )
    if found.where:
        to.print(_places("Where", found.where[:12], True))
    for cause in found.causes:
        to.print(_cause(cause), soft_wrap=True, markup=True)
    if found.reduction.columns:
        reduction = found.reduction
        low, high = reduction.after_ci.low, reduction.after_ci.high
        to.print(
            f"The gap falls from {reduction.before:.2f} to {reduction.after:.2f} ({low:.2f} to {high:.2f})"
            " times the noise, over the columns above the floor, on experiments not used for the fit.",
            soft_wrap=True,
        )
    if found.unexplained:
        to.print(_places("Remaining structure", found.unexplained[:12], False))
    if found.next_experiment.separates:
        to.print(
            f"To distinguish {', '.join(found.next_experiment.separates)}: {found.next_experiment.to_dict()['do']}.",
            soft_wrap=True,
        )


def _places(title: str, places: Any, share: bool) -> Any:
    rows = [
        [
            f"{p.experiment}.{p.column}",
            p.target,
            p.gap,
            *([p.share] if share else []),
            "; ".join(f"{d.variable}: {d.how}" for d in p.depends_on[:2]),
        ]
        for p in places
    ]
    out = tables.make_table(
        title, ["column", "target", "gap [-]", *(["share [-]"] if share else []), "depends on"], rows
    )
    for column in (1, -1):
        out.columns[column].justify = "left"
    return out


def _cause(cause: Any) -> str:
    values = []
    for p in cause.parameters:
        if len(p.value) == 16:
            values.append(f"{p.name} shifted, ± {max(p.std[:3]):.2g} m, ± {max(p.std[3:]):.2g} rad")
            continue
        numbers = ", ".join(
            f"{format_number(v, s)} ± {format_number(s, s)}" if s else f"{v:g}" for v, s in zip(p.value, p.std)
        )
        values.append(f"{p.name} {numbers} {p.unit}")
    tied = "".join(f"; not distinguishable from {t.effect} on {t.target}" for t in cause.tied_with)
    return (
        f"[bold]{cause.effect}[/bold] on {cause.target}, probability {cause.probability:.2f}: "
        f"{escape('; '.join(values))}; explains {100 * cause.explained_fraction:.0f} % of the"
        f" excess not explained by the other causes{tied}."
    )
