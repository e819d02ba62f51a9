"""`kr5 gap`: how far a simulation is from what was recorded, and why."""

from pathlib import Path
from typing import Annotated, Any

import kr5.gap
import typer
from kr5.files import results, writing
from kr5.files.documents import OpenDocument, display_value, parse_json, read_text, validate_document
from kr5.logs.compared_source import SourceOptions, input_files

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.arm_file import BaseOption, TipOption
from kr5_tools.cli.table_options import ColumnsOption, EpisodesOption
from kr5_tools.gap import bench, compare, diagnose, effects, explain, plan
from kr5_tools.gap.source import (
    ModelOption,
    SetOption,
    SourceArgument,
    TrustOption,
    overrides_of,
    print_source,
    read_source,
)
from kr5_tools.gap.terminal_report import print_measure

app = typer.Typer(no_args_is_help=True)
bench.add_to(app)
compare.add_to(app)
diagnose.add_to(app)
effects.add_to(app)
explain.add_to(app)
plan.add_to(app)

CellFile = Annotated[
    Path | None,
    typer.Option("--cell", metavar="CELL.yaml", help="The cell to simulate; by default the recording's own."),
]
ENOUGH_ROWS = 300  # a column of fewer rows is judged by chi-square alone
CLOSE = 1.05
CLOSE_INEXACT = 2.0  # of wrenches where an effect is simulated inexactly: a blow that lasts less than a row, say


@app.callback()
def gap() -> None:
    """Gap between simulation and recording, in units of noise: 1 is what noise alone leaves."""


@app.command(
    epilog="Examples: kr5 gap measure fresh.csv --model tuned.urdf; kr5 gap measure recordings/monday --cell tuned.yaml"
    " -o gap.json --png gap.png"
)
def measure(
    source: SourceArgument,
    cell_file: CellFile = None,
    model: ModelOption = None,
    base: BaseOption = "",
    tip: TipOption = "",
    every: arguments.EveryOption = None,
    columns: ColumnsOption = None,
    episodes: EpisodesOption = "",
    overrides: SetOption = None,
    trust: TrustOption = False,
    png: Annotated[
        Path | None, typer.Option("--png", metavar="GAP.png", help="Plot of the gap of every column (PNG).")
    ] = None,
    full: arguments.FullOption = False,
    everything: arguments.AllOption = False,
    json_file: arguments.JsonOption = None,
    output: arguments.ResultOption = None,
) -> None:
    """Gap of every column: RMS of (recorded - simulated) over its noise [-].

    Of a recording, or of logs with any model of the robot. Columns that the recording lacks are left out; experiments
    that the simulator cannot predict are listed.
    """
    import kr5.cell

    reading = SourceOptions(model, base, tip, every, overrides_of(overrides, columns), trust, episodes)
    own = input_files(source, reading) + ([cell_file] if cell_file else [])
    writing.check_writable(png, json_file, output, inputs=own)
    to = terminal.console(json_file)
    compared = read_source(source, reading)
    cell = kr5.cell.load_cell(cell_file) if cell_file else None
    name = Path(compared.name)
    with terminal.spinner(f"simulating {name}"):
        found = kr5.gap.measure(compared.recording, arguments.make_simulator(full), cell)
    if not found.columns:
        terminal.fail(
            f"{name}: nothing to compare; expected columns that the simulator predicts, and their noise in the cell"
        )
    print_measure(name, found, to, everything)
    print_source(compared, to, everything)
    data = results.write_result(output, **measure_dict(found), input=compared.inputs)
    writing.write_json(data, json_file)
    if png:
        draw_gaps(data, png, str(name))
        to.print(f"{png}: the gap of every column.", soft_wrap=True)


