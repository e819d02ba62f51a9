"""The catalogue of effects: how each bends a truth, and how its parameters are drawn.

`draw(rng, cell, target)` gives a function of the magnitude alone, so that one effect can be made to add any size of
gap; `apply(truth, target, parameters)` sets it. Parameters are absolute values, as a cell holds them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from . import effect_setters as act
from .arm import gear_teeth
from .truth import WRENCH, Truth, pose_matrix

ARM = ("motion",)
STILL = ("poses", "views", "scan")
SENSOR = ("motion", "press", "profile")
CONTACT = ("press", "profile")


@dataclass(frozen=True)
class Effect:
    id: str
    targets: Callable[[dict], list[str]]
    span: tuple[float, float]  # magnitudes that make sense
    draw: Callable[[np.random.Generator, dict, str], Callable[[float], dict]]
    apply: Callable[[Truth, str, dict], None]
    kinds: tuple[str, ...]  # experiments it can be seen in


def joint_index(target: str) -> int:
    """Joint or motor number, from 0."""
    return int(target.removeprefix("joint").removeprefix("motor")) - 1


def joints(cell: dict) -> list[str]:
    return [f"joint{i + 1}" for i in range(len(cell["robot"]["dh"]))]


def single_target(name: str):
    return lambda cell: [name]


def random_sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def random_direction(rng: np.random.Generator, n: int) -> np.ndarray:
    d = rng.standard_normal(n)
    return d / np.linalg.norm(d)


def nominal_value(cell: dict, path: tuple, target: str) -> float:
    value: Any = cell
    for key in path:
        value = value[key]
    return float(value if isinstance(value, (int, float)) else value[joint_index(target)])


def scaled_parameter(name: str, *path: str):
    """A believed number times 1 ± m."""

    def draw(rng, cell, target):
        s, old = random_sign(rng), nominal_value(cell, path, target)
        return lambda m: {name: old * ((1 + m) if s > 0 else 1 / (1 + m))}

    return draw


def shifted_parameter(name: str, key: str):
    """A length or twist of a link plus ± m."""

    def draw(rng, cell, target):
        s, old = random_sign(rng), cell["robot"]["dh"][joint_index(target)][key]
        return lambda m: {name: old + s * m}

    return draw


def plain_parameter(name: str, signed: bool = False, vector: int = 0, nominal: float = 0.0):
    """A number or vector of magnitude m from its nominal value."""

    def draw(rng, cell, target):
        if vector:
            d = random_direction(rng, vector)
            return lambda m: {name: (nominal + m * d).tolist()}
        s = random_sign(rng) if signed else 1.0
        return lambda m: {name: nominal + s * m}

    return draw


def draw_stribeck(rng, cell, target):
    v, c = log_uniform(rng, 0.01, 0.15), cell["drives"]["friction"]["coulomb"][joint_index(target)]
    return lambda m: {"stribeck": m * c, "stribeck_velocity": v}


def draw_thermal(rng, cell, target):
    tau = log_uniform(rng, 30, 300)
    return lambda m: {"drop": m, "time_constant": tau}


def draw_elasticity(rng, cell, target):
    return lambda m: {"stiffness": gear_teeth(joint_index(target)) / m}


def draw_cable(rng, cell, target):
    i, limits = joint_index(target), cell["robot"]["limits"]
    rest = 0.5 * (limits["lower"][i] + limits["upper"][i]) + rng.uniform(-0.8, 0.8)
    return lambda m: {"stiffness": m, "rest": float(rest)}


def periodic_parameter(low: int, high: int):
    def draw(rng, cell, target):
        cycles, phase = round(log_uniform(rng, low, high)), float(rng.uniform(-np.pi, np.pi))
        return lambda m: {"amplitude": m, "cycles": cycles, "phase": phase}

    return draw


def couplings(cell: dict) -> list[tuple[int, int]]:
    """Elements of the structure matrix off its diagonal that are not zero; of a plain arm those of its last two
    motors."""
    S = np.array(cell["drives"]["structure"], float)
    found = [(int(i), int(j)) for i, j in np.argwhere(S - np.diag(np.diag(S)))]
    return found or [(len(S) - 2, len(S) - 3), (len(S) - 1, len(S) - 2)]


def draw_coupling(rng, cell, target):
    row, column = [e for e in couplings(cell) if e[0] == joint_index(target)][-1 if rng.random() < 0.5 else 0]
    s, old = random_sign(rng), cell["drives"]["structure"][row][column]
    return lambda m: {"element": column, "value": old + s * m}


def draw_payload(rng, cell, target):
    com = [*rng.uniform(-0.04, 0.04, 2).tolist(), float(rng.uniform(0.04, 0.15))]
    return lambda m: {"mass": m, "com": com}


def draw_link_mass(rng, cell, target):
    s, old = random_sign(rng), float(cell["robot"]["links"][joint_index(target)]["mass"])
    return lambda m: {"mass": old * ((1 + m) if s > 0 else 1 / (1 + m))}


def draw_link_com(rng, cell, target):
    d, old = random_direction(rng, 3), np.array(cell["robot"]["links"][joint_index(target)]["com"], float)
    return lambda m: {"com": (old + m * d).tolist()}


def draw_tilt(rng, cell, target):
    d = random_direction(rng, 2)
    return lambda m: {"roll": float(m * d[0]), "pitch": float(m * d[1])}


def draw_length(rng, cell, target):
    return shifted_parameter(*(("a", "a") if rng.random() < 0.5 else ("b", "b")))(rng, cell, target)


def draw_growth(rng, cell, target):
    tau = log_uniform(rng, 100, 1200)
    return lambda m: {"growth": m, "time_constant": tau}


def added_delay(*path: str):
    """A delay longer by m, acting between rows."""

    def draw(rng, cell, target):
        old = nominal_value(cell, path, target)
        return lambda m: {"delay": old + m}

    return draw


def draw_tool_delay(rng, cell, target):
    """Whole cycles, as commands act on the cycle."""
    old, cycle = cell["servo"]["tool"]["delay"], cell["servo"]["cycle"]
    return lambda m: {"delay": old + cycle * max(1, round(m / cycle))}


def draw_crosstalk(rng, cell, target):
    source, s = str(rng.choice([c for c in WRENCH if c != target])), random_sign(rng)
    unit = (1.0 if source[0] == "f" else 10.0) * (1.0 if target[0] == "f" else 0.1)
    return lambda m: {"source": source, "gain": s * m * unit}


def wrench_component(name: str, nominal: float, force: float, torque: float):
    def draw(rng, cell, target):
        s, unit = random_sign(rng), force if target[0] == "f" else torque
        return lambda m: {name: nominal + s * m * unit}

    return draw


def draw_focal(rng, cell, target):
    a, b = random_direction(rng, 2)
    cam = cell["camera"]
    return lambda m: {"fx": float(cam["fx"] * (1 + m * a)), "fy": float(cam["fy"] * (1 + m * b))}


def draw_distortion(rng, cell, target):
    (a, b), old = random_direction(rng, 2), cell["camera"]["distortion"]
    return lambda m: {"k1": float(old[0] + m * a), "k2": float(old[1] + 3 * m * b)}


def moved_pose(part: str, name: str):
    """A mount moved by m metres and m radians."""

    def draw(rng, cell, target):
        p, r, old = random_direction(rng, 3), random_direction(rng, 3), pose_matrix(cell[part][name])

        def make(m):
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = Rotation.from_rotvec(m * r).as_matrix(), m * p
            return {name: (old @ T).tolist()}

        return make

    return draw


def draw_grip(rng, cell, target):
    ratio = log_uniform(rng, 0.3, 3)
    return lambda m: {"lateral": m * ratio, "axial": m}


def draw_bore(rng, cell, target):
    s, old = random_sign(rng), cell["tube"]["inner_radius"]
    return lambda m: {"inner_radius": old + s * m}


def coupled_motors(cell: dict) -> list[str]:
    return sorted({f"motor{row + 1}" for row, _ in couplings(cell)})


def components(cell: dict) -> list[str]:
    return list(WRENCH)


def has_parts(cell: dict, effect: "Effect") -> bool:
    """Whether the cell has what an effect sits on."""
    needs = {
        "camera_focal": "camera",
        "lens_distortion": "camera",
        "hand_eye": "camera",
        "contact_friction": "contact",
        "contact_stiffness": "contact",
        "contact_hardening": "contact",
        "gripper_compliance": "contact",
    }
    needs |= dict.fromkeys(("laser_mount", "laser_bias", "laser_lag"), "laser")
    needs |= dict.fromkeys(("tube_tilt", "tube_shift", "tube_radius"), "tube")
    return effect.id not in needs or needs[effect.id] in cell


ALL = (*ARM, *STILL)
CATALOGUE = [
    Effect(
        "coulomb_friction",
        joints,
        (0.01, 1.5),
        scaled_parameter("coulomb", "drives", "friction", "coulomb"),
        act.coulomb,
        ARM,
    ),
    Effect(
        "viscous_friction",
        joints,
        (0.01, 2.0),
        scaled_parameter("viscous", "drives", "friction", "viscous"),
        act.viscous,
        ARM,
    ),
    Effect("stribeck_friction", joints, (0.02, 1.5), draw_stribeck, act.stribeck, ARM),
    Effect("load_friction", joints, (0.002, 0.3), plain_parameter("coefficient"), act.load_friction, ARM),
    Effect("driven_friction", joints, (0.005, 1.0), plain_parameter("coefficient"), act.driven_friction, ARM),
    Effect("quadratic_drag", joints, (0.02, 300.0), plain_parameter("quadratic"), act.quadratic_drag, ARM),
    Effect("angle_friction", joints, (0.05, 40.0), periodic_parameter(1, 13), act.angle_friction, ARM),
    Effect("thermal_friction", joints, (0.02, 0.6), draw_thermal, act.thermal_friction, ARM),
    Effect("joint_elasticity", joints, (0.1, 40.0), draw_elasticity, act.elasticity, ALL),
    Effect("backlash", joints, (1e-5, 5e-3), plain_parameter("gap"), act.backlash, ALL),
    Effect(
        "torque_constant",
        joints,
        (0.002, 0.4),
        scaled_parameter("torque_constant", "drives", "torque_constant"),
        act.torque_constant,
        ARM,
    ),
    Effect(
        "rotor_inertia",
        joints,
        (0.02, 2.0),
        scaled_parameter("rotor_inertia", "drives", "rotor_inertia"),
        act.rotor_inertia,
        ARM,
    ),
    Effect("cable_spring", joints, (0.05, 60.0), draw_cable, act.cable_spring, ARM),
    Effect("torque_ripple", joints, (0.05, 40.0), periodic_parameter(3, 60), act.torque_ripple, ARM),
    Effect("wrist_coupling", coupled_motors, (0.05, 15.0), draw_coupling, act.wrist_coupling, ARM),
    Effect("payload", single_target("tool"), (0.002, 3.0), draw_payload, act.payload, SENSOR),
    Effect("link_mass", joints, (0.002, 3.0), draw_link_mass, act.link_mass, ARM),
    Effect("link_com", joints, (1e-4, 0.2), draw_link_com, act.link_com, ARM),
    Effect("base_tilt", single_target("base"), (1e-5, 0.03), draw_tilt, act.base_tilt, ALL),
    Effect("encoder_offset", joints, (1e-5, 0.02), plain_parameter("offset", True), act.encoder_offset, ALL),
    Effect("link_length", joints, (1e-5, 8e-3), draw_length, act.link_length, ALL),
    Effect("link_twist", joints, (1e-5, 0.02), shifted_parameter("alpha", "alpha"), act.link_twist, ALL),
    Effect("transmission_error", joints, (1e-5, 4e-3), periodic_parameter(1, 8), act.transmission_error, ALL),
    Effect(
        "tool_offset",
        single_target("tool"),
        (1e-5, 8e-3),
        plain_parameter("offset", vector=3),
        act.tool_offset,
        ("poses",),
    ),
    Effect("thermal_growth", single_target("links"), (1e-5, 4e-3), draw_growth, act.thermal_growth, ALL),
    Effect("current_delay", single_target("drives"), (1e-4, 0.04), plain_parameter("delay"), act.current_delay, ARM),
    Effect(
        "joint_servo",
        joints,
        (0.001, 0.5),
        scaled_parameter("natural_frequency", "servo", "joint", "natural_frequency"),
        act.joint_servo,
        ARM,
    ),
    Effect(
        "joint_delay",
        single_target("drives"),
        (2e-5, 0.03),
        added_delay("servo", "joint", "delay"),
        act.joint_delay,
        ARM,
    ),
    Effect(
        "tool_servo",
        single_target("servo"),
        (0.0005, 0.5),
        scaled_parameter("natural_frequency", "servo", "tool", "natural_frequency"),
        act.tool_servo,
        ("step", "press"),
    ),
    Effect(
        "tool_damping",
        single_target("servo"),
        (0.0005, 0.5),
        scaled_parameter("damping_ratio", "servo", "tool", "damping_ratio"),
        act.tool_damping,
        ("step", "press"),
    ),
    Effect("tool_delay", single_target("servo"), (0.012, 0.096), draw_tool_delay, act.tool_delay, ("step", "press")),
    Effect("ft_bias", components, (0.01, 50.0), wrench_component("bias", 0.0, 0.15, 0.008), act.ft_bias, SENSOR),
    Effect("ft_drift", components, (1e-4, 0.5), wrench_component("rate", 0.0, 0.15, 0.008), act.ft_drift, SENSOR),
    Effect("ft_gain", components, (0.001, 0.4), wrench_component("gain", 1.0, 1.0, 1.0), act.ft_gain, SENSOR),
    Effect("ft_crosstalk", components, (0.001, 0.4), draw_crosstalk, act.ft_crosstalk, SENSOR),
    Effect("ft_lag", single_target("force_torque"), (0.002, 0.2), plain_parameter("time_constant"), act.ft_lag, SENSOR),
    Effect("camera_focal", single_target("camera"), (1e-5, 0.02), draw_focal, act.camera_focal, ("views",)),
    Effect("lens_distortion", single_target("camera"), (1e-4, 0.15), draw_distortion, act.lens_distortion, ("views",)),
    Effect("hand_eye", single_target("camera"), (1e-5, 0.02), moved_pose("camera", "T_E_C"), act.hand_eye, ("views",)),
    Effect(
        "laser_mount", single_target("laser"), (1e-5, 0.02), moved_pose("laser", "T_E_L"), act.laser_mount, ("scan",)
    ),
    Effect(
        "laser_bias", single_target("laser"), (5e-6, 4e-3), plain_parameter("bias", True), act.laser_bias, ("scan",)
    ),
    Effect("laser_lag", single_target("laser"), (2e-5, 0.05), plain_parameter("lag"), act.laser_lag, ("scan",)),
    Effect(
        "contact_stiffness",
        single_target("contact"),
        (0.002, 1.0),
        scaled_parameter("stiffness", "contact", "stiffness"),
        act.contact_stiffness,
        CONTACT,
    ),
    Effect(
        "contact_hardening",
        single_target("contact"),
        (0.002, 2.0),
        plain_parameter("hardening"),
        act.contact_hardening,
        CONTACT,
    ),
    Effect(
        "contact_friction",
        single_target("contact"),
        (0.005, 1.5),
        scaled_parameter("friction", "contact", "friction"),
        act.contact_friction,
        ("profile",),
    ),
    Effect("gripper_compliance", single_target("gripper"), (1e-7, 6e-5), draw_grip, act.gripper_compliance, CONTACT),
    Effect(
        "tube_tilt", single_target("tube"), (5e-5, 0.06), plain_parameter("tilt", vector=2), act.tube_tilt, ("profile",)
    ),
    Effect(
        "tube_shift",
        single_target("tube"),
        (5e-6, 1e-3),
        plain_parameter("shift", vector=2),
        act.tube_shift,
        ("profile",),
    ),
    Effect("tube_radius", single_target("tube"), (5e-6, 6e-4), draw_bore, act.tube_radius, ("profile",)),
]
BY_ID = {effect.id: effect for effect in CATALOGUE}
