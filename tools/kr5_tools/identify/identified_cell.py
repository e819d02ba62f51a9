"""An identified arm put into a cell: links, rotors and friction."""

import warnings
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import kr5.identification
import numpy as np
from kr5 import cell as kr5_cell
from kr5 import identification, kinematics
from kr5.files.writing import beside

LEAST_MASS = 1e-3  # of a link without one, for a prior [kg]


def link_bodies(cell: kr5.cell.Cell, with_tool: bool) -> list[Any]:
    """Believed bodies of the links; the last one carries the tool, as the motors feel it."""
    bodies = [kinematics.Body(mass=k.mass, com=k.com, inertia=k.inertia) for k in cell.robot.links]
    tool = tool_body(cell)
    if with_tool and tool is not None:
        bodies[-1] = kinematics.merged_body(bodies[-1], tool)
    return bodies


def expected_bodies(cell: kr5.cell.Cell) -> list[Any]:
    """Bodies for a prior: those of the links with the tool, or none when one of them cannot exist, as a link that was
    left without a mass."""
    if not cell.robot.links:
        return []
    bodies = link_bodies(cell, with_tool=True)
    for body in bodies:
        inertia = np.asarray(body.inertia_matrix())
        second = np.linalg.eigvalsh(0.5 * np.trace(inertia) * np.eye(3) - inertia)
        if body.mass <= 0 or second[0] <= 0:
            return []
    return bodies


def tool_body(cell: kr5.cell.Cell) -> Any:
    """What hangs below the force sensor, in the frame of the last link; None without."""
    tool = cell.tool
    if tool is None or not tool.mass:
        return None
    body = kinematics.Body(mass=tool.mass, com=tool.com, inertia=tool.inertia)
    T = tool.T_flange_sensor if tool.T_flange_sensor is not None else np.eye(4)
    return kinematics.transformed_body(T, body)


def standard_parameters(body: kinematics.Body) -> list[float]:
    """The ten of a body in the order of the regressor: inertia, moments, mass."""
    m, cx, cy, cz, *second = np.asarray(kinematics.inertial_parameters(body))
    return [*second, cx, cy, cz, m]


def believed_parameters(cell: kr5.cell.Cell, model: kr5.identification.DynamicsModel) -> np.ndarray:
    """Standard parameters of the arm of a cell with its tool, in the order of the regressor; terms that a cell does not
    hold are zero."""
    if not cell.robot.links:
        raise kr5.InvalidArgument(
            "the cell has no links, whose masses are needed; identify the arm first: kr5 identify dynamics --write-cell"
        )
    out = np.zeros(len(identification.DynamicsRegressor(model).names))
    n, drives = cell.robot.joints, cell.drives
    coulomb, viscous = np.zeros(n), np.zeros(n)
    if drives is not None and drives.friction is not None:
        coulomb, viscous = np.asarray(drives.friction.coulomb), np.asarray(drives.friction.viscous)
    rotors = np.zeros(n)
    if drives is not None:
        rotors = np.asarray(drives.rotor_inertia) * np.diag(np.asarray(drives.structure)) ** 2
    for k, body in enumerate(link_bodies(cell, with_tool=True)):
        out[13 * k : 13 * k + 13] = [*standard_parameters(body), coulomb[k], viscous[k], rotors[k]]
    return out


def write_identified_cell(
    cell: kr5.cell.Cell,
    motion: kr5.identification.JointMotion,
    result: kr5.identification.DynamicsResult,
    options: kr5.identification.DynamicsOptions,
    file: Path,
) -> None:
    """The cell with bodies that can exist and explain the torques; the tool stays as it is believed."""
    if not cell.robot.links:
        raise kr5.InvalidArgument("--write-cell: the cell has no link masses to begin with; add them to the cell")
    prior = link_bodies(cell, with_tool=False)
    if min(b.mass for b in prior) < LEAST_MASS:
        raise kr5.InvalidArgument(
            "--write-cell: a link of the cell has no mass; the search for physically possible bodies begins"
            " at the masses of the cell"
        )
    options.estimator, options.prior_bodies = "consistent", prior
    options.choose_terms = options.choose_estimate = False
    options.prior_spread, options.min_speed = result.prior_spread, result.min_speed
    model, left_out = terms_of_a_cell(result.model)
    found = identification.identify_dynamics(without_tool(cell, motion, model), model, options)
    if not found.fit.usable:
        raise kr5.InvalidArgument(f"--write-cell: {found.fit.message}")
    with beside(file) as new:
        kr5_cell.save_cell(put_dynamics(cell, found), new)
    if left_out:
        warnings.warn(
            f"{file}: links, rotors and friction were estimated without {', '.join(left_out)}, which it cannot hold",
            kr5.Caution,
            stacklevel=2,
        )
    warnings.warn(
        f"{file}: links, rotors and friction by the consistent estimate, whose bodies are physically possible",
        kr5.Caution,
        stacklevel=2,
    )


def terms_of_a_cell(model: kr5.identification.DynamicsModel) -> tuple[Any, list[str]]:
    """The model with the terms that a cell holds, and offsets, which would otherwise end up in them; and the names of
    the others."""
    terms = [
        identification.JointTerms(coulomb=t.coulomb, viscous=t.viscous, rotor_inertia=t.rotor_inertia, offset=t.offset)
        for t in model.terms
    ]
    plain = identification.DynamicsModel(
        chain=model.chain, gravity=model.gravity, structure=model.structure, terms=terms
    )
    held = set(identification.DynamicsRegressor(plain).names)
    return plain, [name for name in identification.DynamicsRegressor(model).names if name not in held]


def without_tool(
    cell: kr5.cell.Cell, motion: kr5.identification.JointMotion, model: kr5.identification.DynamicsModel
) -> Any:
    """The motion with the torques that the links alone ask for: those of the tool, as it is believed, are taken away,
    so that the links are not asked to hold a part of it."""
    tool = tool_body(cell)
    if tool is None:
        return motion
    regressor = identification.DynamicsRegressor(model)
    chi = np.zeros(len(regressor.names))
    last = 13 * (cell.robot.joints - 1)
    chi[last : last + 10] = standard_parameters(tool)
    return identification.JointMotion(
        t=motion.t,
        q=motion.q,
        qd=motion.qd,
        qdd=motion.qdd,
        tau=np.asarray(motion.tau) - np.asarray(regressor.torques(motion, chi)),
        run_starts=motion.run_starts,
    )


def put_dynamics(cell: kr5.cell.Cell, found: kr5.identification.DynamicsResult) -> Any:
    """A copy of the cell with the identified links, rotors and friction; the tool stays as it is believed."""
    out = kr5_cell.parse_cell(cell.to_yaml())
    robot = out.robot
    robot.links = [kr5_cell.Link(mass=b.mass, com=b.com, inertia=b.inertia) for b in found.bodies]
    out.robot = robot
    n = cell.robot.joints
    chi = dict(zip(found.base.parameters, np.asarray(found.parameters), strict=True))

    def each(stem: str) -> np.ndarray:
        return np.array([max(chi.get(f"{stem}{k + 1}", 0.0), 0.0) for k in range(n)])

    drives = out.drives or kr5_cell.Drives(structure=np.eye(n), rotor_inertia=np.zeros(n), torque_constant=np.ones(n))
    ratio = np.abs(np.diag(np.asarray(drives.structure)))
    drives.rotor_inertia = each("Ia") / ratio**2
    drives.friction = kr5_cell.Friction(coulomb=each("fc"), viscous=each("fv"))
    out.drives = drives
    return out
