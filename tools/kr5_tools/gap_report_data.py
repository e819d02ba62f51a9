"""What the pages and tables about a diagnosis know beyond its JSON: residuals row by row, at the nominal cell and with the
causes, simulated anew."""

import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from . import common

ROTATION = ("rx", "ry", "rz")
QUATERNION = ("qw", "qx", "qy", "qz")


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


def gap_of(rows: np.ndarray) -> float:
    """RMS over the rows that can be compared; NaN without any."""
    rows = rows[np.isfinite(rows)]
    return float(np.sqrt(np.mean(rows**2))) if len(rows) else float("nan")


def rotation_vector(simulated: np.ndarray, recorded: np.ndarray) -> np.ndarray:
    """Log(R_simulated^T R_recorded) of quaternions w x y z, row by row."""
    a = simulated / np.linalg.norm(simulated, axis=1, keepdims=True)
    b = recorded / np.linalg.norm(recorded, axis=1, keepdims=True)
    w = np.sum(a * b, axis=1)
    v = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
    v *= np.where(w < 0, -1.0, 1.0)[:, None]
    sine = np.linalg.norm(v, axis=1)
    angle = 2 * np.arctan2(sine, np.abs(w))
    return v * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)[:, None]


class Comparison:
    """What an experiment recorded, ready to be compared with what a simulator shows: every column that both have and whose
    noise is stated. `sizes`: by what to multiply a noise that the cell states wrongly."""

    def __init__(self, recording: Any, experiment: Any, sizes: dict[str, float]) -> None:
        import kr5.cell

        cell, self.experiment = recording.cell, experiment
        rows = kr5.cell.columns(experiment.kind, cell.robot.joints)
        noise = {key: value * sizes.get(key, 1.0) for key, value in cell.noise.to_dict().items()}
        recorded, names = np.asarray(experiment.data.values), list(experiment.data.columns)
        self.recorded = {name: recorded[:, k] for k, name in enumerate(names)}
        self.noise = {row.name: noise[row.noise] for row in rows if row.name in self.recorded and row.name not in QUATERNION and noise.get(row.noise)}
        turned = all(q in self.recorded for q in QUATERNION) and noise.get("pose_rotation")
        self.rotation, self.turned = noise.get("pose_rotation"), np.column_stack([self.recorded[q] for q in QUATERNION]) if turned else None

    def rows(self, cell: Any, simulator: Any) -> dict[str, np.ndarray]:
        """Recorded less simulated over noise, by column; NaN where the two cannot be compared."""
        return self.rows_of(simulator.predict(cell, self.experiment))

    def rows_of(self, table: Any) -> dict[str, np.ndarray]:
        """The same, of what a simulator showed."""
        values = np.asarray(table.values)
        shown = {name: values[:, k] for k, name in enumerate(table.columns)}
        out = {name: (self.recorded[name] - shown[name]) / sigma for name, sigma in self.noise.items() if name in shown}
        if self.turned is not None and all(q in shown for q in QUATERNION):
            turned = rotation_vector(np.column_stack([shown[q] for q in QUATERNION]), self.turned)
            out |= {name: turned[:, k] / self.rotation for k, name in enumerate(ROTATION)}
        if "sphere" in self.recorded and "sphere" in shown and "z" in out:
            out["z"] = np.where(self.recorded["sphere"] == shown["sphere"], out["z"], np.nan)
        return out


def spikes(experiment: Any, rows: np.ndarray) -> np.ndarray:
    """Single samples far from both neighbours on the same side, in experiments whose rows follow each other."""
    out = np.zeros(len(rows), bool)
    if str(experiment.kind) in ("poses", "views", "scan") or len(rows) < 5:
        return out
    run = np.asarray(experiment["run"]) if "run" in experiment.data else np.zeros(len(rows))
    back, ahead = rows[1:-1] - rows[:-2], rows[1:-1] - rows[2:]
    same = (run[1:-1] == run[:-2]) & (run[1:-1] == run[2:])
    limit = 6 * 1.4826 * np.nanmedian(np.abs(back + ahead)[same]) / np.sqrt(6) if same.any() else np.inf
    out[1:-1] = same & (back * ahead > 0) & (np.abs(back) > limit) & (np.abs(ahead) > limit)
    return out


def seen_noise(warnings: list[str], kind: str) -> dict[str, float]:
    """By what the noise seen in experiments of a kind differs from the one declared, as the diagnosis warned."""
    found = (re.match(r"noise of (\w+)(?: in (\w+))? is ([\d.]+)", text) for text in warnings)
    return {m[1]: float(m[3]) for m in found if m and m[2] in (None, kind)}


