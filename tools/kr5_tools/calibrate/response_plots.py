"""Plots of an identified servo, contact and force sensor. Each gives a figure, or None when the result has not what it
shows."""

import numpy as np
from kr5.files.result_types import ResultData
from matplotlib.figure import Figure

from kr5_tools.pages.plot_style import BLUE, GREEN, GREY, RED, WIDE, plt

MOST_RESPONSES = 6


def servo_responses(data: ResultData) -> Figure | None:
    """Command, measured and fitted response, and the residual below."""
    if data.get("format") != "kr5-servo/1":
        return None
    responses = data["responses"][:MOST_RESPONSES]
    figure, grid = plt.subplots(2, len(responses), figsize=(WIDE, 4.2), sharex="col", squeeze=False)
    for (above, below), response in zip(grid.T, responses):
        rows = np.arange(len(response["t"]))  # runs may begin at any time
        measured, predicted = np.array(response["measured"], float), np.array(response["predicted"], float)
        above.plot(rows, response["command"], color=GREY, linewidth=1.0, label="command")
        above.plot(rows, measured, color=BLUE, linewidth=1.2, label="measured")
        above.plot(rows, predicted, color=RED, linewidth=1.0, linestyle="--", label="fitted")
        above.set(title=response["name"], ylabel=f"position [{response['unit']}]")
        below.plot(rows, measured - predicted, color=GREEN, linewidth=0.8)
        below.set(xlabel="sample", ylabel=f"residual [{response['unit']}]")
    grid[0, 0].legend(fontsize=8.5)
    return figure


def contact_curve(data: ResultData) -> Figure | None:
    """Force against depth with the fitted line, and the residual."""
    if data.get("format") != "kr5-contact/1":
        return None
    curve = data["contact"]
    depth, measured, predicted = (np.array(curve[key], float) for key in ("depth", "measured", "predicted"))
    figure, (left, right) = plt.subplots(1, 2, figsize=(WIDE, 3.3))
    left.plot(depth, measured, ".", color=BLUE, markersize=3, label="measured")
    left.plot(depth, predicted, ".", color=RED, markersize=2, label="fitted")
    left.set(xlabel="depth [mm]", ylabel="force [N]")
    left.legend(fontsize=8.5)
    right.plot(depth, measured - predicted, ".", color=GREEN, markersize=3)
    right.set(xlabel="depth [mm]", ylabel="residual [N]")
    return figure


def force_loop_plot(data: ResultData) -> Figure | None:
    """Limit of the gain and steady error of a force loop over the stiffness."""
    design = data.get("design")
    if data.get("format") != "kr5-contact/1" or not design:
        return None
    points = design["range"]
    stiffness = 1e-3 * np.array([p["stiffness"] for p in points], float)
    figure, (left, right) = plt.subplots(1, 2, figsize=(WIDE, 3.3))
    left.plot(stiffness, 1e3 * np.array([p["gain_limit"] for p in points], float), "o-", color=RED, label="limit")
    left.axhline(1e3 * design["recommended_gain"], color=BLUE, linestyle="--", label="recommended")
    left.set(xlabel="stiffness [N/mm]", ylabel="gain [mm/N]", yscale="log")
    left.legend(fontsize=8.5)
    right.plot(
        stiffness, 100 * np.array([p["steady_error"] for p in points], float), "o-", color=BLUE, label="steady error"
    )
    right.plot(stiffness, 100 * np.array([p["overshoot"] for p in points], float), "s-", color=GREEN, label="overshoot")
    right.set(xlabel="stiffness [N/mm]", ylabel="of the force [%]")
    right.legend(fontsize=8.5)
    return figure


def wrench_overlays(data: ResultData) -> Figure | None:
    """Measured and fitted components of the wrench."""
    if data.get("format") != "kr5-force-torque/1":
        return None
    shown = data["wrenches"]
    figure, grid = plt.subplots(2, 3, figsize=(WIDE, 4.2), sharex=True)
    for axes, name, measured, predicted in zip(
        grid.flat, ("fx", "fy", "fz", "tx", "ty", "tz"), shown["measured"], shown["predicted"]
    ):
        axes.plot(shown["reading"], measured, ".", color=BLUE, markersize=2.5, label="measured")
        axes.plot(shown["reading"], predicted, ".", color=RED, markersize=1.5, label="fitted")
        axes.set(title=f"{name} [{'N' if name[0] == 'f' else 'N m'}]")
    for axes in grid[1]:
        axes.set(xlabel="reading")
    grid[0, 0].legend(fontsize=8.5)
    return figure
