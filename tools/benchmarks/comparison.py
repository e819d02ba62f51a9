"""What every bench ends with: one table of what was measured, here and by others, what is wanted and whether it is
reached.

A difference or a rate is judged by its 95 % interval, not by its value.
"""

import json
import os
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from scipy import stats

from kr5_tools.cli.tables import make_table
from kr5_tools.cli.terminal import errors, track

ROWS_FILE = "KR5_BENCH_ROWS"  # environment variable: the file to which rows are appended


@dataclass
class Row:
    """One quantity; `interval` stands beside `ours` where that is a rate or a mean beside no measured peer, and is that
    of ours less the peer's otherwise. `figure` names the wanted figure that it answers in the table of a group of
    benches; `ratio` is the peer's over ours: above 1 ours is better."""

    what: str
    ours: str
    wanted: str
    reached: bool
    peers: str = "–"
    interval: str = "–"
    figure: str = ""
    ratio: float | None = None


def plain_row(row: Row) -> dict[str, Any]:
    """The row with plain Python values (NumPy's are none of JSON)."""
    out: dict[str, Any] = {name: str(value) for name, value in vars(row).items() if name not in ("reached", "ratio")}
    return {**out, "reached": bool(row.reached), "ratio": None if row.ratio is None else float(row.ratio)}


def print_comparisons(lines: Iterable[Row], title: str = "Comparison") -> None:
    """Prints the rows; under `./tools/run bench --write` they are also handed to the table of figures."""
    lines = list(lines)
    if file := os.environ.get(ROWS_FILE):
        with Path(file).open("a", encoding="utf-8") as stream:
            stream.writelines(json.dumps(plain_row(line), ensure_ascii=False) + "\n" for line in lines)
    columns = ["what", "kr5", "others", "difference or rate, 95 %", "wanted", "reached"]
    rows = [[x.what, x.ours, x.peers, x.interval, x.wanted, "reached" if x.reached else "NOT reached"] for x in lines]
    Console(width=170).print(make_table(title, columns, rows, range(len(columns))))


def progress(items: Sequence[Any], what: str) -> Iterator[Any]:
    """The items, with a bar at a terminal; in a log a line when five seconds have passed."""
    if errors.is_terminal:
        yield from track(items, what)
        return
    said = time.monotonic()
    for i, item in enumerate(items):
        yield item
        if time.monotonic() - said > 5:
            errors.print(f"{what}: {i + 1} of {len(items)}", soft_wrap=True)
            said = time.monotonic()


def print_figures(title: str, wanted: Sequence[str], rows: Sequence[dict[str, Any]]) -> None:
    """One table of what answers the wanted figures, in their order. One without a row is said to be not measured."""
    cells = []
    for figure in wanted:
        own = [r for r in rows if r["figure"] == figure]
        for k, r in enumerate(own):
            ratio = "–" if r["ratio"] is None else f"{r['ratio']:.3g}"
            reached = "yes" if r["reached"] else "NO"
            head = figure if k == 0 else ""
            cells.append([head, r["what"], r["ours"], r["interval"], r["wanted"], reached, r["peers"], ratio])
        if not own:
            cells.append([figure, "not measured", *["–"] * 6])
    columns = ["figure", "data", "kr5", "95 % interval", "wanted", "reached", "peer", "peer / kr5"]
    Console(width=190).print(make_table(title, columns, cells, range(len(columns))))


@dataclass
class Difference:
    """Ours less the peer's: 0 inside the interval means level."""

    mean: float
    low: float
    high: float

    def text(self, unit: str, digits: str = "+.3g") -> str:
        return f"{self.mean:{digits}} [{self.low:{digits}}, {self.high:{digits}}] {unit}"


def mean_interval(values: Any) -> Difference:
    """Mean with Student's interval."""
    return mean_difference(values, np.zeros(len(values)))


def mean_difference(ours: Any, theirs: Any) -> Difference:
    """Mean of paired differences with Student's interval."""
    d = np.asarray(ours, float) - np.asarray(theirs, float)
    half = stats.t.ppf(0.975, len(d) - 1) * d.std(ddof=1) / np.sqrt(len(d)) if len(d) > 1 else np.inf
    return Difference(float(d.mean()), float(d.mean() - half), float(d.mean() + half))


def rms_difference(ours: Any, theirs: Any, scale: float = 1.0) -> Difference:
    """The paired difference of squared errors, as one of RMS."""
    a, b = np.asarray(ours, float), np.asarray(theirs, float)
    per = scale / (np.sqrt((a**2).mean()) + np.sqrt((b**2).mean()))  # a^2 - b^2 = (a - b) (a + b)
    d = mean_difference(a**2, b**2)
    return Difference(per * d.mean, per * d.low, per * d.high)


def rms_ratio(ours: np.ndarray, theirs: np.ndarray, seed: int = 1) -> Difference:
    """Ratio of RMS errors; views or trials are drawn again with replacement, in pairs."""
    draws = np.random.default_rng(seed).integers(len(ours), size=(4000, len(ours)))
    ratio = np.sqrt((ours[draws] ** 2).mean(1) / (theirs[draws] ** 2).mean(1))
    return Difference(
        float(np.sqrt((ours**2).mean() / (theirs**2).mean())), *(float(x) for x in np.quantile(ratio, [0.025, 0.975]))
    )


def exact_interval(hits: int, trials: int) -> tuple[float, float]:
    """Exact interval of a rate."""
    low = float(stats.beta.ppf(0.025, hits, trials - hits + 1)) if hits else 0.0
    high = float(stats.beta.ppf(0.975, hits + 1, trials - hits)) if hits < trials else 1.0
    return low, high


def format_rate(hits: int, trials: int) -> str:
    low, high = exact_interval(hits, trials)
    return f"{hits / trials:.3f} [{low:.3f}, {high:.3f}]"
