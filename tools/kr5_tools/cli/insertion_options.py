"""Options of commands that simulate insertions."""

from pathlib import Path
from typing import Annotated

import typer

Cell = Annotated[
    Path | None,
    typer.Option(
        "--cell",
        metavar="CELL.yaml",
        show_default=False,
        help="The cell; by default the KR5 Arc that kr5 ships (share/cells/kr5_arc.yaml).",
    ),
]
