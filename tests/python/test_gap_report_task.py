"""What a diagnosis means for the insertion: which cells have that task, and what is said of two of them."""

import kr5.cell
import pytest

pytest.importorskip("kr5.sim", reason="this kr5 was built without DART")

from kr5_tools.gap_report import insertion_impact


@pytest.fixture
def cell(share):
    return kr5.cell.load_cell(share / "cells/kr5_arc.yaml")


def test_a_cell_without_the_parts_of_an_insertion_or_with_a_narrow_bore_has_no_such_task(share, cell):
    assert insertion_impact.can_insert(cell)
    assert not insertion_impact.can_insert(kr5.cell.load_cell(share / "cells/kr5_arc_kuka.yaml"))
    tube = cell.tube
    tube.inner_radius = cell.peg.radius - 1e-4
    cell.tube = tube
    assert not insertion_impact.can_insert(cell)
    assert insertion_impact.task_terms(cell, cell) is None


def test_the_same_cell_twice_differs_by_nothing(cell, monkeypatch):
    monkeypatch.setattr(insertion_impact, "TRIALS", 6)
    found = insertion_impact.task_terms(cell, cell)
    nominal, updated = found["rows"]
    assert {**nominal, "name": ""} == {**updated, "name": ""}
    assert found["trials"] == 6 and "no significant difference" in found["words"]


def test_a_tube_that_stands_elsewhere_is_more_than_chance(share, monkeypatch):
    monkeypatch.setattr(insertion_impact, "TRIALS", 6)
    nominal, updated = (kr5.cell.load_cell(share / "cells/kr5_arc.yaml") for _ in range(2))
    updated.effects = kr5.cell.Effects({"tube_shift": {"tube": {"shift": [0.06, 0.0, 0.0]}}})
    found = insertion_impact.task_terms(nominal, updated)
    before, after = found["rows"]
    assert before["first"] == 6 and after["inserted"] == 0 and after["time"] is None
    assert "a significant difference" in found["words"] and after["failed"]
