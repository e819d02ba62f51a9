"""The page of a plan (`kr5-gap-plan/1`): the alternatives, and the experiments that distinguish them."""

from pathlib import Path
from typing import Any, cast

from kr5.files.result_types import ResultData

from kr5_tools.cli.numbers import format_percent
from kr5_tools.pages.tables_page import write_tables_page

MOST_COLUMNS = 4  # of those that change, in the table


def write_page(data: dict[str, Any], source: str, output: Path, png: Path | None) -> list[Path]:
    """Writes the page; a plan has no plots."""
    texts = [f"{k}. {text}" for k, text in enumerate(alternative_texts(data["alternatives"]), 1)]
    if weighed := data.get("probability"):
        texts = [f"{text}: {format_percent(p)} probable" for text, p in zip(texts, weighed)]
    text = data["text"] or "No effects are tied: the diagnosis identifies each cause."
    parts: list[dict[str, Any]] = [
        {"title": "", "texts": [f"{text[:1].upper()}{text[1:]}."], "plots": [], "tables": []},
        {"title": "Alternatives", "texts": texts, "plots": [], "tables": []},
    ]
    if data["experiments"]:
        tables = [experiments_table(data["experiments"])]
        parts.append({"title": "Experiments, the best first", "texts": [], "plots": [], "tables": tables})
    return write_tables_page(cast(ResultData, data), "Next experiment", "kr5 gap plan", source, parts, output, png)


def alternative_texts(alternatives: list[list[dict[str, str]]]) -> list[str]:
    """Each alternative in words: effects that act together are joined."""
    from kr5.gap import effect_text

    from kr5_tools.gap_report.messages import join_list

    return [join_list([effect_text(e["effect"], e["target"]) for e in together]) for together in alternatives]


def experiments_table(experiments: list[dict[str, Any]]) -> dict[str, Any]:
    rows = [
        [
            e["what"],
            f"{e['seconds']:.0f}",
            str(e["repeats"]),
            f"{e['separation_repeated']:.1f}",
            ", ".join(c["column"] for c in e["columns"][:MOST_COLUMNS]),
        ]
        for e in experiments
    ]
    columns = ["experiment", "time [s]", "repeats", "separation [standard deviations]", "columns that tell most"]
    return {"title": "", "columns": columns, "rows": rows, "texts": []}
