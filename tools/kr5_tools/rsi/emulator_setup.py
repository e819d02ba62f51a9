"""What `kr5 rsi emulate` makes of its options, and `kr5 rsi files` of some: layout, rules and path, faults of the
network, and what happens at which time."""

import dataclasses
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
from kr5 import rsi
from kr5.files.paths import library_path

CONTROLLERS = ("krc2", "krc4_rsi3", "krc4", "krc5", "iiqka")
ACTIONS: dict[str, Callable[[rsi.Emulator], None]] = {
    "drives_off": lambda emulator: emulator.set_drives(False),
    "drives_on": lambda emulator: emulator.set_drives(True),
    "emergency_stop": lambda emulator: emulator.emergency_stop(),
    "reset": lambda emulator: emulator.reset_program(),
}
OVERRIDE = "override="


@dataclasses.dataclass
class Action:
    """What is done to the controller, and when [s]."""

    time: float
    do: Callable[[rsi.Emulator], None]
    overrides: bool = False


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _seconds(text: str) -> float | None:
    value = _number(text)
    return value if value is not None and value >= 0 else None


def parse_action(text: str) -> Action:
    """The action of `drives_off@2.5` or `override=30@4`."""
    what, _, when = text.rpartition("@")
    seconds = _seconds(when)
    if seconds is not None and what in ACTIONS:
        return Action(seconds, ACTIONS[what])
    percent = _seconds(what.removeprefix(OVERRIDE)) if what.startswith(OVERRIDE) else None
    if seconds is not None and percent is not None and percent <= 100:
        share = percent / 100
        return Action(seconds, lambda emulator: emulator.set_override(share), overrides=True)
    expected = f"WHAT@SECONDS with WHAT {', '.join(ACTIONS)} or {OVERRIDE}PERCENT, as drives_off@2.5"
    raise kr5.InvalidArgument(f"--do: found {text!r}, expected {expected}")


def parse_fault(text: str) -> rsi.TimedFault:
    """The fault of `lose@1.5`, or of `lose@1.5x10` for the next ten messages."""
    found = re.fullmatch(r"(late|lose|double|reorder|truncate)@([0-9.]+)(?:x([0-9]{1,6}))?", text)
    seconds = _seconds(found[2]) if found else None
    if not found or seconds is None:
        expected = (
            "KIND@SECONDS or KIND@SECONDSxCOUNT with KIND late, lose, double, reorder or truncate, as lose@1.5x10"
        )
        raise kr5.InvalidArgument(f"--fault: found {text!r}, expected {expected}")
    return rsi.TimedFault(fault=found[1], time=seconds, count=int(found[3] or 1))


def make_layout(
    file: Path | None,
    controller: str | None,
    corrections: str,
    address: str | None,
    port: int | None,
    transport: str | None,
) -> rsi.TelegramLayout:
    """Layout of a configuration, else the usual one of the controller, with the address of the client where one is
    given."""
    if file:
        layout = rsi.load_layout(library_path(file))
        if controller:
            layout.controller = rsi.Controller(controller)
    else:
        layout = rsi.usual_layout(rsi.Controller(controller or "krc4"), space=rsi.CorrectionSpace(corrections))
    layout.address = address or layout.address
    layout.port = layout.port if port is None else port
    if transport:
        layout.transport = rsi.Transport(transport)
    layout.validate()
    return layout


def with_current_units(layout: rsi.TelegramLayout) -> rsi.TelegramLayout:
    """Motor currents in amperes where nothing else is said."""
    if not layout.current_units:
        layout.current_units = [1.0] * (6 + layout.externals)
    return layout


def make_rules(
    controller: rsi.Controller,
    timeout: int | None,
    axis_limit: float | None,
    translation_limit: float | None,
    others: Sequence[str] = (),
) -> rsi.ControllerRules:
    """Rules of a controller, with the limits that are given in degrees and millimetres, rotations have that of axes;
    `others` by their names."""
    rules = rsi.usual_rules(controller)
    if timeout is not None:
        rules.max_late = timeout
    if axis_limit is not None:
        rules.axis_limit = rules.rotation_limit = math.radians(axis_limit)
    if translation_limit is not None:
        rules.translation_limit = 1e-3 * translation_limit
    for text in others:
        setattr(rules, *parse_rule(text))
    rules.validate()
    return rules


def parse_rule(text: str) -> tuple[str, Any]:
    """Name and value of `idle_limit=60`, `max_late_share=none` or `at_limit=hold`."""
    fields = {field["name"]: field for field in rsi.ControllerRules.fields()}
    name, _, given = text.partition("=")
    if name not in fields:
        raise kr5.InvalidArgument(f"--rule: found {text!r}, expected NAME=VALUE with NAME {', '.join(fields)}")
    kind, _, optional = fields[name]["type"].partition(" | ")
    if optional and given == "none":
        return name, None
    choices = fields[name]["choices"] or (["true", "false"] if kind == "bool" else [])
    if given in choices:
        return name, given == "true" if kind == "bool" else given
    number = _number(given)
    if number is not None and not choices and (kind == "float" or number.is_integer()):
        return name, number if kind == "float" else int(number)
    expected = " or ".join(choices) or f"a number{' without fraction' if kind == 'int' else ''}"
    raise kr5.InvalidArgument(f"--rule: found {text!r}, expected {expected}{', or none' if optional else ''}")


def parse_place(text: str, robot: kr5.cell.Robot) -> list[float]:
    """Joint values [rad or m] of `0,-60,100,0,45,0` [deg or mm], which the arm can take."""
    scales = [1e-3 if str(row.type) == "prismatic" else math.radians(1) for row in robot.dh]
    values = [_number(word) for word in text.split(",")]
    if len(values) != len(scales) or None in values:
        example = ",".join("0" for _ in scales)
        raise kr5.InvalidArgument(
            f"--path: found {text!r}, expected {len(scales)} joint values [deg; mm of a slide], as {example}"
        )
    place = [scale * value for scale, value in zip(scales, values) if value is not None]
    limits = robot.limits
    for k, (value, scale) in enumerate(zip(place, scales)):
        if limits and not limits.lower[k] <= value <= limits.upper[k]:
            within = f"{limits.lower[k] / scale:.4g} to {limits.upper[k] / scale:.4g}"
            raise kr5.InvalidArgument(f"--path: joint {k + 1}: found {value / scale:g}, the cell allows {within}")
    return place


def make_faults(
    of: str, shares: dict[str, float], delay: float, jitter: float, timed: Sequence[str], seed: int
) -> tuple[rsi.LinkFaults, rsi.LinkFaults]:
    """Faults of telegrams and of answers, as `of` says: telegrams, answers or both; delay and jitter in ms."""
    found = [
        rsi.LinkFaults(
            **shares, delay=1e-3 * delay, jitter=1e-3 * jitter, timed=[parse_fault(t) for t in timed], seed=seed + k
        )
        for k in range(2)
    ]
    found[0].validate()
    none = rsi.LinkFaults()
    return (none if of == "answers" else found[0]), (none if of == "telegrams" else found[1])
