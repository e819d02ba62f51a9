"""One trial of a sweep: its key, its seed, its run. What a worker needs, and no more."""

import functools
import hashlib
import itertools
import math
from dataclasses import asdict, astuple, dataclass, fields
from typing import Any

import kr5.cell

ATTEMPTS = 3


@dataclass(frozen=True, order=True)
class Key:
    """Which trial it is."""

    orientation: str  # vertical | horizontal
    strategy: str
    tilt: float  # [deg]
    clearance: float  # [mm]
    number: int  # from 0


@dataclass(frozen=True)
class Grid:
    """What is swept, and the seed of all of it. The same grid gives the same trials, on any machine, in any order."""

    tilts: tuple[float, ...]  # [deg]
    clearances: tuple[float, ...]  # [mm]
    orientations: tuple[str, ...]
    strategies: tuple[str, ...]
    insert_by: str
    seed: int

    def keys(self, trials: int) -> list[Key]:
        """Every trial, number by number, so that a sweep that is broken off has seen the whole grid."""
        places = list(itertools.product(self.orientations, self.strategies, self.tilts, self.clearances))
        return [Key(*place, number) for number in range(trials) for place in places]


@dataclass(frozen=True)
class Trial(Key):
    """What came of it; a row of the file. Lengths in m, times in s, as the library gives them; tilt and clearance as
    typed."""

    seed: int
    offset_x: float  # [m]
    offset_y: float  # [m]
    inserted: int  # 0 | 1
    attempts: int
    phase: str
    reason: str
    time: float  # [s]
    depth: float  # [m]
    hole_error: float  # [m]
    max_force: float  # [N]

    @property
    def key(self) -> Key:
        return Key(*astuple(self)[:5])


COLUMNS = {
    "orientation": "orientation",
    "strategy": "strategy",
    "tilt": "tilt_deg",
    "clearance": "clearance_mm",
    "number": "trial",
}
HEADER = tuple(COLUMNS.get(f.name, f.name) for f in fields(Trial))


def seed_of(key: Key, seed: int) -> int:
    """Seed of a trial: the first 63 bits of BLAKE2b over a text of the sweep's seed and the key. It depends on nothing
    else."""
    text = f"kr5-sweep/1 {seed} {key.orientation} {key.strategy} {key.tilt:.9g} {key.clearance:.9g} {key.number}"
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "big") >> 1


def check_trial(trial: Trial, grid: Grid) -> None:
    """Raises ValueError unless it is a trial of this grid; its seed shows that its key is as it was written."""
    for name, allowed in (
        ("orientation", grid.orientations),
        ("strategy", grid.strategies),
        ("tilt", grid.tilts),
        ("clearance", grid.clearances),
        ("inserted", (0, 1)),
    ):
        if getattr(trial, name) not in allowed:
            raise ValueError(f"{name}: found {getattr(trial, name)!r}, expected one of {', '.join(map(str, allowed))}")
    if trial.number < 0 or trial.seed != seed_of(trial.key, grid.seed):
        raise ValueError(f"seed: found {trial.seed}, expected that of trial {trial.number} of this sweep")
    for name in (
        "offset_x",
        "offset_y",
        "time",
        "depth",
        "hole_error",
        "max_force",
    ):  # some are NaN where nothing was inserted
        if math.isinf(getattr(trial, name)):
            raise ValueError(f"{name}: found {getattr(trial, name)}, expected a finite number")
    if trial.inserted and not (trial.time >= 0 and trial.attempts >= 1):
        raise ValueError(f"time, attempts: found {trial.time:g} and {trial.attempts}, expected those of an insertion")


@functools.lru_cache(maxsize=2)
def _cell(text: str) -> Any:
    import kr5.cell

    return kr5.cell.parse_cell(text)


def make_setup(cell: kr5.cell.Cell, key: Key, insert_by: str, seed: int) -> Any:
    """The setup of a trial: what `kr5 insert --seed` makes of the seed of the trial."""
    import kr5.sim

    from kr5_tools.insertion.task import set_task

    setup = kr5.sim.InsertionSetup(
        strategy=key.strategy,
        insert_by=insert_by,
        horizontal=key.orientation == "horizontal",
        seed=seed_of(key, seed),
        log=False,
    )
    set_task(setup, key.clearance, key.tilt, None, cell)
    return setup


def run_trial(cell: kr5.cell.Cell, key: Key, insert_by: str, seed: int) -> Trial:
    import kr5.sim

    setup = make_setup(cell, key, insert_by, seed)
    peg = kr5.sim.run_insertion(cell, setup).pegs[0]
    x, y = (float(v) for v in setup.offset)
    return Trial(
        **asdict(key),
        seed=setup.seed,
        offset_x=x,
        offset_y=y,
        inserted=int(peg.inserted),
        attempts=peg.attempts,
        phase=str(peg.phase),
        reason=str(peg.reason),
        time=peg.time,
        depth=peg.depth,
        hole_error=peg.hole_error,
        max_force=peg.max_force,
    )


def run_batch(cell_text: str, keys: list[Key], insert_by: str, seed: int) -> tuple[str, list[Trial]]:
    """Trials one after the other, and the version of the library they were run with."""
    import kr5

    cell = _cell(cell_text)
    return kr5.__version__, [run_trial(cell, key, insert_by, seed) for key in keys]
