"""All kinds of experiment: what they would show, noise, and the gap to what was seen."""

import numpy as np
from scipy.spatial.transform import Rotation

from .contact import press, profile, step
from .motion import motion
from .outside import poses, scan, views
from .truth import Truth

KINDS = {"motion": motion, "poses": poses, "views": views, "scan": scan, "step": step, "press": press, "profile": profile}
QUATERNION = ("qw", "qx", "qy", "qz")


def simulate(truth: Truth, kind: str, given: dict) -> dict:
    """Columns without noise."""
    return KINDS[kind](truth, given)


def sigma(noise: dict, kind: str, column: str) -> float:
    special = {("scan", "z"): "laser", ("profile", "z"): "depth", ("step", "z"): "position", ("press", "z"): "position"}
    if (kind, column) in special:
        return noise[special[kind, column]]
    if kind == "poses":
        return noise["pose_position" if column in "xyz" else "pose_rotation"]
    return noise[{"q": "position", "i": "current", "f": "force", "t": "torque", "u": "pixel", "v": "pixel"}[column[0]]]


def turn(columns: dict) -> Rotation:
    return Rotation.from_quat(np.column_stack([columns[c] for c in QUATERNION]), scalar_first=True)


def with_noise(columns: dict, kind: str, noise: dict, rng: np.random.Generator) -> dict:
    """What the sensors show; `sphere` is the verdict of the scanner and has no noise."""
    out = {}
    for name, value in columns.items():
        exact = name == "sphere" or (kind == "poses" and name in QUATERNION)
        out[name] = value if exact else value + sigma(noise, kind, name) * rng.standard_normal(len(value))
    if kind == "poses":
        R = turn(columns) * Rotation.from_rotvec(noise["pose_rotation"] * rng.standard_normal((len(out["x"]), 3)))
        q = R.as_quat(scalar_first=True)
        q *= np.where(rng.random(len(q)) < 0.5, 1, -1)[:, None]
        out |= dict(zip(QUATERNION, q.T, strict=True))
    return out


def residuals(kind: str, seen: dict, simulated: dict, noise: dict) -> dict:
    """Seen less simulated in noise units, column by column, of the columns both have; rays at an edge are NaN."""
    out = {}
    for name, value in simulated.items():
        if name == "sphere" or name not in seen or (kind == "poses" and name in QUATERNION):
            continue
        r = (seen[name] - value) / sigma(noise, kind, name)
        if kind == "scan":
            r = np.where(seen["sphere"] == simulated["sphere"], r, np.nan)
        out[name] = r
    if kind == "poses" and all(c in seen for c in QUATERNION):
        w = (turn(simulated).inv() * turn(seen)).as_rotvec() / noise["pose_rotation"]
        out |= dict(zip(("rx", "ry", "rz"), w.T, strict=True))
    return out


def rms(values: np.ndarray) -> float:
    good = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else 0.0


def sizes(kind: str, with_effect: dict, without: dict, noise: dict) -> dict[str, float]:
    """RMS an effect adds to each column in noise units; of a quaternion twice its change, which is an angle."""
    out = {c: rms(r) for c, r in residuals(kind, with_effect, without, noise).items() if c not in ("rx", "ry", "rz")}
    if kind == "poses":
        a, b = (turn(x).as_quat(scalar_first=True) for x in (with_effect, without))
        a = a * np.sign(np.sum(a * b, 1))[:, None]
        out |= {c: rms(2 * (a - b)[:, i] / noise["pose_rotation"]) for i, c in enumerate(QUATERNION)}
    return out
