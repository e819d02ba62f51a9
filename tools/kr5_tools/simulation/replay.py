"""`kr5 replay`: one self-contained page in which a cell moves as it was recorded or planned, above its signals."""

from pathlib import Path
from typing import Annotated, Any

import kr5.cell
import typer
from kr5.files import writing
from kr5.files.documents import read_yaml

from kr5_tools.cli import arguments, terminal
from kr5_tools.cli.numbers import format_count
from kr5_tools.cli.rerun_option import Rerun
from kr5_tools.replay.page import make_page
from kr5_tools.replay.rerun_log import write_rerun
from kr5_tools.replay.runs import Run, Skipped, experiment_runs, joint_by_joint

app = typer.Typer()

CellFile = Annotated[
    Path | None,
    typer.Option(
        "--cell",
        metavar="CELL.yaml",
        help="Cell to simulate; by default the recording's own. Required for a protocol.",
        show_default=False,
    ),
]


@app.command(epilog="Example: kr5 replay share/data/friction -o replay.html")
def replay(
    path: Annotated[
        Path,
        typer.Argument(metavar="PATH", help="Folder of a recording, protocol (kr5-protocol/1), or cell file."),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The page.")] = Path("replay.html"),
    cell_file: CellFile = None,
    rows: Annotated[int, typer.Option(min=2, help="Largest number of postures of one experiment.")] = 800,
    seed: Annotated[int, typer.Option(min=0, help="Random seed of the postures of a protocol.")] = 1,
    full: arguments.FullOption = False,
    rerun: Rerun = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Page with the cell in 3D and, on the same time axis, the recorded and simulated signals with their residuals.

    A protocol is shown as planned, with simulated signals; of a cell file, each joint moves in turn.
    """
    writing.check_writable(output, rerun, json_file, inputs=[path, cell_file])
    cell, runs, skipped = load_runs(path, cell_file, rows, seed, full)
    if not runs:
        reasons = "; ".join(f"{s.name}: {s.reason}" for s in skipped)
        terminal.fail(f"{path}: nothing can be shown: {reasons}")
    writing.write_text(make_page(cell, runs, path, skipped=skipped), output)
    to = terminal.console(json_file)
    write_rerun(rerun, cell, runs, to)
    shown = [
        {"name": r.name, "postures": len(r.t), "duration": float(r.t[-1]), "signals": [s.name for s in r.signals]}
        for r in runs
    ]
    for each in skipped:
        terminal.print_note(f"{each.name} is not shown: {each.reason}")
    for run in runs:
        if run.remark:
            terminal.print_note(f"{run.name}: {run.remark}")
    writing.write_json(
        {"replay": str(output), "runs": shown, "skipped": [vars(each) for each in skipped]},
        json_file,
    )
    counts = {"run": len(runs), "frame": sum(len(r.t) for r in runs), "signal": sum(len(r.signals) for r in runs)}
    told = ", ".join(format_count(number, noun) for noun, number in counts.items())
    to.print(
        f"{output}: {told}. Open it in a browser.",
        soft_wrap=True,
        markup=False,
    )


def load_runs(
    path: Path, cell_file: Path | None, rows: int, seed: int, full: bool
) -> tuple[Any, list[Run], list[Skipped]]:
    """What the path holds: the cell, what moves, and what cannot be shown."""
    cell = kr5.cell.load_cell(cell_file) if cell_file else None
    if (path / "recording.yaml").is_file():
        recording = kr5.cell.load_recording(path)
        check_same_joints(recording.cell, cell, cell_file)
        cell = cell or recording.cell
        return cell, *experiment_runs(cell, list(recording.experiments), arguments.make_simulator(full), rows)
    if path.is_dir():
        terminal.fail(
            f"{path}: is a folder without a recording.yaml; expected the folder of a recording, a protocol or a cell"
            " file"
        )
    if is_protocol(path):
        return planned_runs(path, cell, rows, seed, full)
    if cell is not None:
        terminal.fail(f"--cell: {path} is not a recording or a protocol; expected --cell with one of these only")
    cell = kr5.cell.load_cell(path)
    return cell, [joint_by_joint(cell)], []


def check_same_joints(recorded: kr5.cell.Cell, cell: kr5.cell.Cell | None, cell_file: Path | None) -> None:
    if cell is not None and cell.robot.joints != recorded.robot.joints:
        terminal.fail(
            f"{cell_file}: robot: found {cell.robot.joints} joints, expected the {recorded.robot.joints} of the"
            " recording"
        )


def is_protocol(path: Path) -> bool:
    """Whether a file says that it is one."""
    if not path.is_file() or path.suffix.lower() not in (".yaml", ".yml", ".json"):
        return False
    content = read_yaml(path)
    return isinstance(content, dict) and str(content.get("format", "")).startswith("kr5-protocol/")


def planned_runs(
    path: Path, cell: kr5.cell.Cell | None, rows: int, seed: int, full: bool
) -> tuple[Any, list[Run], list[Skipped]]:
    """The experiments of a protocol as a cell would run them."""
    from kr5_tools.simulation import protocol_file
    from kr5_tools.simulation.experiments import with_load

    if cell is None:
        terminal.fail(f"{path}: is a protocol, which needs the cell that runs it; add --cell CELL.yaml")
    cell = with_load(cell, protocol_file.load_on_tool(path))
    with terminal.spinner(f"choosing the postures of {path}"):
        experiments = protocol_file.load_protocol(path, cell, seed)
    return cell, *experiment_runs(cell, experiments, arguments.make_simulator(full), rows)
