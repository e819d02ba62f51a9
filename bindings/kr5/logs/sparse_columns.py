"""Columns with numbers in some rows only, as in a table of several topics, each with instants of its own."""

from collections.abc import Sequence

import numpy as np

GAP = 5.0  # median steps between numbers, more than which is a gap
LEAST_GAP = 0.01  # [s]


def never_complete(values: np.ndarray) -> bool:
    """Whether every column has numbers, but never in the same row; values: rows x columns."""
    known = np.isfinite(values)
    return bool(known.any(axis=0).all() and not known.all(axis=1).any())


def aligned(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows at which the first column has a number, as times and values; the others are interpolated between their own
    numbers and never continued beyond them. t: rows [s]; values: rows x columns."""
    known = np.isfinite(values)
    spans = [t[k] for k in known.T]
    low, high = max(float(s.min()) for s in spans), min(float(s.max()) for s in spans)
    at = t[known[:, 0] & (t >= low) & (t <= high)]
    out = [np.interp(at, *_rising(t[k], column[k])) for k, column in zip(known.T, values.T)]
    return at, np.column_stack(out)


def _rising(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    times, first = np.unique(t, return_index=True)
    return times, values[first]


def longest_step(t: np.ndarray, max_gap: float | None = None) -> float:
    """Step between numbers above which nothing is interpolated [s]; t rises [s]."""
    if max_gap is not None:
        return max_gap
    return max(GAP * float(np.median(np.diff(t))), LEAST_GAP) if len(t) > 2 else np.inf


def covered(at: np.ndarray, columns: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """At which times every column has numbers on both sides, none farther apart than its longest step. Each column:
    times [s] and values."""
    out = np.ones(len(at), bool)
    for t, values in columns:
        own = np.unique(t[np.isfinite(values) & np.isfinite(t)])
        if len(own) < 2:
            return np.zeros(len(at), bool)
        after = np.clip(np.searchsorted(own, at, "left"), 1, len(own) - 1)
        inside = (at >= own[0]) & (at <= own[-1])
        near = (np.diff(own)[after - 1] <= longest_step(own)) | np.isin(at, own)
        out &= inside & near
    return out
