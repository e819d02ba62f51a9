"""Models of robots, whichever file they stand in; MJCF beside MuJoCo itself."""

import os
import shlex
import sys

import kr5
import numpy as np
import pytest
from kr5.logs import read_logs
from kr5.models import Kind, read_model
from kr5.models.kinds import kind_of_file

URDF = """<robot name="two">
  <link name="world"/>
  <link name="a"><inertial><mass value="2"/><inertia ixx="0.1" iyy="0.2" izz="0.2"/></inertial></link>
  <link name="b"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>
  <joint name="shoulder" type="revolute"><origin xyz="0 0 0.3"/><parent link="world"/><child link="a"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="2" effort="5" velocity="3"/></joint>
  <joint name="elbow" type="continuous"><origin xyz="0.5 0 0"/><parent link="a"/><child link="b"/>
    <axis xyz="0 0 1"/></joint>
</robot>
"""


@pytest.fixture
def mujoco():
    return pytest.importorskip("mujoco")


def save(folder, text, name="arm.xml"):
    file = folder / name
    file.write_text(text)
    return file


def body(content, name="b", pos="0 0 0.3"):
    return f'<body name="{name}" pos="{pos}"><geom size="0.05" mass="1"/>{content}</body>'


def joint(name, kind="hinge", **values):
    more = " ".join(f'{key}="{value}"' for key, value in values.items())
    return f'<joint name="{name}" type="{kind}" axis="0 1 0" {more}/>'


def model(world, more=""):
    return f'<mujoco model="m"><compiler angle="radian"/><worldbody>{world}</worldbody>{more}</mujoco>'


def two_joints(inside="", more=""):
    return model(body(joint("j1") + body(joint("j2") + inside, "b2"), "b1"), more)


@pytest.mark.parametrize("seed", range(12))
def test_random_arms_move_and_weigh_as_in_mujoco(mujoco, tmp_path, seed):
    from mjcf_arms import MujocoArm, cell_torques, random_arm, states

    file = save(tmp_path, random_arm(seed))
    found = read_model(file, tip="tcp")
    assert found.kind == Kind.MJCF
    assert found.cell.valid() if hasattr(found.cell, "valid") else True
    arm = MujocoArm(mujoco.MjModel.from_xml_path(str(file)), found.joints)
    for q, qd, qdd in states(arm.model, found.joints, seed):
        assert np.abs(found.cell.T_base_tool(q) - arm.tip(q, "tcp", "site")).max() < 1e-12
        expected = arm.torques(q, qd, qdd)
        assert np.abs(cell_torques(found.cell, q, qd, qdd) - expected).max() < 1e-9 * max(1.0, np.abs(expected).max())
    assert "held where the model begins" in found.notes[0] and "grip" in found.notes[0]


def test_a_base_on_the_arm_has_its_own_axes_and_gravity(mujoco, tmp_path):
    from mjcf_arms import random_arm

    file = save(tmp_path, random_arm(5))
    whole, part = read_model(file, tip="tcp"), read_model(file, base="base", tip="tcp")
    T = np.eye(4)
    T[:3, 3] = [0.1, 0.2, 0.3]
    q = np.linspace(-1, 1, len(whole.joints))
    assert np.abs(whole.cell.T_base_tool(q) - T @ part.cell.T_base_tool(q)).max() < 1e-12
    assert (whole.base, part.base, part.tip) == ("world", "base", "tcp")


def test_joint_values_of_a_model_become_those_of_the_cell(mujoco, tmp_path):
    text = model(
        body(
            joint("j1", damping=2, frictionloss=0.5, armature=0.1, range="-1 2", limited="true")
            + body(joint("j2", "slide", actuatorfrcrange="-30 20", actuatorfrclimited="true"), "b2"),
            "b1",
        )
    )
    cell = read_model(save(tmp_path, text)).cell
    assert list(cell.robot.joint_names) == ["j1", "j2"]
    assert cell.robot.limits.lower[0] == -1 and cell.robot.limits.upper[0] == 2
    assert np.isinf(cell.robot.limits.upper[1]) and cell.robot.limits.effort[1] == 30
    assert cell.drives.friction.viscous[0] == 2 and cell.drives.friction.coulomb[0] == 0.5
    assert cell.drives.rotor_inertia[0] == 0.1 and np.array_equal(cell.drives.structure, np.eye(2))
    assert cell.name == "m"
    assert cell.tool.mass == 0


