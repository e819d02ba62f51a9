"""Joints that a log counts in another direction or from another zero than the model, and models of other robots."""

import re
import shlex
from xml.etree import ElementTree

import kr5.cell
import numpy as np
import pytest
from kr5.arm_log import BETTER_LIKENESS, fitting_convention, lever_arms, load_likeness

from arm_logs import NAMES, QUICK, carrying, case_logs, causes, joint_states, measured_motion, moved, refused


def without_limits(urdf, file):
    """Where a model states limits, a wrong zero mostly lies beyond them."""
    file.write_text(re.sub(r"<limit[^>]*/>", "", urdf.read_text()).replace('type="revolute"', 'type="continuous"'))
    return file


def counted(q, tau, joint, sign, zero):
    q, tau = q.copy(), tau.copy()
    q[:, joint] = sign * q[:, joint] + zero
    tau[:, joint] *= sign
    return q, tau


def printed_remedy(said):
    """The options that a refusal names."""
    return shlex.split(re.search(r"counted .*?: (--set .*?) (?:\(also in .*?\) )?error:", said)[1])


@pytest.mark.parametrize(
    ("joint", "sign", "zero", "unit"),
    [
        (1, -1, 0.0, "rad"),
        (2, 1, np.pi / 2, "deg"),
        (3, -1, 0.0, "deg"),
        (1, -1, -np.pi / 2, "rad"),
    ],
)
def test_another_direction_or_zero_of_a_joint_is_refused_and_the_remedy_works(
    diagnose, named_arm, named_urdf, tmp_path, joint, sign, zero, unit
):
    model = without_limits(named_urdf, tmp_path / "free.urdf")
    broken = carrying(named_arm, "coulomb_friction", "joint3", coulomb=9.0)
    t, q, tau = moved(broken)
    q, tau = counted(q, tau, joint, sign, zero)
    columns = joint_states(t, np.degrees(q) if unit == "deg" else q, tau)
    if unit == "deg":
        columns = {name.replace("position", "position_deg"): values for name, values in columns.items()}
    case_logs.write_csv(tmp_path / "log.csv", columns)
    ways = [text for text, meant in (("in the other direction", sign < 0), ("90 degrees away", zero)) if meant]
    said = refused(diagnose, "log.csv", "--model", model, text=(NAMES[joint], *ways, "--set"))
    remedy = printed_remedy(said)
    code, said, data = diagnose("log.csv", "--model", model, *remedy, *QUICK)
    assert code == 0, said
    assert causes(data) == [("coulomb_friction", "joint3")]


