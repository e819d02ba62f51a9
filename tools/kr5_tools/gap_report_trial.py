"""One effect of the catalogue put to the test: fitted to the `fit` experiments of a recording, judged on the others. For
explanations of single effects; the diagnosis itself weighs all of them against each other."""

import copy
import itertools
import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from .gap_report_data import Comparison, Evidence, limit
from .gap_report_evidence import nominal

# Where the first step goes, by unit; it is scaled until it shows.
STEPS = {"rad": 1e-3, "m": 1e-3, "s": 6e-3, "N m": 3.0, "N m/rad": 3.0, "kg": 0.2, "-": 0.05, "N or N m": 0.5, "N/s or N m/s": 0.01,
         "1/mm": 0.2, "m/N": 1e-6, "px": 2.0, "-, m or 1/m": 0.01, "N m s/rad": 3.0, "m, rad": 1e-3}
SPEEDS = (0.01, 0.03, 0.08, 0.2, 0.5)  # [rad/s] at which friction may fade
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
MISSED = 3.0  # what cannot be compared (a ray that met the sphere in one of the two only) counts as so much noise


@dataclass
class Way:
    """One way to set an effect: free numbers, each with its first step and bounds, and what sets them in a cell."""

    choice: str
    steps: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    parameters: Callable[[np.ndarray], dict[str, Any]]
    leading: bool = False  # the others say nothing without the first, as a centre of mass without a mass


@dataclass
class Trial:
    """An effect at its best: parameters, part of the excess that it closes on data not fitted, gaps by column."""

    effect: str
    target: str
    choice: str
    parameters: dict[str, Any]
    doubts: dict[str, np.ndarray]
    closed: float
    columns: list[tuple[str, float, float]]  # name, before, after; those that change or stand out, most excess first

    def as_cause(self, units: dict[str, str]) -> dict[str, Any]:
        """In the form of a cause of kr5-gap/1."""
        out: dict[str, Any] = {}
        for name, value in self.parameters.items():
            value, std = np.asarray(value, float), self.doubts[name]
            out[name] = {"value": value.tolist(), "std": std.tolist(), "unit": units[name]}
        return {"effect": self.effect, "target": self.target, "parameters": out}

    @property
    def left(self) -> tuple[str, float]:
        """The widest gap that stays, of those columns."""
        return max(((g, after) for g, _, after in self.columns), key=lambda row: row[1], default=("", 1.0))


def way(names: list[tuple[str, float, float, float]], parameters: Callable, choice: str = "", leading: bool = False) -> Way:
    """Of numbers given as name, step, lower and upper bound."""
    return Way(choice, *(np.array([n[k] for n in names], float) for k in (1, 2, 3)), parameters, leading)


def ways(evidence: Evidence, effect: Any, target: str) -> list[Way]:
    """The ways to set an effect of the catalogue on a target."""
    return Ways(evidence, effect, target).all()


