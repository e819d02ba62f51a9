"""Poses in the forms that ROS, URDF, OpenCV, spreadsheets and programs read."""

import json
import xml.etree.ElementTree as xml
from collections.abc import Callable, Sequence

import kr5
import numpy as np
from kr5.files.xml_text import add_element, number_text, quaternion

from kr5_tools.exports.items import ExportPose

PUBLISHER = "static_transform_publisher"
LAUNCH = '''"""Static transforms, written by kr5."""

from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription(
        [
{nodes}
        ]
    )
'''
LAUNCH_NODE = """            Node(
                package="tf2_ros",
                executable="static_transform_publisher",
                name={name},
                arguments=[{arguments}],
            ),"""


def numbers(values: Sequence[float] | np.ndarray) -> list[str]:
    """Numbers that read back exactly."""
    return [number_text(v) for v in values]


def _arguments(pose: ExportPose) -> list[str]:
    w, x, y, z = quaternion(pose.T)
    values = dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), numbers([*pose.T[:3, 3], x, y, z, w])))
    out = [word for key, value in values.items() for word in (f"--{key}", value)]
    return [*out, "--frame-id", pose.parent, "--child-frame-id", pose.child]


def ros_command(poses: list[ExportPose]) -> str:
    """A command line of ROS 2 for each pose."""
    return "".join(f"ros2 run tf2_ros {PUBLISHER} {' '.join(_arguments(pose))}\n" for pose in poses)


def _node_name(pose: ExportPose) -> str:
    return pose.name.removeprefix("T_") + "_publisher"


def launch_python(poses: list[ExportPose]) -> str:
    """A launch file of ROS 2 in Python."""
    nodes = (
        LAUNCH_NODE.format(
            name=json.dumps(_node_name(pose)), arguments=", ".join(json.dumps(word) for word in _arguments(pose))
        )
        for pose in poses
    )
    return LAUNCH.format(nodes="\n".join(nodes))


def launch_xml(poses: list[ExportPose]) -> str:
    """A launch file of ROS 2 in XML."""
    root = xml.Element("launch")
    for pose in poses:
        words = " ".join(_arguments(pose))
        add_element(root, "node", pkg="tf2_ros", exec=PUBLISHER, name=_node_name(pose), args=words)
    return _indented(root)


def _indented(element: xml.Element) -> str:
    xml.indent(element)
    return xml.tostring(element, encoding="unicode") + "\n"


def urdf_joint(pose: ExportPose) -> str:
    """A fixed joint of a URDF, and the link that it carries."""
    joint = xml.Element("joint", {"name": f"{pose.parent}-{pose.child}", "type": "fixed"})
    x = kr5.to_xyzrpy(pose.T)
    add_element(joint, "origin", xyz=x[:3], rpy=x[3:])
    add_element(joint, "parent", link=pose.parent)
    add_element(joint, "child", link=pose.child)
    return f'<link name="{pose.child}"/>\n{_indented(joint)}'


def urdf(poses: list[ExportPose]) -> str:
    """A URDF of nothing but these fixed joints, to be included in one with xacro, or copied into it."""
    children = {pose.child for pose in poses}
    roots = dict.fromkeys(pose.parent for pose in poses if pose.parent not in children)
    lines = [f'<link name="{root}"/>' for root in roots]
    lines += [line for pose in poses for line in urdf_joint(pose).splitlines()]
    return '<?xml version="1.0"?>\n<robot name="frames">\n' + "".join(f"  {line}\n" for line in lines) + "</robot>\n"


def matrix_text(poses: list[ExportPose]) -> str:
    """4x4 matrices, each under a line with its name, as numpy.loadtxt reads them."""
    out = []
    for pose in poses:
        out.append(f"# {pose.name} [m]: pose of {pose.child} in {pose.parent}\n")
        out += [" ".join(numbers(row)) + "\n" for row in pose.T]
    return "".join(out)


def csv(poses: list[ExportPose]) -> str:
    """A row a pose: names, position [m], quaternion."""
    rows = ["parent,child,x,y,z,qx,qy,qz,qw"]
    for pose in poses:
        w, x, y, z = quaternion(pose.T)
        rows.append(",".join([pose.parent, pose.child, *numbers([*pose.T[:3, 3], x, y, z, w])]))
    return "\n".join(rows) + "\n"


def json_text(poses: list[ExportPose]) -> str:
    """Matrix, position [m], quaternion and roll, pitch, yaw [rad] of each pose."""
    out = []
    for pose in poses:
        w, x, y, z = map(float, quaternion(pose.T))
        out.append(
            {
                "parent": pose.parent,
                "child": pose.child,
                "matrix": pose.T.tolist(),
                "xyz": pose.T[:3, 3].tolist(),
                "quaternion_xyzw": [x, y, z, w],
                "rpy": kr5.to_xyzrpy(pose.T)[3:].tolist(),
            }
        )
    return json.dumps({"poses": out}, indent=1) + "\n"


PoseForm = Callable[[list[ExportPose]], str]
