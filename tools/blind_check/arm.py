"""The arm: where its flange is, and what moves it (Pinocchio)."""

import hashlib
from collections import OrderedDict
from types import SimpleNamespace

import numpy as np
import pinocchio as pin

from .truth import Truth, pose_matrix

# Springs that bound the free play of a gear, of the formats' six joints; further joints are like the last [N m/rad].
TEETH = (8e5, 8e5, 4e5, 8e4, 5e4, 3e4)


def gear_teeth(joint: int) -> float:
    return TEETH[min(joint, len(TEETH) - 1)]


def link_transform(row: dict, q, scale=1.0) -> np.ndarray:
    """Rz(q + theta_offset) Tz(b) Tx(a) Rx(alpha) for all q."""
    q = np.atleast_1d(q)
    c, s = np.cos(q + row["theta_offset"]), np.sin(q + row["theta_offset"])
    ca, sa = np.cos(row["alpha"]), np.sin(row["alpha"])
    T = np.zeros((len(q), 4, 4))
    T[:, 0, 0], T[:, 0, 1], T[:, 0, 2], T[:, 0, 3] = c, -s * ca, s * sa, row["a"] * scale * c
    T[:, 1, 0], T[:, 1, 1], T[:, 1, 2], T[:, 1, 3] = s, c * ca, -c * sa, row["a"] * scale * s
    T[:, 2, 1], T[:, 2, 2], T[:, 2, 3], T[:, 3, 3] = sa, ca, row["b"] * scale, 1
    return T


def chain(cell: dict, Q: np.ndarray, scale=1.0) -> np.ndarray:
    """Flange in the base for all rows of Q."""
    T = np.eye(4)
    for i, row in enumerate(cell["robot"]["dh"]):
        T = T @ link_transform(row, Q[:, i], scale)
    return T


def _inertia(body: dict) -> pin.Inertia:
    xx, yy, zz, xy, xz, yz = body["inertia"]
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], float)
    return pin.Inertia(body["mass"], np.array(body["com"], float), J)


class Dynamics:
    """Rigid arm of a truth, the base tilted and the links grown as it says."""

    _known: OrderedDict = OrderedDict()

    def __init__(self, truth: Truth, scale: float = 1.0):
        cell = truth.cell
        self.model, parent, place = pin.Model(), 0, pin.SE3.Identity()
        for i, (row, body) in enumerate(zip(cell["robot"]["dh"], cell["robot"]["links"], strict=True)):
            joint = self.model.addJoint(parent, pin.JointModelRZ(), place, f"j{i}")
            end = pin.SE3(link_transform(row, 0.0, scale)[0])
            self.model.appendBodyToJoint(joint, _inertia(body), end)
            parent, place = joint, end
        self.sensor, self.tool, self.last = (
            place * pin.SE3(pose_matrix(cell["tool"]["T_F_S"])),
            _inertia(cell["tool"]),
            parent,
        )
        self.model.appendBodyToJoint(parent, self.tool, self.sensor)
        self.gravity = truth.base.T @ np.array(cell["robot"]["gravity"], float)
        self.model.gravity.linear = self.gravity
        self.data = self.model.createData()
        robot = cell["robot"]
        self.key = repr((robot["dh"], robot["links"], cell["tool"], self.gravity.tolist(), scale)).encode()

    def torque_and_wrench(self, q, v, a) -> tuple[np.ndarray, np.ndarray]:
        """Joint torques, and the wrench of the tool on the sensor; remembers the last few, as many effects share
        them."""
        key = hashlib.blake2b(b"".join([self.key, *(np.ascontiguousarray(x).tobytes() for x in (q, v, a))])).digest()
        if key not in self._known:
            self._known[key] = self._compute(q, v, a)
            while len(self._known) > 12:
                self._known.popitem(last=False)
        self._known.move_to_end(key)
        return self._known[key]

    def _compute(self, q, v, a):
        tau, W = np.zeros_like(q), np.zeros((len(q), 6))
        for k in range(len(q)):
            tau[k] = pin.rnea(self.model, self.data, q[k], v[k], a[k])
            acceleration, velocity = (
                self.sensor.actInv(self.data.a_gf[self.last]),
                self.sensor.actInv(self.data.v[self.last]),
            )
            W[k] = -(self.tool * acceleration + velocity.cross(self.tool * velocity)).vector
        return tau, W

    def gravity_torque(self, Q) -> np.ndarray:
        return np.array([pin.computeGeneralizedGravity(self.model, self.data, q) for q in Q])

    def along(self, q, v, a, joint: int):
        """Of one joint over a motion: torque, inertia, and how the torque changes with its angle and speed."""
        out = np.zeros((4, len(q)))
        for k in range(len(q)):
            dq, dv, M = pin.computeRNEADerivatives(self.model, self.data, q[k], v[k], a[k])
            out[:, k] = self.data.tau[joint], M[joint, joint], dq[joint, joint], dv[joint, joint]
        return out


def rest_angles(truth: Truth, Q: np.ndarray, t: np.ndarray) -> np.ndarray:
    """True joint angles of static postures from the readings: offsets, gear errors, sag and play under gravity."""
    zero = np.zeros_like(Q)
    s = SimpleNamespace(q=Q.copy(), v=zero.copy(), a=zero.copy(), t=t)
    truth.bend("angle", s)
    if truth.compliance or truth.gaps:
        apply_sag(truth, s.q, Dynamics(truth).gravity_torque(s.q))
    return s.q


def apply_sag(truth: Truth, q: np.ndarray, tau: np.ndarray) -> None:
    """Lets links yield to a torque that does not change: soft joints by their compliance, loose ones to the torque's
    side."""
    for j, c in truth.compliance.items():
        q[:, j] -= tau[:, j] * c
    for j, gap in truth.gaps.items():
        q[:, j] -= np.where(np.abs(tau[:, j]) > 0.5, np.sign(tau[:, j]) * gap / 2, 0.0)


def flange(truth: Truth, Q: np.ndarray, t: np.ndarray) -> np.ndarray:
    """True flange in B of static postures."""
    q = rest_angles(truth, Q, t)
    T = chain(truth.cell, q, 1.0 + truth.growth(t))
    T[:, :3] = truth.base @ T[:, :3]
    s = SimpleNamespace(T=T, q=q, t=t, truth=truth)
    truth.bend("pose", s)
    return s.T
