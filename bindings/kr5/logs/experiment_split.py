"""Which parts of logs are to fit and which to check: whole runs where there are several, else a log cut at rest, else
one that is simulated from its beginning and judged by its last rows."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kr5.logs.rest_guess import LEAST_MOTION, cut_at_rest, initial_speeds, segments, time_of_share

FIT_SHARE = 0.7  # of the motion, or of the rows of what does not move
MOVING = 0.02  # [rad/s or m/s] at its first rows, above which a motion does not begin at rest
LEAST_ROWS = 10


@dataclass
class RawPart:
    """A log of one kind: its times from the beginning of the log (rows, where there are none), the positions of a
    motion and the commands beside measured ones, the runs of other kinds."""

    kind: str
    file: Path
    t: np.ndarray
    q: np.ndarray | None = None
    commands: np.ndarray | None = None
    runs: np.ndarray | None = None
    commanded: bool = False
    settle: float = 0.0  # [s]
    max_gap: float | None = None  # [s] between rows, where the user states it


@dataclass
class Piece:
    part: int
    entry: dict[str, Any]
    length: float  # time or rows
    rows: tuple[int, int]


def split_parts(parts: list[RawPart], reasons: list[list[str]]) -> list[tuple[int, dict[str, Any]]]:
    """Experiments of a map (without their columns), each with the number of its part."""
    pieces: list[Piece] = []
    for kind in dict.fromkeys(p.kind for p in parts):
        own = [piece for k, p in enumerate(parts) if p.kind == kind for piece in _pieces(k, p)]
        pieces += _judged(own, parts, reasons)
    count: dict[str, int] = {}
    for piece in pieces:
        kind = parts[piece.part].kind
        count[kind] = count.get(kind, 0) + 1
        piece.entry = {"name": f"{kind}-{count[kind]}", "kind": kind} | piece.entry
    return [(piece.part, piece.entry) for piece in pieces]


def _pieces(number: int, part: RawPart) -> list[Piece]:
    """A log, parted where its clock stands still."""
    if part.q is None:
        return [Piece(number, {}, float(len(part.t)), (0, len(part.t)))]
    t = part.t
    found = [
        (a, b)
        for a, b in segments(t, part.max_gap)
        if b - a >= LEAST_ROWS and np.ptp(part.q[a:b], axis=0).max() > LEAST_MOTION
    ]
    out = []
    for a, b in found or [(0, len(t))]:
        entry: dict[str, Any] = {}
        if a > 0:
            entry["from"] = _between(t, a)
        if b < len(t):
            entry["to"] = _between(t, b)
        out.append(Piece(number, entry, float(t[b - 1] - t[a]), (a, b)))
    return out


def _between(t: np.ndarray, row: int) -> float:
    return _rounded((t[row - 1] + t[row]) / 2)


def _rounded(t: float) -> float:
    """A time to be written in a map, to a tenth of a millisecond [s]."""
    return round(float(t), 4)


def _judged(pieces: list[Piece], parts: list[RawPart], reasons: list[list[str]]) -> list[Piece]:
    """The pieces of one kind with their splits: the last ones to check, or the only one cut in two."""
    kind = parts[pieces[0].part].kind
    if len(pieces) == 1:
        pieces = _halves(pieces[0], parts[pieces[0].part], reasons)
    else:
        reached = np.cumsum([p.length for p in pieces]) / max(sum(p.length for p in pieces), 1e-30)
        fitted = int(np.argmin(np.abs(reached[:-1] - FIT_SHARE))) + 1
        for k, piece in enumerate(pieces):
            piece.entry["split"] = "fit" if k < fitted else "check"
        shares = f"{fitted} to fit, {len(pieces) - fitted} to check"
        reasons.append([f"split of {kind}", shares, "the last ones are to check"])
    for piece in pieces:
        _lead_in(piece, parts[piece.part], reasons)
    return pieces


def _halves(piece: Piece, part: RawPart, reasons: list[list[str]]) -> list[Piece]:
    if part.q is None:
        return _row_halves(piece, part, reasons)
    a, b = piece.rows
    t, q = part.t[a:b], part.q[a:b]
    fit, check = dict(piece.entry), dict(piece.entry)
    rest = cut_at_rest(t, q, FIT_SHARE)
    cut = _rounded(rest if rest is not None else time_of_share(t, q, FIT_SHARE))
    fit["to"] = cut
    if rest is not None or not part.commanded:
        check["from"] = cut
        why = "cut where the arm rests" if rest is not None else "measured positions need no rest to begin from"
    else:
        check["lead_in"] = _rounded(cut - check.get("from", float(t[0])))
        why = "the arm never rests: all of the log is simulated, and its last rows are judged"
    reasons.append(["split of motion", f"up to {cut:g} s to fit, the rest to check", why])
    rows = int(np.searchsorted(t, cut)) + a
    return [
        Piece(piece.part, fit | {"split": "fit"}, cut - float(t[0]), (a, rows)),
        Piece(piece.part, check | {"split": "check"}, float(t[-1]) - cut, (a if "lead_in" in check else rows, b)),
    ]


def _row_halves(piece: Piece, part: RawPart, reasons: list[list[str]]) -> list[Piece]:
    """Cut between runs, views, lines or poses, where there is more than one; else everything is to fit."""
    runs = part.runs if part.runs is not None else part.t
    starts = np.flatnonzero(np.append(True, np.diff(runs) != 0))
    if len(starts) < 2:
        piece.entry["split"] = "fit"
        reasons.append([f"split of {part.kind}", "all to fit", "it is one run; nothing is left to check by"])
        return [piece]
    rows = int(starts[min(len(starts) - 1, max(1, round(FIT_SHARE * len(starts))))])
    reasons.append([f"split of {part.kind}", f"rows up to {rows} to fit, the rest to check", "cut between runs"])
    a, b = piece.rows
    return [
        Piece(piece.part, {"split": "fit", "rows": [a + 1, rows]}, rows, (a, rows)),
        Piece(piece.part, {"split": "check", "rows": [rows + 1, b]}, b - rows, (rows, b)),
    ]


def _lead_in(piece: Piece, part: RawPart, reasons: list[list[str]]) -> None:
    """A simulation begins at rest: one of a log that begins in motion is judged once the servos have forgotten it."""
    if part.q is None or not part.commanded or "lead_in" in piece.entry:
        return
    a, b = piece.rows
    commands = None if part.commands is None else part.commands[a:b]
    speed = float(initial_speeds(part.t[a:b], part.q[a:b], commands).max())
    if speed > MOVING and part.settle < 0.5 * piece.length:
        piece.entry["lead_in"] = float(f"{part.settle:.3g}")
        reasons.append(
            [
                "lead-in",
                f"first {part.settle:.3g} s not judged",
                f"the log begins while a joint moves at {speed:.2g} rad/s",
            ]
        )
