"""Free motion: the servo, what the gears do, currents and wrench."""

from types import SimpleNamespace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import cont2discrete, lfilter, ss2tf

from .arm import Dynamics, apply_sag, gear_teeth
from .truth import WRENCH, Truth

FINE = 0.001  # step of the servo's simulation [s]
SMOOTH = 0.002  # speed over which friction changes its sign [rad/s]


def second_order(u, dt, wn, xi, hold):
    """x'' = wn^2 (u - x) - 2 xi wn x' from rest at u[0]: x, x', x''."""
    A, B = np.array([[0, 1], [-(wn**2), -2 * xi * wn]]), np.array([[0.0], [wn**2]])
    num, den = ss2tf(*cont2discrete((A, B, np.eye(2), np.zeros((2, 1))), dt, hold)[:4])
    x, v = (lfilter(b, den, u - u[0]) for b in num)
    x = x + u[0]
    return x, v, wn**2 * (u - x) - 2 * xi * wn * v


def per_joint(value, n: int) -> np.ndarray:
    return np.broadcast_to(np.asarray(value, float), n)


def servo_response(truth: Truth, t, qc) -> SimpleNamespace:
    """Joint angles, speeds, accelerations every millisecond."""
    n, j = truth.joints, truth.cell["servo"]["joint"]
    fine = np.arange(0, t[-1] + 1e-9, FINE)
    wn, xi, delay = (per_joint(j[k], n) for k in ("natural_frequency", "damping_ratio", "delay"))
    u = np.column_stack([CubicSpline(t, qc[:, i])(np.maximum(fine - delay[i], 0.0)) for i in range(n)])
    s = SimpleNamespace(t=fine, u=u)
    truth.bend("command", s)
    moved = [second_order(s.u[:, i], FINE, wn[i], xi[i], "foh") for i in range(n)]
    s.q, s.v, s.a = (np.column_stack(x) for x in zip(*moved, strict=True))
    truth.bend("servo", s)
    return s


def integrate(h, M, kq, kv, K, D, half_gap, dt, x, v):
    """Angle of the link before its motor: M x'' = -spring(x) - D x' - (h + kq x + kv x'), stepped by dt.

    Returns x, x', x'' at every step. Plain floats: the step is far shorter than numpy's overhead.
    """
    steps = zip(h.tolist(), (1 / M).tolist(), kq.tolist(), kv.tolist(), D.tolist(), strict=True)
    xs, vs, accelerations = [], [], []
    for hk, inverse, kqk, kvk, Dk in steps:
        stretch = x - half_gap if x > half_gap else x + half_gap if x < -half_gap else 0.0
        a = -(K * stretch + Dk * v + hk + kqk * x + kvk * v) * inverse
        xs.append(x)
        vs.append(v)
        accelerations.append(a)
        v += a * dt
        x += v * dt
    return np.array(xs), np.array(vs), np.array(accelerations)


def deflect_joint(truth: Truth, dynamics: Dynamics, s: SimpleNamespace, joint: int, K: float, gap: float, zeta: float):
    """Forward simulation of one joint whose link is not fixed to its motor; every millisecond."""
    coarse = slice(None, None, 4)
    h, M, kq, kv = dynamics.along(s.lq[coarse], s.lv[coarse], s.la[coarse], joint)
    substeps = max(2, int(np.ceil(FINE / (0.08 / np.sqrt(K / M.min())))))
    dt = FINE / substeps
    t = np.arange(0, s.t[-1] + 1e-12, dt)
    h, M, kq, kv = (np.interp(t, s.t[coarse], x) for x in (h, M, kq, kv))
    D = 2 * zeta * np.sqrt(K * M)
    start = -h[0] / K - np.sign(h[0]) * gap / 2
    x = integrate(h, M, kq, kv, K, D, gap / 2, dt, start, 0.0)
    return (y[::substeps][: len(s.t)] for y in x)


def link_side(truth: Truth, dynamics: Dynamics, s: SimpleNamespace) -> None:
    """lq, lv, la: what the links really do, every millisecond."""
    state = SimpleNamespace(q=s.q.copy(), v=s.v.copy(), a=s.a.copy(), t=s.t)
    truth.bend("angle", state)
    s.lq, s.lv, s.la = state.q, state.v, state.a
    if truth.stride > 1:
        return
    loose = [(j, 1 / c, 0.0, 0.06) for j, c in truth.compliance.items()]
    loose += [(j, gear_teeth(j), gap, 0.3) for j, gap in truth.gaps.items()]
    moved = [(j, *deflect_joint(truth, dynamics, s, j, K, gap, zeta)) for j, K, gap, zeta in loose]
    for j, x, v, a in moved:
        s.lq[:, j] += x
        s.lv[:, j] += v
        s.la[:, j] += a


def drive_currents(truth: Truth, s: SimpleNamespace) -> None:
    """Motor currents from the torques on the links."""
    d = truth.cell["drives"]
    s.sign = np.tanh(s.v / SMOOTH)
    s.friction = np.array(d["friction"]["coulomb"]) * s.sign + np.array(d["friction"]["viscous"]) * s.v
    truth.bend("friction", s)
    truth.bend("friction_scale", s)
    s.torque = s.tau + s.friction
    truth.bend("torque", s)
    S = np.array(d["structure"], float) if truth.current_structure is None else truth.current_structure
    motor = np.array(d["rotor_inertia"]) * (s.a @ S.T) + s.torque @ np.linalg.inv(S)
    s.i = motor / np.array(d["torque_constant"])
    truth.bend("current", s)


def simulate_motion(truth: Truth, d: dict) -> dict:
    n, t = truth.joints, d["t"] - d["t"][0]
    fine = servo_response(truth, t, np.column_stack([d[f"qc{i + 1}"] for i in range(n)]))
    dynamics = Dynamics(truth, float(1.0 + np.mean(truth.growth(d["t"]))))
    link_side(truth, dynamics, fine)
    rows, kept = slice(None, None, round((t[1] - t[0]) / FINE) * truth.stride), d["t"][:: truth.stride]
    s = SimpleNamespace(kind="motion", t=kept, runs=[slice(0, len(kept))], fine=fine, truth=truth)
    s.q, s.v, s.a, s.lq, s.lv, s.la = (
        x[rows][: len(kept)].copy() for x in (fine.q, fine.v, fine.a, fine.lq, fine.lv, fine.la)
    )
    s.tau, s.w = (x.copy() for x in dynamics.torque_and_wrench(s.lq, s.lv, s.la))
    if truth.stride > 1 and (truth.compliance or truth.gaps):
        apply_sag(truth, s.lq, s.tau)
        s.tau, s.w = (x.copy() for x in dynamics.torque_and_wrench(s.lq, s.lv, s.la))
    drive_currents(truth, s)
    truth.bend("load", s)
    truth.bend("sensor", s)
    truth.bend("reading", s)
    out = {f"q{i + 1}": s.q[:, i] for i in range(n)} | {f"i{i + 1}": s.i[:, i] for i in range(n)}
    return out | dict(zip(WRENCH, s.w.T, strict=True))
