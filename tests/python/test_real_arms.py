"""The bench on real arms: what it identifies and aligns, on synthetic truth, and one real arm."""

import sys

import kr5
import kr5.cell
import kr5.io
import kr5.kinematics
import numpy as np
import pytest

from conftest import ROOT

sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "tools/benchmarks")]

import real_arms
import real_arms_identify as identify
import real_arms_mico as mico
import real_arms_sets as sets

H = np.pi / 2


@pytest.fixture(scope="module")
def arm():
    """Three joints with masses, friction and rotors, moved and recorded without noise; fit and check."""
    rows = [(0.3, 0.0, H), (0.0, 0.4, 0.0), (0.0, 0.3, 0.0)]
    links = [
        kr5.cell.Link(mass=m, com=c, inertia=[0.05, 0.06, 0.04, 0.0, 0.0, 0.0])
        for m, c in ((5.0, [0.0, -0.1, 0.02]), (4.0, [-0.2, 0.0, 0.05]), (2.0, [-0.1, 0.02, 0.0]))
    ]
    robot = kr5.cell.Robot(dh=[kr5.kinematics.DhJoint(b=b, a=a, alpha=alpha) for b, a, alpha in rows], links=links)
    cell = sets.nominal_cell(sets.TorqueArm("synthetic", "", robot, {}, {}, 0.02, 5, (0, 1), (1, 2)))
    cell = identify.with_drives(
        cell,
        coulomb=np.array([3.0, 4.0, 1.0]),
        viscous=np.array([2.0, 5.0, 0.5]),
        rotor_inertia=np.array([0.4, 0.3, 0.1]),
    )
    experiments = []
    for split, phase in (("fit", 0.0), ("check", 1.0)):
        t = 0.02 * np.arange(400)
        q = np.column_stack(
            [0.8 * np.sin(1.3 * t + phase), 0.6 * np.sin(2.1 * t + 1) + 0.3, 0.7 * np.sin(2.9 * t + 2 + phase)]
        )
        e = kr5.cell.Experiment(name=split, kind="motion", file=f"{split}.csv", split=split)
        e.data = kr5.io.Table(["t", "qc1", "qc2", "qc3"], np.column_stack([t, q]))
        torque = identify.columns(cell, [e])
        e.data = kr5.io.Table(["t", "qc1", "qc2", "qc3", "i1", "i2", "i3"], np.column_stack([t, q, torque]))
        experiments.append(e)
    return kr5.cell.Recording(cell, experiments)


def test_friction_and_rotors_are_identified_from_another_start_and_torques_of_another_motion_predicted(arm):
    start = identify.with_drives(arm.cell, coulomb=np.zeros(3), viscous=np.zeros(3), rotor_inertia=np.zeros(3))
    robot = start.robot
    robot.links = [kr5.cell.Link(mass=link.mass, com=np.zeros(3), inertia=np.full(6, 0.0)) for link in robot.links]
    start.robot = robot
    shifted = sets.with_torques(
        kr5.cell.Recording(arm.cell, arm.experiments), arm.cell, lambda y: y + np.array([0.5, -1.0, 0.2])
    )
    found = identify.identify(start, shifted.experiments)
    np.testing.assert_allclose(found.cell.drives.friction.coulomb, [3, 4, 1], rtol=2e-3)
    np.testing.assert_allclose(found.cell.drives.friction.viscous, [2, 5, 0.5], rtol=2e-3)
    np.testing.assert_allclose(found.offset, [0.5, -1.0, 0.2], atol=0.05)
    check = arm.experiments[1:]
    torque = identify.recorded(check, 3)
    left = (torque - identify.columns(found.cell, check) + [0.5, -1.0, 0.2] - found.offset)[1:]
    assert np.linalg.norm(left) < 2e-3 * np.linalg.norm(torque)


def test_withholding_friction_leaves_the_other_joints_alone(arm):
    friction = sets.without_friction(arm.cell, [2]).drives.friction
    assert list(friction.coulomb) == [3, 0, 1] and list(friction.viscous) == [2, 0, 0.5]


