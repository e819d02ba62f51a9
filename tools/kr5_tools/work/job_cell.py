"""The simulated cell of `kr5 run`: what is poured and how it differs from its model, and its state beside a journal."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import kr5
import kr5.cell
import kr5.sim
import kr5.work

from kr5_tools.insertion.task import check_task

SPARE = 0.02  # [m] of a tube above the pellets that it shall hold


@dataclass(frozen=True)
class JobSetup:
    """What makes a simulated job: the same setup gives the same job."""

    pellets: int
    seed: int
    errors: str  # nominal | usual | severe
    clearance: float = kr5.sim.WorkCellOptions().clearance  # [m]
    tilt: float = kr5.sim.InsertionSetup().tilt  # of a pellet while it is rolled around the tube [rad]

    def job_id(self, cell: kr5.cell.Cell) -> str:
        """By which a journal knows whether it belongs to this job; what is usual is not said."""
        text = f"{cell.name or 'cell'}, {self.pellets} pellets, seed {self.seed}, {self.errors} errors"
        if self.clearance != JobSetup.clearance:
            text += f", clearance {1e3 * self.clearance:g} mm"
        return text if self.tilt == JobSetup.tilt else f"{text}, tilt {math.degrees(self.tilt):g} degrees"


def make_setup(pellets: int, seed: int, errors: str, clearance: float | None, tilt: float | None) -> JobSetup:
    """With a clearance [mm] and a tilt [deg], as people give them; None: the usual ones."""
    check_task(clearance, tilt)
    setup = JobSetup(pellets, seed, errors)
    if clearance is not None:
        setup = replace(setup, clearance=1e-3 * clearance)
    return setup if tilt is None else replace(setup, tilt=math.radians(tilt))


def make_cell(cell: kr5.cell.Cell, setup: JobSetup) -> kr5.sim.WorkCell:
    """The work cell of a job."""
    return kr5.sim.WorkCell(cell, work_cell_options(cell, setup))


def work_cell_options(cell: kr5.cell.Cell, setup: JobSetup) -> kr5.sim.WorkCellOptions:
    """Its options, with a tube that holds all pellets: the cell's own where that is deep enough."""
    pour = kr5.sim.PourOptions(pellets=setup.pellets, seed=setup.seed)
    options = kr5.sim.WorkCellOptions(pour=pour, seed=setup.seed, clearance=setup.clearance)
    if setup.errors == "nominal":
        options.errors = exact_errors()
    if setup.errors == "severe":
        options.errors = kr5.sim.severe_errors()
    needed = setup.pellets * pour.height_max + SPARE
    if cell.tube is not None and cell.tube.depth < needed:
        options.tube_depth = needed
    return options


def work_options(cell: kr5.sim.WorkCell, setup: JobSetup) -> kr5.work.WorkOptions:
    """Options of the job in that cell."""
    options = kr5.work.work_options(cell)
    options.job.pellets = setup.pellets
    options.job.insertion.tilt = setup.tilt
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


def kept_cell(journal: Path | None) -> str:
    """The file to which a job writes the state of its cell before each record; empty where nothing is kept."""
    return "" if journal is None else str(state_file(journal))


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
