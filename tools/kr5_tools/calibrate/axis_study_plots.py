"""Plots of a noise study of the identification of axes."""

from typing import Any

import numpy as np
from kr5.files.result_types import ResultData
from matplotlib.figure import Figure

from kr5_tools.pages.plot_style import BLUE, GREEN, GREY, RED, WIDE, plt

COLOURS = {"total_station": RED, "laser_tracker": GREEN, "camera": BLUE}
LINES = ("-", "--", ":", "-.")
KINDS = (("length_rms_mm", "lengths, RMS [mm]"), ("angle_rms_deg", "angles, RMS [deg]"))


def _rows(data: ResultData) -> list[dict[str, Any]]:
    if data.get("format") != "kr5-axes-study/1":
        return []
    return [r for r in data.get("result", {}).get("rows", ()) if "length_rms_mm" in r]


def study_noise(data: ResultData) -> Figure | None:
    """Errors of lengths and angles against noise, a line for each device and arc."""
    rows = _rows(data)
    if not rows:
        return None
    arcs = sorted({r["arc_deg"] for r in rows})
    figure, both = plt.subplots(1, 2, figsize=(WIDE, 3.8))
    for axes, (key, label) in zip(both, KINDS, strict=True):
        for device in dict.fromkeys(r["device"] for r in rows):
            for k, arc in enumerate(arcs):
                line = sorted(
                    (r["factor"], r[key], r["label"]) for r in rows if r["device"] == device and r["arc_deg"] == arc
                )
                if not line:
                    continue
                axes.plot(
                    [f for f, _, _ in line],
                    [e for _, e, _ in line],
                    LINES[k % len(LINES)],
                    marker="o",
                    color=COLOURS.get(device, GREY),
                    label=f"{line[0][2]}, {arc:g}°",
                )
        axes.set(xscale="log", yscale="log", xlabel="noise / usual noise [-]", ylabel=label)
        ticks = sorted({r["factor"] for r in rows})
        axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
        axes.xaxis.set_minor_locator(plt.NullLocator())
    figure.legend(*both[0].get_legend_handles_labels(), fontsize=8.5, loc="outside upper left", ncols=3)
    return figure


def study_parameters(data: ResultData) -> Figure | None:
    """Error of each parameter at the usual noise, by device, for the widest arc."""
    rows = _rows(data)
    if not rows:
        return None
    factor = min((r["factor"] for r in rows), key=lambda f: abs(f - 1))
    arc = max(r["arc_deg"] for r in rows)
    rows = [r for r in rows if r["factor"] == factor and r["arc_deg"] == arc]
    if not rows:
        return None
    figure, both = plt.subplots(1, 2, figsize=(WIDE, 3.4), width_ratios=(1.6, 1))
    for axes, angle, label in ((both[0], False, f"RMS at {arc:g}° [mm]"), (both[1], True, f"RMS at {arc:g}° [deg]")):
        names = [n for n in rows[0]["parameters"] if n.startswith("alpha") == angle]
        width = 0.8 / len(rows)
        for k, row in enumerate(rows):
            at = np.arange(len(names)) + (k - 0.5 * (len(rows) - 1)) * width
            axes.bar(
                at,
                [row["parameters"][n] for n in names],
                width,
                color=COLOURS.get(row["device"], GREY),
                label=row["label"],
            )
        axes.set_xticks(range(len(names)), [n.replace("alpha", "α") for n in names])
        axes.set(yscale="log", ylabel=label)
    figure.legend(*both[0].get_legend_handles_labels(), fontsize=9, loc="outside upper left", ncols=3)
    return figure
