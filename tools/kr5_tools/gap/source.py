"""Options of what is compared, and what is printed of it."""

from pathlib import Path
from typing import Annotated

import kr5.cell
import typer
from kr5.logs.column_list import header_entry
from kr5.logs.compared_source import ComparedSource, SourceOptions, open_source
from kr5.logs.log_file import LOG_FORMATS
from rich.markup import escape

from kr5_tools.cli import tables, terminal
from kr5_tools.cli.terminal import Console

SourceArgument = Annotated[
    list[Path],
    typer.Argument(
        metavar="SOURCE...",
        help=f"Folder of a recording (recording.yaml); or logs of a robot, with --model: {LOG_FORMATS}.",
    ),
]
ModelOption = Annotated[
    Path | None,
    typer.Option(
        "--model",
        metavar="MODEL",
        help=(
            "Model of the robot in the logs: URDF, MJCF (MuJoCo) or cell file. With a recording: model in place of its"
            " own cell."
        ),
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help=(
            "Entry of the map of the logs in place of the one found, e.g. columns.tau.scale=-1, or of the model's cell,"
            " e.g. cell.drives.structure=[[...]]; end=SECONDS, end.LOG=SECONDS: use a log up to there. May be given"
            " several times."
        ),
    ),
]


def overrides_of(settings: list[str] | None, columns: str | None) -> list[str]:
    """Entries of the map of the logs, those of --columns included."""
    return [*([header_entry(columns)] if columns else []), *(settings or [])]


TrustOption = Annotated[bool, typer.Option("--trust", help="Compare although some numbers are implausible.")]


def read_source(paths: list[Path], options: SourceOptions) -> ComparedSource:
    """What is to be compared, with a sign of life while logs are read."""
    with terminal.spinner("Reading the logs"):
        return open_source(paths, options)


def known_target(target: str, cell: kr5.cell.Cell) -> str:
    """The target of an effect, which may be named as the joint is in the model of the robot; `joint3` is always the
    third of the chain."""
    if target.rstrip("0123456789") in ("joint", "motor"):
        return target
    names = list(cell.robot.joint_names)
    return f"joint{names.index(target) + 1}" if target in names else target


def print_source(source: ComparedSource, to: Console, everything: bool) -> None:
    """How logs were understood: with everything as a table with reasons, else in a line an item."""
    if not source.reasons and not source.notes:
        return
    to.print()
    if source.reasons and everything:
        to.print(
            tables.make_table("How the logs were read", ["item", "proposal", "reason"], source.reasons, text=(1, 2))
        )
    elif source.reasons:
        to.print("How the logs were read (--all gives the reasons)", style="bold")
        for item, proposal, _ in source.reasons:
            to.print(f"  - {escape(item)}: {escape(proposal)}", soft_wrap=True, markup=True)
    for note in source.notes:
        to.print(f"  - {escape(note)}{'' if note.endswith('?') else '.'}", soft_wrap=True, markup=True)
