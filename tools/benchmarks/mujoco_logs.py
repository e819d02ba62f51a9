"""A MuJoCo arm that follows a motion, logged as CSV; its model with an effect withheld, and how well another model
predicts a log."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

JOINTS = ["pan", "lift", "elbow", "roll", "pitch", "yaw"]
NOISE = np.array([0.3, 0.5, 0.3, 0.08, 0.05, 0.03])  # of the logged torques [N m]
Q_NOISE = 1e-5  # [rad]
STEP = 0.002  # [s]
LOGGED = 4  # steps a row
STIFFNESS = 900.0  # of the controller [1/s^2]

BODIES = [  # place in the body before [m], axis, mass [kg], centre [m], size of its inertia [m]
    ("0 0 0.2", "0 0 1", 12.0, "0.02 0 0.1", 0.12),
    ("0 0.1 0.2", "0 1 0", 9.0, "0 0 0.25", 0.15),
    ("0 -0.05 0.5", "0 1 0", 6.0, "0.15 0 0.03", 0.12),
    ("0.3 0 0.03", "1 0 0", 2.5, "0.08 0 0", 0.06),
    ("0.25 0 0", "0 1 0", 1.6, "0.03 0 0.01", 0.04),
    ("0.08 0 0", "1 0 0", 0.5, "0.03 0 0", 0.03),
]


ASIDE = (0.6, 0.7, -0.4)  # direction in which a centre of mass is elsewhere


@dataclass
class Effect:
    """What the true arm has and its nominal model lacks."""

    effect: str
    joint: int  # from 0
    value: float


EFFECTS = ("coulomb_friction", "viscous_friction", "rotor_inertia", "payload", "link_mass", "link_com")
SIZES = {  # what such an effect is on each joint, before a factor; of the mass and the centre of a link the change
    "coulomb_friction": np.array([6.0, 8.0, 5.0, 1.2, 0.8, 0.5]),
    "viscous_friction": np.array([5.0, 6.0, 4.0, 1.0, 0.7, 0.4]),
    "rotor_inertia": np.array([0.9, 0.9, 0.5, 0.08, 0.05, 0.03]),
    "payload": np.array([0, 0, 0, 0, 0, 1.5]),
    # That of the first link, which turns about the vertical, is an inertia of its rotor.
    "link_mass": np.array([0, 3.0, 2.0, 1.0, 0.8, 0.5]),
    "link_com": np.array([0, 0.06, 0.06, 0.05, 0.05, 0.05]),
}


def drawn_effect(seed: int) -> Effect:
    random = np.random.default_rng(seed)
    effect = EFFECTS[int(random.integers(len(EFFECTS)))]
    first = int(np.flatnonzero(SIZES[effect])[0])
    joint = int(random.integers(first, 6))
    return Effect(effect, joint, float(SIZES[effect][joint] * random.uniform(0.5, 1.5)))


def model_xml(effect: Effect | None = None) -> str:
    """The arm as MJCF, with an effect or nominal."""
    opened, closed = "", ""
    for k, (place, axis, mass, centre, size) in enumerate(BODIES):
        if effect is not None and effect.joint == k:
            mass += effect.value if effect.effect == "link_mass" else 0.0
            if effect.effect == "link_com":
                centre = " ".join(f"{x + s * effect.value:.9g}" for x, s in zip(map(float, centre.split()), ASIDE))
        own = {"coulomb_friction": "frictionloss", "viscous_friction": "damping", "rotor_inertia": "armature"}
        more = ""
        if effect is not None and effect.joint == k and effect.effect in own:
            more = f' {own[effect.effect]}="{effect.value:.9g}"'
        inertia = mass * size**2
        opened += (
            f'<body name="link{k + 1}" pos="{place}"><joint name="{JOINTS[k]}" type="hinge" axis="{axis}"{more}/>'
            f'<inertial pos="{centre}" mass="{mass:.9g}"'
            f' diaginertia="{inertia:.6g} {0.9 * inertia:.6g} {0.8 * inertia:.6g}"/>'
        )
        closed += "</body>"
    if effect is not None and effect.effect == "payload":
        opened += f'<body name="load" pos="0.1 0 0.03"><inertial pos="0 0 0" mass="{effect.value:.9g}"'
        opened += ' diaginertia="0.002 0.002 0.002"/></body>'
    motors = "".join(f'<motor name="m_{j}" joint="{j}"/>' for j in JOINTS)
    return (
        f'<mujoco model="arm"><option timestep="{STEP}"/><worldbody>{opened}{closed}</worldbody>'
        f"<actuator>{motors}</actuator></mujoco>"
    )


def planned(t: float, seed: int) -> np.ndarray:
    """Where the joints should be: swings of their own beats, from rest."""
    random = np.random.default_rng([11, seed])
    size, beat = random.uniform(0.3, 0.7, 6), random.uniform(0.8, 2.8, 6)
    grown = 1 - np.exp(-(t**2))
    return np.array([0.2, 0.4, 0.5, 0.3, 0.4, 0.2]) + grown * size * np.sin(beat * t + np.arange(6))


@dataclass
class Log:
    """Rows x joints; the motion without noise, and torques with it."""

    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    torque: np.ndarray

    def columns(self, seed: int) -> dict[str, np.ndarray]:
        """As a logger writes it."""
        random = np.random.default_rng([12, seed])
        q = self.q + random.normal(0, Q_NOISE, self.q.shape)
        out = {"time": self.t}
        for k, name in enumerate(JOINTS):
            out |= {f"{name}_pos": q[:, k], f"{name}_torque": self.torque[:, k]}
        return out


def simulated_log(xml: str, seed: int, duration: float = 14.0, still: int | None = None) -> Log:
    """The arm under a controller, as MuJoCo steps it, with noise on the torques. still: joint that holds its place."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    held = np.arange(6) == (-1 if still is None else still)
    start = planned(0.0, seed)
    data.qpos[:] = start
    rows, force = [], np.zeros(6)
    for step in range(round(duration / STEP)):
        target, ahead = (np.where(held, start, planned(t, seed)) for t in (data.time, data.time + STEP))
        mujoco.mj_forward(model, data)
        wanted = STIFFNESS * (target - data.qpos) + 2 * np.sqrt(STIFFNESS) * ((ahead - target) / STEP - data.qvel)
        mujoco.mj_mulM(model, data, force, wanted)
        data.ctrl[:] = data.qfrc_bias + force
        mujoco.mj_forward(model, data)
        if step % LOGGED == 0:
            rows.append((data.time, *map(np.copy, (data.qpos, data.qvel, data.qacc, data.actuator_force))))
        mujoco.mj_step(model, data)
    t, q, qd, qdd, torque = (np.array(x) for x in zip(*rows))
    return Log(t, q, qd, qdd, torque + np.random.default_rng([13, seed]).normal(0, NOISE, torque.shape))


def prediction_gap(file: Path, log: Log) -> float:
    """RMS of the logged torques minus those that MuJoCo computes with a model for the motion, over the noise."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    out = np.empty_like(log.torque)
    for k in range(len(log.t)):
        data.qpos[:], data.qvel[:], data.qacc[:] = log.q[k], log.qd[k], log.qdd[k]
        mujoco.mj_inverse(model, data)
        out[k] = data.qfrc_inverse
    return float(np.sqrt((((log.torque - out) / NOISE) ** 2).mean()))
