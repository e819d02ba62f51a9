"""A pose as numbers for people."""

import numpy as np
import numpy.typing as npt

from ._kr5 import to_pose, to_xyzrpy


def xyzrpy_with_std(
    T: npt.ArrayLike, covariance: npt.ArrayLike
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Position and roll, pitch, yaw of a pose [m, rad] (6), and their standard deviations, from its covariance (6 x 6,
    right perturbation, linear first [m, rad])."""
    step = 1e-6
    pose = np.asarray(T, dtype=float)
    centre = to_xyzrpy(pose)
    jacobian = np.empty((6, 6))
    for i in range(6):
        change = to_xyzrpy(pose @ to_pose(step * np.eye(6)[i])) - centre
        change[3:] = (change[3:] + np.pi) % (2 * np.pi) - np.pi
        jacobian[:, i] = change / step
    spread = jacobian @ np.asarray(covariance, dtype=float) @ jacobian.T
    return np.asarray(centre), np.sqrt(np.maximum(np.diag(spread), 0))
