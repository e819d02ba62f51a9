"""How well a result fits: the error of each view or touch, and the residuals over the image. Each function gives a
figure, or None when the result has not what it shows."""

import numpy as np
from kr5.files.result_types import ResultData, ViewNumber
from matplotlib.figure import Figure

from kr5_tools.pages.plot_style import BLUE, GREY, INK, RED, RED_TEXT, WIDE, WIDTH, plt

MOST_ARROWS = 3000


def _bars(names: list[str], values: np.ndarray, marked: np.ndarray, label: str, line: float | None = None) -> Figure:
    """Horizontal bars with names while these can be read, else a plain profile."""
    few = len(names) <= 40
    figure, axes = plt.subplots(figsize=(WIDTH, max(2.2, 0.6 + 0.22 * len(names)) if few else 3.2))
    at = np.arange(len(names))
    colours = [RED if m else BLUE for m in marked]
    if few:
        bars = axes.barh(at, values, color=colours, height=0.72)
        axes.set_yticks(at, [name if len(name) <= 18 else "…" + name[-17:] for name in names], fontsize=9)
        axes.invert_yaxis()
        axes.grid(axis="y", visible=False)
        axes.set_xlabel(label)
        axes.locator_params(axis="x", nbins=6)
        for bar, m in zip(bars, marked):
            if m:
                axes.annotate(
                    " outlier",
                    (bar.get_width(), bar.get_y() + bar.get_height() / 2),
                    color=RED_TEXT,
                    va="center",
                    fontsize=9,
                    annotation_clip=False,
                )
        axes.margins(x=0.18 if any(marked) else 0.05)
    else:
        axes.vlines(at, 0, values, color=colours, linewidth=1.5)
        axes.plot(at[marked], values[marked], "v", color=RED, label="outlier")
        axes.set(xlabel="view number, in order", ylabel=label)
        if any(marked):
            axes.legend()
    axes.set_xlim(left=0) if few else axes.set_ylim(bottom=0)
    if line is not None:
        (axes.axvline if few else axes.axhline)(line, color=GREY, linestyle="--", linewidth=1)
    return figure


def _view_bars(data: ResultData, key: ViewNumber, factor: float, label: str) -> Figure | None:
    views = [v for v in data.get("views", ()) if isinstance(v.get(key), (int, float))]
    if len(views) < 2 or not any(v[key] for v in views):
        return None
    values = factor * np.array([v[key] for v in views])
    marked = np.array([bool(v.get("outlier")) for v in views])
    return _bars([str(v["name"]) for v in views], values, marked, label)


def view_errors(data: ResultData) -> Figure | None:
    return _view_bars(data, "rms_px", 1.0, "RMS distance, seen to predicted [px]")


def robot_positions(data: ResultData) -> Figure | None:
    return _view_bars(data, "robot_position", 1e3, "displacement of the robot [mm]")


def robot_rotations(data: ResultData) -> Figure | None:
    return _view_bars(data, "robot_rotation", 180 / np.pi, "rotation of the robot [deg]")


def touch_errors(data: ResultData) -> Figure | None:
    return _view_bars(data, "distance", 1e3, "tip to the touched point [mm]")


def _residuals(data: ResultData) -> tuple[np.ndarray, np.ndarray] | None:
    """All residuals, one row a point: u, v, du, dv; and whether its view is an outlier."""
    outliers = {v["name"] for v in data.get("views", ()) if v.get("outlier")}
    rows, marked = [], []
    for view in data.get("residuals", ()):
        block = np.array([view[k] for k in ("u", "v", "du", "dv")], dtype=float).T.reshape(-1, 4)
        rows.append(block)
        marked.append(np.full(len(block), view.get("view") in outliers))
    if not rows or not sum(map(len, rows)):
        return None
    points, bad = np.vstack(rows), np.concatenate(marked)
    good = np.isfinite(points).all(axis=1)
    return (points[good], bad[good]) if good.any() else None


def _image_axes(data: ResultData, axes: plt.Axes, points: np.ndarray) -> tuple[float, float]:
    width, height = data.get("image_size") or (points[:, 0].max() + 1, points[:, 1].max() + 1)
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), aspect="equal", xlabel="u [px]", ylabel="v [px]")
    for spine in axes.spines.values():
        spine.set_visible(True)
    return width, height


