"""A recording made of logs and a model of the robot, without a map written by hand."""

import re
import tempfile
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

import kr5
import kr5.cell
from kr5.logs.importer import import_recording
from kr5.logs.map_guess import guess_map
from kr5.logs.model_parts import known_errors, with_noise, with_parts_to_try, with_torque_constants
from kr5.logs.overrides import GivenEntries, Override, apply_overrides, given_entries, parse_overrides


@dataclass
class LogOptions:
    """How logs are read, where that is not left to their names and numbers."""

    every: float | None = None  # interval of logs without a clock [s]
    overrides: list[str] = field(default_factory=list)  # KEY=VALUE of the map, or of the cell after "cell."
    trust: bool = False  # also numbers that are implausible


@dataclass
class LogRecording:
    """The recording, how its columns were found, and what else a person should know."""

    recording: Any
    map: dict[str, Any]
    reasons: list[list[str]]  # item, proposal, reason
    notes: list[str]
    problems: list[Any]
    simulator_errors: list[Any]  # kr5.gap.ColumnError, of columns of which the best model is known


def record_logs(logs: Sequence[Path], cell: Any, options: LogOptions, described: bool) -> LogRecording:
    """Brings logs in with the cell of the recorded robot. `described`: the cell comes from a description of the robot,
    which states neither drives nor noise."""
    of_map, of_cell = parse_overrides(options.overrides)
    constants_stated = not described or any(path[:2] == ["drives", "torque_constant"] for path, _ in of_cell)
    notes: list[str] = []
    if described:
        cell, notes = with_parts_to_try(cell)
    cell = _with_overrides(cell, of_cell)
    with tempfile.TemporaryDirectory() as folder:
        cell_file, map_file = Path(folder) / "cell.yaml", Path(folder) / "map.yaml"
        kr5.cell.save_cell(cell, cell_file)
        guessed = guess_map(logs, cell, cell_file, given=_given(options, of_map))
        apply_overrides(guessed.entry, of_map)
        map_file.write_text(yaml.safe_dump(guessed.entry, sort_keys=False))
        completed: list[str] = []

        def complete(recording: Any) -> None:
            _require_masses(recording)
            if described and not constants_stated:
                completed.extend(with_torque_constants(recording))
            completed.extend(with_noise(recording))

        recording, said, problems = import_recording(logs[0], map_file, complete, ", ".join(log.name for log in logs))
    known = known_errors(recording)
    notes += [
        *guessed.notes,
        *(note for note in said if note not in guessed.notes),
        *completed,
        *_dead_notes(recording.cell, known.dead),
        *_delay_notes(guessed.entry["columns"], known.delay),
    ]
    return LogRecording(recording, guessed.entry, guessed.told(), notes, problems, known.errors)


def _require_masses(recording: Any) -> None:
    loads = any("tau1" in e.data or "i1" in e.data for e in recording.experiments)
    if loads and not recording.cell.robot.links:
        raise kr5.InvalidArgument(
            "the model states no masses of its links, from which torques follow; choose a model with masses and"
            " inertias (in a URDF: <inertial> of each link)"
        )


def _dead_notes(cell: Any, joints: list[int]) -> list[str]:
    if not joints:
        return []
    names = list(cell.robot.joint_names) or [f"joint {k + 1}" for k in range(cell.robot.joints)]
    return [
        f"the loads of {', '.join(names[k] for k in joints)} show hardly anything where the model shows a load, so that"
        " they are not judged; does the driver measure them?"
    ]


def _delay_notes(columns: dict[str, Any], delay: float) -> list[str]:
    if delay == 0.0:
        return []
    family = "tau" if "tau" in columns else "i"
    stated = columns[family].get("delay", 0.0) if isinstance(columns[family], dict) else 0.0
    return [
        f"with masses and friction fitted, the {'torques' if family == 'tau' else 'currents'} match the motion best if"
        f" they were logged {1e3 * abs(delay):.3g} ms {'late' if delay > 0 else 'early'}; if the driver delays them,"
        f" correct this with --set columns.{family}.delay={stated + delay:.3g}"
    ]


def _given(options: LogOptions, of_map: list[Override]) -> GivenEntries:
    out = given_entries(of_map)
    if options.every is not None:
        out.clock.setdefault("every", options.every)
        out.clock.pop("column", None)
    return out


def _with_overrides(cell: Any, overrides: list[tuple[list[str], Any]]) -> Any:
    """The cell with single entries replaced; an error names the entry, not a line of a text that no user wrote."""
    data = yaml.safe_load(cell.to_yaml())
    for path, value in overrides:
        apply_overrides(data, [(path, value)])
        where = f"--set cell.{'.'.join(path)}"
        try:
            cell = kr5.cell.parse_cell(yaml.safe_dump(data, sort_keys=False), where)
        except kr5.Error as error:
            raise kr5.InvalidArgument(re.sub(rf"^{re.escape(where)}:\d+: ", f"{where}: ", str(error))) from error
    return cell


def _shows_nothing(recording: Any) -> bool:
    """Whether no experiment has a column that a model predicts."""
    n = recording.cell.robot.joints
    return not any(c.name in e.data for e in recording.experiments for c in kr5.cell.compared_columns(e.kind, n))


def require_plausible(found: LogRecording, trust: bool) -> None:
    """Raises kr5.Error when nothing that a model predicts was measured, or when numbers of the logs are plausible only
    in another unit, column or side of the gears; `trust`: of these it warns (kr5.Implausible)."""
    if not trust and _shows_nothing(found.recording):
        names = list(found.recording.cell.robot.joint_names)
        raise kr5.InvalidArgument(
            "found no efforts or currents of every joint in the log"
            + (f" ({', '.join(names)})" if names else "")
            + ", and nothing else that a model predicts; name their columns: --set 'columns.tau.from=[...]', or"
            " --set 'columns.i.from=[...]' for currents"
        )
    if found.problems and not trust:
        mismatch = (
            "the log and the model do not fit together as they were read. Is this the model of the robot that was"
            " logged? If so, correct what is named above with --set, or go on with --trust"
        )
        raise kr5.Errors([*(problem.text() for problem in found.problems), mismatch])
    for problem in found.problems:
        warnings.warn(problem.text(), kr5.Implausible, stacklevel=2)
