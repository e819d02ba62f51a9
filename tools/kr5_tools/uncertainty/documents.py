"""The files of `kr5 uncertainty`: chains of poses, sensors that measure one point, a camera before a board."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from kr5.files.documents import Document, PositiveNumber, check_names, fail_at
from kr5.logs.units import UNITS
from pydantic import AfterValidator, Field, field_validator, model_validator

BOOK = Path(__file__).resolve().parent / "book"
NEARLY = 1e-3  # how far a rotation that was printed with few digits may be off
Length = Literal["m", "cm", "mm", "um"]
Angle = Literal["rad", "mrad", "deg"]
Six = Annotated[list[float], Field(min_length=6, max_length=6)]
Three = Annotated[list[float], Field(min_length=3, max_length=3)]
Probability = Annotated[float, Field(gt=0, lt=1)]


def _square(size: int) -> Callable[[list[list[float]]], list[list[float]]]:
    def check(rows: list[list[float]]) -> list[list[float]]:
        if [len(row) for row in rows] != [size] * size:
            raise ValueError(f"a {size} x {size} matrix")
        return rows

    return check


def _not_negative(values: list[float]) -> list[float]:
    if min(values) < 0:
        raise ValueError(f"found the standard deviation {min(values):g}, expected none below 0")
    return values


SixDeviations = Annotated[Six, AfterValidator(_not_negative)]
ThreeDeviations = Annotated[Three, AfterValidator(_not_negative)]
SixCovariance = Annotated[list[list[float]], AfterValidator(_square(6))]
ThreeCovariance = Annotated[list[list[float]], AfterValidator(_square(3))]
PoseNumbers = Six | list[Annotated[list[float], Field(min_length=4, max_length=4)]]


def _check_one(sigma: object, covariance: object, needed: bool) -> None:
    """Complains of both, and of neither where one is needed."""
    if sigma is not None and covariance is not None:
        raise ValueError("found both, expected sigma or covariance")
    if needed and sigma is None and covariance is None:
        raise ValueError("found neither, expected sigma or covariance")


class Units(Document):
    length: Length = Field("m", description="unit of lengths")
    angle: Angle = Field("rad", description="unit of angles")

    @property
    def length_factor(self) -> float:
        return UNITS["length"][self.length]

    @property
    def angle_factor(self) -> float:
        return UNITS["angle"][self.angle]

    @property
    def six(self) -> np.ndarray:
        """Factors to SI of a pose error."""
        return np.repeat([self.length_factor, self.angle_factor], 3)


class PoseEntry(Document):
    """x y z roll pitch yaw or a 4 x 4 matrix, with deviations by axis or a covariance (axes of the inner frame)."""

    name: str = Field(min_length=1)
    T: PoseNumbers = Field(description="x y z roll pitch yaw, or a 4 x 4 matrix")
    sigma: SixDeviations | None = Field(None, description="standard deviations of x y z and of the rotation about them")
    covariance: SixCovariance | None = Field(None, description="6 x 6, in squares and products of the units")
    inverse: bool = Field(False, description="whether the chain takes the inverse of this pose")

    @model_validator(mode="after")
    def _one_at_most(self) -> Self:
        _check_one(self.sigma, self.covariance, needed=False)
        return self


class PointEntry(Document):
    value: Three = Field(description="x y z in the last frame of the chain")
    sigma: ThreeDeviations | None = None
    covariance: ThreeCovariance | None = Field(None, description="3 x 3")

    @model_validator(mode="after")
    def _one_at_most(self) -> Self:
        _check_one(self.sigma, self.covariance, needed=False)
        return self


class ChainFile(Units):
    chain: list[PoseEntry] = Field(min_length=1, max_length=100)
    point: PointEntry | None = None
    confidence: Probability = 0.95

    @field_validator("chain")
    @classmethod
    def _unique(cls, chain: list[PoseEntry]) -> list[PoseEntry]:
        check_names([entry.name for entry in chain])
        return chain


class MeasurementEntry(Document):
    """A sensor in the common frame, and the point that it measures, in its own."""

    name: str = Field(min_length=1)
    T: PoseNumbers
    pose_sigma: SixDeviations | None = Field(None, description="standard deviations of its pose, as of a chain")
    point: Three = Field([0.0, 0.0, 0.0], description="x y z of the point, in the frame of the sensor")
    sigma: ThreeDeviations | None = None
    covariance: ThreeCovariance | None = Field(None, description="3 x 3, of the point")

    @model_validator(mode="after")
    def _exactly_one(self) -> Self:
        _check_one(self.sigma, self.covariance, needed=True)
        return self


class PrintedEntry(Document):
    """A covariance that was published, to be compared."""

    name: str
    of: str = Field(description="name of a measurement, or fused")
    covariance: ThreeCovariance
    rounding: PositiveNumber = Field(1e-9, description="of its entries, of the largest one [-]")


class SensorsFile(Units):
    frame: str = Field("common frame", description="the frame that all poses are in")
    measurements: list[MeasurementEntry] = Field(min_length=1, max_length=100)
    printed: list[PrintedEntry] = []
    confidence: Probability = 0.95

    @field_validator("measurements")
    @classmethod
    def _unique(cls, entries: list[MeasurementEntry]) -> list[MeasurementEntry]:
        check_names([entry.name for entry in entries])
        return entries


class CameraEntry(Document):
    width: int = Field(gt=0)
    height: int = Field(gt=0)
    fx: PositiveNumber
    fy: PositiveNumber
    cx: float
    cy: float


class BoardEntry(Document):
    """Two planes of squares at a right angle, which share an edge."""

    square: PositiveNumber = Field(description="side of a square")
    columns: int = Field(ge=2, le=100, description="corners of each plane across")
    rows: int = Field(ge=2, le=100, description="corners of each plane up")


class PrintedDeviations(Document):
    noise: list[PositiveNumber]
    sigma_x: list[float]
    sigma_z: list[float]

    @model_validator(mode="after")
    def _same_length(self) -> Self:
        if not len(self.noise) == len(self.sigma_x) == len(self.sigma_z) > 0:
            raise ValueError("found lists of different lengths, expected a deviation for each noise")
        return self


class CameraMatrixFile(Units):
    camera: CameraEntry
    board: BoardEntry
    distance: PositiveNumber = Field(description="from the camera to the middle of the board")
    noise: list[PositiveNumber] = Field(min_length=1, max_length=50, description="standard deviations [px]")
    printed: PrintedDeviations | None = None


def pose_of(
    entry: PoseEntry | MeasurementEntry, units: Units, source: Path, at: list[int | str], text: str
) -> np.ndarray:
    """The pose of an entry in SI; a rotation that was printed with few digits is put right."""
    import kr5

    rows = entry.T
    if not isinstance(rows[0], list):
        return np.asarray(kr5.from_xyzrpy(units.six * np.array(rows)))
    T = np.array(rows, float)
    if T.shape != (4, 4) or not np.allclose(T[3], [0, 0, 0, 1]):
        fail_at(source, [*at, "T"], "expected x y z roll pitch yaw, or a 4 x 4 matrix whose last row is 0 0 0 1", text)
    if not kr5.is_rotation(T[:3, :3], NEARLY):
        fail_at(
            source,
            [*at, "T"],
            f"its rotation part is not a rotation matrix: determinant {np.linalg.det(T[:3, :3]):.6g}, expected 1 and"
            " columns at right angles",
            text,
        )
    T[:3, :3] = kr5.nearest_rotation(T[:3, :3])
    T[:3, 3] *= units.length_factor
    return T


def covariance_of(
    sigma: list[float] | None,
    covariance: list[list[float]] | None,
    factors: np.ndarray,
    source: Path,
    at: list[int | str],
    text: str,
) -> np.ndarray:
    """The covariance in SI; complains of a matrix that is none, with its eigenvalue in the units of the file."""
    import kr5

    size = len(factors)
    given = np.diag(np.square(sigma)) if sigma is not None else np.array(covariance or np.zeros((size, size)), float)
    if defect := kr5.covariance_defect(given):
        fail_at(source, [*at, "covariance"], defect, text)
    return np.asarray(np.outer(factors, factors) * given)
