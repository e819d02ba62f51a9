"""What speaks against a map: numbers that make sense in another unit, on the other side of the gears, or in other
columns.

Positions are held against the limits of the cell, everything else against what the simulator shows for the same motion.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

import kr5
import kr5.cell
from kr5 import identification
from kr5.logs.entry_words import EntryWords
from kr5.logs.joint_columns import range_text
from kr5.logs.joint_order import Reading, fitting_convention, fitting_order
from kr5.logs.map_file import column_family
from kr5.logs.values import column_unit, of_motors

FACTOR = 1.6  # a scale within this factor of one that a wrong unit gives is taken for it
SPREAD = 4.0  # between the scales of the joints, above which they are no one unit
ALIKE = 0.8  # correlation of a column with its simulation, from which it is recognised
CURRENT, TORQUE = "motor current", "joint torque"  # channels of kr5.cell.Column
LOADS = (CURRENT, TORQUE, "force", "moment")
THOUSANDTHS = {"A": "mA", "N": "mN", "N m": "N mm"}
TURN = 2 * np.pi  # [rad] beyond which angles may be degrees
WEIGHTLESS = 0.3  # of what gravity makes, that loads without gravity show
NO_GRAVITY = 1e-9  # [m/s^2]
GRAVITY = 5.0  # standard deviations of a torque that gravity must make to be missed


@dataclass
class LogProblem:
    experiment: str
    column: str
    found: str
    expected: str
    remedy: str
    joint: str = ""  # of the column, as the model names it
    also: list[str] = field(default_factory=list)  # experiments with the same problem

    def text(self) -> str:
        what = f"{self.column} ({self.joint})" if self.joint else self.column
        more = f" (also in {', '.join(self.also)})" if self.also else ""
        return f"{self.experiment}: {what}: found {self.found}, expected {self.expected}; {self.remedy}{more}"


def merged_problems(problems: list[LogProblem]) -> list[LogProblem]:
    """Those that have one column and one remedy, told once."""
    out: dict[tuple[str, str], LogProblem] = {}
    for problem in problems:
        first = out.setdefault((problem.column, problem.remedy), problem)
        if first.experiment != problem.experiment and problem.experiment not in first.also:
            first.also.append(problem.experiment)
    return list(out.values())


def check_positions(cell: Any, experiment: Any, words: EntryWords) -> list[LogProblem]:
    """What speaks against the positions and the clock of an experiment; `words`: how a remedy names entries of its
    map."""
    out = _positions(cell, experiment, words) + _speeds(cell, experiment, words)
    return out + (_poses(cell, experiment, words) if str(experiment.kind) == "poses" else [])


def check_loads(cell: Any, experiment: Any, words: EntryWords, sources: Mapping[str, Any]) -> list[LogProblem]:
    """What speaks against the currents, torques and wrenches of a motion, whose positions are right; `words`: how a
    remedy names entries of its map; `sources`: what the map says of its columns."""
    return _loads(cell, experiment, words, sources) if str(experiment.kind) == "motion" else []


def _family(experiment: Any, stem: str, n: int) -> np.ndarray | None:
    names = [f"{stem}{i + 1}" for i in range(n)]
    return np.column_stack([experiment[c] for c in names]) if names[0] in experiment.data else None


def _load_stem(experiment: Any) -> str | None:
    """`tau` or `i`, whichever of the loads of the joints an experiment has."""
    return next((stem for stem in ("tau", "i") if f"{stem}1" in experiment.data), None)


def _joint_name(cell: Any, joint: int) -> str:
    """The model's name of a joint (from 0); empty where it has none."""
    names = cell.robot.joint_names
    return str(names[joint]) if names else ""


