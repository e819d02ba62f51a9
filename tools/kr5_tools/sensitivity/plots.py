"""Bar charts of sensitivity indices, as Fig. 3.6 of Hayat et al. 2022: bars of every output beside each other, by
input."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from kr5_tools.calibrate.plots import Plot
from kr5_tools.pages.plot_style import BLUE, GREEN, GREY, INK, RED, STYLE, WIDE, plt

COLOURS = (BLUE, RED, GREEN)
MOST_BARS = 30  # inputs of a chart; of more, those that count
SIZE = 0.8  # of the space of an input, that its bars take


def analysis_plots(analysis: dict[str, Any]) -> list[Plot]:
    """Charts of up to three outputs each, of those that vary. Close the figures after use."""
    names = [output["name"] for output in analysis["outputs"]]
    varying = [k for k, variance in enumerate(analysis["variance"]) if variance]
    groups = [varying[k : k + 3] for k in range(0, len(varying), 3)]
    if len(names) == 6:  # a pose: position and orientation
        groups = [[k for k in varying if (k < 3) == position] for position in (True, False)]
    out = []
    with plt.rc_context(STYLE):
        for group in groups:
            if group:
                shown = ", ".join(names[k] for k in group)
                slug = "".join(names[k] for k in group) if all(names[k].isalnum() for k in group) else str(group[0] + 1)
                out.append(
                    Plot(
                        f"{analysis['name']}_{slug}", f"Sensitivity of {shown}", TEXT, draw_bars(analysis, group), True
                    )
                )
    return out


TEXT = (
    "Total index of every input (bars), with its interval, and first-order index (dash): where the dash lies below"
    " the bar, the input acts together with others."
)


def draw_bars(analysis: dict[str, Any], outputs: list[int]) -> Figure:
    total, low, high, first = (np.array(analysis[key], float) for key in ("total", "total_low", "total_high", "first"))
    chosen = np.arange(len(total))
    if len(chosen) > MOST_BARS:
        chosen = np.sort(np.argsort(-total[:, outputs].max(axis=1))[:MOST_BARS])
    figure, axes = plt.subplots(figsize=(max(WIDE, 0.34 * len(chosen) + 1.5), 3.2))
    at, width = np.arange(len(chosen)), SIZE / len(outputs)
    for k, output in enumerate(outputs):
        x = at + (k - (len(outputs) - 1) / 2) * width
        y = total[chosen, output]
        errors = np.maximum([y - low[chosen, output], high[chosen, output] - y], 0)
        name = analysis["outputs"][output]["name"]
        axes.bar(x, y, 0.92 * width, color=COLOURS[k], label=name)
        axes.errorbar(x, y, yerr=errors, fmt="none", ecolor=GREY, elinewidth=0.9, capsize=1.5)
        shown = first[chosen, output]
        seen = y > 0.02  # on a lower bar the dash would hide it
        axes.hlines(shown[seen], (x - 0.4 * width)[seen], (x + 0.4 * width)[seen], color=INK, linewidth=1.1)
    labels = [analysis["inputs"][k]["name"] for k in chosen]
    upright = sum(map(len, labels)) > 70 or len(labels) > 14
    axes.set_xticks(at, labels, rotation=90 if upright else 0, fontsize=9)
    axes.set_ylabel("total index [-]")
    axes.set_xlim(-0.6, len(chosen) - 0.4)
    axes.set_ylim(0, None)
    axes.grid(axis="x", visible=False)
    axes.legend(ncols=len(outputs), loc="lower right", bbox_to_anchor=(1, 1), fontsize=9)
    return figure
