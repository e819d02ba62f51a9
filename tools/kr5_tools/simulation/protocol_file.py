"""What a cell is asked to do: the experiments of a protocol (`kr5-protocol/1`), made into their given columns.

An experiment has `name`, `kind`, `split` and either `given`, a CSV file with the given columns, or the parameters of
one of the functions below, named after `kind` (for motion also `signal`)."""

import functools
import inspect
import itertools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn

import kr5
import kr5.cell
import kr5.io
import kr5.kinematics
import kr5.predict
import numpy as np
import numpy.typing as npt
from kr5.files.documents import (
    Document,
    OpenDocument,
    check_names,
    display_value,
    fail_at,
    read_document,
    validate_document,
)
from pydantic import Field, create_model, field_validator

MARGIN = 0.05  # of its range, by which a joint stays within its limits
MAX_ROWS = 1_000_000  # of one motion
TRIES = 200  # postures drawn for each that is wanted

# What the parameters of signals may be: enough for any experiment, and too little to fill the memory.
Instant = Annotated[float, Field(ge=-1e9, le=1e10, description="[s]")]
Duration = Annotated[float, Field(gt=0, le=1e6, description="[s]")]
Pause = Annotated[float, Field(ge=0, le=1e6, description="[s]")]
Frequency = Annotated[float, Field(gt=0, le=1e4, description="[Hz]")]
Count = Annotated[int, Field(ge=1, le=10_000)]
Rows = Annotated[int, Field(ge=2, le=1_000_000)]
Reach = Annotated[float, Field(gt=0, le=100, description="[rad or m]")]
SpeedShare = Annotated[float, Field(ge=1e-4, le=10, description="of the limit of speed [-]")]
Length = Annotated[float, Field(gt=0, le=10, description="[m]")]
Height = Annotated[float, Field(ge=0, le=10, description="[m]")]
Tilt = Annotated[float, Field(ge=0, le=1.5, description="[rad]")]
Ripple = Annotated[float, Field(ge=0, le=1e6, description="[N]")]
Lengths = Annotated[Sequence[Annotated[float, Field(ge=-10, le=10)]], Field(min_length=1, max_length=1000)]
Speeds = Annotated[Sequence[Annotated[float, Field(ge=1e-6, le=10)]], Field(min_length=1, max_length=1000)]
Forces = Annotated[Sequence[Annotated[float, Field(ge=0, le=1e6)]], Field(min_length=1, max_length=1000)]


class Context:
    """What the generators need: the cell, where motions begin, and random numbers of the experiment's own."""

    def __init__(self, cell: kr5.cell.Cell, home: list[float] | None, seed: list[int], where: str):
        self.cell, self.where, self.random = cell, where, np.random.default_rng(seed)
        self.joints = cell.robot.joints
        limits = cell.robot.limits
        if limits is None:
            raise kr5.IoError(
                f"{where}: the cell states no robot.limits, within which postures are chosen; add them, or use given:"
                " FILE.csv"
            )
        low, high = np.asarray(limits.lower), np.asarray(limits.upper)
        self.low, self.high = low + MARGIN * (high - low), high - MARGIN * (high - low)
        self.speed = np.asarray(limits.velocity) if len(limits.velocity) else np.ones(self.joints)
        self.home = np.asarray(home if home is not None else (low + high) / 2, float)
        if self.home.shape != (self.joints,) or np.any(self.home < low) or np.any(self.home > high):
            raise kr5.IoError(
                f"{where}: home: found {home}, expected {self.joints} joint values within the limits of the cell [rad"
                " or m]"
            )

    def fail(self, text: str) -> NoReturn:
        raise kr5.IoError(f"{self.where}: {text}")

    def cycle(self) -> float:
        if self.cell.servo is None or not self.cell.servo.cycle > 0:
            self.fail("needs 'servo.cycle', which the cell does not have")
        return float(self.cell.servo.cycle)

    def check_rows(self, duration: float) -> None:
        """Complains of a motion of too many rows, one a cycle of the servo."""
        if not duration / self.cycle() <= MAX_ROWS:
            self.fail(
                f"lasts {duration:.3g} s, at cycles of {self.cycle():.3g} s more than {MAX_ROWS} rows; check its"
                " durations and speeds, and servo.cycle and robot.limits.velocity of the cell"
            )

    def near(self, reach: float) -> np.ndarray:
        """A posture within `reach` of home [rad or m] and within the limits."""
        return np.asarray(np.clip(self.home + self.random.uniform(-reach, reach, self.joints), self.low, self.high))

    def posture(self, T_base_flange: np.ndarray) -> np.ndarray | None:
        """Joint values that bring the flange there, near home, or None."""
        options = kr5.kinematics.InverseOptions(lower=self.low, upper=self.high, near=self.home)
        found = kr5.kinematics.inverse_kinematics(self.cell.nominal_chain(), T_base_flange, options)
        return next((np.asarray(p.q) for p in found.postures if p.usable), None)

    def joint_names(self, name: str) -> list[str]:
        return [f"{name}{i + 1}" for i in range(self.joints)]


