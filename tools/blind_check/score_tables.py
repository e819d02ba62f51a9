"""Tables and pictures of a score."""

import csv
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .cell_score import CellScore
from .score import confusion

# What is shown, the key of its figure, and what is to be reached.
ROWS = (
    ("one effect of size >= 1.5: it and its target named first", "single_named_first", ">= 95 %"),
    ("one effect: it is named, and nothing else beside it", "single_named_alone", ""),
    ("two effects of size >= 1.5: both named", "pair_both_named", ">= 85 %"),
    ("two effects: both named, and nothing else beside them", "pair_both_named_alone", ""),
    ("two effects: at least one named", "pair_one_named", ""),
    ("several effects of size >= 1.5: all named", "several_all_named", ""),
    ("several effects: each of them named", "several_effects_named", ""),
    ("effects of the catalogue: something else blamed beside", "false_cause_beside", ""),
    ("healthy cell called healthy", "healthy_called_healthy", ">= 98 %"),
    ("effect outside the catalogue called explained", "unknown_called_explained", "<= 3 %"),
    ("effect outside: explained, or a cause told with >= 90 %", "unknown_wrongly_sure", ""),
    ("effect outside called no gap", "unknown_called_no_gap", ""),
    ("small errors of all masses, constants, frictions: named", "scatter_named", ">= 85 %"),
    ("small errors alone: something blamed", "scattered_healthy_blamed", ""),
    ("parameters: truth within 2 sigma", "parameter_within_2_sigma", ">= 90 %"),
    ("diagnosis failed", "failed", "0"),
)


def format_percent(r: dict) -> str:
    if r["rate"] is None:
        return "-"
    return f"{100 * r['rate']:.0f} % [{100 * r['low']:.0f}, {100 * r['high']:.0f}] ({r['hits']}/{r['of']})"


def format_number(x, form: str = "{:.2f}") -> str:
    return "-" if x is None else form.format(x)


def format_limit(s: dict, key: str) -> str:
    """A size of the detection curve; when all were named, below the least of them."""
    found = s["detection_limit"]
    return f"< {found['all_from']:.2f}: all" if found["all_from"] else format_number(found[key])


def further_rows() -> list[tuple]:
    """Figures that are no share: what, function of a score, what is to be reached."""
    out = [
        (f"recording with {c}: named", lambda s, c=c: format_percent(s["conditions"][c]), "")
        for c in ("noise", "clock", "missing", "outliers")
    ]
    return [
        *out,
        (
            "calibration error of the probabilities",
            lambda s: format_number(s["reliability"]["error"], "{:.3f}"),
            "<= 0.05",
        ),
        (
            "parameters: median relative error",
            lambda s: format_number(s["parameter_relative_error_median"], "{:.3f}"),
            "",
        ),
        (
            "excess closed on a fresh recording, median",
            lambda s: format_number(s["excess_closed"]["median"], "{:.3f}"),
            ">= 0.97",
        ),
        ("size of which half are named", lambda s: format_limit(s, "half"), ""),
        ("size of which nine in ten are named", lambda s: format_limit(s, "nine_in_ten"), ""),
        ("size of which half are named, median over effects", lambda s: format_limit(s, "half_median"), "<= 0.5"),
        ("smallest size named, median over effects", lambda s: format_number(s["smallest_named_median"]), ""),
        ("ties told with a right first cause, mean", lambda s: format_number(s["ties_of_first_cause"]), ""),
        ("time, median [s]", lambda s: format_number(s["seconds"]["median"], "{:.1f}"), ""),
        ("time, longest [s]", lambda s: format_number(s["seconds"]["longest"], "{:.1f}"), "<= 60"),
        ("processor time, median [s]", lambda s: format_number(s["cpu_median"], "{:.1f}"), ""),
        ("memory, most [MiB]", lambda s: format_number(s["memory"] and s["memory"] / 2**20, "{:.0f}"), "<= 1024"),
    ]


def print_tables(scores: dict[str, dict], console: Console) -> None:
    """One column a method; shares with their exact 95 % interval."""
    table = Table("what", *scores, "to reach", title="Blind check: shares [95 % interval] (hits/of)")
    for what, key, reach in ROWS:
        table.add_row(what, *(format_percent(s[key]) for s in scores.values()), reach)
    for what, value, reach in further_rows():
        table.add_row(escape(what), *(escape(value(s)) for s in scores.values()), reach)
    console.print(table)
    sizes = Table("size [noise]", *scores, title="One effect named first, by the largest RMS it adds to a column")
    first = next(iter(scores.values()))
    for k, row in enumerate(first["single_by_size"]):
        sizes.add_row(
            f"{row['from']:g} to {row['to']:g}", *(format_percent(s["single_by_size"][k]) for s in scores.values())
        )
    console.print(sizes)


def _axes(width: float, height: float):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    return plt.subplots(figsize=(width, height), layout="constrained")