class Ways:
    """How the numbers of an effect are free: as they stand in the catalogue, or in the form that acts nearly linearly."""

    def __init__(self, evidence: Evidence, effect: Any, target: str) -> None:
        self.evidence, self.effect, self.target, self.cell = evidence, effect, target, evidence.recording.cell
        self.spec = {p.name: p for p in effect.parameters}
        self.number = int(target[5:]) if target[5:].isdigit() else 0  # of joint or motor

    def off(self, name: str) -> float:
        value = nominal(self.cell, self.effect.id, self.target, name)
        return float(value) if value is not None else self.spec[name].off[0] if self.spec[name].off else 0.0

    def free(self, name: str, step: float | None = None) -> tuple[str, float, float, float]:
        p, off = self.spec[name], self.off(name)
        step = step or (0.05 * abs(off) if p.nominal_when_off and abs(off) > 0.02 else STEPS.get(p.unit, 0.01))
        return name, step, p.lower - off, p.upper - off

    def all(self) -> list[Way]:
        found = self.of_drives()
        return found if found is not None else self.of_parts()

    def plain(self) -> list[Way]:
        names = list(self.spec)
        return [way([self.free(n) for n in names], lambda x: {n: self.off(n) + float(v) for n, v in zip(names, x)})]

    def of_drives(self) -> list[Way] | None:
        inf, id = math.inf, self.effect.id
        if id == "stribeck_friction":
            return [way([self.free("stribeck")], lambda x, v=v: {"stribeck": x[0], "stribeck_velocity": v}, f"{v:g} rad/s") for v in SPEEDS]
        if id in ("thermal_friction", "thermal_growth"):
            size = "drop" if self.number else "growth"
            span = max(float(np.max(e["t"])) for e in self.evidence.experiments if "t" in e.data)
            return [way([self.free(size, None if self.number else 2e-4)], lambda x, t=part * span: {size: x[0], "time_constant": t},
                        f"{part * span:.0f} s") for part in (0.1, 0.5, 3.0)]
        if id == "joint_elasticity":
            return [way([("compliance", 1e-6, 0.0, 1e-3)], lambda x: {"stiffness": 1 / max(x[0], 1e-12)})]
        if id == "cable_spring":
            reach = 2 * math.pi
            return [way([("k", 3.0, 1e-3, inf), ("kr", 3.0, -inf, inf)], lambda x: {
                "stiffness": x[0], "rest": float(np.clip(x[1] / max(x[0], 1e-3), -reach, reach))}, leading=True)]
        if id in ("torque_ripple", "transmission_error"):
            p = self.spec["amplitude"]
            size = (STEPS[p.unit], p.lower, p.upper)
            return [way([("s", *size), ("c", *size)], lambda x, n=n: {"amplitude": math.hypot(*x), "cycles": n, "phase": math.atan2(x[1], x[0])},
                        f"{n} cycles") for n in cycles(self.evidence, id, self.number)]
        if id == "wrist_coupling":
            row = np.asarray(self.cell.drives.structure)[self.number - 1]
            return [way([("value", 0.01, -inf, inf)], lambda x, j=j: {"element": j, "value": float(row[j] + x[0])}, f"joint {j + 1}")
                    for j in range(self.cell.robot.joints)]
        return None

    def of_parts(self) -> list[Way]:
        inf, id = math.inf, self.effect.id
        if id == "ft_crosstalk":
            return [way([self.free("gain")], lambda x, s=s: {"source": s, "gain": x[0]}, f"from {name}")
                    for s, name in enumerate(WRENCH) if name != self.target]
        if id == "payload":
            return [way([("m", 0.2, 1e-4, inf), *[(a, 0.01, -inf, inf) for a in "xyz"]], lambda x: {
                "mass": x[0], "com": np.clip(x[1:] / max(x[0], 1e-4), -5, 5).tolist()}, leading=True)]
        if id == "link_length":
            return [way([self.free(n, 1e-3)], lambda x, n=n: {n: self.off(n) + float(x[0])}, n) for n in ("a", "b")]
        if id == "link_twist":
            return [way([self.free("alpha", 1e-3)], lambda x: {"alpha": self.off("alpha") + float(x[0])})]
        p = self.effect.parameters[0]
        if str(p.kind) == "pose":
            import kr5

            here = nominal(self.cell, id, self.target, p.name)
            return [] if here is None else [way([("d", 1e-3, -0.3, 0.3)] * 6, lambda x: {p.name: here @ kr5.to_pose(x)})]
        if str(p.kind).startswith("vector"):
            return [way([(p.name, STEPS[p.unit], p.lower, p.upper)] * len(p.off), lambda x: {p.name: list(map(float, x))})]
        return self.plain()


def cycles(evidence: Evidence, effect: str, joint: int) -> list[int]:
    """Numbers of periods a turn worth a try: the strongest in the current of the joint; of errors of angle the lowest."""
    if effect == "transmission_error":
        return [1, 2]
    rows = [c for c in evidence.columns if c.kind == "motion" and c.name in (f"i{joint}", f"tau{joint}") and f"q{joint}" in c.experiment.data]
    if not rows:
        return [1]
    r, q = np.concatenate([np.nan_to_num(c.before) for c in rows]), np.concatenate([np.asarray(c.experiment[f"q{joint}"]) for c in rows])
    r = r - r.mean()
    return [1 + int(np.argmax([abs(np.sum(r * np.exp(1j * n * q))) for n in range(1, 61)]))]


