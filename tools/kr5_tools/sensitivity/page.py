"""Tables and page of a sensitivity analysis."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from kr5.files.result_types import ResultData

from kr5_tools.cli import tables
from kr5_tools.cli.terminal import Console
from kr5_tools.pages.tables_page import write_tables_page

LEAST_SHOWN = 0.005  # an index that two digits show


def output_heads(analysis: dict[str, Any]) -> list[str]:
    return [output["name"] for output in analysis["outputs"]]


def rows_by_weight(analysis: Mapping[str, object]) -> list[int]:
    """Inputs, the most important ones first."""
    weight = np.array(analysis["total"], float).max(axis=1)
    return [int(k) for k in np.argsort(-weight, kind="stable")]


def widest_interval(analysis: Mapping[str, object]) -> float:
    """Half of the widest interval of an index."""
    return max(
        float((np.array(analysis[f"{kind}_high"]) - np.array(analysis[f"{kind}_low"])).max()) / 2
        for kind in ("first", "total")
    )


def print_analysis(analysis: dict[str, Any], to: Console) -> None:
    """Total indices by input, of those that have any."""
    total = np.array(analysis["total"], float)
    shown = [k for k in rows_by_weight(analysis) if total[k].max() >= LEAST_SHOWN]
    rows = [
        [analysis["inputs"][k]["name"], *(f"{x:.3f}" if x >= LEAST_SHOWN / 10 else "·" for x in total[k])]
        for k in shown
    ]
    to.print(analysis["title"], soft_wrap=True, markup=False)
    to.print()
    to.print(tables.make_table("Total indices [-]", ["input", *output_heads(analysis)], rows))
    hidden = len(total) - len(shown)
    if hidden:
        to.print(f"{hidden} more inputs have indices below {LEAST_SHOWN:g}.", markup=False)
    for text in summary(analysis):
        to.print(text, soft_wrap=True, markup=False)
    to.print()


def summary(analysis: dict[str, Any]) -> list[str]:
    """What else is to be said of an analysis."""
    confidence = 100 * analysis["confidence"]
    out = [
        f"{analysis['samples']} rows, {analysis['evaluations']} evaluations; every {confidence:g} % interval is within"
        f" ± {widest_interval(analysis):.2g}"
        + ("." if analysis["converged"] else f", not within the ± {analysis['tolerance']:g} that were asked for.")
    ]
    return [*out, *analysis["notes"]]


def write_page(data: ResultData, source: str, output: Path, png: Path | None) -> list[Path]:
    """The page, and the plots where they are wanted."""
    from kr5_tools.sensitivity import plots

    parts, drawn = [], []
    for analysis in data["result"]["analyses"]:
        own = plots.analysis_plots(analysis)
        drawn += own
        parts.append(
            {
                "title": analysis["title"],
                "texts": [analysis["text"], *summary(analysis)],
                "plots": own,
                "tables": [spread_table(analysis), *index_tables(analysis), one_at_a_time_table(analysis)],
            }
        )
    return write_tables_page(data, "Sensitivity", "kr5 sensitivity", source, parts, output, png)


def spread_table(analysis: dict[str, Any]) -> dict[str, Any]:
    rows = []
    first = np.array(analysis["first"], float)
    for k, output in enumerate(analysis["outputs"]):
        factor = output["factor"]
        deviation = np.sqrt(analysis["variance"][k]) / factor
        rows.append(
            [
                output["name"],
                output["unit"],
                f"{analysis['mean'][k] / factor:.4g}",
                f"{deviation:.4g}",
                f"{first[:, k].sum():.3f}" if deviation else "–",
            ]
        )
    return {
        "title": "Outputs",
        "columns": ["output", "unit", "mean", "standard deviation", "sum of first-order indices [-]"],
        "rows": rows,
        "texts": ["What the sum lacks to 1 is made by inputs together (interactions)."],
    }


def index_tables(analysis: dict[str, Any]) -> list[dict[str, Any]]:
    out = []
    for kind, title in (("total", "Total indices"), ("first", "First-order indices")):
        value, low, high = (np.array(analysis[kind + end], float) for end in ("", "_low", "_high"))
        rows = [
            [
                analysis["inputs"][k]["name"],
                *(f"{value[k, o]:.4f} ± {(high[k, o] - low[k, o]) / 2:.4f}" for o in range(value.shape[1])),
            ]
            for k in rows_by_weight(analysis)
        ]
        out.append(
            {
                "title": f"{title} [-]",
                "columns": ["input", *output_heads(analysis)],
                "rows": rows,
                "texts": [f"± is half of the {100 * analysis['confidence']:g} % interval."],
            }
        )
    return out


def one_at_a_time_table(analysis: dict[str, Any]) -> dict[str, Any]:
    """The local view beside it: how far each input alone moves the outputs."""
    alone, rows = analysis["one_at_a_time"], []
    plus, minus, lowest, highest = (np.array(alone[k], float) for k in ("plus", "minus", "lowest", "highest"))
    factors = np.array([output["factor"] for output in analysis["outputs"]])
    for k, entry in enumerate(analysis["inputs"]):
        step = (np.abs(plus[k]) + np.abs(minus[k])) / 2 / factors
        span = (highest[k] - lowest[k]) / factors
        rows.append([entry["name"], *(f"{s:.3g} ({r:.3g})" for s, r in zip(step, span))])
    heads = [f"{o['name']} [{o['unit']}]" for o in analysis["outputs"]]
    return {
        "title": "One at a time",
        "columns": ["input", *heads],
        "rows": rows,
        "texts": [
            "Change of the output with one input off by one standard deviation, the others at their medians; in"
            " brackets the range of the output over the whole range of the input."
        ],
    }
