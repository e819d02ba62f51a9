"""Options of commands that take a recording or a log."""

from pathlib import Path
from typing import Annotated

import typer
from kr5.logs.log_file import LOG_FORMATS

SourceArgument = Annotated[
    Path,
    typer.Argument(
        metavar="RECORDING|LOG",
        help=f"Folder of a recording, or a log: {LOG_FORMATS}.",
    ),
]


CellFileOption = Annotated[
    Path | None, typer.Option("--cell", metavar="CELL.yaml", help="Cell; by default that of the recording.")
]


WriteCellFileOption = Annotated[
    Path | None, typer.Option("--write-cell", metavar="OUT.yaml", help="Cell to write, with the result in it.")
]
