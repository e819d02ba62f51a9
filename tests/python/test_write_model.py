"""Cells written as URDF, MJCF and SDF, with what was found in them."""

import functools
import re
import xml.etree.ElementTree as xml

import kr5
import numpy as np
import pytest
from kr5 import cell as kr5_cell
from kr5 import physics
from kr5.models import read_model, write_model, writing

EFFECTS = {  # that every format holds
    "coulomb_friction": {"joint2": {"coulomb": 3.5}},
    "viscous_friction": {"joint1": {"viscous": 1.25}},
    "encoder_offset": {"joint3": {"offset": 0.004}},
    "link_length": {"joint2": {"a": 0.603}},
    "link_twist": {"joint1": {"alpha": 1.572}},
    "link_mass": {"joint2": {"mass": 25.0}},
    "link_com": {"joint2": {"com": [-0.3, 0.02, 0.01]}},
    "base_tilt": {"base": {"roll": 0.003, "pitch": -0.002}},
    "payload": {"tool": {"mass": 0.8, "com": [0.01, 0.02, 0.03]}},
    "tool_offset": {"tool": {"offset": [0.001, -0.002, 0.003]}},
}
LOST = {"stribeck_friction": {"joint4": {"stribeck": 2.0, "stribeck_velocity": 0.1}}, "ft_bias": {"fx": {"bias": 1.5}}}


@pytest.fixture
def arc(share):
    return kr5_cell.load_cell(share / "cells/kr5_arc.yaml")


@pytest.fixture
def mujoco():
    return pytest.importorskip("mujoco")


def with_effects(cell, *effects):
    cell.effects = {name: on for group in effects for name, on in group.items()}
    return cell


def near_arm(cell):
    """Effects of usual size on an arm of any shape."""
    dh = cell.robot.dh
    effects = dict(EFFECTS)
    effects["link_length"] = {"joint2": {"a": dh[1].a + 0.003}}
    effects["link_twist"] = {"joint1": {"alpha": dh[0].alpha + 0.002}}
    if links := cell.robot.links:
        effects["link_mass"] = {"joint2": {"mass": 1.2 * links[1].mass}}
        effects["link_com"] = {"joint2": {"com": np.add(links[1].com, [0.02, -0.01, 0.03]).tolist()}}
    else:
        del effects["link_mass"], effects["link_com"]
    return with_effects(cell, effects)


def difference(a, b, gravity=True):
    """Greatest difference of tip pose, and of torques, relative, at random states."""
    from mjcf_arms import cell_torques

    if not gravity:
        a.robot.gravity = b.robot.gravity = np.array([0.0, 0.0, -9.81])
    worst, random = 0.0, np.random.default_rng(3)
    for q, qd, qdd in random.uniform(-1.5, 1.5, (6, 3, a.robot.joints)):
        worst = max(worst, np.abs(a.T_base_tool(q) - b.T_base_tool(q)).max())
        tau = cell_torques(a, q, qd, qdd)
        worst = max(worst, np.abs(tau - cell_torques(b, q, qd, qdd)).max() / max(1.0, np.abs(tau).max()))
    return worst


def without_rotors(cell):
    drives = cell.drives
    drives.rotor_inertia = np.zeros(cell.robot.joints)
    cell.drives = drives
    return cell


def folded(cell):
    return physics.fold_effects(cell, add_drives=True).cell


def rows(found):
    return {(p.effect, p.target, p.parameter) for p in found}


def test_a_tuned_cell_is_not_the_nominal_urdf_and_what_is_lost_is_told(arc, tmp_path):
    nominal, tuned = tmp_path / "nominal.urdf", tmp_path / "tuned.urdf"
    assert write_model(arc, nominal).losses == []
    with_effects(arc, EFFECTS, LOST, {"torque_constant": {"joint5": {"torque_constant": 0.9}}})
    written = write_model(arc, tuned)
    assert nominal.read_text() != tuned.read_text()
    back = read_model(tuned).cell
    assert difference(without_rotors(folded(arc)), back) < 1e-12
    assert np.array_equal(back.drives.friction.coulomb, folded(arc).drives.friction.coulomb)
    assert {p.effect for p in written.folded} == set(EFFECTS)
    assert rows(written.losses) == {
        ("torque_constant", "joint5", "torque_constant"),
        ("stribeck_friction", "joint4", "stribeck"),
        ("stribeck_friction", "joint4", "stribeck_velocity"),
        ("ft_bias", "fx", "bias"),
    }
    reasons = {p.effect: (p.value, p.unit, p.reason) for p in written.losses}
    assert reasons["torque_constant"] == (0.9, "N m/A", "a URDF has no place for the torque constant of a motor")
    assert reasons["ft_bias"] == (1.5, "N or N m", "a URDF cannot express this: sensor offset")
    field = {p.effect: p.field for p in written.folded}
    assert field["payload"] == "tool.mass, tool.com, tool.inertia"
    assert field["coulomb_friction"] == "drives.friction.coulomb[1]"
    assert any("camera" in note and "servo" in note for note in written.notes)


