"""What an insertion did, phase by phase, and how each peg ended: as rows of tables and as JSON."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from kr5_tools.cli.numbers import NONE
from kr5_tools.insertion import directions

if TYPE_CHECKING:
    import kr5.io
    import kr5.sim
    import numpy as np


def phases(rows: "kr5.io.Table") -> list[dict[str, Any]]:
    """What was done when: peg, attempt, phase, begin and duration [s]."""
    import kr5.force
    import numpy as np

    if not len(rows):
        return []
    t = np.asarray(rows["t"])
    key = np.column_stack([rows[name] for name in ("peg", "attempt", "phase")]).astype(int)
    starts = np.append(0, np.flatnonzero(np.any(np.diff(key, axis=0) != 0, axis=1)) + 1)
    ends = np.append(t[starts[1:]], t[-1])
    return [
        {
            "peg": int(key[k, 0]),
            "attempt": int(key[k, 1]),
            "phase": str(kr5.force.Phase(int(key[k, 2]))),
            "begin": float(t[k]),
            "duration": float(end - t[k]),
        }
        for k, end in zip(starts, ends)
    ]


def as_dict(result: "kr5.sim.InsertionResult", setup: "kr5.sim.InsertionSetup") -> dict[str, Any]:
    """All of it but the rows, in SI."""
    profile = {name: result.profile[name] for name in result.profile.columns} if len(result.profile) else {}
    return {
        "inserted": result.inserted,
        "time": result.time,
        "setup": setup.to_dict(),
        "pegs": [p.to_dict() for p in result.pegs],
        "phases": phases(result.rows),
        "profile": profile,
        "directions": directions.directions(result),
        "tube": result.cell.tube.to_dict(),
        "peg": result.cell.peg.to_dict(),
        "T_tube_actual": result.T_tube_actual,
    }


def phase_rows(result: "kr5.sim.InsertionResult") -> list[list[Any]]:
    """Of each attempt: its phases with their durations, and where in time it began."""
    return rows_of_phases(phases(result.rows))


def rows_of_phases(all_phases: list[dict[str, Any]]) -> list[list[Any]]:
    """The same of what `phases` returned."""
    found: dict[tuple[int, int], list[dict[str, Any]]] = {}
    for p in all_phases:
        found.setdefault((p["peg"], p["attempt"]), []).append(p)
    return [
        [
            f"{peg}",
            attempt,
            f"{each[0]['begin']:.2f}",
            f"{sum(p['duration'] for p in each):.2f}",
            ", ".join(f"{p['phase']} {p['duration']:.2f}" for p in each if p["duration"] > 0),
        ]
        for (peg, attempt), each in found.items()
    ]


def peg_rows(result: "kr5.sim.InsertionResult") -> list[list[Any]]:
    """How each peg fared, in mm."""
    return rows_of_pegs([p.to_dict() for p in result.pegs], result.T_tube_actual)


def _max_force(peg: Mapping[str, Any]) -> float:
    """[N], also of files in which it is called `greatest_force`."""
    return float(peg["max_force"] if "max_force" in peg else peg["greatest_force"])


def rows_of_pegs(
    pegs: list[dict[str, Any]], T_tube_actual: "Sequence[Sequence[float]] | np.ndarray"
) -> list[list[Any]]:
    """The same of pegs as JSON holds them."""
    off = 1e3 * math.hypot(*(row[3] for row in T_tube_actual[:2]))
    return [
        [
            f"{k}",
            "yes" if p["inserted"] else "no",
            p["attempts"],
            f"{p['time']:.2f}",
            f"{1e3 * p['depth']:.2f}",
            f"{_max_force(p):.1f}",
            f"{off:.3f}",
            NONE if p["hole_error"] is None or math.isnan(p["hole_error"]) else f"{1e3 * p['hole_error']:.3f}",
        ]
        for k, p in enumerate(pegs, 1)
    ]


PEG_COLUMNS = ["peg", "in", "attempts", "time [s]", "depth [mm]", "force [N]", "offset [mm]", "error [mm]"]
PEG_TEXT = (
    "Force: largest force on the peg. Offset: true axis of the tube from the assumed one. Error: the same from the"
    " axis estimated by the fit; – without a fit."
)
PHASE_COLUMNS = ["peg", "attempt", "begin [s]", "duration [s]", "phases [s]"]
