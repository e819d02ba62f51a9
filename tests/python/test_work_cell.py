"""kr5.sim.WorkCell in Python: options, readings, truth, state, and its picture. What it does is tested in C++."""

from pathlib import Path

import kr5
import numpy as np
import pytest
from kr5 import robot, sim
from kr5.cell import load_cell

SHARE = Path(__file__).resolve().parents[2] / "share"


@pytest.fixture
def cell() -> sim.WorkCell:
    return sim.WorkCell(load_cell(SHARE / "cells/kr5_arc.yaml"), sim.WorkCellOptions(pour=sim.PourOptions(pellets=3)))


def test_it_is_read_and_sent_commands(cell):
    before = cell.read()
    command = robot.RobotCommand(space="joints", mode="relative", joints=[0.01, 0, 0, 0, 0, 0])
    command.gripper = robot.GripperCommand(hold=False, fingers=True)
    for _ in range(5):
        cell.send(command)
        cell.read()
    after = cell.read()
    assert after.time == pytest.approx(5 * cell.cycle)
    assert after.joints[0] > before.joints[0]
    assert not after.status.gripped


def test_the_truth_has_every_pellet_at_its_place(cell):
    truth = cell.truth()
    assert [str(p.place) for p in truth.pellets] == ["bin"] * 3
    assert truth.gripped == -1
    assert cell.believed.peg.radius == cell.options.pour.radius


def test_a_state_goes_through_a_file(cell, tmp_path):
    cell.read()
    cell.send(robot.RobotCommand())
    cell.state().save(tmp_path / "state.yaml")
    other = sim.WorkCell(load_cell(SHARE / "cells/kr5_arc.yaml"), cell.options)
    other.restore(sim.WorkCellState.load(tmp_path / "state.yaml"))
    assert np.array_equal(other.read().joints, cell.read().joints)
    with pytest.raises(kr5.Error, match=r"none\.yaml"):
        sim.WorkCellState.load(tmp_path / "none.yaml")


def test_bad_options_are_named():
    options = sim.WorkCellOptions()
    options.clearance = -1.0
    with pytest.raises(kr5.InvalidArgument, match="clearance: must be positive"):
        sim.WorkCell(load_cell(SHARE / "cells/kr5_arc.yaml"), options)


def test_the_side_view_is_written(cell, tmp_path):
    from kr5_tools.picking.side_view import write_side_view

    write_side_view(tmp_path / "cell.png", cell)
    assert (tmp_path / "cell.png").read_bytes().startswith(b"\x89PNG")
