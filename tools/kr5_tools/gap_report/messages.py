"""What to do after a diagnosis: the steps with their commands and files. The sentences about the diagnosis itself are
those of the library."""

import shlex
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import kr5.gap
from kr5.gap import column_text, dependence_text, effect_text, effects_text
from kr5.models.kinds import ENDINGS, NAMES
from kr5.models.writing import lost_effects

from kr5_tools.gap_report.clock_faults import clock_remedy
from kr5_tools.gap_report.diagnosis_file import DiagnosisFile


def find_column(group: str) -> Any:
    """The column of a group such as `motion.i3`, as kr5.cell.Column; None for one that no kind has."""
    kind, _, column = group.partition(".")
    try:
        return kr5.cell.find_column(kr5.cell.Kind(kind), column)
    except (kr5.Error, ValueError):
        return None


def effect_row(effect: str) -> Any:
    """The row of the catalogue; None for an effect that it does not name."""
    try:
        return kr5.cell.find_effect(effect)
    except kr5.Error:
        return None


def moves_tool(effect: str) -> bool:
    """Whether an effect of the catalogue changes where the tool is."""
    row = effect_row(effect)
    return row is not None and bool(row.moves_tool)


def group_of(place: kr5.gap.ColumnExcess) -> str:
    """The column of a place, as `motion.i3`."""
    return f"{place.experiment}.{place.column}"


def capitalised(text: str) -> str:
    return text[:1].upper() + text[1:]


def join_list(items: list[str], last: str = "and") -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} {last} {items[-1]}" if items else ""


def next_steps(
    diagnosis: DiagnosisFile, source: str, model: str | None = None, cell: kr5.cell.Cell | None = None
) -> list[str]:
    """What to do now, in order. `source`: what was diagnosed, as a command takes it; `model`: file of the model that
    was given beside it; `cell`: the cell with the causes, which tells what of them such a model can hold."""
    found = diagnosis.found
    if str(found.verdict) == "no_gap" or not found.where:
        return _steps_without_gap(found)
    steps = [clock_remedy(fault, source, diagnosis.of_logs) for fault in found.clock_faults]
    if experiment := _experiment_step(diagnosis, source):
        steps.append(experiment)
    steps += _geometry_from_loads(found) + _remedies(found.causes)
    if found.causes:
        steps.append(_simulation_step(diagnosis, source, model, cell))
    return steps + _steps_of_rest(found, bool(steps))


def _steps_without_gap(found: kr5.gap.Diagnosis) -> list[str]:
    if found.scope:
        return [
            "Record what this recording cannot show, before the cell is trusted there: `kr5 record --help` lists"
            " the kinds of experiments.",
            "For what it shows, use the cell as it is.",
        ]
    return ["Use the cell as it is. Record again after a repair, a crash or a change of tool."]


def _experiment_step(diagnosis: DiagnosisFile, source: str) -> str:
    """The experiment that distinguishes what is tied; empty where nothing is."""
    found, following = diagnosis.found, diagnosis.found.next_experiment
    if not any(cause.tied_with for cause in found.causes):
        return capitalised(f"{following.text}.") if following.text else ""
    if not following.separates:
        return ""
    names = join_list([effect_text(n.effect, n.target) for n in following.separates])
    text = following.text if following.what else _plan_text(following.separates, source, diagnosis.of_logs)
    return f"To distinguish {names}: {text}."


def _steps_of_rest(found: kr5.gap.Diagnosis, others: bool) -> list[str]:
    """What to do about what stays unexplained."""
    if not found.unexplained:
        return []
    top = found.unexplained[0]
    depends = f": its gap {dependence_text(top.depends_on[0], top.experiment)}" if top.depends_on else ""
    return [
        f"{'Then' if others else 'First'} check whether sensor, units and frame of the {column_text(group_of(top))} are"
        f" as the recording states{depends}.",
        "Repeat the recording. A residual that recurs belongs to the cell and can be described by a custom"
        " effect, added from Python; one that does not recur belonged to this recording.",
    ]


def _geometry_from_loads(found: kr5.gap.Diagnosis) -> list[str]:
    """A doubt in lengths and angles of the arm that were found where no pose was measured."""
    motion_only = any(str(limit.reason) == "one_kind" and str(limit.kind) == "motion" for limit in found.scope)
    named = [effect_text(c.effect, c.target) for c in found.causes if motion_only and moves_tool(c.effect)]
    if not named:
        return []
    return [
        f"{capitalised(join_list(named))}: found from loads alone, in which a wrong mass or centre of mass of a link"
        " looks much the same. Check the masses of the model, or measure poses, before it goes into the model."
    ]


def _plan_text(separates: Iterable[kr5.gap.EffectName], source: str, of_logs: bool) -> str:
    """The command that finds the experiment, where the diagnosis knows none."""
    names = ",".join(f"{name.effect}:{name.target}" for name in separates)
    first = f"`kr5 gap diagnose {source} --write-recording made`, then " if of_logs else ""
    return f"{first}`kr5 gap plan {'made' if of_logs else source} --separate {names} -o next.yaml`"


def _remedies(causes: Iterable[kr5.gap.Cause]) -> list[str]:
    """What to do about each effect, once for all its targets."""
    targets = _by_effect((cause.effect, cause.target) for cause in causes)
    rows = {effect: effect_row(effect) for effect in targets}
    return [
        f"{capitalised(effects_text(effect, at))}: {rows[effect].remedy}"
        for effect, at in targets.items()
        if rows[effect] and rows[effect].remedy
    ]


def _simulation_step(diagnosis: DiagnosisFile, source: str, model: str | None, cell: kr5.cell.Cell | None) -> str:
    """How to simulate with the causes: in a model like the given one where that holds them, else in a cell; what is
    written already is to be checked."""
    written = diagnosis.written
    tuned = written.get("model") or (f"tuned{_ending(model)}" if model else "tuned.yaml")
    named = list(dict.fromkeys((cause.effect, cause.target) for cause in diagnosis.found.causes))
    kind = ENDINGS[Path(tuned).suffix.lower()]
    in_model = "model" in written or bool(model)
    lost = [name for name in lost_effects(cell, kind) if name in named] if in_model and cell else []
    if whole := ("" if lost else written.get("model")) or written.get("cell"):
        return _check_step(whole, bool(model) or whole == written.get("model"))
    options = [f"--write-{'model' if in_model else 'cell'} {tuned}"] if len(lost) < len(named) else []
    limit = ""
    if lost:
        tuned = "tuned.yaml"
        options.append(f"--write-cell {tuned}")
        limit = f" {capitalised(NAMES[kind])} cannot hold {_lost_text(lost)}; the cell {tuned} holds every cause."
    return (
        f"To simulate with these causes: `kr5 gap diagnose {source} {' '.join(options)}`.{limit} A gap near 1 on"
        f" another recording, `{_measure(tuned, bool(model))}`, confirms the result."
    )


def _check_step(file: str, is_model: bool) -> str:
    """What to do with a file that was written with every cause in it."""
    return (
        f"{file} is written with these causes; check it on another recording, `{_measure(file, is_model)}`: a gap near"
        " 1 confirms the result."
    )


def _measure(file: str, is_model: bool) -> str:
    return f"kr5 gap measure OTHER --{'model' if is_model else 'cell'} {shlex.quote(file)}"


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
