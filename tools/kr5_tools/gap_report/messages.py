"""A diagnosis in sentences: names of columns, parts and variables, and the verdict."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from kr5.models.kinds import ENDINGS, NAMES
from kr5.models.writing import lost_effects

from kr5_tools.cli.numbers import format_number, format_percent, text_unit
from kr5_tools.gap_report.clock_faults import clock_faults

NOTICEABLE = 1.25  # times the noise, from which a gap is told although no cause need be found
NEAR_NOISE = 2.0  # times the noise, up to which a gap is that of noise and small errors
KINDS = {
    "motion": "free motion",
    "poses": "measured poses",
    "views": "views of the board",
    "scan": "scans",
    "step": "steps",
    "press": "presses on the bench",
    "profile": "rolls of the peg on the tube",
}
# Variables that a diagnosis derives from columns, in words; {} is the number of a joint. Others are columns.
DERIVED = (
    (r"\|qd(\d+)\|", "speed of joint {}"),
    (r"qdd(\d+)", "acceleration of joint {}"),
    (r"qd(\d+)", "velocity of joint {}"),
    (r"zcd()", "commanded vertical speed"),
)
GEOMETRY = "everything that depends on where the tool is"  # how the row of an effect begins that moves the tool
MOST_NAMED = 3  # causes in a sentence
PREDICTED = "predicted "  # before the name of a column
PARTS = {
    "sensor": "force sensor",
    "tool": "tool",
    "camera": "camera",
    "laser": "scanner",
    "servo": "path correction",
    "contact": "contact with the bench",
    "tube": "peg on the tube",
}


def find_column(group: str) -> Any:
    """The column of a group such as `motion.i3`, as kr5.cell.Column; None for one that no kind has."""
    import kr5
    import kr5.cell

    kind, _, column = group.partition(".")
    try:
        return kr5.cell.find_column(kr5.cell.Kind(kind), column)
    except (kr5.Error, ValueError):
        return None


def column_text(group: str) -> str:
    """`motion.i3` is the current of joint 3."""
    column = find_column(group)
    return column.label if column else group


def effect_row(effect: str) -> Any:
    """The row of the catalogue; None for an effect that it does not name."""
    import kr5
    import kr5.cell

    try:
        return kr5.cell.find_effect(effect)
    except kr5.Error:
        return None


def moves_tool(effect: str) -> bool:
    """Whether an effect of the catalogue changes where the tool is."""
    row = effect_row(effect)
    return row is not None and str(row.shows_in).startswith(GEOMETRY)


def variable_text(name: str, kind: str | None = None) -> str:
    """A variable that a residual depends on: a column of this kind of experiment, or one derived from columns."""
    if name.startswith(PREDICTED):
        return f"simulated {variable_text(name.removeprefix(PREDICTED), kind)}"
    for pattern, words in DERIVED:
        if found := re.fullmatch(pattern, name):
            return words.format(found[1])
    columns = (find_column(f"{k}.{name}") for k in ((kind,) if kind else KINDS))
    return next((column.label for column in columns if column), name)


def part_of(group: str) -> str:
    """What of the cell a column belongs to: joint1..., or a key of PARTS."""
    column = find_column(group)
    if column is None:
        return group
    return "sensor" if wrench_component(column.target) else column.target


def part_text(part: str) -> str:
    return PARTS.get(part) or re.sub(r"(\d+)$", r" \1", part)


def wrench_component(target: str) -> Any:
    """The column of an effect's target that is a component of the wrench; None for any other target."""
    column = find_column(f"motion.{target}")
    return column if column and column.group == "wrench" else None


def target_text(target: str) -> str:
    """What an effect sits on."""
    if component := wrench_component(target):
        return str(component.label.partition(" at ")[0])
    return {"force_torque": "force sensor", "servo": "path correction", "laser": "scanner"}.get(target) or re.sub(
        r"(\d+)$", r" \1", target
    )


def effect_text(effect: str, target: str) -> str:
    """An effect on its target, such as Stribeck friction of joint 3."""
    row = effect_row(effect)
    name = row.label if row else effect.replace("_", " ")
    return (
        name
        if target_text(target) in name or target in ("drives", "links", "base", "servo")
        else (
            f"{name} of {target_text(target)}"
            if target.startswith(("joint", "motor"))
            else f"{name} ({target_text(target)})"
        )
    )


