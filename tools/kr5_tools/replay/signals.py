"""The signals of an experiment as a replay shows them: recorded, simulated, and the residual in units of its noise."""

import base64
from dataclasses import dataclass
from typing import Any

import kr5.cell
import kr5.gap
import kr5.io
import numpy as np
import numpy.typing as npt

from kr5_tools.cell.frames import joint_unit
from kr5_tools.cli.numbers import table_unit

PAGE_VALUES = 1_200_000  # numbers of all signals on one page, of which each takes 2.7 letters
MOST_POINTS, FEWEST_POINTS = 2000, 200  # of one signal
UNKNOWN = 65535  # a packed value that there is not


@dataclass
class Signal:
    """One column over the time of its run; what there is not is None. In SI."""

    name: str
    label: str
    unit: str
    group: str  # of the list of columns: the quantity
    x: np.ndarray  # [s] on the time axis of the replay
    given: np.ndarray | None = None  # to the simulation
    recorded: np.ndarray | None = None
    simulated: np.ndarray | None = None
    residual: np.ndarray | None = None  # recorded minus simulated over the noise [-]

    @property
    def compared(self) -> np.ndarray:
        """The residuals that are numbers [-]."""
        return np.empty(0) if self.residual is None else self.residual[np.isfinite(self.residual)]

    @property
    def gap(self) -> float | None:
        """RMS of the residual [-]."""
        rows = self.compared
        return kr5.gap.residual_gap(rows) if len(rows) else None

    @property
    def above(self) -> bool:
        """Whether the gap is above the limit of noise."""
        return self.gap is not None and self.gap > kr5.gap.noise_limit(len(self.compared))

    @property
    def curves(self) -> dict[str, np.ndarray]:
        """What there is of given, recorded, simulated and residual."""
        found = {name: getattr(self, name) for name in ("given", "recorded", "simulated", "residual")}
        return {name: values for name, values in found.items() if values is not None}


def experiment_signals(
    cell: kr5.cell.Cell,
    experiment: kr5.cell.Experiment,
    x: np.ndarray,
    rows: np.ndarray,
    predicted: kr5.io.Table | None,
) -> list[Signal]:
    """Signals of the `rows` of an experiment; `predicted`: what a simulator returned for all of them, if it did.

    Left out are numbers of runs, times, and joint positions of postures that stand still.
    """
    data, kind = experiment.data, experiment.kind
    columns = kr5.cell.columns(kind, cell.robot.joints)
    omitted = {"t", "pose", "view", "line", "run", "marker", "corner"}
    if str(kind) != "motion":
        omitted |= {f"q{i + 1}" for i in range(cell.robot.joints)}
    out = []
    for column in columns:
        if column.name in omitted or column.group == "orientation":
            continue
        unit, recorded = joint_unit(cell, column.joint, str(column.unit)), _values(data, column.name, rows)
        if str(column.role) == "given" and recorded is not None:
            out.append(Signal(column.name, column.label, unit, "given", x, given=recorded))
            continue
        simulated = _values(predicted, column.name, rows)
        if recorded is None and simulated is None:
            continue
        noise = cell.noise.of(column.noise, column.joint) if column.noise else 0.0
        residual = (recorded - simulated) / noise if recorded is not None and simulated is not None and noise else None
        out.append(
            Signal(
                column.name,
                column.label,
                unit,
                column.channel,
                x,
                recorded=recorded,
                simulated=simulated,
                residual=_finite(residual),
            )
        )
    return out + _turns(cell, data, predicted, x, rows)


def _values(table: kr5.io.Table | None, name: str, rows: np.ndarray) -> np.ndarray | None:
    return np.asarray(table[name], dtype=float)[rows] if table is not None and name in table else None


def _finite(values: np.ndarray | None) -> np.ndarray | None:
    return values if values is not None and np.any(np.isfinite(values)) else None


def _turns(
    cell: kr5.cell.Cell, data: kr5.io.Table, predicted: kr5.io.Table | None, x: np.ndarray, rows: np.ndarray
) -> list[Signal]:
    """The residual of an orientation, as rotation vector."""
    from scipy.spatial.transform import Rotation

    names = ("qx", "qy", "qz", "qw")
    if predicted is None or any(n not in data or n not in predicted for n in names) or not cell.noise.pose_rotation:
        return []
    seen, shown = (
        Rotation.from_quat(np.column_stack([np.asarray(table[n], dtype=float)[rows] for n in names]))
        for table in (data, predicted)
    )
    turn = (shown.inv() * seen).as_rotvec() / cell.noise.pose_rotation
    return [
        Signal(f"r{axis}", f"rotation of the tool about {axis}", "rad", "orientation", x, residual=turn[:, k])
        for k, axis in enumerate("xyz")
    ]


def points_for(signals: int, curves: int = 4) -> int:
    """How many points of each signal a page may hold; a signal has `curves` with that of its times."""
    return int(np.clip(PAGE_VALUES / max(1, signals * curves), FEWEST_POINTS, MOST_POINTS))


def page_signal(signal: Signal, most: int) -> dict[str, Any]:
    """A signal for the script of a page, with lengths in mm and angles in degrees, thinned out to `most` points and
    packed."""
    factor, unit = table_unit(signal.unit)
    curves = signal.curves
    keep = peak_rows(next(iter(reversed(curves.values()))), most)
    return {
        "name": signal.name,
        "label": signal.label,
        "unit": unit,
        "group": signal.group,
        "gap": None if signal.gap is None else round(signal.gap, 3),
        "above": signal.above,
        "x": pack(signal.x[keep]),
        **{name: pack(values[keep] * (1.0 if name == "residual" else factor)) for name, values in curves.items()},
    }


def peak_rows(values: np.ndarray, most: int) -> np.ndarray:
    """Rows to keep of many: of each of most / 2 equal parts that with the smallest value and that with the largest, so
    that no peak is lost."""
    n = len(values)
    if n <= most:
        return np.arange(n)
    finite = np.isfinite(values)
    filled = np.where(finite, values, np.mean(values[finite]) if finite.any() else 0.0)
    part = np.arange(n) * (most // 2) // n
    order = np.lexsort((filled, part))
    first = np.searchsorted(part, np.arange(most // 2))
    last = np.append(first[1:], n) - 1
    return np.unique(np.concatenate([[0], order[first], order[last], [n - 1]]))


def pack(values: np.ndarray) -> dict[str, Any]:
    """Numbers as 16 bits each between the least and the greatest, in base64: a third of their length as text."""
    finite = np.isfinite(values)
    low, high = (float(f(values[finite])) for f in (np.min, np.max)) if finite.any() else (0.0, 0.0)
    step = (high - low) / (UNKNOWN - 1)
    codes = np.full(len(values), UNKNOWN, "<u2")
    codes[finite] = np.round((values[finite] - low) / step) if step else 0
    return {"low": low, "step": step, "data": base64.b64encode(codes.tobytes()).decode()}


def signal_of(name: str, label: str, unit: str, group: str, x: np.ndarray, values: npt.ArrayLike) -> Signal:
    """A signal of a simulation that nothing recorded is compared with."""
    return Signal(name, label, unit, group, x, simulated=np.asarray(values, dtype=float))
