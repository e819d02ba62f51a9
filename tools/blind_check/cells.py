"""Nominal cells: the KR5 of the formats, arms of other makes, and random relatives of them."""

import copy
from pathlib import Path

import numpy as np
import yaml

from .arm import chain
from .catalogue import log_uniform
from .truth import pose_matrix

KR5_HOME = [0.0, 0.02, -2.75, 0.0, -0.3, 1.571]


def kr5_cell() -> tuple[dict, np.ndarray]:
    """The cell of the sample recordings, and a posture over its targets."""
    return yaml.safe_load((Path(__file__).parent / "cells/kr5_arc.yaml").read_text()), np.array(KR5_HOME)


# b, a [m], alpha [quarter turns], mass [kg] of each link, and a posture with the tool down.
ARMS = {
    "ur_like": (
        [
            (0.163, 0, 1, 3.7),
            (0, -0.425, 0, 8.1),
            (0, -0.392, 0, 2.9),
            (0.133, 0, 1, 1.4),
            (0.1, 0, -1, 1.3),
            (0.1, 0, 0, 0.4),
        ],
        [0.0, -1.3, 1.6, -1.87, -1.571, 0.3],
    ),
    "panda_like": (
        [
            (0.333, 0, -1, 3.2),
            (0, 0, 1, 3.1),
            (0.316, 0.0825, 1, 3.2),
            (0, -0.0825, -1, 3.4),
            (0.384, 0, 1, 3.3),
            (0, 0.088, 1, 1.6),
            (0.107, 0, 0, 0.6),
        ],
        [0.0, 0.0, 0.0, -1.6, 0.0, 1.6, 0.4],
    ),
}


def _link(b: float, a: float, mass: float) -> dict:
    """A rod along the link's length, seen from the link's own frame at its far end."""
    length = max(np.hypot(a, b), 0.1)
    J = mass * np.array([0.004, length**2 / 10 + 0.003, length**2 / 10 + 0.003])
    return {"mass": mass, "com": [-a / 2, 0.01, -b / 3], "inertia": [*J.tolist(), 0.0, 0.0, 0.0]}


def _robot(rows: list) -> tuple[dict, dict]:
    n = len(rows)
    dh = [{"b": b, "theta_offset": 0.0, "a": a, "alpha": q * np.pi / 2} for b, a, q, _ in rows]
    limits = {"lower": [-2.9] * n, "upper": [2.9] * n, "velocity": [2.2] * n}
    robot = {"dh": dh, "limits": limits, "links": [_link(b, a, m) for b, a, _, m in rows], "gravity": [0.0, 0.0, -9.81]}
    size = np.array([max(sum(r[3] for r in rows[i:]), 1.0) for i in range(n)])
    drives = {
        "structure": (100.0 * np.eye(n)).tolist(),
        "rotor_inertia": (4e-6 * size + 4e-5).tolist(),
        "torque_constant": (0.08 + 0.004 * size).tolist(),
        "friction": {"coulomb": (0.5 + 0.3 * size).tolist(), "viscous": (0.8 + 0.4 * size).tolist()},
    }
    return robot, drives


def place_targets(cell: dict, home: np.ndarray) -> None:
    """Board and line target below the tool at home, where camera and scanner can see them."""
    x, y, z = (chain(cell, home[None])[0] @ pose_matrix(cell["tool"]["T_F_E"]))[:3, 3]
    board, top = cell["board"], float(z - 0.25)
    width, height = ((board[k] - 1) * (board["marker"] + board["gap"]) + board["marker"] for k in ("cols", "rows"))
    board["T_B_W"] = [float(x - width / 2), float(y - height / 2), top, 0.0, 0.0, 0.0]
    radius = cell["laser"]["target"]["radius"]
    cell["laser"]["target"] = {"sphere": [float(x), float(y), top + radius], "radius": radius, "plane": top}


def textbook_arm(name: str) -> tuple[dict, np.ndarray]:
    """Another arm with the tool, sensors and task of the KR5 cell."""
    cell, _ = kr5_cell()
    rows, posture = ARMS[name]
    home = np.array(posture)
    cell["name"] = name
    cell["robot"], cell["drives"] = _robot(rows)
    place_targets(cell, home)
    return cell, home


def vary_cell(cell: dict, home: np.ndarray, rng: np.random.Generator) -> tuple[dict, np.ndarray]:
    """A relative: other lengths, masses, drives, servo; the same tool and sensors."""
    cell = copy.deepcopy(cell)
    cell["name"] += "_variation"

    def near(x, factor=1.3):
        return float(x * log_uniform(rng, 1 / factor, factor))

    for row, body in zip(cell["robot"]["dh"], cell["robot"]["links"], strict=True):
        row.update(a=near(row["a"], 1.1), b=near(row["b"], 1.1))
        s = near(1.0)
        body.update(mass=body["mass"] * s, inertia=[x * s for x in body["inertia"]], com=[near(x) for x in body["com"]])
    drives = cell["drives"]
    for key in ("rotor_inertia", "torque_constant"):
        drives[key] = [near(x) for x in drives[key]]
    for key in ("coulomb", "viscous"):
        drives["friction"][key] = [near(x, 1.6) for x in drives["friction"][key]]
    servo = cell["servo"]
    for part in ("joint", "tool"):
        servo[part].update(
            natural_frequency=near(servo[part]["natural_frequency"]),
            damping_ratio=near(servo[part]["damping_ratio"], 1.1),
        )
    cell["contact"].update(
        stiffness=near(cell["contact"]["stiffness"], 1.6), friction=near(cell["contact"]["friction"])
    )
    place_targets(cell, home)
    return cell, home


def draw_cell(rng: np.random.Generator) -> tuple[dict, np.ndarray]:
    """Three in five the KR5, the rest relatives of all arms."""
    cell, home = kr5_cell()
    if rng.random() < 0.6:
        return cell, home
    name = str(rng.choice(["kr5_arc", *ARMS]))
    return vary_cell(*(kr5_cell() if name == "kr5_arc" else textbook_arm(name)), rng)
