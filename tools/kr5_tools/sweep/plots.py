"""The figures of a sweep of insertions, as Figs 6.13 and 6.14 of Hayat et al. 2022: success and time over clearance,
and over tilt."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from kr5_tools.calibrate.plots import Plot
from kr5_tools.pages.plot_style import BLUE, GREEN, GREY, RED, STYLE, WIDE, WIDTH, plt
from kr5_tools.sweep.trials import Grid

HAYAT_TILT = 15.0  # [deg], at which the book sweeps the clearance
ATTEMPTS = (("first attempt", BLUE, "o", -1), ("by second", GREEN, "s", 0), ("by third", RED, "^", 1))


def sweep_plots(tables: list[dict[str, Any]], grid: Grid) -> list[Plot]:
    """Those with something to compare. Close the figures after use."""
    tilt = min(grid.tilts, key=lambda t: abs(t - HAYAT_TILT))
    clearance = min(grid.clearances)
    out = []
    with plt.rc_context(STYLE):
        if len(grid.clearances) > 1:
            out.append(
                Plot(
                    "over_clearance",
                    f"Success and time over clearance, at a tilt of {tilt:g}°",
                    TEXT,
                    draw_rates(tables, "clearance", "tilt", tilt, "clearance [mm]"),
                    len(tables) > 1,
                )
            )
        if len(grid.tilts) > 1:
            out.append(
                Plot(
                    "over_tilt",
                    f"Success and time over tilt, at a clearance of {clearance:g} mm",
                    TEXT,
                    draw_rates(tables, "tilt", "clearance", clearance, "tilt [deg]"),
                    len(tables) > 1,
                )
            )
    return out


TEXT = (
    "Above: share of trials that are inserted, with exact 95 % intervals; dashed: 95 %. Below: median time of the"
    " insertions with its 95 % interval, and the time within which nine of ten are done."
)


def draw_rates(tables: list[dict[str, Any]], over: str, fixed: str, value: float, label: str) -> Figure:
    """A column for each orientation and strategy: success above, time below."""
    size = (WIDE if len(tables) == 1 else WIDTH * len(tables), 5.0)
    figure, axes = plt.subplots(2, len(tables), figsize=size, sharex=True, sharey="row", squeeze=False)
    for (upper, lower), table in zip(axes.T, tables):
        places = sorted((p for p in table["rows"] if p[fixed] == value), key=lambda p: p[over])
        plot_success(upper, places, over)
        plot_times(lower, places, over)
        upper.set_title(f"{table['orientation']}, {table['strategy']}", loc="left")
        lower.set_xlabel(label)
        set_ticks(lower, [p[over] for p in places])
    axes[1, 0].set_ylim(0, axes[1, 0].get_ylim()[1])  # shared by all, so only now that all are drawn
    axes[0, 0].set_ylabel("inserted [%]")
    axes[1, 0].set_ylabel("time [s]")
    axes[0, 0].legend(fontsize=8.5, loc="lower left")
    axes[1, 0].legend(fontsize=8.5, loc="best")
    return figure


def set_ticks(axes: Axes, x: list[float]) -> None:
    """At the values themselves; logarithmic where they span more than a decade."""
    if min(x) > 0 and max(x) > 10 * min(x):
        axes.set_xscale("log")
    axes.set_xticks(x, [f"{v:g}" for v in x], rotation=45 if len(x) > 8 else 0)
    axes.xaxis.set_minor_locator(NullLocator())


def plot_success(axes: Axes, places: list[dict[str, Any]], over: str) -> None:
    """Points of the attempts side by side, so that their intervals can be told apart."""
    x = np.array([p[over] for p in places])
    wide = max(x) > 10 * min(x) > 0
    step = (0.025 * np.log(max(x) / min(x)) if wide else 0.012 * np.ptp(x)) if len(x) > 1 else 0.01
    for k, (name, colour, marker, side) in enumerate(ATTEMPTS):
        rates = [p["by_attempt"][k] for p in places]
        y, low, high = (100 * np.array([r[key] for r in rates]) for key in ("rate", "low", "high"))
        at = x * np.exp(side * step) if wide else x + side * step
        axes.errorbar(
            at,
            y,
            yerr=[y - low, high - y],
            fmt=marker,
            color=colour,
            markersize=5,
            linewidth=1.2,
            capsize=2.5,
            label=name,
        )
    axes.axhline(95, color=GREY, linewidth=0.9, linestyle="--")
    axes.set_ylim(-4, 104)


def plot_times(axes: Axes, places: list[dict[str, Any]], over: str) -> None:
    done = [(p[over], p["time"]) for p in places if p["time"]["median"] is not None]
    if not done:
        axes.plot([], [], "o", color=BLUE, label="no insertion")
        return
    x, y = [d[0] for d in done], np.array([d[1]["median"] for d in done])
    low, high = (
        np.array([d[1][key] if d[1][key] is not None else d[1]["median"] for d in done]) for key in ("low", "high")
    )
    axes.errorbar(
        x, y, yerr=[y - low, high - y], fmt="o-", color=BLUE, markersize=5, linewidth=1.2, capsize=2.5, label="median"
    )
    axes.plot(x, [d[1]["q90"] for d in done], "_", color=RED, markersize=11, mew=1.6, label="nine of ten within")