def effects_text(effect: str, targets: list[str]) -> str:
    """An effect on several targets, such as viscous friction of joints 1, 2 and 3."""
    numbered = [re.fullmatch(r"(joint|motor)(\d+)", target) for target in targets]
    words = {found[1] for found in numbered if found}
    one = effect_text(effect, targets[0])
    if len(targets) > 1 and all(numbered) and len(words) == 1 and one.endswith(f" of {target_text(targets[0])}"):
        name = one.removesuffix(target_text(targets[0]))
        return f"{name}{words.pop()}s {join_list([found[2] for found in numbered if found])}"
    return join_list([effect_text(effect, target) for target in targets])


def dependence_text(dependence: dict[str, Any], kind: str | None = None) -> str:
    """A dependence in a kind of experiment as the end of `the gap ...`."""
    name, how = variable_text(dependence["variable"], kind), dependence["how"].replace(" rad or m", " rad")
    if m := re.fullmatch(r"(\w+) of (\w+) differs with it", how):
        where = f"with the {name}" if name else "between columns or experiments"
        return f"suggests that {effect_text(m[1], m[2])} differs {where}"
    turn = ""
    if m := re.match(r"changes sign with (\w+), ", how):
        turn, how = "changes sign with the direction of motion", how[m.end() :]
        if how == "constant offset":
            return f"{turn}, and is of the same size at any {name}"
        turn += " and "
    if how == "constant offset":
        return f"{turn}is a constant offset"
    if how.startswith("drifts slowly"):
        return f"{turn}drifts slowly"
    if how.startswith("oscillates"):
        return f"{turn}{how}"
    if m := re.match(r"(below|above|between) ", how):
        return f"{turn}is largest where the {name} is {how}"
    return f"{turn}{how.replace('with it', f'with the {name}')}"


def capitalised(text: str) -> str:
    return text[:1].upper() + text[1:]


def _sentence(text: str) -> str:
    """A text with a capital letter, unless it begins with the name of a column or an experiment."""
    first = text.split(maxsplit=1)[0] if text else ""
    return text if "." in first or first.endswith(":") else capitalised(text)


def join_list(items: list[str], last: str = "and") -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} {last} {items[-1]}" if items else ""


def join_first(items: list[str], last: str = "and") -> str:
    """A list of which a sentence names the first three."""
    left = len(items) - MOST_NAMED
    return join_list([*items[:MOST_NAMED], f"{left} more, below"] if left > 0 else items, last)


def display_unit(unit: str, values: list[float], target: str) -> tuple[float, str]:
    """Factor and unit for people; long times stay in seconds. `N or N.m`, `N/s or N m/s`: of a force or a torque, as
    the target says; a factor between both has no unit."""
    if " or " in unit and (component := wrench_component(target)):
        names = (component.unit, f"{component.unit}/s")
        unit = next((u for u in unit.split(" or ") if u.replace(".", " ") in names), "-")
    return text_unit(unit, max(map(abs, values), default=0.0))


def value_text(parameter: dict[str, Any], target: str) -> str:
    """Value with uncertainty and unit; a pose only says that it is one."""
    value = parameter["value"]
    values, std = (value, parameter["std"]) if isinstance(value, list) else ([value], parameter["std"])
    std = std if isinstance(std, list) else [std]
    if values and isinstance(values[0], list):
        return f"± {format_number(1e3 * max(std[:3]))} mm, ± {format_number(57.3 * max(std[3:]))} °"
    factor, unit = display_unit(parameter["unit"], values, target)
    texts = [format_number(factor * v, factor * s) if s else f"{factor * v:.6g}" for v, s in zip(values, std)]
    errors = [f" ± {format_number(factor * s, factor * s)}" if s else "" for s in std]
    if len(set(errors)) > 1:
        texts = [text + error for text, error in zip(texts, errors)]
    return ", ".join(texts) + (errors[0] if len(set(errors)) == 1 else "") + (f" {unit}" if unit else "")


def joint_name(named: dict[str, Any]) -> str:
    """The model's name of the joint that an effect sits on, where that says more than its number; else nothing."""
    name = named.get("joint") or ""
    own = re.fullmatch(r"(?:joint|a)?[_ ]?(\d+)", name.lower())
    number = re.search(r"\d+$", named.get("target") or named.get("column") or "")
    return "" if own and number and int(own[1]) == int(number[0]) else name