def test_the_first_row_takes_the_residual_of_the_next(arm):
    changed = sets.with_torques(arm, arm.cell, lambda y: y + 1.0)
    y, shown = identify.recorded(changed.experiments[:1], 3), identify.columns(arm.cell, changed.experiments[:1])
    np.testing.assert_allclose(y - shown, 1.0, atol=1e-12)


def test_a_calibration_of_all_dh_parameters_finds_an_arm_that_is_off():
    rows, tool = sets.NOMINAL["UR5"]
    random = np.random.default_rng(4)
    joint = lambda b, a, alpha, d: kr5.kinematics.DhJoint(b=b + d[0], a=a + d[1], alpha=alpha + d[2], theta_offset=d[3])
    make = lambda d: kr5.cell.Cell(
        robot=kr5.cell.Robot(dh=[joint(*r, x) for r, x in zip(rows, d)]),
        tool=kr5.cell.Tool(T_flange_tool=kr5.from_xyzrpy([0, 0, tool, 0, 0, 0])),
    )
    true, nominal = make(random.normal(0, 2e-3, (6, 4))), make(np.zeros((6, 4)))
    made = []
    for count in (120, 30):
        q = random.uniform(-2, 2, (count, 6))
        seen = np.array([true.T_base_tool(x)[:3, 3] for x in q])
        e = kr5.cell.Experiment(name="p", kind="poses", file="p.csv", split="fit")
        e.data = kr5.io.Table(
            ["pose", "t", *(f"q{k + 1}" for k in range(6)), "x", "y", "z"],
            np.column_stack([np.arange(count), np.arange(count), q, seen]),
        )
        made.append(e)
    found = sets.all_of_dh(nominal, made[0])
    assert sets.position_errors(nominal, made[1]).mean() > 1e-3
    assert sets.position_errors(found, made[1]).max() < 1e-5


def path(rows=200):
    s = np.clip(mico.STEP * np.arange(rows) / 4, 0, 1)
    return np.column_stack([0.5 * s**2 * (3 - 2 * s), 0.05 * s, 0.9 - 0.6 * s**2 * (3 - 2 * s)])


def test_a_late_start_and_another_speed_are_found_and_nothing_is_left():
    mark = np.array([0.01, -0.02, 0.0])
    run = mico.replayed(path(), 300, 1.5, 0.8) + mark
    start, speed = mico.aligned([run], path(), True)
    assert start == pytest.approx(1.5, abs=mico.STEP) and speed == pytest.approx(0.8, abs=0.011)
    assert mico.errors([run], path(), mark, start, speed)[0] < 0.01 * mico.errors([run], path(), mark, 0.0, 1.0)[0]


def test_runs_begun_at_different_instants_are_cut_to_begin_together():
    runs = [mico.replayed(path(), 300, s, 1.0) for s in (1.0, 1.6)]
    together = mico.begun_together(runs)
    assert mico.rms(together[0][:200] - together[1][:200]) < 1e-9


def test_a_hand_that_rests_is_seen():
    assert mico.at_rest(path())[120:].all() and not mico.at_rest(path())[20:60].any()


def test_friction_withheld_from_a_real_arm_is_named(reference):
    row = real_arms.friction_withheld(sets.ur10(), reference / "data", [4], 3)
    assert row.right and row.before > 2 * row.after and row.after < 1.1 * row.best


def test_causes_beside_the_right_one_are_counted_and_printed(capsys):
    def row(right, beside):
        return real_arms.ArmRow("arm", "friction", "named", right, 2.0, 1.0, 1.0, beside=beside)

    rows = [row(True, []), row(True, ["payload tool", "backlash joint1"]), row(False, ["payload tool"])]
    real_arms.print_rows(rows)
    assert "named in 2 of 3 cases, in 1 of these with no other cause beside; 3 causes beside in all" in " ".join(
        capsys.readouterr().out.split()
    )
