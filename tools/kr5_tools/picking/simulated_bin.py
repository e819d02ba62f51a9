"""The simulated bin: its shape, and the camera above it."""

from pathlib import Path
from typing import Any

import kr5
from kr5 import sim

# The book's camera (Hayat et al. 2022, appendix C.2) with pixels twice as wide.
CAMERA: dict[str, Any] = {
    "width": 1224,
    "height": 1025,
    "fx": 1164.3,
    "fy": 1167.2,
    "cx": 626.8,
    "cy": 505.8,
    "k1": -0.2018,
}


def bin_shape(file: Path | None) -> Any:
    """The bin of a file, or the one that is taken without."""
    if file is None:
        return sim.BinShape(T_base_bin=kr5.from_xyzrpy([0.6, 0.0, 0.1, 0.0, 0.0, 0.0]))
    from kr5_tools.picking.bin_file import read_bin

    given = read_bin(file)
    return sim.BinShape(T_base_bin=given.T_base_bin, size=given.size, wall=given.wall_thickness)