def cause_text(cause: dict[str, Any]) -> str:
    """Cause with its first value, as in the verdict."""
    name = effect_text(cause["effect"], cause["target"])
    known = [
        p for p in cause["parameters"].values() if np.any(p["std"])
    ]  # a choice, as the number of cycles, has no uncertainty
    first = next(iter(known), None)
    pose = first and isinstance(first["value"], list) and isinstance(first["value"][0], list)
    value = f"{value_text(first, cause['target'])}, " if first and not pose else ""
    joint = joint_name(cause)
    return f"{name} ({f'{joint}; ' if joint else ''}{value}{format_percent(cause['probability'])} probable)"


def main_places(where: list[dict[str, Any]]) -> list[tuple[float, str]]:
    """Share of the excess and where, by kind and part, largest first: a column where one holds most of it."""
    wrench = {p["column"] for p in where if part_of(f"{p['experiment']}.{p['column']}") == "sensor"}
    kinds = [p["experiment"] for p in where if p["column"] in wrench]
    if len(wrench) == 1 and len(kinds) == len(where) > 1:  # one component, wherever it is recorded
        return [
            (
                sum(p["share"] for p in where),
                f"the {column_text(f'motion.{next(iter(wrench))}')}, in {join_list([KINDS.get(k, k) for k in kinds])}",
            )
        ]
    shares: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for place in where:
        group = f"{place['experiment']}.{place['column']}"
        shares.setdefault((place["experiment"], part_of(group)), []).append(place)
    out = []
    for (kind, part), places in shares.items():
        total = sum(p["share"] for p in places)
        top = max(places, key=lambda p: p["share"])
        columns = join_list([f"{p['column']}" for p in places])
        one = top["share"] > 0.75 * total
        text = (
            column_text(f"{kind}.{top['column']}")
            if one
            else f"{part_text(part)} in {KINDS.get(kind, kind)} ({columns})"
        )
        out.append((total, f"the {text}"))
    return sorted(out, key=lambda row: -row[0])


def location_text(where: list[dict[str, Any]]) -> str:
    """`82 % of its excess sits in the current of joint 3`, with what it depends on."""
    places = main_places(where)
    said: list[str] = []
    held = 0.0
    for share, text in places[:3]:
        said.append(f"{format_percent(share)} {'of its excess sits ' if not said else ''}in {text}")
        held += share
        if held > 0.8:
            break
    depends = [d for d in where[0]["depends_on"] if "about the same" not in d["how"] or "changes sign" in d["how"]]
    tail = f"; it {dependence_text(depends[0], where[0]['experiment'])}" if depends and len(said) == 1 else ""
    return join_list(said) + tail


def scope_text(data: dict[str, Any]) -> str:
    """What the recording cannot show, as sentences; empty where it has no such limit."""
    return " ".join(f"{capitalised(limit)}." for limit in data.get("scope", []))


def verdict_text(data: dict[str, Any]) -> str:
    """The diagnosis in plain sentences, for one who did not run it, with the limits within which it holds."""
    scope = scope_text(data)
    return f"{_agreement_text(data, bool(scope))} {scope}".strip()


def _agreement_text(data: dict[str, Any], limited: bool) -> str:
    where, causes, shrink = data["where"], data["causes"], data["shrink"]
    excused = any("the error of the best model" in warning for warning in data.get("warnings", []))
    if data["verdict"] == "no_gap" and excused and shrink.get("before", 1.0) > NOTICEABLE:
        return (
            f"Simulation and recording agree within {shrink['before']:.1f} times the noise, which the best model of the"
            " arm leaves, too."
        )
    if data["verdict"] == "no_gap" or not where:
        if limited:
            return (
                "Within what the recording can show there is no gap: simulation and recording agree within noise. The"
                " rest of the cell was not tested."
            )
        return "There is no gap: simulation and recording agree within noise. No correction is needed."
    said = [
        *(f"{capitalised(fault.text)}." for fault in clock_faults(data.get("warnings", []))),
        f"The gap is {shrink['before']:{'.1f' if shrink['before'] >= 10 else '.2f'}} times the noise in the"
        f" {'columns' if len(where) > 1 else 'column'} above the limit; {location_text(where)}.",
    ]
    if not causes:
        late = ", with these times as they are" if len(said) > 1 else ""
        return " ".join([*said, f"No effect of the catalogue explains it{late}, so no cause is named."])
    ties = sorted({effect_text(t["effect"], t["target"]) for c in causes for t in c["tied_with"]})
    said.append(
        f"{'Causes' if len(causes) > 1 else 'Cause'}: {join_first([cause_text(c) for c in causes])}"
        + (f", which this recording cannot distinguish from {join_first(ties, 'or')}" if ties else "")
        + "."
    )
    said.append(
        f"With {'them' if len(causes) > 1 else 'it'} the gap falls to {shrink['after']:.2f} on experiments not used to"
        " fit; "
        + (
            _left_text(shrink["after"])
            if data["verdict"] == "explained"
            else f"structure remains in the residuals of {_rest(data)}{_pattern(data)}."
        )
    )
    return " ".join(said)


