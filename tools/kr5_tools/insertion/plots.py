"""The plots of one insertion: profile, forces, height, path over the face of the tube."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import kr5.force
import kr5.io
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kr5_tools.calibrate.plots import Plot
from kr5_tools.insertion import ending_tables
from kr5_tools.pages.plot_style import BLUE, GREEN, GREY, PAPER, RED, SOFT, STYLE, WIDE, plt

if TYPE_CHECKING:
    import kr5.sim

# Phases side by side differ; grey ones are between the acts. Laid over the paper thinly, whichever colour it has.
SHADES = {
    "touch": "#E69F00",
    "roll": "#56B4E9",
    "slide": "#009E73",
    "upright": "#CC79A7",
    "push": "#D55E00",
    "spiral": "#7B61C9",
    "locate": GREY,
}
SHADE = 0.2  # share of the colour
MOST_POINTS = 3000


def insertion_plots(result: "kr5.sim.InsertionResult") -> list[Plot]:
    """All that there is something to show for. Close the figures after use."""
    out = []
    with plt.rc_context(STYLE):
        for name, title, function, wide, text in CATALOGUE:
            if (figure := function(result)) is not None:
                out.append(Plot(name, title, text, figure, wide))
    return out


def _columns(result: "kr5.sim.InsertionResult", *names: str) -> list[np.ndarray]:
    """Time and columns of the rows, thinned out for the page; NaN on the way from one peg to the next."""
    step = max(1, math.ceil(len(result.rows) / MOST_POINTS))
    between = np.asarray(result.rows["phase"])[::step] == int(kr5.force.Phase.Done)
    return [
        np.asarray(result.rows["t"])[::step],
        *(np.where(between, np.nan, np.asarray(result.rows[name])[::step]) for name in names),
    ]


def _shade(axes: Axes, result: "kr5.sim.InsertionResult", label: bool) -> None:
    """Phases behind a plot over time, and the names of those wide enough for one."""
    spans = ending_tables.phases(result.rows)
    whole = spans[-1]["begin"] + spans[-1]["duration"] - spans[0]["begin"]
    for span in spans:
        end = span["begin"] + span["duration"]
        if span["phase"] in SHADES:
            axes.axvspan(span["begin"], end, color=SHADES[span["phase"]], alpha=SHADE, linewidth=0, zorder=0)
        if label and span["phase"] in SHADES and span["duration"] > 0.035 * whole:
            axes.text(
                (span["begin"] + end) / 2,
                1.02,
                span["phase"],
                transform=axes.get_xaxis_transform(),
                fontsize=8,
                color=SOFT,
                ha="left" if span["duration"] < 0.1 * whole else "center",
                va="bottom",
                rotation=40 if span["duration"] < 0.1 * whole else 0,
            )
    axes.set_xlim(spans[0]["begin"], spans[0]["begin"] + whole)
    axes.grid(False, axis="x")


def profile_plot(result: "kr5.sim.InsertionResult") -> Figure | None:
    return draw_profile(result.profile) if len(result.profile) else None


def draw_profile(profile: Mapping[str, npt.ArrayLike] | kr5.io.Table) -> Figure:
    """Of the columns azimuth, height and closed_form [rad, m]."""
    order = np.argsort(profile["azimuth"])
    azimuth, measured, closed = (np.asarray(profile[name])[order] for name in ("azimuth", "height", "closed_form"))
    figure, axes = plt.subplots(2, 1, figsize=(WIDE, 4.4), sharex=True, height_ratios=(3, 1.3))
    axes[0].plot(
        np.degrees(azimuth),
        1e3 * closed,
        color=BLUE,
        linewidth=1.6,
        label="closed form, at the true position of the peg",
    )
    axes[0].plot(np.degrees(azimuth), 1e3 * measured, "o", color=RED, markersize=3.2, label="measured")
    axes[0].set_ylabel("height of the peg's\nbottom centre [mm]")
    axes[0].legend(fontsize=9, loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    axes[1].axhline(0, color=GREY, linewidth=0.8)
    axes[1].plot(np.degrees(azimuth), 1e3 * (measured - closed), ".", color=RED, markersize=4)
    axes[1].set_ylabel("difference\n[mm]")
    axes[1].set_xlabel("azimuth of the lowest point of the rim [deg]")
    axes[1].set_xticks(range(0, 361, 45))
    return figure


def force_plot(result: "kr5.sim.InsertionResult") -> Figure:
    t, fx, fy, fz = _columns(result, "fx", "fy", "fz")
    figure, axes = plt.subplots(2, 1, figsize=(WIDE, 4.2), sharex=True)
    for ax, values, colour, name in (
        (axes[0], fz, BLUE, "along the tube [N]"),
        (axes[1], np.hypot(fx, fy), RED, "across it [N]"),
    ):
        _shade(ax, result, ax is axes[0])
        ax.plot(t, values, color=colour, linewidth=0.9)
        ax.set_ylabel(name)
    axes[1].set_xlabel("time [s]")
    return figure


def height_plot(result: "kr5.sim.InsertionResult") -> Figure:
    t, z, tilt = _columns(result, "true_z", "true_tilt")
    figure, axes = plt.subplots(2, 1, figsize=(WIDE, 4.2), sharex=True, height_ratios=(2, 1))
    for ax, values, colour, name in (
        (axes[0], 1e3 * z, BLUE, "above the face [mm]"),
        (axes[1], np.degrees(tilt), GREEN, "tilt [deg]"),
    ):
        _shade(ax, result, ax is axes[0])
        ax.plot(t, values, color=colour, linewidth=1.2)
        ax.set_ylabel(name)
    axes[0].axhline(0, color=GREY, linewidth=0.8, linestyle="--")
    axes[1].set_xlabel("time [s]")
    return figure


def path_plot(result: "kr5.sim.InsertionResult") -> Figure:
    """In the frame of the assumed tube; the true path of the peg."""
    _, x, y = _columns(result, "true_x", "true_y")
    tube = result.cell.tube
    off = (1e3 * float(result.T_tube_actual[0, 3]), 1e3 * float(result.T_tube_actual[1, 3]))
    x, y = 1e3 * x + off[0], 1e3 * y + off[1]
    first, last = np.flatnonzero(np.isfinite(x))[[0, -1]]
    figure, axes = plt.subplots(figsize=(WIDE, 4.9))
    for radius, colour, name in (
        (tube.outer_radius, "#b5653c4d", "face of the tube"),
        (tube.inner_radius, PAPER, "bore"),
    ):
        axes.add_patch(
            plt.Circle(off, 1e3 * radius, facecolor=colour, edgecolor="#b5653c", linewidth=1.2, zorder=1, label=name)
        )
    axes.plot(x, y, color=BLUE, linewidth=1.2, zorder=3, label="path of the peg")
    axes.plot(x[first], y[first], "s", color=BLUE, markersize=5, zorder=4, label="begin")
    axes.plot(x[last], y[last], "o", color=BLUE, mfc=PAPER, markersize=6, zorder=4, label="end")
    axes.plot(0, 0, "x", color=RED, markersize=8, mew=1.8, zorder=5, label="assumed axis of the tube")
    axes.plot(*off, "+", color=GREEN, markersize=11, mew=1.8, zorder=5, label="axis of the tube")
    axes.set_aspect("equal")
    reach = 1.25e3 * tube.outer_radius
    axes.set(
        xlabel="x [mm]",
        ylabel="y [mm]",
        xlim=off[0] + np.array([-reach, reach]),
        ylim=off[1] + np.array([-reach, reach]),
    )
    axes.legend(fontsize=8.5, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3)
    return figure


# name, title, function, wide, what it shows
CATALOGUE = [
    (
        "profile",
        "Depth profile of the last turn",
        profile_plot,
        True,
        (
            "Resting height of the tilted peg over one turn of its lowest point: measured, and by"
            " the closed form at the true position of the peg."
        ),
    ),
    (
        "forces",
        "Forces on the peg",
        force_plot,
        True,
        "Unfiltered, in the frame of the tube, without the motion to the next peg. Shaded: the phases.",
    ),
    (
        "height",
        "Height and tilt of the peg",
        height_plot,
        True,
        "Height of the bottom centre above the true face of the tube; negative below it. Shaded: the phases.",
    ),
    (
        "path",
        "Path over the face, from above",
        path_plot,
        False,
        "The true tube in its assumed frame; the path is that of the bottom centre of the peg.",
    ),
]
