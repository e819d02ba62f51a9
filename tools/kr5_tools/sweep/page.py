"""The page of a sweep of insertions (`kr5-sweep/1`): rates and times by tilt and clearance."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kr5.files import writing
from kr5.files.result_types import ResultData

from kr5_tools.cli import terminal
from kr5_tools.sweep.trials import Grid


def write_page(data: ResultData, source: Path, output: Path, png: Path | None) -> list[Path]:
    """Writes the page of a sweep.json and the trials.csv beside it; returns the files of the plots."""
    from kr5_tools.sweep import rate_table, sweep_file

    grid = Grid(
        tilts=tuple(data["tilts"]),
        clearances=tuple(data["clearances"]),
        orientations=tuple(data["orientations"]),
        strategies=tuple(data["strategies"]),
        insert_by=data["insert_by"],
        seed=data["seed"],
    )
    trials = sweep_file.read_trials(source.parent / "trials.csv", grid)
    return write_sweep_page(rate_table.rate_tables(trials, grid), grid, source.name, output, png)


def table_title(table: Mapping[str, object]) -> str:
    return f"Tube {'standing' if table['orientation'] == 'vertical' else 'lying'}, strategy {table['strategy']}"


def write_sweep_page(
    rate_tables: list[dict[str, Any]], grid: Grid, source: str, page: Path, png: Path | None
) -> list[Path]:
    """Writes the page, and the plots where they are wanted; returns the files of these."""
    import kr5

    from kr5_tools.pages.plot_style import plt
    from kr5_tools.pages.rendering import embed_plot, render_page, write_png
    from kr5_tools.sweep import plots, rate_table

    with terminal.spinner("drawing"):
        drawn = plots.sweep_plots(rate_tables, grid)
        files = write_png(drawn, png) if png else []
        shown = [
            {"title": table_title(t), "rows": rate_table.display_rows(t), "words": rate_table.table_texts(t)}
            for t in rate_tables
        ]
        html = render_page(
            "sweep.html",
            title="Sweep of insertions",
            brand="kr5 sweep insertion",
            version=kr5.__version__,
            source=source,
            tables=shown,
            text=f"Seed {grid.seed}, pushed in by {grid.insert_by}",
            columns=rate_table.COLUMNS,
            plots=[embed_plot(p) for p in drawn],
        )
        writing.write_text(html, page)
    for plot in drawn:
        plt.close(plot.figure)
    return files
