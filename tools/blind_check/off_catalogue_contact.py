"""Effects no catalogue names, of bench, tube, grip and path correction."""

import numpy as np
from scipy.signal import lfilter

from .stages import at_stage


@at_stage("press")
def contact_hysteresis(truth, target, m, rng):
    """The bench gives back less force than it took."""

    def hook(s):
        s.force = s.force * np.where(s.v > 1e-5, 1 - m, 1.0)

    return hook


@at_stage("press")
def contact_creep(truth, target, m, rng):
    """The bench's cover relaxes under load."""
    tau = rng.uniform(0.4, 2.0)

    def hook(s):
        k = 1 - np.exp(-0.012 / tau)
        for run in s.runs:
            f = s.force[run]
            s.force[run] = f - m * lfilter([k], [1, k - 1], f)

    return hook


@at_stage("rub")
def stick_slip(truth, target, m, rng):
    pitch = rng.uniform(0.15, 0.5)

    def hook(s):
        s.friction *= (1 + m * (2 * np.mod(s.d["alpha"] / pitch, 1) - 1))[:, None]

    return hook


def oval_tube(truth, target, m, rng):
    a = rng.uniform(0, np.pi)
    R = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    truth.tube_shape = R @ np.diag([1 + m, 1 / (1 + m)]) @ R.T


@at_stage("depth")
def burr(truth, target, m, rng):
    where, width = rng.uniform(0, 2 * np.pi), rng.uniform(0.15, 0.5)

    def hook(s):
        off = np.mod(s.d["alpha"] - where + np.pi, 2 * np.pi) - np.pi
        s.z = s.z + m * np.exp(-((off / width) ** 2))

    return hook


@at_stage("depth")
def grip_slip(truth, target, m, rng):
    """The peg is pushed back into the grip as each run goes on."""
    tau = rng.uniform(2, 8)

    def hook(s):
        for run in s.runs:
            t = s.t[run] - s.t[run][0]
            s.z[run] += m * (1 - np.exp(-t / tau))

    return hook


@at_stage("tool_servo")
def path_creep(truth, target, m, rng):
    """The correction settles with a slow tail."""
    tau = rng.uniform(0.8, 2.0)

    def hook(s):
        k = 1 - np.exp(-s.dt / tau)
        slow = s.z[0] + lfilter([k], [1, k - 1], s.z - s.z[0])
        s.z = (1 - m) * s.z + m * slow

    return hook


@at_stage("tool_command")
def path_rate_limit(truth, target, m, rng):
    """A correction acts no faster than a rate."""
    top = 1e-4 / m

    def hook(s):
        x, out = float(s.u[0]), []
        for u in s.u.tolist():
            x += min(max(u - x, -top), top)
            out.append(x)
        s.u = np.array(out)

    return hook
