"""Insertions into a cell that differs from the one the controller is told: contact, servo, friction, limits.

    python tools/benchmarks/insertion_mismatch.py [--trials 200]

Rates of the first attempt, with exact 95 % intervals."""

import dataclasses
import math
import os
from collections.abc import Callable
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

CELL = Path(__file__).resolve().parents[2] / "share/cells/kr5_arc.yaml"
MM = 1e-3
WANTED = 0.95


@dataclasses.dataclass
class Condition:
    """How the cell differs: a change of the cell drawn with a seed, and settings of the insertion."""

    what: str
    setup: dict[str, Any]
    change: Callable[[kr5.cell.Cell, np.random.Generator], None] = lambda cell, rng: None
    first_seed: int = 0


def softer_contact(cell: kr5.cell.Cell, _: np.random.Generator) -> None:
    assert cell.contact is not None
    cell.set_effect("contact_stiffness", "contact", "stiffness", 0.5 * cell.contact.stiffness)


def limited_corrections(mode: str) -> Callable[[kr5.cell.Cell, np.random.Generator], None]:
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


def first_attempts(condition: Condition, trials: int) -> int:
    """How many of the seeded insertions succeed at the first attempt."""

    def one(seed: int) -> bool:
        cell = kr5.cell.load_cell(CELL)
        assert cell.peg is not None
        condition.change(cell, np.random.default_rng(seed))
        setup = kr5.sim.InsertionSetup(
            seed=seed, offset=offset_in_disc(cell.peg.radius, seed), log=False, **condition.setup
        )
        result = kr5.sim.run_insertion(cell, setup)
        return bool(result.inserted and result.pegs[0].attempts == 1)

    seeds = range(condition.first_seed, condition.first_seed + trials)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return sum(pool.map(one, seeds))


def main() -> int:
    parser = arguments.parser(__doc__)
    parser.add_argument("--trials", type=int, default=200, help="of each rate")
    given = parser.parse_args()
    rows = []
    for condition in comparison.progress(CONDITIONS, "Conditions"):
        count = first_attempts(condition, given.trials)
        rate = success_rate(count, given.trials)
        rows.append(
            comparison.Row(
                f"{condition.what}: in at the first attempt",
                f"{count} of {given.trials}",
                f"lower bound ≥ {100 * WANTED:.0f} %",
                rate["low"] >= WANTED,
                interval=f"[{100 * rate['low']:.1f}, {100 * rate['high']:.1f}] %",
            )
        )
    comparison.print_comparisons(rows, "Insertion into a cell other than believed")
    return 0 if all(row.reached for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