def _positions(cell: Any, e: Any, words: EntryWords) -> list[LogProblem]:
    """Joint values beyond the limits, and the unit or side of the gears with which they would lie within."""
    limits, n = cell.robot.limits, cell.robot.joints
    out: list[LogProblem] = []
    if limits is None:
        return out
    low, high = np.asarray(limits.lower), np.asarray(limits.upper)
    turns = np.array([str(j.type) == "revolute" for j in cell.robot.dh])
    room = 0.05 * np.where(np.isfinite(high - low), high - low, 0) + 0.01
    ratio = np.abs(np.diag(np.asarray(cell.drives.structure))) if cell.drives else np.ones(n)

    def within(q: np.ndarray) -> bool:
        return bool(np.all((q >= low - room) & (q <= high + room)))

    commands = _family(e, "qc", n)
    for stem in ("qc", "q"):
        q = _family(e, stem, n)
        if q is None:
            continue
        name = "q" if str(e.joint_reference) == "measured" else stem  # what was measured stands for the motion
        put = partial(words.put, f"columns.{name}")
        to_rad = np.where(turns, np.pi / 180, 1e-3)
        if not within(q):
            j = int(np.argmax(np.maximum(q.max(0) - high, low - q.min(0))))
            scales = [
                (to_rad, f"as degrees (mm for a slide): {put(unit='deg')}"),
                (1 / to_rad, f"as radians (m for a slide): {put(unit='rad')}"),
                (1 / ratio, f"on the motor side: {put(side='motor')}"),
                (to_rad / ratio, f"as degrees on the motor side: {put(unit='deg', side='motor')}"),
            ]
            if turns.any() and np.abs(q[:, turns]).max() < TURN:  # divided by 57, they would fit any limits
                del scales[3], scales[0]
            readings = [(scale, text) for scale, text in scales if within(q * scale)]
            if (
                stem == "q" and commands is not None and within(commands)
            ):  # of several, the one that follows the commands
                readings.sort(key=lambda r: np.median(np.abs(q * r[0] - commands)))
            remedy = (
                f"the numbers make sense {readings[0][1]}"
                if readings
                else f"check columns.{name}, its order and its offsets, and that this is the model of its robot"
            )
            unit = "rad" if turns[j] else "m"
            out.append(
                LogProblem(
                    e.name,
                    f"{name}{j + 1}",
                    f"{q[:, j].min():.4g} to {q[:, j].max():.4g} {unit}",
                    f"{low[j]:.4g} to {high[j]:.4g} {unit}",
                    remedy,
                    _joint_name(cell, j),
                )
            )
        elif turns.all() and within(q / to_rad) and np.abs(q).max() < 0.12 and np.ptp(q, axis=0).max() > 1e-3:
            out.append(
                LogProblem(
                    e.name,
                    range_text([f"{name}{k + 1}" for k in range(n)]),
                    f"no joint farther than {np.abs(q).max():.3g} rad from zero",
                    "a motion of some size",
                    f"are the numbers radians, which were read as degrees? {put(unit='rad')}",
                )
            )
    return out + _following(e, n)


def _following(e: Any, n: int) -> list[LogProblem]:
    """A measured joint follows its own command."""
    q, qc = _family(e, "q", n), _family(e, "qc", n)
    if q is None or qc is None:
        return []
    off = np.array([[np.median(np.abs(q[:, j] - qc[:, k])) for k in range(n)] for j in range(n)])
    out = []
    for j in range(n):
        k = int(np.argmin(off[j]))
        if k != j and off[j, j] > 0.1 and off[j, k] < 0.2 * off[j, j]:
            out.append(
                LogProblem(
                    e.name,
                    f"q{j + 1}",
                    f"that it follows qc{k + 1}, and is {off[j, j]:.3g} from qc{j + 1}",
                    "its own command",
                    "columns are swapped: check the order of names in columns.q and columns.qc",
                )
            )
    return out


