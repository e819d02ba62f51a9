"""What all writers of XML share: numbers that read back exactly, elements, rotations."""

import xml.etree.ElementTree as xml
from typing import Any

import numpy as np
import numpy.typing as npt

ROUNDING = 1e-15  # [m, -]


def number_text(values: npt.ArrayLike) -> str:
    """A number, or numbers with blanks between, that read back exactly."""
    return " ".join(repr(float(v) + 0.0).removesuffix(".0") for v in np.atleast_1d(values))


def quaternion(T: np.ndarray) -> np.ndarray:
    """Rotation of a pose, w x y z with w not negative."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True)
    return np.array([w, x, y, z])


def rounded_pose(T: np.ndarray) -> np.ndarray:
    """A pose without what rounding leaves of zeros."""
    return np.where(np.abs(T) < ROUNDING, 0.0, T)


def add_element(
    parent: xml.Element, tag: str, text: npt.ArrayLike = "", **attributes: npt.ArrayLike | None
) -> xml.Element:
    """A child with attributes; numbers become text, and what is None is left out."""
    values = {name: v if isinstance(v, str) else number_text(v) for name, v in attributes.items() if v is not None}
    out = xml.SubElement(parent, tag, values)
    out.text = (text if isinstance(text, str) else number_text(text)) or None
    return out


def document_text(root: xml.Element) -> str:
    xml.indent(root)
    return f'<?xml version="1.0"?>\n{xml.tostring(root, encoding="unicode")}\n'
