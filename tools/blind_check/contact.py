"""Steps of the path correction, pressing on the bench, and rolling the tilted peg round the tube."""

from types import SimpleNamespace

import numpy as np

from .motion import second_order
from .truth import WRENCH, G, Truth


def run_slices(d: dict) -> list[slice]:
    edges = [0, *(np.flatnonzero(np.diff(d["run"])) + 1), len(d["run"])]
    return [slice(a, b) for a, b in zip(edges, edges[1:], strict=False)]


def tool_servo(truth: Truth, zc) -> tuple[np.ndarray, np.ndarray]:
    """Height and speed; a command is held over its cycle and acts whole cycles later."""
    s, dt = truth.cell["servo"]["tool"], truth.cell["servo"]["cycle"]
    late = round(s["delay"] / dt)
    u = np.concatenate([np.full(late, zc[0]), zc])[: len(zc)]
    state = SimpleNamespace(u=u, dt=dt)
    truth.bend("tool_command", state)
    state.z, state.v, _ = second_order(state.u, dt, s["natural_frequency"], s["damping_ratio"], "zoh")
    truth.bend("tool_servo", state)
    return state.z, state.v


def simulate_step(truth: Truth, d: dict) -> dict:
    return {"z": np.concatenate([tool_servo(truth, d["zc"][r])[0] for r in run_slices(d)])}


def tool_weight(truth: Truth, n: int) -> np.ndarray:
    """Wrench of the resting tool, pointing down."""
    tool = truth.cell["tool"]
    w, c = tool["mass"] * G, tool["com"]
    return np.tile([0, 0, w, c[1] * w, -c[0] * w, 0], (n, 1))


def stiffness(truth: Truth) -> float:
    return 1 / (1 / truth.cell["contact"]["stiffness"] + truth.axial)


def depth_under(truth: Truth, force: np.ndarray) -> np.ndarray:
    """Depth at which the contact carries a force: k p (1 + h p / 1 mm) = F."""
    p, h = force / stiffness(truth), truth.hardening / 1e-3
    return 2 * p / (1 + np.sqrt(1 + 4 * h * p))


def sensed_wrench(truth: Truth, s: SimpleNamespace) -> dict:
    truth.bend("sensor", s)
    return {"z": s.z} | dict(zip(WRENCH, s.w.T, strict=True))


def simulate_press(truth: Truth, d: dict) -> dict:
    s = SimpleNamespace(kind="press", t=d["t"], runs=run_slices(d), w=tool_weight(truth, len(d["t"])), truth=truth)
    s.z, s.v = (np.concatenate(x) for x in zip(*(tool_servo(truth, d["zc"][r]) for r in s.runs), strict=True))
    p = np.maximum(-s.z, 0)
    damping = truth.cell["contact"]["damping"] * np.where(p > 0, -s.v, 0)
    s.depth, s.force = p, stiffness(truth) * p * (1 + truth.hardening * p / 1e-3) + damping
    truth.bend("press", s)
    s.w[:, 2] -= np.maximum(s.force, 0)
    return sensed_wrench(truth, s)


def region_crossings(inside: np.ndarray, beta: np.ndarray, excess) -> tuple[np.ndarray, np.ndarray]:
    """Rows and angles where `excess(row, angle)` changes sign between the samples; by bisection."""
    row, k = np.nonzero(inside != np.roll(inside, -1, 1))
    low, high = beta[k], beta[k] + beta[1] - beta[0]
    side = inside[row, k]
    for _ in range(45):
        middle = (low + high) / 2
        same = (excess(row, middle) <= 0) == side
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return row, (low + high) / 2


def rim_height(axis, c, radius, inner, outer, shape) -> np.ndarray:
    """Height of the peg's bottom centre c over a flat ring, where the disc round it first touches. One row a posture.

    The height at a common point P of disc and ring is linear in P, so its maximum lies at the lowest point of the disc,
    at the extreme point of an edge of the ring, or where the rims cross: these are all tried. `shape` takes the bore
    (and the outside) to circles.
    """
    n = axis[:, :2] / axis[:, 2:]
    u = np.column_stack([-axis[:, 1], axis[:, 0]])
    u /= np.linalg.norm(u, axis=1)[:, None]
    w = np.column_stack([-axis[:, 2] * u[:, 1], axis[:, 2] * u[:, 0]])

    def ring(row, angle):
        return radius * (np.cos(angle)[..., None] * u[row] + np.sin(angle)[..., None] * w[row])

    def distance(row, angle):
        return np.linalg.norm((ring(row, angle) + c[row]) @ shape.T, axis=-1)

    every = np.arange(len(n))
    top = np.arctan2(np.sum(w * n, 1), np.sum(u * n, 1))
    rho = distance(every, top)
    best = np.where((rho >= inner) & (rho <= outer), np.sum(ring(every, top) * n, 1), -np.inf)
    beta = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    sampled = distance(every[:, None], beta[None] + 0 * every[:, None])
    back = np.linalg.inv(shape)
    det = u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0]
    for R in (inner, outer):
        row, angle = region_crossings(sampled <= R, beta, lambda i, b, R=R: distance(i, b) - R)
        np.maximum.at(best, row, np.sum(ring(row, angle) * n[row], 1))
        g = n @ back
        P = (R * g / np.linalg.norm(g, axis=1)[:, None]) @ back.T - c
        local = (
            np.column_stack([P[:, 0] * w[:, 1] - P[:, 1] * w[:, 0], u[:, 0] * P[:, 1] - u[:, 1] * P[:, 0]])
            / det[:, None]
        )
        best = np.maximum(best, np.where(np.sum(local**2, 1) <= radius**2, np.sum(P * n, 1), -np.inf))
    return best


def resting_height(truth: Truth, axis: np.ndarray, c: np.ndarray) -> np.ndarray:
    """The same over the tube as it stands: turned and shifted in T."""
    tube, R = truth.cell["tube"], truth.tube_turn
    n, base, up = axis @ R, np.column_stack([c - truth.tube_shift, np.zeros(len(c))]) @ R, R.T @ [0, 0, 1.0]
    z = np.zeros(len(c))
    for _ in range(3 if np.any(np.eye(3) != R) else 1):
        p = base[:, :2] + z[:, None] * up[:2]
        h = rim_height(n, p, truth.cell["peg"]["radius"], tube["inner_radius"], tube["outer_radius"], truth.tube_shape)
        z = (h - base[:, 2]) / up[2]
    return z


def simulate_profile(truth: Truth, d: dict) -> dict:
    s = SimpleNamespace(
        kind="profile", d=d, t=d["t"], runs=run_slices(d), w=tool_weight(truth, len(d["t"])), truth=truth
    )
    s.axis = np.column_stack(
        [np.sin(d["tilt"]) * np.cos(d["alpha"]), np.sin(d["tilt"]) * np.sin(d["alpha"]), np.cos(d["tilt"])]
    )
    s.friction = (
        -truth.cell["contact"]["friction"]
        * d["fc"][:, None]
        * np.column_stack([-np.sin(d["alpha"]), np.cos(d["alpha"])])
    )
    truth.bend("rub", s)
    s.c = np.column_stack([d["cx"], d["cy"]]) + truth.lateral * s.friction
    s.z = resting_height(truth, s.axis, s.c) - depth_under(truth, d["fc"])
    truth.bend("depth", s)
    s.w[:, 0] += s.friction[:, 0]
    s.w[:, 1] -= s.friction[:, 1]
    s.w[:, 2] -= d["fc"]
    return sensed_wrench(truth, s)
