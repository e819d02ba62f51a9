"""`kr5 cell`: check a cell or a recording, and show it."""

from pathlib import Path
from typing import Annotated, Any

import kr5.cell
import kr5.io
import typer
from kr5.files import writing

from kr5_tools.cell.frames import DEG, carried_frames, cell_frames, fixed_frames, is_slide
from kr5_tools.cell.rest_posture import rest_posture
from kr5_tools.cell.tables import cell_tables, recording_table
from kr5_tools.cli import arguments, terminal
from kr5_tools.cli.numbers import format_count
from kr5_tools.cli.terminal import Console

app = typer.Typer(no_args_is_help=True)

What = Annotated[Path, typer.Argument(metavar="PATH", help="A cell file, a recording, or a folder of any of these.")]


@app.command(epilog="Example: kr5 cell check recordings/ --json problems.json")
def check(path: What, json_file: arguments.JsonOption = None) -> None:
    """Check of cells and recordings: file, line, field, found and expected value of every finding.

    Exit code 2 when there is a problem.
    """
    writing.check_writable(json_file, inputs=[path])
    with terminal.spinner(f"reading {path}"):
        documents = kr5.cell.find_documents(path)
        problems = kr5.cell.check(path)
    writing.write_json({"checked": [str(d) for d in documents], "problems": [p.to_dict() for p in problems]}, json_file)
    writing.publish()  # also where there are problems, which are what was asked for
    to = terminal.console(json_file)
    if not problems:
        recordings = sum(d.name == "recording.yaml" for d in documents)
        cells = len(documents) - recordings
        counts = [format_count(n, what) for n, what in ((recordings, "recording"), (cells, "cell")) if n]
        to.print(
            f"{path}: no problem in {' and '.join(counts)}.",
            soft_wrap=True,
        )
        return
    _show_problems(problems, path, to)
    raise typer.Exit(2)


def _show_problems(problems: list[kr5.io.Diagnostic], path: Path, to: Console) -> None:
    from rich.markup import escape
    from rich.table import Table

    by_file: dict[str, list[Any]] = {}
    for problem in problems:
        by_file.setdefault(problem.file, []).append(problem)
    for file, found in by_file.items():
        table = Table(title=file, title_justify="left", box=None, header_style="bold")
        table.add_column("line", justify="right")
        for column in ("field", "found", "expected"):
            table.add_column(column, overflow="fold")
        for p in found:
            table.add_row(str(p.line or ""), p.field, p.found, p.expected)
        to.print(table)
    files = format_count(len(by_file), "file")
    to.print(
        f"[red]{format_count(len(problems), 'problem')} in {files}[/red] of {escape(str(path))}.",
        soft_wrap=True,
        markup=True,
    )


Base = Annotated[
    str,
    typer.Option(metavar="LINK", help="Link or body that is the base B; by default the root (MJCF: the world)."),
]
Tip = Annotated[
    str,
    typer.Option(
        metavar="LINK",
        help="Link, body or site that is the tool tip E; by default the end of the chain, when there is only one.",
    ),
]


@app.command("import", epilog="Example: kr5 cell import panda.urdf --tip panda_hand -o panda.yaml")
def import_robot(
    robot: Annotated[
        Path,
        typer.Argument(
            metavar="ROBOT",
            help="URDF, or MJCF of MuJoCo, which the content tells; a xacro file must be expanded by xacro first.",
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="CELL.yaml", help="Cell file to write.")],
    base: Base = "",
    tip: Tip = "",
    json_file: arguments.JsonOption = None,
) -> None:
    """Cell from the URDF or MJCF of a robot: the serial arm from base to tip, with exact poses and masses."""
    from kr5.models import read_model

    writing.check_writable(output, json_file, inputs=[robot])
    found = read_model(robot, base, tip)
    with writing.beside(output) as new:
        kr5.cell.save_cell(found.cell, new)
    writing.write_json(
        {
            "kind": str(found.kind),
            "cell": found.cell,
            "base": found.base,
            "tip": found.tip,
            "joints": found.joints,
            "notes": found.notes,
        },
        json_file,
    )
    to = terminal.console(json_file)
    way = f" from {found.base} to {found.tip}" if found.base else ""
    to.print(
        f"{output}: {format_count(len(found.joints), 'joint')}{way}: {', '.join(found.joints)}.",
        soft_wrap=True,
        markup=False,
    )
    for note in found.notes:
        to.print(f"Note: {note}.", soft_wrap=True, markup=False)