class ExperimentEntry(OpenDocument):
    """An experiment; the keys beside these are parameters of its signal."""

    name: str = Field(min_length=1)
    kind: Literal["motion", "poses", "views", "scan", "step", "press", "profile"]
    split: Literal["fit", "check"]
    given: str | None = Field(None, description="CSV file with the given columns")
    signal: str | None = None


class ProtocolFile(Document):
    format: Literal["kr5-protocol/1"]
    name: str | None = None
    home: list[float] | None = Field(None, description="joint values where motions begin [rad or m]")
    load: float = Field(0.0, ge=0, description="known weight on the tool [kg]")
    experiments: list[ExperimentEntry] = Field(min_length=1, description="a list of experiments")

    @field_validator("experiments")
    @classmethod
    def _names_differ(cls, experiments: list[ExperimentEntry]) -> list[ExperimentEntry]:
        check_names([e.name for e in experiments])
        return experiments


EXPECTED = "a protocol of experiments (kr5-protocol/1)"


def load_protocol(file: Path, cell: kr5.cell.Cell, seed: int) -> list[Any]:
    """Experiments of a protocol with their given columns. Ends with an error that names file and experiment."""
    protocol = read_document(file, ProtocolFile, EXPECTED)
    return [
        _experiment(Path(file), entry, cell, protocol.home, [seed, i], i)
        for i, entry in enumerate(protocol.experiments)
    ]


def load_on_tool(file: Path) -> float:
    """Known weight that hangs on the tool in all experiments of a protocol [kg]."""
    return read_document(file, ProtocolFile, EXPECTED).load


def _experiment(
    file: Path, entry: ExperimentEntry, cell: kr5.cell.Cell, home: list[float] | None, seed: list[int], index: int
) -> kr5.cell.Experiment:
    at: tuple[int | str, ...] = ("experiments", index)
    if entry.given is not None:
        table = kr5.io.load_csv(file.parent / entry.given)
    else:
        signals = KINDS[entry.kind]
        signal = entry.signal if len(signals) > 1 else next(iter(signals))
        if signal not in signals:
            fail_at(file, (*at, "signal"), f"found {display_value(signal)}, expected one of {', '.join(signals)}")
        model = _parameters_of(signals[signal])
        parameters = validate_document(dict(entry.__pydantic_extra__ or {}), model, file, at=at)
        context = Context(cell, home, seed, f"{file}: experiment {entry.name!r}")
        table = signals[signal](context, **parameters.model_dump())
    out = kr5.cell.Experiment(name=entry.name, kind=entry.kind, file=f"{entry.name}.csv", split=entry.split)
    out.data = table
    return out


@functools.cache
def _parameters_of(signal: Callable[..., Any]) -> type[Document]:
    """The model of a signal's parameters, from its signature."""
    parameters = list(inspect.signature(signal).parameters.values())[1:]
    fields: dict[str, Any] = {p.name: (p.annotation, ... if p.default is p.empty else p.default) for p in parameters}
    return create_model(signal.__name__, __base__=Document, **fields)


