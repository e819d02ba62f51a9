"""Options of commands that take a recording or a log."""

from pathlib import Path
from typing import Annotated

import typer

SourceArgument = Annotated[
    Path, typer.Argument(metavar="RECORDING|LOG.csv", help="Folder of a recording, or a CSV with a header.")
]


ColumnsOption = Annotated[
    str | None,
    typer.Option(metavar="NAMES", help="Columns of a CSV, separated by commas; a minus before a name turns its sign."),
]


CellFileOption = Annotated[
    Path | None, typer.Option("--cell", metavar="CELL.yaml", help="Cell; by default that of the recording.")
]


WriteCellFileOption = Annotated[
    Path | None, typer.Option("--write-cell", metavar="OUT.yaml", help="Cell to write, with the result in it.")
]
