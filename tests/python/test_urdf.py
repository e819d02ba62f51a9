"""`kr5 cell import` and `export`, beside Pinocchio."""

from pathlib import Path

import kr5
import numpy as np
import pytest
from kr5.cell import import_urdf, load_cell, to_urdf
from kr5.kinematics import Body, Dynamics

ROBOTS = [
    ("kr5_arc_description/kr5_arc.urdf", "base_link", "tool0"),
    ("geo_socket_panda_iiwa/panda.urdf", "", "panda_hand"),
    ("geo_socket_panda_iiwa/iiwa14.urdf", "base_link", "tool0"),
    ("geo_ur10_figaroh/ur10_robot.urdf", "base_link", "tool0"),
    ("dyn_tx40_figaroh/tx40_mdh_modified.urdf", "", ""),
    ("dyn_tiago_figaroh/tiago_no_hand.urdf", "torso_lift_link", "arm_tool_link"),
    ("dyn_lbr_med7_kcl/med7dock.urdf", "", ""),
    ("simreal_kinova_mico/m1n6s300.urdf", "", "m1n6s300_link_6"),
]


def dynamics(cell, gravity):
    bodies = [Body(**link.to_dict()) for link in cell.robot.links]
    return Dynamics(cell.nominal_chain(), bodies, gravity)


def arm_of(pin, file: Path, joints: list[str]):
    """Pinocchio's model with every other joint held at 0."""
    whole = pin.buildModelFromUrdf(str(file))
    others = [i for i in range(1, whole.njoints) if whole.names[i] not in joints]
    return pin.buildReducedModel(whole, others, pin.neutral(whole))


@pytest.mark.parametrize(("name", "base", "tip"), ROBOTS)
def test_poses_and_torques_equal_pinocchio(reference, name, base, tip):
    pin = pytest.importorskip("pinocchio")
    file = reference / "data" / name
    urdf = import_urdf(file, base, tip)
    random = np.random.default_rng(1)
    model = arm_of(pin, file, urdf.joints)
    data, n = model.createData(), len(urdf.joints)
    assert list(model.names)[1:] == urdf.joints
    frame_base, frame_tip = model.getFrameId(urdf.base), model.getFrameId(urdf.tip)
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    R_world_base = data.oMf[frame_base].rotation.copy()
    arm = dynamics(urdf.cell, R_world_base.T @ model.gravity.linear) if urdf.cell.robot.links else None
    assert arm is not None or sum(inertia.mass for inertia in list(model.inertias)[1:]) == 0  # no mass in the file
    for _ in range(20):
        q, qd, qdd = random.uniform(-3, 3, (3, n))
        q_pin = np.concatenate(
            [[np.cos(v), np.sin(v)] if joint.nq == 2 else [v] for v, joint in zip(q, model.joints[1:])]
        )
        pin.framesForwardKinematics(model, data, q_pin)
        expected = (data.oMf[frame_base].inverse() * data.oMf[frame_tip]).homogeneous
        assert np.abs(urdf.cell.T_base_tool(q) - expected).max() < 1e-10
        if arm is None:
            continue
        tau = pin.rnea(model, data, q_pin, qd, qdd)
        assert np.abs(arm.torques(q, qd, qdd) - tau).max() < 1e-10 * max(1.0, np.abs(tau).max())


def test_a_cell_goes_out_and_comes_back(run_kr5, share, tmp_path):
    urdf, back = tmp_path / "robot.urdf", tmp_path / "back.yaml"
    assert run_kr5("cell", "export", share / "cells/kr5_arc.yaml", "-o", urdf).returncode == 0
    done = run_kr5("cell", "import", urdf, "-o", back)
    assert done.returncode == 0
    assert "6 joints from base_link to tool_tip" in done.stdout
    a, b = load_cell(share / "cells/kr5_arc.yaml"), load_cell(back)
    q = np.linspace(-1, 1, 6)
    assert np.abs(a.T_base_tool(q) - b.T_base_tool(q)).max() < 1e-12
    assert run_kr5("cell", "check", back).returncode == 0


def test_what_cannot_be_imported_is_one_line_and_exit_code_2(run_kr5, share, tmp_path):
    urdf, out = tmp_path / "robot.urdf", tmp_path / "cell.yaml"
    urdf.write_text(to_urdf(load_cell(share / "cells/kr5_arc.yaml")))
    for arguments, word in [((urdf, "--tip", "flinge"), "is it flange?"), ((tmp_path / "no.urdf",), "no.urdf")]:
        failed = run_kr5("cell", "import", *arguments, "-o", out)
        assert failed.returncode == 2
        assert word in failed.stderr
        assert not out.exists()


def test_both_tables_of_the_kr5_ship(share):
    printed = load_cell(share / "cells/kr5_arc_printed.yaml")
    kuka = load_cell(share / "cells/kr5_arc_kuka.yaml")
    zero = np.zeros(6)
    assert np.allclose(printed.T_base_tool(zero)[:3, 3], [-0.44, 0, 1.12], atol=1e-12)  # Hayat et al. 2022, table 3.1
    assert np.allclose(kuka.T_base_tool(zero)[:3, 3], [0.8, 0, 1.12], atol=1e-12)
    home = np.radians([0, 70, 12, 0, 0, 0])
    assert np.allclose(printed.T_base_tool(home)[:3, 3], [-0.8141, 0, 0.1430], atol=1e-4)
    assert np.allclose(kuka.T_base_tool(home)[:3, 3], [-0.1570, 0, 1.1946], atol=1e-4)
    for cell in (printed, kuka):
        found = kr5.kinematics.inverse_kinematics(cell.nominal_chain(), cell.T_base_tool(home + 0.3))
        assert found.closed_form
        assert len(found.postures) in (4, 8)


def test_a_batch_of_postures_is_what_single_ones_are(share):
    chain = load_cell(share / "cells/kr5_arc.yaml").nominal_chain()
    q = np.random.default_rng(2).uniform(-3, 3, (5, 6))
    T = chain.flanges(q)
    assert T.shape == (5, 4, 4)
    for row, pose in zip(q, T):
        assert np.array_equal(chain.flange(row), pose)