def _left_text(after: float) -> str:
    if after < NEAR_NOISE:
        return "no structure is left in the residuals."
    return "what is left is within the accuracy of a simulation."


def _rest(data: dict[str, Any]) -> str:
    places = [column_text(f"{p['experiment']}.{p['column']}") for p in data["unexplained"]]
    more = f" and {len(places) - 3} more columns" if len(places) > 3 else ""
    return "the " + (join_list(places) if not more else ", ".join(places[:3]) + more)


def _pattern(data: dict[str, Any]) -> str:
    """What the residual of the only column left does, or of the one that is most off."""
    top = data["unexplained"][0]
    if not top["depends_on"]:
        return ""
    which = "it" if len(data["unexplained"]) == 1 else "the first of them"
    return f"; {which} {dependence_text(top['depends_on'][0], top['experiment'])}"


def next_steps(data: dict[str, Any], source: str, model: str | None = None, cell: Any = None) -> list[str]:
    """What to do now, in order. `source`: what was diagnosed, as a command takes it; `model`: file of the model that
    was given beside it; `cell`: the cell with the causes, which tells what of them such a model can hold."""
    steps = []
    if data["verdict"] == "no_gap" or not data["where"]:
        if data.get("scope"):
            return [
                "Record what this recording cannot show, before the cell is trusted there: `kr5 record --help` lists"
                " the kinds of experiments.",
                "For what it shows, use the cell as it is.",
            ]
        return ["Use the cell as it is. Record again after a repair, a crash or a change of tool."]
    of_logs = "logs" in data.get("input", {})
    steps += [fault.remedy(source, of_logs) for fault in clock_faults(data.get("warnings", []))]
    ties, do = [t for c in data["causes"] for t in c["tied_with"]], data["next_experiment"]["do"]
    if ties and do:
        steps.append(
            "To distinguish"
            f" {join_list([effect_text(*n.split(' ', 1)) for n in data['next_experiment']['separates']])}:"
            f" {_plan_text(data, source, of_logs) if do.startswith('kr5 gap plan') else do}."
        )
    elif do:
        steps.append(capitalised(f"{do}."))
    steps += _geometry_from_loads(data) + _remedies(data["causes"])
    if data["causes"]:
        steps.append(_simulation_step(data["causes"], source, model, cell))
    if data["unexplained"]:
        top = data["unexplained"][0]
        column = column_text(f"{top['experiment']}.{top['column']}")
        depends = f": its gap {dependence_text(top['depends_on'][0], top['experiment'])}" if top["depends_on"] else ""
        steps.append(
            f"{'Then' if steps else 'First'} check whether sensor, units and frame of the {column} are as the"
            f" recording states{depends}."
        )
        steps.append(
            "Repeat the recording. A residual that recurs belongs to the cell and can be described by a custom"
            " effect, added from Python; one that does not recur belonged to this recording."
        )
    return steps


def _geometry_from_loads(data: dict[str, Any]) -> list[str]:
    """A doubt in lengths and angles of the arm that were found where no pose was measured."""
    motion_only = any("motion only" in limit for limit in data.get("scope", []))
    named = [effect_text(c["effect"], c["target"]) for c in data["causes"] if motion_only and moves_tool(c["effect"])]
    if not named:
        return []
    return [
        f"{capitalised(join_list(named))}: found from loads alone, in which a wrong mass or centre of mass of a link"
        " looks much the same. Check the masses of the model, or measure poses, before it goes into the model."
    ]


