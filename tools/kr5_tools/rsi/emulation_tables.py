"""What `kr5 rsi emulate` tells of an emulated controller: a line while it runs, sentence and tables at the end."""

import math
from collections.abc import Sequence

from kr5 import rsi

from kr5_tools.cli.numbers import NONE, format_count, format_number

COUNT_COLUMNS = ["quantity", "value", "unit"]
TIME_COLUMNS = ["time", "median [ms]", "99 % [ms]", "99.9 % [ms]", "max. [ms]"]
EVENT_COLUMNS = ["time [s]", "event", "detail"]
MOST_EVENTS = 20  # that are listed unless all are asked for
EVENT_NAMES = {
    "started": "program started",
    "answered": "first answer",
    "missing": "answers missing",
    "jump": "correction fell back",
    "limited": "correction at its limit",
    "drives_off": "drives off",
    "emergency_stop": "emergency stop",
    "drives_on": "drives on",
    "override": "override changed",
    "ended": "program ended",
    "overrun": "emulator late",
}
ANSWER_FAULTS = {  # what was wrong with answers, and the remedy
    "foreign_ipoc": "had an IPOC that was never sent: send the digits back as they came",
    "late": "came too late: each is due before the next telegram",
    "empty": "had no bytes",
    "too_long": "were longer than a telegram may be",
    "foreign": "were no <Sen> of the Type that the layout names: compare SENTYPE with the client",
    "truncated": "ended before their end",
    "malformed": "were no XML of the form of a telegram",
    "duplicate": "had an element or attribute twice",
    "bad_number": "had a value that is no finite number",
    "bad_ipoc": "had an IPOC that is no number",
    "no_ipoc": "had no IPOC: send back that of the telegram",
    "incomplete": "lacked elements of the layout: compare its RECEIVE section with what the client sends",
}


def status_line(statistics: rsi.EmulatorStatistics, layout: rsi.TelegramLayout) -> str:
    """What goes on, on one line."""
    c = statistics.controller
    if not statistics.connected:
        return f"waiting for a client to take the connection at {layout.address}:{layout.port}"
    if c.answered == 0:
        return f"sending to {layout.address}:{layout.port}, no good answer yet; telegram {c.sent}"
    phase = str(c.phase).replace("_", " ")
    return (
        f"{phase}, {format_count(c.answered, 'answer')}, {c.missing} missing ({c.missing_now} now),"
        f" {c.telegrams.faulty()} faulty, answer {1e3 * statistics.answer.p50:.2f} ms"
    )


def verdict_sentence(statistics: rsi.EmulatorStatistics, layout: rsi.TelegramLayout) -> str:
    """How it went."""
    c = statistics.controller
    if c.answered == 0:
        where = f"{layout.address}:{layout.port} ({str(layout.transport).upper()})"
        return f"No client gave a good answer at {where}: {format_count(c.sent, 'telegram')} went out. {_refused(c)}"
    if c.stop.reason != rsi.ProgramStopReason.None_:
        return f"The program ended: {rsi.stop_message(layout.controller, c.stop)}."
    return f"{c.answered} of {format_count(c.answered + c.missing, 'cycle')} had a good answer."


def _refused(c: rsi.EmulationStatistics) -> str:
    """What was wrong with most of the answers, none of which was good."""
    counts = {name: count for name, count in c.telegrams.to_dict().items() if name in ANSWER_FAULTS}
    counts |= {"foreign_ipoc": c.foreign, "late": c.late}
    most = max(counts, key=lambda name: counts[name])
    if counts[most] == 0:
        return "None came."
    return f"{format_count(counts[most], 'answer')} {ANSWER_FAULTS[most]}."


def fall(size: float, layout: rsi.TelegramLayout) -> tuple[float, str]:
    """Size of a jump, with its unit: of an axis, or of the tool where axes are not corrected."""
    of_axes = any(e.tag.split(".")[0] in ("AKorr", "AK") for e in layout.receive)
    return (math.degrees(size), "deg") if of_axes else (1e3 * size, "mm")


def count_rows(statistics: rsi.EmulatorStatistics, layout: rsi.TelegramLayout) -> list[list[object]]:
    c = statistics.controller
    jump, unit = fall(c.largest_jump, layout)
    rows: list[list[object]] = [
        ["programs started", c.programs, "-"],
        ["telegrams", c.sent, "-"],
        ["cycles with a good answer", c.answered, "-"],
        ["cycles without", c.missing, "-"],
        ["most of them in succession", c.missing_most, "-"],
        ["their share of the latest", 100 * c.missing_share, "%"],
        ["answers too late", c.late, "-"],
        ["answers with an IPOC never sent", c.foreign, "-"],
        ["answers given twice", c.repeated, "-"],
        ["faulty answers", c.telegrams.faulty(), "-"],
        ["corrections that fell back", c.jumps, "-"],
        ["largest fall", jump, unit],
        ["cycles at a limit", c.limited, "-"],
        ["cycles that this computer missed", statistics.overruns, "-"],
    ]
    for way, counts in (("telegrams", statistics.telegram_faults), ("answers", statistics.answer_faults)):
        for fault in ("late", "lost", "doubled", "reordered", "truncated"):
            if number := getattr(counts, fault):
                rows.append([f"{way} {fault} on purpose", number, "-"])
    faults = statistics.controller.telegrams.to_dict()
    rows += [
        [f"answers: {name.replace('_', ' ')}", faults[name], "-"] for name in faults if name != "good" and faults[name]
    ]
    return rows


def time_rows(statistics: rsi.EmulatorStatistics) -> list[list[object]]:
    named = (("period", statistics.period), ("lateness", statistics.lateness), ("answer", statistics.answer))
    return [[name, *(1e3 * v for v in (d.p50, d.p99, d.p999, d.max))] for name, d in named if d.count]


def event_detail(event: rsi.ControllerEvent, layout: rsi.TelegramLayout) -> str:
    kind = str(event.kind)
    if kind == "ended":
        return rsi.stop_message(layout.controller, event.stop)
    if kind == "override":
        return f"{100 * event.value:.0f} %"
    if kind == "overrun":
        return format_count(int(event.value), "cycle")
    if kind == "jump":
        size, unit = fall(event.value, layout)
        return f"{format_number(size)} {unit}"
    return NONE


def rare_events(events: Sequence[rsi.ControllerEvent]) -> list[rsi.ControllerEvent]:
    """The first of each kind that may come in every cycle, and the first of the others."""
    often = ("missing", "jump", "limited", "overrun")
    firsts = {kind: next((e for e in events if str(e.kind) == kind), None) for kind in often}
    return [e for e in events if str(e.kind) not in often or e is firsts[str(e.kind)]][:MOST_EVENTS]


def event_rows(events: Sequence[rsi.ControllerEvent], layout: rsi.TelegramLayout) -> list[list[str]]:
    return [[f"{e.time:.3f}", EVENT_NAMES[str(e.kind)], event_detail(e, layout)] for e in events]
