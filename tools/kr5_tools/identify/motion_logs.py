"""Motions with joint torques, from a recording of the project or from any log with a cell or a URDF."""

import re
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import kr5.identification
import numpy as np
from kr5 import identification, physics
from kr5.logs.column_list import names_in_order
from kr5.logs.column_names import find_families
from kr5.logs.importer import Importer
from kr5.logs.log import Log
from kr5.logs.log_file import is_log_folder
from kr5.logs.map_file import Clock, Experiment, Map, Source, load_map
from kr5.logs.map_guess import guess_map
from kr5.logs.overrides import GivenEntries
from kr5.logs.units import OF_RANGE
from kr5.logs.values import to_si

from kr5_tools.cli.arm_file import ArmFile
from kr5_tools.cli.options import options_from

TEMPERATURE = re.compile(
    r"(motor|joint|axis|drive|gear|gearbox|j|q)?_?(temp|temperature|temperatur)_?(motor|joint|axis|drive|gear|gearbox|j|q)?"
    r"_?\[?(?P<unit>deg_?c|c|celsius|k|kelvin)?\]?"
)
ZERO_CELSIUS = 273.15  # [K]
LEAST_KELVIN = 200.0  # above which a temperature without a unit is in K; a drive in deg C is cooler


@dataclass
class MotionLogs:
    """Logs of one arm; those of `check` are only judged by."""

    cell: Any
    fit: list[Any] = field(default_factory=list)
    check: list[Any] = field(default_factory=list)
    names: list[str] = field(default_factory=list)  # of the experiments, fit first
    notes: list[str] = field(default_factory=list)


def read_motions(
    source: Path,
    arm: ArmFile | None,
    map_file: Path | None,
    held_out: float,
    columns: str | None = None,
    episodes: str = "",
) -> MotionLogs:
    """The motions of a recording folder, or of a log with --map, or with --cell, whose map is then guessed.
    `columns`: names of the columns of a log in their order; `episodes`: those of a data set that are read.

    A recording says which experiments are held out; of everything else, and of a recording that does not, the last
    part `held_out` is.
    """
    if columns and (map_file or not arm):
        raise kr5.InvalidArgument("--columns: only for a log with --cell; a map names the columns by its entry header")
    if episodes and (map_file or not arm):
        raise kr5.InvalidArgument("--episodes: only for a log with --cell; a map names one by the entry episode")
    if source.is_dir() and not is_log_folder(source):
        out = _recording_motions(source, arm)
    elif map_file:
        out = _log_motions(source, load_map(map_file))
    elif arm:
        given = GivenEntries(header=names_in_order(columns) if columns else None, episodes=episodes)
        out = _guessed_motions(source, arm, given)
    else:
        raise kr5.FileError(
            source, "a log needs its arm: --cell with a cell file, a URDF or an MJCF, or --map with a map file"
        )
    if not out.fit:
        raise kr5.FileError(source, "found no motion with joint values and currents or torques to fit, expected one")
    if not out.check and held_out > 0:
        parts = [identification.split_log(log, held_out) for log in out.fit]
        out.fit, out.check = [p[0] for p in parts], [p[1] for p in parts]
    return out


def _rows(log: kr5.identification.JointLog, keep: np.ndarray) -> Any:
    values = {name: np.asarray(getattr(log, name)) for name in ("t", "q", "qd", "tau", "temperature")}
    return identification.JointLog(
        **{name: v[keep] if v.size else v for name, v in values.items()},
        q_names=log.q_names,
        qd_names=log.qd_names,
        tau_names=log.tau_names,
        temperature_names=log.temperature_names,
    )


def _recording_motions(folder: Path, arm: ArmFile | None) -> MotionLogs:
    recording = kr5.cell.load_recording(folder)
    out = MotionLogs(arm.cell() if arm else recording.cell)
    n = out.cell.robot.joints
    for experiment in recording.experiments:
        if str(experiment.kind) != "motion":
            continue
        log = _experiment_log(out.cell, experiment, n)
        if log is None:
            continue
        check = str(experiment.split) == "check"
        (out.check if check else out.fit).append(log)
        out.names.append(experiment.name)
    return out


