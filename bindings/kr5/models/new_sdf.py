"""A new SDF 1.9 of the arm of a cell, as Gazebo or Drake reads it."""

import math
import xml.etree.ElementTree as xml
from typing import Any

import numpy as np

import kr5
import kr5.cell
import kr5.kinematics
from kr5 import cell as kr5_cell
from kr5.files.xml_text import add_element, document_text, rounded_pose
from kr5.models.kinds import Kind
from kr5.models.simulator_masses import require_masses

VERSION = "1.9"
DRAKE = "http://drake.mit.edu"  # name space of its elements
CONTROLLER = "gz-sim-joint-position-controller"
CONTROLLER_CLASS = "gz::sim::systems::JointPositionController"
NO_LIMIT = 1e9  # [N m or N] in place of the limit of a controller, which has one where none is stated
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")  # in the order of a Body


def sdf_text(cell: kr5.cell.Cell, springs: np.ndarray, kind: Kind = Kind.SDF) -> str:
    """SDF of arm and tool, effects apart: base_link fixed to the world, links link_1 ... link_n, joint friction and
    limits, torque servos as joint controllers, and frames flange and tool_tip. Of Drake (Kind.DRAKE) the servos are the
    gains of joint actuators, with rotors beside them and no dry friction, which Drake does not read.

    springs: stiffness [N m/rad or N/m] and joint value without torque, n x 2. Raises IoError for links without mass.
    """
    arm = kr5_cell.arm_links(cell)
    require_masses(arm, cell.name, "Drake" if kind == Kind.DRAKE else "Gazebo")
    servos = _servos(cell)
    root = xml.Element("sdf", {"version": VERSION})
    if kind == Kind.DRAKE:
        root.set("xmlns:drake", DRAKE)
    model = add_element(root, "model", name=cell.name or "robot")
    add_element(model, "link", name="base_link")
    _add_joint(model, "world-base_link", "fixed", "world", "base_link")
    parent, T_base_parent = "base_link", np.eye(4)
    for k, link in enumerate(arm.links):
        name = f"link_{k + 1}"
        _add_link(model, name, np.linalg.inv(T_base_parent) @ link.T_base_link, parent, link.body)
        drive = _add_drake_joint if kind == Kind.DRAKE else _add_gazebo_joint
        drive(model, link, (parent, name), springs[k], servos[k] if servos else None)
        parent, T_base_parent = name, link.T_base_link
    _add_frame(model, "flange", parent, np.linalg.inv(T_base_parent) @ arm.T_base_tip)
    tool = cell.tool
    if tool is not None and tool.mass > 0:
        _add_link(model, "tool", tool.T_flange_sensor, "flange", tool)
        _add_joint(model, "flange-tool", "fixed", parent, "tool")
    _add_frame(model, "tool_tip", "flange", tool.T_flange_tool if tool is not None else np.eye(4))
    return document_text(root)


def _add_pose(parent: xml.Element, T: np.ndarray, relative_to: str | None = None) -> None:
    add_element(parent, "pose", kr5.to_xyzrpy(rounded_pose(T)), relative_to=relative_to)


def _add_frame(model: xml.Element, name: str, attached_to: str, T: np.ndarray) -> None:
    _add_pose(add_element(model, "frame", name=name, attached_to=attached_to), T)


def _add_link(
    model: xml.Element, name: str, T: np.ndarray, relative_to: str, body: kr5.kinematics.Body | kr5.cell.Tool
) -> None:
    link = add_element(model, "link", name=name)
    _add_pose(link, T, relative_to)
    inertial = add_element(link, "inertial")
    at = np.eye(4)
    at[:3, 3] = body.com
    _add_pose(inertial, at)
    add_element(inertial, "mass", body.mass)
    inertia = add_element(inertial, "inertia")
    for key, value in zip(MOMENTS, body.inertia):
        add_element(inertia, key, float(value))


def _add_joint(model: xml.Element, name: str, kind: str, parent: str, child: str) -> xml.Element:
    joint = add_element(model, "joint", name=name, type=kind)
    add_element(joint, "parent", parent)
    add_element(joint, "child", child)
    return joint


def _servos(cell: kr5.cell.Cell) -> list[kr5.cell.TorqueServo]:
    if cell.servo is None or not cell.servo.torque:
        return []
    return [cell.servo.torque_of(k) for k in range(cell.robot.joints)]


def _add_gazebo_joint(
    model: xml.Element,
    link: kr5.cell.ArmLink,
    between: tuple[str, str],
    spring: np.ndarray,
    servo: kr5.cell.TorqueServo | None,
) -> None:
    """The damping of a servo acts on the joint and not, as that of the controller would, on the error."""
    damping = link.viscous + (servo.damping if servo else 0.0)
    _add_moving_joint(model, link, between, spring, {"damping": damping, "friction": link.coulomb}, link.effort)
    if servo is None:
        return
    plugin = add_element(model, "plugin", filename=f"{CONTROLLER}-system", name=CONTROLLER_CLASS)
    add_element(plugin, "joint_name", link.joint)
    limit = servo.torque_limit if servo.torque_limit is not None else NO_LIMIT
    gains = {"p_gain": servo.stiffness, "i_gain": servo.integral, "d_gain": 0.0}
    bounds = {"i_max": limit, "i_min": -limit, "cmd_max": limit, "cmd_min": -limit}
    for key, value in (gains | bounds).items():
        add_element(plugin, key, value)


def _add_drake_joint(
    model: xml.Element,
    link: kr5.cell.ArmLink,
    between: tuple[str, str],
    spring: np.ndarray,
    servo: kr5.cell.TorqueServo | None,
) -> None:
    limit = servo.torque_limit if servo is not None and servo.torque_limit is not None else link.effort
    joint = _add_moving_joint(model, link, between, spring, {"damping": link.viscous}, limit)
    if link.armature:
        add_element(joint, "drake:rotor_inertia", link.armature)
        add_element(joint, "drake:gear_ratio", 1.0)  # the inertia is that on the side of the joint
    if servo is not None:
        add_element(joint, "drake:controller_gains", p=servo.stiffness, d=servo.damping)


def _add_moving_joint(
    model: xml.Element,
    link: kr5.cell.ArmLink,
    between: tuple[str, str],
    spring: np.ndarray,
    friction: dict[str, float],
    effort: float,
) -> xml.Element:
    bounded = math.isfinite(link.lower) and math.isfinite(link.upper)
    kind = "prismatic" if str(link.type) == "prismatic" else "revolute" if bounded else "continuous"
    joint = _add_joint(model, link.joint, kind, *between)
    axis = add_element(joint, "axis")
    add_element(axis, "xyz", "0 0 1")
    limits = {"lower": link.lower, "upper": link.upper} if bounded else {}
    limits |= {key: value for key, value in (("effort", effort), ("velocity", link.velocity)) if math.isfinite(value)}
    if limits:
        limit = add_element(axis, "limit")
        for key, value in limits.items():
            add_element(limit, key, value)
    stiffness, rest = map(float, spring)
    dynamics = friction | {"spring_stiffness": stiffness}
    if stiffness:
        dynamics["spring_reference"] = rest
    if any(dynamics.values()):
        element = add_element(axis, "dynamics")
        for key, value in dynamics.items():
            add_element(element, key, value)
    return joint