def _table(names: list[str], *columns: npt.ArrayLike) -> kr5.io.Table:
    return kr5.io.Table(names, np.column_stack(columns))


def _motion(c: Context, start: float, q: np.ndarray) -> Any:
    low, high = np.asarray(c.cell.robot.limits.lower), np.asarray(c.cell.robot.limits.upper)
    if np.any(q < low) or np.any(q > high):
        c.fail("exceeds the limits of the joints; reduce 'reach', or move home")
    return _table(["t", *c.joint_names("qc")], start + c.cycle() * np.arange(len(q)), q)


def fourier(
    c: Context,
    start: Instant = 0.0,
    duration: Duration = 20.0,
    base: Frequency = 0.1,
    harmonics: Count = 5,
    reach: Reach = 0.8,
    speed: SpeedShare = 0.2,
) -> Any:
    """All joints at once, each a sum of `harmonics` of `base` [Hz], from home and back to it, within `reach` [rad or m]
    of home and `speed` times the limit of speed."""
    c.check_rows(duration)
    t = np.arange(0.0, duration, c.cycle())
    k = 2 * np.pi * base * np.arange(1, harmonics + 1)
    wave = np.einsum("jk,tk->tj", c.random.normal(size=(c.joints, harmonics)), np.sin(np.outer(t, k))) + np.einsum(
        "jk,tk->tj", c.random.normal(size=(c.joints, harmonics)), np.cos(np.outer(t, k))
    )
    if len(t) < 4:
        c.fail(f"duration: found {duration:g} s, expected a few cycles of {c.cycle():g} s at least")
    wave *= (np.sin(np.pi * t / duration) ** 2)[:, None]
    room = np.minimum(reach, np.minimum(c.high - c.home, c.home - c.low))
    rate = np.abs(np.gradient(wave, t, axis=0)).max(axis=0)
    return _motion(c, start, c.home + wave * np.minimum(room / np.abs(wave).max(axis=0), speed * c.speed / rate))


def way_points(
    c: Context, start: Instant = 0.0, count: Count = 8, reach: Reach = 0.9, speed: SpeedShare = 0.45, pause: Pause = 0.4
) -> Any:
    """From home through `count` postures within `reach` [rad or m] of home and back, jerk-limited, resting `pause` [s]
    at each; the fastest joint moves at `speed` times its limit."""
    points = [c.home, *(c.near(reach) for _ in range(count)), c.home]
    c.check_rows(pause)
    parts = [np.tile(c.home, (round(pause / c.cycle()), 1))]
    for a, b in itertools.pairwise(points):
        duration = 1.875 * np.max(np.abs(b - a) / (speed * c.speed))  # of the fifth-order move below
        c.check_rows(duration)
        s = np.arange(0.0, 1.0, c.cycle() / duration)[:, None]
        parts += [a + (b - a) * (10 * s**3 - 15 * s**4 + 6 * s**5), np.tile(b, (round(pause / c.cycle()), 1))]
    return _motion(c, start, np.vstack(parts))


def one_by_one(c: Context, start: Instant = 0.0, reach: Reach = 0.48, swing: Duration = 9.0, turns: Count = 2) -> Any:
    """One joint after the other swings `turns` times within `reach` [rad or m] of home, `swing` [s] a joint."""
    c.check_rows(swing)
    t = np.arange(0.0, swing, c.cycle())
    room = np.minimum(reach, np.minimum(c.high - c.home, c.home - c.low))
    wave = np.sin(2 * np.pi * turns * t / swing) * np.minimum(1.0, 6 * np.minimum(t, swing - t) / swing)
    return _motion(
        c, start, np.vstack([c.home + np.outer(room[j] * wave, np.eye(c.joints)[j]) for j in range(c.joints)])
    )


def poses(c: Context, count: Count = 60, start: Instant = 0.0, interval: Pause = 30.0, reach: Reach = 1.0) -> Any:
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


