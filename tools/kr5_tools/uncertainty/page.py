"""The page of a result of `kr5 uncertainty`."""

from pathlib import Path

from kr5.files.result_types import ResultData

from kr5_tools.pages.tables_page import write_tables_page


def write_page(data: ResultData, source: str, output: Path, png: Path | None) -> list[Path]:
    """Writes the page and, where they are wanted, the plots; returns the files of these."""
    from kr5_tools.uncertainty.plots import part_plots

    parts = [{**part, "plots": part_plots(part)} for part in data["parts"]]
    return write_tables_page(data, "Uncertainty", "kr5 uncertainty", source, parts, output, png)