@pytest.mark.parametrize("ending", ["urdf", "xml", "sdf", "drake.sdf", "yaml"])
def test_every_effect_is_held_or_lost_and_none_forgotten(arc, tmp_path, ending, torque_servo_effects):
    all_effects = {}
    possible = [effect for effect in kr5_cell.effect_catalogue() if effect.id not in torque_servo_effects]
    for effect in possible:
        target = arc.effect_targets(effect.id)[0]
        values = {}
        for p in effect.parameters:
            size = 1e-3 if p.unit in ("m", "rad") else 0.5
            nominal = arc.nominal_value(effect.id, target, p.name)
            kind = str(p.kind)
            values[p.name] = (
                np.asarray(nominal) @ kr5.to_pose([1e-3] * 3 + [0.0] * 3)
                if kind == "pose"
                else [1e-3] * int(kind[-1])
                if kind.startswith("vector")
                else int(p.off[0])
                if kind == "whole"
                else 1e5
                if p.name == "stiffness" and nominal is None
                else (nominal or (p.off[0] if p.off else 0.0)) + size * 1e-3
            )
        all_effects[effect.id] = {target: values}
    with_effects(arc, all_effects)
    written = write_model(arc, tmp_path / f"arm.{ending}")
    named = {p.effect for p in (*written.folded, *written.losses)}
    if ending == "yaml":
        back = kr5_cell.load_cell(tmp_path / "arm.yaml")
        named |= set(back.effects.to_dict())
        assert written.losses == []
    assert named == {effect.id for effect in possible}


