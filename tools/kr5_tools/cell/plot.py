"""The arm of a cell in its frames, drawn with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import kr5.cell
import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import proj3d

from kr5_tools.pages.plot_style import BLUE, GREEN, GREY, RED, STYLE

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D

AXES = (RED, GREEN, BLUE)
LINK, JOINT, JOINT_TEXT = "#374151", "#f59e0b", "#92400e"


def arm_figure(
    cell: kr5.cell.Cell, q: list[float], fixed: dict[str, Any], carried: dict[str, Any], title: str
) -> Figure:
    """The whole cell on the left, what the flange carries on the right.

    `fixed` and `carried`: pose in the base of each frame, by a name whose first word is its label; `F flange` is
    carried."""
    links = [np.asarray(cell.robot.T_base_0), *map(np.asarray, cell.link_poses(q))]
    fixed = {"B base": np.eye(4), **{name: np.asarray(T) for name, T in fixed.items()}}
    carried = {name: np.asarray(T) for name, T in carried.items()}
    with plt.rc_context({**STYLE, "figure.constrained_layout.use": False}):
        figure = plt.figure(figsize=(13, 7))
        figure.suptitle(title, fontsize=12, y=0.975)
        whole = figure.add_axes((0.01, 0.12, 0.47, 0.8), projection="3d")
        near = figure.add_axes((0.5, 0.12, 0.47, 0.8), projection="3d")
        labels = {**fixed, "F flange": carried["F flange"]}
        _draw(whole, links, {**fixed, **carried}, labels, 0.07, range(len(links) - 1))
        _draw(near, links, carried, carried, 0.09, range(0))
        whole.set_title("the cell", y=1.0)
        near.set_title("at the flange", y=1.0)
        _legend(figure, [*fixed, *carried])
    return figure


def _draw(
    axes: Axes3D,
    links: list[np.ndarray],
    shown: dict[str, np.ndarray],
    labelled: dict[str, np.ndarray],
    size: float,
    joints: range,
) -> None:
    """Frames, and the links behind `joints`, in a cube around them; without joints the last link as far as it lies
    there."""
    near = len(joints) == 0
    origins = np.array([T[:3, 3] for T in [*shown.values(), *(links[i + 1] for i in joints)]])
    low, high = origins.min(axis=0), origins.max(axis=0)
    span = max(float((high - low).max()), 0.1)
    length = size * span
    middle, half = (low + high) / 2, 0.5 * span + 1.1 * length
    box = np.array([middle - half, middle + half])
    axes.set(xlim=box[:, 0], ylim=box[:, 1], zlim=box[:, 2], xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set_box_aspect((1, 1, 1))
    axes.view_init(elev=18, azim=-60)
    axes.tick_params(labelsize=8)
    axes.locator_params(nbins=6)
    numbers = _draw_links(axes, links, joints or range(len(links) - 2, len(links) - 1), length, box)
    for name, T in shown.items():
        if near and name != "F flange":
            axes.plot(*np.array([shown["F flange"][:3, 3], T[:3, 3]]).T, color=GREY, linewidth=0.8, linestyle=":")
        if not near:
            axes.plot(*np.array([T[:3, 3], [*T[:2, 3], box[0, 2]]]).T, color=GREY, linewidth=0.5, alpha=0.4)
        for k, colour in enumerate(AXES):
            axes.plot(*np.array([T[:3, 3], T[:3, 3] + length * T[:3, k]]).T, color=colour, linewidth=1.8)
    lines = [T[:3, 3] + part * length * T[:3, k] for T in shown.values() for k in range(3) for part in (0.4, 0.7, 1.0)]
    _place_labels(axes, {name.split(" ")[0]: T[:3, 3] for name, T in labelled.items()}, numbers, lines)


def _inside(line: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Points along a line that lie in the box; matplotlib does not clip in 3D."""
    t = np.linspace(0, len(line) - 1, 60 * (len(line) - 1) + 1)
    points = np.stack([np.interp(t, range(len(line)), line[:, k]) for k in range(3)], axis=1)
    return points[np.all((points >= box[0]) & (points <= box[1]), axis=1)]