def _experiment_log(cell: kr5.cell.Cell, experiment: kr5.cell.Experiment, n: int) -> Any:
    columns = experiment.data.columns

    def family(stem: str) -> list[str] | None:
        names = [f"{stem}{k + 1}" for k in range(n)]
        return names if all(name in columns for name in names) else None

    q, load = family("q") or family("qc"), family("tau") or family("i")
    if q is None or load is None:
        return None
    values = np.column_stack([experiment[name] for name in load])
    if load[0] == "i1":
        if cell.drives is None:
            raise kr5.InvalidArgument(
                f"{experiment.name}: needs drives (structure, torque_constant) in the cell to read currents, which it"
                " does not have"
            )
        values = physics.reported_torques(cell, values)
    return identification.JointLog(
        t=experiment["t"],
        q=np.column_stack([experiment[name] for name in q]),
        tau=values,
        q_names=[f"{experiment.name}.{name}" for name in q],
        tau_names=[f"{experiment.name}.{name}" for name in load],
    )


def _guessed_motions(source: Path, arm: ArmFile, given: GivenEntries) -> MotionLogs:
    cell = arm.cell()
    with tempfile.TemporaryDirectory() as folder:
        cell_file, map_file = Path(folder) / "cell.yaml", Path(folder) / "map.yaml"
        kr5.cell.save_cell(cell, cell_file)
        guessed = guess_map([source], cell, cell_file, given=given)
        found = guessed.entry | ({"header": given.header} if given.header else {})
        found["experiments"] = _whole_logs(found["experiments"])
        import yaml

        map_file.write_text(yaml.safe_dump(found))
        out = _log_motions(source, load_map(map_file))
    out.cell = cell
    guesses = [f"{item}: {proposal} ({reason})" for item, proposal, reason in guessed.told() if item != "experiments"]
    out.notes = guesses + out.notes
    return out


