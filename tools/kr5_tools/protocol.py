"""What a cell is asked to do: the experiments of a protocol (`kr5-protocol/1`), made into their given columns.

An experiment has `name`, `kind`, `split` and either `given`, a CSV file with the given columns, or the parameters of one of
the functions below, named after `kind` (for motion also `signal`).
"""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import kr5.io
import kr5.kinematics
import kr5.predict
import numpy as np
import yaml

from . import common

FORMAT = "kr5-protocol/1"
MARGIN = 0.05  # of its range, by which a joint stays within its limits
TRIES = 200  # postures drawn for each that is wanted


class Context:
    """What the generators need: the cell, where motions begin, and random numbers of the experiment's own."""

    def __init__(self, cell: Any, home: list[float] | None, seed: list[int], where: str):
        self.cell, self.where, self.random = cell, where, np.random.default_rng(seed)
        self.joints = cell.robot.joints
        limits = cell.robot.limits
        if limits is None:
            common.fail(f"{where}: the cell states no robot.limits, within which postures are chosen; add them, or use given: FILE.csv")
        low, high = np.asarray(limits.lower), np.asarray(limits.upper)
        self.low, self.high = low + MARGIN * (high - low), high - MARGIN * (high - low)
        self.speed = np.asarray(limits.velocity) if len(limits.velocity) else np.ones(self.joints)
        self.home = np.asarray(home if home is not None else (low + high) / 2, float)
        if self.home.shape != (self.joints,) or np.any(self.home < low) or np.any(self.home > high):
            common.fail(f"{where}: home: found {home}, expected {self.joints} joint values within the limits of the cell [rad or m]")

    def fail(self, text: str) -> None:
        common.fail(f"{self.where}: {text}")

    def cycle(self) -> float:
        if self.cell.servo is None or not self.cell.servo.cycle > 0:
            self.fail("needs 'servo.cycle', which the cell does not have")
        return self.cell.servo.cycle

    def near(self, reach: float) -> np.ndarray:
        """A posture within `reach` of home [rad or m] and within the limits."""
        return np.clip(self.home + self.random.uniform(-reach, reach, self.joints), self.low, self.high)

    def posture(self, T_B_F: np.ndarray) -> np.ndarray | None:
        """Joint values that bring the flange there, near home, or None."""
        options = kr5.kinematics.InverseOptions(lower=self.low, upper=self.high, near=self.home)
        found = kr5.kinematics.inverse(self.cell.chain(), T_B_F, options)
        return next((np.asarray(p.q) for p in found.postures if p.usable), None)

    def joint_names(self, name: str) -> list[str]:
        return [f"{name}{i + 1}" for i in range(self.joints)]


def load(file: Path, cell: Any, seed: int) -> list[Any]:
    """Experiments of a protocol with their given columns. Complains of what is wrong, naming file and experiment."""
    data = _read(file)
    entries = data.get("experiments")
    if not isinstance(entries, list) or not entries:
        common.fail(f"{file}: experiments: expected a list of experiments")
    names = [e.get("name") if isinstance(e, dict) else None for e in entries]
    if len(set(names)) < len(names):
        common.fail(f"{file}: experiments: two have the same name, or none")
    return [_experiment(Path(file), dict(e), cell, data.get("home"), [seed, i]) for i, e in enumerate(entries)]


def weight(file: Path) -> float:
    """Known weight that hangs on the tool in all experiments of a protocol [kg]."""
    found = _read(file).get("load", 0.0)
    if isinstance(found, bool) or not isinstance(found, (int, float)) or not 0 <= found < np.inf:
        common.fail(f"{file}: load: found {found!r}, expected a weight [kg]")
    return float(found)


def _read(file: Path) -> dict[str, Any]:
    try:
        data = yaml.safe_load(Path(file).read_text(encoding="utf-8"))
    except yaml.YAMLError as error:
        common.fail(f"{file}: is no YAML ({str(error).splitlines()[0]})")
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        common.fail(f"{file}: format: found {data.get('format') if isinstance(data, dict) else data!r}, expected {FORMAT}")
    if unknown := set(data) - {"format", "name", "home", "load", "experiments"}:
        common.fail(f"{file}: unknown key '{sorted(unknown)[0]}', expected format, name, home, load, experiments")
    return data