@app.command("export", epilog="Example: kr5 cell export tuned.yaml --original robot.urdf -o tuned.urdf")
def export_robot(
    cell: Annotated[Path, typer.Argument(metavar="CELL.yaml", help="A cell file.")],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="File to write: .urdf, .xml (MJCF of MuJoCo), .sdf (Gazebo), .drake.sdf (Drake), .py (actuators of"
            " Isaac Lab), or .yaml (cell).",
        ),
    ],
    original: Annotated[
        Path | None,
        typer.Option(
            metavar="ROBOT",
            help="URDF or MJCF from which the cell was imported: only what differs is changed in it.",
        ),
    ] = None,
    base: Base = "",
    tip: Tip = "",
    json_file: arguments.JsonOption = None,
) -> None:
    """Model of the arm of a cell for ROS, MuJoCo or Gazebo, with the effects of the cell in it.

    Every effect that the format can hold becomes a nominal value; every other one is listed with the reason.
    """
    from kr5.models import write_model

    from kr5_tools.cell.export_tables import print_export

    writing.check_writable(output, json_file, inputs=[cell, original])
    if (base or tip) and original is None:
        terminal.fail("--base, --tip: only with --original, whose links they name")
    written = write_model(kr5.cell.load_cell(cell), output, original, base, tip)
    writing.write_json(written, json_file)
    print_export(written, terminal.console(json_file))


@app.command(epilog="Example: kr5 cell show cell.yaml -o arm.png --q 0,-20,-120,0,30,0")
def show(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="A cell file, or the folder of a recording.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="ARM.png", help="Drawing of the arm (PNG).")
    ] = None,
    q: Annotated[
        str | None,
        typer.Option(
            metavar="Q1,Q2,...",
            help=(
                "Joint values of the drawing [deg, mm for a prismatic joint]; by default the first recorded posture, or"
                " one near zero within the limits."
            ),
        ),
    ] = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Tables and drawing of a cell; of a recording also its experiments."""
    writing.check_writable(output, json_file, inputs=[path])
    recording = kr5.cell.load_recording(path) if (path / "recording.yaml").is_file() else None
    if recording is None and path.is_dir():
        terminal.fail(
            f"{path}: is a folder without a recording.yaml; expected a cell file or the folder of a recording"
        )
    cell = recording.cell if recording else kr5.cell.load_cell(path)
    posture = parse_posture(q, cell) if q else rest_posture(cell, recording)
    to = terminal.console(json_file)
    for table in cell_tables(cell) + ([recording_table(recording)] if recording else []):
        to.print(table)
        to.print()
    if output:
        draw_arm(cell, posture, output)
        to.print(f"{output}: the arm of {cell.name or path} at q = {posture_text(posture, cell)}.", soft_wrap=True)
    data = {"cell": cell, "q": posture, "frames": cell_frames(cell, posture)}
    if recording:
        data["experiments"] = [
            {**e.to_dict(), "rows": len(e.data), "columns": e.data.columns} for e in recording.experiments
        ]
    writing.write_json(data, json_file)


def parse_posture(text: str, cell: kr5.cell.Cell) -> list[float]:
    """Joint values in rad and m from degrees and millimetres."""
    words = text.replace(",", " ").split()
    if len(words) != cell.robot.joints:
        terminal.fail(
            f"--q: found {len(words)} values, expected {cell.robot.joints}, one a joint, such as --q 0,-20,45"
        )
    try:
        return [float(w) / (1000 if is_slide(cell, i) else DEG) for i, w in enumerate(words)]
    except ValueError:
        terminal.fail(
            f"--q: found '{text}', expected numbers in degrees (mm for a prismatic joint), separated by commas"
        )


def posture_text(q: list[float], cell: kr5.cell.Cell) -> str:
    return ", ".join(
        f"{1000 * v:.1f} mm" if is_slide(cell, i) else f"{round(DEG * v, 1) + 0.0:.1f}°" for i, v in enumerate(q)
    )


def draw_arm(cell: kr5.cell.Cell, q: list[float], output: Path) -> None:
    from kr5_tools.cell.plot import arm_figure

    if output.suffix.lower() not in (".png", ".svg", ".pdf"):
        terminal.fail(f"{output}: found the ending '{output.suffix}', expected .png, .svg or .pdf")
    figure = arm_figure(
        cell, q, fixed_frames(cell), carried_frames(cell, q), f"{cell.name}, q = {posture_text(q, cell)}"
    )
    writing.save_figure(figure, output, dpi=160)
