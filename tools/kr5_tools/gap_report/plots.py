"""The plots of a diagnosis: the cell coloured by its gap, gaps by column and experiment, residuals before and after."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import kr5.cell
import kr5.gap
import numpy as np
from kr5.gap import column_text, part_of, part_text, variable_text
from kr5.robot import usual_cycle
from matplotlib.colors import LinearSegmentedColormap, LogNorm, to_hex
from matplotlib.figure import Figure

from kr5_tools.calibrate.plots import Plot
from kr5_tools.gap_report.evidence_data import Evidence, display_variable
from kr5_tools.gap_report.messages import group_of
from kr5_tools.pages.plot_style import (
    BLUE,
    EDGE,
    FLOOR,
    GREY,
    LINE,
    ON_PALE,
    PAPER,
    RED,
    SOFT,
    STYLE,
    UNKNOWN,
    WIDE,
    plt,
)

if TYPE_CHECKING:
    from mpl_toolkits.mplot3d import Axes3D

WIDEST = 30.0
COLOURS = LinearSegmentedColormap.from_list("gap", ["#fde9a9", "#fdb863", "#e8601c", "#a50f15", "#5c0011"])
NORM = LogNorm(1.0, WIDEST, clip=True)
MOST_POINTS = 4000
MIDDLE = 5.0  # [in] wide: two beside each other on a desk, readable on a phone


def gap_colour(gap: float | None, above: bool) -> str:
    """Of a part: none recorded, at the floor, or by its gap."""
    if gap is None or not np.isfinite(gap):
        return UNKNOWN
    return to_hex(COLOURS(NORM(gap))) if above else FLOOR


def thinned_rows(n: int, most: int = MOST_POINTS) -> np.ndarray:
    return np.unique(np.linspace(0, n - 1, min(n, most)).round().astype(int))


def heat_map(evidence: Evidence, which: str) -> Figure:
    """Gap of every column (rows) in every experiment."""
    rows = list(dict.fromkeys(c.name for c in evidence.columns))
    names = list(dict.fromkeys(c.experiment.name for c in evidence.columns))
    gaps, above = np.full((len(rows), len(names)), np.nan), np.zeros((len(rows), len(names)), bool)
    for c in evidence.columns:
        values = getattr(c, which)
        at = rows.index(c.name), names.index(c.experiment.name)
        gaps[at] = kr5.gap.residual_gap(values)
        above[at] = gaps[at] > kr5.gap.noise_limit(int(np.isfinite(values).sum()))
    figure, axes = plt.subplots(figsize=(max(MIDDLE, 0.8 + 0.28 * len(names)), 1.6 + 0.22 * len(rows)))
    for i, j in np.ndindex(gaps.shape):
        if np.isfinite(gaps[i, j]):
            axes.add_patch(
                plt.Rectangle(
                    (j - 0.5, i - 0.5), 1, 1, color=gap_colour(float(gaps[i, j]), bool(above[i, j])), linewidth=0
                )
            )
        if above[i, j]:
            text = f"{gaps[i, j]:.0f}" if gaps[i, j] >= 10 else f"{gaps[i, j]:.1f}"
            axes.text(j, i, text, ha="center", va="center", fontsize=8, color="white" if gaps[i, j] > 5 else ON_PALE)
    checks = {e.name for e in evidence.experiments if str(e.split) == "check"}
    axes.set_xticks(
        range(len(names)),
        [f"{n} ✓" if n in checks else n for n in names],
        rotation=60,
        ha="right",
        rotation_mode="anchor",
        fontsize=9,
    )
    axes.set_yticks(range(len(rows)), rows, fontsize=9)
    axes.set(xlim=(-0.5, len(names) - 0.5), ylim=(len(rows) - 0.5, -0.5))
    axes.grid(False)
    axes.tick_params(length=0)
    scale = figure.colorbar(plt.cm.ScalarMappable(NORM, COLOURS), ax=axes, location="bottom", shrink=0.6, aspect=40)
    scale.set_ticks([1, 2, 5, 10, WIDEST], labels=["1", "2", "5", "10", f"{WIDEST:.0f} and more"])
    scale.set_label("gap: times the noise [-]; grey: within the limit of noise")
    scale.ax.minorticks_off()
    return figure


def reduction_plot(found: kr5.gap.Diagnosis) -> Figure | None:
    """Gap of each column before and after, against the floor."""
    columns = sorted(found.reduction.columns, key=lambda column: column.before)[-24:]
    if not columns or not found.causes:
        return None
    figure, axes = plt.subplots(figsize=(MIDDLE, 1.3 + 0.3 * len(columns)))
    at = np.arange(len(columns))
    before, after = np.array([c.before for c in columns]), np.array([c.after for c in columns])
    axes.hlines(at, before, after, color=EDGE, linewidth=1.5)
    axes.plot(before, at, "s", color=RED, label="nominal cell")
    axes.plot(after, at, "o", color=BLUE, label="with the causes")
    axes.axvline(1.0, color=GREY, linestyle="--", linewidth=1)
    axes.set_yticks(at, [c.column for c in columns], fontsize=9)
    if before.max() > 8:
        axes.set_xscale("log")
        axes.set_xticks([t for t in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000) if t < 1.5 * before.max()])
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.minorticks_off()
    axes.set_xlabel("gap on experiments not used for the fit [-]; dashed: the floor")
    axes.legend(fontsize=9, loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    return figure


def residual_plot(evidence: Evidence, group: str) -> Figure:
    """Row by row, before and after; a third panel magnifies the latter where it is much smaller."""
    columns = evidence.judged(group)[:4]
    moving = columns[0].kind not in ("poses", "views", "scan")
    before = np.concatenate([c.before for c in columns])
    after = np.concatenate([c.after for c in columns]) if all(c.after is not None for c in columns) else None
    x, edges, end = [], [], 0.0
    for c in columns:
        t = (
            np.asarray(c.experiment["t"], dtype=float)
            if moving and "t" in c.experiment.data
            else np.arange(len(c.before), dtype=float)
        )
        if np.any(np.diff(t) < 0):
            t = np.arange(len(t), dtype=float) * usual_cycle if moving else np.arange(len(t), dtype=float)
        x.append(t - t[0] + end)
        end = x[-1][-1] + (np.median(np.diff(t)) if len(t) > 1 else 1.0)
        edges.append(end)
    panels = [("at the nominal cell", before, RED, _reach(before))]
    if after is not None:
        panels.append(("with the causes", after, BLUE, _reach(before)))
        if _reach(before) > 3 * _reach(after):
            panels.append(("with the causes, magnified", after, BLUE, _reach(after)))
    figure, axes = plt.subplots(len(panels), 1, figsize=(MIDDLE, 1.0 + 1.25 * len(panels)), sharex=True, squeeze=False)
    keep = thinned_rows(len(before))
    for ax, (title, values, paint, reach) in zip(axes[:, 0], panels):
        ax.axhspan(-2, 2, color=LINE, zorder=0)
        ax.plot(
            np.concatenate(x)[keep],
            values[keep],
            ".",
            color=paint,
            markersize=2.2 if len(keep) > 400 else 6,
            rasterized=len(keep) > 400,
        )
        ax.set_ylim(-reach, reach)
        ax.set_title(f"{title}: gap {kr5.gap.residual_gap(values):.2f}", loc="left")
        for edge in edges[:-1]:
            ax.axvline(edge, color=GREY, linewidth=0.8, linestyle=":")
    axes[-1, 0].set_xlabel(f"{'time [s]' if moving else 'row'}, {', '.join(c.experiment.name for c in columns)}")
    figure.supylabel("recorded − simulated [noise]", fontsize=10)
    return figure


def _reach(values: np.ndarray) -> float:
    """Half a scale that shows nearly all."""
    return max(4.0, 1.15 * float(np.nanquantile(np.abs(values), 0.998)))


def dependence_plot(evidence: Evidence, group: str, dependence: kr5.gap.Dependence) -> Figure | None:
    """The residual against what it depends on: points, and means over bins of equal numbers of rows."""
    columns = evidence.judged(group)
    found = [f for c in columns if (f := display_variable(c, dependence)) is not None]
    if len(found) < len(columns):
        return None
    x, sign = (np.concatenate([f[k] for f in found]) for k in (0, 1))
    figure, axes = plt.subplots(figsize=(MIDDLE, 3.2))
    axes.axhspan(-2, 2, color=LINE, zorder=0)
    reach = 0.0
    for which, paint, label in (("before", RED, "nominal cell"), ("after", BLUE, "with the causes")):
        if any(getattr(c, which) is None for c in columns):
            continue
        r = sign * np.concatenate([getattr(c, which) for c in columns])
        good = np.isfinite(r) & np.isfinite(x) & (sign != 0)
        if good.sum() < 4:
            continue
        reach = max(reach, _reach(r[good]))
        keep = np.flatnonzero(good)[thinned_rows(int(good.sum()))]
        axes.plot(
            x[keep],
            r[keep],
            ".",
            color=paint,
            markersize=2 if len(keep) > 400 else 6,
            alpha=0.35,
            rasterized=len(keep) > 400,
        )
        middle, mean, std = binned_means(x[good], r[good])
        axes.errorbar(middle, mean, 2 * std, color=PAPER, linewidth=4, zorder=4)
        axes.errorbar(
            middle,
            mean,
            2 * std,
            color=paint,
            linewidth=1.8,
            marker="s" if which == "before" else "o",
            markersize=4,
            label=label,
            zorder=5,
        )
    if not reach:
        plt.close(figure)
        return None
    name = variable_text(dependence.variable, group.partition(".")[0])
    axes.set(
        ylim=(-reach, reach),
        xlabel=f"{name} {found[0][2]}".strip(),
        ylabel="recorded − simulated\n" + ("times direction of motion " if np.any(sign != 1) else "") + "[noise]",
    )
    axes.legend(fontsize=9, loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    return figure


def binned_means(x: np.ndarray, r: np.ndarray, bins: int = 24) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle, mean and standard error over bins of equal numbers of rows."""
    parts = [p for p in np.array_split(np.argsort(x, kind="stable"), max(2, min(bins, len(x) // 4))) if len(p)]
    return (
        np.array([x[p].mean() for p in parts]),
        np.array([r[p].mean() for p in parts]),
        np.array([r[p].std() / np.sqrt(len(p)) for p in parts]),
    )


def cell_map(evidence: Evidence, parts: list[dict[str, Any]], q: list[float]) -> Figure:
    """The arm in its frames, joints and sensors coloured by their gap: before, and after."""
    cell, names = evidence.recording.cell, ["before", "after"] if evidence.found.causes else ["before"]
    links = [np.asarray(cell.robot.T_base_0), *map(np.asarray, cell.link_poses(q))]
    places = _places(cell, links)
    figure = plt.figure(figsize=(WIDE * (1.7 if len(names) > 1 else 1), 5.6))
    for k, which in enumerate(names):
        axes = figure.add_subplot(1, len(names), k + 1, projection="3d")
        states = {p["id"]: p[which] for p in parts if p.get(which)}
        _draw_arm(axes, links, states)
        _draw_parts(axes, places, states)
        _set_view(axes, list(places.values()))
        axes.set_title({"before": "nominal cell", "after": "with the causes"}[which])
    scale = figure.colorbar(
        plt.cm.ScalarMappable(NORM, COLOURS), ax=figure.axes, location="bottom", shrink=0.5, aspect=40
    )
    scale.set_ticks([1, 2, 5, 10, WIDEST], labels=["1", "2", "5", "10", f"{WIDEST:.0f}"])
    scale.set_label("widest gap of the part: times the noise [-]; grey: at the floor")
    scale.ax.minorticks_off()
    return figure


def _places(cell: kr5.cell.Cell, links: list[np.ndarray]) -> dict[str, np.ndarray]:
    """Where the parts of a cell are, in the base [m]."""
    places = {f"joint{i + 1}": T[:3, 3] for i, T in enumerate(links[:-1])}
    carried = {
        "sensor": cell.tool and cell.tool.T_flange_sensor,
        "tool": cell.tool and cell.tool.T_flange_tool,
        "camera": cell.T_flange_camera(),
        "laser": cell.T_flange_scanner(),
    }
    places |= {part: (links[-1] @ np.asarray(T))[:3, 3] for part, T in carried.items() if T is not None}
    if cell.tube:
        places["tube"] = np.asarray(cell.tube.T_base_tube)[:3, 3]
    return places


def _draw_arm(axes: "Axes3D", links: list[np.ndarray], states: dict[str, dict[str, Any]]) -> None:
    """Each link, along the axis of its joint and across to the next, in the colour of the joint."""
    for i, (T, after) in enumerate(pairwise(links)):
        start, end, z = T[:3, 3], after[:3, 3], T[:3, 2]
        way = np.array([start, start + np.dot(end - start, z) * z, end])
        paint = states.get(f"joint{i + 1}", {}).get("colour", UNKNOWN)
        axes.plot(*way.T, color=GREY, linewidth=8, solid_capstyle="round")
        axes.plot(*way.T, color=paint, linewidth=6.5, solid_capstyle="round")


def _draw_parts(axes: "Axes3D", places: dict[str, np.ndarray], states: dict[str, dict[str, Any]]) -> None:
    """Marks of what has a place, and labels of what has a gap to write beside it."""
    labels = dict(places)
    if "tool" in places:  # what acts at the tip has a label, no place of its own
        labels |= {"contact": places["tool"] - [0, 0, 0.05], "servo": places["tool"] - [0, 0, 0.1]}
    for part, place in labels.items():
        state = states.get(part)
        if state is None:
            continue
        if part in places and not part.startswith("joint"):
            look = {"color": state["colour"], "markeredgecolor": SOFT, "markersize": 11, "zorder": 20}
            axes.plot(*place.reshape(3, 1), "o", **look)
        if state["label"]:
            axes.text(*place, f"   {part_text(part)} {state['gap']:.1f}", fontsize=9, zorder=30)


def _set_view(axes: "Axes3D", places: list[np.ndarray]) -> None:
    """A cube that holds the places and the base."""
    low, high = (f([*places, np.zeros(3)], axis=0) for f in (np.min, np.max))
    half = 0.5 * float((high - low).max())
    for axis, m in zip("xyz", (low + high) / 2):
        getattr(axes, f"set_{axis}lim")(m - half, m + half)
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set_box_aspect((1, 1, 1))
    axes.view_init(elev=20, azim=-55)
    axes.tick_params(labelsize=8)


def plots_of(
    evidence: Evidence | None, found: kr5.gap.Diagnosis, parts: list[dict[str, Any]], q: list[float], most: int = 4
) -> list[Plot]:
    """Every plot of a diagnosis; without its recording only those of the JSON. Close the figures after use."""
    out = []

    def add(name: str, title: str, text: str, figure: Figure | None, wide: bool = True) -> None:
        if figure is not None:
            out.append(Plot(name, title, text, figure, wide))

    with plt.rc_context(STYLE):
        add(
            "shrink",
            "The gap of each column, before and after",
            "Columns above the floor, on experiments that were not used for the fit.",
            reduction_plot(found),
        )
        if evidence is None:
            return out
        add("map", "The cell, coloured by its gap", "", cell_map(evidence, parts, q))
        add(
            "heat_before",
            "Gap by column and experiment, nominal cell",
            "✓ marks check experiments.",
            heat_map(evidence, "before"),
        )
        if evidence.explained:
            add(
                "heat_after",
                "Gap by column and experiment, with the causes",
                "Coloured fields are not explained; single pale fields are due to chance.",
                heat_map(evidence, "after"),
            )
        for place in worst_columns(evidence, found, most):
            group = group_of(place)
            add(
                f"rows_{group}",
                f"{group}: {column_text(group)}",
                "Row by row. The grey band is two times the noise: 95 % of the points of a "
                "perfect simulation lie in it, without a pattern.",
                residual_plot(evidence, group),
            )
            for dependence in place.depends_on:
                figure = dependence_plot(evidence, group, dependence)
                if figure is not None:
                    add(
                        f"against_{group}",
                        f"{group} against the {variable_text(dependence.variable, place.experiment)}",
                        "Points: rows; squares and circles: means with twice their standard error.",
                        figure,
                    )
                    break
    return out


def worst_columns(evidence: Evidence, found: kr5.gap.Diagnosis, most: int) -> list[kr5.gap.ColumnExcess]:
    """The places whose residuals are worth a look: the first column of each part, and of what stays unexplained; two at
    least. Without a gap, the widest column, to see what noise looks like."""
    where = found.where
    if not where:
        group = max(evidence.groups, key=lambda g: evidence.gap(g) / evidence.limit(g))
        kind, column = group.split(".", 1)
        return [kr5.gap.ColumnExcess(experiment=kind, column=column)]
    first: dict[tuple[str, str], Any] = {}
    for place in [*(p for k, p in enumerate(where) if p.share > 0.002 or k == 0), *found.unexplained]:
        first.setdefault((place.experiment, part_of(group_of(place))), place)
    taken = {id(p) for p in first.values()}
    rest = [p for p in where if id(p) not in taken]
    return [*first.values(), *rest[: max(0, 2 - len(first))]][:most]