def residual_field(data: ResultData) -> Figure | None:
    found = _residuals(data)
    if found is None:
        return None
    points, bad = found
    if len(points) > MOST_ARROWS:
        keep = np.linspace(0, len(points) - 1, MOST_ARROWS).astype(int)
        points, bad = points[keep], bad[keep]
    across, down = data.get("image_size") or (4, 3)
    figure, axes = plt.subplots(figsize=(WIDE, min(WIDE * down / across + 0.4, 7.5)))
    width, _ = _image_axes(data, axes, points)
    sound = points[~bad] if (~bad).any() else points
    typical = float(np.median(np.hypot(sound[:, 2], sound[:, 3]))) or 1.0
    magnify = 0.02 * width / typical
    for which, colour in ((~bad, BLUE), (bad, RED)):
        if which.any():
            axes.quiver(
                *points[which].T,
                angles="xy",
                scale_units="xy",
                scale=1 / magnify,
                color=colour,
                width=0.0018,
                headwidth=4,
                headlength=5,
            )
    key = float(f"{2 * typical:.1g}")
    axes.plot([0.03 * width, 0.03 * width + key * magnify], [-0.045 * width] * 2, color=INK, linewidth=2, clip_on=False)
    axes.annotate(f"{key:g} px", (0.04 * width + key * magnify, -0.045 * width), va="center", annotation_clip=False)
    if bad.any():
        axes.annotate(
            "orange: views named as outliers",
            (width, -0.045 * width),
            color=RED_TEXT,
            ha="right",
            va="center",
            annotation_clip=False,
        )
    return figure


def residual_cloud(data: ResultData) -> Figure | None:
    found = _residuals(data)
    if found is None:
        return None
    points, bad = found
    figure, axes = plt.subplots(figsize=(WIDTH, WIDTH * 0.92))
    sound = points[~bad] if (~bad).any() else points
    sigma = float(np.sqrt(np.mean(sound[:, 2:] ** 2)))
    limit = max(4.5 * sigma, 1e-9)
    inside = np.abs(points[:, 2:]).max(axis=1) < limit
    size = 9 if len(points) < 800 else 4
    axes.scatter(
        points[inside & ~bad, 2],
        points[inside & ~bad, 3],
        s=size,
        color=BLUE,
        alpha=0.45,
        linewidths=0,
        rasterized=len(points) > 1500,
    )
    axes.scatter(points[inside & bad, 2], points[inside & bad, 3], s=size + 5, color=RED, marker="x", linewidths=0.8)
    for k in (1, 3):
        axes.add_patch(
            plt.Circle((0, 0), k * sigma, fill=False, color=INK, linewidth=1, linestyle="-" if k == 1 else "--")
        )
        axes.annotate(f"{k}σ", (0, -k * sigma), fontsize=9, ha="center", va="bottom")
    beyond = int((~inside).sum())
    title = f"σ = {sigma:.3f} px per axis" + (f"\n{beyond} of {len(points)} beyond the frame" if beyond else "")
    axes.set(
        xlim=(-limit, limit), ylim=(limit, -limit), aspect="equal", xlabel="du [px]", ylabel="dv [px]", title=title
    )
    return figure


def coverage_plot(data: ResultData) -> Figure | None:
    counts = np.array((data.get("result", {}).get("coverage") or {}).get("counts", []), dtype=float)
    size = data.get("image_size")
    if counts.ndim != 2 or not counts.size or not size:
        return None
    figure, axes = plt.subplots(figsize=(WIDTH, WIDTH * size[1] / size[0] + 0.75))
    shown = axes.imshow(counts, extent=(-0.5, size[0] - 0.5, size[1] - 0.5, -0.5), cmap="Blues", vmin=0, aspect="equal")
    rows, cols = counts.shape
    for i, j in zip(*np.nonzero(counts == 0)):
        axes.annotate(
            "0", ((j + 0.5) * size[0] / cols, (i + 0.5) * size[1] / rows), ha="center", va="center", color=RED_TEXT
        )
    figure.colorbar(shown, ax=axes, label="points in cell", location="bottom", shrink=0.8, aspect=30)
    axes.grid(False)
    axes.set(xlabel="u [px]", ylabel="v [px]")
    return figure