def _experiment(file: Path, entry: dict[str, Any], cell: Any, home: Any, seed: list[int]) -> Any:
    where = f"{file}: experiment {entry.get('name')!r}"
    for key in ("name", "kind", "split"):
        if not isinstance(entry.get(key), str):
            common.fail(f"{where}: {key}: found {entry.get(key)!r}, expected a word")
    name, kind, split = (entry.pop(key) for key in ("name", "kind", "split"))
    if kind not in KINDS or split not in ("fit", "check"):
        common.fail(f"{where}: found kind {kind!r}, split {split!r}, expected one of {', '.join(KINDS)}, and fit or check")
    if given := entry.pop("given", None):
        table = kr5.io.load_csv(file.parent / given)
    else:
        signals = KINDS[kind]
        signal = entry.pop("signal", None) if len(signals) > 1 else next(iter(signals))
        if signal not in signals:
            common.fail(f"{where}: signal: found {signal!r}, expected one of {', '.join(signals)}")
        _check_parameters(signals[signal], entry, where)
        table = signals[signal](Context(cell, home, seed, where), **entry)
    out = kr5.cell.Experiment(name=name, kind=kind, file=f"{name}.csv", split=split)
    out.data = table
    return out


def _check_parameters(signal: Callable, entry: dict[str, Any], where: str) -> None:
    parameters = dict(list(inspect.signature(signal).parameters.items())[1:])
    for key in entry:
        if key not in parameters:
            common.fail(f"{where}: unknown key '{key}', expected {', '.join(parameters)} (or given: FILE.csv)")
    for key, parameter in parameters.items():
        value = entry.get(key, parameter.default)
        if value is parameter.empty:
            common.fail(f"{where}: '{key}' is missing")
        numbers = value if isinstance(value, list) else [value]
        if parameter.annotation in (float, int) and isinstance(value, list) or not all(isinstance(v, (int, float)) and np.isfinite(v) for v in numbers):
            common.fail(f"{where}: {key}: found {value!r}, expected {'numbers' if parameter.annotation is list else 'a number'}")


def _table(names: list[str], *columns: Any) -> Any:
    return kr5.io.Table(names, np.column_stack(columns))


def _motion(c: Context, start: float, q: np.ndarray) -> Any:
    low, high = np.asarray(c.cell.robot.limits.lower), np.asarray(c.cell.robot.limits.upper)
    if np.any(q < low) or np.any(q > high):
        c.fail("leaves the limits of the joints; make 'reach' smaller, or move home")
    return _table(["t", *c.joint_names("qc")], start + c.cycle() * np.arange(len(q)), q)


def fourier(c: Context, start: float = 0.0, duration: float = 20.0, base: float = 0.1, harmonics: int = 5, reach: float = 0.8,
            speed: float = 0.2) -> Any:
    """All joints at once, each a sum of `harmonics` of `base` [Hz], from home and back to it, within `reach` [rad or m] of
    home and `speed` times the limit of speed."""
    t = np.arange(0.0, duration, c.cycle())
    k = 2 * np.pi * base * np.arange(1, harmonics + 1)
    wave = np.einsum("jk,tk->tj", c.random.normal(size=(c.joints, harmonics)), np.sin(np.outer(t, k))) + np.einsum(
        "jk,tk->tj", c.random.normal(size=(c.joints, harmonics)), np.cos(np.outer(t, k)))
    wave *= (np.sin(np.pi * t / duration) ** 2)[:, None]
    room = np.minimum(reach, np.minimum(c.high - c.home, c.home - c.low))
    rate = np.abs(np.gradient(wave, t, axis=0)).max(axis=0)
    return _motion(c, start, c.home + wave * np.minimum(room / np.abs(wave).max(axis=0), speed * c.speed / rate))


def way_points(c: Context, start: float = 0.0, count: int = 8, reach: float = 0.9, speed: float = 0.45, pause: float = 0.4) -> Any:
    """From home through `count` postures within `reach` [rad or m] of home and back, jerk-limited, resting `pause` [s] at
    each; the fastest joint moves at `speed` times its limit."""
    points = [c.home, *(c.near(reach) for _ in range(count)), c.home]
    parts = [np.tile(c.home, (int(round(pause / c.cycle())), 1))]
    for a, b in zip(points, points[1:]):
        duration = 1.875 * np.max(np.abs(b - a) / (speed * c.speed))  # of the fifth-order move below
        s = np.arange(0.0, 1.0, c.cycle() / duration)[:, None]
        parts += [a + (b - a) * (10 * s**3 - 15 * s**4 + 6 * s**5), np.tile(b, (int(round(pause / c.cycle())), 1))]
    return _motion(c, start, np.vstack(parts))


