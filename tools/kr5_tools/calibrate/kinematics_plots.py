"""Plots of a kinematic calibration. Each function gives a figure, or None when the result has not what it shows."""

import numpy as np
from kr5.files.result_types import ResultData
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from kr5_tools.pages.plot_style import BLUE, GREY, RED, WIDE, WIDTH, plt

UNITS = (("m", "mm", 1e3), ("rad", "deg", 180 / np.pi), ("px", "px", 1.0))  # of the file, shown, factor


def posture_errors(data: ResultData) -> Figure | None:
    """How many postures have which error, with the nominal arm and with the identified one."""
    postures = data.get("result", {}).get("postures")
    if not postures:
        return None
    after = 1e3 * np.array([p["position_error"] for p in postures])
    before = 1e3 * np.array([p["nominal_error"] for p in postures])
    outlier = np.array([p["outlier"] for p in postures], bool)
    both = np.concatenate([before, after])
    positive = both[both > 0]
    if len(positive) < 2:
        return None
    figure, axes = plt.subplots(figsize=(WIDTH, 3.2))
    count = int(np.clip(2 * np.sqrt(len(postures)), 5, 40))
    bins = np.geomspace(positive.min(), positive.max() * 1.001, count).tolist()
    axes.hist(before, bins=bins, color=GREY, alpha=0.7, label="nominal arm")
    axes.hist(after[~outlier], bins=bins, color=BLUE, alpha=0.8, label="identified arm")
    if outlier.any():
        axes.plot(after[outlier], np.zeros(outlier.sum()), "v", color=RED, label="outlier", clip_on=False)
    axes.set(xscale="log", xlabel="distance, measured to predicted [mm]", ylabel="postures")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(fontsize=9)
    return figure


def parameter_changes(data: ResultData) -> Figure | None:
    """Changes of the parameters of arm and camera from their nominal values, with two standard deviations."""
    result = data.get("result", {})
    every = result.get("coordinates") or result.get("parameters") or ()
    rows = [c for c in every if str(c.get("name", "")).startswith(("arm.", "camera."))]
    if not rows:
        return None
    shown = [(unit, scale, [c for c in rows if c["unit"] == own]) for own, unit, scale in UNITS]
    shown = [part for part in shown if part[2]]
    height = 0.9 + 0.24 * max(len(part) for _, _, part in shown)
    figure, all_axes = plt.subplots(1, len(shown), figsize=(WIDE, height), squeeze=False)
    for axes, (unit, scale, part) in zip(all_axes[0], shown, strict=True):
        at = np.arange(len(part))
        change = scale * np.array([c["value"] - c["nominal"] for c in part])
        spread = 2 * scale * np.array([c["std"] for c in part])
        known = np.array([c["identifiable"] for c in part], bool)
        for which, colour in ((known, BLUE), (~known, GREY)):
            axes.errorbar(change[which], at[which], xerr=spread[which], fmt="o", color=colour, markersize=4, capsize=2)
        axes.axvline(0, color=GREY, linewidth=1)
        axes.set_yticks(at, [c["name"].removeprefix("arm.") for c in part], fontsize=8.5)
        axes.invert_yaxis()
        axes.set_xlabel(f"change [{unit}]")
        axes.locator_params(axis="x", nbins=4)
    return figure


VALUE_LABELS = {
    "prediction": (1e3, "error of a predicted place [mm]"),
    "variance": (1.0, "standard deviation over spread [-]"),
    "determinant": (1.0, "log determinant per parameter [-]"),
}


def posture_value(data: ResultData) -> Figure | None:
    """What each further posture adds to a choice of postures."""
    result = data.get("result", {})
    scale, label = VALUE_LABELS.get(str(result.get("criterion")), (0.0, ""))
    values = [v for v in result.get("value_after", ()) if v is not None]
    if len(values) < 2 or not scale:
        return None
    figure, axes = plt.subplots(figsize=(WIDTH, 3.2))
    first = min(2, len(values) - 2)  # one or two postures tell next to nothing
    axes.plot(np.arange(first + 1, len(values) + 1), scale * np.array(values[first:]), color=BLUE)
    axes.set(xlabel="postures", ylabel=label)
    if min(values) > 0:
        axes.set_yscale("log")
    return figure


def posture_spread(data: ResultData) -> Figure | None:
    """Joint values of the chosen postures among the candidates."""
    result = data.get("result", {})
    chosen, candidates = (np.array(result.get(key, []), float) for key in ("q", "candidates"))
    if chosen.ndim != 2 or candidates.ndim != 2 or not len(chosen):
        return None
    figure, axes = plt.subplots(figsize=(WIDTH, 3.2))
    units = result.get("units") or ["rad"] * chosen.shape[1]
    for k, unit in enumerate(units):
        scale = 180 / np.pi if unit == "rad" else 1e3
        low, high = scale * candidates[:, k].min(), scale * candidates[:, k].max()
        axes.plot([k + 1, k + 1], [low, high], color=GREY, linewidth=7, alpha=0.3, solid_capstyle="butt")
        axes.plot(np.full(len(chosen), k + 1), scale * chosen[:, k], "_", color=BLUE, markersize=12)
    shown = " or ".join(name for own, name in (("rad", "deg"), ("m", "mm")) if own in units)
    axes.set(xlabel="joint", ylabel=f"joint value [{shown}]", xticks=np.arange(1, chosen.shape[1] + 1))
    return figure
