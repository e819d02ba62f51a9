"""Side view of a work cell: bin, stand, tubes, tool, and where every pellet is."""

from pathlib import Path

import kr5.sim
import numpy as np
from matplotlib.axes import Axes

from kr5_tools.pages.plot_style import BLUE, EDGE, GREEN, GREY, INK, RED, STYLE, plt

COLOURS = {"bin": GREY, "grip": BLUE, "loose": RED, "stand": GREEN, "tube": GREEN, "lost": RED}
MILLIMETRES = 1e3


def write_side_view(file: Path, cell: kr5.sim.WorkCell) -> None:
    """Writes the picture of what is so in a cell."""
    tube = cell.believed.tube
    assert tube is not None  # a work cell needs one
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(7.4, 4.6))
        draw_side_view(axes, cell.truth(), cell.options, tube)
        figure.savefig(file, dpi=130)
        plt.close(figure)


def draw_side_view(
    axes: Axes, truth: kr5.sim.WorkCellTruth, options: kr5.sim.WorkCellOptions, tube: kr5.cell.Tube
) -> None:
    """Outlines in the plane of y and z of the base."""
    size = np.asarray(options.bin.size)
    _draw_box(axes, truth.T_base_bin, (-size[:2] / 2, size[:2] / 2), (0.0, size[2]), EDGE)
    half = np.asarray(options.stand.size) / 2
    _draw_box(axes, truth.T_base_stand, (-half, half), (-0.002, 0.0), INK)
    for T in truth.T_base_tubes:
        for radius in (tube.inner_radius, tube.outer_radius):
            across = np.array([radius, radius])
            _draw_box(axes, T, (-across, across), (-tube.depth, 0.0), EDGE)
    for pellet in truth.pellets:
        outline = MILLIMETRES * pellet_outline(np.asarray(pellet.T_base_pellet), pellet.radius, pellet.height)
        axes.plot(*outline, color=COLOURS[str(pellet.place)], linewidth=1.0)
    tip, back = np.asarray(truth.T_base_tool)[:3, 3], np.asarray(truth.T_base_tool)[:3, 2]
    tool = MILLIMETRES * np.array([tip, tip - 0.1 * back])
    axes.plot(tool[:, 1], tool[:, 2], color=BLUE, linewidth=2.5, alpha=0.5)
    axes.axhline(MILLIMETRES * options.table, color=INK, linewidth=1.2)
    for place, colour in COLOURS.items():
        count = sum(str(p.place) == place for p in truth.pellets)
        if count:
            axes.plot([], [], color=colour, label=f"{place}: {count}")
    axes.legend(loc="upper left", fontsize=8.5)
    axes.set(xlabel="y of the base [mm]", ylabel="z of the base [mm]", aspect="equal")


def pellet_outline(T_base_pellet: np.ndarray, radius: float, height: float) -> np.ndarray:
    """Outline of a cylinder in the plane of y and z, closed, shape (2, n) [m]."""
    angle = np.linspace(0, 2 * np.pi, 49)
    ring = radius * np.array([np.cos(angle), np.sin(angle), np.zeros_like(angle)])
    ends = [ring + np.array([[0], [0], [side * height / 2]]) for side in (-1, 1)]
    points = (T_base_pellet[:3, :3] @ np.hstack(ends) + T_base_pellet[:3, 3:])[1:]
    return _convex_hull(points)


def _convex_hull(points: np.ndarray) -> np.ndarray:
    """Of points in a plane, closed (Andrew's monotone chain)."""
    order = [tuple(p) for p in points.T[np.lexsort((points[1], points[0]))]]

    def half(walk: list[tuple[float, float]]) -> list[tuple[float, float]]:
        out: list[tuple[float, float]] = []
        for p in walk:
            while len(out) > 1 and _turns_right(out[-2], out[-1], p):
                out.pop()
            out.append(p)
        return out

    lower, upper = half(order), half(order[::-1])
    return np.array(lower[:-1] + upper).T


def _turns_right(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) <= 0


def _draw_box(
    axes: Axes, T: np.ndarray, across: tuple[np.ndarray, np.ndarray], heights: tuple[float, float], colour: str
) -> None:
    low, high = across
    corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in heights]).T
    T = np.asarray(T)
    axes.plot(*(MILLIMETRES * _convex_hull((T[:3, :3] @ corners + T[:3, 3:])[1:])), color=colour, linewidth=1.2)
