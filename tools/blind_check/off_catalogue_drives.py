"""Effects no catalogue names, of gears, drives and clocks."""

import numpy as np
from scipy.signal import lfilter

from .catalogue import joint_index, log_uniform, random_sign
from .stages import at_stage


def friction(make):
    """make(truth, i, m, rng) gives f(s), the extra friction torque of joint i."""

    def bend(truth, target, m, rng):
        i = joint_index(target)
        torque = make(truth, i, m * truth.cell["drives"]["friction"]["coulomb"][i], rng)

        def hook(s):
            s.friction[:, i] += torque(s)

        truth.hooks["friction"].append(hook)

    return bend


@friction
def asymmetric_friction(truth, i, c, rng):
    side = random_sign(rng)
    return lambda s: c * np.maximum(side * s.sign[:, i], 0) * side


@friction
def dahl_friction(truth, i, c, rng):
    """Friction with memory: builds up over a distance after each reversal instead of at once."""
    length = log_uniform(rng, 3e-3, 3e-2)

    def torque(s):
        z, out = 0.0, np.zeros(len(s.fine.t))
        for k, d in enumerate((np.diff(s.fine.q[:, i], prepend=s.fine.q[0, i]) / length).tolist()):
            target = 1.0 if d > 0 else -1.0
            z = target + (z - target) * np.exp(-abs(d))
            out[k] = z
        rows = round((s.t[1] - s.t[0]) / (s.fine.t[1] - s.fine.t[0]))
        return c * (out[::rows][: len(s.t)] - s.sign[:, i])

    return torque


@friction
def break_away(truth, i, c, rng):
    """Sticks for a distance after each reversal."""
    length = log_uniform(rng, 3e-3, 2e-2)

    def torque(s):
        travelled, last, out = 0.0, 0.0, np.zeros(len(s.t))
        for k, d in enumerate(np.diff(s.q[:, i], prepend=s.q[0, i]).tolist()):
            travelled, last = (0.0, d) if d * last < 0 else (travelled + abs(d), d or last)
            out[k] = np.exp(-travelled / length)
        return c * out * s.sign[:, i]

    return torque


@at_stage("torque")
def cable_jerk(truth, target, m, rng):
    """The dress pack snags at one angle, when passed one way."""
    i, side, width, where = joint_index(target), random_sign(rng), rng.uniform(0.02, 0.06), rng.uniform(-0.15, 0.15)

    def hook(s):
        at = s.q[0, i] + where
        s.torque[:, i] += 5 * m * np.exp(-(((s.q[:, i] - at) / width) ** 2)) * np.maximum(side * s.sign[:, i], 0) * side

    return hook


@at_stage("current")
def current_dead_zone(truth, target, m, rng):
    i = joint_index(target)

    def hook(s):
        x = s.i[:, i]
        s.i[:, i] = np.sign(x) * np.maximum(np.abs(x) - m, 0)

    return hook


@at_stage("current")
def current_saturation(truth, target, m, rng):
    i = joint_index(target)

    def hook(s):
        s.i[:, i] = np.clip(s.i[:, i], *(np.array([-1, 1]) * np.quantile(np.abs(s.i[:, i]), max(0.2, 1 - m))))

    return hook


@at_stage("current")
def current_steps(truth, target, m, rng):
    i = joint_index(target)

    def hook(s):
        s.i[:, i] = m * np.round(s.i[:, i] / m)

    return hook


@at_stage("reading")
def encoder_interpolation(truth, target, m, rng):
    """Error periodic in the motor's angle, in the reading alone."""
    i, lines = joint_index(target), int(rng.integers(1, 4))
    ratio = abs(truth.cell["drives"]["structure"][i][i])

    def hook(s):
        s.q[:, i] += m * np.sin(lines * ratio * s.q[:, i])

    return hook


@at_stage("servo")
def servo_overshoot(truth, target, m, rng):
    """An integrator leaves a slow tail after each move."""
    i, tau = joint_index(target), log_uniform(rng, 0.15, 0.5)

    def hook(s):
        dt = s.t[1] - s.t[0]
        k = 1 - np.exp(-dt / tau)
        tail = m * lfilter([0, tau * k], [1, k - 1], s.v[:, i])
        s.q[:, i] += tail
        s.v[:, i] += np.gradient(tail, dt)
        s.a[:, i] += np.gradient(np.gradient(tail, dt), dt)

    return hook


@at_stage("command")
def rate_limit(truth, target, m, rng):
    """The drive follows no faster than a part of the speed asked of it."""
    i = joint_index(target)

    def hook(s):
        steps = np.diff(s.u[:, i], prepend=s.u[0, i])
        top, x, out = max(0.3, 1 - m) * np.abs(steps).max(), float(s.u[0, i]), []
        for u in s.u[:, i].tolist():
            x += min(max(u - x, -top), top)
            out.append(x)
        s.u[:, i] = out

    return hook


@at_stage("reading")
def stamp_jitter(truth, target, m, rng):
    """Rows are stamped a random moment away from when they were taken."""
    seed = int(rng.integers(2**32))

    def hook(s):
        t = s.t - s.t[0]
        late = t + m * np.random.default_rng([seed, int(s.t[0])]).standard_normal(len(t))
        s.q, s.i, s.w = (np.column_stack([np.interp(late, t, x) for x in y.T]) for y in (s.q, s.i, s.w))

    return hook
