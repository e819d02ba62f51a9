"""The chain of an arm that follows from its joint axes."""

import numpy as np
from kr5 import kinematics


def chain_of(lines: list[kinematics.AxisLine], home: np.ndarray, end: np.ndarray) -> kinematics.DhChain:
    """The arm whose last frame has its origin where the measured thing is when every joint is at home."""
    z = lines[-1].direction
    x = np.linalg.svd(z[None])[2][1]
    flange = np.eye(4)
    flange[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    flange[:3, 3] = end
    return kinematics.chain_from_axes(lines, home, flange)