@app.command(epilog="Example: kr5 gap cases ../shared/cases --full")
def cases(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Folder of recordings with a labels.json of their effects.")
    ],
    full: arguments.FullOption = False,
    json_file: arguments.JsonOption = None,
) -> None:
    """Test of the simulator on recordings with known effects: sets these effects and prints the largest gap of each
    recording.

    Exit code 1 when a column of 300 rows or more is above 1.05 and above the limit of noise, or a shorter column
    above the limit of noise.
    """

    writing.check_writable(json_file, inputs=[folder])
    rows, far = [], 0
    out: dict[str, Any] = {}
    for name, label in terminal.track(list(_labels(folder).items()), "simulating"):
        found, text = measure_case(folder / name, label["effects"], full)
        if found.refused:
            terminal.fail(f"{folder / name}: {found.refused[0]}")
        if not found.columns:
            terminal.fail(f"{folder / name}: no column that the simulator predicts was recorded")
        widest = max(found.columns, key=lambda c: (c.rows >= ENOUGH_ROWS, c.gap))
        inexact = has_inexact(label["effects"])
        above = [c for c in found.columns if is_far(c, len(found.columns), inexact)]
        far += len(above)
        over = sum(c.rows >= ENOUGH_ROWS and c.gap > CLOSE for c in found.columns)
        rows.append(
            [
                name,
                text,
                f"{found.gap:.3f}",
                f"{widest.experiment}.{widest.column}",
                f"{widest.gap:.3f}",
                over,
                " ".join(f"{c.experiment}.{c.column}" for c in above) or "none",
            ]
        )
        out[name] = measure_dict(found)
    to = terminal.console(json_file)
    table = tables.make_table(
        f"{folder}, with the effects of labels.json set",
        [
            "recording",
            "effects",
            "RMS gap [-]",
            f"widest ({ENOUGH_ROWS}+ rows)",
            "gap [-]",
            f"> {CLOSE}",
            "unexplained",
        ],
        rows,
        text=(1, 3, 6),
    )
    to.print(table)
    writing.write_json(out, json_file)
    if far:
        raise typer.Exit(1)


def measure_case(folder: Path, effects: list[dict[str, Any]], full: bool = False) -> tuple[Any, str]:
    """Gap of a recording with these effects set in its cell, and the effects in words."""
    import kr5.cell

    recording = kr5.cell.load_recording(folder)
    cell = recording.cell
    for e in effects:
        for parameter, value in e["parameters"].items():
            cell.set_effect(e["effect"], e["target"], parameter, value)
    text = ", ".join(f"{e['effect']} {e['target']}" for e in effects) or "none"
    return kr5.gap.measure(recording, arguments.make_simulator(full), cell), text


def has_inexact(effects: list[dict[str, Any]]) -> bool:
    """Whether the catalogue says of one of the effects that its simulation is inexact."""
    import kr5.cell

    return any(kr5.cell.find_effect(e["effect"]).inaccuracy > 0 for e in effects)


def is_far(column: kr5.gap.ColumnGap, columns: int, inexact: bool) -> bool:
    """Above the floor: beyond what noise alone shows once in 1000 recordings with so many columns. `inexact`: an effect
    of the recording is simulated inexactly."""
    import kr5.cell

    limit = kr5.gap.noise_limit(column.rows, columns)
    if inexact and kr5.cell.find_column(column.kind, column.column).group == "wrench":
        limit = max(limit, CLOSE_INEXACT)
    return bool(column.gap > (max(limit, CLOSE) if column.rows >= ENOUGH_ROWS else limit))


class LabelledEffect(OpenDocument):
    effect: str
    target: str
    parameters: dict[str, Any]


class Label(OpenDocument):
    effects: list[LabelledEffect]


def _labels(folder: Path) -> dict[str, Any]:
    file = folder / "labels.json"
    expected = '{"case-000": {"effects": [{"effect": ..., "target": ..., "parameters": {...}}]}}'
    text = read_text(file, expected)
    labels = parse_json(text, file, expected)
    if not isinstance(labels, dict):
        terminal.fail(f"{file}: found {display_value(labels)}, expected {expected}")
    return {
        name: validate_document(label, Label, file, text, at=(name,)).model_dump(exclude_unset=True)
        for name, label in labels.items()
    }


def measure_dict(found: kr5.gap.Measure) -> dict[str, Any]:
    """The file form kr5-gap-measure/1."""
    return {
        "format": "kr5-gap-measure/1",
        "gap": found.gap,
        "parts": [part.to_dict() for part in found.parts],
        "columns": {f"{c.experiment}.{c.column}": c.gap for c in found.columns},
        "limits": {f"{c.experiment}.{c.column}": c.limit for c in found.columns},
    }


def draw_gaps(data: dict[str, Any], file: Path, title: str) -> None:
    """The gap of every column as a picture."""
    from kr5_tools.gap.measure_page import gap_figure
    from kr5_tools.pages.plot_style import plt

    figure = gap_figure(data["columns"], data["limits"])
    figure.axes[0].set_title(title)
    writing.save_figure(figure, file, dpi=110)
    plt.close(figure)
