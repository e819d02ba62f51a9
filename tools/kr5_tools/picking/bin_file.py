"""`bin.yaml`: where a bin stands and how large it is."""

from pathlib import Path
from typing import Annotated, Any

import kr5
import numpy as np
from kr5 import picking
from kr5.files.documents import OpenDocument, Pose, PoseMatrix, PositiveNumber, read_document
from pydantic import Field

EXPECTED = "a bin: T_base_bin (x y z roll pitch yaw, or a 4 x 4 matrix; origin at the centre of the inner floor, Z up)"
EXAMPLE = "T_base_bin: [0.8, 0, 0.1, 0, 0, 0]\nsize: [0.2, 0.2, 0.1]\n"


class BinFile(OpenDocument):
    """The keys of the file."""

    T_base_bin: Pose | PoseMatrix
    size: Annotated[list[PositiveNumber], Field(min_length=3, max_length=3, description="inner lengths [m]")]
    wall_thickness: PositiveNumber = 0.003


def read_bin(file: Path) -> Any:
    """The bin of a file."""
    data = read_document(file, BinFile, EXPECTED)
    given = np.asarray(data.T_base_bin, float)
    out = picking.Bin(size=data.size, wall_thickness=data.wall_thickness)
    try:
        out.T_base_bin = kr5.from_xyzrpy(given) if given.shape == (6,) else given
        out.validate()
    except (kr5.Error, ValueError) as error:
        raise kr5.FileError(file, str(error)) from error
    return out