def test_a_new_mjcf_moves_in_mujoco_as_the_cell(mujoco, arc, tmp_path):
    from mjcf_arms import MujocoArm, states

    names = [f"a{k}" for k in range(6)]
    arc.robot.joint_names = names
    springs = {"cable_spring": {"joint2": {"stiffness": 12.0, "rest": 0.3}}}
    with_effects(arc, EFFECTS, springs, {"rotor_inertia": {"joint1": {"rotor_inertia": 1e-3}}}, LOST)
    written = write_model(arc, tmp_path / "arm.xml")
    assert rows(written.losses) == {
        ("stribeck_friction", "joint4", "stribeck"),
        ("stribeck_friction", "joint4", "stribeck_velocity"),
        ("ft_bias", "fx", "bias"),
    }
    assert ("cable_spring", "joint2", "stiffness") in rows(written.folded)
    assert any("rotors of coupled joints" in note for note in written.notes)
    cell = folded(arc)
    drives = cell.drives  # MuJoCo couples no rotors
    drives.rotor_inertia = np.diag(drives.structure.T @ np.diag(drives.rotor_inertia) @ drives.structure)
    drives.structure = np.eye(6)
    cell.drives = drives
    arm = MujocoArm(mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml")), names)
    check_mujoco(arm, cell, names, "tool_tip", "site", physics.cable_springs(arc))
    assert arm.model.dof_frictionloss[1] == 3.5
    assert np.allclose(arm.model.jnt_range, np.column_stack([cell.robot.limits.lower, cell.robot.limits.upper]))
    assert read_model(tmp_path / "arm.xml", tip="tool_tip").joints == names
    assert states(arm.model, names, 0).shape[2] == 6


def check_mujoco(arm, cell, names, tip, kind, springs=None, T_world_base=None):
    from mjcf_arms import cell_torques, states

    T_world_base = np.eye(4) if T_world_base is None else T_world_base
    springs = np.zeros((len(names), 2)) if springs is None else springs
    for q, qd, qdd in states(arm.model, names, 7):
        assert np.abs(arm.tip(q, tip, kind) - T_world_base @ cell.T_base_tool(q)).max() < 1e-12
        expected = cell_torques(cell, q, qd, qdd) + springs[:, 0] * (q - springs[:, 1])
        found = arm.torques(q, qd, qdd)
        assert np.abs(found - expected).max() < 1e-9 * max(1.0, np.abs(expected).max())


@pytest.mark.parametrize("seed", range(10))
def test_an_mjcf_with_a_changed_arm_in_it_moves_in_mujoco_as_the_cell(mujoco, tmp_path, seed):
    from mjcf_arms import MujocoArm, random_arm

    file, out = tmp_path / "arm.xml", tmp_path / "tuned.xml"
    file.write_text(random_arm(seed))
    tip, kind = [("tcp", "site"), ("cover", "body")][seed % 2]
    found = read_model(file, tip=tip)
    names = found.joints
    near_arm(found.cell)
    write_model(found.cell, out, file, tip=tip)
    cell = folded(found.cell)
    arm = MujocoArm(mujoco.MjModel.from_xml_path(str(out)), names)
    check_mujoco(arm, cell, names, tip, kind)
    assert np.allclose(arm.model.dof_frictionloss[arm.dof], cell.drives.friction.coulomb, rtol=0, atol=0)
    assert difference(cell, read_model(out, tip=tip).cell) < 1e-9


TEXT = """<!-- by the maker -->
<mujoco model="two">
  <compiler angle="degree" meshdir="assets"/>
  <default>
    <default class="big"><joint damping="1" armature="0.1"/></default>
  </default>
  <worldbody>
    <light pos="0 0 3"/>  <!-- a lamp -->
    <body name="a" pos="0 0 0.3" euler="0 0 30">
      <joint name="j1" class="big" axis="0 0 1" range="-90 90"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03"/>
      <body name="b" pos="0.3 0 0">
        <joint name="j2" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.02"/>
        <body name="hand" pos="0.2 0 0"><geom size="0.02" mass="0.3"/></body>
      </body>
    </body>
  </worldbody>
  <actuator><position name="servo" joint="j1" kp="100"/></actuator>
</mujoco>
"""


@pytest.fixture
def described(mujoco, tmp_path):
    file = tmp_path / "two.xml"
    file.write_text(TEXT)
    return file


def test_only_what_changed_is_changed_in_an_mjcf(described, tmp_path):
    out = tmp_path / "tuned.xml"
    cell = read_model(described).cell
    assert write_model(cell, out, described).changes == []
    assert out.read_text() == TEXT
    cell.effects = {"viscous_friction": {"joint1": {"viscous": 2.5}}, "coulomb_friction": {"joint2": {"coulomb": 0.25}}}
    written = write_model(cell, out, described)
    assert written.changes == ["joint j1: damping", "joint j2: frictionloss"]
    expected = TEXT.replace('range="-90 90"/>', 'range="-90 90" damping="2.5"/>')
    assert out.read_text() == expected.replace('axis="0 1 0"/>', 'axis="0 1 0" frictionloss="0.25"/>')


def test_masses_geometry_and_springs_are_put_into_an_mjcf(mujoco, described, tmp_path):
    from mjcf_arms import MujocoArm

    cell = near_arm(read_model(described).cell)
    effects = cell.effects.to_dict() | {"cable_spring": {"joint2": {"stiffness": 4.0, "rest": 0.5}}}
    del effects["encoder_offset"], effects["link_length"]
    cell.effects = effects | {"encoder_offset": {"joint2": {"offset": 0.01}}}
    out = tmp_path / "tuned.xml"
    written = write_model(cell, out, described)
    text = out.read_text()
    for kept in (
        "<!-- by the maker -->",
        "<!-- a lamp -->",
        '<position name="servo" joint="j1" kp="100"/>',
        'class="big"',
    ):
        assert kept in text
    assert "body b: inertial" in written.changes
    found = physics.fold_effects(cell, add_drives=True)
    assert found.cell.effects.to_dict()["cable_spring"]["joint2"]["rest"] == pytest.approx(0.49)
    arm = MujocoArm(mujoco.MjModel.from_xml_path(str(out)), ["j1", "j2"])
    check_mujoco(arm, found.cell, ["j1", "j2"], "hand", "body", physics.cable_springs(found.cell))


def test_a_tip_that_is_the_last_moving_body_gets_a_site(mujoco, described, tmp_path):
    from mjcf_arms import MujocoArm

    cell = read_model(described, tip="b").cell
    cell.effects = {"tool_offset": {"tool": {"offset": [0.01, 0.0, 0.02]}}}
    out = tmp_path / "tuned.xml"
    written = write_model(cell, out, described, tip="b")
    assert written.changes == ["site tool_tip: added to b"]
    arm = MujocoArm(mujoco.MjModel.from_xml_path(str(out)), ["j1", "j2"])
    check_mujoco(arm, folded(cell), ["j1", "j2"], "tool_tip", "site")


def test_a_file_that_includes_others_becomes_one_file(mujoco, described, tmp_path):
    scene = tmp_path / "scene.xml"
    scene.write_text(
        '<mujoco model="scene"><include file="two.xml"/>'
        '<worldbody><geom size="1 1 1" type="plane"/></worldbody></mujoco>'
    )
    cell = read_model(scene).cell
    cell.effects = {
        "viscous_friction": {"joint1": {"viscous": 2.5}},
        "payload": {"tool": {"mass": 0.5, "com": [0, 0, 0.1]}},
    }
    written = write_model(cell, tmp_path / "out.xml", scene)
    assert any("numbers to six digits" in note for note in written.notes)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out.xml"))
    assert model.dof_damping[0] == 2.5
    masses = mujoco.MjModel.from_xml_path(str(scene)).body_mass.sum() + 0.5
    assert model.body_mass.sum() == pytest.approx(masses, rel=1e-5)


def slanted_rod(mass=1.5, length=0.2):
    """Inertia of a rod without thickness along (1, 2, 3)."""
    along = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
    i = mass * length**2 / 12 * (np.eye(3) - np.outer(along, along))
    return [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]


@pytest.mark.parametrize("inertia", [[0.0] * 6, slanted_rod()], ids=["point", "rod"])
def test_a_thin_body_as_payload_is_an_mjcf_that_mujoco_takes(mujoco, arc, tmp_path, inertia):
    plain = arc.to_dict()
    plain["tool"] |= {"mass": 0.0, "com": [0, 0, 0], "inertia": [0] * 6}
    bare, loaded, again = (tmp_path / f"{name}.xml" for name in ("bare", "loaded", "again"))
    write_model(kr5.cell.Cell.from_dict(plain), bare)
    plain["tool"] |= {"mass": 1.5, "com": [0, 0, 0.05], "inertia": inertia}
    cell = kr5.cell.Cell.from_dict(plain)
    write_model(cell, loaded)
    before, after = (mujoco.MjModel.from_xml_path(str(file)) for file in (bare, loaded))
    assert after.body_mass.sum() == pytest.approx(before.body_mass.sum() + 1.5, rel=1e-6)
    assert np.sort(after.body("tool").inertia) == pytest.approx(
        np.linalg.eigvalsh(cell.tool.inertia_matrix()), abs=1e-9
    )
    # In a file that is edited, and in one that MuJoCo writes anew.
    (tmp_path / "none.xml").write_text("<mujoco><option/></mujoco>")
    for text in (TEXT, TEXT.replace("<worldbody>", '<include file="none.xml"/><worldbody>')):
        (tmp_path / "two.xml").write_text(text)
        model = read_model(tmp_path / "two.xml")
        model.cell.tool = kr5.cell.Tool(mass=1.5, com=[0, 0, 0.05], inertia=inertia)
        write_model(model.cell, again, tmp_path / "two.xml")
        before, after = (mujoco.MjModel.from_xml_path(str(file)) for file in (tmp_path / "two.xml", again))
        assert after.body_mass.sum() == pytest.approx(before.body_mass.sum() + 1.5, rel=1e-5)


def test_assets_are_found_from_another_folder(mujoco, tmp_path):
    (tmp_path / "assets").mkdir()
    (tmp_path / "other").mkdir()
    cube = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    (tmp_path / "assets/cube.obj").write_text(cube + "".join(f"f {f}\n" for f in faces))
    text = TEXT.replace(
        "<worldbody>", '<asset><mesh name="cube" file="cube.obj" scale="0.1 0.1 0.1"/></asset><worldbody>'
    )
    text = text.replace('<geom size="0.02" mass="0.3"/>', '<geom type="mesh" mesh="cube" mass="0.3"/>')
    file = tmp_path / "two.xml"
    file.write_text(text)
    cell = read_model(file).cell
    cell.effects = {"viscous_friction": {"joint1": {"viscous": 2.5}}}
    write_model(cell, tmp_path / "other/out.xml", file)
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "other/out.xml")).dof_damping[0] == 2.5


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (
            ('<body name="b" pos="0.3 0 0">', '<frame pos="0.1 0 0"><body name="b" pos="0.2 0 0">'),
            "stands in a <frame>",
        ),
        (('meshdir="assets"', 'inertiafromgeom="true"'), "inertiafromgeom computes masses anew"),
        (('meshdir="assets"', 'settotalmass="5"'), "settotalmass computes masses anew"),
    ],
)
def test_what_cannot_be_edited_is_refused(mujoco, tmp_path, change, word):
    text = TEXT.replace(*change)
    if "<frame" in text:
        text = text.replace("</body>\n    </body>\n  </worldbody>", "</body></frame>\n    </body>\n  </worldbody>")
    file = tmp_path / "two.xml"
    file.write_text(text)
    cell = read_model(file).cell
    cell.effects = {
        "payload": {"tool": {"mass": 0.5, "com": [0, 0, 0.1]}},
        "encoder_offset": {"joint2": {"offset": 0.01}},
    }
    with pytest.raises(kr5.IoError, match=word):
        write_model(cell, tmp_path / "out.xml", file)
    assert not (tmp_path / "out.xml").exists()


