"""A map proposed for a log: families of columns by their names, units by the size of their numbers."""

import os
import re
from pathlib import Path
from typing import Any

import kr5.cell
import numpy as np

from kr5_tools.cli import terminal
from kr5_tools.log_import.log import Log
from kr5_tools.log_import.log_file import read_log

NAMES = {  # a name without its number, in small letters
    "qc": (
        r"(q|pos|position|joint|axis|j|angle)?_?(c|cmd|command|commanded|des|desired|target|ref|reference|set|setpoint|soll)_?(q|pos|position|joint|angle)?_?"
    ),
    "i": r"(i|cur|curr|current|amp|motor_?current|strom)_?",
    "tau": r"(tau|eff|effort|torque|trq|joint_?torque|moment)_?j?",
    "q": r"(q|pos|position|joint|axis|angle|j|a|ist)_?(pos|position|act|actual|meas|measured|ist)?_?(q|joint|j)?_?",
}
WRENCH = [re.compile(rf"(^|[^a-z])(?:{p})_?{a}$") for p in ("f|force", "t|m|torque|moment") for a in "xyz"]
TIME = re.compile(
    r"(^|[^a-z])(t|time|timestamp|stamp|clock|zeit|seconds|sec|log_time|header\.stamp)(_?\[?(s|ms|us|ns)\]?)?$"
)


def guess_map(file: Path, cell_file: Path, output: Path | None) -> tuple[dict[str, Any], list[list[str]]]:
    """The map, and a reason for each of its parts."""
    log, cell, reasons = read_log(file), kr5.cell.load_cell(cell_file), []
    families = _families(log, cell.robot.joints)
    columns: dict[str, Any] = {}
    for name, names in families.items():
        unit, why = _unit(name, np.column_stack([log.columns[n] for n in names]), cell)
        columns[name] = {"from": _pattern(names), "unit": unit}
        reasons.append([name, f"{names[0]} to {names[-1]} [{unit}]", why])
    if "q" in columns and "qc" not in columns:
        columns["qc"] = {"from": "measured", "unit": "rad"}
        reasons.append(["qc", "measured", "no column looks like commands"])
    wrench = [n for pattern in WRENCH for n in [c for c in log.columns if pattern.search(c.lower())][:1]]
    if len(wrench) == len(WRENCH):
        columns["wrench"] = {"from": wrench, "unit": ["N", "N m"]}
        reasons.append(["wrench", ", ".join(wrench), "from the names; its unit, frame and sign must be checked"])
    if not set(columns) & {"q", "tau", "i"}:
        terminal.fail(
            f"{file}: found no {cell.robot.joints} columns that are counted and look like joints (q1, pos_1, ...) among"
            f" {', '.join(list(log.columns)[:12])}; write the map by hand, see kr5 recording import --help"
        )
    clock, duration = _clock(log, cell, families, reasons)
    place = cell_file if output is None else Path(os.path.relpath(cell_file, output.parent))
    cut = float(f"{0.7 * duration:.4g}")
    reasons.append(["experiments", f"first {cut:g} s to fit, the rest to check", "a fit must be checked on other data"])
    found = {
        "format": "kr5-map/1",
        "cell": str(place),
        **({"clock": clock} if clock else {}),
        "columns": columns,
        "experiments": [
            {"name": "motion-1", "kind": "motion", "split": "fit", "to": cut},
            {"name": "motion-2", "kind": "motion", "split": "check", "from": cut},
        ],
    }
    return found, reasons


def _families(log: Log, joints: int) -> dict[str, list[str]]:
    """Groups of columns that differ in a number alone, as many as there are joints."""
    groups: dict[str, list[str]] = {}
    for name in log.columns:
        if match := list(re.finditer(r"\d+", name)):
            groups.setdefault(name[: match[-1].start()] + "#" + name[match[-1].end() :], []).append(name)
    out: dict[str, list[str]] = {}
    for stem, names in groups.items():
        word = stem.lower().split(":")[-1].replace("[#]", "").replace("#", "").strip(" _.[]")
        if len(names) != joints:
            continue
        family = next(
            (f for f, pattern in NAMES.items() if re.fullmatch(pattern, word) or re.fullmatch(pattern, word + "_")),
            None,
        )
        if family and family not in out:
            out[family] = sorted(names, key=lambda n: int(re.findall(r"\d+", n)[-1]))
    return out


def _pattern(names: list[str]) -> Any:
    first = re.findall(r"\d+", names[0])[-1]
    if first in ("0", "1"):
        at = names[0].rindex(first)
        pattern = names[0][:at] + ("{}" if first == "1" else "{0}") + names[0][at + 1 :]
        from kr5_tools.log_import.map_file import names_of

        if names_of(pattern, len(names), "") == names:
            return pattern
    return names


def _unit(family: str, values: np.ndarray, cell: Any) -> tuple[str, str]:
    size = float(np.nanmax(np.abs(values)))
    if family in ("q", "qc"):
        return (
            ("deg", f"values up to {size:.4g} are too large for radians")
            if size > 7
            else ("rad", f"values up to {size:.4g}")
        )
    if family == "i":
        return (
            ("mA", f"values up to {size:.4g} are too large for A") if size > 200 else ("A", f"values up to {size:.4g}")
        )
    return (
        ("N mm", f"values up to {size:.4g} are too large for N m")
        if size > 5000
        else ("N m", f"values up to {size:.4g}")
    )


def _clock(
    log: Log, cell: Any, families: dict[str, list[str]], reasons: list[list[str]]
) -> tuple[dict[str, Any] | None, float]:
    """The time column, its unit by the cycle of the servo (or a usual rate), and the duration [s]."""
    stream = log.streams[next(iter(families.values()))[0]]
    name = log.clocks.get(stream) or next((n for n in log.columns if TIME.search(n.lower().split(":")[-1])), None)
    rows = len(log.columns[next(iter(families.values()))[0]])
    cycle = cell.servo.cycle if cell.servo else 0.005
    if name is None:
        reasons.append(
            ["clock", f"every {cycle:g} s", "no column looks like time; this is the cycle of the cell; check it"]
        )
        return {"every": cycle}, rows * cycle
    stamps = log.columns[name]
    step = float(np.median(np.diff(stamps)))
    unit = min(
        ("s", "ms", "us", "ns"),
        key=lambda u: abs(np.log(max(step, 1e-12) * {"s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[u] / cycle)),
    )
    scale = {"s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[unit]
    reasons.append(["clock", f"{name} [{unit}]", f"a row every {step:.4g}, which is {step * scale:.4g} s"])
    duration = float(stamps[-1] - stamps[0]) * scale
    return (None if stream in log.clocks else {"column": name, "unit": unit}), duration
