"""How each effect changes each column, to first order: what the plain methods of `baselines` reason with."""

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from .catalogue import CATALOGUE, Effect, couplings, has_parts, joint_index
from .recording import Experiment
from .simulate import residuals, simulate
from .truth import WRENCH, Truth, pose_matrix, pose_vector

STRIDE = 6  # rows of a motion are dense: every so many is enough
# Parameters that shape an effect but carry none of it, at plain values.
SHAPE: dict[str, Any] = {"stribeck_velocity": 0.05, "thermal": 60.0, "growth": 400.0, "cycles": (1, 2, 3)}


@dataclass
class Hypothesis:
    effect: str
    target: str
    names: list[str]  # of the parameters its columns stand for
    nominal: np.ndarray
    columns: np.ndarray  # rows x parameters, in noise units


ParameterStep = tuple[str, float, float, dict]  # name, nominal value, step, parameters at nominal + step


def single_parameter(name: str, nominal: float, step: float, **rest) -> ParameterStep:
    return (name, float(nominal), step, {name: nominal + step} | rest)


def vector_parameter(name: str, size: int, step: float) -> list[ParameterStep]:
    return [(f"{name}[{k}]", 0.0, step, {name: [step * (j == k) for j in range(size)]}) for k in range(size)]


def mount_parameter(part: dict, name: str, step: float = 1e-5) -> list[ParameterStep]:
    p = pose_vector(pose_matrix(part[name]))
    return [
        (f"{name}[{k}]", p[k], step, {name: pose_matrix([x + step * (j == k) for j, x in enumerate(p)]).tolist()})
        for k in range(6)
    ]


def wave_parameters(step: float) -> list[ParameterStep]:
    phases = (0.0, np.pi / 2)
    return [
        (f"amplitude{n}{k}", 0.0, step, {"amplitude": step, "cycles": n, "phase": p})
        for n in SHAPE["cycles"]
        for k, p in enumerate(phases)
    ]


def drive_trials(d: dict, i: int) -> dict:
    S = d["structure"]
    return {
        "coulomb_friction": lambda: [single_parameter("coulomb", d["friction"]["coulomb"][i], 0.1)],
        "viscous_friction": lambda: [single_parameter("viscous", d["friction"]["viscous"][i], 0.1)],
        "stribeck_friction": lambda: [
            single_parameter("stribeck", 0, 0.1, stribeck_velocity=SHAPE["stribeck_velocity"])
        ],
        "load_friction": lambda: [single_parameter("coefficient", 0, 1e-3)],
        "driven_friction": lambda: [single_parameter("coefficient", 0, 1e-2)],
        "quadratic_drag": lambda: [single_parameter("quadratic", 0, 0.1)],
        "angle_friction": lambda: wave_parameters(0.1),
        "thermal_friction": lambda: [single_parameter("drop", 0, 1e-2, time_constant=SHAPE["thermal"])],
        "torque_constant": lambda: [single_parameter("torque_constant", d["torque_constant"][i], 1e-3)],
        "rotor_inertia": lambda: [single_parameter("rotor_inertia", d["rotor_inertia"][i], 1e-5)],
        # The second stands for a spring far from its rest: a steady pull.
        "cable_spring": lambda: [
            ("stiffness", 0.0, 0.1, {"stiffness": 0.1, "rest": 0.0}),
            ("pull", 0.0, 0.1, {"stiffness": 1e-6, "rest": 1e5}),
        ],
        "torque_ripple": lambda: wave_parameters(0.1),
        "wrist_coupling": lambda: [
            ("value", S[r][k], 0.01, {"element": k, "value": S[r][k] + 0.01})
            for r, k in couplings({"drives": d})
            if r == i
        ],
        "current_delay": lambda: [single_parameter("delay", 0, 1e-3)],
    }


