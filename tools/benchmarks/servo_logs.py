"""Drawn MuJoCo arms that follow commands by position servos, logged as CSV; the model of an arm with effects withheld,
and what another model leaves in a log."""

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import servo_forces
from servo_forces import StepForce

TICK = 2 * np.pi / 4096  # of the encoders [rad]
NOISE = TICK / 12**0.5  # that rounding makes [rad]
STEP = 0.001  # of the simulation [s]
AXES = {4: "zyyy", 6: "zyyxyx", 7: "zyxyxyx"}
VECTORS = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


@dataclass
class Joint:
    """A joint with its link and its servo; what it carries lies along X, of the first joint along Z."""

    name: str
    axis: str
    length: float  # of the link [m]
    mass: float  # [kg]
    width: float  # of the link, for its inertia [m]
    stiffness: float = 0.0  # [N m/rad]
    damping: float = 0.0  # of the servo [N m s/rad]
    viscous: float = 0.0  # [N m s/rad]
    coulomb: float = 0.0  # [N m]
    armature: float = 0.0  # [kg m^2]
    limit: float = 0.0  # [N m]


@dataclass
class Arm:
    joints: list[Joint]
    payload: float = 0.0  # [kg]
    delay: float = 0.0  # of the commands [s]
    forces: list[StepForce] = field(default_factory=list)  # which no MJCF holds

    def xml(self, integrator: str = "implicitfast", step: float = STEP, solver: str = "") -> str:
        """solver: further attributes of each joint."""
        opened, closed, place = "", "", "0 0 0.05"
        for j in self.joints:
            along = np.array([0.0, 0.0, j.length]) if j is self.joints[0] else np.array([j.length, 0.0, 0.0])
            long, thin = j.mass * j.length**2 / 12 + j.mass * j.width**2, 2 * j.mass * j.width**2
            moments = (long, long, thin) if j is self.joints[0] else (thin, long, long)
            opened += (
                f'<body name="{j.name}_link" pos="{place}"><joint name="{j.name}" type="hinge" axis="{VECTORS[j.axis]}"'
                f' damping="{j.viscous:.9g}" frictionloss="{j.coulomb:.9g}" armature="{j.armature:.9g}"{solver}/>'
                f'<inertial pos="{_text(along / 2)}" mass="{j.mass:.9g}" diaginertia="{_text(moments)}"/>'
            )
            place = _text(along)
            closed += "</body>"
        if self.payload:
            opened += f'<body name="load" pos="{place}"><inertial pos="0 0 0" mass="{self.payload:.9g}"'
            opened += f' diaginertia="{_text([self.payload * 4e-4] * 3)}"/></body>'
        servos = "".join(
            f'<position name="{j.name}" joint="{j.name}" kp="{j.stiffness:.9g}" kv="{j.damping:.9g}"'
            f' forcerange="{-j.limit:.9g} {j.limit:.9g}"/>'
            for j in self.joints
        )
        return (
            f'<mujoco model="arm"><option timestep="{step}" integrator="{integrator}"/>'
            f"<worldbody>{opened}{closed}</worldbody><actuator>{servos}</actuator></mujoco>"
        )


def _text(values: object) -> str:
    return " ".join(f"{v:.9g}" for v in np.atleast_1d(values))  # type: ignore[call-overload]


def drawn_arm(random: np.random.Generator, axes: str) -> Arm:
    """An arm whose servos droop by some hundredths of a radian under its weight, as those of small arms do."""
    size = random.uniform(0.8, 2.0)
    joints = []
    for k, axis in enumerate(axes):
        length, mass = size * random.uniform(0.07, 0.15), size**2 * random.uniform(0.06, 0.2)
        joints.append(Joint(f"{'abcdefg'[k]}_joint", axis, length, mass, random.uniform(0.015, 0.03) * size))
    inertia, weight = _stretched(joints)
    for j, own, held in zip(joints, inertia, weight):
        j.armature = own * random.uniform(0.2, 1.0) + 2e-4
        own += j.armature
        j.stiffness = max(held / random.uniform(0.03, 0.08), own * (2 * np.pi * random.uniform(2.0, 4.0)) ** 2)
        ratio = random.uniform(0.5, 1.0)
        j.damping = 1.6 * ratio * (j.stiffness * own) ** 0.5
        j.viscous = 0.4 * ratio * (j.stiffness * own) ** 0.5
        j.coulomb = j.stiffness * random.uniform(0.003, 0.012)
        j.limit = 3.0 * held + 1.0 * j.stiffness
    return Arm(joints)


