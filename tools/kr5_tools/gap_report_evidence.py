"""What a recording says for and against a cause, in sentences with numbers."""

from typing import Any

import numpy as np

from . import common
from .gap_report_words import capital, column_words, dependence_words, effect_words, listed, percent, shown_unit

DEG = 57.29577951308232


def nominal(cell: Any, effect: str, target: str, parameter: str) -> Any:
    """What the cell says of a parameter that an effect replaces; None for one that is an addition."""
    joint = int(target[5:]) - 1 if target.startswith("joint") else 0
    drives, servo, camera = cell.drives, cell.servo, cell.camera
    places = {
        ("coulomb_friction", "coulomb"): lambda: drives.friction.coulomb[joint],
        ("viscous_friction", "viscous"): lambda: drives.friction.viscous[joint],
        ("torque_constant", "torque_constant"): lambda: drives.torque_constant[joint],
        ("rotor_inertia", "rotor_inertia"): lambda: drives.rotor_inertia[joint],
        ("link_length", "a"): lambda: cell.robot.dh[joint].a, ("link_length", "b"): lambda: cell.robot.dh[joint].b,
        ("link_twist", "alpha"): lambda: cell.robot.dh[joint].alpha,
        ("joint_servo", "natural_frequency"): lambda: servo.of_joint(joint).natural_frequency,
        ("joint_delay", "delay"): lambda: servo.of_joint(0).delay,
        ("tool_servo", "natural_frequency"): lambda: servo.tool.natural_frequency,
        ("tool_damping", "damping_ratio"): lambda: servo.tool.damping_ratio, ("tool_delay", "delay"): lambda: servo.tool.delay,
        ("ft_gain", "gain"): lambda: 1.0,
        ("camera_focal", "fx"): lambda: camera.fx, ("camera_focal", "fy"): lambda: camera.fy,
        ("lens_distortion", "k1"): lambda: camera.distortion.values[0], ("lens_distortion", "k2"): lambda: camera.distortion.values[1],
        ("hand_eye", "T_E_C"): lambda: _at_tip(cell, cell.T_F_C()), ("laser_mount", "T_E_L"): lambda: _at_tip(cell, cell.T_F_L()),
        ("contact_stiffness", "stiffness"): lambda: cell.contact.stiffness, ("contact_friction", "friction"): lambda: cell.contact.friction,
        ("tube_radius", "inner_radius"): lambda: cell.tube.inner_radius,
    }
    find = places.get((effect, parameter))
    return find() if find else None


def _at_tip(cell: Any, T_F_X: Any) -> Any:
    """What the flange carries, in the nominal tool tip; None for what it does not carry."""
    if T_F_X is None:
        return None
    return np.linalg.inv(cell.tool.T_F_E) @ T_F_X if cell.tool else np.asarray(T_F_X)


def parameter_rows(cause: dict[str, Any], cell: Any) -> list[dict[str, str]]:
    """Name, value, doubt, unit and what the cell says, one row a number; a pose as its difference from the cell's."""
    out = []
    for name, p in cause["parameters"].items():
        before = nominal(cell, cause["effect"], cause["target"], name) if cell else None
        if isinstance(p["value"], list) and isinstance(p["value"][0], list):
            out += _pose_rows(p, before)
            continue
        values, std = (v if isinstance(v, list) else [v] for v in (p["value"], p["std"]))
        factor, unit = shown_unit(p["unit"], values, cause["target"])
        for axis, value, doubt in zip("xyz" if len(values) > 1 else [""], values, std):
            exact = not doubt  # a choice, such as the number of cycles
            out.append({"name": f"{name.replace('_', ' ')} {axis}".strip(), "unit": unit,
                        "value": f"{factor * value:g}" if exact else common.number(factor * value, factor * doubt),
                        "std": "" if exact else f"± {common.number(factor * doubt, factor * doubt)}",
                        "nominal": "" if before is None else f"{factor * before:.6g}"})
    return out


def _pose_rows(p: dict[str, Any], before: Any) -> list[dict[str, str]]:
    from scipy.spatial.transform import Rotation

    value = np.asarray(p["value"], float)
    moved = np.linalg.inv(before) @ value if before is not None else value
    numbers = [*(1e3 * moved[:3, 3]), *(DEG * Rotation.from_matrix(moved[:3, :3]).as_rotvec())]
    std = [*(1e3 * np.asarray(p["std"][:3])), *(DEG * np.asarray(p["std"][3:]))]
    names = [f"{what} {axis}" for what in ("shift along", "turn about") for axis in "xyz"]
    return [{"name": n, "value": common.number(v, s), "std": f"± {common.number(s, s)}", "unit": u, "nominal": "0" if before is not None else ""}
            for n, v, s, u in zip(names, numbers, std, ["mm"] * 3 + ["°"] * 3)]


def _moved(cause: dict[str, Any], cell: Any) -> float | None:
    """By how many standard deviations the best known number of a cause is from off."""
    most = None
    for name, p in cause["parameters"].items():
        before = nominal(cell, cause["effect"], cause["target"], name) if cell else None
        if isinstance(p["value"], list) and isinstance(p["value"][0], list):
            rows = [(float(r["value"]), float(r["std"].removeprefix("± "))) for r in _pose_rows(p, before)] if before is not None else []
        else:
            values, std = (v if isinstance(v, list) else [v] for v in (p["value"], p["std"]))
            rows = [(v - (before or 0.0), s) for v, s in zip(values, std)]
        if name in ("stribeck_velocity", "time_constant", "rest", "phase", "com") or cause["effect"] == "joint_elasticity":
            continue  # says nothing of the size
        for value, std in rows:
            if std > 0:
                most = max(most or 0.0, abs(value) / std)
    return most