def arm_trials(robot: dict, servo: dict, cycle: float, i: int) -> dict:
    row = robot["dh"][min(i, len(robot["dh"]) - 1)]
    wn = np.broadcast_to(servo["joint"]["natural_frequency"], len(robot["dh"]))
    corner = [[0.1 * (j == k) for j in range(3)] for k in range(3)]
    body = robot["links"][min(i, len(robot["links"]) - 1)]
    beside = [[float(x) + 1e-3 * (j == k) for j, x in enumerate(body["com"])] for k in range(3)]
    return {
        "joint_elasticity": lambda: [("compliance", 0.0, 1e-7, {"stiffness": 1e7})],
        "backlash": lambda: [single_parameter("gap", 0, 1e-4)],
        "payload": lambda: (
            [("mass", 0.0, 0.01, {"mass": 0.01, "com": [0, 0, 0]})]
            + [(f"moment{k}", 0.0, 1e-3, {"mass": 0.01, "com": corner[k]}) for k in range(3)]
        ),
        "link_mass": lambda: [single_parameter("mass", body["mass"], 0.01)],
        "link_com": lambda: [(f"com{k}", 0.0, 1e-3, {"com": beside[k]}) for k in range(3)],
        "base_tilt": lambda: [
            ("roll", 0.0, 1e-5, {"roll": 1e-5, "pitch": 0}),
            ("pitch", 0.0, 1e-5, {"roll": 0, "pitch": 1e-5}),
        ],
        "encoder_offset": lambda: [single_parameter("offset", 0, 1e-5)],
        "link_length": lambda: [single_parameter("a", row["a"], 1e-5), single_parameter("b", row["b"], 1e-5)],
        "link_twist": lambda: [single_parameter("alpha", row["alpha"], 1e-5)],
        "transmission_error": lambda: wave_parameters(1e-5),
        "tool_offset": lambda: vector_parameter("offset", 3, 1e-5),
        "thermal_growth": lambda: [single_parameter("growth", 0, 1e-5, time_constant=SHAPE["growth"])],
        "joint_servo": lambda: [single_parameter("natural_frequency", wn[i], 0.05)],
        "joint_delay": lambda: [single_parameter("delay", servo["joint"]["delay"], 1e-4)],
        "tool_servo": lambda: [single_parameter("natural_frequency", servo["tool"]["natural_frequency"], 1e-3)],
        "tool_damping": lambda: [single_parameter("damping_ratio", servo["tool"]["damping_ratio"], 1e-3)],
        "tool_delay": lambda: [single_parameter("delay", servo["tool"]["delay"], cycle)],
    }


def sensor_trials(cell: dict, target: str) -> dict:
    cam = cell.get("camera") or {}
    return {
        "ft_bias": lambda: [single_parameter("bias", 0, 0.01)],
        "ft_drift": lambda: [single_parameter("rate", 0, 0.01)],
        "ft_gain": lambda: [single_parameter("gain", 1, 0.01)],
        "ft_crosstalk": lambda: [(f"gain {w}", 0.0, 0.01, {"source": w, "gain": 0.01}) for w in WRENCH if w != target],
        "ft_lag": lambda: [single_parameter("time_constant", 0, 0.01)],
        "camera_focal": lambda: [
            single_parameter("fx", cam["fx"], 0.1, fy=cam["fy"]),
            single_parameter("fy", cam["fy"], 0.1, fx=cam["fx"]),
        ],
        "lens_distortion": lambda: [
            single_parameter("k1", cam["distortion"][0], 1e-4, k2=cam["distortion"][1]),
            single_parameter("k2", cam["distortion"][1], 1e-4, k1=cam["distortion"][0]),
        ],
        "hand_eye": lambda: mount_parameter(cam, "T_E_C"),
        "laser_mount": lambda: mount_parameter(cell["laser"], "T_E_L"),
        "laser_bias": lambda: [single_parameter("bias", 0, 1e-5)],
        "laser_lag": lambda: [single_parameter("lag", 0, 1e-4)],
    }


