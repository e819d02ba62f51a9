"""Options of commands that take a recording or a log."""

from pathlib import Path
from typing import Annotated

import typer

SourceArgument = Annotated[
    Path,
    typer.Argument(
        metavar="RECORDING|LOG",
        help="Folder of a recording, or a log: CSV with any separator, NPZ, Parquet, HDF5, MCAP, a ROS bag, …",
    ),
]


CellFileOption = Annotated[
    Path | None, typer.Option("--cell", metavar="CELL.yaml", help="Cell; by default that of the recording.")
]


WriteCellFileOption = Annotated[
    Path | None, typer.Option("--write-cell", metavar="OUT.yaml", help="Cell to write, with the result in it.")
]
