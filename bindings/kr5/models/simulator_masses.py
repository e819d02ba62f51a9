"""Masses as simulators take them."""

import numpy as np

import kr5
import kr5.cell
import kr5.kinematics
from kr5.files.xml_text import quaternion
from kr5.kinematics import is_real

LEAST_MOMENT = 1e-9  # of the largest, below which rounding may make it negative


def require_masses(arm: kr5.cell.ArmLinks, name: str, simulator: str) -> None:
    """Complains of links that a simulator refuses: each that moves needs a mass and the inertia of a real body.

    name: of the cell, for the error.
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


def inertial_attributes(body: kr5.kinematics.Body | kr5.cell.Tool) -> dict[str, np.ndarray]:
    """Attributes of an MJCF body that hold the inertia of a body about its centre of mass [kg m^2].

    MuJoCo refuses a `fullinertia` with a principal moment of zero, as a point mass or a thin rod has, but no
    `diaginertia`, which is stated along the principal axes.
    """
    inertia = np.asarray(body.inertia)
    if not np.any(inertia[3:]):
        return {"diaginertia": inertia[:3]}
    moments, axes = np.linalg.eigh(body.inertia_matrix())
    if moments[0] > LEAST_MOMENT * moments[2]:
        return {"fullinertia": inertia}
    T = np.eye(4)
    T[:3, :3] = axes * np.sign(np.linalg.det(axes))
    return {"diaginertia": np.maximum(moments, 0.0), "quat": quaternion(T)}
