"""Arrays of points whose shape does not say which of its axes counts the points."""

from typing import Any

import numpy as np
import numpy.typing as npt


def points_from_rows(array: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Points that stand in the rows of an array, n x 3 or n x 2, as n x 1 x 3 or n x 1 x 2.

    Functions of kr5 take points as n x 3, as 3 x n and as n x 1 x 3 (as OpenCV has them), but refuse three points as
    3 x 3, which may be either of the first two. This says which.
    """
    return _as_matrix(array)[:, None, :]


def points_from_columns(array: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Points that stand in the columns of an array, 3 x n or 2 x n, as n x 1 x 3 or n x 1 x 2; see points_from_rows."""
    return _as_matrix(array).T[:, None, :]


def _as_matrix(array: npt.ArrayLike) -> npt.NDArray[Any]:
    values = np.asarray(array, dtype=float)
    if values.ndim != 2:
        raise ValueError(f"points: expected an array of two dimensions, found one of shape {values.shape}")
    return values
