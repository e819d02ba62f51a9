"""Where a motion rests, and where a log of it may be cut."""

from dataclasses import dataclass

import numpy as np

QUIET_SHARE = 0.01  # of a joint's fastest speed, below which it rests
LEAST_REST = 0.25  # [s]
LEAST_MOTION = 1e-3  # [rad or m] that a joint must go to have moved
GAP = 5.0  # median steps, more than which a log stands still


@dataclass
class Rest:
    begin: float  # [s]
    end: float


def joints_move(q: np.ndarray) -> bool:
    """Whether any joint goes further than its noise; q: rows x joints [rad or m]."""
    return bool((np.ptp(q, axis=0) > LEAST_MOTION).any())


def segments(t: np.ndarray, max_gap: float | None = None) -> list[tuple[int, int]]:
    """Rows [first, last) of the parts between gaps of the clock; t rises [s]."""
    if len(t) < 3:
        return [(0, len(t))]
    steps = np.diff(t)
    most = max_gap if max_gap is not None else max(GAP * float(np.median(steps)), 0.01)
    cuts = [0, *(int(k) + 1 for k in np.flatnonzero(steps > most)), len(t)]
    return [(a, b) for a, b in zip(cuts, cuts[1:])]


def rests(t: np.ndarray, q: np.ndarray) -> list[Rest]:
    """Spans in which all joints stand; q: rows x joints."""
    if len(t) < 5 or not np.median(np.diff(t)) > 0:
        return []
    speed = np.abs(np.gradient(q, t, axis=0))
    fastest = np.quantile(speed, 0.99, axis=0)
    rough = 1.4826 * np.median(np.abs(np.diff(q, 2, axis=0)), axis=0) / np.sqrt(6)  # noise, where the motion is slow
    limit = np.maximum(QUIET_SHARE * fastest.max(), 5 * rough / float(np.median(np.diff(t))))
    still = (speed <= limit).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    spans = [Rest(float(t[a]), float(t[b - 1])) for a, b in zip(edges[::2], edges[1::2])]
    return [s for s in spans if s.end - s.begin >= LEAST_REST]


def speed_at(t: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Speed of each joint at the first rows [rad/s or m/s], from a line through a few of them."""
    n = min(8, len(t))
    at = t[:n] - t[:n].mean()
    return np.asarray(at @ (q[:n] - q[:n].mean(axis=0)) / max(float(at @ at), 1e-30))


def cut_at_rest(t: np.ndarray, q: np.ndarray, share: float) -> float | None:
    """Time of the rest nearest to a share of the log, between a half and 0.9 of it; nothing where there is none."""
    begin, length = float(t[0]), float(t[-1] - t[0])
    wanted = begin + share * length
    inside = [r for r in rests(t, q) if begin + 0.5 * length <= r.end <= begin + 0.9 * length]
    if not inside:
        return None
    best = min(inside, key=lambda r: abs(r.end - wanted))
    return max(best.begin, best.end - LEAST_REST / 2)
