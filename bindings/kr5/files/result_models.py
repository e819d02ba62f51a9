"""Models of the result files that `kr5 report` and `kr5 gap explain` read; keys that they do not name are kept as they
are."""

from typing import Any, Literal

from pydantic import Field, model_validator

from kr5.files.documents import Document, OpenDocument, PoseMatrix


class ResultVerdict(OpenDocument):
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
    corrected: list[float] | None = Field(
        None, min_length=2, max_length=2, description="value and standard deviation with the first cause corrected"
    )


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
    verdict: ResultVerdict | None = None
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


class DescribedDependence(OpenDocument):
    variable: str
    how: str
    evidence: float | None


class Variable(OpenDocument):
    kind: str
    joint: int = Field(0, description="from 1; 0: none")
    column: str = ""
    experiment: str = ""


class Dependence(OpenDocument):
    """The fields of `kr5.gap.Dependence`, and the same in words."""

    variable: Variable
    shape: str
    evidence: float | None
    text: str = Field("", description="the dependence in words; not read back")


class LocatedGap(OpenDocument):
    experiment: str
    column: str
    target: str
    gap: float | None
    share: float | None
    depends_on: list[Dependence]


class DescribedGap(OpenDocument):
    experiment: str
    column: str
    gap: float | None
    depends_on: list[DescribedDependence]


class GapReduction(OpenDocument):
    before: float | None
    after: float | None
    columns: dict[str, list[float | None]]


class NextExperiment(OpenDocument):
    separates: list[EffectOnTarget]
    kind: str | None = Field(None, description="kind of the experiment; none: `kr5 gap plan` searches for one")
    what: str = ""
    text: str = Field("", description="the experiment in words; not read back")


class MujocoFriction(OpenDocument):
    scale: float = Field(1.0, description="of each frictionloss, over the dry friction that was found [-]")
    time_constant: float | None = Field(None, description="of solreffriction; none: as the model states it [s]")
    impedance: float | None = Field(None, description="of solimpfriction; none: as the model states it [-]")


class MujocoErrors(OpenDocument):
    """Errors of positions, RMS over the rows to check, one a joint [rad or m]."""

    joints: list[str]
    slides: list[bool] = Field(description="whether a joint moves along its axis")
    rows: int
    checked: bool = Field(description="whether the rows were kept to judge")
    before: list[float] = Field(description="MuJoCo with the model as it was read")
    own: list[float] = Field(description="kr5 with the causes")
    after: list[float] = Field(description="MuJoCo with the model that was written")
    as_found: list[float] = Field([], description="MuJoCo with dry friction as found, where other is written")
    friction: MujocoFriction = Field(description="dry friction that is written")
    seconds: float


class DiagnosisFile(OpenDocument):
    """A diagnosis, `kr5-gap/2`: the fields of `kr5.gap.Diagnosis`, `reduction` as `shrink` and `explained_fraction` as
    `gap_closed`. The library reads it, and tells what is wrong in lists whose items are not shown here."""

    verdict: Literal["no_gap", "explained", "partly_explained", "unknown"]
    text: str = Field("", description="the verdict in sentences; not read back")
    warnings: list[str] = Field([], description="all that was found about the recording in sentences; not read back")
    where: list[LocatedGap]
    causes: list[BlamedCause]
    unexplained: list[LocatedGap]
    shrink: GapReduction
    next_experiment: NextExperiment
    nearest: list[dict[str, Any]] = Field([], description="as `kr5.gap.NearestEffect`")
    not_tried: list[dict[str, Any]] = Field([], description="as `kr5.gap.UntriedEffect`")
    nuisance_std: float = 0.0
    scope: list[dict[str, Any]] = Field([], description="as `kr5.gap.ScopeLimit`")
    noise: list[dict[str, Any]] = Field([], description="as `kr5.gap.NoiseRatio`")
    clock_faults: list[dict[str, Any]] = Field([], description="as `kr5.gap.ClockFault`")
    spikes: int = 0
    outliers: int = 0
    coarse: list[dict[str, Any]] = Field([], description="as `kr5.gap.ColumnName`")
    left_out: list[dict[str, Any]] = Field([], description="as `kr5.gap.LeftOut`")
    missing_splits: list[dict[str, Any]] = Field([], description="as `kr5.gap.MissingSplit`")
    excused: list[dict[str, Any]] = Field([], description="as `kr5.gap.ColumnError`")
    clock_reset: bool = False
    effects_limit: int = 0
    sets_limit: int = 0
    joint_names: list[str] = []
    notes: list[str] = []
    mujoco: MujocoErrors | None = Field(None, description="what MuJoCo says of the model that was written")
    written: dict[str, str] = Field({}, description="files with the causes in them: `model` and `cell`")


class DescribedExperiment(OpenDocument):
    separates: list[str]
    do: str


