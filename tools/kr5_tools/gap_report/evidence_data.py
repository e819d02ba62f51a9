"""What the pages and tables about a diagnosis know beyond its JSON: residuals row by row, at the nominal cell and with
the causes, simulated anew."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import kr5.cell
import kr5.gap
import numpy as np
from kr5.logs.compared_source import reopen_source

from kr5_tools.cli import arguments
from kr5_tools.cli.numbers import format_percent
from kr5_tools.gap_report.messages import find_column


@dataclass
class Column:
    """One column of one experiment: recorded less simulated over noise; NaN where the two cannot be compared."""

    experiment: Any
    name: str
    before: np.ndarray
    after: np.ndarray | None = None
    without: dict[int, np.ndarray] = field(default_factory=dict)  # by the number of the cause that is left out

    @property
    def kind(self) -> str:
        return str(self.experiment.kind)

    @property
    def group(self) -> str:
        return f"{self.kind}.{self.name}"


def measured_noise(found: kr5.gap.Diagnosis) -> list[kr5.gap.NoiseOverride]:
    """The noise that a diagnosis measured, as kr5.gap.NoiseOverride."""
    return [kr5.gap.NoiseOverride(key=n.key, kind=n.kind, ratio=n.ratio) for n in found.noise]


class Evidence:
    """A diagnosis (kr5.gap.Diagnosis) with its recording, and what both say together."""

    def __init__(
        self, found: kr5.gap.Diagnosis, recording: kr5.cell.Recording, simulator: kr5.cell.Simulator | None = None
    ) -> None:
        self.found, self.recording = found, recording
        self.simulator = simulator or arguments.make_simulator(False)
        self.noise = measured_noise(found)
        self.experiments = list(recording.experiments)  # once: each look makes copies
        self.unset: list[str] = []  # causes that a cell cannot hold
        self.cell = self.cell_with(range(len(found.causes)))

    def cell_with(self, causes: Iterable[int]) -> kr5.cell.Cell:
        """The recording's cell with some of the causes added."""
        known = {e.id for e in kr5.cell.effect_catalogue()}
        cell, named = self.recording.cell, self.found.causes  # copies
        for k in causes:
            cause = named[k]
            if cause.effect not in known:
                self.unset = sorted({*self.unset, cause.effect})
                continue
            for parameter in cause.parameters:
                cell.set_effect(cause.effect, cause.target, parameter.name, shaped_value(parameter.value))
        return cell

    @property
    def left_out(self) -> list[int]:
        """Causes whose part is seen by leaving them out; of a single one the nominal cell tells."""
        count = len(self.found.causes)
        return list(range(count)) if self.explained and count > 1 else []

    @cached_property
    def residuals(self) -> list[kr5.gap.ResidualColumn]:
        """kr5.gap.ResidualColumn: at the nominal cell, with the causes, and without each of them."""
        causes = range(len(self.found.causes))
        others = [self.cell_with([j for j in causes if j != k]) for k in self.left_out]
        return kr5.gap.residual_columns(
            self.recording, self.simulator, [self.cell, *others] if self.explained else [], self.noise
        )

    @cached_property
    def columns(self) -> list[Column]:
        experiments, out = {e.name: e for e in self.experiments}, []
        for shown in self.residuals:
            rows = np.asarray(shown.residuals).T
            after = rows[1] if self.explained else None
            without = dict(zip(self.left_out, rows[2:])) or ({0: rows[0]} if self.explained else {})
            out.append(Column(experiments[shown.experiment], shown.column, rows[0], after, without))
        return out

    def parts(self) -> list[dict[str, Any]]:
        """The gap by subsystem, pose region, speed and experiment, before and with the causes."""
        before = kr5.gap.gap_parts(self.recording, self.residuals)
        after = (
            {(p.by, p.name): p.gap for p in kr5.gap.gap_parts(self.recording, self.residuals, 1)}
            if self.explained
            else {}
        )
        return [
            {
                "by": p.by,
                "name": p.name,
                "gap": p.gap,
                "after": after.get((p.by, p.name)),
                "share": format_percent(p.share) if p.share > 0 else "–",
            }
            for by in ("subsystem", "pose region", "speed", "experiment")
            for p in before
            if p.by == by
        ]

    def judged(self, group: str) -> list[Column]:
        """The columns of a group (kind.column) that judge it: of the check experiments, of all where none is to
        check."""
        all_of = [c for c in self.columns if c.group == group]
        return [c for c in all_of if str(c.experiment.split) == "check"] or all_of

    @cached_property
    def of_causes(self) -> list[kr5.gap.CauseEvidence]:
        """What each cause explains; only where there is a cell with the causes."""
        return [
            kr5.gap.cause_evidence(self.recording, self.residuals, self._without(k), 1)
            for k in range(len(self.found.causes))
        ]

    def _without(self, k: int) -> int:
        """The column of the residuals at the cell with all causes but one."""
        return 2 + self.left_out.index(k) if self.left_out else 0

    @cached_property
    def _judged(self) -> list[dict[str, kr5.gap.JudgedColumn]]:
        """By column of the residuals, then by group (kind.column)."""
        cells = 2 + len(self.left_out) if self.explained else 1
        return [{c.column: c for c in kr5.gap.judged_columns(self.recording, self.residuals, k)} for k in range(cells)]

    @property
    def options(self) -> Any:
        """Of trials on the recording."""
        return kr5.gap.EffectFitOptions(noise=self.noise)

    def rivals(self, k: int) -> list[Any]:
        """The other effects that explain most of what a cause explains, in its place."""
        causes = self.found.causes
        taken = [kr5.gap.EffectName(effect=c.effect, target=c.target) for c in causes]
        cell = self.cell_with([j for j in range(len(causes)) if j != k])
        explains = {
            c.group
            for c in self.columns
            if k in c.without and self.gap(c.group, without=k) > self.gap(c.group, "after") + 0.02
        }
        tried = kr5.gap.fit_best_effects(self.recording, cell, self.simulator, taken, 6, self.options)
        return [t for t in tried if any(c.column in explains and c.after < c.before for c in t.columns)][:3]

    @property
    def explained(self) -> bool:
        """Whether there is a cell with the causes, for curves after."""
        return bool(self.found.causes) and not self.unset

    @property
    def groups(self) -> list[str]:
        return list(dict.fromkeys(c.group for c in self.columns))

    def gap(self, group: str, which: str = "before", without: int | None = None) -> float:
        cell = self._without(without) if without is not None else int(which == "after")
        found = self._judged[cell].get(group) if cell < len(self._judged) else None
        return found.gap if found else float("nan")

    def limit(self, group: str) -> float:
        """What noise alone stays below in 99.9 % of recordings."""
        found = self._judged[0].get(group)
        return found.limit if found else float("inf")

    def exceeds(self, group: str, which: str = "before") -> bool:
        return self.gap(group, which) > self.limit(group)


