"""Where the last turn says the hole is: by depths, by moments, by the least depth, beside where it really is."""

import math
from typing import Any

import numpy as np

COLUMNS = ["by", "direction [deg]", "off [deg]"]
TEXT = ("Direction: azimuth of the hole as seen from where the peg went round, in the plane of the tube's face, from X. Off: from the real one. "
        "The least depth lies opposite the hole beyond the critical offset.")


def directions(result: Any) -> dict[str, float | None]:
    """Azimuths of the hole [rad], None where there is no telling; empty without a turn."""
    from kr5 import force

    turn = result.profile
    if not len(turn):
        return {}
    peg, tube = result.cell.peg, result.cell.tube
    bodies = force.PegTube(peg_radius=peg.radius, inner_radius=tube.inner_radius, outer_radius=tube.outer_radius)
    column = {name: np.asarray(turn[name]) for name in turn.columns}
    rows = [force.TurnRow(azimuth=a, force=f, moment=[x, y])
            for a, f, x, y in zip(*(column[name] for name in ("azimuth", "force", "moment_x", "moment_y")))]
    by_depth = force.fit_tube(bodies, float(np.mean(column["tilt"])), column["azimuth"], column["height"])
    by_moment = force.locate_by_moment(rows)
    x, y = np.array(result.T_T_tube)[:2, 3] - [np.mean(column["x"]), np.mean(column["y"])]
    return {"depth": _known(by_depth), "moment": _known(by_moment), "least depth": float(column["azimuth"][np.argmin(column["height"])]),
            "really": math.atan2(y, x) % math.tau}


def _known(found: Any) -> float | None:
    return float(found.azimuth) if found.report.usable else None


def table_rows(result: Any) -> list[list[str]]:
    found = directions(result)
    return [[name, "–" if a is None else f"{math.degrees(a):.1f}",
             "–" if a is None or name == "really" else f"{math.degrees(math.remainder(a - found['really'], math.tau)):+.1f}"] for name, a in found.items()]
