"""Which parts of logs are to fit and which to check: motions as the library splits them, of other kinds whole logs
where there are several, else one cut between its runs."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from kr5 import arm_log

FIT_SHARE = 0.7  # of the rows of what does not move, of a log that is cut by its time


@dataclass
class RawPart:
    """A log of one kind: a motion, or the number of rows and the runs of another kind."""

    kind: str
    name: str  # of the log, and its episode
    motion: arm_log.LoggedMotion | None = None
    rows: int = 0
    runs: np.ndarray | None = None
    kept_to_check: bool = False  # as the user states it
    end: float = np.inf  # [s] from which on rows are left out, as the user states it


NumberedExperiment = tuple[int, dict[str, Any]]  # number of a part, experiment of a map


def split_parts(parts: list[RawPart], reasons: list[list[str]]) -> list[NumberedExperiment]:
    """Experiments of a map (without their columns), each with the number of its part."""
    out: list[NumberedExperiment] = []
    for kind in dict.fromkeys(p.kind for p in parts):
        own = [k for k, p in enumerate(parts) if p.kind == kind]
        split = _split_motions if parts[own[0]].motion is not None else _split_rows
        for count, (number, entry) in enumerate(split(own, parts, reasons), 1):
            out.append((number, {"name": f"{kind}-{count}", "kind": kind} | entry))
    return out


def _split_motions(own: list[int], parts: list[RawPart], reasons: list[list[str]]) -> list[NumberedExperiment]:
    spans = arm_log.split_motions([_motion_of(parts[k]) for k in own])
    _tell_cut(spans, [parts[k].name for k in own], any(parts[k].kept_to_check for k in own), reasons)
    out: list[NumberedExperiment] = []
    for span in spans:
        entry: dict[str, Any] = {}
        if np.isfinite(span.begin):
            entry["from"] = span.begin
        end = min(span.end, parts[own[span.log]].end)
        if np.isfinite(end):
            entry["to"] = end
        entry["split"] = str(span.split)
        if span.lead_in > 0:
            entry["lead_in"] = span.lead_in
        if span.initial_speed > 0:
            reasons.append(
                [
                    "lead-in",
                    f"first {span.lead_in:.3g} s not judged",
                    f"the log begins while a joint moves at {span.initial_speed:.2g} rad/s",
                ]
            )
        out.append((own[span.log], entry))
    return out


def _motion_of(part: RawPart) -> arm_log.LoggedMotion:
    motion = part.motion
    assert motion is not None, "a part of a kind that moves"
    motion.kept_to_check = part.kept_to_check
    if np.isfinite(part.end):
        used = np.asarray(motion.t) < part.end
        motion.t, motion.q = np.asarray(motion.t)[used], np.asarray(motion.q)[used]
        if motion.command.size:
            motion.command = np.asarray(motion.command)[used]
    return motion


CUTS = {
    "at_rest": "cut where the arm rests",
    "measured": "measured positions need no rest to begin from",
    "lead_in": "the arm never rests: its last rows are judged, after a lead-in",
}


def _tell_cut(spans: list[arm_log.MotionSpan], names: list[str], stated: bool, reasons: list[list[str]]) -> None:
    fitted = [span for span in spans if str(span.split) == "fit"]
    checked = [span for span in spans if str(span.split) == "check"]
    if str(spans[0].cut) == "uncut":
        several = len(set(names)) > 1
        fit, check = (_named([names[s.log] for s in p]) if several else str(len(p)) for p in (fitted, checked))
        why = "as stated" if stated else "the last ones are to check"
        reasons.append(["split of motion", f"{fit} to fit, {check} to check", why])
    else:
        cut = max(span.end for span in fitted)
        reasons.append(["split of motion", f"up to {cut:g} s to fit, the rest to check", CUTS[str(spans[0].cut)]])
    if stretches := [span for span in spans if span.stretch]:
        logs = "the log" if len(names) == 1 else "the logs"
        reasons.append(["stretches", f"{len(stretches)} of {logs}", "all rows are too many to be simulated"])


MOST_NAMED = 12


def _named(names: list[str]) -> str:
    """Logs by their names; the number of them, where they are many."""
    different = list(dict.fromkeys(names))
    return ", ".join(different) if len(different) <= MOST_NAMED else f"{len(different)} logs"


def _split_rows(own: list[int], parts: list[RawPart], reasons: list[list[str]]) -> list[NumberedExperiment]:
    """Whole logs, the last ones to check; the only one cut in two."""
    kind = parts[own[0]].kind
    if len(own) == 1:
        return [(own[0], entry) for entry in _row_halves(parts[own[0]], reasons)]
    rows = np.array([parts[k].rows for k in own], float)
    reached = np.cumsum(rows) / max(rows.sum(), 1e-30)
    fitted = int(np.argmin(np.abs(reached[:-1] - FIT_SHARE))) + 1
    shares = f"{fitted} to fit, {len(own) - fitted} to check"
    reasons.append([f"split of {kind}", shares, "the last ones are to check"])
    return [(number, {"split": "fit" if k < fitted else "check"}) for k, number in enumerate(own)]


def _row_halves(part: RawPart, reasons: list[list[str]]) -> list[dict[str, Any]]:
    """Cut between runs, views, lines or poses, where there is more than one; else everything is to fit."""
    runs = part.runs if part.runs is not None else np.arange(part.rows)
    starts = np.flatnonzero(np.append(True, np.diff(runs) != 0))
    if len(starts) < 2:
        reasons.append([f"split of {part.kind}", "all to fit", "it is one run; nothing is left to check by"])
        return [{"split": "fit"}]
    rows = int(starts[min(len(starts) - 1, max(1, round(FIT_SHARE * len(starts))))])
    reasons.append([f"split of {part.kind}", f"rows up to {rows} to fit, the rest to check", "cut between runs"])
    return [{"split": "fit", "rows": [1, rows]}, {"split": "check", "rows": [rows + 1, part.rows]}]
