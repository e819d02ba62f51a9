"""What a simulation is compared with: a recording, or logs with a model of the robot in them."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import kr5
import kr5.cell
from kr5.logs.command_limits import clamped_commands
from kr5.logs.log_file import ENDINGS, FOLDER_WORDS, is_log_folder

if TYPE_CHECKING:
    from kr5.models.reading import Model


@dataclass
class SourceOptions:
    model: Path | None = None
    base: str = ""
    tip: str = ""
    every: float | None = None
    overrides: list[str] = field(default_factory=list)
    trust: bool = False
    episodes: str = ""
    check: str = ""


@dataclass
class ComparedSource:
    """A recording, and how it came to be."""

    recording: Any
    name: str
    model: Any = None  # kr5.models.reading.Model, where one was given
    inputs: dict[str, Any] = field(default_factory=dict)  # of a result file
    reasons: list[list[str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    best_arm: Any = None  # kr5.arm_log.BestArmErrors
    command: str = ""  # as it is given to a command


def input_files(paths: Sequence[Path], options: SourceOptions) -> list[Path]:
    """Files and folders that must not be written over."""
    return [*paths, *([options.model] if options.model else [])]


def open_source(paths: Sequence[Path], options: SourceOptions) -> ComparedSource:
    """Reads what is to be compared; ends with an error that says what is missing, and how to give it."""
    for path in paths:
        if not path.exists():
            raise kr5.FileError(
                path,
                f"no such file or folder; expected the folder of a recording (recording.yaml), or a log"
                f" ({', '.join('.' + e for e in ENDINGS)}, or {FOLDER_WORDS})",
            )
    recordings = [p for p in paths if (p / "recording.yaml").is_file()]
    if recordings and len(paths) > 1:
        raise kr5.FileError(recordings[0], "is a recording, beside other sources; expected one recording, or logs")
    out = _open_recording(paths[0], options) if recordings else _open_logs(paths, options)
    out.inputs |= _reading_inputs(options)
    out.command = shlex.join([*map(str, paths), *_option_words(options)])
    return out


def reopen_source(inputs: dict[str, Any], beside: Path, folder: Path | None = None) -> ComparedSource | None:
    """What a result file was made of, by its `input`; nothing where a file of it is gone. `beside`: folder of the
    result file, in which files are looked for, too; `folder`: a recording in place of the named one."""
    recording = folder or _found(inputs.get("recording"), beside)
    # A recording that was made of logs has their model as its cell.
    model = inputs.get("model") if recording is None or "logs" not in inputs else None
    paths = [recording] if recording else [_found(log, beside) for log in inputs.get("logs", [])]
    there = [path for path in paths if path is not None]
    file = _found(model, beside)
    if not there or len(there) < len(paths) or (model and file is None):
        return None
    if recording:
        return open_source(there, SourceOptions(file, *_arm_of(inputs, file)))
    return open_source(there, _log_options(inputs, file))


def command_of(inputs: dict[str, Any]) -> str:
    """What a result file was made of, as a command takes it."""
    if "logs" not in inputs:
        model = inputs.get("model")
        options = SourceOptions(Path(model) if model else None, inputs.get("base", ""), inputs.get("tip", ""))
        return shlex.join([str(inputs.get("recording", "RECORDING")), *_option_words(options)])
    return shlex.join([*inputs["logs"], *_option_words(_log_options(inputs, Path(inputs["model"])))])


def _log_options(inputs: dict[str, Any], model: Path | None) -> SourceOptions:
    """How logs were read, by the `input` of a result file."""
    return SourceOptions(
        model,
        *_arm_of(inputs, model),
        inputs.get("every"),
        list(inputs.get("set", [])),
        bool(inputs.get("trust")),
        str(inputs.get("episodes", "")),
        str(inputs.get("check", "")),
    )


def name_of(inputs: dict[str, Any]) -> str:
    """What a result file was made of, for people."""
    if "logs" in inputs:
        return ", ".join(Path(log).name for log in inputs["logs"])
    return str(inputs.get("recording", "RECORDING"))


def _found(name: object, beside: Path) -> Path | None:
    files = (Path(name), beside / name) if isinstance(name, str) else ()
    return next((file for file in files if file.exists()), None)


def _arm_of(inputs: dict[str, Any], model: Path | None) -> tuple[str, str]:
    return (inputs.get("base", ""), inputs.get("tip", "")) if model else ("", "")


def _reading_inputs(options: SourceOptions) -> dict[str, Any]:
    """The options of reading that were given, for a result file."""
    out: dict[str, Any] = {"model": str(options.model.resolve()) if options.model else None}
    out |= {"base": options.base, "tip": options.tip, "every": options.every, "set": options.overrides}
    out |= {"trust": options.trust, "episodes": options.episodes, "check": options.check}
    return {key: value for key, value in out.items() if value}


def _option_words(options: SourceOptions) -> list[str]:
    words = []
    for option, value in (
        ("--model", options.model),
        ("--base", options.base),
        ("--tip", options.tip),
        ("--every", options.every),
        ("--episodes", options.episodes),
        ("--check", options.check),
        *(("--set", text) for text in options.overrides),
    ):
        words += [option, str(value)] if value else []
    return words + (["--trust"] if options.trust else [])


def _open_recording(folder: Path, options: SourceOptions) -> ComparedSource:
    from kr5 import arm_log

    if options.every is not None or options.overrides or options.episodes or options.check:
        raise kr5.FileError(folder, "is a recording; --every, --set, --episodes and --check are for logs")
    out = ComparedSource(kr5.cell.load_recording(folder), str(folder))
    out.inputs = {"recording": str(folder.resolve())}
    if options.model:
        out.model = _read_model(options)
        described = str(out.model.kind) != "cell"
        out.recording.cell = _described_cell(out.model, out.recording.cell) if described else out.model.cell
        out.notes = [*out.model.notes, *clamped_commands(out.recording, out.model.command_ranges)]
    out.best_arm = arm_log.best_arm_errors(out.recording)
    return out


def _described_cell(model: "Model", recorded: kr5.cell.Cell) -> kr5.cell.Cell:
    """The robot of a description in the cell of a recording."""
    from kr5 import arm_log

    try:
        return arm_log.described_cell(model.cell, recorded, str(model.kind) == "mjcf")
    except kr5.InvalidArgument as error:
        raise kr5.FileError(model.file, str(error)) from error


def _open_logs(paths: Sequence[Path], options: SourceOptions) -> ComparedSource:
    from kr5.logs.log_recording import LogOptions, record_logs, require_plausible

    _require_logs(paths)
    if options.model is None:
        raise kr5.FileError(
            paths[0],
            "is a log; expected --model with the model of its robot (URDF, MJCF or cell file), or the"
            " folder of a recording (recording.yaml)",
        )
    model = _read_model(options)
    described = str(model.kind) != "cell"
    found = record_logs(
        paths,
        model.cell,
        LogOptions(options.every, options.overrides, options.trust, options.episodes, options.check),
        described,
    )
    require_plausible(found, options.trust)
    return ComparedSource(
        found.recording,
        ", ".join(p.name for p in paths),
        model=model,
        inputs={"logs": [str(p.resolve()) for p in paths]},
        reasons=found.reasons,
        notes=[*model.notes, *found.notes, *clamped_commands(found.recording, model.command_ranges)],
        best_arm=found.best_arm,
    )


def _require_logs(paths: Sequence[Path]) -> None:
    for path in paths:
        if path.is_dir() and not is_log_folder(path):
            raise kr5.FileError(
                path,
                f"is a folder without recording.yaml (a recording), and no log; expected {FOLDER_WORDS}, or log files",
            )


def _read_model(options: SourceOptions) -> Any:
    from kr5.models.reading import read_model

    assert options.model is not None, "asked for with a model"
    return read_model(options.model, options.base, options.tip)
