"""Reasons to doubt turns of several joints together: what no single arc shows."""

from typing import Any

import numpy as np

LONGEST, SHORTEST = 20.0, 1e-2  # sum of the lengths of an arm that a person can mean [m]
SURE = 8.0  # standard deviations


def home_point_doubts(
    turns: list[list[Any]], labels: list[list[str]], results: list[Any], home: np.ndarray
) -> list[str]:
    """Joints between which the device moved: by the turn of each joint, the point is elsewhere when all stand at home.

    Only for joints with known values: without them, nothing says where the others stood.
    """
    if any(s.q is None for turn in turns for s in turn):
        return []
    places, spreads = [], []
    for k, (turn, result) in enumerate(zip(turns, results, strict=True)):
        place, spread = _place_at_home(turn, result, float(home[k]))
        places.append(place), spreads.append(spread)
    out = []
    for k in range(1, len(places)):
        off = float(np.linalg.norm(places[k] - places[k - 1]))
        if off > SURE * max(np.hypot(spreads[k], spreads[k - 1]), 1e-9):
            out.append(
                f"between joint {k} (to {labels[k - 1][-1]}) and joint {k + 1} (from {labels[k][0]}) the measured point"
                f" at home jumps by {1e3 * off:.2f} mm: the device or the base moved, or another joint did"
            )
    return out


def _place_at_home(turn: list[Any], result: Any, home: float) -> tuple[np.ndarray, float]:
    """Where the first point, or the tool, is on the circle of a joint when the joint is at home, and about how well
    that is known [m]."""
    inverse = np.linalg.inv(result.T_world_axis)
    inside = [i for i in range(len(turn)) if i not in set(result.outliers)]
    inside = [i for i in inside if np.isfinite(_place(turn[i])).all()]
    back = []
    for i in inside:  # turned back about the axis by its own joint value
        angle = home - turn[i].q
        c, s = np.cos(angle), np.sin(angle)
        back.append(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ (inverse @ np.append(_place(turn[i]), 1))[:3])
    scatter = np.std(back, axis=0).max()
    # The axis is known less well than the points that it is of; beside the arc that does not matter.
    spread = max(scatter, result.sigma_position) / np.sqrt(max(1, len(back) - 5))
    lever = float(np.hypot(*np.mean(back, axis=0)[:2]))
    tilt = float(np.sqrt(np.trace(result.covariance[2:, 2:]))) * max(lever, result.arc * lever)
    reach = max((abs(turn[i].q - home) for i in inside), default=0.0)
    offset = float(np.sqrt(np.trace(result.covariance[:2, :2]))) * min(1.0, reach)
    return (np.asarray(result.T_world_axis) @ np.append(np.mean(back, axis=0), 1))[:3], float(
        np.sqrt(spread**2 + tilt**2 + offset**2)
    )


def _place(sample: Any) -> np.ndarray:
    return np.asarray(sample.T_world_tool)[:3, 3] if sample.T_world_tool is not None else sample.points[:, 0]


def length_doubts(chain: Any) -> list[str]:
    """A unit of lengths that no arm has."""
    size = sum(abs(j.a) + abs(j.b) for j in chain.joints)
    if size > LONGEST:
        return [f"the arm would be {size:.0f} m long: are the lengths in millimetres? (--length mm)"]
    if size < SHORTEST:
        return [f"the arm would be {1e3 * size:.3g} mm long: are the lengths in metres? (--length m)"]
    return []
