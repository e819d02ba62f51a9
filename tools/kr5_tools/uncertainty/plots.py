"""Plots of the commands of `kr5 uncertainty`, from what their results hold."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from kr5_tools.calibrate.plots import Plot
from kr5_tools.pages.plot_style import BLUE, GREEN, GREY, RED, STYLE, WIDTH, plt

COLOURS = (BLUE, RED, GREEN, GREY)


def part_plots(part: dict[str, Any]) -> list[Plot]:
    """Close the figures after use."""
    out = []
    with plt.rc_context(STYLE):
        for drawn in part.get("ellipses", ()):
            out.append(Plot(drawn["name"], drawn["title"], drawn["text"], draw_ellipses(drawn)))
        for drawn in part.get("lines", ()):
            out.append(Plot(drawn["name"], drawn["title"], drawn["text"], draw_lines(drawn)))
    return out


def draw_ellipses(drawn: dict[str, Any]) -> Figure:
    from kr5.uncertainty import confidence_ellipsoid

    figure, axes = plt.subplots(figsize=(WIDTH, 3.6))
    named = any(e["name"] for e in drawn["ellipses"])
    reach = []
    for k, entry in enumerate(drawn["ellipses"]):
        covariance = np.array(entry["covariance"], float)
        lengths, directions = confidence_ellipsoid((covariance + covariance.T) / 2, drawn["confidence"])
        angle = float(np.degrees(np.arctan2(directions[1, 0], directions[0, 0])))
        colour = COLOURS[k % len(COLOURS)] if named else BLUE
        axes.add_patch(
            Ellipse(
                entry["centre"],
                2 * lengths[0],
                2 * lengths[1],
                angle=angle,
                fill=False,
                edgecolor=colour,
                linewidth=1.6 if named else 1.0,
                linestyle="--" if named and k == 1 else "-",
                label=entry["name"],
            )
        )
        axes.plot(*entry["centre"], ".", color=colour, markersize=3)
        extent = np.sqrt(np.maximum((directions**2) @ lengths**2, 0))
        reach += [np.array(entry["centre"]) - extent, np.array(entry["centre"]) + extent]
    low, high = np.min(reach, axis=0), np.max(reach, axis=0)
    half = 0.53 * (float(max(high - low)) or 1.0)  # a square holds both, at one scale
    (x, y) = (low + high) / 2
    axes.set(xlim=(x - half, x + half), ylim=(y - half, y + half), xlabel=drawn["axes"][0], ylabel=drawn["axes"][1])
    axes.set_aspect("equal", adjustable="box")
    if named:
        axes.legend(fontsize=9, loc="lower right", bbox_to_anchor=(1, 1), ncols=3)
    return figure


def draw_lines(drawn: dict[str, Any]) -> Figure:
    figure, axes = plt.subplots(figsize=(WIDTH, 3.6))
    for k, line in enumerate(drawn["lines"]):
        simulated = line["name"].endswith("simulated")
        colour = (BLUE, RED)[k % 2]
        axes.plot(line["x"], line["y"], "o" if simulated else "-", color=colour, label=line["name"], markersize=5)
    axes.set(xlabel=drawn["axes"][0], ylabel=drawn["axes"][1])
    axes.set_xlim(0, None)
    axes.set_ylim(0, None)
    axes.legend(fontsize=9)
    return figure
