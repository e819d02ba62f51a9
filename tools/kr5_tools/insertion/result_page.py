"""The page of the result of an insertion (`kr5-insertion/1`), which holds no motion: outcome, phases, profile."""

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from kr5.files.result_types import ResultData, VerdictData

from kr5_tools.insertion import directions, ending_tables, messages
from kr5_tools.pages.tables_page import write_tables_page


def write_page(data: ResultData, source: str, output: Path, png: Path | None) -> list[Path]:
    """Writes the page and, where they are wanted, the plots; returns the files of these."""
    from kr5_tools.calibrate.plots import Plot
    from kr5_tools.insertion.plots import CATALOGUE, draw_profile
    from kr5_tools.pages.plot_style import STYLE, plt

    plots = []
    if data["profile"]:
        name, title, _, wide, text = CATALOGUE[0]
        profile = {column: np.array(values, float) for column, values in data["profile"].items()}
        with plt.rc_context(STYLE):
            plots.append(Plot(name, title, text, draw_profile(profile), wide))
    endings = [messages.ending_sentence(k, SimpleNamespace(**peg)) for k, peg in enumerate(data["pegs"], 1)]
    verdict: VerdictData = {
        "word": "good" if data["inserted"] else "unusable",
        "label": "Inserted" if data["inserted"] else "Not inserted",
        "text": " ".join(endings),
    }
    tables = [
        _table("Phases", ending_tables.PHASE_COLUMNS, ending_tables.rows_of_phases(data["phases"]), []),
        _table(
            "Result",
            ending_tables.PEG_COLUMNS,
            ending_tables.rows_of_pegs(data["pegs"], data["T_tube_actual"]),
            [ending_tables.PEG_TEXT],
        ),
    ]
    if rows := directions.direction_rows(data["directions"]):
        title = "Direction of the hole by the last turn"
        tables.insert(1, _table(title, directions.COLUMNS, rows, [directions.TEXT]))
    text = "The result holds no motion; `kr5 insert -o PAGE.html` writes the page with the motion."
    parts = [{"title": "", "texts": [text], "plots": plots, "tables": tables}]
    page: ResultData = {**data, "verdict": verdict}
    return write_tables_page(page, "Insertion", "kr5 insert", source, parts, output, png)


def _table(title: str, columns: list[str], rows: Sequence[Sequence[object]], texts: list[str]) -> dict[str, Any]:
    return {"title": title, "columns": columns, "rows": [[str(v) for v in row] for row in rows], "texts": texts}