def _speeds(cell: Any, e: Any, words: EntryWords) -> list[LogProblem]:
    """The clock against the limits of speed and the cycle of the servo."""
    n, limits = cell.robot.joints, cell.robot.limits
    q = _family(e, "qc", n) if str(e.kind) == "motion" else None
    if q is None or len(q) < 10:
        return []
    t = np.asarray(e["t"])
    step = float(np.median(np.diff(t)))
    cycle = cell.servo.cycle if cell.servo else None
    wrong = ""
    if limits is not None and len(limits.velocity):
        limit = np.asarray(limits.velocity)
        speed = np.quantile(np.abs(np.diff(q, axis=0)) / np.diff(t)[:, None], 0.99, axis=0) / limit
        if speed.max() > 3.0 or (speed.max() < 3e-3 and np.ptp(q, axis=0).max() > 0.05):
            wrong = f"joints that move at {speed.max():.3g} times their limit of speed"
    if cycle and not wrong and (step > 50 * cycle or step < cycle / 50):
        wrong = f"a row every {step:.3g} s"
    if not wrong:
        return []
    remedy = "check the unit and the column of the clock"
    for unit, scale in (("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("s", 1e3)):
        if (cycle and 1 / 3 < step * scale / cycle < 3) or (not cycle and 2e-4 < step * scale < 0.2):
            remedy = (
                f"the clock makes sense with {words.put('clock', unit=unit)}"
                if unit != "s"
                else "the clock makes sense in a unit a thousand times longer"
            )
            break
    return [
        LogProblem(
            e.name,
            "t",
            wrong,
            f"a row every {cycle:g} s" if cycle else "speeds within the limits of the cell",
            remedy,
        )
    ]


def _loads(cell: Any, e: Any, words: EntryWords, sources: Mapping[str, Any]) -> list[LogProblem]:
    """Currents, torques and wrench against the simulation of the same motion. Descriptions of robots may state friction
    that is no more than a placeholder: what is recognised and fits without it is not objected to."""
    if broken := _constant(cell, e) or _saturated(cell, e):
        return broken
    if found := _order(cell, e, words) or _convention(cell, e, words, sources) or _without_gravity(cell, e):
        return found
    bare = _without_friction(cell)
    out, _ = _compare_loads(cell, cell, e, words, by_joint=bare is None)  # stated friction may be off by joint
    if not out or bare is None:
        return out
    left, recognised = _compare_loads(cell, bare, e, words)
    return out if left or not recognised else []


def _constant(cell: Any, e: Any) -> list[LogProblem]:
    """Loads that are the same in every row, as of a driver that does not measure them."""
    stem = _load_stem(e)
    loads = _family(e, stem, cell.robot.joints) if stem else None
    if loads is None or float(np.ptp(loads, axis=0).max()) > 0:
        return []
    names = [f"{stem}{k + 1}" for k in range(cell.robot.joints)]
    return [
        LogProblem(
            e.name,
            range_text(names),
            f"the same value in every row ({loads[0, 0]:g} in {names[0]})",
            "values that follow the motion",
            "check that the driver measures efforts and that publishing them is turned on",
        )
    ]


def _saturated(cell: Any, e: Any) -> list[LogProblem]:
    """Loads that are clipped, in which nothing but the limit is seen."""
    q, stem = _family(e, "qc", cell.robot.joints), _load_stem(e)
    loads = _family(e, stem, cell.robot.joints) if stem else None
    if stem is None or q is None or loads is None or len(q) < 10:
        return []
    log = identification.JointLog(t=np.asarray(e["t"]), q=q, tau=loads)
    return [
        LogProblem(
            e.name,
            f.column.replace("tau", stem),
            f"a value that stays at its extreme from {f.begin:.3f} to {f.end:.3f} s while the arm moves",
            "values that follow the motion",
            "sensor, driver or logger clip it: record again with a wider range or a gentler motion",
            joint=_joint_name(cell, int(f.column[3:]) - 1),
        )
        for f in identification.check_log(log)
        if str(f.fault) == "saturated" and f.column.startswith("tau")
    ]


def _without_gravity(cell: Any, e: Any) -> list[LogProblem]:
    """Loads from which the controller took those of gravity: they are like the simulation of an arm without weight."""
    import kr5.predict

    stem = _load_stem(e)
    got = _family(e, stem, cell.robot.joints) if stem else None
    if got is None:
        return []
    weightless = kr5.cell.parse_cell(cell.to_yaml())
    robot = weightless.robot
    robot.gravity = np.full(3, NO_GRAVITY)
    weightless.robot = robot
    try:
        shown = [kr5.predict.FastSimulator().predict(c, e) for c in (cell, weightless)]
    except kr5.Error:
        return []
    with_it, without = (np.column_stack([s[f"{stem}{k + 1}"] for k in range(cell.robot.joints)]) for s in shown)
    gravity = with_it - without
    j = int(np.argmax(gravity.std(0)))
    # Of loads in another unit the size says nothing, and the shape all.
    alike, alike_lighter = (abs(_correlations(got, model)[j, j]) for model in (with_it, without))
    if alike > max(ALIKE, alike_lighter):
        return []
    left, lighter = (np.std(got[:, j] - model[:, j]) for model in (with_it, without))
    share = abs(float(np.dot(got[:, j] - got[:, j].mean(), gravity[:, j] - gravity[:, j].mean())))
    share /= max(float(np.sum((gravity[:, j] - gravity[:, j].mean()) ** 2)), 1e-30)
    if not (lighter < WEIGHTLESS * left and share < WEIGHTLESS):
        return []
    return [
        LogProblem(
            e.name,
            f"{stem}{j + 1}",
            "loads as of an arm without weight",
            "those of gravity, too",
            "the controller took gravity from what it logs, or the direction of gravity in the cell is wrong: log the"
            " whole load of each joint",
        )
    ]


def _order(cell: Any, e: Any, words: EntryWords) -> list[LogProblem]:
    """Joints in another order than the model's, which shows in many ways that say less."""
    stem = _load_stem(e)
    order = fitting_order(cell, e, stem) if stem else None
    if order is None:
        return []
    names = list(cell.robot.joint_names) or [f"joint{k + 1}" for k in range(cell.robot.joints)]
    wanted = {"from": "[...]"}
    return [
        LogProblem(
            e.name,
            f"q and {stem}",
            "loads that do not fit the motion",
            f"the order of the model: {', '.join(names)}",
            f"they fit with the joints in the order {', '.join(names[k] for k in order)}: name the columns in the order"
            f" of the model: {words.put('columns.q', **wanted)}, {words.put(f'columns.{stem}', **wanted)}",
        )
    ]


def _convention(cell: Any, e: Any, words: EntryWords, sources: Mapping[str, Any]) -> list[LogProblem]:
    """Joints that are counted in another direction, or from another zero, than in the model."""
    stem = _load_stem(e)
    reading = fitting_convention(cell, e, stem) if stem else None
    if stem is None or reading is None:
        return []
    joints = range(cell.robot.joints)
    said = [text for k in joints if (text := _convention_text(cell, reading, k))]
    return [
        LogProblem(
            e.name,
            f"q and {stem}",
            "loads that do not fit the motion",
            "joints counted as in the model",
            f"they fit with {' and '.join(said)}: {_convention_remedy(cell, reading, stem, words, sources)}",
        )
    ]


def _convention_remedy(cell: Any, reading: Reading, stem: str, words: EntryWords, sources: Mapping[str, Any]) -> str:
    """Entries that count the joints as the model does. What was measured on the motors stays as it is: the gears join
    it to joints counted another way."""
    q, load, sign, zero = sources["q"], sources[stem], np.array(reading.sign), np.array(reading.zero)
    units = np.array([column_unit(cell, "q", k, q) for k in range(cell.robot.joints)])
    entries = []
    if of_motors(q) or of_motors(load):
        gear = np.asarray(cell.drives.structure)
        entries.append(("cell.drives", "structure", gear, gear * sign))
    of_q, zero = (1, gear * sign @ zero) if of_motors(q) else (sign, zero)
    of_load = 1 if of_motors(load) else sign
    entries += [
        ("columns.q", "scale", q.scale, of_q * np.array(q.scale)),
        ("columns.q", "offset", q.offset, of_q * np.array(q.offset) + zero / units),
        (f"columns.{stem}", "scale", load.scale, of_load * np.array(load.scale)),
        (f"columns.{stem}", "offset", load.offset, of_load * np.array(load.offset)),
    ]
    puts = [words.put(key, **{name: new.tolist()}) for key, name, old, new in entries if np.any(new != np.asarray(old))]
    return " ".join(puts) if words.by_option else ", ".join(puts)


def _convention_text(cell: Any, reading: Reading, joint: int) -> str:
    name = _joint_name(cell, joint) or f"joint {joint + 1}"
    ways = ["in the other direction"] if reading.sign[joint] < 0 else []
    if reading.zero[joint]:
        ways.append(f"from a zero {np.degrees(abs(reading.zero[joint])):.0f} degrees away")
    return f"{name} counted {' and '.join(ways)}" if ways else ""


def _compare_loads(
    cell: Any, simulated: Any, e: Any, words: EntryWords, by_joint: bool = True
) -> tuple[list[LogProblem], bool]:
    """What speaks against the loads, and whether the columns of each channel are like their simulation."""
    import kr5.predict

    try:
        shown = kr5.predict.FastSimulator().predict(simulated, e)
    except kr5.Error:
        return [], False
    out: list[LogProblem] = []
    recognised = True
    for columns in _load_columns(cell, e):
        names = [c.name for c in columns]
        if all(c in e.data and c in shown for c in names):
            got = np.column_stack([e[c] for c in names])
            model = np.column_stack([shown[c] for c in names])
            recognised = recognised and _enough_alike(np.diag(_correlations(got, model)))
            out += (
                _scale(cell, e, columns, got, model, words, by_joint)
                or _swapped(e, names, got, model)
                or _unexplained(e, names, got, model)
            )
    return out, recognised


def _enough_alike(correlations: np.ndarray) -> bool:
    return bool((np.abs(correlations) > ALIKE).sum() >= max(1, len(correlations) // 3))


def _without_friction(cell: Any) -> Any | None:
    """The cell without friction of its joints; nothing where it states none."""
    drives = cell.drives
    if drives is None or not (np.any(drives.friction.coulomb) or np.any(drives.friction.viscous)):
        return None
    out: Any = kr5.cell.parse_cell(cell.to_yaml())
    drives, n = out.drives, cell.robot.joints
    drives.friction = kr5.cell.Friction(coulomb=np.zeros(n), viscous=np.zeros(n))
    out.drives = drives
    return out


def _load_columns(cell: Any, e: Any) -> list[list[Any]]:
    """The columns that show loads, those of one channel together."""
    channels: dict[str, list[Any]] = {}
    for column in kr5.cell.compared_columns(e.kind, cell.robot.joints):
        if column.channel in LOADS:
            channels.setdefault(column.channel, []).append(column)
    return list(channels.values())


def _correlations(got: np.ndarray, model: np.ndarray) -> np.ndarray:
    """Of each recorded column (row) with each simulated one."""
    a, b = got - got.mean(0), model - model.mean(0)
    lengths = np.linalg.norm(a, axis=0)[:, None] * np.linalg.norm(b, axis=0)[None, :]
    return np.asarray((a.T @ b) / np.maximum(lengths, 1e-30))


def _scale(
    cell: Any, e: Any, columns: list[Any], got: np.ndarray, model: np.ndarray, words: EntryWords, by_joint: bool
) -> list[LogProblem]:
    """A factor that all columns share, as a wrong unit, sign or side of the gears gives."""
    names = [c.name for c in columns]
    put = partial(words.put, f"columns.{column_family(names[0])}")
    own = np.diag(_correlations(got, model))
    known = np.abs(own) > ALIKE
    if not _enough_alike(own):
        return []
    slope = ((got - got.mean(0)) * (model - model.mean(0))).sum(0) / np.maximum(
        ((model - model.mean(0)) ** 2).sum(0), 1e-30
    )
    if not (slope[known] > 0).all() and (slope[known] < 0).all():
        return [
            LogProblem(
                e.name,
                range_text(names),
                "the opposite sign to the simulation",
                "the same sign",
                f"{put(scale=-1)} turns it (or correct the directions of the joints)",
            )
        ]
    backward = [c for c, k, s in zip(names, known, slope) if k and s < 0]
    if backward:
        return [
            LogProblem(
                e.name,
                ", ".join(backward),
                "the opposite sign to the simulation",
                "the same sign as in the other columns",
                f"{put(scale=[-1 if c in backward else 1 for c in names])} turns it; turn the positions of the joint,"
                " too, if its direction is reversed",
            )
        ]
    for factor, text in _factors(cell, columns, put):
        near = np.abs(np.log(slope[known] / factor[known])) < np.log(FACTOR)
        beside = np.abs(np.log(slope[known])) < np.log(FACTOR)
        if near.mean() > 0.7 and beside.mean() < 0.5:
            return [
                LogProblem(
                    e.name,
                    range_text(names),
                    f"{np.median(slope[known]):.3g} times what the simulation shows",
                    "a factor near 1",
                    text,
                )
            ]
    few_alike = np.mean(np.abs(np.log(slope[known])) < np.log(FACTOR)) < 0.5
    if by_joint and known.sum() >= 3 and few_alike and slope[known].max() > SPREAD * slope[known].min():
        return [
            LogProblem(
                e.name,
                range_text(names),
                f"{slope[known].min():.3g} to {slope[known].max():.3g} times what the simulation shows, a different"
                " factor for each joint",
                "a factor near 1",
                "are they per cent of a rated torque, or currents? State what 1 of the log is for each joint:"
                f" {put(scale='[...]')}",
            )
        ]
    off = float(np.exp(np.median(np.log(slope[known]))))
    if off > 3 or off < 1 / 3:
        return [
            LogProblem(
                e.name,
                range_text(names),
                f"{off:.3g} times what the simulation shows",
                "a factor near 1",
                f"check unit and side of columns.{column_family(names[0])}, and torque constants, structure and masses"
                " of the cell",
            )
        ]
    return []


def _factors(cell: Any, columns: list[Any], put: Callable[..., str]) -> list[tuple[np.ndarray, str]]:
    n, channel, unit = len(columns), columns[0].channel, columns[0].unit
    thousandth = "the unit is a thousandth of the one that was read"
    if unit in THOUSANDTHS and channel in (CURRENT, TORQUE):
        thousandth = put(unit=THOUSANDTHS[unit])
    thousand = f"the unit is a thousand times the one that was read: {put(scale=1000)}"
    out = [(np.full(n, 1e3), thousandth), (np.full(n, 1e-3), thousand)]
    limits = cell.robot.limits
    if channel == TORQUE and limits is not None and len(limits.effort) == n and np.isfinite(limits.effort).all():
        effort = np.asarray(limits.effort)
        percent = put(scale=[float(f"{x / 100:.6g}") for x in effort])
        out.append((100 / effort, f"they are percent of the limits of effort of the model: {percent}"))
    if cell.drives is None or channel not in (CURRENT, TORQUE):
        return out
    ratio = np.abs(np.diag(np.asarray(cell.drives.structure)))
    constant = np.asarray(cell.drives.torque_constant)
    if channel == CURRENT:
        return [
            *out,
            (constant, f"they are torques of the motors: {put(unit='N m', side='motor')}"),
            (constant * ratio, f"they are torques of the joints: {put(unit='N m')}"),
        ]
    return [
        *out,
        (1 / ratio, f"they are torques on the motor side: {put(side='motor')}"),
        (1 / (ratio * constant), f"they are currents: {put(unit='A')}"),
    ]


def _swapped(e: Any, names: list[str], got: np.ndarray, model: np.ndarray) -> list[LogProblem]:
    c = _correlations(got, model)
    for j in range(len(names)):
        for k in range(j + 1, len(names)):
            own, other = min(c[j, j], c[k, k]), min(c[j, k], c[k, j])
            if other > ALIKE and other > own + 0.3:
                return [
                    LogProblem(
                        e.name,
                        f"{names[j]} and {names[k]}",
                        f"each like the simulation of the other (correlation {other:.2f}, own {own:.2f})",
                        "each similar to its own",
                        f"the two columns are swapped: exchange their names in columns.{column_family(names[0])}.from",
                    )
                ]
    return []


def _unexplained(e: Any, names: list[str], got: np.ndarray, model: np.ndarray) -> list[LogProblem]:
    """The column in which the simulation sees the largest load shows nothing of it."""
    c = np.diag(_correlations(got, model))
    j = int(np.argmax(model.std(0)))
    rest = np.median(np.abs(np.diff(got[:, j], 2))) / 1.65 + 1e-12
    if c[j] < 0.3 and model[:, j].std() > GRAVITY * rest:
        return [
            LogProblem(
                e.name,
                names[j],
                f"a correlation of {c[j]:.2f} with the simulation",
                "visible gravity and inertia of the arm",
                "is this the right column, did the controller remove gravity from it, is the direction of gravity"
                " in the cell right, and are joint directions and zeros those of the log?",
            )
        ]
    return []


def _poses(cell: Any, e: Any, words: EntryWords) -> list[LogProblem]:
    """Tool positions against where the cell puts the tool: another unit, or measured in another frame."""
    n = cell.robot.joints
    q, seen = _family(e, "q", n), np.column_stack([e[c] for c in "xyz"])
    if q is None:
        return []
    tip = np.array([cell.T_base_tool(row)[:3, 3] for row in q])
    off = float(np.median(np.linalg.norm(seen - tip, axis=1)))
    reach = float(np.median(np.linalg.norm(tip, axis=1)))
    if off < 0.05 * max(reach, 0.1):
        return []
    spread = float(np.linalg.norm(seen.std(0))) / max(float(np.linalg.norm(tip.std(0))), 1e-9)
    for scale, text in ((1e3, "mm"), (1e2, "cm"), (1e-3, "m")):
        if 1 / FACTOR < spread / scale < FACTOR:
            return [
                LogProblem(
                    e.name,
                    "x y z",
                    f"positions that spread {spread:.3g} times as far as the cell's tool",
                    "about as far",
                    words.put("columns.tool", position=text),
                )
            ]
    a, b = seen - seen.mean(0), tip - tip.mean(0)
    U, _, V = np.linalg.svd(a.T @ b)
    R = V.T @ np.diag([1, 1, np.linalg.det(V.T @ U.T)]) @ U.T
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, tip.mean(0) - R @ seen.mean(0)
    left = float(np.median(np.linalg.norm(a @ R.T - b, axis=1)))
    if left < 0.2 * off:
        pose = words.put("columns.tool", device=[float(f"{x:.5g}") for x in kr5.to_xyzrpy(T)])
        return [
            LogProblem(
                e.name,
                "x y z",
                f"a tool {1e3 * off:.4g} mm from its position by the cell, {1e3 * left:.3g}"
                " mm after a rigid transformation",
                "poses in the base of the robot",
                f"the device measures in its own frame: {pose}",
            )
        ]
    return [
        LogProblem(
            e.name,
            "x y z",
            f"a tool {1e3 * off:.4g} mm (median) from its position by the cell",
            "agreement within a few per cent of the reach",
            "are joint angles, their order and the cell's tool right?",
        )
    ]