def test_content_tells_the_kind_of_a_file_not_its_ending(mujoco, tmp_path, share):
    assert read_model(save(tmp_path, URDF, "robot.xml")).kind == Kind.URDF
    assert read_model(save(tmp_path, f"<!-- <mujoco> -->\n{URDF}", "robot.txt")).kind == Kind.URDF
    assert read_model(save(tmp_path, two_joints(), "robot.urdf")).kind == Kind.MJCF
    arc = read_model(share / "cells/kr5_arc.yaml")
    assert (arc.kind, arc.joints[2], arc.base) == (Kind.CELL, "joint3", "")
    named = save(tmp_path, (share / "cells/kr5_arc.yaml").read_text(), "cell.xml")
    assert read_model(named).cell.robot.joints == 6


def test_a_urdf_keeps_its_names_and_gets_a_tool(tmp_path):
    found = read_model(save(tmp_path, URDF, "two.urdf"))
    assert found.joints == ["shoulder", "elbow"] == list(found.cell.robot.joint_names)
    assert (found.base, found.tip) == ("world", "b")
    assert "payload" in [e.id for e in kr5.cell.effect_catalogue() if found.cell.effect_targets(e.id) == ["tool"]]


@pytest.mark.parametrize(
    ("text", "name", "options", "word"),
    [
        ("<html/>", "a.xml", {}, "found <html>, expected a URDF"),
        ("<mujocoinclude/>", "a.xml", {}, "name the file that includes it"),
        ("<sdf version='1.9'/>", "a.sdf", {}, "written but not read; give the URDF"),
        ("<robot><xacro:arm/></robot>", "a.urdf", {}, "xacro FILE > robot.urdf"),
        ("<robot name='x'>", "a.urdf", {}, "is not valid XML"),
        (URDF.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 1"/><mimic joint="shoulder"/>'), "a.urdf", {}, "mimics"),
        (URDF, "a.urdf", {"tip": "c"}, 'there is no link "c" for the tip'),
        ("just words", "a.yaml", {}, "expected a map with format: kr5-cell/1"),
    ],
)
def test_bad_models_are_refused_with_the_remedy(tmp_path, text, name, options, word):
    with pytest.raises(kr5.IoError) as error:
        read_model(save(tmp_path, text, name), **options)
    assert word in str(error.value)
    assert str(tmp_path / name) in str(error.value)


def test_a_cell_has_no_other_base_or_tip_and_a_missing_file_is_named(share, tmp_path):
    with pytest.raises(kr5.IoError, match="--tip: only for a URDF or an MJCF"):
        read_model(share / "cells/kr5_arc.yaml", tip="flange")
    with pytest.raises(kr5.IoError, match="nowhere.urdf: No such file"):
        read_model(tmp_path / "nowhere.urdf")
    (tmp_path / "binary.xml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(kr5.IoError, match="is not UTF-8 text"):
        read_model(tmp_path / "binary.xml")


@pytest.mark.parametrize("file", ["pipe.urdf", "zero.urdf"])
def test_a_model_without_an_end_is_refused(run_kr5, share, tmp_path, file):
    os.mkfifo(tmp_path / "pipe.urdf")  # to which nobody writes
    (tmp_path / "zero.urdf").symlink_to("/dev/zero")
    log = share / "data/arm_log/joint_states.csv"
    for words in (("cell", "import", file, "-o", "cell.yaml"), ("gap", "measure", log, "--model", file)):
        done = run_kr5(*words, timeout=60)
        assert done.returncode == 2 and f"{file}: is a " in done.stderr, done.stderr


def test_a_bag_with_a_part_without_an_end_is_refused(run_kr5, share, tmp_path):
    pytest.importorskip("rosbags")
    (tmp_path / "bag").mkdir()
    os.mkfifo(tmp_path / "bag/part.db3")  # to which nobody writes
    done = run_kr5("gap", "measure", "bag", "--model", share / "data/arm_log/arm.urdf", timeout=60)
    assert done.returncode == 2 and "part.db3: is a pipe or a socket" in done.stderr, done.stderr


DOCTYPES = (
    "<!DOCTYPE robot>",
    '<!DOCTYPE robot SYSTEM "a>.dtd">',
    '<!DOCTYPE robot [\n<!ENTITY x "]>">\n<!-- don\'t ] -->\n]>\n<!-- <mujoco> -->',
)


@pytest.mark.parametrize("doctype", DOCTYPES)
def test_a_declaration_of_the_type_hides_no_model(kr5_here, share, tmp_path, doctype):
    plain = (share / "data/arm_log/arm.urdf").read_text()
    begin = plain.index("<robot")
    (tmp_path / "arm.urdf").write_text(plain[:begin] + doctype + plain[begin:])
    assert kr5_here("cell", "import", "arm.urdf", "-o", "cell.yaml").exit_code == 0
    log = share / "data/arm_log/joint_states.csv"
    assert kr5_here("gap", "measure", log, "--model", "arm.urdf").exit_code == 0


@pytest.mark.parametrize(
    "text", ["<!DOCTYPE [" + "<!--" * 50_000, "<!DOCTYPE " + '"' * 50_001, "<!DOCTYPE a>" * 50_000]
)
def test_a_text_that_never_ends_its_declarations_is_no_xml(tmp_path, text):
    file = save(tmp_path, text, "arm.urdf")
    assert str(kind_of_file(file)) == "cell"


EQUAL = '<equality><joint name="gear" joint1="j1" joint2="j2"/></equality>'
LOOP = '<equality><connect name="rod" body1="b1" body2="b3" anchor="0 0 0"/></equality>'
FINGERS = body(joint("left", "slide"), "left") + body(joint("right", "slide"), "right")


@pytest.mark.parametrize(
    ("text", "options", "word"),
    [
        ("<mujoco><worldbody><body><geom/></body></worldbody></mujoco>", {}, "cannot be compiled by MuJoCo"),
        (two_joints("<site nme='x'/>"), {}, "cannot be compiled by MuJoCo"),
        (two_joints(more=EQUAL), {}, "equality gear ties the joint j1; the joints of an arm must be independent"),
        (
            two_joints(body(joint("j3"), "b3"), LOOP),
            {},
            "equality rod joins b1 and b3, which closes a loop",
        ),
        (two_joints(FINGERS), {}, "behind body b2 the model branches to left, right; name the body or site that"),
        (two_joints(), {"tip": "hand"}, 'there is no body "hand" for the tip; the bodies are world, b1, b2'),
        (two_joints(), {"base": "b2", "tip": "b1"}, "the tip b1 is not carried by the base b2"),
        (two_joints(), {"base": "b2"}, "no joint moves"),
        (model(body("<joint name='ball' type='ball'/>" + body(joint("j2"), "b2"), "b1")), {}, "joint ball is a ball"),
        (
            model(body("<freejoint name='float'/>" + body(joint("j2"), "b2"), "b1")),
            {"tip": "b2"},
            "joint float is free; an arm has hinges and slides, so name a base behind it (--base)",
        ),
        (model(body("", "rock")), {}, "no joint moves; expected an arm of hinges and slides"),
    ],
)
def test_what_is_no_arm_in_an_mjcf_is_refused(mujoco, tmp_path, text, options, word):
    with pytest.raises(kr5.IoError) as error:
        read_model(save(tmp_path, text), **options)
    assert word in str(error.value)
    assert "\n" not in str(error.value)


def test_what_a_cell_cannot_hold_of_an_mjcf_is_noted(mujoco, tmp_path):
    inside = body(joint("j3", stiffness=5, springref=0.1), "b3").replace("<body ", '<body gravcomp="1" ')
    more = (
        '<option density="1.2"/><tendon><fixed name="rope"><joint joint="j1" coef="1"/></fixed></tendon>'
        '<actuator><position name="servo" joint="j2" kp="10"/></actuator>'
    )
    free = body("<freejoint/>", "box", "1 0 0")
    text = two_joints(inside, more).replace("<worldbody>", f"<worldbody>{free}")
    notes = " ".join(read_model(save(tmp_path, text)).notes)
    for words in (
        "springs of j3",
        "gravcomp) of b3",
        "density",
        "tendons have no place in a cell: rope",
        "servo",
        "contacts",
    ):
        assert words in notes


SERVOS = """<mujoco model="m"><compiler angle="radian"/><option timestep="0.005"/>
  <default><default class="stiff"><position kp="40" kv="3" forcerange="-9 9"/></default></default>
  <worldbody><body name="b1"><joint name="j1" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <geom type="mesh" mesh="cover" contype="0" conaffinity="0"/>
    <body name="b2" pos="1 0 0"><joint name="j2" axis="0 1 0" actuatorfrcrange="-7 7"/>
      <inertial pos="0.2 0 0" mass="1" diaginertia="1 1 1"/></body></body></worldbody>
  <asset><mesh name="cover" file="nowhere/cover.stl"/></asset>
  <actuator>
    <position name="a1" joint="j1" class="stiff"/>
    <general name="a2" joint="j2" gear="2" gainprm="10" biastype="affine" biasprm="0 -10 -0.5"/>
  </actuator>
</mujoco>
"""


def swing_log(folder):
    """Commands of up to 0.5 and 0.4 rad, and positions that follow them."""
    t = np.arange(600) * 0.01
    swing = np.column_stack([0.5 * np.sin(2 * t), 0.4 * np.sin(3 * t)]) * np.clip(t - 1, 0, 1)[:, None]
    table = np.column_stack([t, swing, 0.97 * np.roll(swing, 3, axis=0)])
    np.savetxt(folder / "log.csv", table, delimiter=",", header="t,cmd1,cmd2,pos1,pos2", comments="")
    return folder / "log.csv"


def test_position_actuators_are_the_torque_servos_of_a_cell(mujoco, tmp_path):
    found = read_model(save(tmp_path, SERVOS))
    assert found.cell.has_torque_servos and found.cell.servo.cycle == 0.005
    one, two = found.cell.servo.torque
    assert (one.stiffness, one.damping, one.torque_limit) == (40, 3, 9)
    assert (two.stiffness, two.damping, two.torque_limit) == (40, 2, 7)  # of the joint, behind a gear of 2
    assert any("divide them by the gear" in note and "a2" in note for note in found.notes)


def test_a_damping_ratio_is_the_damping_that_mujoco_makes_of_it(mujoco, tmp_path):
    text = SERVOS.replace('kp="40" kv="3"', 'kp="40" dampratio="0.7"')
    servo = read_model(save(tmp_path, text)).cell.servo.torque_of(0)
    assert servo.stiffness == 40
    assert 0 < servo.damping < 2 * np.sqrt(40 * 3)


def test_actuators_that_are_no_position_servos_are_noted(mujoco, tmp_path):
    found = read_model(
        save(
            tmp_path, SERVOS.replace('joint="j1" class="stiff"', 'joint="j1" kp="0"').replace('biastype="affine" ', "")
        )
    )
    assert found.cell.servo is None
    note = next(note for note in found.notes if "have no position servo" in note)
    assert "j1 (general), j2 (motor) have" in note


@pytest.mark.parametrize("kind", ["velocity", "motor"])
def test_of_actuators_that_are_not_read_the_note_says_what_to_type(mujoco, tmp_path, kind):
    other = f'<{kind} name="a2" joint="j2" {"kv" if kind == "velocity" else "gear"}="3"/>'
    begin, end = SERVOS.index("<general"), SERVOS.index("</actuator>")
    file = save(tmp_path, f"{SERVOS[:begin]}{other}{SERVOS[end:]}")
    found = read_model(file)
    assert found.cell.servo is None
    note = next(note for note in found.notes if f"j2 ({kind}) have no position servo" in note)
    settings = shlex.split(note[note.index("--set") :])[1::2]
    read = read_logs(swing_log(tmp_path), file, settings=settings)
    assert read.recording.cell.has_torque_servos and read.recording.cell.servo.torque_of(1).stiffness == 20


@pytest.mark.parametrize(
    ("wrong", "limit", "told"),
    [
        ("-9 9", 9, ""),
        ("-9 5", 5, "a1 (5 and 9 N m)"),
        ("-4 9", 4, "a1 (4 and 9 N m)"),
        ("0 9", 9, "a1 (9 and 0 N m)"),
    ],
)
def test_of_uneven_limits_of_force_one_is_taken_and_noted(mujoco, tmp_path, wrong, limit, told):
    found = read_model(save(tmp_path, SERVOS.replace("-9 9", wrong)))
    assert found.cell.servo.torque_of(0).torque_limit == limit
    notes = [note for note in found.notes if "limited in both directions unlike" in note]
    assert len(notes) == bool(told) and all(told in note for note in notes)


def test_the_smaller_limit_of_actuator_and_joint_holds_on_each_side(mujoco, tmp_path):
    text = SERVOS.replace('actuatorfrcrange="-7 7"', 'actuatorfrcrange="-7 20"').replace(
        'biasprm="0 -10 -0.5"', 'biasprm="0 -10 -0.5" forcerange="-8 4"'
    )
    assert read_model(save(tmp_path, text)).cell.servo.torque_of(1).torque_limit == 7  # -7 to 8 behind a gear of 2


@pytest.mark.parametrize("clamps", [True, False])
def test_commands_that_mujoco_would_clamp_are_noted(mujoco, tmp_path, clamps):
    text = SERVOS.replace('name="a1"', 'name="a1" ctrlrange="-0.6 0.6"').replace(
        'name="a2"', 'name="a2" ctrlrange="-0.2 1.6"'
    )
    if not clamps:
        text = text.replace("<option ", '<option><flag clampctrl="disable"/></option><option ')
    notes = [n for n in read_logs(swing_log(tmp_path), save(tmp_path, text)).notes if "ctrlrange" in n]
    assert len(notes) == clamps
    assert all("j2 from -0.4 to 0.4 rad, beside -0.1 to 0.8 rad" in n and "j1" not in n for n in notes)


def test_a_mesh_that_gives_a_mass_must_be_there(mujoco, tmp_path):
    inertial = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    with pytest.raises(kr5.IoError, match="mass"):
        read_model(save(tmp_path, SERVOS.replace(inertial, "")))


def test_objects_that_float_beside_an_arm_are_no_branches(mujoco, tmp_path):
    text = two_joints().replace("<worldbody>", "<worldbody>" + body("<freejoint/>", "box", "1 0 0"))
    assert read_model(save(tmp_path, text)).joints == ["j1", "j2"]
    tied = two_joints(FINGERS, '<equality><joint joint1="left" joint2="right"/></equality>')
    assert read_model(save(tmp_path, tied), tip="b2").joints == ["j1", "j2"]


def test_without_mujoco_the_message_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(kr5.IoError, match=r"which is not installed: pip install 'kr5\[mujoco\]'"):
        read_model(save(tmp_path, two_joints()))


def test_the_command_imports_an_mjcf(mujoco, run_kr5, tmp_path):
    file = save(tmp_path, two_joints())
    done = run_kr5("cell", "import", file, "-o", "cell.yaml", "--json", "found.json")
    assert done.returncode == 0, done.stderr
    assert "cell.yaml: 2 joints from world to b2: j1, j2." in done.stdout
    assert run_kr5("cell", "check", "cell.yaml").returncode == 0
    assert (tmp_path / "found.json").read_text().count('"j1"') == 2
    failed = run_kr5("cell", "import", file, "--tip", "hand", "-o", "other.yaml")
    assert failed.returncode == 2
    assert len(failed.stderr.splitlines()) == 1
    assert not (tmp_path / "other.yaml").exists()
