"""Plot of the times of a link: the share of them that is longer than a time, as far as the longest one."""

from pathlib import Path

import numpy as np
from kr5 import rsi
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter

from kr5_tools.calibrate.plots import Plot
from kr5_tools.cli.terminal import Console
from kr5_tools.pages.plot_style import BLUE, GREEN, RED, WIDE, plt
from kr5_tools.pages.rendering import write_drawn

COLOURS = {"period": BLUE, "answer": RED, "lateness": GREEN}
SHARES = np.power(10.0, -np.arange(25) / 4)  # of the durations that are longer than the times of a tail
MARKED = {"p50": 0.5, "p99": 1e-2, "p99.9": 1e-3}
LEAST = 1e-3  # [ms] that is told from none


def timing_plot(**times: rsi.Distribution) -> Plot | None:
    """One line each for the distributions that are not empty, with the quantiles of their table; none without any. The
    period, which is to be one time, stands apart."""
    shown = {name: time for name, time in times.items() if time.count}
    if not shown:
        return None
    parts = [{k: t for k, t in shown.items() if (k == "period") == apart} for apart in (False, True)]
    parts = [part for part in parts if part]
    figure, row = plt.subplots(1, len(parts), figsize=(WIDE, 3.0), sharey=True, squeeze=False)
    for axes, part in zip(row[0], parts, strict=True):
        for name, time in part.items():
            _draw(axes, name, time)
        axes.set_xlabel("time [ms]")
        axes.legend(loc="upper right", fontsize=8, handlelength=1)  # no line comes there
        if "period" not in part:
            axes.set_xscale("log")
            axes.xaxis.set_major_locator(LogLocator(subs=(1, 3)))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter(NullFormatter())
    row[0][0].set_yscale("log")
    row[0][0].yaxis.set_major_formatter("{x:g}")
    row[0][0].set_ylabel("share that is longer [-]")
    for name, share in MARKED.items():
        row[0][-1].annotate(
            name, (1, share), xycoords=("axes fraction", "data"), xytext=(3, 0), textcoords="offset points",
            va="center", fontsize=8,
        )  # fmt: skip
    counts = ", ".join(f"{name} {time.count}" for name, time in shown.items())
    text = f"Share of the times that are longer than a time; the diamond is the longest one. Number of times: {counts}."
    return Plot("link_times", "Times of the link", text, figure, True)


def _draw(axes: Axes, name: str, time: rsi.Distribution) -> None:
    share = np.maximum(SHARES, 1 / time.count)
    seen = np.append(True, share[:-1] > 1 / time.count)
    milliseconds = np.maximum(1e3 * np.asarray(time.tail), LEAST)
    axes.plot(milliseconds[seen], share[seen], color=COLOURS[name], label=name)
    marks = np.maximum([1e3 * value for value in (time.p50, time.p99, time.p999)], LEAST)
    axes.plot(marks, list(MARKED.values()), "o", color=COLOURS[name], markersize=4)
    axes.plot(max(1e3 * time.max, LEAST), 1 / time.count, "D", color=COLOURS[name], markersize=4)


def write_timing_plot(folder: Path, to: Console, **times: rsi.Distribution) -> None:
    """The plot as a file, where there are times; says so."""
    if not any(time.count for time in times.values()):
        to.print("No times, hence no plot.")
        return
    (file,) = write_drawn(lambda: [plot for plot in (timing_plot(**times),) if plot], folder)
    to.print(f"{file}: the times of the link.", soft_wrap=True, markup=False)
