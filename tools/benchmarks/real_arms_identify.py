"""Masses, friction and rotors of an arm from a recording of its torques, by weighted least squares.

Every column of the regressor is a simulation of the arm with one parameter alone, so that what is identified is exactly
what the simulator uses. Masses stay as given: what they do beside first and second moments of a serial arm on a fixed
base cannot be seen."""

from dataclasses import dataclass
from typing import Any

import kr5.cell
import kr5.predict
import numpy as np

SIMULATOR = kr5.predict.FastSimulator()
AXES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # Ixx Iyy Izz Ixy Ixz Iyz


@dataclass
class Identified:
    cell: Any
    offset: np.ndarray  # constant part of each column that no part of the cell makes
    residual: np.ndarray  # of the fit experiments, rows x joints


def matrix(inertia: Any) -> np.ndarray:
    out = np.zeros((3, 3))
    for value, (i, j) in zip(inertia, AXES):
        out[i, j] = out[j, i] = value
    return out


def about_origin(link: Any) -> np.ndarray:
    c = np.asarray(link.com)
    return matrix(link.inertia) + link.mass * (c @ c * np.eye(3) - np.outer(c, c))


def link_of(mass: float, moment: np.ndarray, inertia: np.ndarray) -> Any:
    """A link from its mass, first moment and inertia about its origin."""
    c = moment / mass
    about = inertia - mass * (c @ c * np.eye(3) - np.outer(c, c))
    return kr5.cell.Link(mass=mass, com=c, inertia=[about[i, j] for i, j in AXES])


def columns(cell: Any, experiments: list[Any]) -> np.ndarray:
    """What the simulator shows, experiments one after the other, rows x joints."""
    out = []
    for e in experiments:
        shown = SIMULATOR.predict(cell, e)
        out.append(np.column_stack([shown[f"i{k + 1}"] for k in range(cell.robot.joints)]))
    return np.vstack(out)


def recorded(experiments: list[Any], joints: int) -> np.ndarray:
    return np.vstack([np.column_stack([e[f"i{k + 1}"] for k in range(joints)]) for e in experiments])


def without_drives(cell: Any) -> Any:
    """The arm without mass, friction and rotors."""
    out = kr5.cell.parse_cell(cell.to_yaml())
    n = cell.robot.joints
    robot, drives = out.robot, out.drives
    robot.links = [kr5.cell.Link(mass=0.0, com=np.zeros(3), inertia=np.zeros(6)) for _ in range(n)]
    drives.friction = kr5.cell.Friction(coulomb=np.zeros(n), viscous=np.zeros(n))
    drives.rotor_inertia = np.zeros(n)
    out.robot, out.drives = robot, drives
    return out


def with_link(cell: Any, index: int, link: Any) -> Any:
    out = kr5.cell.parse_cell(cell.to_yaml())
    robot = out.robot
    links = list(robot.links)
    links[index] = link
    robot.links = links
    out.robot = robot
    return out


def with_drives(cell: Any, **changes: Any) -> Any:
    """Changed `coulomb`, `viscous`, `rotor_inertia`, `structure`, `torque_constant`."""
    out = kr5.cell.parse_cell(cell.to_yaml())
    drives = out.drives
    friction = drives.friction
    for name, value in changes.items():
        setattr(friction if name in ("coulomb", "viscous") else drives, name, value)
    drives.friction = friction
    out.drives = drives
    return out