def one_by_one(c: Context, start: float = 0.0, reach: float = 0.48, swing: float = 9.0, turns: int = 2) -> Any:
    """One joint after the other swings `turns` times within `reach` [rad or m] of home, `swing` [s] a joint."""
    t = np.arange(0.0, swing, c.cycle())
    room = np.minimum(reach, np.minimum(c.high - c.home, c.home - c.low))
    wave = np.sin(2 * np.pi * turns * t / swing) * np.minimum(1.0, 6 * np.minimum(t, swing - t) / swing)
    return _motion(c, start, np.vstack([c.home + np.outer(room[j] * wave, np.eye(c.joints)[j]) for j in range(c.joints)]))


def poses(c: Context, count: int = 60, start: float = 0.0, interval: float = 30.0, reach: float = 1.0) -> Any:
    """`count` postures within `reach` [rad or m] of home, one every `interval` [s]."""
    k = np.arange(count)
    return _table(["pose", "t", *c.joint_names("q")], k, start + interval * k, [c.near(reach) for _ in k])


def _turn(axis: np.ndarray, angle: float) -> np.ndarray:
    return kr5.exp_rotation(axis / np.linalg.norm(axis) * angle)


def _looking(c: Context, towards: np.ndarray, tilt: float) -> np.ndarray:
    """A rotation whose Z points along `towards` but for up to `tilt` [rad], turned about it at random."""
    z = _turn(np.cross(towards, c.random.normal(size=3)), c.random.uniform(0, tilt)) @ towards
    x = np.cross(z, c.random.normal(size=3))
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def views(c: Context, count: int = 17, start: float = 0.0, interval: float = 20.0, near: float = 0.35, far: float = 0.6,
          tilt: float = 0.5) -> Any:
    """`count` views of the board from `near` to `far` [m], up to `tilt` [rad] off its normal, one every `interval` [s]; a row
    each corner that the image holds."""
    camera, board = c.cell.camera, c.cell.board
    if camera is None or board is None or c.cell.T_F_C() is None:
        c.fail("needs 'camera' on the flange and 'board', which the cell does not have; use given: FILE.csv for others")
    T_B_W, T_F_C = np.asarray(board.T_B_W), np.asarray(c.cell.T_F_C())
    middle = np.array([board.cols * (board.marker + board.gap), board.rows * (board.marker + board.gap), 0.0]) / 2
    at_home = np.linalg.inv(T_B_W) @ np.asarray(c.cell.flange(c.home)) @ T_F_C
    up = np.array([0.0, 0.0, np.sign(at_home[2, 3]) or 1.0])  # the side on which the arm is
    found: list[np.ndarray] = []
    for _ in range(TRIES * count):
        if len(found) == count:
            break
        T_W_C = np.eye(4)
        T_W_C[:3, :3] = _looking(c, -up, tilt)
        T_W_C[:3, 3] = middle + c.random.uniform(-0.03, 0.03, 3) - T_W_C[:3, 2] * c.random.uniform(near, far)
        q = c.posture(T_B_W @ T_W_C @ np.linalg.inv(T_F_C))
        if q is None:
            continue
        view = _seen(c, q, len(found), start + interval * len(found))
        if len(view) >= 12:
            found.append(view)
    if len(found) < count:
        c.fail(f"found {len(found)} views of the board within the limits, expected {count}; move home, or change near, far, tilt")
    return kr5.io.Table(["view", "t", *c.joint_names("q"), "marker", "corner"], np.vstack(found))


