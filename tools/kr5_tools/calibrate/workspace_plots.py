"""Maps of a workspace. Each function gives a figure, or None when the result has not what it shows."""

import numpy as np
from kr5.files.result_types import ResultData
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from kr5_tools.pages.plot_style import GREY, WIDTH, plt


def _map(data: ResultData, name: str, label: str, colours: str, log: bool = False) -> Figure | None:
    result = data.get("result", {})
    if not all(result.get(key) for key in (name, "radius", "height")):
        return None
    values = np.array([[np.nan if v is None else v for v in row] for row in result[name]], float)
    if name == "counts":
        values[values == 0] = np.nan
    if not np.isfinite(values).any():
        return None
    radius, height = np.array(result["radius"]), np.array(result["height"])
    wide, high = np.diff(radius)[0], np.diff(height)[0]
    extent = (radius[0] - wide / 2, radius[-1] + wide / 2, height[0] - high / 2, height[-1] + high / 2)
    tall = np.clip((extent[3] - extent[2]) / (extent[1] - extent[0]), 0.25, 2.0)
    figure, axes = plt.subplots(figsize=(WIDTH, min(WIDTH * tall * 0.8 + 1.0, 8.0)))
    norm = LogNorm(vmin=np.nanmin(values), vmax=min(np.nanmax(values), 100 * np.nanmin(values))) if log else None
    shown = axes.imshow(values, extent=extent, origin="lower", cmap=colours, norm=norm, aspect="equal")
    figure.colorbar(shown, ax=axes, label=label, location="bottom", shrink=0.85, aspect=30)
    axes.axvline(0, color=GREY, linewidth=1)
    axes.axvline(result["reach"], color=GREY, linewidth=1, linestyle="--")
    axes.grid(False)
    axes.set(xlabel="distance from axis 1 [m]", ylabel="height [m]")
    return figure


def reachable_region(data: ResultData) -> Figure | None:
    return _map(data, "counts", "postures in the cell", "Blues", log=True)


def dexterity_map(data: ResultData) -> Figure | None:
    return _map(data, "dexterity", "sqrt(det(J Jᵀ)) of the point", "viridis")


def singular_value_map(data: ResultData) -> Figure | None:
    name = "min_singular_value" if "min_singular_value" in data.get("result", {}) else "least"  # of versions before 0.3
    return _map(data, name, "smallest singular value [-]", "viridis")


def condition_map(data: ResultData) -> Figure | None:
    return _map(data, "condition", "condition number [-]", "viridis_r", log=True)
