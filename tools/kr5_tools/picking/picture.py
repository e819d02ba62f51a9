"""Picture of a bin from above: heights, cylinders, and what was decided about each."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import kr5.picking
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.patches import Patch

from kr5_tools.pages.plot_style import BLUE, GREEN, GREY, RED, STYLE, plt

COLOURS = {"graspable": GREEN, "covered": BLUE, "touches_bin": RED, "touches_pile": RED}
LABELS = {
    "graspable": "can be picked, in this order",
    "covered": "another lies on it",
    "touches_bin": "gripper would touch the bin",
    "touches_pile": "gripper would touch neighbours",
    "other": "hidden, no place for the cup, or uncertain",
}
DASHES = {"touches_pile": (0, (3, 1.5))}  # the other outlines are drawn through
CELL = 0.5e-3  # [m] of the height map
HEIGHTS = LinearSegmentedColormap.from_list(
    "heights", ["#f3f4f6", "#868f9c"]
)  # on which outlines and numbers stand out
UNSEEN = "#fbdf9d"  # no height has this colour
WALLS = 1.0  # share of the map [%] that walls and stray points may fill without stretching the scale


def write_picture(file: Path, points: np.ndarray, bin_: kr5.picking.Bin, pellets: list[dict[str, Any]]) -> None:
    """Writes the picture. `points`: 3 x n in the base [m]; `pellets` as in a kr5-pick/1 result."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(7.4, 6.4))
        draw_bin(axes, points, bin_, pellets)
        figure.savefig(file, dpi=130)
        plt.close(figure)


def draw_bin(axes: Axes, points: np.ndarray, bin_: kr5.picking.Bin, pellets: list[dict[str, Any]]) -> None:
    """Height map and outlines in the frame of the bin."""
    T_bin_base = np.linalg.inv(bin_.T_base_bin)
    size = np.asarray(bin_.size)
    local = T_bin_base[:3, :3] @ points + T_bin_base[:3, 3:]
    local = local[:, np.isfinite(local).all(axis=0)]
    inside = (np.abs(local[0]) < size[0] / 2) & (np.abs(local[1]) < size[1] / 2)
    _draw_heights(axes, local[:, inside], size)
    draw_pellets(axes, T_bin_base, pellets, [Patch(color=UNSEEN, label="not seen by the scanner")])
    wide, deep = 1e3 * size[:2] / 2
    axes.set(xlabel="x of the bin [mm]", ylabel="y of the bin [mm]", aspect="equal")
    axes.set(xlim=(-wide, wide), ylim=(-deep, deep))


def draw_pellets(
    axes: Axes, T_bin_base: np.ndarray, pellets: list[dict[str, Any]], more: Iterable[Artist] = ()
) -> None:
    """Outlines of the cylinders from above, coloured by what was decided, with a legend that has `more`, too."""
    for number, pellet in enumerate(pellets, 1):
        _draw_pellet(axes, T_bin_base, pellet)
        if pellet["graspable"]:
            x, y, _ = 1e3 * (T_bin_base[:3, :3] @ np.asarray(pellet["centre"]) + T_bin_base[:3, 3])
            axes.text(x, y, str(number), ha="center", va="center", fontsize=7.5, weight="bold")
    finding = [p["finding"] for p in pellets]
    handles = []
    for key, label in LABELS.items():
        count = sum(f == key or (key == "other" and f not in COLOURS) for f in finding)
        style: dict[str, Any] = {"color": COLOURS.get(key, GREY), "linestyle": DASHES.get(key, "-"), "linewidth": 2}
        if count:
            handles += axes.plot([], [], label=f"{label}: {count}", **style)
    axes.figure.legend(handles=[*handles, *more], loc="outside lower center", ncols=2, fontsize=8.5)


def _draw_heights(axes: Axes, local: np.ndarray, size: np.ndarray) -> None:
    cell = max(CELL, float(size[:2].max()) / 600)
    shape = np.ceil(size[:2] / cell).astype(int)
    heights = np.full(shape, np.nan)
    at = np.minimum(((local[:2].T + size[:2] / 2) / cell).astype(int), shape - 1)
    order = np.argsort(local[2])  # the highest of a cell is written last
    heights[at[order, 0], at[order, 1]] = 1e3 * local[2, order]
    wide, deep = 1e3 * size[0] / 2, 1e3 * size[1] / 2
    extent = (-wide, wide, -deep, deep)
    seen = heights[np.isfinite(heights)]
    top = float(np.percentile(seen, 100 - WALLS)) if seen.size else 1.0
    axes.set_facecolor(UNSEEN)
    image = axes.imshow(heights.T, origin="lower", extent=extent, cmap=HEIGHTS, interpolation="nearest")
    image.set_clim(min(0.0, top - 1), top)
    axes.grid(False)
    label = "height above the floor [mm]"
    axes.figure.colorbar(image, ax=axes, label=label, shrink=0.8, extend="max" if (seen > top).any() else "neither")


def _draw_pellet(axes: Axes, T_bin_base: np.ndarray, pellet: dict[str, Any]) -> None:
    centre = T_bin_base[:3, :3] @ np.asarray(pellet["centre"]) + T_bin_base[:3, 3]
    axis = T_bin_base[:3, :3] @ np.asarray(pellet["axis"])
    colour, dashes = COLOURS.get(pellet["finding"], GREY), DASHES.get(pellet["finding"], "-")
    angle = np.linspace(0, 2 * np.pi, 61)
    u = np.cross(axis, [1.0, 0, 0] if abs(axis[0]) < 0.7 else [0, 1.0, 0])
    u /= np.linalg.norm(u)
    ring = pellet["radius"] * (np.outer(np.cos(angle), u) + np.outer(np.sin(angle), np.cross(axis, u)))
    ends = [1e3 * (centre + side * axis * pellet["height"] / 2 + ring) for side in (1, -1)]
    for end, alpha in zip(ends, (1.0, 0.35), strict=True):
        axes.plot(end[:, 0], end[:, 1], color=colour, linestyle=dashes, linewidth=1.4, alpha=alpha)
    across = np.cross(axis, [0, 0, 1.0])
    if np.linalg.norm(across) > 0.2:  # the two lines of the outline
        offset = pellet["radius"] * across / np.linalg.norm(across)
        for sign in (1, -1):
            line = 1e3 * np.array([centre + s * axis * pellet["height"] / 2 + sign * offset for s in (-1, 1)])
            axes.plot(line[:, 0], line[:, 1], color=colour, linestyle=dashes, linewidth=1.4)
