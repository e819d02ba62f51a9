"""Rows of times of a link, for people."""

from kr5 import rsi

TIMING_COLUMNS = ["time", "number", "p50 [ms]", "p99 [ms]", "p99.9 [ms]", "max [ms]"]


def timing_rows(**times: rsi.Distribution) -> list[list[object]]:
    """A row for each distribution that is not empty."""
    return [
        [name, t.count, *(1e3 * value for value in (t.p50, t.p99, t.p999, t.max))]
        for name, t in times.items()
        if t.count
    ]