def views(
    c: Context,
    count: Count = 17,
    start: Instant = 0.0,
    interval: Pause = 20.0,
    near: Length = 0.35,
    far: Length = 0.6,
    tilt: Tilt = 0.5,
) -> Any:
    """`count` views of the board from `near` to `far` [m], up to `tilt` [rad] off its normal, one every `interval` [s];
    a row each corner that the image holds."""
    camera, board = c.cell.camera, c.cell.board
    if camera is None or board is None or c.cell.T_flange_camera() is None:
        c.fail("needs 'camera' on the flange and 'board', which the cell does not have; use given: FILE.csv for others")
    T_base_target, T_flange_camera = np.asarray(board.T_base_target), np.asarray(c.cell.T_flange_camera())
    middle = np.array([board.cols * (board.marker + board.gap), board.rows * (board.marker + board.gap), 0.0]) / 2
    at_home = np.linalg.inv(T_base_target) @ np.asarray(c.cell.flange(c.home)) @ T_flange_camera
    up = np.array([0.0, 0.0, np.sign(at_home[2, 3]) or 1.0])  # the side on which the arm is
    found: list[np.ndarray] = []
    for _ in range(TRIES * count):
        if len(found) == count:
            break
        T_target_camera = np.eye(4)
        T_target_camera[:3, :3] = _looking(c, -up, tilt)
        T_target_camera[:3, 3] = (
            middle + c.random.uniform(-0.03, 0.03, 3) - T_target_camera[:3, 2] * c.random.uniform(near, far)
        )
        q = c.posture(T_base_target @ T_target_camera @ np.linalg.inv(T_flange_camera))
        if q is None:
            continue
        view = _seen(c, q, len(found), start + interval * len(found))
        if len(view) >= 12:
            found.append(view)
    if len(found) < count:
        c.fail(
            f"found {len(found)} views of the board within the limits, expected {count}; move home, or change near,"
            " far, tilt"
        )
    return kr5.io.Table(["view", "t", *c.joint_names("q"), "marker", "corner"], np.vstack(found))


def _seen(c: Context, q: np.ndarray, view: int, t: float) -> np.ndarray:
    """Rows of the corners that the image holds."""
    board, camera = c.cell.board, c.cell.camera
    number = np.arange(4 * board.rows * board.cols)
    rows = np.column_stack(
        [
            np.full(len(number), view),
            np.full(len(number), t),
            np.tile(q, (len(number), 1)),
            board.first_id + number // 4,
            number % 4,
        ]
    )
    probe = kr5.cell.Experiment(name="probe", kind="views", file="probe.csv", split="fit")
    probe.data = kr5.io.Table(["view", "t", *c.joint_names("q"), "marker", "corner"], rows)
    shown = kr5.predict.FastSimulator().predict(c.cell, probe)
    u, v = shown["u"], shown["v"]
    return np.asarray(rows[(u >= 5) & (u <= camera.width - 6) & (v >= 5) & (v <= camera.height - 6)])


