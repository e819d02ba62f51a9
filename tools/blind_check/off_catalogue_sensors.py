"""Effects no catalogue names, of tool, force sensor, structure, camera and scanner."""

import numpy as np
from scipy.signal import cont2discrete, lfilter
from scipy.spatial.transform import Rotation

from .catalogue import random_sign
from .stages import at_stage
from .truth import WRENCH


@at_stage("load")
def slosh(truth, target, m, rng):
    """A liquid swings in the tool: a pendulum driven by the tool's acceleration."""
    w0, com = rng.uniform(6, 14), rng.uniform(0.08, 0.16)

    def hook(s):
        a, b = cont2discrete(
            (np.array([[0, 1], [-(w0**2), -0.06 * w0]]), np.array([[0.0], [1.0]]), np.eye(2), np.zeros((2, 1))),
            0.012,
            "zoh",
        )[:2]
        den = np.poly(a)
        num = np.array([0.0, b[0, 0], a[0, 1] * b[1, 0] - a[1, 1] * b[0, 0]])
        for k in (0, 1):
            x = lfilter(num, den, (s.w[:, k] - s.w[0, k]) / truth.cell["tool"]["mass"])
            s.w[:, k] += m * w0**2 * x
            s.w[:, 4 - k] += (1 - 2 * k) * m * w0**2 * x * com

    return hook


@at_stage("sensor")
def ft_hysteresis(truth, target, m, rng):
    """Reading lags behind the load by a play, as friction in the sensor's body does."""
    k, half = WRENCH.index(target), m * (0.15 if target[0] == "f" else 0.008)

    def hook(s):
        for run in s.runs:
            x, out = s.w[run][0, k], []
            for w in s.w[run][:, k].tolist():
                x = min(max(x, w - half), w + half)
                out.append(x)
            s.w[run, k] = out

    return hook


@at_stage("sensor")
def ft_warming(truth, target, m, rng):
    """Offset that follows the load with the slowness of the sensor's temperature."""
    k, tau = WRENCH.index(target), rng.uniform(5, 25)

    def hook(s):
        dt = s.t[1] - s.t[0]
        for run in s.runs:
            load = np.linalg.norm(s.w[run][:, :3] - s.w[run][0, :3], axis=1)
            f = 1 - np.exp(-dt / tau)
            s.w[run, k] += m * (1.0 if k < 3 else 0.05) * lfilter([f], [1, f - 1], load)

    return hook


@at_stage("sensor")
def ft_quadratic(truth, target, m, rng):
    k = WRENCH.index(target)
    top = 30.0 if k < 3 else 3.0

    def hook(s):
        s.w[:, k] += m * s.w[:, k] * np.abs(s.w[:, k]) / top

    return hook


@at_stage("sensor")
def ft_turned(truth, target, m, rng):
    """The sensor is mounted turned."""
    R = Rotation.from_rotvec(m * np.array([*rng.choice([-1, 1], 2) * 0.5, random_sign(rng)])).as_matrix()

    def hook(s):
        s.w[:, :3], s.w[:, 3:] = s.w[:, :3] @ R, s.w[:, 3:] @ R

    return hook


@at_stage("pose")
def link_bending(truth, target, m, rng):
    """Links bend under their load: the tip falls with the cube of the reach."""

    def hook(s):
        xy = s.T[:, :2, 3]
        s.T[:, 2, 3] -= m * np.sum(xy**2, 1) ** 1.5

    return hook


@at_stage("pose")
def base_flex(truth, target, m, rng):
    """The stand tilts towards where the arm reaches, more easily one way than the other."""
    soft, about = rng.uniform(1.5, 3), rng.uniform(-np.pi, np.pi)
    d = np.array([np.cos(about), np.sin(about)])

    def hook(s):
        xy = s.T[:, :2, 3]
        lean = m * (xy + (soft - 1) * np.outer(xy @ d, d))
        R = Rotation.from_rotvec(np.column_stack([-lean[:, 1], lean[:, 0], 0 * lean[:, 0]])).as_matrix()
        s.T[:, :3] = R @ s.T[:, :3]

    return hook


@at_stage("pose")
def walking_base(truth, target, m, rng):
    """The stand creeps over the session."""
    d = rng.standard_normal(3)

    def hook(s):
        s.T[:, :3, 3] += m * np.outer(s.t / 1000, d / np.linalg.norm(d))

    return hook


@at_stage("lens")
def thin_prism(truth, target, m, rng):
    d = rng.standard_normal(2)
    d /= np.linalg.norm(d)

    def hook(s):
        s.x, s.y = s.x + m * d[0] * s.r2**2, s.y + m * d[1] * s.r2**2

    return hook


@at_stage("lens")
def higher_distortion(truth, target, m, rng):
    side = random_sign(rng)

    def hook(s):
        radius = np.sqrt(s.r2)
        wave = side * m * np.sin(14 * radius)
        s.x, s.y = s.x * (1 + wave), s.y * (1 + wave)

    return hook


@at_stage("pixel")
def rolling_shutter(truth, target, m, rng):
    """Rows are read one after another while the arm still rings: each view is sheared by its own amount."""
    seed = int(rng.integers(2**32))

    def hook(s):
        shear = np.random.default_rng(seed).uniform(-1, 1, 10000)[s.d["view"].astype(int)]
        s.u = s.u + 10 * m * shear * (s.v / truth.cell["camera"]["height"] - 0.5)

    return hook


@at_stage("pixel")
def corner_bias(truth, target, m, rng):
    """Blooming light makes the dark squares look smaller."""

    def hook(s):
        marker = np.unique(np.column_stack([s.d["view"], s.d["marker"]]), axis=0, return_inverse=True)[1].ravel()
        n = np.bincount(marker)
        for x in ("u", "v"):
            value = getattr(s, x)
            middle = (np.bincount(marker, value) / n)[marker]
            setattr(s, x, value - m * np.sign(value - middle))

    return hook


@at_stage("fan")
def laser_fan(truth, target, m, rng):
    """The fan's scale differs from the middle to the edge."""

    def hook(s):
        s.x = s.x * (1 + m * (s.x / 0.045) ** 2)

    return hook


@at_stage("range")
def laser_bow(truth, target, m, rng):
    side = random_sign(rng)

    def hook(s):
        s.z = s.z + side * m * np.cos(3 * np.pi * s.x / 0.09)

    return hook


@at_stage("range")
def second_reflection(truth, target, m, rng):
    """Steep surfaces look nearer."""

    def hook(s):
        s.z = s.z - m * (1 - s.steep) ** 2

    return hook