def _stretched(joints: list[Joint]) -> tuple[np.ndarray, np.ndarray]:
    """Greatest inertia that each joint moves [kg m^2], and torque that it bears [N m]."""
    inertia, weight = np.zeros(len(joints)), np.zeros(len(joints))
    for k in range(len(joints)):
        at = 0.0
        for j in joints[max(k, 1) :]:
            arm = at + j.length / 2
            bent = joints[k].axis != "x"
            inertia[k] += j.mass * (arm**2 if bent else j.width**2 + 0.1 * j.length**2)
            weight[k] += 9.81 * j.mass * arm * (1.0 if joints[k].axis == "y" else 0.1)
            at += j.length
    return inertia, weight


@dataclass
class Effect:
    """What the true arm has and its model lacks."""

    effect: str
    target: str


def _scaled(name: str, *ranges: tuple[float, float]) -> Callable[[Joint, np.random.Generator], None]:
    def change(joint: Joint, random: np.random.Generator) -> None:
        low, high = ranges[int(random.integers(len(ranges)))]
        setattr(joint, name, getattr(joint, name) * random.uniform(low, high))

    return change


def _more_friction(joint: Joint, random: np.random.Generator) -> None:
    joint.coulomb += joint.stiffness * random.uniform(0.012, 0.03)


# Effects of a joint, by their id in the catalogue: what they change, and how far.
OF_JOINTS: dict[str, Callable[[Joint, np.random.Generator], None]] = {
    "servo_stiffness": _scaled("stiffness", (0.5, 0.75), (1.35, 1.8)),
    "servo_damping": _scaled("damping", (0.4, 0.6), (1.7, 2.5)),
    "rotor_inertia": _scaled("armature", (2.5, 5.0)),
    "coulomb_friction": _more_friction,
}
IN_MJCF = (*OF_JOINTS, "torque_limit", "joint_delay", "payload", "link_mass")  # the delay apart


def _dead_band(k: int, joint: Joint, random: np.random.Generator) -> StepForce:
    return servo_forces.dead_band(k, random.uniform(0.012, 0.03))


def _drag(k: int, joint: Joint, random: np.random.Generator) -> StepForce:
    return servo_forces.quadratic_drag(k, joint.stiffness * random.uniform(0.02, 0.05))


def _angle_friction(k: int, joint: Joint, random: np.random.Generator) -> StepForce:
    amplitude, cycles = joint.stiffness * random.uniform(0.012, 0.03), random.uniform(2.0, 6.0)
    return servo_forces.angle_friction(k, amplitude, cycles, random.uniform(-np.pi, np.pi))


def _load_friction(k: int, joint: Joint, random: np.random.Generator) -> StepForce:
    return servo_forces.load_friction(k, random.uniform(0.25, 0.5))


def _fading(k: int, joint: Joint, random: np.random.Generator) -> StepForce:
    return servo_forces.fading_servo(k, random.uniform(0.4, 0.7), random.uniform(10.0, 30.0))


def _beating(k: int, joint: Joint, random: np.random.Generator) -> StepForce:
    return servo_forces.beating_torque(k, joint.stiffness * random.uniform(0.02, 0.05), random.uniform(1.5, 4.0))


# Effects that MuJoCo is given step by step, by their id; and what no effect of the catalogue describes.
BY_STEPS: dict[str, Callable[[int, Joint, np.random.Generator], StepForce]] = {
    "servo_dead_band": _dead_band,
    "quadratic_drag": _drag,
    "angle_friction": _angle_friction,
    "load_friction": _load_friction,
}
OUTSIDE = {"fading_servo": _fading, "beating_torque": _beating}
HEAVY = ("link_mass", "torque_limit", "load_friction", "fading_servo")  # on joints that bear weight
KINDS = (*IN_MJCF, *BY_STEPS)


def with_effect(
    arm: Arm, kind: str, random: np.random.Generator, command: np.ndarray, rate: float
) -> tuple[Arm, Effect]:
    """An arm with an effect. command, rate: of the motion in which a torque limit shows."""
    out = copy.deepcopy(arm)
    if kind == "joint_delay":
        out.delay = random.uniform(0.03, 0.08)
        return out, Effect(kind, "drives")
    if kind == "payload":
        out.payload = random.uniform(0.15, 0.4) * sum(j.mass for j in arm.joints[1:])
        return out, Effect(kind, "tool")
    heavy = [k for k, j in enumerate(arm.joints) if k and j.axis == "y"]
    k = int(random.choice(heavy)) if kind in HEAVY else int(random.integers(len(arm.joints)))
    joint = out.joints[k]
    if kind in BY_STEPS or kind in OUTSIDE:
        out.forces.append((BY_STEPS | OUTSIDE)[kind](k, joint, random))
    elif kind == "link_mass":
        joint.mass *= random.uniform(1.5, 2.2)
    elif kind == "torque_limit":
        torque = simulated_log(arm.xml(), command, rate, forces=arm.forces).torque[:, k]
        joint.limit = float(np.abs(torque).max()) * random.uniform(0.5, 0.75)
    else:
        OF_JOINTS[kind](joint, random)
    return out, Effect(kind, f"joint{k + 1}")