def regressor(cell: Any, experiments: list[Any], rotors: bool) -> tuple[np.ndarray, np.ndarray]:
    """Columns (rows x joints x parameters), and what each parameter may plausibly change by.

    Parameters: of each link three first moments and six second ones; dry and viscous friction of each joint; rotors;
    offsets."""
    n, empty = cell.robot.joints, without_drives(cell)
    parts, scale = [], []
    masses = [link.mass for link in cell.robot.links]
    for k in range(n):
        alone = columns(with_link(empty, k, kr5.cell.Link(mass=1.0, com=np.zeros(3), inertia=np.zeros(6))), experiments)
        for axis in np.eye(3):
            there = kr5.cell.Link(
                mass=1.0, com=axis, inertia=[-(np.eye(3) - np.outer(axis, axis))[i, j] for i, j in AXES]
            )
            parts.append(columns(with_link(empty, k, there), experiments) - alone)
        scale += [0.2 * masses[k] + 0.1] * 3
        for unit in np.eye(6):
            parts.append(
                columns(with_link(empty, k, kr5.cell.Link(mass=0.0, com=np.zeros(3), inertia=unit)), experiments)
            )
        scale += [0.02 * masses[k] + 0.01] * 6
    for name in ("coulomb", "viscous", *(["rotor_inertia"] if rotors else [])):
        for k in range(n):
            parts.append(columns(with_drives(empty, **{name: np.eye(n)[k]}), experiments))
            scale.append(100.0 if name != "rotor_inertia" else 1e-2)
    rows = len(parts[0])
    for k in range(n):
        parts.append(np.tile(np.eye(n)[k], (rows, 1)))
        scale.append(100.0 / abs(np.asarray(cell.drives.torque_constant)[k]))
    return np.stack(parts, axis=2), np.array(scale)


def starting_values(cell: Any, rotors: bool) -> np.ndarray:
    out = []
    for link in cell.robot.links:
        moment, inertia = link.mass * np.asarray(link.com), about_origin(link)
        out += [*moment, *(inertia[i, j] for i, j in AXES)]
    friction = cell.drives.friction
    out += [*friction.coulomb, *friction.viscous, *(cell.drives.rotor_inertia if rotors else [])]
    return np.array([*out, *np.zeros(cell.robot.joints)])


def identify(cell: Any, experiments: list[Any], rotors: bool = True, rounds: int = 4) -> Identified:
    """The cell that explains the torques of the fit experiments; friction and rotors do not become negative."""
    from scipy.optimize import lsq_linear

    n = cell.robot.joints
    fit = [e for e in experiments if str(e.split) == "fit"]
    A, scale = regressor(cell, fit, rotors)
    mass_only = without_drives(cell)
    robot = mass_only.robot
    robot.links = [kr5.cell.Link(mass=link.mass, com=np.zeros(3), inertia=np.zeros(6)) for link in cell.robot.links]
    mass_only.robot = robot
    y = recorded(fit, n) - columns(mass_only, fit)
    x0 = starting_values(cell, rotors)
    sigma, x = y.std(0), x0
    lower = np.full(len(x0), -np.inf)
    first = 9 * n
    lower[first : len(x0) - n] = 0.0
    for _ in range(rounds):
        rows = (A / sigma[None, :, None]).reshape(-1, len(x0)) * scale
        right = ((y - A @ x0) / sigma).reshape(-1)
        problem = np.vstack([rows, np.eye(len(x0))])
        target = np.concatenate([right, np.zeros(len(x0))])
        G = problem.T @ problem
        L = np.linalg.cholesky(G)
        small = lsq_linear(L.T, np.linalg.solve(L, problem.T @ target), bounds=((lower - x0) / scale, np.inf))
        x = x0 + scale * small.x
        residual = y - A @ x
        sigma = residual.std(0)
    return Identified(_cell_of(cell, x, rotors), x[-n:], residual)


def _cell_of(cell: Any, x: np.ndarray, rotors: bool) -> Any:
    n = cell.robot.joints
    out = kr5.cell.parse_cell(cell.to_yaml())
    robot, links = out.robot, []
    for k, link in enumerate(cell.robot.links):
        own = x[9 * k : 9 * k + 9]
        links.append(link_of(link.mass, own[:3], matrix(own[3:])))
    robot.links = links
    out.robot = robot
    at = 9 * n
    changes = {"coulomb": x[at : at + n], "viscous": x[at + n : at + 2 * n]}
    if rotors:
        changes["rotor_inertia"] = x[at + 2 * n : at + 3 * n]
    return with_drives(out, **changes)