def sdf_model(file):
    """Poses at zero, bodies and joints of an SDF, by a reader of its own."""
    model = xml.parse(file).getroot().find("model")
    named = {e.get("name"): e for e in model if e.get("name")}

    def pose(name):
        if name in (None, "", "__model__"):
            return np.eye(4)
        element = named[name]
        at = element.find("pose")
        own = kr5.from_xyzrpy([float(v) for v in at.text.split()]) if at is not None else np.eye(4)
        parent = at.get("relative_to") if at is not None else None
        return pose(parent or element.get("attached_to")) @ own

    return model, pose


def test_an_sdf_has_the_poses_masses_and_friction_of_the_cell(arc, tmp_path):
    with_effects(arc, EFFECTS, LOST)
    written = write_model(arc, tmp_path / "arm.sdf")
    assert {p.effect for p in written.losses} == set(LOST)
    cell = folded(arc)
    model, pose = sdf_model(tmp_path / "arm.sdf")
    zero = np.zeros(6)
    assert np.abs(pose("tool_tip") - cell.T_base_tool(zero)).max() < 1e-12
    assert np.abs(pose("flange") - cell.flange(zero)).max() < 1e-12
    joints = [j for j in model.findall("joint") if j.get("type") != "fixed"]
    assert [j.get("name") for j in joints] == [f"joint_{k}" for k in range(1, 7)]
    q = np.linspace(-0.4, 0.6, 6)
    T = np.eye(4)  # each joint turns what is behind it about the Z axis of its child
    for joint, value in zip(joints, q):
        child = pose(joint.findtext("child"))
        assert joint.findtext("axis/xyz") == "0 0 1"
        T = T @ child @ kr5.to_pose([0, 0, 0, 0, 0, value]) @ np.linalg.inv(child)
    assert np.abs(T @ pose("tool_tip") - cell.T_base_tool(q)).max() < 1e-12
    links = kr5_cell.arm_links(cell).links
    for k, link in enumerate(links):
        element = next(e for e in model.findall("link") if e.get("name") == f"link_{k + 1}")
        check_sdf_body(element.find("inertial"), link.body)
        axis = joints[k].find("axis")
        assert float(axis.findtext("dynamics/friction", "0")) == link.coulomb
        assert float(axis.findtext("dynamics/damping", "0")) == link.viscous
        assert float(axis.findtext("limit/lower")) == link.lower
    tool = next(e for e in model.findall("link") if e.get("name") == "tool")
    check_sdf_body(tool.find("inertial"), cell.tool)
    assert np.abs(pose("tool") - cell.flange(zero) @ cell.tool.T_flange_sensor).max() < 1e-12


