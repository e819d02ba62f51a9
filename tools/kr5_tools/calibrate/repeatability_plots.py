"""Plots of a repeatability test. Each function gives a figure, or None when the result has not what it shows."""

from typing import Any

import numpy as np
from kr5.files.result_types import ResultData
from matplotlib.figure import Figure

from kr5_tools.pages.plot_style import BLUE, GREY, INK, RED, WIDE, WIDTH, plt

MOST_POINTS = 9
PLANES = ((0, 1, "x", "y"), (0, 2, "x", "z"))


def _returns(data: ResultData) -> list[dict[str, Any]]:
    return [r for r in data.get("returns", ()) if len(r.get("deviation", ())) == 3]


def return_spread(data: ResultData) -> Figure | None:
    """Deviations of each point in two planes, with the circle of its RP."""
    returns = _returns(data)
    points = data.get("result", {}).get("points", [])[:MOST_POINTS]
    if not returns or not points:
        return None
    figure, all_axes = plt.subplots(
        len(points), 2, figsize=(WIDE, 2.9 * len(points)), squeeze=False, sharex=True, sharey=True
    )
    farthest = max(np.abs([r["deviation"] for r in returns]).max(), *(p["RP"]["value"] for p in points))
    limit = 1.15e3 * farthest
    for row, p in zip(all_axes, points, strict=True):
        own = [r for r in returns if r["point"] == p["point"]]
        d = 1e3 * np.array([r["deviation"] for r in own])
        bad = np.array([r["outlier"] for r in own], bool)
        for axes, (i, j, first, second) in zip(row, PLANES, strict=True):
            axes.scatter(d[~bad, i], d[~bad, j], s=14, color=BLUE, alpha=0.7, linewidths=0)
            axes.scatter(d[bad, i], d[bad, j], s=26, color=RED, marker="x", label="outlier" if bad.any() else None)
            axes.add_patch(plt.Circle((0, 0), 1e3 * p["RP"]["value"], fill=False, color=INK, linewidth=1))
            axes.plot(0, 0, "+", color=GREY)
            axes.set(aspect="equal", xlim=(-limit, limit), ylim=(-limit, limit))
            axes.set(xlabel=f"{first} [mm]", ylabel=f"{second} [mm]")
            axes.set_title(f"{p['point']}: RP {1e3 * p['RP']['value']:.3g} mm", loc="left", fontsize=9.5)
    return figure


def distance_histogram(data: ResultData) -> Figure | None:
    """Distances from the barycentres of the points, with RP of all together."""
    returns = _returns(data)
    overall = data.get("result", {}).get("overall", {})
    if len(returns) < 3 or not overall.get("RP"):
        return None
    distance = 1e3 * np.linalg.norm([r["deviation"] for r in returns], axis=1)
    figure, axes = plt.subplots(figsize=(WIDTH, 3.2))
    axes.hist(distance, bins=min(40, max(8, len(distance) // 5)), color=BLUE, alpha=0.8)
    rp = {key: 1e3 * value for key, value in overall["RP"].items()}
    axes.axvline(rp["value"], color=INK, label=f"RP {rp['value']:.3g} mm")
    axes.axvspan(rp["low"], rp["high"], color=GREY, alpha=0.25, label="bounds of RP", linewidth=0)
    axes.set(xlabel="distance from the barycentre [mm]", ylabel="returns", xlim=(0, None))
    axes.legend(fontsize=9, loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    return figure


def return_order(data: ResultData) -> Figure | None:
    """Deviations in the order of the test, with the trend common to all points."""
    returns = _returns(data)
    drift = data.get("result", {}).get("drift")
    if len(returns) < 3 or not drift:
        return None
    d = 1e3 * np.array([r["deviation"] for r in returns])
    order = np.arange(1, len(d) + 1)
    figure, all_axes = plt.subplots(3, 1, figsize=(WIDE, 4.6), sharex=True)
    for k, (axes, name) in enumerate(zip(all_axes, "xyz", strict=True)):
        axes.plot(order, d[:, k], ".", color=BLUE, markersize=4)
        motion = 1e3 * drift["motion"][k]
        axes.plot([1, len(d)], [-motion / 2, motion / 2], color=RED if drift["significant"] else GREY, linewidth=1.2)
        axes.set_ylabel(f"{name} [mm]")
    all_axes[-1].set_xlabel("return, in the order of the test")
    return figure
