"""The actuators of an MJCF as torque servos of a cell, and back."""

from dataclasses import dataclass
from typing import Any

import numpy as np

import kr5.cell

SAME = 1e-9  # [-] between the gain of a command and that of a position, which a position servo has alike
STATED_SERVOS = "--set cell.servo.cycle=0.02 --set 'cell.servo.torque={stiffness: 20, damping: 1}'"  # to be typed


@dataclass(frozen=True)
class Actuator:
    """An actuator of MuJoCo as a torque servo: torque = stiffness (command / gear - q) - damping qd."""

    number: int  # in the model
    name: str
    gear: float
    stiffness: float  # [N m/rad or N/m]
    damping: float  # [N m s/rad or N s/m]
    limit: float | None  # [N m or N]
    other_limit: float | None = None  # in the other direction, where that is another


@dataclass(frozen=True)
class DryFriction:
    """How MuJoCo is to take dry friction, which it softens. Absent numbers: as the model states them."""

    scale: float = 1.0  # of each frictionloss [-]
    time_constant: float | None = None  # of solreffriction [s]
    impedance: float | None = None  # both ends of solimpfriction [-]

    def solver(self) -> dict[str, list[float]]:
        """Attributes of a joint of MJCF."""
        out = {}
        if self.time_constant is not None:
            out["solreffriction"] = [self.time_constant, 1.0]
        if self.impedance is not None:
            out["solimpfriction"] = [self.impedance, self.impedance]
        return out


AS_FOUND = DryFriction()


def driving(model: Any, joint: int) -> list[int]:
    """Numbers of the actuators that act on a joint."""
    import mujoco

    kinds = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    return [
        i for i in range(model.nu) if int(model.actuator_trntype[i]) in kinds and model.actuator_trnid[i, 0] == joint
    ]


def position_servo(model: Any, joint: int) -> Actuator | None:
    """The only actuator of a joint, where it is a position servo."""
    import mujoco

    found = driving(model, joint)
    if len(found) != 1:
        return None
    i = found[0]
    kinds = (int(model.actuator_gaintype[i]), int(model.actuator_biastype[i]), int(model.actuator_dyntype[i]))
    wanted = (mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE, mujoco.mjtDyn.mjDYN_NONE)
    if kinds != tuple(map(int, wanted)):
        return None
    gear, gain = float(model.actuator_gear[i, 0]), float(model.actuator_gainprm[i, 0])
    constant, slope, rate = map(float, model.actuator_biasprm[i, :3])
    servo = gain > 0 and gear != 0 and constant == 0 and abs(slope + gain) <= SAME * gain and rate <= 0
    if not servo:
        return None
    name = str(model.actuator(i).name)
    return Actuator(i, name, gear, gear**2 * gain, -(gear**2) * rate, *_limits(model, joint, i))


def _limits(model: Any, joint: int, actuator: int) -> tuple[float | None, float | None]:
    """The torque of a servo at most [N m or N], and in the other direction, where that is another. A range on one side
    of zero is that of its farther end."""
    low, high = -np.inf, np.inf
    if model.actuator_forcelimited[actuator]:
        low, high = sorted(float(model.actuator_gear[actuator, 0]) * model.actuator_forcerange[actuator])
    if model.jnt_actfrclimited[joint]:
        low, high = max(low, model.jnt_actfrcrange[joint, 0]), min(high, model.jnt_actfrcrange[joint, 1])
    sides = sorted(float(abs(side)) for side in (low, high))
    least = sides[0] if low < 0 < high else sides[1]
    other = sides[0] if least == sides[1] else sides[1]
    if not np.isfinite(least):
        return None, None
    return least, other if abs(other - least) > SAME * least else None


def command_ranges(model: Any, joints: list[int]) -> dict[int, tuple[float, float]]:
    """Within which MuJoCo holds the commands of joints with position servos [rad or m], by their numbers."""
    import mujoco

    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL:
        return {}
    out = {}
    for joint in joints:
        servo = position_servo(model, joint)
        if servo is not None and model.actuator_ctrllimited[servo.number]:
            low, high = sorted(float(x) / servo.gear for x in model.actuator_ctrlrange[servo.number])
            out[joint] = (low, high)
    return out


def servos_of(model: Any, joints: list[int]) -> kr5.cell.Servo | None:
    """The servos of the joints of an arm, where each has a position servo."""
    found = [position_servo(model, joint) for joint in joints]
    servos = [servo for servo in found if servo is not None]
    if not joints or len(servos) < len(joints):
        return None
    out = kr5.cell.Servo()
    out.cycle = float(model.opt.timestep)
    out.torque = [kr5.cell.TorqueServo(stiffness=s.stiffness, damping=s.damping, torque_limit=s.limit) for s in servos]
    return out


def servo_notes(model: Any, joints: dict[int, str]) -> list[str]:
    """What was made of the actuators of the joints of an arm, in words. joints: names by number."""
    moved = {joint: driving(model, joint) for joint in joints}
    if not any(moved.values()):
        return []
    if servos_of(model, list(joints)) is None:
        other = [f"{name} ({_kind(model, j)})" for j, name in joints.items() if position_servo(model, j) is None]
        return [
            f"the actuators are not read, for {', '.join(other)} have no position servo (position, or general with"
            " affine bias and one gain) of their own; state the servos that the arm has, as starting values for the"
            f" diagnosis: {STATED_SERVOS}"
        ]
    notes = ["the actuators are the torque servos of the cell (servo.torque)"]
    servos = {joint: servo for joint in joints if (servo := position_servo(model, joint)) is not None}
    if geared := [servo.name for servo in servos.values() if servo.gear != 1.0]:
        notes.append(f"commands of {', '.join(geared)} count on the side of the motor: divide them by the gear")
    if uneven := [(joint, servo) for joint, servo in servos.items() if servo.other_limit is not None]:
        told = ", ".join(f"{s.name} ({s.limit:g} and {s.other_limit:g} {_load_unit(model, j)})" for j, s in uneven)
        notes.append(
            f"the force of {told} is limited in both directions unlike, and in the cell alike: by the first of them"
        )
    return notes


def _load_unit(model: Any, joint: int) -> str:
    import mujoco

    return "N" if int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_SLIDE) else "N m"


def _kind(model: Any, joint: int) -> str:
    """What drives a joint, in the words of MJCF."""
    import mujoco

    found = driving(model, joint)
    if len(found) != 1:
        return "no actuator" if not found else f"{len(found)} actuators"
    i = found[0]
    if int(model.actuator_dyntype[i]) != int(mujoco.mjtDyn.mjDYN_NONE):
        return "an actuator with a state"
    bias = int(model.actuator_biastype[i])
    if bias == int(mujoco.mjtBias.mjBIAS_NONE):
        return "motor"
    gain, slope, rate = (float(model.actuator_gainprm[i, 0]), *map(float, model.actuator_biasprm[i, 1:3]))
    return "velocity" if slope == 0 and rate == -gain < 0 else "general"
