"""All kinds of experiment: what they would show, noise, and the gap to what was seen."""

import numpy as np
from scipy.spatial.transform import Rotation

from .contact import simulate_press, simulate_profile, simulate_step
from .external_sensors import simulate_poses, simulate_scan, simulate_views
from .motion import simulate_motion
from .truth import Truth

KINDS = {
    "motion": simulate_motion,
    "poses": simulate_poses,
    "views": simulate_views,
    "scan": simulate_scan,
    "step": simulate_step,
    "press": simulate_press,
    "profile": simulate_profile,
}
QUATERNION = ("qw", "qx", "qy", "qz")


def simulate(truth: Truth, kind: str, given: dict) -> dict:
    """Columns without noise."""
    return KINDS[kind](truth, given)


def noise_sigma(noise: dict, kind: str, column: str) -> float:
    special = {("scan", "z"): "laser", ("profile", "z"): "depth", ("step", "z"): "position", ("press", "z"): "position"}
    if (kind, column) in special:
        return noise[special[kind, column]]
    if kind == "poses":
        return noise["pose_position" if column in "xyz" else "pose_rotation"]
    return noise[{"q": "position", "i": "current", "f": "force", "t": "torque", "u": "pixel", "v": "pixel"}[column[0]]]


def rotation_of(columns: dict) -> Rotation:
    return Rotation.from_quat(np.column_stack([columns[c] for c in QUATERNION]), scalar_first=True)


def with_noise(columns: dict, kind: str, noise: dict, rng: np.random.Generator) -> dict:
    """What the sensors show; `sphere` is the verdict of the scanner and has no noise."""
    out = {}
    for name, value in columns.items():
        exact = name == "sphere" or (kind == "poses" and name in QUATERNION)
        out[name] = value if exact else value + noise_sigma(noise, kind, name) * rng.standard_normal(len(value))
    if kind == "poses":
        R = rotation_of(columns) * Rotation.from_rotvec(
            noise["pose_rotation"] * rng.standard_normal((len(out["x"]), 3))
        )
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
        r = (seen[name] - value) / noise_sigma(noise, kind, name)
        if kind == "scan":
            r = np.where(seen["sphere"] == simulated["sphere"], r, np.nan)
        out[name] = r
    if kind == "poses" and all(c in seen for c in QUATERNION):
        w = (rotation_of(simulated).inv() * rotation_of(seen)).as_rotvec() / noise["pose_rotation"]
        out |= dict(zip(("rx", "ry", "rz"), w.T, strict=True))
    return out


def root_mean_square(values: np.ndarray) -> float:
    good = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else 0.0


def effect_sizes(kind: str, with_effect: dict, without: dict, noise: dict) -> dict[str, float]:
    """RMS an effect adds to each column in noise units; of a quaternion twice its change, which is an angle."""
    out = {
        c: root_mean_square(r)
        for c, r in residuals(kind, with_effect, without, noise).items()
        if c not in ("rx", "ry", "rz")
    }
    if kind == "poses":
        a, b = (rotation_of(x).as_quat(scalar_first=True) for x in (with_effect, without))
        a = a * np.sign(np.sum(a * b, 1))[:, None]
        out |= {c: root_mean_square(2 * (a - b)[:, i] / noise["pose_rotation"]) for i, c in enumerate(QUATERNION)}
    return out