def check_sdf_body(inertial, body):
    at = kr5.from_xyzrpy([float(v) for v in inertial.findtext("pose").split()])
    found = [float(inertial.findtext(f"inertia/{key}")) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
    assert float(inertial.findtext("mass")) == body.mass
    assert np.allclose(at[:3, 3], body.com, rtol=0, atol=1e-15)
    assert np.allclose(found, body.inertia, rtol=1e-15, atol=0)


def test_a_cell_file_keeps_what_has_no_nominal_value(arc, tmp_path):
    with_effects(arc, EFFECTS, LOST, {"torque_constant": {"joint5": {"torque_constant": 0.9}}})
    written = write_model(arc, tmp_path / "cell.yaml")
    back = kr5_cell.load_cell(tmp_path / "cell.yaml")
    assert set(back.effects.to_dict()) == set(LOST)
    assert back.drives.torque_constant[4] == 0.9
    assert written.losses == [] and len(written.folded) == 13
    assert written.notes == [
        "these stay effects, for no nominal value holds them: stribeck_friction joint4, ft_bias fx"
    ]


def test_a_urdf_is_changed_in_place_and_finds_its_meshes(arc, tmp_path):
    (tmp_path / "other").mkdir()
    file = tmp_path / "robot.urdf"
    text = kr5_cell.to_urdf(arc).replace(
        '<link name="link_1">',
        '<link name="link_1"><visual><geometry><mesh filename="meshes/a.stl"/></geometry></visual>',
    )
    file.write_text(text.replace("<robot", "<!-- mine -->\n<robot"))
    model = read_model(file)
    cell = near_arm(model.cell)
    written = write_model(cell, tmp_path / "other/tuned.urdf", file, model.base, model.tip)
    out = (tmp_path / "other/tuned.urdf").read_text()
    assert "<!-- mine -->" in out and 'filename="../meshes/a.stl"' in out
    assert "joint joint_1: damping" in written.changes
    assert difference(folded(cell), read_model(tmp_path / "other/tuned.urdf").cell) < 1e-12


@pytest.mark.parametrize(
    "name", ['"meshes/a.stl"', "'meshes/a.stl'", "'meshes/the \"a\".stl'", "\"meshes/the 'a'.stl\""]
)
@pytest.mark.parametrize("equals", ["=", " = "])
def test_meshes_in_either_quotes_are_named_from_the_folder_of_the_urdf(tmp_path, name, equals):
    text = f'<robot><mesh scale="1 1 1" filename{equals}{name}/><mesh filename{equals}"package://p/b.stl"/></robot>'
    out = writing._with_meshes_of(text, tmp_path / "robot.urdf", tmp_path / "other/tuned.urdf")
    assert out == text.replace("meshes/", "../meshes/")
    xml.fromstring(out)


@pytest.mark.parametrize(
    ("output", "original", "word"),
    [
        ("arm.step", None, "found the ending '.step', expected .urdf, .xml"),
        ("arm.sdf", "robot.urdf", "an SDF is written anew; an original serves .urdf and .xml only"),
        ("arm.xml", "robot.urdf", "is a URDF, and .*arm.xml asks for an MJCF"),
        (
            "arm.urdf",
            "other.urdf",
            "the joints from base_link to tool_tip are other_1, .* those of the cell are joint_1",
        ),
        ("arm.urdf", "nothing.urdf", "nothing.urdf: No such file"),
    ],
)
def test_outputs_and_originals_that_do_not_fit_are_refused(arc, tmp_path, output, original, word):
    urdf = kr5_cell.to_urdf(arc)
    (tmp_path / "robot.urdf").write_text(urdf)
    (tmp_path / "other.urdf").write_text(urdf.replace('name="joint_', 'name="other_'))
    cell = read_model(tmp_path / "robot.urdf").cell
    with pytest.raises(kr5.IoError, match=word):
        write_model(cell, tmp_path / output, tmp_path / original if original else None)
    assert not (tmp_path / output).exists()


def test_links_without_mass_are_refused_by_simulators(arc, tmp_path):
    arc.robot.links = []
    arc.effects = {}
    for output in ("arm.xml", "arm.sdf", "arm.drake.sdf"):
        with pytest.raises(kr5.IoError, match="link 1 has a mass of 0 kg"):
            write_model(arc, tmp_path / output)
    write_model(arc, tmp_path / "arm.urdf")


def test_the_command_tells_what_is_held_and_lost(run_kr5, arc, tmp_path):
    with_effects(arc, EFFECTS, LOST)
    kr5_cell.save_cell(arc, tmp_path / "tuned.yaml")
    done = run_kr5("cell", "export", "tuned.yaml", "-o", "tuned.urdf", "--json", "said.json")
    assert done.returncode == 0, done.stderr
    assert "Effects in the model" in done.stdout and "Effects that are lost" in done.stdout
    assert "tuned.urdf: written with 10 of 12 effects." in done.stdout
    assert "N m s/rad" in done.stdout
    import json

    said = json.loads((tmp_path / "said.json").read_text())
    assert said["kind"] == "urdf" and {row["effect"] for row in said["losses"]} == set(LOST)
    assert all(row["unit"] and row["reason"] for row in said["losses"])
    table, _, _ = done.stdout.partition("Effects that are lost")
    for part in table.split("Effects in the model")[1].strip("\n").split("\n\n"):
        for effect, on in EFFECTS.items():
            (target, parameters), *_ = on.items()
            assert all(re.search(rf"^ {effect} +{target} +{p} ", part, re.MULTILINE) for p in parameters), part
    again = run_kr5("cell", "export", "tuned.yaml", "--original", "tuned.urdf", "-o", "tuned.urdf")
    assert again.returncode == 2 and "is an input of this command" in again.stderr
    other = run_kr5("cell", "export", "tuned.yaml", "--tip", "flange", "-o", "other.urdf")
    assert other.returncode == 2 and "only with --original" in other.stderr
    assert not (tmp_path / "other.urdf").exists()


SERVOS = TEXT.replace(
    '<actuator><position name="servo" joint="j1" kp="100"/></actuator>',
    '<actuator><position name="s1" joint="j1" kp="100" dampratio="1"/>'
    '<position name="s2" joint="j2" kp="50"/></actuator>',
)


def with_servos(cell):
    servo = cell.servo
    torque = list(servo.torque)
    torque[0].stiffness, torque[0].damping, torque[1].torque_limit = 70.0, 4.0, 12.0
    servo.torque = torque
    cell.servo = servo
    return cell


@pytest.mark.parametrize("original", [True, False])
def test_torque_servos_are_the_actuators_of_an_mjcf(mujoco, tmp_path, original):
    file, out = tmp_path / "two.xml", tmp_path / "tuned.xml"
    file.write_text(SERVOS)
    cell = with_servos(read_model(file).cell)
    written = write_model(cell, out, file if original else None)
    if original:
        assert written.changes == ["actuator s1: kp, kv", "actuator s2: limit"]
    again = read_model(out).cell
    for k in range(2):
        was, now = cell.servo.torque_of(k), again.servo.torque_of(k)
        assert (now.stiffness, now.damping) == (was.stiffness, was.damping)
    assert again.servo.torque_of(1).torque_limit == 12.0
    assert not any("servo" in note for note in written.notes)


def test_what_an_actuator_has_no_place_for_is_noted(mujoco, tmp_path):
    file, out = tmp_path / "two.xml", tmp_path / "tuned.xml"
    file.write_text(SERVOS)
    cell = read_model(file).cell
    servo = cell.servo
    torque = list(servo.torque)
    torque[0].delay, torque[0].dead_band = 0.03, 0.01
    servo.torque = torque
    cell.servo = servo
    notes = write_model(cell, out, file).notes
    assert any("no place for these parts of a servo: dead_band, delay" in note for note in notes)


def servo_cell(arc, **changes):
    """The arc with a torque servo a joint; changes: values of that of the second."""
    servos = [kr5_cell.TorqueServo(stiffness=100.0 + k, damping=2.0 + k, torque_limit=50.0 + k) for k in range(6)]
    for name, value in changes.items():
        setattr(servos[1], name, value)
    servo = kr5_cell.Servo(cycle=0.02)
    servo.torque = servos
    arc.servo = servo
    arc.effects = {}
    return arc


def test_torque_servos_are_controllers_of_gazebo(arc, tmp_path):
    cell = servo_cell(arc, integral=7.0, torque_limit=None, dead_band=0.01)
    written = write_model(cell, tmp_path / "arm.sdf")
    model = xml.parse(tmp_path / "arm.sdf").getroot().find("model")
    plugins = model.findall("plugin")
    assert {p.get("name") for p in plugins} == {"gz::sim::systems::JointPositionController"}
    joints = [j for j in model.findall("joint") if j.get("type") != "fixed"]
    for k, (joint, plugin) in enumerate(zip(joints, plugins)):
        servo = cell.servo.torque_of(k)
        assert plugin.findtext("joint_name") == joint.get("name")
        found = {key: float(plugin.findtext(key)) for key in ("p_gain", "i_gain", "d_gain", "cmd_max", "cmd_min")}
        limit = 1e9 if servo.torque_limit is None else servo.torque_limit
        assert list(found.values()) == [servo.stiffness, servo.integral, 0.0, limit, -limit]
        # The damping of the controller would act on the error: it stands in that of the joint.
        assert float(joint.findtext("axis/dynamics/damping")) == cell.drives.friction.viscous[k] + servo.damping
    assert any("no place for these parts of a servo: dead_band" in note for note in written.notes)
    assert any("torque limits do not hold for it" in note for note in written.notes)


def test_torque_servos_are_actuators_of_drake(arc, tmp_path):
    cell = servo_cell(arc, delay=0.03)
    cell.effects = {"coulomb_friction": {"joint2": {"coulomb": 3.5}}, "servo_damping": {"joint3": {"damping": 9.0}}}
    written = write_model(cell, tmp_path / "arm.drake.sdf")
    root = xml.parse(tmp_path / "arm.drake.sdf").getroot()
    joints = [j for j in root.iter("joint") if j.get("type") != "fixed"]
    links = kr5_cell.arm_links(folded(cell)).links
    drake = "{http://drake.mit.edu}"
    for k, (joint, link) in enumerate(zip(joints, links)):
        servo = folded(cell).servo.torque_of(k)
        gains = joint.find(f"{drake}controller_gains")
        assert (float(gains.get("p")), float(gains.get("d"))) == (servo.stiffness, servo.damping)
        assert float(joint.findtext(f"{drake}rotor_inertia")) == link.armature > 0
        assert float(joint.findtext(f"{drake}gear_ratio")) == 1.0
        assert float(joint.findtext("axis/limit/effort")) == servo.torque_limit
        assert float(joint.findtext("axis/dynamics/damping")) == link.viscous
        assert joint.find("axis/dynamics/friction") is None
    assert rows(written.losses) == {("coulomb_friction", "joint2", "coulomb")}
    assert written.losses[0].reason == "an SDF of Drake has no place for dry friction of a joint"
    assert any("parts of a servo: delay" in note for note in written.notes)


def as_given(name, **arguments):
    return name, arguments


def isaac_actuators(file):
    """What Isaac Lab is given by a file: classes and their arguments."""
    import ast

    given = {}
    values = {}
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.ImportFrom):
            assert node.module == "isaaclab.actuators"
            names = [alias.name for alias in node.names]
            given = {name: functools.partial(as_given, name) for name in names}
        if isinstance(node, ast.Assign):
            exec(compile(ast.Module([node], []), str(file), "exec"), {**given, **values, "round": round}, values)
    return values["ACTUATORS"], values["PHYSICS_STEP"]