class DescribedDiagnosisFile(OpenDocument):
    """A diagnosis as versions before 0.3 wrote it, `kr5-gap/1`: what it says in sentences is shown and not used."""

    verdict: Literal["no_gap", "explained", "partly_explained", "unknown"]
    where: list[DescribedGap]
    causes: list[BlamedCause]
    unexplained: list[DescribedGap]
    shrink: GapReduction
    next_experiment: DescribedExperiment
    scope: list[str] = []
    warnings: list[str] = []


class GapMeasureFile(OpenDocument):
    """Gap of every column, `kr5-gap-measure/1`."""

    gap: float
    parts: list[dict[str, Any]]
    columns: dict[str, float] = Field(min_length=1)
    limits: dict[str, float] = Field({}, description="limit of noise of each column [-]")


class ChangedParameter(OpenDocument):
    name: str
    first: list[float]
    second: list[float]
    std: list[float]
    unit: str


class ChangedEffect(EffectOnTarget):
    probability: float
    parameters: list[ChangedParameter]


class GapComparisonFile(OpenDocument):
    """What differs between two recordings, `kr5-gap-comparison/1`."""

    text: str
    changes: list[ChangedEffect]
    common: list[EffectOnTarget]
    difference: dict[str, Any] = Field(description="diagnosis of the difference, a kr5-gap/2")


class GapPlanFile(OpenDocument):
    """Experiments that distinguish alternatives, or what they said once they were done, `kr5-gap-plan/1`."""

    alternatives: list[list[EffectOnTarget]]
    text: str
    experiments: list[dict[str, Any]]
    probability: list[float] = Field([], description="of each alternative, once experiments were done [-]")


class ExplainedParameter(OpenDocument):
    """A number of a cause or an effect as a table shows it."""

    name: str
    value: str
    std: str
    unit: str
    nominal: str = Field(description="value of the cell")


class Reasons(OpenDocument):
    """What a recording says for something and against it, in sentences."""

    supporting: list[str] = Field(alias="for")
    against: list[str]
    parameters: list[ExplainedParameter]


class ExplainedCause(Reasons):
    name: str
    id: str
    sure: str = Field(description="probability, in words")
    what: str
    shows: str
    remedy: str
    rivals: list[str] = Field(description="what other effects do in its place")


class ExplainedColumn(OpenDocument):
    column: str
    before: float | None = Field(description="gap without the effect [-]")
    after: float | None = Field(description="gap with the effect [-]")


class ExplainedTarget(Reasons):
    """What fitting an effect on a target shows."""

    target: str
    name: str
    closed: float | None = Field(description="explained part of the excess [-]; null: no recorded column changes")
    choice: str = ""
    columns: list[ExplainedColumn] = []


class EffectParameter(OpenDocument):
    name: str
    unit: str
    what: str


class GapExplanationFile(OpenDocument):
    """What `kr5 gap explain --json` writes, `kr5-gap-explanation/1`: of a verdict `verdict` to `next`, of an effect
    `effect` to `targets`, the best target first."""

    verdict: Literal["no_gap", "explained", "partly_explained", "unknown"] | None = None
    text: str = ""
    causes: list[ExplainedCause] = []
    notes: list[str] = []
    next: list[str] = []
    effect: str | None = None
    name: str = ""
    what: str = ""
    shows: str = ""
    remedy: str = ""
    parameters: list[EffectParameter] = []
    targets: list[ExplainedTarget] = []

    @model_validator(mode="after")
    def _one_of_both(self) -> "GapExplanationFile":
        if (self.verdict is None) == (self.effect is None):
            raise ValueError("found neither or both of verdict and effect, expected one of them")
        return self


class InsertionFile(OpenDocument):
    """What `kr5 insert --json` writes."""

    inserted: bool
    pegs: list[dict[str, Any]]
    phases: list[dict[str, Any]]
    profile: dict[str, list[float]]
    directions: dict[str, dict[str, float | None]]
    T_tube_actual: PoseMatrix


class SceneCheckEntry(OpenDocument):
    expected: dict[str, Any]
    value: float | None
    passed: bool
    unit: str


class SceneResultFile(OpenDocument):
    """What `kr5 scene run --json` writes."""

    name: str
    passed: bool
    checks: list[SceneCheckEntry]


class PelletEntry(OpenDocument):
    centre: list[float] = Field(min_length=3, max_length=3, description="[m]")
    axis: list[float] = Field(min_length=3, max_length=3)
    radius: float
    height: float
    covariance: list[list[float]]
    exposed: float
    graspable: bool
    finding: str
    reason: str


class PickFile(OpenDocument):
    """What `kr5 pick` writes."""

    verdict: ResultVerdict
    figures: list[Figure]
    pellets: list[PelletEntry]


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