class Judge:
    """Tries effects on a recording whose cell already carries some causes."""

    def __init__(self, evidence: Evidence, base: Any) -> None:
        self.evidence, self.base = evidence, base
        self.compare: dict[str, Comparison] = {}
        self.wild = dict(evidence.wild)
        self.base_rows: dict[str, dict[str, np.ndarray]] = {}
        for experiment in evidence.experiments:
            self.add(experiment)

    def add(self, experiment: Any) -> None:
        self.compare[experiment.name] = self.evidence.compare(experiment)
        self.base_rows[experiment.name] = self._rows(self.base, experiment)

    def short(self, experiment: Any, rows: int = 500) -> Any:
        """The beginning of a long motion, under a name of its own: enough to screen by."""
        import kr5.cell
        import kr5.io

        if str(experiment.kind) != "motion" or len(experiment.data) <= 1.5 * rows:
            return experiment
        out = kr5.cell.Experiment(name=f"{experiment.name}, beginning", kind=experiment.kind, file=experiment.file, split=experiment.split)
        out.data = kr5.io.Table(experiment.data.columns, np.asarray(experiment.data.values)[:rows])
        self.wild |= {(out.name, column): mask[:rows] for (name, column), mask in self.evidence.wild.items() if name == experiment.name}
        self.add(out)
        return out

    def _rows(self, cell: Any, experiment: Any) -> dict[str, np.ndarray]:
        rows = self.compare[experiment.name].rows(cell, self.evidence.simulator)
        return {name: np.where(self.wild.get((experiment.name, name), False), 0.0, np.where(np.isfinite(values), values, MISSED))
                for name, values in rows.items()}

    def _cell(self, effect: str, target: str, parameters: dict[str, Any]) -> Any:
        cell = copy.deepcopy(self.base)
        for name, value in parameters.items():
            cell.set_effect(effect, target, name, value)
        return cell

    def _stacked(self, cell: Any, experiments: list[Any]) -> np.ndarray:
        return np.concatenate([values for e in experiments for values in self._rows(cell, e).values()] or [np.zeros(0)])

    def _base(self, experiments: list[Any]) -> np.ndarray:
        return np.concatenate([v for e in experiments for v in self.base_rows[e.name].values()] or [np.zeros(0)])

    def experiments(self, split: str) -> list[Any]:
        all_of = self.evidence.experiments
        return [e for e in all_of if str(e.split) == split] or all_of

    def _changes(self, effect: Any, target: str, way: Way, i: int, steps: np.ndarray, experiments: list[Any]) -> list[np.ndarray]:
        """By how much a step of one number changes the residuals of each experiment."""
        x = np.maximum(way.lower, 0.0) if way.leading else np.zeros(len(steps))
        if way.leading and i:
            x[0] = steps[0]
        moved = x.copy()
        flipped = -1.0 if x[i] + steps[i] > way.upper[i] else 1.0
        moved[i] += flipped * steps[i]
        shown = [self._stacked(self._cell(effect.id, target, way.parameters(moved)), [e]) for e in experiments]
        if way.leading and i:
            before = [self._stacked(self._cell(effect.id, target, way.parameters(x)), [e]) for e in experiments]
        else:
            before = [self._base([e]) for e in experiments]
        return [flipped * (a - b) for a, b in zip(shown, before)]

    def start(self, effect: Any, target: str, way: Way, experiments: list[Any]) -> tuple[np.ndarray, np.ndarray, list[Any]] | None:
        """Steps that show by about one noise, the change each makes, and the experiments that it changes."""
        steps, changes = way.steps.copy(), []
        for i in range(len(steps)):
            for _ in range(3):
                change = self._changes(effect, target, way, i, steps, experiments)
                size = max((float(np.sqrt(np.mean(c**2))) for c in change if len(c)), default=0.0)
                if 0.1 < size < 30:
                    break
                grow = min(max(1 / size, 1e-4), 1e4) if size else 10.0  # what acts in whole cycles shows late
                steps[i] = min(steps[i] * grow, 0.1 * (way.upper[i] - way.lower[i]))
            changes.append(change)
        touched = [k for k in range(len(experiments)) if any(np.any(c[k]) for c in changes)]
        if not touched:
            return None
        return steps, np.column_stack([np.concatenate([c[k] for k in touched]) for c in changes]), [experiments[k] for k in touched]

    def screen(self, effect: Any, target: str, experiments: list[Any]) -> float:
        """Part of the excess that the effect would close if it were linear."""
        best, total = 0.0, sum(float(np.sum(v**2) - len(v)) for e in experiments for v in self.base_rows[e.name].values())
        for way in ways(self.evidence, effect, target):
            found = self.start(effect, target, way, experiments)
            if found is None:
                continue
            r = self._base(found[2])
            x = np.linalg.lstsq(found[1], -r, rcond=None)[0]
            x = np.clip(x, way.lower / found[0], way.upper / found[0])
            best = max(best, float(np.sum(r**2) - np.sum((r + found[1] @ x) ** 2)) / max(total, 1.0))
        return best

    def fit(self, effect: Any, target: str) -> Trial | None:
        """The effect at its best; None where it changes nothing that was recorded."""
        best: tuple[float, Way, np.ndarray, np.ndarray] | None = None
        for way in ways(self.evidence, effect, target):
            found = self.start(effect, target, way, self.experiments("fit"))
            refined = found and self._refined(effect, target, way, *found)
            if refined and (best is None or refined[0] > best[0]):
                best = refined[0], way, *refined[1:]
        return self._judged(effect.id, target, *best[1:]) if best else None

    def _refined(self, effect: Any, target: str, way: Way, steps: np.ndarray, changes: np.ndarray,
                 touched: list[Any]) -> tuple[float, np.ndarray, np.ndarray]:
        """Sum of squares gained, the numbers at their best, and their standard deviations."""
        from scipy.optimize import least_squares

        r, lower, upper = self._base(touched), way.lower / steps, way.upper / steps

        def shown(y: np.ndarray) -> np.ndarray:
            return self._stacked(self._cell(effect.id, target, way.parameters(steps * y)), touched)

        def slope(y: np.ndarray) -> np.ndarray:
            here, out = shown(y), []
            for i in range(len(y)):
                h = 0.1 if y[i] + 0.1 <= upper[i] else -0.1
                out.append((shown(y + h * np.eye(len(y))[i]) - here) / h)
            return np.column_stack(out)

        y = np.clip(np.linalg.lstsq(changes, -r, rcond=None)[0], lower + 1e-6, upper - 1e-6)
        done = least_squares(shown, y, slope, bounds=(lower, upper), max_nfev=12, xtol=1e-6, ftol=1e-6)
        std = steps * np.sqrt(np.maximum(np.diag(np.linalg.pinv(done.jac.T @ done.jac)), 0.0))
        return float(np.sum(r**2)) - 2 * done.cost, steps * done.x, std

    def _judged(self, effect: str, target: str, way: Way, x: np.ndarray, std: np.ndarray) -> Trial:
        parameters = way.parameters(x)
        moved = [way.parameters(x + 0.01 * s * axis) for s, axis in zip(std, np.eye(len(x)))]
        doubts = {name: std if np.shape(value) == (4, 4) else 100 * np.sqrt(sum(
            np.square(np.asarray(m[name], float) - np.asarray(value, float)) for m in moved)) for name, value in parameters.items()}
        cell = self._cell(effect, target, parameters)
        sums: dict[str, np.ndarray] = {}
        for e in self.experiments("check"):
            for name, values in self._rows(cell, e).items():
                before = self.base_rows[e.name][name]
                sums[f"{e.kind}.{name}"] = sums.get(f"{e.kind}.{name}", np.zeros(3)) + [np.sum(before**2), np.sum(values**2), len(values)]
        gaps = {g: (math.sqrt(b / n), math.sqrt(a / n), n) for g, (b, a, n) in sums.items() if n}
        above = {g: v for g, v in gaps.items() if v[0] > limit(int(v[2]))}
        excess = sum(b * b - 1 for b, _, _ in above.values())
        closed = sum(b * b - a * a for b, a, _ in above.values()) / excess if excess > 0 else 0.0
        changed = {g: v for g, v in gaps.items() if g in above or abs(v[0] - v[1]) > 0.02}
        rows = sorted(((g, b, a) for g, (b, a, _) in changed.items()), key=lambda row: -abs(row[1] ** 2 - row[2] ** 2))
        return Trial(effect, target, way.choice, parameters, doubts, closed, rows)


