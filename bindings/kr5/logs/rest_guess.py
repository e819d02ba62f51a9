"""Where a motion rests, and where a log of it may be cut."""

from dataclasses import dataclass

import numpy as np

import kr5.cell
from kr5.logs.sparse_columns import longest_step

QUIET_SHARE = 0.01  # of a joint's fastest speed, below which it rests
LEAST_REST = 0.25  # [s]
NOTICEABLE = 0.05  # [s] over which a way is counted, so that noise adds little to it
STARTING = 0.5  # of the speed of its command, below which an arm begins at rest
SURE = 4.0  # standard deviations of a speed that is no noise
LEAST_MOTION = 1e-3  # [rad or m] that a joint must go to have moved


@dataclass
class Rest:
    begin: float  # [s]
    end: float


def joints_move(q: np.ndarray) -> bool:
    """Whether any joint goes further than its noise; q: rows x joints [rad or m]."""
    return bool((np.ptp(q, axis=0) > LEAST_MOTION).any())


def segments(t: np.ndarray, max_gap: float | None = None) -> list[tuple[int, int]]:
    """Rows [first, last) of the parts between gaps of the clock; t rises [s]."""
    cuts = [0, *(int(k) + 1 for k in np.flatnonzero(np.diff(t) > longest_step(t, max_gap))), len(t)]
    return [(a, b) for a, b in zip(cuts, cuts[1:])]


def rests(t: np.ndarray, q: np.ndarray) -> list[Rest]:
    """Spans in which all joints stand; q: rows x joints."""
    if len(t) < 5 or not np.median(np.diff(t)) > 0:
        return []
    speed = np.abs(np.gradient(q, t, axis=0))
    fastest = np.quantile(speed, 0.99, axis=0)
    limit = np.maximum(QUIET_SHARE * fastest.max(), 5 * _roughness(q) / float(np.median(np.diff(t))))
    still = (speed <= limit).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    spans = [Rest(float(t[a]), float(t[b - 1])) for a, b in zip(edges[::2], edges[1::2])]
    return [s for s in spans if s.end - s.begin >= LEAST_REST]


def initial_speeds(t: np.ndarray, q: np.ndarray, commands: np.ndarray | None = None) -> np.ndarray:
    """How fast each joint surely moves at the first row, noise of the readings taken off [rad/s or m/s]; q, commands:
    rows x joints. 0 where it is still far slower than its command: an arm that begins at rest."""
    found = [kr5.cell.initial_speed(t, column) for column in q.T]
    out = np.array([max(abs(v) - SURE * gain * noise, 0.0) for (v, gain), noise in zip(found, _roughness(q))])
    if commands is not None:
        commanded = [abs(kr5.cell.initial_speed(t, column)[0]) for column in commands.T]
        out[out < STARTING * np.array(commanded)] = 0.0
    return out


def _roughness(q: np.ndarray) -> np.ndarray:
    """Noise of the readings of each joint, where the motion is slow."""
    return np.asarray(1.4826 * np.median(np.abs(np.diff(q, 2, axis=0)), axis=0) / np.sqrt(6))


def motion_share(t: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Share of the way of all joints, each in units of its range, that lies before each time; a rest adds nothing."""
    stride = max(1, round(NOTICEABLE / max(float(np.median(np.diff(t))), 1e-9)))
    rows = np.append(np.arange(0, len(t) - 1, stride), len(t) - 1)
    steps = np.abs(np.diff(q[rows], axis=0)) / np.maximum(np.ptp(q, axis=0), LEAST_MOTION)
    way = np.concatenate([[0.0], np.cumsum(steps.sum(axis=1))])
    return np.asarray(np.interp(np.arange(len(t)), rows, way / max(float(way[-1]), 1e-30)))


def time_of_share(t: np.ndarray, q: np.ndarray, share: float) -> float:
    """Time before which this share of the motion lies [s]."""
    return float(t[np.searchsorted(motion_share(t, q), share)])


def cut_at_rest(t: np.ndarray, q: np.ndarray, share: float) -> float | None:
    """Time of the rest nearest to a share of the motion, between a half and 0.9 of it; nothing where there is none."""
    before = motion_share(t, q)
    inside = [r for r in rests(t, q) if 0.5 <= np.interp(r.end, t, before) <= 0.9]
    if not inside:
        return None
    best = min(inside, key=lambda r: abs(np.interp(r.end, t, before) - share))
    return float(max(best.begin, best.end - LEAST_REST / 2))