def draw_confusion(cells: list[CellScore], file: Path) -> None:
    truths, named, table = confusion(cells)
    figure, axes = _axes(3 + 0.24 * len(named), 2.2 + 0.22 * len(truths))
    share = table / np.maximum(table.sum(1, keepdims=True), 1)
    picture = axes.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for i, j in np.argwhere(table):
        axes.text(
            j, i, table[i, j], ha="center", va="center", fontsize=6, color="white" if share[i, j] > 0.6 else "black"
        )
    axes.set_xticks(range(len(named)), [n.replace("_", " ") for n in named], rotation=90, fontsize=7)
    axes.set_yticks(range(len(truths)), [n.replace("_", " ") for n in truths], fontsize=7)
    axes.set(xlabel="named first (right target, or told as a tie)", ylabel="in the cell")
    figure.colorbar(picture, label="share of the row", shrink=0.6)
    figure.savefig(file, dpi=140)


def draw_limit(scores: dict[str, dict], file: Path) -> None:
    """Share named first by size, with its interval."""
    figure, axes = _axes(6.4, 4.2)
    for k, (name, s) in enumerate(scores.items()):
        rows = [r for r in s["single_by_size"] if r["of"]]
        x = np.array([np.sqrt(max(r["from"], 0.02) * min(r["to"], 30.0)) for r in rows]) * 1.03**k
        y, low, high = (np.array([r[key] for r in rows]) for key in ("rate", "low", "high"))
        axes.errorbar(
            x, 100 * y, [100 * (y - low), 100 * (high - y)], marker="o", capsize=2, lw=1.8 if k == 0 else 1, label=name
        )
    axes.axvline(1.5, color="0.6", ls=":")
    axes.set(
        xscale="log",
        ylim=(-3, 103),
        xlabel="largest RMS the effect adds to a column [noise]",
        ylabel="effect and target named first [%]",
    )
    axes.set_xticks([0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10, 20], ["0.05", "0.1", "0.25", "0.5", "1", "2", "5", "10", "20"])
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    figure.savefig(file, dpi=140)


def draw_reliability(scores: dict[str, dict], file: Path) -> None:
    figure, axes = _axes(4.8, 4.6)
    axes.plot([0, 1], [0, 1], color="0.6", ls=":")
    for name, s in scores.items():
        rows = s["reliability"]["bins"]
        if rows:
            x, y = np.array([r["told"] for r in rows]), np.array([r["rate"] for r in rows])
            bars = [y - [r["low"] for r in rows], [r["high"] for r in rows] - y]
            axes.errorbar(x, y, bars, marker="o", capsize=2, label=f"{name}: error {s['reliability']['error']:.3f}")
    axes.set(xlabel="probability told", ylabel="share that is right", xlim=(-0.02, 1.02), ylim=(-0.02, 1.02))
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    figure.savefig(file, dpi=140)


def draw_smallest(cells: list[CellScore], file: Path) -> None:
    """Every single effect by size: named or not."""
    single = [c for c in cells if c.sort == "single"]
    effects = sorted({c.label["effects"][0]["effect"] for c in single})
    figure, axes = _axes(6.6, 1.4 + 0.2 * max(len(effects), 3))
    for right, colour, text in ((True, "tab:blue", "named first"), (False, "tab:red", "not")):
        at = [c for c in single if c.first == right]
        axes.scatter(
            [max(c.largest, 0.01) for c in at],
            [effects.index(c.label["effects"][0]["effect"]) for c in at],
            c=colour,
            s=14,
            label=text,
        )
    axes.set_yticks(range(len(effects)), [e.replace("_", " ") for e in effects], fontsize=7)
    axes.set_ylim(-0.7, len(effects) - 0.3)
    axes.set(xscale="log", xlabel="largest RMS the effect adds to a column [noise]")
    axes.set_xticks(
        [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20], ["0.02", "0.05", "0.1", "0.2", "0.5", "1", "2", "5", "10", "20"]
    )
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="lower right")
    figure.savefig(file, dpi=140)


def write_cells(cells: list[CellScore], file: Path) -> None:
    """One line a cell: what it carries, and what was said."""
    with file.open("w", newline="") as out:
        table = csv.writer(out)
        table.writerow(["cell", "sort", "effects", "size", "verdict", "causes", "first right", "closed", "seconds"])
        for c in cells:
            effects = " + ".join(f"{e['effect']} {e['target']}" for e in c.label["effects"])
            causes = " ".join(f"{p:.2f}{'' if right else '!'}" for p, right in c.causes)
            table.writerow(
                [
                    c.name,
                    c.sort,
                    effects,
                    c.largest,
                    c.verdict,
                    f"{c.first_named}: {causes}",
                    int(c.first),
                    c.closed,
                    c.seconds,
                ]
            )


def draw_figures(scores: dict[str, dict], judged: dict[str, list[CellScore]], folder: Path) -> list[Path]:
    """Of the first method the confusion and every size, of all the curves."""
    folder.mkdir(parents=True, exist_ok=True)
    first = next(iter(scores))
    files = [folder / f"{n}.png" for n in ("confusion", "detection_limit", "reliability", "sizes")]
    draw_confusion(judged[first], files[0])
    draw_limit(scores, files[1])
    draw_reliability(scores, files[2])
    draw_smallest(judged[first], files[3])
    write_cells(judged[first], folder / "cells.csv")
    return [*files, folder / "cells.csv"]
