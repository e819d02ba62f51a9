"""Plots of a scanner calibration and of a study of scanning. Each gives a figure, or None when the result has not what
it shows."""

import numpy as np
from kr5.files.result_types import ResultData
from matplotlib.figure import Figure

from kr5_tools.pages.plot_style import BLUE, GREEN, GREY, RED, WIDE, plt

COLOURS = (BLUE, GREEN, "#CC79A7", "#E69F00")  # of targets


def profile_errors(data: ResultData) -> Figure | None:
    """Distance of each profile from its target, by the fit and without it."""
    if data.get("format") != "kr5-laser/1":
        return None
    views = data["result"]["views"]
    figure, axes = plt.subplots(figsize=(WIDE, 3.2))
    at = np.arange(len(views))
    fitted = 1e3 * np.array([v["distance"] for v in views], float)
    left_out = 1e3 * np.array([v["held_out"] for v in views], float)
    outlier = np.array([v["outlier"] for v in views], bool)
    names = list(dict.fromkeys(v["target"] for v in views))
    for k, name in enumerate(names):
        mine = np.array([v["target"] == name for v in views]) & ~outlier
        axes.plot(at[mine], fitted[mine], "o", color=COLOURS[k % len(COLOURS)], markersize=4, label=name)
    known = (left_out > 0) & ~outlier
    axes.plot(at[known], left_out[known], "_", color=GREY, label="left out of the fit")
    top = 1.25 * max(np.concatenate([fitted[~outlier], left_out[known], [1e-6]]))
    if outlier.any():
        shown = np.minimum(fitted[outlier], 0.97 * top)
        axes.plot(at[outlier], shown, "v", color=RED, markersize=6, label="outlier (may lie higher)")
    axes.set(xlabel="profile, in the order of the file", ylabel="distance from target [mm]", ylim=(0, top))
    axes.legend(fontsize=8.5, ncols=4, loc="lower left", bbox_to_anchor=(0, 1))
    return figure


def cloud_plot(data: ResultData) -> Figure | None:
    """Part of the points of all profiles in the base, from above and from the side."""
    points = 1e3 * np.array(data.get("cloud", {}).get("points", []), float)
    if points.ndim != 2 or points.shape[0] != 3 or not points.size:
        return None
    figure, (above, side) = plt.subplots(1, 2, figsize=(WIDE, 3.2))
    low, high = np.percentile(points[2], [1, 99])
    above.scatter(points[0], points[1], c=points[2], s=1.5, cmap="viridis", vmin=low, vmax=high, rasterized=True)
    above.set(xlabel="x [mm]", ylabel="y [mm]", title="from above", aspect="equal")
    side.scatter(points[0], points[2], c=points[2], s=1.5, cmap="viridis", vmin=low, vmax=high, rasterized=True)
    side.set(xlabel="x [mm]", ylabel="z [mm]", title="from the side")
    return figure


def study_plot(data: ResultData) -> Figure | None:
    """Errors against stand-off and against speed."""
    study = data.get("study")
    if not study:
        return None
    figure, (left, right) = plt.subplots(1, 2, figsize=(WIDE, 3.3))
    for axes, key, label in ((left, "stand_off", "stand-off [mm]"), (right, "speed", "scanning speed [mm/s]")):
        at = 1e3 * np.array([row[key] for row in study[key]])
        for name, colour, mark in (("as_stamped", RED, "o-"), ("synchronised", BLUE, "s--")):
            error = 1e3 * np.array([row[f"centre_{name}"] for row in study[key]])
            axes.plot(at, error, mark, color=colour, markersize=4, linewidth=1.2, label=name.replace("_", " "))
        axes.set(xlabel=label, ylabel="error of the sphere's centre [mm]")
        axes.set_ylim(bottom=0)
    left.axvline(1e3 * study["best_stand_off"], color=GREY, linewidth=1)
    right.legend(fontsize=9)
    return figure
