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
MISSED = 3.0  # what cannot be compared (a ray that met the sphere in one of the two only) counts as so much noise


@dataclass
class Way:
    """One way to set an effect: free numbers, each with its first step and bounds, and what sets them in a cell."""

    choice: str
    steps: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    parameters: Callable[[np.ndarray], dict[str, Any]]


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


def ways(evidence: Evidence, effect: Any, target: str) -> list[Way]:
    """The ways to set an effect of the catalogue on a target."""
    cell, spec = evidence.recording.cell, {p.name: p for p in effect.parameters}
    joint = int(target[5:]) if target[5:].isdigit() else 0

    def way(names: list[tuple[str, float, float, float]], parameters: Callable[[np.ndarray], dict[str, Any]], choice: str = "") -> Way:
        return Way(choice, *(np.array([n[k] for n in names], float) for k in (1, 2, 3)), parameters)

    def free(name: str, step: float | None = None, positive: bool | None = None) -> tuple[str, float, float, float]:
        p, off = spec[name], nominal(cell, effect.id, target, name)
        off = float(off) if off is not None else p.off[0] if p.off else 0.0
        step = step or (0.05 * abs(off) if p.nominal_when_off and abs(off) > 0.02 else STEPS.get(p.unit, 0.01))
        return name, step, (0.0 if positive else p.lower) - off, p.upper - off

    def absolute(name: str, x: float) -> float:
        off = nominal(cell, effect.id, target, name)
        return float(x) + (float(off) if off is not None else spec[name].off[0] if spec[name].off else 0.0)

    inf = math.inf
    match effect.id:
        case "stribeck_friction":
            return [way([free("stribeck")], lambda x, v=v: {"stribeck": x[0], "stribeck_velocity": v}, f"{v:g} rad/s") for v in SPEEDS]
        case "thermal_friction" | "thermal_growth":
            size, span = ("drop" if joint else "growth"), max(float(np.max(e["t"])) for e in evidence.experiments if "t" in e.data)
            return [way([free(size, None if joint else 2e-4)], lambda x, s=s: {size: x[0], "time_constant": s * span}, f"{s * span:.0f} s")
                    for s in (0.1, 0.5, 3.0)]
        case "joint_elasticity":
            return [way([("compliance", 1e-6, 0.0, 1e-3)], lambda x: {"stiffness": 1 / max(x[0], 1e-12)})]
        case "cable_spring":
            reach = 2 * math.pi
            return [way([("k", 3.0, 1e-3, inf), ("kr", 3.0, -inf, inf)],
                        lambda x: {"stiffness": x[0], "rest": float(np.clip(x[1] / max(x[0], 1e-3), -reach, reach))})]
        case "torque_ripple" | "transmission_error":
            step = STEPS[spec["amplitude"].unit]
            return [way([("s", step, -inf, inf), ("c", step, -inf, inf)], lambda x, n=n: {
                "amplitude": math.hypot(*x), "cycles": n, "phase": math.atan2(x[1], x[0])}, f"{n} cycles") for n in cycles(evidence, effect.id, joint)]
        case "wrist_coupling":
            motor = int(target[5:]) - 1
            structure = np.asarray(cell.drives.structure)
            return [way([("value", 0.01, -inf, inf)], lambda x, j=j: {"element": j, "value": structure[motor][j] + x[0]}, f"joint {j + 1}")
                    for j in range(cell.robot.joints)]
        case "ft_crosstalk":
            return [way([free("gain")], lambda x, s=s: {"source": s, "gain": x[0]}, f"from {('fx', 'fy', 'fz', 'tx', 'ty', 'tz')[s]}")
                    for s in range(6) if ("fx", "fy", "fz", "tx", "ty", "tz")[s] != target]
        case "payload":
            return [way([("m", 0.2, 1e-4, inf), *[(a, 0.01, -inf, inf) for a in "xyz"]],
                        lambda x: {"mass": x[0], "com": np.clip(x[1:] / max(x[0], 1e-4), -5, 5).tolist()})]
        case "link_length":
            return [way([free(n, 1e-3)], lambda x, n=n: {n: absolute(n, x[0])}, n) for n in ("a", "b")]
        case "link_twist":
            return [way([free("alpha", 1e-3)], lambda x: {"alpha": absolute("alpha", x[0])})]
        case "hand_eye" | "laser_mount":
            import kr5

            name = effect.parameters[0].name
            here = np.asarray(nominal(cell, effect.id, target, name))
            return [way([("d", 1e-3, -0.3, 0.3)] * 6, lambda x: {name: here @ kr5.to_pose(x)})]
    vectors = [p for p in effect.parameters if str(p.kind).startswith("vector")]
    if vectors:
        p = vectors[0]
        return [way([(p.name, STEPS[p.unit], p.lower, p.upper)] * len(p.off), lambda x: {p.name: list(map(float, x))})]
    names = list(spec)
    return [way([free(n) for n in names], lambda x: {n: absolute(n, v) for n, v in zip(names, x)})]


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
        self.compare[experiment.name] = Comparison(self.evidence.recording, experiment, self.evidence.noise_sizes)
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

    def experiments(self, split: str) -> list[Any]:
        all_of = self.evidence.experiments
        return [e for e in all_of if str(e.split) == split] or all_of

    def start(self, effect: Any, target: str, way: Way, experiments: list[Any]) -> tuple[np.ndarray, np.ndarray, list[Any]] | None:
        """Steps that show by about one noise, the change each makes, and the experiments that it changes."""
        base = {e.name: np.concatenate([*self.base_rows[e.name].values(), np.zeros(0)]) for e in experiments}
        steps, changes = way.steps.copy(), []
        for i in range(len(steps)):
            for _ in range(3):
                x = np.clip(way.lower, 0.0, way.upper) if effect.id not in ("payload", "cable_spring") else np.maximum(way.lower, 0.0)
                if effect.id in ("payload", "cable_spring") and i:
                    x[0] = steps[0]
                flipped = -1.0 if x[i] + steps[i] > way.upper[i] else 1.0
                moved = x.copy()
                moved[i] += flipped * steps[i]
                reference = base if not np.any(x) or effect.id not in ("payload", "cable_spring") or not i else None
                shown = [self._stacked(self._cell(effect.id, target, way.parameters(moved)), [e]) for e in experiments]
                before = [reference[e.name] for e in experiments] if reference else [
                    self._stacked(self._cell(effect.id, target, way.parameters(x)), [e]) for e in experiments]
                change = [flipped * (a - b) for a, b in zip(shown, before)]
                size = max((float(np.sqrt(np.mean(c**2))) for c in change if len(c)), default=0.0)
                if size == 0.0 or 0.1 < size < 30:
                    break
                steps[i] *= min(max(1 / size, 1e-4), 1e4)
            changes.append(change)
        touched = [k for k, e in enumerate(experiments) if any(np.any(c[k]) for c in changes)]
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
            r = np.concatenate([v for e in found[2] for v in self.base_rows[e.name].values()])
            x = np.linalg.lstsq(found[1], -r, rcond=None)[0]
            x = np.clip(x, way.lower / found[0], way.upper / found[0])
            best = max(best, float(np.sum(r**2) - np.sum((r + found[1] @ x) ** 2)) / max(total, 1.0))
        return best

    def fit(self, effect: Any, target: str) -> Trial | None:
        """The effect at its best; None where it changes nothing that was recorded."""
        from scipy.optimize import least_squares

        best: tuple[float, Way, Any] | None = None
        for way in ways(self.evidence, effect, target):
            found = self.start(effect, target, way, self.experiments("fit"))
            if found is None:
                continue
            steps, changes, touched = found
            r = np.concatenate([v for e in touched for v in self.base_rows[e.name].values()])
            lower, upper = way.lower / steps, way.upper / steps

            def shown(y: np.ndarray, way: Way = way, steps: np.ndarray = steps, touched: list[Any] = touched) -> np.ndarray:
                return self._stacked(self._cell(effect.id, target, way.parameters(steps * y)), touched)

            def slope(y: np.ndarray, shown: Callable = shown, upper: np.ndarray = upper) -> np.ndarray:
                here, out = shown(y), []
                for i in range(len(y)):
                    h = 0.1 if y[i] + 0.1 <= upper[i] else -0.1
                    out.append((shown(y + h * np.eye(len(y))[i]) - here) / h)
                return np.column_stack(out)

            y = np.clip(np.linalg.lstsq(changes, -r, rcond=None)[0], lower + 1e-6, upper - 1e-6)
            done = least_squares(shown, y, slope, bounds=(lower, upper), max_nfev=12, xtol=1e-6, ftol=1e-6)
            gain = float(np.sum(r**2)) - 2 * done.cost
            if best is None or gain > best[0]:
                best = gain, way, (steps, done)
        if best is None:
            return None
        _, way, (steps, done) = best
        H = done.jac.T @ done.jac
        std = steps * np.sqrt(np.maximum(np.diag(np.linalg.pinv(H)), 0.0))
        return self._judged(effect.id, target, way, steps * done.x, std)

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