def shaped_value(value: list[float]) -> Any:
    """A value as a cell file has it: a number, a list, or the rows of a matrix."""
    if len(value) == 1:
        return value[0]
    return [value[i : i + 4] for i in range(0, 16, 4)] if len(value) == 16 else list(value)


# Number of times that a position is differentiated, and the unit; in the order of the kinds of variables of a joint.
OF_JOINTS = {
    "joint_position": (0, "[rad]"),
    "joint_velocity": (1, "[rad/s]"),
    "joint_speed": (1, "[rad/s]"),
    "joint_acceleration": (2, "[rad/s²]"),
}


def display_variable(column: Column, dependence: kr5.gap.Dependence) -> tuple[np.ndarray, np.ndarray, str] | None:
    """Values of what a residual depends on, by what to multiply the residual (the direction of motion, where it turns
    with it), and the unit; None when the recording has not the columns."""
    variable = dependence.variable
    kind, data = str(variable.kind), column.experiment.data
    sign = np.ones(len(column.before))
    if dependence.sign_joint:
        speed = _joint(column.experiment, dependence.sign_joint, 1)
        if speed is None:
            return None
        sign = np.where(np.abs(speed) > 1e-4, np.sign(speed), 0.0)
    if kind in OF_JOINTS:
        order, unit = OF_JOINTS[kind]
        values = _joint(column.experiment, variable.joint, order)
        if values is None:
            return None
        return np.abs(values) if kind == "joint_speed" else values, sign, unit
    if kind == "path_velocity" and "zc" in data:
        return np.gradient(np.asarray(data["zc"]), _cycle(column.experiment)), sign, "[m/s]"
    if not variable.column or variable.column not in data:
        return None
    known = find_column(f"{column.kind}.{variable.column}")
    return np.asarray(data[variable.column]), sign, f"[{known.unit}]" if known and known.unit != "-" else ""


def _cycle(experiment: kr5.cell.Experiment) -> float:
    t = np.asarray(experiment["t"])
    return max(float(t[-1] - t[0]) / max(len(t) - 1, 1), 1e-6)


def _joint(experiment: kr5.cell.Experiment, number: int, order: int) -> np.ndarray | None:
    """Position of a joint as commanded (where it is, else as read), its rate, or its acceleration."""
    name = next((n for n in (f"qc{number}", f"q{number}") if n in experiment.data), None)
    if name is None or (order and "t" not in experiment.data):
        return None
    values = np.asarray(experiment[name])
    for _ in range(order):
        values = np.gradient(values, _cycle(experiment))
    return values


def find_recording(inputs: dict[str, Any], source: Path, given: Path | None) -> Any:
    """The recording that a diagnosis is of, with the model that it was compared with: given, or named in its `input`,
    or made anew of the logs that are named there; None when there is none (any more)."""
    found = reopen_source(inputs, source.parent, given)
    if found is None and given:
        return kr5.cell.load_recording(given)
    return found.recording if found else None


def named_inputs(given: Mapping[str, object], evidence: Evidence | None) -> dict[str, Any]:
    """The `input` of a diagnosis, with the folder from which its recording was read."""
    inputs = dict(given)
    if evidence and "logs" not in inputs and str(evidence.recording.folder):
        inputs["recording"] = str(evidence.recording.folder)
    return inputs
