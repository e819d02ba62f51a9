"""Measured positions that stand for a motion: smoothed, since speeds and accelerations follow from them."""

from dataclasses import dataclass

import numpy as np

from kr5 import identification
from kr5.logs.values import Series, low_pass

MARGIN = 5.0  # [s] beyond an experiment that a filter may use
HIGHEST = 0.45  # of the rate of the log, above which nothing is left to smooth away
EDGE = 2.0  # periods of the cut-off at the ends of a log, where the filter knows one side of the motion only
SAMPLES = 20  # rows a period of the cut-off that are kept
MOST_ROWS = 3000  # of an experiment


@dataclass
class Smoothing:
    cutoff: float  # [Hz]
    even_step: float | None  # [s], where the stamps came late and the samples were even
    stride: int  # rows of the log of which one is kept
    smooths: bool


def choose_smoothing(q: Series, loads: np.ndarray | None) -> Smoothing:
    """Cut-off five times the bandwidth of the motion, and the meaning of uneven stamps, as kr5 identify dynamics takes
    them."""
    step = float(np.median(np.diff(q.t)))
    log = identification.JointLog(t=q.t, q=q.values, tau=loads if loads is not None else np.zeros_like(q.values))
    found = identification.condition_log(log, identification.ConditioningOptions(accept=_every_fault()))
    even = float(found.step) if found.usable and found.even_clock else None
    rows = np.arange(q.t[0], q.t[-1] + step / 2, step)
    smooth = np.column_stack([np.interp(rows, q.t, column) for column in q.values.T])
    cutoff = float(found.cutoff) if found.usable else 5 * identification.motion_bandwidth(smooth, step)
    smooths = 0 < cutoff < HIGHEST / step
    stride = max(1, int(1 / (SAMPLES * max(cutoff, 1e-3) * step)))
    return Smoothing(cutoff, even, stride, smooths)


def _every_fault() -> str:
    return ",".join(str(f) for f in identification.LogFault.__members__.values())


def smoothed(s: Series, smoothing: Smoothing, where: str) -> Series:
    return low_pass(s, smoothing.cutoff, where) if smoothing.smooths else s


def kept_times(
    t: np.ndarray, smoothing: Smoothing, span: tuple[float, float], smoothed_span: tuple[float, float]
) -> np.ndarray:
    """Rows of the log that an experiment [begin, end) keeps: not those near an end of what was smoothed, where the
    filter knows one side only. All in s."""
    edge = EDGE / smoothing.cutoff if smoothing.smooths else 0.0
    inside = t[(t >= span[0]) & (t < span[1]) & (t >= smoothed_span[0] + edge) & (t <= smoothed_span[1] - edge)]
    return np.asarray(inside[:: max(smoothing.stride, -(-len(inside) // MOST_ROWS))])
