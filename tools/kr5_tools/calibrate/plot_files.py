"""The plots of a result as files, for `--png` of the command that makes it."""

from pathlib import Path
from typing import Any, cast

from kr5.files.result_types import ResultData


def write_plots(data: dict[str, Any], folder: Path | None) -> list[Path]:
    """Writes every plot that the result has the data for, as `kr5 report --png` does, where a folder is wanted; returns
    the files."""
    if folder is None:
        return []
    from kr5_tools.calibrate.plots import plots_of
    from kr5_tools.pages.rendering import write_drawn

    return write_drawn(lambda: plots_of(cast(ResultData, data)), folder)
