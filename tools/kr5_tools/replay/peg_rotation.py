"""How a tilted peg stands: a peg knows its axis alone, and the rotation about it is a choice."""

import numpy as np


def peg_rotations(tilt: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    """Rotations n x 3 x 3 of the peg in the frame in which tilt and azimuth of its lowest point are stated [rad]; Z is
    its axis, up, and X has no part of Y of that frame."""
    axis = np.column_stack([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    across = np.cross(np.broadcast_to([0.0, 1.0, 0.0], axis.shape), axis)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return np.stack([across, np.cross(axis, across), axis], axis=2)