def _seen(c: Context, q: np.ndarray, view: int, t: float) -> np.ndarray:
    """Rows of the corners that the image holds."""
    board, camera = c.cell.board, c.cell.camera
    number = np.arange(4 * board.rows * board.cols)
    rows = np.column_stack([np.full(len(number), view), np.full(len(number), t), np.tile(q, (len(number), 1)),
                            board.first_id + number // 4, number % 4])
    probe = kr5.cell.Experiment(name="probe", kind="views", file="probe.csv", split="fit")
    probe.data = kr5.io.Table(["view", "t", *c.joint_names("q"), "marker", "corner"], rows)
    shown = kr5.predict.FastSimulator().predict(c.cell, probe)
    u, v = shown["u"], shown["v"]
    return rows[(u >= 5) & (u <= camera.width - 6) & (v >= 5) & (v <= camera.height - 6)]


def scan(c: Context, passes: int = 6, lines: int = 13, start: float = 0.0, interval: float = 5.0, distance: float = 0.17,
         tilt: float = 0.25, width: float = 0.09, points: int = 61, speeds: list = [0.01, 0.03, 0.1]) -> Any:
    """`passes` across the sphere of the target, each of `lines` profiles along the scanner's Y, `distance` [m] from its top
    and up to `tilt` [rad] off the vertical, at the `speeds` [m/s] in turn; a profile is `points` over `width` [m]."""
    laser = c.cell.laser
    if laser is None or laser.target is None or c.cell.T_F_L() is None:
        c.fail("needs 'laser' with a 'target', which the cell does not have")
    centre, radius = np.asarray(laser.target.sphere), laser.target.radius
    T_L_F = np.linalg.inv(np.asarray(c.cell.T_F_L()))
    x = np.linspace(-width / 2, width / 2, points)
    table: list[np.ndarray] = []
    for number in range(passes):
        for _ in range(TRIES):
            R = _looking(c, np.array([0.0, 0.0, -1.0]), tilt)
            middle = centre - R[:, 2] * (distance + radius)
            path = [middle + R[:, 1] * y for y in np.linspace(-1.1 * radius, 1.1 * radius, lines)]
            postures = [c.posture(np.block([[R, p[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]]) @ T_L_F) for p in path]
            if all(q is not None for q in postures):
                break
        else:
            c.fail(f"found no pass of the scanner over the sphere within the limits after {TRIES} tries; move home or the target")
        for q in postures:
            line = len(table)
            table.append(np.column_stack([np.tile([line, start + interval * line, speeds[number % len(speeds)], *q], (points, 1)), x]))
    return kr5.io.Table(["line", "t", "speed", *c.joint_names("q"), "x"], np.vstack(table))


def step(c: Context, heights: list = [0.024, -0.01], rest: float = 1.0, duration: float = 8.0) -> Any:
    """One run a height [m]: at 0 for `rest` [s], then the step."""
    t = c.cycle() * np.arange(round(duration / c.cycle()))
    runs = [np.column_stack([np.full(len(t), i), t, np.where(t < rest, 0.0, h)]) for i, h in enumerate(heights)]
    return kr5.io.Table(["run", "t", "zc"], np.vstack(runs))


def press(c: Context, speeds: list = [0.001, 0.0007], start: float = 0.0, above: float = 0.002, depth: float = 0.006,
          rest: float = 1.0, hold: float = 2.0, interval: float = 100.0) -> Any:
    """One run a speed [m/s]: from `above` the bench [m] down to a command of `depth` below it, held for `hold` [s]; a run
    every `interval` [s]."""
    runs = []
    for i, v in enumerate(speeds):
        t = c.cycle() * np.arange(round((rest + (above + depth) / v + hold) / c.cycle()))
        runs.append(np.column_stack([np.full(len(t), i), start + interval * i + t, np.clip(above - v * (t - rest), -depth, above)]))
    return kr5.io.Table(["run", "t", "zc"], np.vstack(runs))


def profile(c: Context, tilts: list = [0.131, 0.262, 0.262], cx: list = [-0.0075, 0.006, -0.003], cy: list = [-0.0072, 0.004, 0.008],
            forces: list = [10.0, 10.0, 20.0], ripple: float = 0.25, rows: int = 833, start: float = 300.0,
            interval: float = 20.0) -> Any:
    """One roll round the tube a tilt [rad], the peg's bottom at cx, cy [m] in T, under a force [N] that wavers by
    `ripple` [N]."""
    if not len(tilts) == len(cx) == len(cy) == len(forces):
        c.fail("tilts, cx, cy and forces have different lengths")
    runs = []
    for i, (tilt, x, y, force) in enumerate(zip(tilts, cx, cy, forces)):
        k, one = np.arange(rows), np.ones(rows)
        held = force + ripple * np.sin(2 * np.pi * k / 120)
        runs.append(np.column_stack([i * one, start + interval * i + c.cycle() * k, tilt * one, 2 * np.pi * k / rows, x * one, y * one, held]))
    return kr5.io.Table(["run", "t", "tilt", "alpha", "cx", "cy", "fc"], np.vstack(runs))


KINDS: dict[str, dict[str, Callable]] = {
    "motion": {"fourier": fourier, "way_points": way_points, "one_by_one": one_by_one},
    "poses": {"poses": poses}, "views": {"views": views}, "scan": {"scan": scan}, "step": {"step": step},
    "press": {"press": press}, "profile": {"profile": profile},
}
