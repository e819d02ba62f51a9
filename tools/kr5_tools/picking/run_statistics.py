"""Statistics of emptied bins as the book gives them (Hayat et al. 2022, Table 2.3 and Figures 6.7 and 6.8)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from kr5.files.result_types import ResultData
from matplotlib.axes import Axes

# Time for an object [ms] and picks that succeeded [%], as printed in Table 2.3 (Hayat et al. 2022).
BOOK = (("Domae", 270, 92), ("Buchholz", 4000, 99), ("Matthias", 2000, 90), ("Liu", 900, 94), ("Hayat et al.", 300, 93))


def run_plots(data: ResultData) -> list[Any]:
    """Plots of a result kr5-bin-run/1. Close the figures after use."""
    from kr5_tools.calibrate.plots import Plot
    from kr5_tools.pages.plot_style import STYLE, WIDE, WIDTH, plt

    trials = [t for b in data["bins"] for t in b["trials"]]
    scans = np.array([s for b in data["bins"] for s in b["scan_seconds"]], float)
    vision = np.array([s for b in data["bins"] for s in b["vision_seconds"]], float)
    out: list[Any] = []
    with plt.rc_context(STYLE):
        if trials:
            figure, axes = plt.subplots(figsize=(WIDE, 3.0))
            _draw_trials(axes, trials)
            text = (
                "Share of the picks that succeeded up to each trial, over all bins, with its exact 95 % interval;"
                " crosses are picks that failed (as Figure 6.7, which has 50 trials and 90 %)."
            )
            out.append(Plot("trials", "Picks that succeeded", text, figure, True))
        if len(vision):
            figure, axes = plt.subplots(figsize=(WIDTH, 3.0))
            _draw_times(axes, 1e3 * vision, "finding, refining and planning [ms]")
            text = (
                f"Time of the computer for what a scan shows; the arm scans for {scans.mean():.1f} s, both passes (as"
                " Figure 6.8a: 7 s on average for scan and image). The time to place (Figure 6.8b) is not simulated."
            )
            out.append(Plot("times", "Time for a scan", text, figure, False))
    return out


def _draw_trials(axes: Axes, trials: Sequence[Mapping[str, object]]) -> None:
    import kr5.uncertainty

    from kr5_tools.pages.plot_style import BLUE, RED

    good = np.array([t["success"] for t in trials], bool)
    number = np.arange(1, len(good) + 1)
    share = 100 * np.cumsum(good) / number
    bounds = [kr5.uncertainty.binomial_interval(int(k), int(n)) for k, n in zip(np.cumsum(good), number, strict=True)]
    axes.fill_between(number, [100 * b.low for b in bounds], [100 * b.high for b in bounds], color=BLUE, alpha=0.15)
    axes.plot(number, share, color=BLUE)
    axes.plot(number[~good], share[~good], "x", color=RED)
    axes.set(xlabel="trial", ylabel="succeeded [%]", ylim=(min(80.0, 100 * bounds[-1].low - 2), 101))


def _draw_times(axes: Axes, values: np.ndarray, label: str) -> None:
    from kr5_tools.pages.plot_style import BLUE, GREY

    axes.hist(values, bins=min(20, max(5, len(values) // 2)), color=BLUE)
    axes.axvline(float(values.mean()), color=GREY, linewidth=1)
    axes.set(xlabel=label, ylabel="scans", title=f"mean {values.mean():.0f}, SD {values.std():.0f}")


def comparison_table(data: ResultData) -> dict[str, Any]:
    """Table 2.3 with this run."""
    attempts = sum(b["attempts"] for b in data["bins"])
    picked = sum(b["picked"] for b in data["bins"])
    found = sum(b["found"] for b in data["bins"])
    time = 1e3 * sum(sum(b["vision_seconds"]) for b in data["bins"]) / max(1, found)
    rows = [[name, f"{ms}", f"{share}", "real cell, as printed"] for name, ms, share in BOOK]
    rate = f"{100 * picked / max(1, attempts):.1f}"
    rows.append(["this run", f"{time:.1f}", rate, f"simulated, {attempts} picks"])
    return {
        "title": "Methods of bin picking (Table 2.3)",
        "columns": ["method", "time for an object [ms]", "picks that succeeded [%]", "measured on"],
        "rows": rows,
        "texts": ["The other methods were measured on other objects, bins and computers."],
    }


def bins_table(data: ResultData) -> dict[str, Any]:
    """A row a bin."""
    rows = [
        [b["seed"], b["pellets"], b["attempts"], b["picked"], b["scans"], b["shakes"], b["left"], b["wall_touches"]]
        for b in data["bins"]
    ]
    columns = ["seed", "cylinders", "picks", "succeeded", "scans", "shakes", "left", "wall touches"]
    return {"title": "Each bin", "columns": columns, "rows": [[str(v) for v in row] for row in rows], "texts": []}


def write_page(data: ResultData, source: str, output: Path, png: Path | None) -> list[Path]:
    """The page of a result file; returns the files of its plots."""
    from kr5_tools.pages.tables_page import figures_table, write_tables_page

    tables = [figures_table(data["figures"]), bins_table(data), comparison_table(data)]
    parts = [{"title": "Bins emptied", "texts": [], "plots": run_plots(data), "tables": tables}]
    return write_tables_page(data, "Bins emptied", "kr5 report", source, parts, output, png)