def _whole_logs(experiments: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """One experiment for all of each log, or episode: what is held out is cut later."""
    out = dict[object, dict[str, Any]]()
    for entry in experiments:
        episode = entry.get("episode")
        name = "log" if episode is None else f"episode-{episode}"
        own = {key: entry[key] for key in ("episode", "clock", "columns") if key in entry}
        out.setdefault(episode, {"name": name, "kind": "motion", "split": "fit"} | own)
    return list(out.values())


def _log_motions(source: Path, map: Map) -> MotionLogs:
    """The columns of a log as they came, in SI on the joint side: its faults are for check_log to name."""
    importer = Importer(map, source)
    out = MotionLogs(importer.cell)
    for experiment in map.experiments:
        if experiment.entry.kind != "motion":
            continue
        log = importer.log(None, experiment.entry.episode)
        begin, end = experiment.span()
        one = _mapped_log(importer.cell, log, map, experiment, out.notes.append)
        if one is None:
            continue
        t = np.asarray(one.t)
        one = _rows(one, ~np.isfinite(t) | ((t >= begin) & (t < end)))
        (out.check if experiment.entry.split == "check" else out.fit).append(one)
        out.names.append(experiment.entry.name)
    return out


def _mapped_log(cell: kr5.cell.Cell, log: Log, map: Map, experiment: Experiment, note: Callable[[str], None]) -> Any:
    named = {name: s for name, s in experiment.sources.items() if isinstance(s, Source) and s.names}
    q = named.get("q") or named.get("qc")
    load = named.get("tau") or named.get("i")
    if q is None or load is None:
        return None
    values = to_si(q, "q", _raw(log, q), cell, note)
    torque = to_si(load, "tau", _raw(log, load), cell, note)
    speeds = _speeds(log, q, cell, note)
    t = _times(log, map, experiment.entry.clock or map.clock, len(values))
    return identification.JointLog(
        t=t,
        q=values,
        tau=torque,
        q_names=q.names,
        tau_names=load.names,
        **speeds,
        **_temperatures(log, t, len(q.names), note),
    )


def _raw(log: Log, source: Source) -> np.ndarray:
    return np.column_stack([log.column(name, source.where) for name in source.names])


def _times(log: Log, map: Map, clock: Clock | None, rows: int) -> np.ndarray:
    if clock is None or clock.column is None:
        every = clock.every if clock is not None and clock.every is not None else None
        stamps = next(iter(log.clocks.values()), None)
        if every is not None:
            return every * np.arange(rows)
        if stamps is None:
            raise kr5.FileError(map.file, "needs a clock: {column: NAME, unit: s}, or {every: SECONDS}")
        return np.asarray(log.columns[stamps])
    stamps_s = np.asarray(log.column(clock.column, f"{map.file}: clock.column")) * clock.seconds()
    return np.asarray(stamps_s - np.nanmin(stamps_s) + clock.offset)


def _speeds(log: Log, q: Source, cell: kr5.cell.Cell, note: Callable[[str], None]) -> dict[str, Any]:
    """Logged speeds, when a family of columns is named like them; taken in the unit of the positions."""
    found = find_families(log, list(cell.robot.joint_names), len(q.names)).first("qd")
    if found is None or {*q.unit} & {*OF_RANGE, "tick"}:  # which have a zero of their own
        return {}
    names = found.columns
    own = Source(q.where, q.members, names, None, False, q.unit, q.scale, [0.0] * len(names), q.side)
    note(f"speeds for comparison: {names[0]} to {names[-1]}")
    return {"qd": to_si(own, "q", _raw(log, own), cell, note), "qd_names": names}


def _numbered(log: Log) -> dict[str, list[str]]:
    """Columns that differ in a number alone, in its order, by their name without it in small letters."""
    groups: dict[str, list[str]] = {}
    for name in log.columns:
        if match := list(re.finditer(r"\d+", name)):
            groups.setdefault(name[: match[-1].start()] + "#" + name[match[-1].end() :], []).append(name)
    return {
        stem.lower().split(":")[-1].replace("[#]", "").replace("#", "").strip(" _.[]"): sorted(
            names, key=lambda n: int(re.findall(r"\d+", n)[-1])
        )
        for stem, names in groups.items()
    }


def _temperatures(log: Log, t: np.ndarray, joints: int, note: Callable[[str], None]) -> dict[str, Any]:
    """Logged temperatures in deg C, when a column a joint, or one for all, is named like them. The unit stands in the
    name or follows from the size; a slow sensor's missing numbers are interpolated."""
    families = {word: names for word, names in _numbered(log).items() if len(names) == joints}
    families |= {name.lower().split(":")[-1].strip(" _.[]"): [name] * joints for name in log.columns}
    for word, names in families.items():
        match = TEMPERATURE.fullmatch(word)
        if match is None:
            continue
        values = np.column_stack([log.column(name, "temperature") for name in names])
        if len(values) != len(t) or not np.isfinite(values).any(axis=0).all():
            note(f"temperatures: {names[0]} is not used: it has no number, or a clock of its own")
            continue
        unit = match["unit"]
        kelvin = unit.startswith("k") if unit else bool(np.nanmin(values) > LEAST_KELVIN)
        values = values - ZERO_CELSIUS if kelvin else values
        missing = int((~np.isfinite(values)).sum())
        if missing:
            values = np.column_stack([_interpolated(t, column) for column in values.T])
        note(
            f"temperatures: {names[0]} to {names[-1]} [{'K' if kelvin else 'deg C'}"
            f"{', from the name' if unit else ', from the size'}]"
            f"{f', {missing} missing ones interpolated' if missing else ''}"
        )
        return {"temperature": values, "temperature_names": names}
    return {}


def _interpolated(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    known = np.isfinite(values) & np.isfinite(t)
    order = np.argsort(t[known], kind="stable")
    return np.where(known, values, np.interp(t, t[known][order], values[known][order]))


FROM_THE_CELL = ("lower", "upper", "expected_torque", "slides")  # options of conditioning that no command asks for


def log_and_terms_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Gives a command a --flag for every field of what its log is conditioned by, `log`, and of the model, `terms`."""
    with_terms = options_from(identification.JointTerms, argument="terms")(command)
    return options_from(identification.ConditioningOptions, skip=FROM_THE_CELL, argument="log")(with_terms)


def require_usable(parts: list[identification.ConditionedMotion], where: str = "") -> None:
    """Ends with every error that conditioning found in logs."""
    bad = [p for p in parts if not p.usable]
    if bad:
        errors = [f.text for p in bad for f in p.findings if str(f.severity) == "error"]
        raise kr5.InvalidArgument(f"{where}the log cannot be used: " + "; ".join(errors or [p.message for p in bad]))


def conditioning_of(options: kr5.identification.ConditioningOptions, cell: kr5.cell.Cell) -> Any:
    """Options with the limits and slides of the cell."""
    robot = cell.robot
    options.slides = [k + 1 for k, joint in enumerate(robot.dh) if str(joint.type) == "prismatic"]
    limits = robot.limits
    if limits is not None and np.isfinite([*limits.lower, *limits.upper]).all():
        options.lower, options.upper = limits.lower, limits.upper
    return options