def all_effects(cell: Any) -> Iterator[tuple[Any, str]]:
    import kr5.cell

    for effect in kr5.cell.effect_catalogue():
        for target in cell.effect_targets(effect.id):
            yield effect, target


def rivals(evidence: Evidence, k: int, most: int = 3) -> list[Trial]:
    """The other effects that explain most of what a cause explains, when they take its place; best first."""
    others = [j for j in range(len(evidence.data["causes"])) if j != k]
    judge = Judge(evidence, evidence.cell_with(others))
    taken = {(c["effect"], c["target"]) for c in evidence.data["causes"]}
    weight: dict[str, float] = {}
    for c in evidence.columns:
        if c.after is not None and k in c.without and str(c.experiment.split) == "fit":
            weight[c.experiment.name] = weight.get(c.experiment.name, 0.0) + float(np.nansum(c.without[k] ** 2 - c.after**2))
    names = sorted(weight, key=lambda n: -weight[n])[:3]
    experiments = [judge.short(e) for e in evidence.experiments if e.name in names and weight[e.name] > 0.01 * max(weight.values())]
    tried = [(e, t) for e, t in all_effects(evidence.recording.cell) if (e.id, t) not in taken]
    with ThreadPoolExecutor() as pool:
        scores = list(pool.map(lambda pair: judge.screen(*pair, experiments), tried))
    order = sorted(range(len(tried)), key=lambda i: -scores[i])
    fitted = [judge.fit(*tried[i]) for i in itertools.islice(order, most) if scores[i] > 0.01]
    return sorted((f for f in fitted if f), key=lambda f: -f.closed)