def contact_trials(cell: dict) -> dict:
    c = cell.get("contact") or {}
    return {
        "contact_stiffness": lambda: [single_parameter("stiffness", c["stiffness"], 10.0)],
        "contact_hardening": lambda: [single_parameter("hardening", 0, 1e-3)],
        "contact_friction": lambda: [single_parameter("friction", c["friction"], 1e-3)],
        "gripper_compliance": lambda: [
            single_parameter("lateral", 0, 1e-7, axial=0.0),
            single_parameter("axial", 0, 1e-8, lateral=0.0),
        ],
        "tube_tilt": lambda: vector_parameter("tilt", 2, 1e-4),
        "tube_shift": lambda: vector_parameter("shift", 2, 1e-6),
        "tube_radius": lambda: [single_parameter("inner_radius", cell["tube"]["inner_radius"], 1e-6)],
    }


def trials_of(effect: str, target: str, cell: dict) -> list[ParameterStep]:
    """Each free direction of an effect."""
    i = joint_index(target) if target.startswith(("joint", "motor")) else 0
    servo = cell["servo"]
    every = drive_trials(cell["drives"], i) | arm_trials(cell["robot"], servo, servo["cycle"], i)
    return (every | sensor_trials(cell, target) | contact_trials(cell))[effect]()


def thin_experiment(e: Experiment) -> dict:
    """What was seen in the rows that are reasoned with."""
    return {c: x[::STRIDE] if e.kind == "motion" else x for c, x in e.columns.items()}


class Stack:
    """All columns of all experiments as one vector in noise units."""

    def __init__(self, cell: dict, experiments: list[Experiment]):
        self.cell, self.experiments = cell, experiments
        self.nominal = [self.at(Truth.of(cell), e) for e in experiments]
        parts = [
            residuals(e.kind, thin_experiment(e), n, cell["noise"])
            for e, n in zip(experiments, self.nominal, strict=True)
        ]
        self.layout = [(e, list(p)) for e, p in zip(experiments, parts, strict=True)]
        self.residual = np.concatenate([x for p in parts for x in p.values()])
        self.fit = np.concatenate(
            [np.full(len(x), e.split == "fit") for e, p in zip(experiments, parts, strict=True) for x in p.values()]
        )
        self.column = np.concatenate([np.full(len(x), k) for k, x in enumerate(x for p in parts for x in p.values())])
        self.names = [(e.name, c) for e, p in zip(experiments, parts, strict=True) for c in p]
        self.good = np.isfinite(self.residual)
        self.residual = np.where(self.good, self.residual, 0.0)

    def at(self, truth: Truth, e: Experiment) -> dict:
        truth = copy.copy(truth)
        truth.stride = STRIDE
        return simulate(truth, e.kind, e.columns)

    def change(self, truth: Truth, kinds: tuple[str, ...]) -> np.ndarray:
        """What a truth shows less what the nominal cell shows."""
        parts = []
        for (e, names), nominal in zip(self.layout, self.nominal, strict=True):
            if e.kind in kinds:
                moved = self.at(truth, e)
                r = residuals(
                    e.kind,
                    moved | {"sphere": nominal["sphere"]} if e.kind == "scan" else moved,
                    nominal,
                    self.cell["noise"],
                )
                parts += [np.clip(np.nan_to_num(r[c]), -1e3, 1e3) for c in names]
            else:
                n = len(next(iter(thin_experiment(e).values())))
                parts += [np.zeros(n) for _ in names]
        return np.where(self.good, np.concatenate(parts), 0.0)

    def hypotheses(self, effects: list[Effect] = CATALOGUE) -> list[Hypothesis]:
        out, kinds = [], {e.kind for e in self.experiments}
        for effect in effects:
            if not kinds & set(effect.kinds) or not has_parts(self.cell, effect):
                continue
            for target in effect.targets(self.cell):
                tried = trials_of(effect.id, target, self.cell)
                columns = []
                for _, _, step, parameters in tried:
                    truth = Truth.of(self.cell)
                    effect.apply(truth, target, parameters)
                    columns.append(self.change(truth, effect.kinds) / step)
                nominal = np.array([t[1] for t in tried])
                out.append(Hypothesis(effect.id, target, [t[0] for t in tried], nominal, np.column_stack(columns)))
        return out
