"""A cell as it really is: the believed one with some parameters moved, and functions that bend single stages."""

import copy
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
G = 9.81


def pose_matrix(v) -> np.ndarray:
    """4x4 of `x y z roll pitch yaw`, or the 4x4 itself."""
    v = np.asarray(v, float)
    if v.shape == (4, 4):
        return v
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", v[3:]).as_matrix()
    T[:3, 3] = v[:3]
    return T


def pose_vector(T: np.ndarray) -> list[float]:
    return [*T[:3, 3].tolist(), *Rotation.from_matrix(T[:3, :3]).as_euler("xyz").tolist()]


@dataclass
class Truth:
    """`hooks[stage]` are called in order with the state of that stage and change it."""

    cell: dict
    hooks: dict[str, list[Callable]] = field(default_factory=lambda: defaultdict(list))
    compliance: dict[int, float] = field(default_factory=dict)  # 1/stiffness of a joint [rad/(N m)]
    gaps: dict[int, float] = field(default_factory=dict)  # backlash of a joint [rad]
    base: np.ndarray = field(default_factory=lambda: np.eye(3))
    growth: Callable = lambda t: 0.0 * t
    current_structure: np.ndarray | None = None
    tube_turn: np.ndarray = field(default_factory=lambda: np.eye(3))
    tube_shift: np.ndarray = field(default_factory=lambda: np.zeros(2))
    tube_shape: np.ndarray = field(default_factory=lambda: np.eye(2))  # takes the bore to a circle
    hardening: float = 0.0
    lateral: float = 0.0
    axial: float = 0.0
    laser_lag: float = 0.0
    stride: int = 1  # more than 1: plain and quick, every so many rows of a motion, joints deflect without swinging

    @staticmethod
    def of(cell: dict) -> "Truth":
        return Truth(copy.deepcopy(cell))

    @property
    def joints(self) -> int:
        return len(self.cell["robot"]["dh"])

    def bend(self, stage: str, state) -> None:
        for hook in self.hooks[stage]:
            hook(state)


def attach_mass(body: dict, mass: float, com) -> None:
    """Adds a point mass to a body, in its frame."""
    m0, c0 = body["mass"], np.asarray(body["com"], float)
    xx, yy, zz, xy, xz, yz = body["inertia"]
    total = m0 + mass
    c = (m0 * c0 + mass * np.asarray(com)) / total
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], float)
    for m, p in ((m0, c0), (mass, np.asarray(com))):
        d = p - c
        J += m * (d @ d * np.eye(3) - np.outer(d, d))
    body.update(mass=total, com=c.tolist(), inertia=[J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]])
