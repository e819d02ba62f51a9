"""What is done with a cell: random motions, postures, views, scans, steps, presses, profiles. Only the given
columns."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import Rotation

from .arm import chain
from .catalogue import log_uniform
from .external_sensors import board_points, project
from .truth import Truth, pose_matrix

ROW = 0.012
DECIMALS = {
    "t": 3,
    "speed": 3,
    "x": 5,
    "tilt": 5,
    "alpha": 5,
    "cx": 5,
    "cy": 5,
    "fc": 3,
    "zc": 6,
    "marker": 0,
    "corner": 0,
}


@dataclass(frozen=True)
class Size:
    """How much is recorded."""

    wave: float  # duration of a free motion [s]
    slow: float  # duration of each joint's slow and fast part [s]
    motions: tuple[str, ...]  # what each motion file is, then its split
    poses: int
    views: int
    heights: int
    lines: int
    rays: int
    steps: int
    presses: int
    profiles: int
    profile_rows: int


CASES = Size(
    20.0, 9.0, ("wave fit", "slow fit", "wide fit", "wave check", "wide check"), 80, 24, 4, 9, 61, 3, 3, 4, 833
)
SMALL = Size(6.0, 4.0, ("wave fit", "slow fit", "wide check"), 24, 10, 2, 6, 31, 3, 2, 3, 250)


def round_columns(columns: dict) -> dict:
    """As a file holds them: what is simulated is what is written."""
    return {k: np.round(np.asarray(v, float), DECIMALS.get(k, 6)) for k, v in columns.items()}


def joint_room(cell: dict, home: np.ndarray) -> np.ndarray:
    """How far each joint may leave home."""
    lim = cell["robot"]["limits"]
    return np.minimum(home - np.array(lim["lower"]), np.array(lim["upper"]) - home)


def wave_motion(cell, home, rng, duration, wide: bool) -> np.ndarray:
    """Fourier sums that start and end at rest at home."""
    t, n = np.arange(0, duration, ROW), len(home)
    gate = np.minimum(1, np.minimum(t, duration - t) / 2.0)
    gate = gate**3 * (10 - 15 * gate + 6 * gate**2)
    top = np.array(cell["robot"]["limits"]["velocity"])
    q = np.zeros((len(t), n))
    for i in range(n):
        f = rng.uniform(0.06, 0.14) * np.arange(1, 5) * (2.0 if wide else 1.0)
        q[:, i] = (
            sum(rng.standard_normal() / k * np.sin(2 * np.pi * f[k - 1] * t + rng.uniform(0, 6.3)) for k in range(1, 5))
            * gate
        )
        reach = min((1.0 if wide else 0.5) * rng.uniform(0.5, 1), 0.8 * joint_room(cell, home)[i])
        q[:, i] *= min(reach / np.abs(q[:, i]).max(), 0.45 * top[i] / (np.abs(np.gradient(q[:, i], ROW)).max() + 1e-9))
    return home + q


def slow_and_fast(cell, home, rng, duration) -> np.ndarray:
    """Each joint in turn goes out and back at several speeds, with reversals; the others rest."""
    parts = []
    for i in range(len(home)):
        t = np.arange(0, duration, ROW)
        speed = np.zeros(len(t))
        pieces = 4
        for k, block in enumerate(np.array_split(np.arange(len(t)), pieces)):
            v = log_uniform(rng, 0.01, 0.08) if k < 2 else log_uniform(rng, 0.1, 0.6)
            third = len(block) // 4
            speed[block[third // 2 : third // 2 + third]] = v
            speed[block[third // 2 + 2 * third : third // 2 + 3 * third]] = -v
        kernel = np.hanning(max(5, round(0.3 / ROW)) + 2)[1:-1]
        speed = np.convolve(speed, kernel / kernel.sum(), "same")
        part = np.tile(home, (len(t), 1))
        way = np.cumsum(speed) * ROW
        part[:, i] += rng.choice([-1, 1]) * way * min(1, 0.8 * joint_room(cell, home)[i] / np.abs(way).max())
        parts.append(part)
    return np.concatenate(parts)


def draw_motions(cell, home, rng, size: Size):
    start = 0.0
    for k, entry in enumerate(size.motions):
        kind, split_rows = entry.split()
        q = (
            slow_and_fast(cell, home, rng, size.slow)
            if kind == "slow"
            else wave_motion(cell, home, rng, size.wave, kind == "wide")
        )
        t = start + ROW * np.arange(len(q))
        start = np.ceil(t[-1]) + 5
        yield f"motion-{k + 1}", "motion", split_rows, {"t": t} | {f"qc{i + 1}": q[:, i] for i in range(q.shape[1])}


def joint_columns(Q: np.ndarray) -> dict:
    return {f"q{i + 1}": Q[:, i] for i in range(Q.shape[1])}


def reach_pose(cell, T_flange_x, goal, seed) -> np.ndarray | None:
    """Joint angles that bring X to its goal, by damped least squares; None if the limits forbid."""
    q, lim = seed.copy(), cell["robot"]["limits"]
    for _ in range(60):
        steps = np.vstack([q, q + 1e-6 * np.eye(len(q))])
        T = chain(cell, steps) @ T_flange_x
        error = np.concatenate(
            [goal[:3, 3] - T[0, :3, 3], Rotation.from_matrix(goal[:3, :3] @ T[0, :3, :3].T).as_rotvec()]
        )
        if np.linalg.norm(error) < 1e-6:
            inside = np.all(q > np.array(lim["lower"]) + 0.05) and np.all(q < np.array(lim["upper"]) - 0.05)
            return q if inside else None
        D = T[1:, :3, :3] @ T[0, :3, :3].T  # so near to no turn that its skew part is the turn
        turns = np.column_stack([D[:, 2, 1] - D[:, 1, 2], D[:, 0, 2] - D[:, 2, 0], D[:, 1, 0] - D[:, 0, 1]]) / 2
        J = np.column_stack([T[1:, :3, 3] - T[0, :3, 3], turns]).T / 1e-6
        q = q + np.clip(J.T @ np.linalg.solve(J @ J.T + 1e-6 * np.eye(6), error), -0.3, 0.3)
    return None


def downward_pose(at, distance, tilt, about, roll) -> np.ndarray:
    """A frame whose Z points at a place from above, tilted."""
    R = Rotation.from_euler("zy", [about, tilt]) * Rotation.from_euler("xz", [np.pi, roll])
    T = np.eye(4)
    T[:3, :3] = R.as_matrix()
    T[:3, 3] = np.asarray(at) - distance * T[:3, 2]
    return T


def draw_poses(cell, home, rng, size: Size):
    spread = np.minimum(0.6 * joint_room(cell, home), np.array([1.2, 0.5, 0.5, 1.7, 0.8, 2.4, 2.4])[: len(home)])
    Q = home + rng.uniform(-1, 1, (size.poses, len(home))) * spread
    k = np.arange(size.poses)
    yield from split_rows(
        "poses", "pose", {"pose": k, "t": 30.0 * k} | joint_columns(Q), rng.permutation(size.poses) % 4 == 0
    )


def split_rows(name, key, columns, check):
    """Two files, the rows in `check` (one flag a value of the key) to judge by."""
    rows = check[np.asarray(columns[key]).astype(int)]
    for k, (part, of) in enumerate((("fit", ~rows), ("check", rows))):
        yield f"{name}-{k + 1}", name, part, {c: np.asarray(v)[of] for c, v in columns.items()}


def draw_views(cell, home, rng, size: Size):
    board, cam, truth = cell["board"], cell["camera"], Truth.of(cell)
    T_flange_camera, T_base_target = (
        pose_matrix(cell["tool"]["T_F_E"]) @ pose_matrix(cam["T_E_C"]),
        pose_matrix(board["T_B_W"]),
    )
    marker, corner = (
        x.ravel() for x in np.meshgrid(np.arange(board["rows"] * board["cols"]), np.arange(4), indexing="ij")
    )
    points = board_points(board, marker, corner)
    natural, tries = chain(cell, home[None])[0] @ T_flange_camera, 0
    taken: list = []
    yaw = np.arctan2(natural[1, 0], natural[0, 0])
    while len(taken) < size.views and tries < 60 * size.views:
        tries += 1
        at = (T_base_target @ [*rng.uniform(-0.03, 0.03, 2) + points[:, :2].mean(0), 0, 1])[:3]
        about, turn = rng.uniform(-np.pi, np.pi), rng.uniform(-0.8, 0.8)
        goal = downward_pose(at, rng.uniform(0.3, 0.55), rng.uniform(0, 0.5), about, about - yaw - turn)
        q = reach_pose(cell, T_flange_camera, goal, home)
        if q is None:
            continue
        q = np.round(q, 6)
        p = (np.linalg.inv(chain(cell, q[None])[0] @ T_flange_camera) @ T_base_target @ points.T).T[:, :3]
        s = SimpleNamespace(p=p)
        project(truth, s)
        seen = (s.u > 20) & (s.u < cam["width"] - 20) & (s.v > 20) & (s.v < cam["height"] - 20)
        if seen.sum() >= 60:
            k = len(taken)
            columns = {"view": np.full(seen.sum(), k), "t": np.full(seen.sum(), 20.0 * k)} | joint_columns(
                np.tile(q, (seen.sum(), 1))
            )
            taken.append(columns | {"marker": marker[seen], "corner": corner[seen]})
    if len(taken) >= 4:
        every = {c: np.concatenate([v[c] for v in taken]) for c in taken[0]}
        yield from split_rows("views", "view", every, np.arange(len(taken)) % 3 == 2)


def draw_scan(cell, home, rng, size: Size):
    laser = cell["laser"]
    T_flange_scanner, at = (
        pose_matrix(cell["tool"]["T_F_E"]) @ pose_matrix(laser["T_E_L"]),
        np.array([*laser["target"]["sphere"][:2], laser["target"]["plane"]]),
    )
    natural = chain(cell, home[None])[0] @ T_flange_scanner
    yaw, x, line, parts = np.arctan2(natural[1, 0], natural[0, 0]), np.linspace(-0.045, 0.045, size.rays), 0, []
    for height in np.linspace(0.16, 0.25, size.heights) + rng.uniform(-0.004, 0.004, size.heights):
        for speed in (0.01, 0.03, 0.1):
            tilt, about, turn = rng.uniform(0.02, 0.1), rng.uniform(-np.pi, np.pi), rng.uniform(-0.3, 0.3)
            last = home
            for y in np.linspace(-0.022, 0.03, size.lines) + rng.uniform(-0.003, 0.003):
                T = downward_pose(at, height, tilt, about, -(yaw + turn) + about)
                T[:3, 3] += T[:3, 1] * y + rng.uniform(-0.001, 0.001) * T[:3, 0]
                q = reach_pose(cell, T_flange_scanner, T, last)
                if q is not None:
                    last = q
                    columns = {
                        "line": np.full(len(x), line),
                        "t": np.full(len(x), 5.0 * line),
                        "speed": np.full(len(x), speed),
                    }
                    parts.append(columns | joint_columns(np.tile(q, (len(x), 1))) | {"x": x})
                    line += 1
    if line >= 12:
        every = {c: np.concatenate([p[c] for p in parts]) for c in parts[0]}
        yield from split_rows("scan", "line", every, np.arange(line) % 4 == 2)


def split_runs(name, runs: list[dict], check: int):
    """`check` of the runs, the last ones, to judge by."""
    every = {c: np.concatenate([r[c] for r in runs]) for c in runs[0]}
    yield from split_rows(name, "run", every, np.arange(len(runs)) >= len(runs) - check)


def draw_step(cell, home, rng, size: Size):
    runs, t = [], ROW * np.arange(667 if size.steps > 2 and size.wave > 10 else 400)
    for k in range(size.steps):
        height = rng.choice([-1, 1]) * log_uniform(rng, 0.006, 0.03)
        zc = np.where(t >= 1.2, height, 0.0)
        if rng.random() < 0.4:
            zc = np.where(t >= t[-1] * 0.6, height * rng.uniform(-0.5, 0.5), zc)
        runs.append({"run": np.full(len(t), k), "t": t, "zc": zc})
    yield from split_runs("step", runs, 1)


def draw_press(cell, home, rng, size: Size):
    runs = []
    for k in range(size.presses):
        depth, speed, hold = log_uniform(rng, 0.6e-3, 2.4e-3), log_uniform(rng, 4e-4, 2.5e-3), rng.uniform(0.5, 2.0)
        times = np.cumsum([0, 1.2, (0.002 + depth) / speed, hold, (0.002 + depth) / speed, 0.5])
        t = np.arange(0, times[-1], ROW)
        zc = np.interp(t, times, [0.002, 0.002, -depth, -depth, 0.002, 0.002])
        runs.append({"run": np.full(len(t), k), "t": 100.0 * k + t, "zc": zc})
    yield from split_runs("press", runs, 1)


def draw_profile(cell, home, rng, size: Size):
    runs, clearance = [], cell["tube"]["inner_radius"]
    for k in range(size.profiles):
        n = size.profile_rows
        t, around, radius = ROW * np.arange(n), rng.uniform(-np.pi, np.pi), rng.uniform(0.5, 1.05) * clearance
        c, force = np.round([radius * np.cos(around), radius * np.sin(around)], 5), rng.choice([8.0, 10.0, 15.0, 20.0])
        column = {"tilt": rng.uniform(0.1, 0.28), "cx": c[0], "cy": c[1]}
        alpha = 2 * np.pi * np.arange(n) / n
        swing = rng.uniform(0.2, 2.0) * np.sin(2 * np.pi * t / rng.uniform(1, 3))
        runs.append(
            {"run": np.full(n, k), "t": 300 + 20.0 * k + t, "alpha": alpha, "fc": force + swing}
            | {x: np.full(n, v) for x, v in column.items()}
        )
    yield from split_runs("profile", runs, 1)


ORDER = {"motion": ["t"], "profile": ["run", "t", "tilt", "alpha", "cx", "cy", "fc"]}


def draw_protocol(cell, home, rng, size: Size) -> list[tuple[str, str, str, dict]]:
    """Name, kind, split and given columns of every experiment."""
    parts = {"camera": draw_views, "laser": draw_scan, "contact": draw_press, "tube": draw_profile}
    makers = [draw_motions, draw_poses, *(f for key, f in parts.items() if key in cell), draw_step]
    done = []
    for make in makers:
        for name, kind, part, given in make(cell, home, rng, size):
            columns = round_columns(given)
            done.append((name, kind, part, {c: columns[c] for c in (*ORDER.get(kind, ()), *columns) if c in columns}))
    return done
