"""Insertions into a cell that differs from the one the controller is told.

    python tools/benchmarks/insertion_mismatch.py [--trials 600] [--first-seed 710001]

Differences that are drawn anew in each trial, each alone and all together, of which the controller knows nothing; what
no insertion can succeed in must end with a reason, and never with more force than allowed; contact, servo, friction and
limits as before. Rates with exact 95 % intervals. To show 99 %, 368 trials must succeed, or 554 of 555."""

import dataclasses
import functools
import math
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import kr5.cell
import kr5.sim
import numpy as np

import arguments
import comparison
from kr5_tools.insertion.task import offset_in_disc
from kr5_tools.sweep.rate_table import success_rate
from mismatched_cells import DIFFERENCES, HOPELESS, MM, Difference

CELL = Path(__file__).resolve().parents[2] / "share/cells/kr5_arc.yaml"
CLEARANCE, CLOSE = 0.28 * MM, 0.05 * MM
FIRST, WITHIN, ATTEMPTS = 0.97, 0.99, 3
WANTED = 0.95
SPACING = 10_000  # of the seeds of two rates, so that all trials are independent

Told = Callable[[kr5.cell.Cell, np.random.Generator], None]


@dataclasses.dataclass
class Condition:
    """A change of the cell, drawn with a seed, and settings of the insertion; its controller is told what is no
    effect."""

    what: str
    setup: dict[str, Any]
    change: Told = lambda cell, rng: None
    first_seed: int = 0


@dataclasses.dataclass
class Outcome:
    """How an insertion ended, by the truth of the simulator."""

    attempts: int  # that it took; 0: not inserted
    told: bool  # whether one that is not inserted has a reason
    force: float  # greatest between grip and peg [N]
    limit: float  # [N]


def softer_contact(cell: kr5.cell.Cell, _: np.random.Generator) -> None:
    assert cell.contact is not None
    cell.set_effect("contact_stiffness", "contact", "stiffness", 0.5 * cell.contact.stiffness)


def limited_corrections(mode: str) -> Told:
    """1 to 20 mm in a cycle, behind a servo of 3 to 60 rad/s."""

    def change(cell: kr5.cell.Cell, rng: np.random.Generator) -> None:
        servo = cell.servo
        assert servo is not None and servo.tool is not None
        servo.correction = kr5.cell.Correction(mode=mode, per_cycle=MM * math.exp(rng.uniform(0, math.log(20))))
        tool = servo.tool
        tool.natural_frequency = math.exp(rng.uniform(math.log(3), math.log(60)))
        servo.tool = tool
        cell.servo = servo

    return change


CONDITIONS = [
    Condition("contact of half the believed stiffness, 0.05 mm", {"clearance": 0.05 * MM}, softer_contact, 9000),
    Condition(
        "absolute corrections limited, any servo, 0.1 mm",
        {"clearance": 0.1 * MM},
        limited_corrections("absolute"),
        5000,
    ),
    Condition(
        "relative corrections limited, any servo, 0.1 mm",
        {"clearance": 0.1 * MM},
        limited_corrections("relative"),
        5000,
    ),
    Condition("servo told with 10 % error, 0.28 mm", {"clearance": 0.28 * MM, "servo_error": 0.1}, first_seed=3000),
    Condition(
        "friction told with 30 % error, 0.28 mm", {"clearance": 0.28 * MM, "friction_error": 0.3}, first_seed=4000
    ),
]


def setup_of(cell: kr5.cell.Cell, seed: int, **settings: Any) -> kr5.sim.InsertionSetup:
    assert cell.peg is not None
    return kr5.sim.InsertionSetup(seed=seed, offset=offset_in_disc(cell.peg.radius, seed), log=False, **settings)


def insert(difference: Difference, clearance: float, seed: int) -> Outcome:
    """One insertion with the options for the cell that its controller is told of, in another one."""
    cell = kr5.cell.load_cell(CELL)
    setup = setup_of(cell, seed, clearance=clearance)
    options = kr5.sim.insertion_options(cell, setup)
    difference.draw(cell, setup, np.random.default_rng(seed))
    peg = kr5.sim.run_insertion(cell, setup, options).pegs[0]
    told = peg.reason != kr5.force.Reason.None_
    return Outcome(peg.attempts if peg.inserted else 0, told, peg.max_force, options.limits.force)


