"""What the pages and tables about a diagnosis know beyond its JSON: residuals row by row, at the nominal cell and with
the causes, simulated anew."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import kr5.cell
import kr5.gap
import numpy as np
from kr5.logs.compared_source import reopen_source

from kr5_tools.cli import arguments
from kr5_tools.cli.numbers import format_percent
from kr5_tools.gap_report.messages import effect_row, find_column


@dataclass
class Column:
    """One column of one experiment: recorded less simulated over noise; NaN where the two cannot be compared."""

    experiment: Any
    name: str
    before: np.ndarray
    after: np.ndarray | None = None

    @property
    def kind(self) -> str:
        return str(self.experiment.kind)

    @property
    def group(self) -> str:
        return f"{self.kind}.{self.name}"


class Evidence:
    """A diagnosis (kr5.gap.Diagnosis) with its recording, and what both say together."""

    def __init__(
        self, found: kr5.gap.Diagnosis, recording: kr5.cell.Recording, simulator: kr5.cell.Simulator | None = None
    ) -> None:
        self.found, self.recording = found, recording
        self.simulator = simulator or arguments.make_simulator(False)
        self.experiments = list(recording.experiments)  # once: each look makes copies
        self.unset = sorted({c.effect for c in found.causes if effect_row(c.effect) is None})  # no cell can hold them
        self.cell = kr5.gap.with_causes(recording.cell, found.causes)

    @cached_property
    def told(self) -> kr5.gap.DiagnosisEvidence:
        """Residuals with and without each cause, and what they say."""
        return kr5.gap.diagnosis_evidence(self.found, self.recording, self.simulator)

    @cached_property
    def residuals(self) -> list[kr5.gap.ResidualColumn]:
        """A copy, made once."""
        return list(self.told.residuals)

    @cached_property
    def columns(self) -> list[Column]:
        experiments, out = {e.name: e for e in self.experiments}, []
        for shown in self.residuals:
            rows = np.asarray(shown.residuals).T
            after = rows[1] if self.explained else None
            out.append(Column(experiments[shown.experiment], shown.column, rows[0], after))
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
        """The columns of a group (kind.column) that judge it."""
        found = self._judged[0].get(group)
        return [c for c in self.columns if found and c.group == group and c.experiment.name in found.experiments]

    @cached_property
    def _judged(self) -> list[dict[str, kr5.gap.JudgedColumn]]:
        """By column of the residuals, then by group (kind.column)."""
        cells = np.shape(self.residuals[0].residuals)[1] if self.residuals else 0
        return [{c.column: c for c in kr5.gap.judged_columns(self.recording, self.residuals, k)} for k in range(cells)]

    @property
    def explained(self) -> bool:
        """Whether there is a cell with the causes, for curves after."""
        return bool(self.found.causes) and not self.unset

    @property
    def groups(self) -> list[str]:
        return list(dict.fromkeys(c.group for c in self.columns))

    def gap(self, group: str, which: str = "before", without: int | None = None) -> float:
        cell = self.told.cell_without(without) if without is not None else int(which == "after")
        found = self._judged[cell].get(group) if cell < len(self._judged) else None
        return found.gap if found else float("nan")

    def limit(self, group: str) -> float:
        """What noise alone stays below in 99.9 % of recordings."""
        found = self._judged[0].get(group)
        return found.limit if found else float("inf")

    def exceeds(self, group: str, which: str = "before") -> bool:
        return self.gap(group, which) > self.limit(group)


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
