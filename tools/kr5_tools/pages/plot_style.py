"""The look that all plots share."""

from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt

__all__ = ["BLUE", "GREEN", "GREY", "RED", "STYLE", "WIDE", "WIDTH", "plt"]

# Okabe and Ito's palette, which people with any colour vision tell apart; outliers are also marked in words or shape.
BLUE, RED, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#6b7280"
STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 10.5,
    "axes.titlesize": 10.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#9ca3af",
    "axes.labelcolor": "#1f2937",
    "xtick.color": "#374151",
    "ytick.color": "#374151",
    "axes.grid": True,
    "grid.color": "#e5e7eb",
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "svg.fonttype": "none",
    "svg.hashsalt": "kr5",
    "figure.constrained_layout.use": True,
    "legend.frameon": False,
}
WIDTH = 4.4  # [in]: readable at phone width, two or three beside each other on a desk
WIDE = 6.4