def first_attempt(condition: Condition, seed: int) -> bool:
    """Whether an insertion succeeds at once."""
    cell = kr5.cell.load_cell(CELL)
    condition.change(cell, np.random.default_rng(seed))
    result = kr5.sim.run_insertion(cell, setup_of(cell, seed, **condition.setup))
    return bool(result.inserted and result.pegs[0].attempts == 1)


def in_parallel(run: Callable[[int], Any], first_seed: int, trials: int) -> list[Any]:
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(run, range(first_seed, first_seed + trials)))


def rate_row(what: str, count: int, trials: int, wanted: float) -> comparison.Row:
    rate = success_rate(count, trials)
    return comparison.Row(
        what,
        f"{count} of {trials}",
        f"lower bound ≥ {100 * wanted:.0f} %",
        rate["low"] >= wanted,
        interval=f"[{100 * rate['low']:.1f}, {100 * rate['high']:.1f}] %",
    )


def force_row(what: str, ended: list[Outcome], judged: bool) -> comparison.Row:
    forces, limit = [o.force for o in ended], ended[0].limit
    text = f"{np.median(forces):.1f}, {max(forces):.1f} N"
    wanted = f"≤ {limit:g} N" if judged else f"– (the arm stops from {limit:g} N)"
    reached = not judged or max(forces) <= limit
    return comparison.Row(f"{what}: peak force, median and most", text, wanted, reached)


def difference_rows(difference: Difference, trials: int, first_seed: int) -> Iterator[comparison.Row]:
    """Rates and forces at the usual clearance, and the rate at the close one."""
    usual = in_parallel(functools.partial(insert, difference, CLEARANCE), first_seed, trials)
    close = in_parallel(functools.partial(insert, difference, CLOSE), first_seed + SPACING, trials)
    what = difference.what
    first, within = (sum(0 < o.attempts <= most for o in usual) for most in (1, ATTEMPTS))
    yield rate_row(f"{what}; 0.28 mm: in at the first attempt", first, trials, FIRST)
    yield rate_row(f"{what}; 0.28 mm: within {ATTEMPTS}", within, trials, WITHIN)
    yield rate_row(f"{what}; 0.05 mm: in at the first attempt", sum(o.attempts == 1 for o in close), trials, WANTED)
    yield force_row(what, usual + close, judged=False)


def hopeless_rows(difference: Difference, trials: int, first_seed: int) -> Iterator[comparison.Row]:
    """What cannot succeed, or hardly: that it ends with a reason."""
    ended = in_parallel(functools.partial(insert, difference, CLEARANCE), first_seed, trials)
    inserted, told = sum(o.attempts > 0 for o in ended), sum(o.attempts > 0 or o.told for o in ended)
    yield comparison.Row(
        f"{difference.what}: in, or ended with a reason", f"{told} of {trials}, {inserted} in", "all", told == trials
    )
    yield force_row(difference.what, ended, judged=True)


def main() -> int:
    parser = arguments.parser(__doc__)
    parser.add_argument("--trials", type=int, default=600, help="of each rate")
    parser.add_argument("--first-seed", type=int, default=710_001, help="seed of the first difference")
    given = parser.parse_args()
    rows: list[comparison.Row] = []
    seeds = iter(range(given.first_seed, given.first_seed + 100 * SPACING, 2 * SPACING))
    for difference in comparison.progress(DIFFERENCES, "Differences"):
        rows += difference_rows(difference, given.trials, next(seeds))
    for difference in comparison.progress(HOPELESS, "Hopeless"):
        rows += hopeless_rows(difference, given.trials, next(seeds))
    for condition in comparison.progress(CONDITIONS, "Conditions"):
        count = sum(in_parallel(functools.partial(first_attempt, condition), condition.first_seed, given.trials))
        rows.append(rate_row(f"{condition.what}: in at the first attempt", count, given.trials, WANTED))
    comparison.print_comparisons(rows, "Insertion into a cell other than believed")
    return 0 if all(row.reached for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
