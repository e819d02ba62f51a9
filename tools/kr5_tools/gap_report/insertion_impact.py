"""The gap in terms of the task: what the insertion of the cell would be with the nominal cell, and with the causes in
it."""

import os
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import kr5
import kr5.cell
from kr5 import uncertainty

from kr5_tools.sweep import rate_table

if TYPE_CHECKING:
    import kr5.sim

TRIALS = 20  # of each cell, with the same seeds; 20 of 20 is [83, 100] %


def can_insert(cell: kr5.cell.Cell) -> bool:
    """Whether the cell holds all that an insertion takes, a bore wider than its peg with it, and there is a simulator
    for it."""
    try:
        from kr5 import sim

        sim.insertion_options(cell, sim.InsertionSetup())
    except (ImportError, kr5.InvalidArgument):
        return False
    return bool(cell.tube.inner_radius > cell.peg.radius)


def task_terms(nominal: kr5.cell.Cell, updated: kr5.cell.Cell) -> dict[str, Any] | None:
    """Success, time and force of insertions in both cells, by the controller of the nominal one; None where there is no
    such task, or where a cause is an effect that was registered in Python, which run_insertion does not know."""
    if not (can_insert(nominal) and can_insert(updated)):
        return None
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        trials = list(
            pool.map(
                lambda job: _insert(*job),
                [(cell, seed) for cell in (nominal, updated) for seed in range(1, TRIALS + 1)],
            )
        )
    rows = [_row("nominal cell", trials[:TRIALS]), _row("with the causes", trials[TRIALS:])]
    clearance = 1e3 * (nominal.tube.inner_radius - nominal.peg.radius)
    return {"rows": rows, "words": _words(*rows), "clearance": f"{clearance:.2g}", "trials": TRIALS}


def _insert(cell: kr5.cell.Cell, seed: int) -> "kr5.sim.PegOutcome":
    import kr5.sim

    from kr5_tools.insertion.task import offset_in_disc

    clearance = cell.tube.inner_radius - cell.peg.radius
    setup = kr5.sim.InsertionSetup(
        clearance=clearance, offset=offset_in_disc(cell.peg.radius, seed), seed=seed, log=False
    )
    return kr5.sim.run_insertion(cell, setup).pegs[0]


def _row(name: str, pegs: "list[kr5.sim.PegOutcome]") -> dict[str, Any]:
    first = rate_table.success_rate(sum(p.inserted and p.attempts == 1 for p in pegs), len(pegs))
    failed = sorted({rate_table.reason_text(p.reason).replace("_", " ") for p in pegs if not p.inserted})
    times = [p.time for p in pegs if p.inserted]
    return {
        "name": name,
        "first": first["count"],
        "low": first["low"],
        "high": first["high"],
        "inserted": sum(p.inserted for p in pegs),
        "time": uncertainty.sample_median(times).median if times else None,
        "force": uncertainty.sample_median([p.max_force for p in pegs]).median,
        "failed": ", ".join(failed),
    }


def _differ_by_more_than_chance(one: int, other: int) -> bool:
    """Of two counts of `TRIALS`: Fisher's exact test at 5 %."""
    counts = [uncertainty.Count(successes=n, trials=TRIALS) for n in (one, other)]
    return uncertainty.same_rate_probability(*counts) < 0.05


def _words(nominal: dict[str, Any], updated: dict[str, Any]) -> str:
    """What the causes mean for the task; a difference that chance explains is said to be none."""
    differs = nominal["first"] != updated["first"] and _differ_by_more_than_chance(nominal["first"], updated["first"])
    text = (
        f"At the first attempt the simulation of the nominal cell inserts {nominal['first']} of {TRIALS} pegs, that"
        f" with the causes {updated['first']}"
    )
    text += ", a significant difference" if differs else ", no significant difference"
    if nominal["time"] and updated["time"]:
        text += f"; a successful insertion takes {updated['time']:.1f} s instead of {nominal['time']:.1f} s"
    return (
        text + f", and the force on the grip is {updated['force']:.0f} N at most instead of"
        f" {nominal['force']:.0f} N (medians)."
    )
