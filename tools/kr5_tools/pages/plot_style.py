"""The look that all plots share, on paper and on a page in light or dark mode."""

from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt

__all__ = [
    "BEHIND",
    "BLUE",
    "EDGE",
    "FLOOR",
    "GREEN",
    "GREY",
    "INK",
    "LINE",
    "ON_PALE",
    "PAPER",
    "RED",
    "RED_TEXT",
    "SOFT",
    "STYLE",
    "THEMED",
    "UNKNOWN",
    "WIDE",
    "WIDTH",
    "plt",
]

# Okabe and Ito's palette, which people with any colour vision tell apart; outliers are also marked in words or shape.
BLUE, RED, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#6b7280"
RED_TEXT = "#b94700"  # dark enough for words
INK, SOFT, EDGE, LINE = "#1f2937", "#374151", "#9ca3af", "#e5e7eb"  # text, ticks, axes and lines, grid and bands
PAPER = "#fffffe"  # behind the plot: almost "white", which stays white in dark mode
ON_PALE = "#111111"  # text on a pale colour, in dark mode too
FLOOR, UNKNOWN = "#cbd5de", "#f3f4f6"  # a gap at the floor of noise; not recorded
# Colours of which a page has another in dark mode, and the name of its variable in report.css.
THEMED = {
    BLUE: "plot-blue",
    RED: "plot-red",
    RED_TEXT: "red",
    GREEN: "plot-green",
    GREY: "plot-grey",
    INK: "plot-ink",
    SOFT: "plot-soft",
    EDGE: "plot-edge",
    LINE: "plot-line",
    PAPER: "paper",
    FLOOR: "plot-floor",
    UNKNOWN: "plot-unknown",
}
STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 10.5,
    "text.color": INK,
    "axes.titlesize": 10.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": EDGE,
    "axes.labelcolor": INK,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "axes.grid": True,
    "grid.color": LINE,
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "svg.fonttype": "none",
    "svg.hashsalt": "kr5",
    "figure.constrained_layout.use": True,
    "legend.frameon": False,
}
BEHIND: dict[str, Any] = {"color": GREY, "linewidth": 3.5, "alpha": 0.5}  # a measured line that a predicted one lies on
WIDTH = 4.4  # [in]: readable at phone width, two or three beside each other on a desk
WIDE = 6.4
