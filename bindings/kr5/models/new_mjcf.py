"""A new MJCF of the arm of a cell."""

import math
import xml.etree.ElementTree as xml

import numpy as np

import kr5.cell
import kr5.kinematics
from kr5 import cell as kr5_cell
from kr5.files.xml_text import add_element, document_text, number_text, quaternion, rounded_pose
from kr5.models.mjcf_actuators import AS_FOUND, DryFriction
from kr5.models.simulator_masses import inertial_attributes, require_masses

THICKNESS = 0.02  # radius of the links that a viewer shows [m]
SHORTEST = 1e-3  # of a link to show [m]


def mjcf_text(cell: kr5.cell.Cell, springs: np.ndarray, friction: DryFriction = AS_FOUND) -> str:
    """MJCF of arm and tool, effects apart: bodies link_1 ... link_n, joint friction and limits, the drives' inertia as
    armature, gravity, and the tip as site tool_tip. The base is the world.

    springs: stiffness [N m/rad or N/m] and joint value without torque, n x 2; friction: how dry friction is stated.
    Raises IoError for links without mass.
    """
    arm = kr5_cell.arm_links(cell)
    require_masses(arm, cell.name, "MuJoCo")
    root = xml.Element("mujoco", {"model": cell.name or "robot"})
    add_element(root, "compiler", angle="radian", autolimits="true")
    add_element(root, "option", gravity=cell.robot.gravity)
    parent, T_base_parent = add_element(root, "worldbody"), np.eye(4)
    ends = [*(link.T_base_link for link in arm.links[1:]), arm.T_base_tip]
    for k, (link, end) in enumerate(zip(arm.links, ends)):
        parent = _add_body(parent, f"link_{k + 1}", np.linalg.inv(T_base_parent) @ link.T_base_link)
        _add_inertial(parent, link.body)
        _add_joint(parent, link, springs[k], friction)
        T_base_parent = link.T_base_link
        _add_shape(parent, np.linalg.inv(T_base_parent) @ end)
    _add_tool(parent, np.linalg.inv(T_base_parent) @ arm.T_base_tip, cell.tool)
    _add_servos(root, arm, cell)
    return document_text(root)


def _add_body(parent: xml.Element, name: str, T: np.ndarray) -> xml.Element:
    T = rounded_pose(T)
    return add_element(parent, "body", name=name, pos=T[:3, 3], quat=quaternion(T))


def _add_inertial(body: xml.Element, found: kr5.kinematics.Body | kr5.cell.Tool) -> None:
    add_element(body, "inertial", pos=found.com, mass=found.mass, **inertial_attributes(found))


def _add_joint(body: xml.Element, link: kr5.cell.ArmLink, spring: np.ndarray, friction: DryFriction) -> None:
    bounded = math.isfinite(link.lower) and math.isfinite(link.upper)
    stiffness, rest = spring
    add_element(
        body,
        "joint",
        name=link.joint,
        type="slide" if str(link.type) == "prismatic" else "hinge",
        axis="0 0 1",
        range=[link.lower, link.upper] if bounded else None,
        actuatorfrcrange=[-link.effort, link.effort] if math.isfinite(link.effort) else None,
        damping=link.viscous or None,
        frictionloss=friction.scale * link.coulomb or None,
        armature=link.armature or None,
        stiffness=stiffness or None,
        springref=rest if stiffness else None,
        **(friction.solver() if link.coulomb else {}),
    )


def _add_shape(body: xml.Element, T_body_end: np.ndarray) -> None:
    """What a viewer shows; it has no mass and touches nothing."""
    end = rounded_pose(T_body_end)[:3, 3]
    if np.linalg.norm(end) < SHORTEST:
        return
    line = f"0 0 0 {number_text(end)}"
    add_element(
        body, "geom", type="capsule", fromto=line, size=THICKNESS, mass="0", contype="0", conaffinity="0", group="2"
    )


def _add_servos(root: xml.Element, arm: kr5.cell.ArmLinks, cell: kr5.cell.Cell) -> None:
    if cell.servo is None or not cell.servo.torque:
        return
    actuators = add_element(root, "actuator")
    for k, link in enumerate(arm.links):
        servo = cell.servo.torque_of(k)
        limit = servo.torque_limit
        add_element(
            actuators,
            "position",
            name=link.joint,
            joint=link.joint,
            kp=servo.stiffness,
            kv=servo.damping or None,
            forcerange=[-limit, limit] if limit is not None else None,
        )


def _add_tool(body: xml.Element, T_body_flange: np.ndarray, tool: kr5.cell.Tool | None) -> None:
    if tool is not None and tool.mass > 0:
        sensor = _add_body(body, "tool", T_body_flange @ tool.T_flange_sensor)
        _add_inertial(sensor, tool)
    T = rounded_pose(T_body_flange @ (tool.T_flange_tool if tool is not None else np.eye(4)))
    add_element(body, "site", name="tool_tip", pos=T[:3, 3], quat=quaternion(T))