def _draw_links(
    axes: Axes3D, links: list[np.ndarray], joints: range, length: float, box: np.ndarray
) -> dict[str, np.ndarray]:
    """Links as the way along b and then a of each row, joint axes as short thick lines. Gives places for the
    numbers."""
    numbers = {}
    for i in joints:
        start, end, z = links[i][:3, 3], links[i + 1][:3, 3], links[i][:3, 2]
        knee = start + np.dot(end - start, z) * z  # along the axis; the rest is along a
        way = _inside(np.array([start, knee, end]), box)
        if len(way):
            axes.plot(*way.T, color=LINK, linewidth=5, solid_capstyle="round", alpha=0.45)
        if len(_inside(np.array([start, start]), box)):
            axes.plot(
                *np.array([start - 0.6 * length * z, start + 0.6 * length * z]).T,
                color=JOINT,
                linewidth=5,
                alpha=0.85,
                solid_capstyle="butt",
            )
            numbers[str(i + 1)] = start
    return numbers


def _place_labels(
    axes: Axes3D, frames: dict[str, np.ndarray], numbers: dict[str, np.ndarray], lines: list[np.ndarray]
) -> None:
    """Each label at the nearest place around its origin where it covers no other label and little of the drawing."""
    figure = axes.get_figure()
    axes.apply_aspect()
    figure.canvas.draw()
    to_pixels = axes.transData.transform
    points = figure.dpi / 72

    def pixel(p: np.ndarray) -> np.ndarray:
        x, y, _ = proj3d.proj_transform(*p, axes.get_proj())
        return np.asarray(to_pixels((x, y)))

    drawn = np.array([pixel(p) for p in [*frames.values(), *numbers.values(), *lines]])
    taken: list[tuple[np.ndarray, np.ndarray]] = []
    for text, p, bold in [(t, p, True) for t, p in frames.items()] + [(t, p, False) for t, p in numbers.items()]:
        at = pixel(p)
        half = points * np.array([4.5 * len(text) + 2, 8.0])

        def cost(offset: np.ndarray, at: np.ndarray = at, half: np.ndarray = half) -> float:
            centre = at + offset
            over = sum(np.all(np.abs(centre - other) < half + other_half) for other, other_half in taken)
            covers = np.sum(np.all(np.abs(centre - drawn) < half, axis=1))
            return float(1000 * over + 30 * points * covers + np.hypot(*offset))

        turns = np.deg2rad([225, 315, 135, 45, 180, 0, 270, 90])
        places = [points * radius * np.array([np.cos(a), np.sin(a)]) for radius in (15, 24, 36, 50) for a in turns]
        best = min(places, key=cost)
        taken.append((at + best, half))
        far = np.hypot(*best) > 20 * points
        axes.annotate(
            text,
            xy=axes.transData.inverted().transform(at),
            xytext=best / points,
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=12 if bold else 9,
            fontweight="bold" if bold else "normal",
            color="#111827" if bold else JOINT_TEXT,
            zorder=30,
            arrowprops=(
                {"arrowstyle": "-", "color": GREY, "linewidth": 0.6, "shrinkA": 6, "shrinkB": 2} if far else None
            ),
        )


def _legend(figure: Figure, names: list[str]) -> None:
    lines = [plt.Line2D([], [], color=c, linewidth=2) for c in AXES] + [
        plt.Line2D([], [], color=LINK, linewidth=5, alpha=0.45),
        plt.Line2D([], [], color=JOINT, linewidth=5, alpha=0.85),
    ]
    texts = ["x", "y", "z", "link (along b, then a)", "joint axis with its number"]
    figure.legend(lines, texts, loc="lower center", bbox_to_anchor=(0.5, 0.045), ncols=5, fontsize=10)
    figure.text(0.5, 0.025, "     ".join(names), ha="center", fontsize=10, color="#374151")
