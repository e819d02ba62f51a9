"""Types of result files as dictionaries, as commands make and write them; result_models checks those that are read."""

from typing import Any, TypedDict


class VerdictData(TypedDict):
    word: str
    text: str


class CauseData(TypedDict, total=False):
    cause: str
    text: str
    remedy: str | None
    evidence: str
    probability: float | None


class FigureData(TypedDict, total=False):
    """A number for people, in the unit that it names."""

    name: str
    unit: str
    value: float | None
    std: float | None
    corrected: list[float] | None


class ViewData(TypedDict, total=False):
    """A view, a posture or a profile, and what is left of it."""

    name: str
    points: float | None
    rms_px: float | None
    weight: float | None
    robot_position: float | None
    robot_rotation: float | None
    distance: float | None
    position_error: float | None
    noise_px: float | None
    tilt_deg: float | None
    influence: float | None
    outlier: bool | None
    image: str | None
    drawing: str | None
    note: str


class ResidualData(TypedDict):
    """Seen minus predicted of the points of a view [px]."""

    view: str
    u: list[float]
    v: list[float]
    du: list[float]
    dv: list[float]


class FrameData(TypedDict, total=False):
    name: str
    parent: str | None
    T: list[list[float]]
    kind: str
    size: list[float]
    id: int


class FindingData(TypedDict, total=False):
    """A target or marker that was found in an image."""

    view: str
    what: str
    ids: list[int]
    pixels: list[list[float]]
    sigma: list[float]
    pose: dict[str, Any] | None
    noise: float | None


class MissData(TypedDict, total=False):
    view: str
    name: str
    status: str
    message: str


class ResultData(TypedDict, total=False):
    """A result file. Which keys there are depends on `format`; `result` has those of a calibration, in SI."""

    format: str
    version: str
    created: str
    command: str
    input: dict[str, Any]
    verdict: VerdictData
    causes: list[CauseData]
    figures: list[FigureData]
    views: list[ViewData]
    residuals: list[ResidualData]
    frames: list[FrameData]
    held_out: dict[str, Any]
    result: dict[str, Any]
    image_size: list[int]
    alignment: dict[str, Any]
    found: list[FindingData]
    not_found: list[MissData]
    study: dict[str, Any]
    samples: list[dict[str, Any]]
    wrenches: dict[str, Any]
    returns: list[dict[str, Any]]
    responses: dict[str, Any]
    design: dict[str, Any]
    contact: dict[str, Any]
    cloud: dict[str, Any]
    camera: dict[str, Any]