def columns_of(evidence: Any, k: int) -> list[tuple[str, float, float, float]]:
    """Columns that a cause explains: name, gap without it, gap with it, part of the squares it takes away; most first."""
    rows, total = [], 0.0
    for group in evidence.groups:
        if all(c.after is None or k not in c.without for c in evidence.judged(group)):
            continue
        without, after = evidence.gap(group, without=k), evidence.gap(group, "after")
        n = sum(int(np.isfinite(c.after).sum()) for c in evidence.judged(group))
        gain = n * (without**2 - after**2)
        total += max(gain, 0.0)
        rows.append((group, without, after, gain))
    rows.sort(key=lambda row: -row[3])
    return [(g, w, a, gain / total if total else 0.0) for g, w, a, gain in rows]


def closed_by_experiment(evidence: Any, k: int) -> dict[str, float]:
    """Part of the excess that a cause closes, in each experiment in which it stands out."""
    sums: dict[str, list[float]] = {}
    for c in evidence.columns:
        if c.after is None or k not in c.without:
            continue
        both = np.isfinite(c.without[k]) & np.isfinite(c.after)
        without, after, n = np.sum(c.without[k][both] ** 2), np.sum(c.after[both] ** 2), int(both.sum())
        if n and without / n > 1 + 6 * np.sqrt(2 / n):
            entry = sums.setdefault(c.experiment.name, [0.0, 0.0])
            entry[0] += without - n
            entry[1] += without - after
    return {name: closed / excess for name, (excess, closed) in sums.items()}


def for_it(data: dict[str, Any], k: int, evidence: Any) -> list[str]:
    """What speaks for a cause."""
    cause = data["causes"][k]
    others = " that the other causes leave" if len(data["causes"]) > 1 else ""
    out = [f"It closes {percent(cause['gap_closed'])} of the excess{others}, on experiments that were not used to fit it."]
    if evidence and evidence.explained:
        top = [row for row in columns_of(evidence, k) if row[3] > 0.01 and row[1] > evidence.limit(row[0])][:4]
        if top:
            out.append("It explains " + listed([f"the {column_words(g)} ({w:.2f} → {a:.2f})" for g, w, a, _ in top])
                       + f"{', all with the same values' if len(top) > 1 else ''}.")
        closed = closed_by_experiment(evidence, k)
        if len(closed) > 1 and min(closed.values()) > 0.5:
            out.append(f"It holds in each of the {len(closed)} experiments in which it stands out: in the worst "
                       f"{percent(min(closed.values()))} of its excess goes.")
        away = _moved(cause, evidence.recording.cell)
        if away and away >= 3:
            out.append(f"Its size is {f'{away:.0f}' if away < 1000 else 'more than 1000'} standard deviations from none.")
    return out


def in_its_place(trials: list[Any], evidence: Any) -> list[str]:
    """What other effects do in the place of a cause, fitted anew."""
    out = []
    for trial in trials:
        if trial.closed < 0.01:
            continue
        group, left = max(((c.column, c.after) for c in trial.columns), key=lambda row: row[1], default=("", 1.0))
        rest = "leaves nothing above the floor" if left <= 1.02 * evidence.limit(group) else f"leaves the {column_words(group)} at {left:.2f}"
        out.append(f"{capital(effect_words(trial.effect, trial.target))} closes {percent(trial.closed)} and {rest}.")
    return out or ["No other effect closes more than 1 % of what it closes."]


def against(data: dict[str, Any], k: int, evidence: Any) -> list[str]:
    """What speaks against a cause; says so when nothing does."""
    cause, out = data["causes"][k], []
    for tied in cause["tied_with"]:
        out.append(f"{capital(effect_words(tied['effect'], tied['target']))} would look the same in this recording.")
    if cause["probability"] < 0.99:
        out.append(f"{percent(1 - cause['probability'])} of the probability lies with other explanations.")
    if evidence and evidence.explained:
        rows = columns_of(evidence, k)
        explained = {g for g, _, _, part in rows if part > 0.01}
        for place in data["unexplained"]:
            group = f"{place['experiment']}.{place['column']}"
            if group in explained:
                depends = f", and {dependence_words(place['depends_on'][0])}" if place["depends_on"] else ""
                out.append(f"In the {column_words(group)} a gap of {place['gap']:.2f} stays{depends}.")
        worse = [(g, w, a) for g, w, a, _ in rows if a > evidence.limit(g) and a > 1.02 * w]
        out += [f"It makes the {column_words(g)} worse ({w:.2f} → {a:.2f})." for g, w, a in worse[:3]]
        closed = closed_by_experiment(evidence, k)
        out += [f"In {name} it closes only {percent(max(part, 0.0))} of the excess." for name, part in closed.items() if part <= 0.5]
        away = _moved(cause, evidence.recording.cell)
        if away is not None and away < 3:
            out.append(f"Its size is only {away:.1f} standard deviations from none.")
    if not out:
        out.append("Nothing was found against it: no column gets worse, and nothing structured stays in those it explains."
                   if evidence else "Nothing in the file speaks against it.")
    return out
