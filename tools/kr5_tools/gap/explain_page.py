"""The page of an explanation (`kr5-gap-explanation/1`): a verdict with its causes, or an effect on its targets, each
with what the recording says for it and against it."""

from pathlib import Path
from typing import Any, cast

from kr5.files.result_types import ResultData
from kr5.gap import column_text
from kr5.logs.compared_source import name_of

from kr5_tools.cli.numbers import NONE
from kr5_tools.gap.explained_targets import TARGET_COLUMNS, target_rows
from kr5_tools.gap_report.messages import capitalised
from kr5_tools.pages.tables_page import write_tables_page

REASONS = (("For it", "for"), ("Against it", "against"), ("Other effects in its place", "rivals"))


def write_page(data: dict[str, Any], source: str, output: Path, png: Path | None) -> list[Path]:
    """Writes the page; an explanation has no plots."""
    if data.get("effect"):
        title, parts, shown = capitalised(data["name"]), effect_parts(data), data
    else:
        from kr5_tools.gap_report.page import LOOK

        word, icon, label = LOOK[data["verdict"]]
        title, parts = "The verdict explained", verdict_parts(data)
        shown = {**data, "verdict": {"word": word, "icon": icon, "label": label, "text": data["text"]}}
    return write_tables_page(
        cast(ResultData, shown), title, "kr5 gap explain", _origin(data, source), parts, output, png
    )


def _origin(data: dict[str, Any], source: str) -> str:
    """The file, and what was diagnosed."""
    inputs = data.get("input", {})
    return f"{source}, of {'the log' if 'logs' in inputs else 'the recording'} {name_of(inputs)}" if inputs else source


def verdict_parts(data: dict[str, Any]) -> list[dict[str, Any]]:
    """Next steps, each cause, and the notes on the recording."""
    parts = [page_part("Next steps", lists=[("", data["next"])])]
    for cause in data["causes"]:
        shows = f" Shows in {cause['shows']}." if cause["shows"] else ""
        texts = [f"{cause['what']}.{shows}", *([f"What to do: {cause['remedy']}"] if cause["remedy"] else [])]
        tables = parameter_tables(cause["parameters"])
        parts.append(page_part(f"{cause['name']}, {cause['sure']} probable", texts, tables, reason_lists(cause)))
    if data["notes"]:
        parts.append(page_part("Notes on the recording", lists=[("", data["notes"])]))
    return parts


def effect_parts(data: dict[str, Any]) -> list[dict[str, Any]]:
    """What the effect is, all of its targets, and each of them."""
    shows = f" Shows in {data['shows']}." if data["shows"] else ""
    texts = [
        f"{capitalised(data['what'])}.{shows}",
        *([f"What to do if it is the cause: {data['remedy']}"] if data["remedy"] else []),
    ]
    rows = [[p["name"], p["unit"], p["what"]] for p in data["parameters"]]
    parts = [page_part("", texts, [make_table("Parameters", ["parameter", "unit", "meaning"], rows)])]
    if len(data["targets"]) > 1:
        table = make_table("", TARGET_COLUMNS, target_rows(data["targets"]))
        parts.append(page_part("Each target, fitted alone", tables=[table]))
    for target in data["targets"]:
        choice = f" ({target['choice']})" if target.get("choice") else ""
        tables = parameter_tables(target["parameters"]) + column_tables(target.get("columns", []))
        parts.append(page_part(capitalised(target["name"]) + choice, [], tables, reason_lists(target)))
    return parts


def reason_lists(told: dict[str, Any]) -> list[tuple[str, list[str]]]:
    return [(title, told[key]) for title, key in REASONS if told.get(key)]


def parameter_tables(parameters: list[dict[str, str]]) -> list[dict[str, Any]]:
    """The values with their uncertainty; the value of the cell where it has any."""
    if not parameters:
        return []
    rows = [[p["name"], p["value"], p["std"] or NONE, p["unit"], p["nominal"] or NONE] for p in parameters]
    columns = ["parameter", "value", "± std", "unit", "in the cell"]
    shown = len(columns) if any(p["nominal"] for p in parameters) else len(columns) - 1
    return [make_table("Values", columns[:shown], [row[:shown] for row in rows])]


def column_tables(columns: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The gap of every column that the effect changes, the widest first."""
    if not columns:
        return []
    rows = [
        [capitalised(column_text(c["column"])), *(NONE if c[k] is None else f"{c[k]:.2f}" for k in ("before", "after"))]
        for c in sorted(columns, key=lambda c: -(c["before"] or 0.0))
    ]
    table = make_table("Gaps of the columns that it changes", ["column", "without it [-]", "with it [-]"], rows)
    return [{**table, "folded": True}]


def make_table(title: str, columns: list[str], rows: list[list[str]]) -> dict[str, Any]:
    return {"title": title, "columns": columns, "rows": rows, "texts": []}


def page_part(
    title: str,
    texts: list[str] | None = None,
    tables: list[dict[str, Any]] | None = None,
    lists: list[tuple[str, list[str]]] | None = None,
) -> dict[str, Any]:
    return {
        "title": title,
        "texts": texts or [],
        "plots": [],
        "tables": tables or [],
        "lists": [{"title": heading, "items": items} for heading, items in lists or []],
    }