def test_torque_servos_are_actuators_of_isaac_lab(arc, tmp_path):
    cell = servo_cell(arc, delay=0.034, dead_band=0.01)
    cell.robot.joint_names = [f"a.{k}" for k in range(6)]
    cell.effects = {"link_mass": {"joint2": {"mass": 25.0}}, "viscous_friction": {"joint4": {"viscous": 1.25}}}
    written = write_model(cell, tmp_path / "actuators.py")
    groups, step = isaac_actuators(tmp_path / "actuators.py")
    assert [kind for kind, _ in groups.values()] == ["ImplicitActuatorCfg", "DelayedPDActuatorCfg"]
    links = kr5_cell.arm_links(folded(cell)).links
    seen = set()
    for _, given in groups.values():
        for expression in given["joint_names_expr"]:
            (k,) = [k for k, link in enumerate(links) if re.fullmatch(expression, link.joint)]
            seen.add(k)
            servo, link = folded(cell).servo.torque_of(k), links[k]
            wanted = {
                "stiffness": servo.stiffness,
                "damping": servo.damping,
                "effort_limit": servo.torque_limit,
                "armature": link.armature,
                "friction": link.coulomb,
                "dynamic_friction": link.coulomb,
                "viscous_friction": link.viscous,
                "velocity_limit": link.velocity,
            }
            assert {name: given[name][expression] for name in wanted} == wanted
            delay = round(0.034 / step) if k == 1 else None
            assert given.get("min_delay") == given.get("max_delay") == delay
    assert seen == set(range(6))
    assert rows(written.losses) == {("link_mass", "joint2", "mass")}
    assert any("parts of a servo: dead_band" in note for note in written.notes)


