"""Masses, friction and rotors of an arm from a recording of its torques, by `kr5.identification`. Masses stay
as given: what they do beside first and second moments of a serial arm on a fixed base cannot be seen. What the bench
asks of the simulator stands here, too."""

from dataclasses import dataclass
from typing import Any

import kr5.cell
import kr5.predict
import numpy as np
from kr5 import identification, kinematics, physics
from kr5.logs.joint_motion import arm_model
from scipy.interpolate import CubicSpline

from kr5_tools.identify.identified_cell import believed_parameters, link_bodies, put_dynamics

SIMULATOR = kr5.predict.FastSimulator()


@dataclass
class Identified:
    cell: Any
    offset: np.ndarray  # constant part of each column that no part of the cell makes
    residual: np.ndarray  # of the fit experiments, rows x joints


def columns(cell: Any, experiments: list[Any]) -> np.ndarray:
    """What the simulator shows, experiments one after the other, rows x joints."""
    out = []
    for e in experiments:
        shown = SIMULATOR.predict(cell, e)
        out.append(np.column_stack([shown[f"i{k + 1}"] for k in range(cell.robot.joints)]))
    return np.vstack(out)


def recorded(experiments: list[Any], joints: int) -> np.ndarray:
    return np.vstack([np.column_stack([e[f"i{k + 1}"] for k in range(joints)]) for e in experiments])


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


def commanded_motion(cell: Any, experiment: Any) -> Any:
    """The motion of an experiment whose servos follow at once, with torques on the joint side; the first rows, at which
    the simulator starts from rest, are left out."""
    n, t = cell.robot.joints, np.asarray(experiment["t"])
    course = CubicSpline(t, np.column_stack([experiment[f"qc{k + 1}"] for k in range(n)]))
    tau = physics.reported_torques(cell, recorded([experiment], n))
    servo = cell.servo.joint[0]
    behind = 2 * servo.damping_ratio / servo.natural_frequency + servo.delay
    q, qd, qdd = (course(t - behind, order)[1:] for order in range(3))
    return identification.JointMotion(t=t[1:], q=q, qd=qd, qdd=qdd, tau=tau[1:])


def identify(cell: Any, experiments: list[Any], rotors: bool = True) -> Identified:
    """The cell that explains the torques of the fit experiments. Of all cells that do, the one nearest to what is
    believed, with its masses; where the motion leaves combinations open, the likeliest with bodies that can exist."""
    n = cell.robot.joints
    fit = [e for e in experiments if str(e.split) == "fit"]
    motion = identification.merged_motion([commanded_motion(cell, e) for e in fit])
    found = positive_drives(cell, motion, rotors)
    if found.observability.unidentifiable:
        options = identification.DynamicsOptions(
            held_out=0.0, estimator="consistent", prior_bodies=link_bodies(cell, with_tool=True), prior_spread=1.0
        )
        model = arm_model(cell, [identification.JointTerms(offset=True, rotor_inertia=rotors)] * n)
        out = put_dynamics(cell, identification.identify_dynamics(motion, model, options))
    else:
        believed = believed_parameters(cell, found.model)
        out = with_parameters(cell, nearest_parameters(found.base, np.asarray(found.values), believed, n), rotors)
    off = recorded(fit, n) - columns(out, fit)
    return Identified(out, off.mean(0), off - off.mean(0))


def positive_drives(cell: Any, motion: Any, rotors: bool) -> Any:
    """The weighted estimate; friction and rotors that would become negative are left out, the most negative first."""
    n = cell.robot.joints
    kept = {"coulomb": [True] * n, "viscous": [True] * n, "rotor_inertia": [rotors] * n}
    stems = {"coulomb": "fc", "viscous": "fv", "rotor_inertia": "Ia"}
    while True:
        terms = [identification.JointTerms(offset=True, **{k: v[j] for k, v in kept.items()}) for j in range(n)]
        found = identification.identify_dynamics(
            motion, arm_model(cell, terms), identification.DynamicsOptions(held_out=0.0)
        )
        assert found.fit.usable, found.fit.message
        told = [
            (value[0], name, j)
            for name, stem in stems.items()
            for j in range(n)
            if kept[name][j] and (value := found.parameter(f"{stem}{j + 1}")) is not None
        ]
        if not told or min(told)[0] >= 0:
            return found
        _, name, joint = min(told)
        kept[name][joint] = False


def nearest_parameters(base: Any, values: np.ndarray, believed: np.ndarray, joints: int) -> np.ndarray:
    """Standard parameters with these base parameters, changed least from the believed ones; masses are not changed."""
    change = np.ones(len(believed))
    for k in range(joints):
        mass = believed[13 * k + 9]
        change[13 * k : 13 * k + 10] = [0.02 * mass + 0.01] * 6 + [0.2 * mass + 0.1] * 3 + [0.0]
        change[13 * k + 10 : 13 * k + 13] = 100.0
    R = np.asarray(base.regrouping) * change
    return np.asarray(believed + change * (np.linalg.pinv(R) @ (values - np.asarray(base.regrouping) @ believed)))


def with_parameters(cell: Any, chi: np.ndarray, rotors: bool) -> Any:
    """A copy of the cell with these standard parameters."""
    n = cell.robot.joints
    own = chi[: 13 * n].reshape(n, 13)
    out = kr5.cell.parse_cell(cell.to_yaml())
    robot, links = out.robot, []
    for *second, cx, cy, cz, mass, _, _, _ in own:
        body = kinematics.body_from_parameters([mass, cx, cy, cz, *second])
        links.append(kr5.cell.Link(mass=body.mass, com=body.com, inertia=body.inertia))
    robot.links = links
    out.robot = robot
    changes = {"coulomb": np.maximum(own[:, 10], 0), "viscous": np.maximum(own[:, 11], 0)}
    if rotors:
        changes["rotor_inertia"] = np.maximum(own[:, 12], 0) / np.diag(np.asarray(cell.drives.structure)) ** 2
    return with_drives(out, **changes)
