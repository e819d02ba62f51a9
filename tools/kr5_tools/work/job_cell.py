"""The simulated cell of `kr5 run`: what is poured and how it differs from its model, and its state beside a journal."""

from dataclasses import dataclass
from pathlib import Path

import kr5
import kr5.cell
import kr5.sim

SPARE = 0.02  # [m] of a tube above the pellets that it shall hold


@dataclass(frozen=True)
class JobSetup:
    """What makes a simulated job: the same setup gives the same job."""

    pellets: int
    seed: int
    errors: str  # nominal | usual

    def job_id(self, cell: kr5.cell.Cell) -> str:
        """By which a journal knows whether it belongs to this job."""
        return f"{cell.name or 'cell'}, {self.pellets} pellets, seed {self.seed}, {self.errors} errors"


def make_cell(cell: kr5.cell.Cell, setup: JobSetup) -> kr5.sim.WorkCell:
    """The work cell of a job."""
    return kr5.sim.WorkCell(cell, work_cell_options(cell, setup))


def work_cell_options(cell: kr5.cell.Cell, setup: JobSetup) -> kr5.sim.WorkCellOptions:
    """Its options, with a tube that holds all pellets: the cell's own where that is deep enough."""
    pour = kr5.sim.PourOptions(pellets=setup.pellets, seed=setup.seed)
    options = kr5.sim.WorkCellOptions(pour=pour, seed=setup.seed)
    if setup.errors == "nominal":
        options.errors = exact_errors()
    needed = setup.pellets * pour.height_max + SPARE
    if cell.tube is not None and cell.tube.depth < needed:
        options.tube_depth = needed
    return options


def exact_errors() -> kr5.sim.WorkCellErrors:
    """A cell that is as its controller is told, but for the noise of its sensors."""
    errors = kr5.sim.WorkCellErrors()
    return kr5.sim.WorkCellErrors.from_dict(
        {name: [0.0, 0.0] if name == "tube_offset" else 0.0 for name in errors.to_dict()}
    )


def state_file(journal: Path) -> Path:
    """Where the state of the simulated cell stands beside its journal: a real cell would be as it was left."""
    return journal.with_name(journal.name + ".cell")


def restore_cell(cell: kr5.sim.WorkCell, journal: Path) -> None:
    """The cell as the job left it."""
    file = state_file(journal)
    if not file.is_file():
        raise kr5.FileError(
            file,
            "the state of the simulated cell is missing, without which its job cannot go on",
            remedy=f"remove {journal}, and begin the job anew",
        )
    cell.restore(kr5.sim.WorkCellState.load(file))
