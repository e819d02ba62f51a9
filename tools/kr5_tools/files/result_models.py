"""Models of the result files that `kr5 report` and `kr5 gap explain` read; keys that they do not name are kept as they
are."""

from typing import Any, Literal

from pydantic import Field, model_validator

from kr5_tools.files.documents import Document, OpenDocument, PoseMatrix


class Verdict(OpenDocument):
    word: Literal["good", "doubtful", "unusable"]
    text: str


class Cause(OpenDocument):
    cause: str
    text: str
    remedy: str | None = None
    probability: float | None = Field(None, description="probability [-]")


class Figure(OpenDocument):
    name: str
    unit: str
    value: float | None = None
    std: float | None = Field(None, description="standard deviation, in the unit of the value")


class View(OpenDocument):
    name: str | int
    points: float | None = None
    rms_px: float | None = None
    weight: float | None = None
    robot_position: float | None = Field(None, description="[m]")
    robot_rotation: float | None = Field(None, description="[rad]")
    distance: float | None = Field(None, description="[m]")
    position_error: float | None = Field(None, description="[m]")
    noise_px: float | None = None
    tilt_deg: float | None = None
    influence: float | None = None
    outlier: bool | None = None
    image: str | None = None
    drawing: str | None = None


class Residual(OpenDocument):
    """Seen minus predicted of the points of a view [px]."""

    u: list[float]
    v: list[float]
    du: list[float]
    dv: list[float]

    @model_validator(mode="after")
    def _same_length(self) -> "Residual":
        if len({len(self.u), len(self.v), len(self.du), len(self.dv)}) != 1:
            raise ValueError("u, v, du and dv of one length")
        return self


class Frame(OpenDocument):
    name: str
    T: PoseMatrix
    parent: str | None = None


class Finding(OpenDocument):
    """A target or marker that was found in an image."""

    view: str
    what: str
    ids: list[int] = Field(min_length=1)
    pixels: list[list[float]] = Field(description="u and v of each point [px]")
    sigma: list[float] = Field(description="standard deviation of each point [px]")

    @model_validator(mode="after")
    def _pixels_of_every_point(self) -> "Finding":
        if [len(row) for row in self.pixels] != [len(self.ids)] * 2:
            raise ValueError(f"pixels: u and v of {len(self.ids)} points")
        return self


class Miss(OpenDocument):
    view: str
    message: str


class ResultFile(OpenDocument):
    """What a calibration or a detection writes with -o."""

    format: str
    verdict: Verdict | None = None
    causes: list[Cause] = []
    figures: list[Figure] = []
    views: list[View] = []
    residuals: list[Residual] = []
    frames: list[Frame] = []
    held_out: dict[str, Any] = {}
    result: dict[str, Any] = {}
    input: dict[str, Any] = {}
    image_size: list[int] = []
    alignment: dict[str, Any] = {}
    found: list[Finding] = []
    not_found: list[Miss] = []


class EffectOnTarget(OpenDocument):
    effect: str
    target: str


class ParameterEstimate(OpenDocument):
    """A number, a list or a matrix, and standard deviations of the same shape."""

    value: Any
    std: Any
    unit: str


class BlamedCause(EffectOnTarget):
    probability: float | None
    parameters: dict[str, ParameterEstimate]
    gap_closed: float | None
    tied_with: list[EffectOnTarget]


class Dependence(OpenDocument):
    variable: str
    how: str
    evidence: float | None


class GapPlace(OpenDocument):
    experiment: str
    column: str
    gap: float | None
    depends_on: list[Dependence]


class LocatedGap(GapPlace):
    target: str
    share: float | None


class GapReduction(OpenDocument):
    before: float | None
    after: float | None
    columns: dict[str, list[float | None]]


class NextExperiment(OpenDocument):
    separates: list[str]
    do: str


class DiagnosisFile(OpenDocument):
    """A diagnosis, `kr5-gap/1`."""

    verdict: Literal["no_gap", "explained", "partly_explained", "unknown"]
    where: list[LocatedGap]
    causes: list[BlamedCause]
    unexplained: list[GapPlace]
    shrink: GapReduction
    next_experiment: NextExperiment
    scope: list[str] = []
    warnings: list[str] = []


class SweepFile(OpenDocument):
    """`sweep.json`: what a sweep is of."""

    tilts: list[float] = Field(description="[deg]")
    clearances: list[float] = Field(description="[mm]")
    orientations: list[str]
    strategies: list[str]
    insert_by: str
    seed: int
    cell_sha256: str
    version: str


MODELS: dict[str, type[Document]] = {"kr5-gap/1": DiagnosisFile, "kr5-sweep/1": SweepFile}


def model_of(format: str) -> type[Document]:
    return MODELS.get(format, ResultFile)
