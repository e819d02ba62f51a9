"""What `kr5 insert` and `kr5 sweep insertion` share: the cell, the task in the units of the command line, where the
tube is."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import kr5
import kr5.cell
from kr5.files.paths import SHIPPED_CELL, find_shipped_cell

if TYPE_CHECKING:
    import kr5.sim


def cell_file(given: Path | None) -> Path:
    """The file given, or the shipped cell."""
    if given:
        return given
    found = find_shipped_cell()
    if found is None:
        raise kr5.InvalidArgument(
            f"--cell: is missing, and there is no {SHIPPED_CELL} here; specify a cell with"
            " peg, tube, tool, contact and servo"
        )
    return found


def load_cell(given: Path | None) -> tuple[Any, Path]:
    """The cell and its file; complains of one without peg or tube."""
    file = cell_file(given)
    cell = kr5.cell.load_cell(file)
    for part in ("peg", "tube"):
        if getattr(cell, part) is None:
            raise kr5.FileError(file, f"{part}: is missing; an insertion needs it, as in {SHIPPED_CELL}")
    return cell, file


def offset_in_disc(radius: float, seed: int) -> list[float]:
    """Where the tube's axis really is [m]: uniform in a disc about the believed place, the same for the same seed
    everywhere."""
    import numpy as np

    share, turn = np.random.Generator(np.random.PCG64(seed)).random(2)
    r, angle = radius * np.sqrt(share), 2 * np.pi * turn
    return [float(r * np.cos(angle)), float(r * np.sin(angle))]


def check_task(clearance: float | None, tilt: float | None) -> None:
    """Complains of a clearance [mm] or a tilt [deg] with which nothing can be inserted."""
    if clearance is not None and not 0 < clearance < math.inf:
        raise kr5.InvalidArgument(f"clearance: found {clearance:g}, expected more than 0 mm")
    if tilt is not None and not 0 < tilt < 90:
        raise kr5.InvalidArgument(f"tilt: found {tilt:g}, expected more than 0 and less than 90 degrees")


def set_task(
    setup: "kr5.sim.InsertionSetup",
    clearance: float,
    tilt: float,
    offset: tuple[float, float] | None,
    cell: kr5.cell.Cell,
) -> None:
    """Sets a clearance [mm], a tilt [deg] and an offset [mm], which without one is drawn from the seed of the setup."""
    check_task(clearance, tilt)
    setup.clearance, setup.tilt = 1e-3 * clearance, math.radians(tilt)
    setup.offset = [1e-3 * x for x in offset] if offset else offset_in_disc(cell.peg.radius, setup.seed)
    setup.validate()