def test_an_offset_that_is_stated_turns_with_the_direction(diagnose, named_arm, named_urdf, tmp_path):
    model = without_limits(named_urdf, tmp_path / "free.urdf")
    t, q, tau = moved(named_arm)
    q, tau = counted(q, tau, 1, -1, -0.4)
    case_logs.write_csv(tmp_path / "log.csv", joint_states(t, q, tau + np.array([0, 20, 0, 0, 0, 0])))
    stated = ["--set", "columns.q.offset=[0, 0.4, 0, 0, 0, 0]", "--set", "columns.tau.offset=[0, -20, 0, 0, 0, 0]"]
    turned = ("columns.q.offset=[0, -0.4, 0, 0, 0, 0]", "columns.tau.offset=[0, 20, 0, 0, 0, 0]")
    said = refused(diagnose, "log.csv", "--model", model, *stated, text=turned)
    remedy = printed_remedy(said)
    code, said, data = diagnose("log.csv", "--model", model, *remedy, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def motor_log(named_arm, gear, joint, file):
    """Angles and torques of the motors of a sound arm with a joint counted the other way, and the options they need."""
    t, q, tau = moved(named_arm)
    q, tau = counted(q, tau, joint, -1, np.pi / 2)
    case_logs.write_csv(file, joint_states(t, q @ gear.T, tau @ np.linalg.inv(gear)))
    return [
        *("--set", f"cell.drives.structure={gear.tolist()}", "--set", f"cell.drives.torque_constant={[1.0] * 6}"),
        *("--set", "columns.q.side=motor", "--set", "columns.tau.side=motor"),
    ]


@pytest.mark.parametrize("joint", [1, 2])
@pytest.mark.parametrize("coupling", [0.0, 60.0])
def test_the_remedy_counts_angles_of_motors_with_their_gears(
    diagnose, named_arm, named_urdf, tmp_path, joint, coupling
):
    model = without_limits(named_urdf, tmp_path / "free.urdf")
    gear = np.diag([100.0, -120, 100, 80, 60, 50])
    gear[2, 1] = gear[5, 4] = coupling
    words = motor_log(named_arm, gear, joint, tmp_path / "log.csv")
    said = refused(diagnose, "log.csv", "--model", model, *words, text=(NAMES[joint], "in the other direction"))
    remedy = printed_remedy(said)
    code, said, data = diagnose("log.csv", "--model", model, *words, *remedy, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_wrong_masses_and_friction_are_no_other_direction(named_arm):
    """Beside effects drawn at random, none is taken for a joint that is counted another way."""
    random = np.random.default_rng(11)
    unlike = 0
    for seed in range(12):
        broken = named_arm
        for effect in random.choice(["link_mass", "link_com", "payload", "coulomb_friction"], 2, replace=False):
            joint = int(random.integers(2, 7))
            link = named_arm.robot.links[joint - 1]
            target = "tool" if effect == "payload" else f"joint{joint}"
            values = {
                "link_mass": {"mass": link.mass * random.uniform(0.4, 2.0)},
                "link_com": {"com": np.asarray(link.com) + 0.1 * random.normal(size=3)},
                "payload": {"mass": random.uniform(1, 8), "com": 0.1 * random.normal(size=3)},
                "coulomb_friction": {"coulomb": random.uniform(1, 20)},
            }[effect]
            broken = carrying(broken, effect, target, **values)
        motion = measured_motion(*moved(broken, seed=seed))
        assert fitting_convention(named_arm, motion) is None, seed
        unlike += load_likeness(named_arm, motion) + BETTER_LIKENESS < 1
    assert unlike >= 6, "too few logs unlike the model, for which another way is looked for at all"


def test_the_model_of_another_robot_of_the_same_names_is_doubted(diagnose, named_arm, named_urdf, tmp_path):
    """Masses and lengths of the model are those of a lighter and longer arm."""
    urdf = ElementTree.parse(named_urdf)
    for inertial in urdf.iter("inertial"):
        mass, origin = inertial.find("mass"), inertial.find("origin")
        mass.set("value", str(0.4 * float(mass.get("value"))))
        origin.set("xyz", " ".join(str(1.25 * float(x)) for x in origin.get("xyz").split()))
    for origin in urdf.iterfind(".//joint/origin"):
        origin.set("xyz", " ".join(str(1.25 * float(x)) for x in origin.get("xyz").split()))
    urdf.write(tmp_path / "other.urdf")
    case_logs.write_csv(tmp_path / "log.csv", joint_states(*moved(named_arm)))
    code, said, _ = diagnose("log.csv", "--model", "other.urdf", *QUICK[2:], "--max-effects", "3")
    assert code == 0, said
    assert "Does other.urdf describe this robot and its payload?" in said, said


def test_a_large_offset_of_a_joint_is_doubted_as_another_zero(diagnose, named_arm, named_urdf, tmp_path):
    turned = carrying(named_arm, "encoder_offset", "joint3", offset=0.3)
    case_logs.write_csv(tmp_path / "log.csv", joint_states(*moved(turned)))
    code, said, data = diagnose("log.csv", "--model", named_urdf, *QUICK)
    assert code == 0 and causes(data) == [("encoder_offset", "joint3")], said
    assert f"Does the log measure {NAMES[2]} from the same zero as the model?" in said, said
    assert "columns.q.offset corrects the log, by +0.3 rad" in said, said
    corrected = ["--set", "columns.q.offset=[0, 0, 0.3, 0, 0, 0]"]
    code, said, data = diagnose("log.csv", "--model", named_urdf, *corrected, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_logs_of_an_arm_without_a_tool_are_checked_too(named_arm):
    bare = kr5.cell.Cell(robot=named_arm.robot, name="arm")
    t, q, tau = moved(bare)
    motion = measured_motion(t, *counted(q, tau, 1, -1, 0.0))
    assert fitting_convention(bare, motion).sign == [1, -1, 1, 1, 1, 1]


def test_a_tool_makes_the_lever_arm_of_the_wrist(named_arm):
    q = np.radians([0, -90, 90, 0, 90, 0])
    bare = kr5.cell.Cell(robot=named_arm.robot, name="arm")
    aside = kr5.cell.parse_cell(named_arm.to_yaml())
    tool = aside.tool
    tool.mass, tool.com = 20.0, [0.3, 0.0, 0.0]
    aside.tool = tool
    wrist = named_arm.robot.links[5].mass
    assert lever_arms(bare, q)[5] < 0.02
    assert lever_arms(aside, q)[5] > 0.25 * 20 / (20 + wrist)


def test_errors_of_usual_size_are_not_doubted(diagnose, named_arm, named_urdf, tmp_path):
    mass = 1.3 * named_arm.robot.links[2].mass
    case_logs.write_csv(
        tmp_path / "log.csv", joint_states(*moved(carrying(named_arm, "link_mass", "joint3", mass=mass)))
    )
    code, said, data = diagnose("log.csv", "--model", named_urdf, *QUICK)
    assert code == 0 and causes(data) == [("link_mass", "joint3")], said
    assert "describe this robot" not in said
    assert f"instead of {named_arm.robot.links[2].mass:.4g}" in said, said