class SensitivityRunFile(OpenDocument):
    """`analysis.json`: what a sensitivity analysis evaluates."""

    title: str
    inputs: list[dict[str, Any]]
    outputs: int
    seed: int
    replicates: int
    model_sha256: str
    version: str


class NamedUnit(OpenDocument):
    """An input or an output; `factor` takes its unit to SI."""

    name: str
    unit: str
    factor: float = Field(gt=0)


class OneAtATimeTable(OpenDocument):
    """Changes of the outputs by input, inputs x outputs."""

    minus: list[list[float]]
    plus: list[list[float]]
    lowest: list[list[float]]
    highest: list[list[float]]


class SensitivityAnalysis(OpenDocument):
    """Indices by input (row) and output (column)."""

    name: str
    title: str
    text: str
    inputs: list[NamedUnit] = Field(min_length=1)
    outputs: list[NamedUnit] = Field(min_length=1)
    first: list[list[float]]
    first_low: list[list[float]]
    first_high: list[list[float]]
    total: list[list[float]]
    total_low: list[list[float]]
    total_high: list[list[float]]
    mean: list[float]
    variance: list[float]
    one_at_a_time: OneAtATimeTable
    samples: int
    evaluations: int
    confidence: float
    tolerance: float
    converged: bool
    notes: list[str]

    @model_validator(mode="after")
    def _shapes(self) -> "SensitivityAnalysis":
        shape = [len(self.outputs)] * len(self.inputs)
        for name in ("first", "first_low", "first_high", "total", "total_low", "total_high"):
            if [len(row) for row in getattr(self, name)] != shape:
                raise ValueError(f"found {name} of another shape, expected {len(shape)} inputs x {shape[0]} outputs")
        alone = self.one_at_a_time
        if any([len(row) for row in m] != shape for m in (alone.minus, alone.plus, alone.lowest, alone.highest)):
            raise ValueError("found one_at_a_time of another shape than the indices")
        if len(self.mean) != shape[0] or len(self.variance) != shape[0]:
            raise ValueError(f"found mean and variance of another length than {shape[0]} outputs")
        return self


class SensitivityResult(OpenDocument):
    analyses: list[SensitivityAnalysis] = Field(min_length=1)


class SensitivityFile(OpenDocument):
    """What `kr5 sensitivity` writes."""

    format: str
    verdict: ResultVerdict
    result: SensitivityResult


class ShownTable(OpenDocument):
    title: str
    columns: list[str]
    rows: list[list[str]]
    texts: list[str] = []

    @model_validator(mode="after")
    def _width(self) -> "ShownTable":
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"rows of {len(self.columns)} cells")
        return self


class ShownEllipse(OpenDocument):
    """A covariance to be drawn: of two coordinates, in the unit of `axes`."""

    name: str
    centre: list[float] = Field(min_length=2, max_length=2)
    covariance: list[list[float]] = Field(min_length=2, max_length=2)


class ShownEllipses(OpenDocument):
    name: str
    title: str
    text: str
    axes: list[str] = Field(min_length=2, max_length=2)
    confidence: float = Field(gt=0, lt=1)
    ellipses: list[ShownEllipse] = Field(min_length=1)


class ShownLine(OpenDocument):
    name: str
    x: list[float] = Field(min_length=1)
    y: list[float] = Field(min_length=1)


class ShownLines(OpenDocument):
    name: str
    title: str
    text: str
    axes: list[str] = Field(min_length=2, max_length=2)
    lines: list[ShownLine] = Field(min_length=1)


class UncertaintyPart(OpenDocument):
    title: str
    texts: list[str] = []
    tables: list[ShownTable] = []
    ellipses: list[ShownEllipses] = []
    lines: list[ShownLines] = []


class UncertaintyFile(OpenDocument):
    """What the commands of `kr5 uncertainty` write."""

    format: str
    verdict: ResultVerdict
    parts: list[UncertaintyPart] = Field(min_length=1)
    result: dict[str, Any]


MODELS: dict[str, type[Document]] = {
    "kr5-gap/2": DiagnosisFile,
    "kr5-gap/1": DescribedDiagnosisFile,
    "kr5-gap-measure/1": GapMeasureFile,
    "kr5-gap-comparison/1": GapComparisonFile,
    "kr5-gap-plan/1": GapPlanFile,
    "kr5-gap-explanation/1": GapExplanationFile,
    "kr5-insertion/1": InsertionFile,
    "kr5-scene-result/1": SceneResultFile,
    "kr5-pick/1": PickFile,
    "kr5-sweep/1": SweepFile,
    "kr5-sensitivity-run/1": SensitivityRunFile,
    "kr5-sensitivity/1": SensitivityFile,
    "kr5-uncertainty/1": UncertaintyFile,
}


def model_of(format: str) -> type[Document]:
    return MODELS.get(format, ResultFile)
