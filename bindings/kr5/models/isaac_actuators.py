"""The torque servos of a cell as actuators of Isaac Lab: the text of a Python file."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass

import kr5
import kr5.cell
from kr5 import cell as kr5_cell

PHYSICS_STEP = 0.005  # [s] of a simulation of Isaac Lab that states none other
HEAD = '''"""Actuators of {name} for Isaac Lab, written by kr5 {version}: ArticulationCfg(actuators=ACTUATORS, ...).

In SI units of the joints. Friction is a torque, as Isaac Sim takes it from version 5.0 on.
"""

from isaaclab.actuators import {classes}

PHYSICS_STEP = {step}  # [s] set this to the step of your simulation (SimulationCfg.dt), in which delays are counted

ACTUATORS = {{
'''


@dataclass
class _Joint:
    """A joint with its servo."""

    link: kr5.cell.ArmLink
    servo: kr5.cell.TorqueServo

    @property
    def delay(self) -> float:
        return self.servo.delay

    @property
    def is_motor(self) -> bool:
        """Whether the supply voltage limits its torque, which no delayed actuator of Isaac Lab has."""
        return not self.delay and None not in (self.servo.stall_torque, self.servo.no_load_speed)

    @property
    def kind(self) -> str:
        if self.delay:
            return "DelayedPDActuatorCfg"
        return "DCMotorCfg" if self.is_motor else "ImplicitActuatorCfg"


def isaac_text(cell: kr5.cell.Cell) -> str:
    """A Python file with a dictionary ACTUATORS, effects apart: joints whose servos have one delay, and one motor, are
    a group. Raises IoError for a cell without torque servos."""
    if cell.servo is None or not cell.servo.torque:
        raise kr5.IoError(
            f"{cell.name or 'cell'}: has no torque servos, which actuators of Isaac Lab are made of; state them with"
            " --set 'cell.servo.torque={stiffness: 20, damping: 1}', or give an MJCF with position actuators"
        )
    joints = [_Joint(link, cell.servo.torque_of(k)) for k, link in enumerate(kr5_cell.arm_links(cell).links)]
    groups: dict[tuple[str, float, float | None], list[_Joint]] = {}
    for joint in joints:
        groups.setdefault((joint.kind, joint.delay, joint.servo.stall_torque if joint.is_motor else None), []).append(
            joint
        )
    classes = ", ".join(sorted({kind for kind, _, _ in groups}))
    head = HEAD.format(name=cell.name or "the robot", version=kr5.__version__, classes=classes, step=PHYSICS_STEP)
    names = ["servos"] if len(groups) == 1 else [f"servos_{k + 1}" for k in range(len(groups))]
    return head + "".join(_group_text(name, group) for name, group in zip(names, groups.values())) + "}\n"


def _group_text(name: str, joints: list[_Joint]) -> str:
    first = joints[0]
    rows: list[tuple[str, Callable[[_Joint], float | None]]] = [
        ("stiffness", lambda j: j.servo.stiffness),
        ("damping", lambda j: j.servo.damping),
        ("effort_limit", lambda j: j.servo.torque_limit),
        ("velocity_limit", lambda j: j.servo.no_load_speed if j.is_motor else _finite(j.link.velocity)),
        ("armature", lambda j: j.link.armature),
        ("friction", lambda j: j.link.coulomb),
        ("dynamic_friction", lambda j: j.link.coulomb),
        ("viscous_friction", lambda j: j.link.viscous),
    ]
    expressions = [re.escape(j.link.joint) for j in joints]
    lines = [f"joint_names_expr={expressions!r}"]
    for attribute, value in rows:
        values = {key: v for key, joint in zip(expressions, joints) if (v := value(joint)) is not None}
        lines += [f"{attribute}={values!r}"] if values else []
    if first.delay:
        lines += [f"{key}=round({first.delay!r} / PHYSICS_STEP)" for key in ("min_delay", "max_delay")]
    if first.is_motor:
        lines.append(f"saturation_effort={first.servo.stall_torque!r}")
    body = "".join(f"        {line},\n" for line in lines)
    return f'    "{name}": {first.kind}(\n{body}    ),\n'


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