class Evidence:
    """A diagnosis (dict of format kr5-gap/1) with its recording, and what both say together."""

    def __init__(self, data: dict[str, Any], recording: Any, simulator: Any = None) -> None:
        self.data, self.recording = data, recording
        self.simulator = simulator or common.simulator(False)
        self.nominal: dict[str, Any] = {}  # what the nominal cell shows, by experiment
        self.experiments = [e for e in recording.experiments if self.shows(e)]  # once: each look makes copies
        self.wild: dict[tuple[str, str], np.ndarray] = {}  # spikes, by experiment and column
        self.unset: list[str] = []  # causes that a cell cannot hold
        self.cell = self.cell_with(range(len(data["causes"])))

    def shows(self, experiment: Any) -> bool:
        """Whether the simulator can show an experiment at all, and what; the diagnosis warns of those that it cannot."""
        import kr5

        try:
            self.nominal[experiment.name] = self.simulator.predict(self.recording.cell, experiment)
        except kr5.InvalidArgument:
            return False
        return True

    def compare(self, experiment: Any) -> Comparison:
        """The comparison of an experiment, by the noise that was seen."""
        return Comparison(self.recording, experiment, seen_noise(self.data.get("warnings", []), str(experiment.kind)))

    def cell_with(self, causes: Any) -> Any:
        """The recording's cell with some of the causes added."""
        import kr5.cell

        known = {e.id for e in kr5.cell.effect_catalogue()}
        cell = self.recording.cell  # a copy
        for k in causes:
            cause = self.data["causes"][k]
            if cause["effect"] not in known:
                self.unset = sorted({*self.unset, cause["effect"]})
                continue
            for name, parameter in cause["parameters"].items():
                cell.set_effect(cause["effect"], cause["target"], name, parameter["value"])
        return cell

    @cached_property
    def columns(self) -> list[Column]:
        causes = range(len(self.data["causes"]))
        others = {k: self.cell_with([j for j in causes if j != k]) for k in causes} if len(causes) > 1 and self.explained else {}
        spiky = any("spikes" in w for w in self.data.get("warnings", []))
        out = []
        for experiment in common.track(self.experiments, "simulating"):
            compare = self.compare(experiment)
            before = compare.rows_of(self.nominal[experiment.name])
            after = compare.rows(self.cell, self.simulator) if self.explained else {}
            without = {k: compare.rows(cell, self.simulator) for k, cell in others.items()} or ({0: before} if self.explained else {})
            for name, rows in before.items():
                wild = spikes(experiment, rows) if spiky else np.zeros(len(rows), bool)
                self.wild[experiment.name, name] = wild
                kept = {key: np.where(wild, np.nan, values[name]) for key, values in [("before", before), ("after", after), *without.items()]
                        if name in values}
                out.append(Column(experiment, name, kept["before"], kept.get("after"), {k: kept[k] for k in without if k in kept}))
        return out

    def judged(self, group: str) -> list[Column]:
        """The columns of a group (kind.column) that judge it: of the check experiments, of all where none is to check."""
        all_of = [c for c in self.columns if c.group == group]
        return [c for c in all_of if str(c.experiment.split) == "check"] or all_of

    @property
    def explained(self) -> bool:
        """Whether there is a cell with the causes, for curves after."""
        return bool(self.data["causes"]) and not self.unset

    @property
    def groups(self) -> list[str]:
        return list(dict.fromkeys(c.group for c in self.columns))

    def gap(self, group: str, which: str = "before", without: int | None = None) -> float:
        rows = [c.without.get(without) if without is not None else getattr(c, which) for c in self.judged(group)]
        rows = [r for r in rows if r is not None]
        return gap_of(np.concatenate(rows)) if rows else float("nan")

    def limit(self, group: str) -> float:
        """What noise alone stays below in 99.9 % of recordings."""
        return limit(sum(int(np.isfinite(c.before).sum()) for c in self.judged(group)))

    def exceeds(self, group: str, which: str = "before") -> bool:
        return self.gap(group, which) > self.limit(group)


def limit(rows: int) -> float:
    from kr5.uncertainty import chi_square_quantile

    return float((chi_square_quantile(0.999, rows) / rows) ** 0.5) if rows else float("inf")


def shown_variable(column: Column, dependence: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, str] | None:
    """Values of what a residual depends on, by what to multiply the residual (the direction of motion, where it turns with
    it), and the unit; None when the recording has not the columns."""
    data, name = column.experiment.data, dependence["variable"].removeprefix("predicted ").strip("|")
    sign = np.ones(len(column.before))
    if m := re.match(r"changes sign with qd(\d+)", dependence["how"]):
        speed = _joint(column.experiment, m[1], 1)
        if speed is None:
            return None
        sign = np.where(np.abs(speed) > 1e-4, np.sign(speed), 0.0)
    if m := re.fullmatch(r"(q|qd|qdd)(\d+)", name):
        values = _joint(column.experiment, m[2], len(m[1]) - 1)
        if values is None:
            return None
        return np.abs(values) if "|" in dependence["variable"] else values, sign, ("[rad]", "[rad/s]", "[rad/s²]")[len(m[1]) - 1]
    if name == "zcd" and "zc" in data:
        return np.gradient(np.asarray(data["zc"]), _cycle(column.experiment)), sign, "[m/s]"
    units = {"t": "[s]", "u": "[px]", "v": "[px]", "fc": "[N]", "tilt": "[rad]", "alpha": "[rad]", "speed": "[m/s]"}
    default = "[m]" if name in ("x", "zc", "cx", "cy", "z") else "[N]" if name[:1] == "f" else "[N m]" if len(name) == 2 and name[0] == "t" else ""
    return (np.asarray(data[name]), sign, units.get(name, default)) if name in data else None


def _cycle(experiment: Any) -> float:
    t = np.asarray(experiment["t"])
    return max(float(t[-1] - t[0]) / max(len(t) - 1, 1), 1e-6)


def _joint(experiment: Any, number: str, order: int) -> np.ndarray | None:
    """Position of a joint as commanded (where it is, else as read), its rate, or its acceleration."""
    name = next((n for n in (f"qc{number}", f"q{number}") if n in experiment.data), None)
    if name is None or (order and "t" not in experiment.data):
        return None
    values = np.asarray(experiment[name])
    for _ in range(order):
        values = np.gradient(values, _cycle(experiment))
    return values


def find_recording(data: dict[str, Any], source: Path, given: Path | None) -> Any:
    """The recording that a diagnosis is of: given, or named in the file; None when there is none (any more)."""
    import kr5.cell

    if given:
        return kr5.cell.load_recording(given)
    named = data.get("input", {}).get("recording")
    for folder in (Path(named), source.parent / named) if isinstance(named, str) else ():
        if (folder / "recording.yaml").is_file():
            return kr5.cell.load_recording(folder)
    return None
