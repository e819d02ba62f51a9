"""The cells of the bench of insertions into a cell other than believed: their controllers are told of no difference."""

import sys

import kr5.cell
import kr5.sim
import numpy as np
import pytest

from conftest import ROOT

sys.path[:0] = [str(ROOT / "tools/benchmarks")]
import insertion_mismatch as bench
import mismatched_cells as cells

DRAWN = [*cells.DIFFERENCES, *cells.HOPELESS]


def drawn(difference, seed, clearance=bench.CLEARANCE):
    """What is told, and the cell and setup in which it is run."""
    cell = kr5.cell.load_cell(bench.CELL)
    setup = bench.setup_of(cell, seed, clearance=clearance)
    told = kr5.sim.insertion_options(cell, setup)
    difference.draw(cell, setup, np.random.default_rng(seed))
    return told, cell, setup


@pytest.mark.parametrize("difference", DRAWN, ids=[d.what for d in DRAWN])
def test_a_difference_is_drawn_with_a_seed_and_its_controller_is_not_told(difference):
    first, again, other = (drawn(difference, seed)[1:] for seed in (1, 1, 2))
    as_text = [(cell.to_dict(), setup.to_dict()) for cell, setup in (first, again, other)]
    assert as_text[0] == as_text[1] != as_text[2]
    plain = kr5.cell.load_cell(bench.CELL)
    changed = first[0]
    assert changed.servo.to_dict() == plain.servo.to_dict() and changed.contact.to_dict() == plain.contact.to_dict()
    read, told = (kr5.sim.insertion_options(*first).to_dict(), drawn(difference, 1)[0].to_dict())
    if difference.draw in (cells.radii, cells.everything):  # the radius of the peg is a field, of which none is told
        assert read.pop("bodies") != told.pop("bodies")
    if difference.draw is cells.wedging:  # a tilt in the grip that is stated is searched for
        assert read != told and told == drawn(difference, 2)[0].to_dict()
    else:
        assert read == told


@pytest.mark.parametrize("clearance", [bench.CLEARANCE, bench.CLOSE])
def test_radii_stay_within_their_tolerance_of_what_is_told(clearance):
    most = cells.tolerance(clearance)
    for seed in range(20):
        told, cell, setup = drawn(cells.Difference("", cells.radii), seed, clearance)
        real = kr5.sim.run_insertion(cell, setup, told).cell
        bore = real.effects.get("tube_radius", "tube", "inner_radius")
        assert 0 < abs(cell.peg.radius - told.bodies.peg_radius) <= most
        assert 0 < abs(bore - told.bodies.inner_radius) <= most
        assert bore > cell.peg.radius


def test_an_outcome_is_judged_by_the_truth_and_the_limit_of_force():
    def blocked(cell, setup, rng):
        cell.set_effect("tube_radius", "tube", "inner_radius", 0.5 * cell.peg.radius)

    ended = bench.insert(cells.Difference("blocked", blocked), bench.CLEARANCE, 1)
    assert ended.attempts == 0 and ended.told
    good = bench.insert(cells.Difference("nothing", lambda *_: None), bench.CLEARANCE, 1)
    assert good.attempts == 1 and 0 < good.force < good.limit == 80
    above = bench.force_row("x", [good, bench.Outcome(0, True, 81.0, 80.0)], judged=True)
    assert not above.reached and "81.0" in above.ours