def _plan_text(data: dict[str, Any], source: str, of_logs: bool) -> str:
    """The command that finds the experiment, where the diagnosis knows none."""
    names = ",".join(":".join(n.split(" ", 1)) for n in data["next_experiment"]["separates"])
    first = f"`kr5 gap diagnose {source} --write-recording made`, then " if of_logs else ""
    return f"{first}`kr5 gap plan {'made' if of_logs else source} --separate {names} -o next.yaml`"


def _remedies(causes: list[dict[str, Any]]) -> list[str]:
    """What to do about each effect, once for all its targets."""
    targets = _by_effect((cause["effect"], cause["target"]) for cause in causes)
    rows = {effect: effect_row(effect) for effect in targets}
    return [
        f"{capitalised(effects_text(effect, at))}: {rows[effect].remedy}"
        for effect, at in targets.items()
        if rows[effect] and rows[effect].remedy
    ]


def _simulation_step(causes: list[dict[str, Any]], source: str, model: str | None, cell: Any) -> str:
    """How to simulate with the causes: in a model like the given one where that holds them, else in a cell."""
    tuned = f"tuned{_ending(model)}" if model else "tuned.yaml"
    named = list(dict.fromkeys((cause["effect"], cause["target"]) for cause in causes))
    kind = ENDINGS[Path(tuned).suffix]
    lost = [name for name in lost_effects(cell, kind) if name in named] if model and cell else []
    options = [f"--write-{'model' if model else 'cell'} {tuned}"] if len(lost) < len(named) else []
    limit = ""
    if lost:
        tuned = "tuned.yaml"
        options.append(f"--write-cell {tuned}")
        limit = f" {capitalised(NAMES[kind])} cannot hold {_lost_text(lost)}; the cell {tuned} holds every cause."
    return (
        f"To simulate with these causes: `kr5 gap diagnose {source} {' '.join(options)}`.{limit} A gap near 1 on"
        f" another recording, `kr5 gap measure OTHER --{'model' if model else 'cell'} {tuned}`, confirms the result."
    )


def _lost_text(lost: list[tuple[str, str]]) -> str:
    return join_list([effects_text(effect, at) for effect, at in _by_effect(lost).items()], "or")


def _by_effect(names: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
    """The targets of each effect."""
    out: dict[str, list[str]] = {}
    for effect, target in names:
        out.setdefault(effect, []).append(target)
    return out


def _ending(model: str) -> str:
    """Of a new model in the format of this one, as far as its name tells."""
    ending = Path(model).suffix.lower()
    return ending if ending in ENDINGS else ".urdf"


NOISE = (
    "Gaps are given in units of the measured noise. Correct the noise in the cell: a declared value"
    " that is too small makes every recording look bad, and one that is too large hides real gaps."
)
SPIKES = (
    "Single outliers, as from a disturbed signal line, would outweigh thousands of good samples; the"
    " diagnosis leaves them out. If there are many, check cables and logging."
)


def warning_notes(data: dict[str, Any]) -> list[tuple[str, str]]:
    """Each warning of a diagnosis with what it means; those of the noise in one."""
    warnings = data.get("warnings", [])
    noise = [
        m for m in (re.match(r"noise of (\w+(?: in \w+)?) is ([\d.]+ (?:\+-|±) [\d.]+)", w) for w in warnings) if m
    ]
    out = [
        (
            _sentence(f"{w.replace('+-', '±').replace('max_effects: ', '--max-effects ')}."),
            SPIKES if re.search(r"\bspikes?\b", w) else "",
        )
        for w in warnings
        if not w.startswith("noise of") and not clock_faults([w])
    ]
    if noise:
        each = join_list([f"{m[1].replace('_', ' ')} {m[2].replace('+-', '±')}" for m in noise])
        out.append(
            (f"The noise is this many times that of neighbouring rows, and is taken so: {each}.", "")
            if _estimates_noise(data.get("input", {}))
            else (f"The measured noise differs from the declared one by these factors: {each}.", NOISE)
        )
    return out


def _estimates_noise(inputs: dict[str, Any]) -> bool:
    """Whether the model of logs is a description of a robot, which declares no noise."""
    return "logs" in inputs and Path(inputs.get("model", "")).suffix.lower() not in (".yaml", ".yml")
