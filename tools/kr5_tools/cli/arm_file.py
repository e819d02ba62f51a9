"""The file of an arm that a command takes: a cell, or the model of a robot with the ends of its chain."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from kr5_tools.cli.terminal import print_note

BaseOption = Annotated[
    str, typer.Option("--base", metavar="LINK", help="Link of the model that is the base; by default its root.")
]
TipOption = Annotated[
    str, typer.Option("--tip", metavar="LINK", help="Link of the model that is the tool; by default its only end.")
]


@dataclass(frozen=True)
class ArmFile:
    """A cell, URDF or MJCF, which the content tells, and the links between which its arm lies."""

    file: Path
    base: str = ""
    tip: str = ""

    def cell(self) -> Any:
        """The cell with the arm; what it cannot hold, or what was assumed, is printed."""
        from kr5.models import read_model

        model = read_model(self.file, self.base, self.tip)
        for note in model.notes:
            print_note(f"{self.file}: {note}.")
        return model.cell


def arm_file(file: Path | None, base: str, tip: str) -> ArmFile | None:
    return ArmFile(file, base, tip) if file else None
