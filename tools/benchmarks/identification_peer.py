"""The identification of FIGAROH (pip install figaroh), run with its own functions on the same smoothed motion:
regressor of Pinocchio sample by sample, viscous and dry friction, rotor inertia and offset of each joint, zero columns
left out, base parameters by its double QR, least squares, then weights by joint."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np


def pinocchio_chain(cell: Any) -> Any:
    """The arm of a cell for Pinocchio; each body is attached to its joint's frame."""
    import kr5
    import pinocchio as pin

    model, parent = pin.Model(), 0
    T = np.asarray(cell.robot.T_base_0)
    for k, row in enumerate(cell.robot.dh):
        kind = pin.JointModelPZ() if str(row.type) == "prismatic" else pin.JointModelRZ()
        parent = model.addJoint(parent, kind, pin.SE3(T), f"joint{k + 1}")
        model.appendBodyToJoint(parent, pin.Inertia(1.0, np.zeros(3), 0.1 * np.eye(3)), pin.SE3.Identity())
        turned = kr5.from_xyzrpy([0, 0, row.b, 0, 0, row.theta_offset])
        along = kr5.from_xyzrpy([row.a, 0, 0, row.alpha, 0, 0])
        T = turned @ along @ kr5.from_xyzrpy([0, 0, 0, 0, row.beta, 0])
    model.gravity.linear = np.asarray(cell.robot.gravity)
    return model


@dataclass
class Figaroh:
    """A fit of FIGAROH, which predicts further motions. `coupled`: joints 5 and 6 turn motor 6, as in its TX40."""

    cell: Any
    coupled: bool = False
    columns: list[int] = field(default_factory=list)
    phi: np.ndarray = field(default_factory=lambda: np.empty(0))

    def regressor(self, motion: Any) -> np.ndarray:
        """Rows joint by joint."""
        from figaroh.tools.regressor import build_regressor_basic

        model = pinocchio_chain(self.cell)
        robot = SimpleNamespace(model=model, data=model.createData())
        settings = {
            "has_friction": True,
            "has_actuator_inertia": True,
            "has_joint_offset": True,
            "is_joint_torques": True,
            "is_external_wrench": False,
            "act_idxv": list(range(model.nv)),
        }
        q, v, a = (np.asarray(x) for x in (motion.q, motion.qd, motion.qdd))
        W = build_regressor_basic(robot, q, v, a, settings)
        return np.hstack([W, _wrist_columns(v, a)]) if self.coupled else W

    def fit(self, motion: Any) -> "Figaroh":
        from figaroh.tools.qrdecomposition import get_baseIndex
        from figaroh.tools.regressor import get_index_eliminate

        W = self.regressor(motion)
        names = {f"p{k}": 0.0 for k in range(W.shape[1])}
        left_out, kept = get_index_eliminate(W, names, 1e-6)
        rest = [k for k in range(W.shape[1]) if k not in set(left_out)]
        base = get_baseIndex(W[:, rest], kept)
        self.columns = [rest[k] for k in base]
        tau = np.asarray(motion.tau).T.ravel()
        A = W[:, self.columns]
        phi = np.linalg.pinv(A) @ tau
        n = np.asarray(motion.tau).shape[1]
        variance = ((tau - A @ phi).reshape(n, -1) ** 2).mean(1)
        weight = np.repeat(1 / np.sqrt(variance + 1e-12), len(tau) // n)
        self.phi = np.linalg.lstsq(A * weight[:, None], tau * weight, rcond=None)[0]
        return self

    def predict(self, motion: Any) -> np.ndarray:
        """Torques, samples x joints."""
        n = np.asarray(motion.q).shape[1]
        return (self.regressor(motion)[:, self.columns] @ self.phi).reshape(n, -1).T


def _wrist_columns(v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Inertia, viscous and dry friction of the motor that joints 5 and 6 turn together."""
    N, n = v.shape
    out = np.zeros((n * N, 3))
    both = np.sign(v[:, 4] + v[:, 5])
    out[4 * N : 5 * N] = np.column_stack([a[:, 5], v[:, 5], both])
    out[5 * N : 6 * N] = np.column_stack([a[:, 4], v[:, 4], both])
    return out