def planned(random: np.random.Generator, joints: int, duration: float, rate: float) -> np.ndarray:
    """Commands, rows x joints [rad]: of one half of the logs swings, of the other moves between rests."""
    t = np.arange(round(duration * rate)) / rate
    out = np.empty((len(t), joints))
    swings = random.uniform() < 0.5
    for j in range(joints):
        at = random.uniform(-0.4, 0.4)
        if swings:
            s = np.maximum(t - 1.0, 0.0)
            slow, fast = random.uniform(0.1, 0.3), random.uniform(0.4, 0.9)
            rise = np.minimum(s / 2.0, 1.0)
            out[:, j] = at + rise * (0.5 * np.sin(2 * np.pi * slow * s) + 0.12 * np.sin(2 * np.pi * fast * s))
            continue
        out[:, j], begin, value = at, 1.0, at
        while begin < duration:
            goal, lasts = random.uniform(-0.8, 0.8), random.uniform(0.6, 2.0)
            x = np.clip((t - begin) / lasts, 0.0, 1.0)
            out[:, j] += (goal - value) * x**3 * (10 - 15 * x + 6 * x**2)
            begin, value = begin + lasts + random.uniform(0.0, 1.5), goal
    return out


@dataclass
class Log:
    """Rows x joints."""

    t: np.ndarray
    command: np.ndarray
    q: np.ndarray
    torque: np.ndarray
    names: list[str] = field(default_factory=list)

    def columns(self, random: np.random.Generator, efforts: bool) -> dict[str, np.ndarray]:
        """As a logger writes it: positions of encoders of 4096 steps, efforts with noise."""
        out = {"time": self.t}
        for k, name in enumerate(self.names):
            out |= {f"cmd_{name}": self.command[:, k], f"pos_{name}": np.round(self.q[:, k] / TICK) * TICK}
        for k, name in enumerate(self.names if efforts else ()):
            noise = 0.02 * np.abs(self.torque[:, k]).max() + 1e-3
            out[f"effort_{name}"] = self.torque[:, k] + random.normal(0, noise, len(self.t))
        return out


def simulated_log(
    xml: str, command: np.ndarray, rate: float, delay: float = 0.0, forces: Sequence[StepForce] = ()
) -> Log:
    """The arm under commands that hold between their rows, as MuJoCo steps it."""
    import mujoco

    model, stated = (mujoco.MjModel.from_xml_string(xml) for _ in (0, 1))
    data = mujoco.MjData(model)
    h = model.opt.timestep
    settle, steps = round(1.5 / h), round(len(command) / rate / h)
    data.qpos[:] = command[0]
    for _ in range(settle):
        data.ctrl[:] = command[0]
        servo_forces.step(model, data, stated, forces)
    every = round(1 / rate / h)
    q, torque = [], []
    for k in range(steps):
        row = int(np.floor((k * h - delay) * rate + 1e-9))
        data.ctrl[:] = command[min(max(row, 0), len(command) - 1)]
        if k % every == 0:
            q.append(data.qpos.copy())
        servo_forces.step(model, data, stated, forces)
        if k % every == 0:
            torque.append(data.actuator_force.copy())
    names = [model.joint(k).name for k in range(model.njnt)]
    return Log(np.arange(len(command)) / rate, command, np.array(q), np.array(torque), names)


def left_over(file: Path, log: Log, delay: float) -> float:
    """RMS of the positions of a log minus those that MuJoCo reaches with a model, over the noise of rounding, which the
    log has, too [-]."""
    from kr5.models.mujoco_motion import CommandedMotion, MujocoArm

    arm, n = MujocoArm(file), len(log.names)
    moved = arm.positions(CommandedMotion(log.t, log.command, log.q[0], [delay] * n))[0]
    rounded = np.round(log.q / TICK) * TICK
    return float(np.sqrt(np.mean((moved - rounded) ** 2)) / NOISE)