def scan(
    c: Context,
    passes: Count = 6,
    lines: Count = 13,
    start: Instant = 0.0,
    interval: Pause = 5.0,
    distance: Length = 0.17,
    tilt: Tilt = 0.25,
    width: Length = 0.09,
    points: Count = 61,
    speeds: Speeds = (0.01, 0.03, 0.1),
) -> Any:
    """`passes` across the sphere of the target, each of `lines` profiles along the scanner's Y, `distance` [m] from its
    top and up to `tilt` [rad] off the vertical, at the `speeds` [m/s] in turn; a profile is `points` over `width`
    [m]."""
    laser = c.cell.laser
    if laser is None or laser.target is None or c.cell.T_flange_scanner() is None:
        c.fail("needs 'laser' with a 'target', which the cell does not have")
    centre, radius = np.asarray(laser.target.sphere), laser.target.radius
    T_scanner_flange = np.linalg.inv(np.asarray(c.cell.T_flange_scanner()))
    x = np.linspace(-width / 2, width / 2, points)
    table: list[np.ndarray] = []
    for number in range(passes):
        for _ in range(TRIES):
            R = _looking(c, np.array([0.0, 0.0, -1.0]), tilt)
            middle = centre - R[:, 2] * (distance + radius)
            path = [middle + R[:, 1] * y for y in np.linspace(-1.1 * radius, 1.1 * radius, lines)]
            postures = [
                c.posture(np.block([[R, p[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]]) @ T_scanner_flange)
                for p in path
            ]
            if all(q is not None for q in postures):
                break
        else:
            c.fail(
                f"found no pass of the scanner over the sphere within the limits after {TRIES} tries; move home or the"
                " target"
            )
        for q in postures:
            line = len(table)
            head = [line, start + interval * line, speeds[number % len(speeds)]]
            table.append(np.column_stack([np.tile([*head, *np.asarray(q)], (points, 1)), x]))
    return kr5.io.Table(["line", "t", "speed", *c.joint_names("q"), "x"], np.vstack(table))


def step(c: Context, heights: Lengths = (0.024, -0.01), rest: Pause = 1.0, duration: Duration = 8.0) -> Any:
    """One run a height [m]: at 0 for `rest` [s], then the step."""
    c.check_rows(duration)
    t = c.cycle() * np.arange(round(duration / c.cycle()))
    runs = [np.column_stack([np.full(len(t), i), t, np.where(t < rest, 0.0, h)]) for i, h in enumerate(heights)]
    return kr5.io.Table(["run", "t", "zc"], np.vstack(runs))


def press(
    c: Context,
    speeds: Speeds = (0.001, 0.0007),
    start: Instant = 0.0,
    above: Height = 0.002,
    depth: Height = 0.006,
    rest: Pause = 1.0,
    hold: Pause = 2.0,
    interval: Pause = 100.0,
) -> Any:
    """One run a speed [m/s]: from `above` the bench [m] down to a command of `depth` below it, held for `hold` [s]; a
    run every `interval` [s]."""
    runs = []
    for i, v in enumerate(speeds):
        c.check_rows(rest + (above + depth) / v + hold)
        t = c.cycle() * np.arange(round((rest + (above + depth) / v + hold) / c.cycle()))
        runs.append(
            np.column_stack(
                [np.full(len(t), i), start + interval * i + t, np.clip(above - v * (t - rest), -depth, above)]
            )
        )
    return kr5.io.Table(["run", "t", "zc"], np.vstack(runs))


def profile(
    c: Context,
    tilts: Lengths = (0.131, 0.262, 0.262),
    cx: Lengths = (-0.0075, 0.006, -0.003),
    cy: Lengths = (-0.0072, 0.004, 0.008),
    forces: Forces = (10.0, 10.0, 20.0),
    ripple: Ripple = 0.25,
    rows: Rows = 833,
    start: Instant = 300.0,
    interval: Pause = 20.0,
) -> Any:
    """One roll round the tube a tilt [rad], the peg's bottom at cx, cy [m] in T, under a force [N] that wavers by
    `ripple` [N]."""
    if not len(tilts) == len(cx) == len(cy) == len(forces):
        c.fail("tilts, cx, cy and forces have different lengths")
    runs = []
    for i, (tilt, x, y, force) in enumerate(zip(tilts, cx, cy, forces)):
        k, one = np.arange(rows), np.ones(rows)
        held = force + ripple * np.sin(2 * np.pi * k / 120)
        runs.append(
            np.column_stack(
                [
                    i * one,
                    start + interval * i + c.cycle() * k,
                    tilt * one,
                    2 * np.pi * k / rows,
                    x * one,
                    y * one,
                    held,
                ]
            )
        )
    return kr5.io.Table(["run", "t", "tilt", "alpha", "cx", "cy", "fc"], np.vstack(runs))


KINDS: dict[str, dict[str, Callable[..., Any]]] = {
    "motion": {"fourier": fourier, "way_points": way_points, "one_by_one": one_by_one},
    "poses": {"poses": poses},
    "views": {"views": views},
    "scan": {"scan": scan},
    "step": {"step": step},
    "press": {"press": press},
    "profile": {"profile": profile},
}
