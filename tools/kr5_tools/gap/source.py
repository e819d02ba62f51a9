"""What is compared: a recording, or logs with a model of the robot in them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from kr5_tools.cli import tables, terminal
from kr5_tools.log_import.log_file import ENDINGS

SourceArgument = Annotated[
    list[Path],
    typer.Argument(
        metavar="SOURCE...",
        help=(
            "Folder of a recording (recording.yaml); or logs of a robot, with --model: "
            + ", ".join(f".{e}" for e in ENDINGS)
            + ", folders of ROS 2 bags."
        ),
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
BaseOption = Annotated[
    str, typer.Option("--base", metavar="LINK", help="Link of the model that is the base; by default its root.")
]
TipOption = Annotated[
    str, typer.Option("--tip", metavar="LINK", help="Link of the model that is the tool; by default its only end.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help=(
            "Entry of the map of the logs in place of the one found, e.g. columns.tau.scale=-1, or of the model's cell,"
            " e.g. cell.drives.structure=[[...]]. May be given several times."
        ),
    ),
]
TrustOption = Annotated[bool, typer.Option("--trust", help="Compare although some numbers are implausible.")]


@dataclass
class ComparedSource:
    """A recording, and how it came to be."""

    recording: Any
    name: str
    folder: Path | None = None  # of a recording on the disk
    command: str = ""  # as it is given to a command
    model: Any = None  # kr5_tools.model_files.reading.Model, where one was given
    inputs: dict[str, Any] = field(default_factory=dict)  # of a result file
    reasons: list[list[str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    simulator_errors: list[Any] = field(default_factory=list)


@dataclass
class SourceOptions:
    model: Path | None = None
    base: str = ""
    tip: str = ""
    every: float | None = None
    overrides: list[str] = field(default_factory=list)
    trust: bool = False


def input_files(paths: Sequence[Path], options: SourceOptions) -> list[Path]:
    """Files that must not be written over."""
    own = [p for path in paths for p in ((path / "recording.yaml", path / "cell.yaml") if path.is_dir() else (path,))]
    return [*own, *([options.model] if options.model else [])]


def open_source(paths: Sequence[Path], options: SourceOptions) -> ComparedSource:
    """Reads what is to be compared; ends with an error that says what is missing, and how to give it."""
    recordings = [p for p in paths if (p / "recording.yaml").is_file()]
    if recordings and len(paths) > 1:
        terminal.fail(f"{recordings[0]}: is a recording, beside other sources; expected one recording, or logs")
    return _open_recording(paths[0], options) if recordings else _open_logs(paths, options)


def _open_recording(folder: Path, options: SourceOptions) -> ComparedSource:
    import kr5.cell

    if options.every is not None or options.overrides:
        terminal.fail(f"{folder}: is a recording; --every and --set are for logs")
    out = ComparedSource(kr5.cell.load_recording(folder), str(folder), folder, command=str(folder))
    out.inputs = {"recording": str(folder.resolve())}
    if options.model:
        out.command += f" --model {options.model}"
        out.model = _read_model(options)
        out.recording.cell = out.model.cell
        out.inputs["model"] = str(options.model.resolve())
    return out


def _open_logs(paths: Sequence[Path], options: SourceOptions) -> ComparedSource:
    from kr5_tools.log_import.log_recording import LogOptions, record_logs, require_plausible

    _require_logs(paths)
    if options.model is None:
        terminal.fail(
            f"{paths[0]}: is a log; expected --model with the model of its robot (URDF, MJCF or cell file), or the"
            " folder of a recording (recording.yaml)"
        )
    model = _read_model(options)
    described = str(model.kind) != "cell"
    with terminal.spinner("Reading the logs"):
        found = record_logs(paths, model.cell, LogOptions(options.every, options.overrides, options.trust), described)
    require_plausible(found, options.trust)
    names = ", ".join(p.name for p in paths)
    return ComparedSource(
        found.recording,
        names,
        command=_command(paths, options),
        model=model,
        inputs={"logs": [str(p.resolve()) for p in paths], "model": str(options.model.resolve())},
        reasons=found.reasons,
        notes=[*model.notes, *found.notes],
        simulator_errors=found.simulator_errors,
    )


def _command(paths: Sequence[Path], options: SourceOptions) -> str:
    words = [*map(str, paths), "--model", str(options.model)]
    for option, value in (("--base", options.base), ("--tip", options.tip), ("--every", options.every)):
        words += [option, str(value)] if value else []
    return " ".join([*words, *(f"--set '{text}'" for text in options.overrides)])


def _require_logs(paths: Sequence[Path]) -> None:
    from kr5_tools.log_import.bag_file import is_bag_folder

    for path in paths:
        if path.is_dir() and not is_bag_folder(path):
            terminal.fail(
                f"{path}: is a folder without recording.yaml (a recording) or metadata.yaml (a ROS 2 bag); expected"
                " one of these, or log files"
            )


def _read_model(options: SourceOptions) -> Any:
    from kr5_tools.model_files.reading import read_model

    assert options.model is not None, "asked for with a model"
    return read_model(options.model, options.base, options.tip)


def print_source(source: ComparedSource, to: Any, everything: bool) -> None:
    """How logs were understood: with everything as a table with reasons, else in a line an item."""
    if source.reasons and everything:
        to.print(
            tables.make_table("How the logs were read", ["item", "proposal", "reason"], source.reasons, text=(1, 2))
        )
    elif source.reasons:
        to.print("How the logs were read (--all gives the reasons)", style="bold")
        for item, proposal, _ in source.reasons:
            to.print(f"  - {escape(item)}: {escape(proposal)}", soft_wrap=True, markup=True)
    for note in source.notes:
        to.print(f"  - {escape(note)}.", soft_wrap=True, markup=True)
    if source.reasons or source.notes:
        to.print()