def test_a_motor_of_isaac_lab_has_its_supply_voltage(arc, tmp_path):
    cell = servo_cell(arc, stall_torque=80.0, no_load_speed=5.0)
    write_model(cell, tmp_path / "actuators.py")
    groups, _ = isaac_actuators(tmp_path / "actuators.py")
    (motor,) = [given for kind, given in groups.values() if kind == "DCMotorCfg"]
    assert motor["saturation_effort"] == 80.0 and list(motor["velocity_limit"].values()) == [5.0]
    arc.servo = None
    with pytest.raises(kr5.IoError, match="has no torque servos"):
        write_model(arc, tmp_path / "none.py")


@pytest.mark.parametrize("kept", ["edited", "flattened", "new"])
def test_dry_friction_is_stated_as_it_fits_best_in_mujoco(mujoco, tmp_path, kept):
    from kr5.models.mjcf_actuators import DryFriction

    file, out = tmp_path / "two.xml", tmp_path / "tuned.xml"
    (tmp_path / "none.xml").write_text("<mujoco><option/></mujoco>")
    text = SERVOS.replace('name="j2"', 'name="j2" frictionloss="0.5"')
    file.write_text(text if kept == "edited" else text.replace("<worldbody>", '<include file="none.xml"/><worldbody>'))
    friction = DryFriction(scale=0.8, time_constant=0.005, impedance=0.99)
    written = write_model(read_model(file).cell, out, None if kept == "new" else file, friction=friction)
    model = mujoco.MjModel.from_xml_path(str(out))
    assert model.dof_frictionloss == pytest.approx([0.0, 0.4])
    assert model.dof_solref[1] == pytest.approx([0.005, 1.0]) and model.dof_solimp[1, :2] == pytest.approx(0.99)
    assert model.dof_solref[0] == pytest.approx([0.02, 1.0])  # which has none
    assert any("0.8 times the dry friction" in note for note in written.notes)
