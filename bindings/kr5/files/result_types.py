"""Types of result files as dictionaries, as commands make and write them; result_models checks those that are read."""

from typing import Any, Literal, Required, TypedDict

import numpy.typing as npt


class VerdictData(TypedDict, total=False):
    word: Required[str]
    text: Required[str]
    label: str
    icon: str


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


ViewNumber = Literal[
    "points",
    "rms_px",
    "weight",
    "robot_position",
    "robot_rotation",
    "distance",
    "position_error",
    "noise_px",
    "tilt_deg",
    "influence",
]


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
    reason: str


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
    T: npt.ArrayLike
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
    id: int | str
    rms_px: float | None
    pose: dict[str, Any] | None
    pose_message: str


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
    responses: list[dict[str, Any]]
    design: dict[str, Any]
    contact: dict[str, Any]
    cloud: dict[str, Any]
    camera: dict[str, Any]
    # an insertion
    inserted: bool
    pegs: list[dict[str, Any]]
    phases: list[dict[str, Any]]
    profile: dict[str, list[float]]
    directions: dict[str, dict[str, float | None]]
    T_tube_actual: list[list[float]]
    # bins
    pellets: list[dict[str, Any]]
    bins: list[dict[str, Any]]
    # a study of uncertainty
    parts: list[dict[str, Any]]
    # a scene
    name: str
    passed: bool
    checks: list[dict[str, Any]]
    # a sweep
    tilts: list[float]
    clearances: list[float]
    orientations: list[str]
    strategies: list[str]
    insert_by: str
    seed: int
