"""Arguments that many commands share."""

from pathlib import Path
from typing import Annotated, Any

import typer

JsonOption = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", help="JSON file to write; - for standard output.")
]


ResultOption = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="RESULT.json", help="Result file to write.")
]


PngOption = Annotated[Path | None, typer.Option("--png", metavar="DIR", help="Folder for the plots as PNG files.")]


AllOption = Annotated[bool, typer.Option("--all", help="List everything, not only what matters most.")]


FullOption = Annotated[
    bool,
    typer.Option(
        "--full",
        help="Full simulation: steps the cell through time in DART instead of the closed-form computation; slower.",
    ),
]


def make_simulator(full: bool) -> Any:
    """The simulator of a grade; what is linked with DART is imported only when it is asked for."""
    if full:
        import kr5.sim

        return kr5.sim.DartSimulator()
    import kr5.predict

    return kr5.predict.FastSimulator()


EveryOption = Annotated[
    float | None, typer.Option("--every", metavar="SECONDS", help=r"Interval of the rows of a log without time \[s].")
]


Target = Annotated[
    str,
    typer.Option(
        "--target",
        "--board",
        metavar="TARGET",
        help=(
            "Short form, e.g. chessboard:6x9:0.025 (inner corners, rows first; lengths in"
            " m), or a file. --board is the same."
        ),
    ),
]
