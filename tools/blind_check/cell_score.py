"""Holds one diagnosis against the truth of its cell."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from .truth import pose_matrix

SHAPES = ("phase",)  # parameters whose sign or turn is a matter of writing
FAILED = "failed"


@dataclass
class CellScore:
    """`label` is the sealed truth; `named` says for each of its effects whether any cause is it, or ties with it."""

    name: str
    label: dict
    verdict: str = FAILED
    first: bool = False  # the first cause is one of the effects
    first_named: str = "nothing"
    named: list[bool] = field(default_factory=list)
    causes: list[tuple[float, bool]] = field(default_factory=list)  # probability, right
    ties: int = 0  # of the first cause
    errors: list[tuple[str, str, float, float]] = field(
        default_factory=list
    )  # effect, parameter, relative error, sigmas
    closed: float | None = None  # of the excess on a fresh recording
    seconds: float | None = None
    cpu: float | None = None
    memory: float | None = None

    @property
    def sort(self) -> str:
        return self.label["sort"]

    @property
    def catalogued(self) -> list[dict]:
        return [e for e in self.label["effects"] if e["catalogued"]]

    @property
    def largest(self) -> float:
        """Size of the smallest effect that must be named."""
        return min((e["largest"] for e in self.label["effects"]), default=0.0)


def names_effect(cause: dict, effect: dict) -> bool:
    """Whether a cause, or one it says it cannot tell from it, is the effect."""
    return any(
        c.get("effect") == effect["effect"] and c.get("target") == effect["target"]
        for c in [cause, *cause.get("tied_with", [])]
    )


def _numbers(value, like) -> np.ndarray | None:
    """Values as a vector; mounts as they differ from the true one, so that a zero vector is right."""
    try:
        value = np.asarray(value, float)
        if np.shape(like) == (4, 4):
            T = np.linalg.inv(pose_matrix(like)) @ pose_matrix(value)
            return np.concatenate([T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_rotvec()])
        return np.atleast_1d(value).ravel()
    except (TypeError, ValueError):
        return None


def parameter_errors(cause: dict, effect: dict) -> list[tuple[str, str, float, float]]:
    """Relative error and error over its stated uncertainty, of every number both give."""
    out = []
    for name, true in effect["parameters"].items():
        told = cause.get("parameters", {}).get(name)
        if name in SHAPES or isinstance(true, str) or told is None:
            continue
        value, std = (told.get("value"), told.get("std")) if isinstance(told, dict) else (told, None)
        a = _numbers(value, true)
        b = np.zeros(6) if np.shape(true) == (4, 4) else _numbers(true, true)
        if a is None or b is None or len(a) != len(b):
            continue
        s = _numbers(std, 0.0) if std is not None else np.full(len(b), np.nan)
        s = np.broadcast_to(s if s is not None and len(s) in (1, len(b)) else np.nan, len(b))
        scale = np.linalg.norm(b) if len(b) > 1 else abs(b[0])
        relative = np.abs(a - b) / scale if scale > 0 else np.full(len(b), np.nan)
        whole = name in ("cycles", "element")
        out += [
            (effect["effect"], name, r, np.nan if whole or not d > 0 else abs(x) / d)
            for r, x, d in zip(relative, a - b, s, strict=True)
        ]
    return out


def excess_closed(before: dict | None, after: dict | None, rows: dict[str, int]) -> float | None:
    """Share of gap^2 - 1 that is gone, over the columns that exceeded the floor; `rows` of each experiment."""
    if not before or not after:
        return None
    squares = {c: g**2 for c, g in before["columns"].items() if g is not None and after["columns"].get(c) is not None}
    count = {c: max(rows.get(c.rsplit(".", 1)[0], 1), 1) for c in squares}
    columns = [c for c, g2 in squares.items() if g2 * count[c] > chi2.ppf(0.999, count[c])]
    excess = sum(squares[c] - 1 for c in columns)
    return 1 - sum(after["columns"][c] ** 2 - 1 for c in columns) / excess if columns else None


def score_cell(
    name: str, label: dict, diagnosis: dict | None, run: dict | None = None, before=None, after=None, rows=None
) -> CellScore:
    out = CellScore(name, label, named=[False] * len(label["effects"]))
    if run:
        out.seconds, out.cpu, out.memory = run["seconds"], run.get("cpu"), run.get("memory")
    if diagnosis is None:
        return out
    causes = diagnosis.get("causes", [])
    out.verdict = diagnosis.get("verdict", FAILED)
    out.closed = excess_closed(before, after, rows or {})
    known = [e for e in label["effects"] if e["catalogued"]]
    for cause in causes:
        out.causes.append((float(cause.get("probability", 0.0)), any(names_effect(cause, e) for e in known)))
    out.named = [e["catalogued"] and any(names_effect(c, e) for c in causes) for e in label["effects"]]
    if causes:
        out.first = out.causes[0][1]
        out.ties = len(causes[0].get("tied_with", []))
        right = next((e for e in known if names_effect(causes[0], e)), None)
        out.first_named = right["effect"] if right else str(causes[0].get("effect"))
    for e in known:
        out.errors += next(
            (
                parameter_errors(c, e)
                for c in causes
                if (c.get("effect"), c.get("target")) == (e["effect"], e["target"])
            ),
            [],
        )
    return out
