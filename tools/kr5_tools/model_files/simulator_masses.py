"""Masses as simulators take them."""

from typing import Any

import kr5
import numpy as np
from kr5.kinematics import is_real


def require_masses(arm: Any, name: str, simulator: str) -> None:
    """Complains of links that a simulator refuses: each that moves needs a mass and the inertia of a real body.

    arm: `kr5.cell.ArmLinks`; name: of the cell, for the error.
    """
    for k, link in enumerate(arm.links):
        least = float(np.linalg.eigvalsh(link.body.inertia_matrix()).min())
        if is_real(link.body) and least > 0:
            continue
        found = f"a mass of {link.body.mass:g} kg and a least moment of inertia of {least:.3g} kg m^2"
        if link.body.mass > 0 and least > 0:
            found = "an inertia of which two principal moments add up to less than the third"
        raise kr5.IoError(
            f"{name or 'cell'}: link {k + 1} has {found}, which {simulator} refuses for a link that moves; give"
            " robot.links the mass and inertia of a real body"
        )


def inertia_attribute(inertia: np.ndarray) -> tuple[str, np.ndarray]:
    """Name and values of the inertia of an MJCF body [kg m^2].

    MuJoCo refuses a `fullinertia` with a principal moment of zero, as a point mass has, but no `diaginertia`.
    """
    return ("fullinertia", inertia) if np.any(inertia[3:]) else ("diaginertia", inertia[:3])
