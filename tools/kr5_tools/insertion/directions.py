"""Direction of the hole by the last turn: by its fit, by moments, by the least depth, beside the true one."""

import math
from typing import TYPE_CHECKING

import numpy as np

from kr5_tools.cli.numbers import NONE, format_degrees

if TYPE_CHECKING:
    import kr5.sim

COLUMNS = ["by", "direction [deg]", "± std [deg]", "error [deg]"]
TEXT = (
    "Direction: azimuth of the hole from the centre of the turn, in the plane of the face of the tube, from X. Error:"
    " from the true direction. Fit: the estimate of the insertion itself, with compliance. Moment: without a standard"
    " deviation, because its error is systematic: it neglects friction and compliance. Beyond the critical offset the"
    " least depth lies opposite to the hole."
)


def directions(result: "kr5.sim.InsertionResult") -> dict[str, dict[str, float | None]]:
    """Azimuth of the hole and its standard deviation [rad], None where it is not known; empty without a turn."""
    from kr5 import force

    turn = result.profile
    if not len(turn):
        return {}
    column = {name: np.asarray(turn[name]) for name in turn.columns}
    centre = np.array([np.mean(column["x"]), np.mean(column["y"])])
    rows = [
        force.TurnRow(azimuth=a, force=f, moment=[x, y])
        for a, f, x, y in zip(*(column[name] for name in ("azimuth", "force", "moment_x", "moment_y")))
    ]
    moment = force.locate_by_moment(rows)
    known = moment.report.usable
    out = {name: _direction(None) for name in ("fit", "moment", "least depth", "true")}
    if fitted := [p for p in result.pegs if p.hole_std > 0]:
        way = np.array(fitted[-1].hole)[:2] - centre
        out["fit"] = _direction(_azimuth(way), fitted[-1].hole_std / np.hypot(*way))
    out["moment"] = _direction(moment.azimuth if known else None)
    out["least depth"] = _direction(float(column["azimuth"][np.argmin(column["height"])]))
    out["true"] = _direction(_azimuth(np.array(result.T_tube_actual)[:2, 3] - centre))
    return out


def _azimuth(way: np.ndarray) -> float:
    return math.atan2(way[1], way[0]) % math.tau


def _direction(azimuth: float | None, std: float | None = None) -> dict[str, float | None]:
    return {"azimuth": None if azimuth is None else float(azimuth), "std": None if std is None else float(std)}


def table_rows(result: "kr5.sim.InsertionResult") -> list[list[str]]:
    return direction_rows(directions(result))


def direction_rows(found: dict[str, dict[str, float | None]]) -> list[list[str]]:
    """Rows of what `directions` found."""
    true = found["true"]["azimuth"] if found else None
    return [
        [
            name,
            format_degrees(d["azimuth"]),
            format_degrees(d["std"]),
            (
                NONE
                if d["azimuth"] is None or true is None or name == "true"
                else format_degrees(math.remainder(d["azimuth"] - true, math.tau), sign=True)
            ),
        ]
        for name, d in found.items()
    ]
