"""A recording made of logs and a model of the robot, without a map written by hand."""

import tempfile
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

import kr5
import kr5.cell
import kr5.io
from kr5 import arm_log
from kr5.logs.importer import Readings, import_recording
from kr5.logs.map_guess import guess_map
from kr5.logs.overrides import (
    GivenEntries,
    Override,
    apply_overrides,
    given_entries,
    of_guessed_map,
    parse_overrides,
)
from kr5.models.mjcf_actuators import STATED_SERVOS


@dataclass
class LogOptions:
    """How logs are read, where that is not left to their names and numbers."""

    every: float | None = None  # interval of logs without a clock [s]
    overrides: list[str] = field(default_factory=list)  # KEY=VALUE of the map, or of the cell after "cell."
    trust: bool = False  # also numbers that are implausible
    episodes: str = ""  # of data sets, such as 3,7-12
    check: str = ""  # of several logs or episodes, those that are kept to judge


@dataclass
class LogRecording:
    """The recording, how its columns were found, and what else a person should know."""

    recording: Any
    map: dict[str, Any]
    reasons: list[list[str]]  # item, proposal, reason
    notes: list[str]
    problems: list[Any]
    best_arm: arm_log.BestArmErrors
    unused_commands: bool = False  # logged beside positions, and not simulated for want of a servo


def record_logs(logs: Sequence[Path], cell: kr5.cell.Cell, options: LogOptions, described: bool) -> LogRecording:
    """Brings logs in with the cell of the recorded robot. `described`: the cell comes from a description of the robot,
    which states neither drives nor noise."""
    of_map, of_cell = parse_overrides(options.overrides)
    constants_stated = not described or any(path[:2] == ["drives", "torque_constant"] for path, _ in of_cell)
    notes: list[str] = []
    if described:
        cell, added = arm_log.with_parts_to_try(cell)
        notes = [note.text(cell) for note in added]
    cell = _with_overrides(cell, of_cell)
    with tempfile.TemporaryDirectory() as folder:
        cell_file, map_file = Path(folder) / "cell.yaml", Path(folder) / "map.yaml"
        kr5.cell.save_cell(cell, cell_file)
        guessed = guess_map(logs, cell, cell_file, given=_given(options, of_map))
        apply_overrides(guessed.entry, of_guessed_map(of_map))
        map_file.write_text(yaml.safe_dump(guessed.entry, sort_keys=False))
        completed: list[str] = []

        def complete(recording: kr5.cell.Recording, readings: Readings) -> None:
            _require_masses(recording)
            completed.extend(_complete_model(recording, readings, constants_stated))

        recording, said, problems = import_recording(logs[0], map_file, complete, ", ".join(log.name for log in logs))
    best_arm = arm_log.best_arm_errors(recording)
    notes += [
        *guessed.notes,
        *(note for note in said if note not in guessed.notes),
        *completed,
        *(_best_arm_text(note, recording.cell, guessed.entry["columns"]) for note in best_arm.notes(recording)),
    ]
    return LogRecording(recording, guessed.entry, guessed.told(), notes, problems, best_arm, guessed.unused_commands)


def _complete_model(recording: kr5.cell.Recording, readings: Readings, constants_stated: bool) -> list[str]:
    """Torque constants and noise that the log tells; notes in words."""
    try:
        recording.cell, notes = arm_log.completed_model(recording, readings, constants_stated)
    except kr5.InvalidArgument as error:
        raise kr5.InvalidArgument(f"{error}: --set 'cell.drives.torque_constant=[...]'") from error
    return [note.text(recording.cell) for note in notes]


def _require_masses(recording: kr5.cell.Recording) -> None:
    loads = any("tau1" in e.data or "i1" in e.data for e in recording.experiments)
    if loads:
        arm_log.require_masses(recording.cell)


def _best_arm_text(note: arm_log.LogNote, cell: kr5.cell.Cell, columns: Mapping[str, object]) -> str:
    """A note in words, of a delay with the entry that corrects it."""
    said = str(note.text(cell))
    if note.kind != arm_log.LogNoteKind.DelayedLoads:
        return said
    entry = columns[note.name]
    stated = entry.get("delay", 0.0) if isinstance(entry, dict) else 0.0
    remedy = f"--set columns.{note.name}.delay={stated + note.value:.3g}"
    return f"{said}; if the driver delays them, correct this with {remedy}"


def _given(options: LogOptions, of_map: list[Override]) -> GivenEntries:
    out = given_entries(of_map)
    out.episodes, out.check = options.episodes, options.check
    if options.every is not None:
        out.clock.setdefault("every", options.every)
        out.clock.pop("column", None)
    return out


def _with_overrides(cell: kr5.cell.Cell, overrides: list[tuple[list[str], object]]) -> kr5.cell.Cell:
    """The cell with single entries replaced; an error names the entry, not a line of a text that no user wrote."""
    data = yaml.safe_load(cell.to_yaml())
    for path, value in overrides:
        apply_overrides(data, [(path, value)])
        where = f"--set cell.{'.'.join(path)}"
        try:
            cell = kr5.cell.parse_cell(yaml.safe_dump(data, sort_keys=False), where)
        except kr5.Error as error:
            raise kr5.Errors(_faults(data, where) or [str(error)]) from error
    return cell


def _faults(data: dict[str, object], where: str) -> list[str]:
    """What is wrong with a cell, each told of `where`."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "cell.yaml"
        file.write_text(yaml.safe_dump(data, sort_keys=False))
        faults = [fault for fault in kr5.cell.check(file) if fault.severity == kr5.io.Severity.Error]
    for fault in faults:
        fault.file, fault.line = where, 0  # which no user wrote
    return [fault.text() for fault in faults]


def _shows_nothing(recording: kr5.cell.Recording) -> bool:
    """Whether no experiment has a column that a model predicts."""
    n = recording.cell.robot.joints
    return not any(c.name in e.data for e in recording.experiments for c in kr5.cell.compared_columns(e.kind, n))


def require_plausible(found: LogRecording, trust: bool) -> None:
    """Raises kr5.Error when nothing that a model predicts was measured, or when numbers of the logs are plausible only
    in another unit, column or side of the gears; `trust`: of these it warns (kr5.Implausible)."""
    if not trust and _shows_nothing(found.recording):
        if found.unused_commands:
            raise kr5.InvalidArgument(
                "found commands and positions of the joints, no efforts or currents, and a model that states no servos,"
                f" by which commands move the arm; state them, as starting values for the diagnosis: {STATED_SERVOS}"
            )
        names = list(found.recording.cell.robot.joint_names)
        raise kr5.InvalidArgument(
            "found no efforts or currents of every joint in the log"
            + (f" ({', '.join(names)})" if names else "")
            + ", and nothing else that a model predicts; name their columns: --set 'columns.tau.from=[...]', or"
            " --set 'columns.i.from=[...]' for currents"
        )
    if found.problems and not trust:
        mismatch = f"{arm_log.mismatch_text()} If so, correct what is named above with --set, or go on with --trust"
        raise kr5.Errors([*(problem.text() for problem in found.problems), mismatch])
    for problem in found.problems:
        warnings.warn(problem.text(), kr5.Implausible, stacklevel=2)
