"""The option of commands that write a recording of Rerun."""

from pathlib import Path
from typing import Annotated

import typer

Rerun = Annotated[
    Path | None,
    typer.Option(
        "--rerun",
        metavar="FILE.rrd",
        help=(
            "Rerun recording to write: poses of the links, recorded and simulated signals, residuals. Needs pip"
            " install 'kr5\\[rerun]'."
        ),
    ),
]
