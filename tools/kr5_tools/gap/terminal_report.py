"""What `kr5 gap diagnose` and `kr5 gap measure` print for people: the answer first, then what it rests on."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import kr5.cell
import kr5.gap
import numpy as np
from kr5.gap import column_text, dependence_text, display_unit, effect_text, joint_name, notes, value_text
from kr5.logs.compared_source import ComparedSource
from kr5.models.mujoco_check import MujocoCheck
from rich.markup import escape

from kr5_tools.cli import tables
from kr5_tools.cli.numbers import NONE, format_percent, root_mean_square, table_unit
from kr5_tools.cli.terminal import Console
from kr5_tools.gap.source import print_source
from kr5_tools.gap_report.diagnosis_file import DiagnosisFile
from kr5_tools.gap_report.messages import capitalised, group_of, join_list, next_steps
from kr5_tools.gap_report.model_warnings import model_warnings
from kr5_tools.gap_report.mujoco_sentences import check_sentences
from kr5_tools.gap_report.parameter_rows import nominal_value, without_rounding

VERDICTS = {
    "no_gap": ("green", "No gap"),
    "explained": ("green", "Explained"),
    "partly_explained": ("yellow", "Partly explained"),
    "unknown": ("red", "Unknown"),
}
MOST_PLACES = 5  # columns that are listed without --all
LEAST_SHARE = 0.01  # of the excess that such a column holds
MOST_PARTS = 3  # rows for each way to divide the gap, without --all
FURTHER = "--all lists every one"


def print_diagnosis(
    diagnosis: DiagnosisFile,
    source: ComparedSource,
    to: Console,
    everything: bool = False,
    check: MujocoCheck | None = None,
) -> None:
    """A diagnosis for people: the verdict, what MuJoCo says of the model that was written, the
    causes, how its logs were read, where the gap is, what remains, what to do."""
    found = diagnosis.found
    colour, word = VERDICTS[str(found.verdict)]
    to.print(f"[bold {colour}]{word}.[/] {escape(found.text)}", soft_wrap=True, markup=True)
    nominal = source.recording.cell
    model = str(source.model.file) if source.model else None
    for warning in model_warnings(found, nominal, model):
        to.print(f"[yellow]{escape(warning)}[/]", soft_wrap=True, markup=True)
    if check is not None:
        to.print(" ".join(check_sentences(check)), soft_wrap=True)
    causes, names = found.causes, found.joint_names
    _say_list(to, "Causes", [cause_line(cause, names, nominal, len(causes) > 1) for cause in causes])
    print_source(source, to, everything)
    _print_places(found, to, everything)
    _print_remainder(found, to, everything)
    _say_list(to, "Notes", [note_text(note) for note in notes(found, diagnosis.noise_declared)])
    steps = next_steps(diagnosis, source.command, model, found.cell)
    _say_list(to, "Next steps", [step.replace("`", "") for step in steps])


def _say_list(to: Console, title: str, lines: list[str]) -> None:
    if not lines:
        return
    to.print(f"\n{title}", style="bold")
    for line in lines:
        to.print(f"  - {line}", soft_wrap=True)


def note_text(note: kr5.gap.Note) -> str:
    """A note with what it means."""
    return f"{note.text} {note.meaning}".strip()


def effect_id(named: kr5.gap.EffectName) -> str:
    """An effect and its target as `kr5 gap explain` and `kr5 gap plan` take them."""
    return f"{named.effect}:{named.target}"


def known_as(named: kr5.gap.EffectName, joint_names: list[str]) -> str:
    """The joint by the name of the model, and what the commands take."""
    return _with_joint(joint_name(joint_names, named.target), effect_id(named))


def _with_joint(joint: str, text: str) -> str:
    return "; ".join(filter(None, (joint, text)))


def cause_line(
    cause: kr5.gap.Cause, joint_names: list[str], cell: kr5.cell.Cell | None = None, others: bool = False
) -> str:
    """A cause in one line: what and where it is, its size, that of the cell where it states one, and how sure it is.
    `cell`: without the causes; `others`: whether there are more of them."""
    names = len(cause.parameters) > 1
    values = [
        (f"{p.name.replace('_', ' ')} " if names else "") + value_text(p, cause.target) + _stated(cause, p, cell)
        for p in cause.parameters
    ]
    line = (
        f"{capitalised(effect_text(cause.effect, cause.target))} ({known_as(cause, joint_names)}): {', '.join(values)};"
        f" {format_percent(cause.probability)} probable; explains {format_percent(cause.explained_fraction)} of the gap"
        + (" that the others leave" if others else "")
    )
    if cause.tied_with:
        ties = [f"{effect_text(t.effect, t.target)} ({effect_id(t)})" for t in cause.tied_with]
        line += f"; not distinguishable from {join_list(ties, 'or')}"
    return f"{line}."


def _stated(cause: kr5.gap.Cause, parameter: kr5.gap.ParameterEstimate, cell: kr5.cell.Cell | None) -> str:
    """What the cell states of a parameter, where that is a number or three and not 0."""
    before = nominal_value(cell, cause, parameter.name) if cell else None
    if before is None or np.ndim(before) > 1 or not np.any(before):
        return ""
    factor, _ = display_unit(parameter.unit, parameter.value, cause.target)
    return f" instead of {', '.join(f'{factor * x:.4g}' for x in without_rounding(before))}"


def _named(place: kr5.gap.ColumnExcess, joint_names: list[str]) -> str:
    group = group_of(place)
    return f"{column_text(group)} ({_with_joint(joint_name(joint_names, place.target), group)})"


def _depends(place: kr5.gap.ColumnExcess) -> str:
    """What a residual does, in words, each once."""
    texts = [dependence_text(d, place.experiment) for d in place.depends_on[:2]]
    return "; ".join(dict.fromkeys(texts))


def _print_places(found: kr5.gap.Diagnosis, to: Console, everything: bool) -> None:
    where, names = found.where, found.joint_names
    listed = where if everything else [p for p in where[:MOST_PLACES] if p.share >= LEAST_SHARE]
    if not listed:
        return
    with_causes = {c.column: c.after for c in found.reduction.columns} if found.causes else {}
    rows = []
    for place in listed:
        after = with_causes.get(group_of(place))
        rows.append(
            [
                _named(place, names),
                f"{place.gap:.2f}",
                NONE if after is None else f"{after:.2f}",
                share_text(place.share),
                _depends(place) if everything else "",
            ]
        )
    more = f" ({len(listed)} of {len(where)} columns above the limit; {FURTHER})" if len(listed) < len(where) else ""
    heads = ["column", "gap [-]", "after [-]", "share [%]", "pattern of the gap"]
    title = f"Where{', before and after the causes' if found.causes else ''}{more}"
    to.print()
    to.print(tables.make_table(title, heads, rows, text=(4,)))


def share_text(share: float) -> str:
    """A share of the excess in percent, as a number of a table."""
    return "< 0.1" if 0 < share < 0.001 else f"{100 * share:.1f}"


def _print_remainder(found: kr5.gap.Diagnosis, to: Console, everything: bool) -> None:
    """What has no cause: columns, the effects that come nearest, and those that could not be tried."""
    left, names = found.unexplained, found.joint_names
    listed = left if everything else left[:MOST_PLACES]
    if listed:
        rows = [[_named(p, names), f"{p.gap:.2f}", _depends(p)] for p in listed]
        more = f" ({len(listed)} of {len(left)} columns; {FURTHER})" if len(listed) < len(left) else ""
        to.print()
        to.print(
            tables.make_table(f"Not explained{more}", ["column", "gap [-]", "pattern of the gap"], rows, text=(2,))
        )
    if nearest := found.nearest:
        rows = [[f"{effect_text(n.effect, n.target)} ({known_as(n, names)})", f"{n.gap:.2f}", n.text] for n in nearest]
        heads = ["effect", "gap left [-]", "why it is not blamed"]
        to.print()
        to.print(tables.make_table("Nearest effects", heads, rows, text=(2,)))
    _print_untried(found.not_tried, to, everything)


def _print_untried(untried: list[kr5.gap.UntriedEffect], to: Console, everything: bool) -> None:
    if not untried:
        return
    reasons: dict[str, list[str]] = {}
    for effect in untried:
        reasons.setdefault(effect.text, []).append(" ".join([effect.effect, *effect.targets]))
    if everything:
        _say_list(to, "Not tried", [f"{', '.join(names)}: {reason}." for reason, names in reasons.items()])
        return
    to.print(f"\nNot tried: {len(untried)} effects that this cell or recording cannot show; {FURTHER}.", soft_wrap=True)


def print_measure(source: Path, found: kr5.gap.Measure, to: Console, everything: bool = False) -> None:
    """The gap, the columns above their limit, and where they are, for people."""
    within = len(found.columns) - found.exceeding
    above = root_mean_square(c.gap for c in found.columns if c.exceeds)
    over = f"{above:.3f} over the {found.exceeding}" if found.exceeding else "none"
    rest = f"{within} within it{'' if everything or not within else f' ({FURTHER})'}"
    to.print(
        f"RMS gap of {source}: {found.gap:.3f} over {len(found.columns)} columns, {over} above the limit of noise;"
        f" {rest}.",
        style="bold",
        soft_wrap=True,
    )
    for refused in found.refused:
        to.print(f"[yellow]note:[/yellow] {escape(refused)}.", soft_wrap=True, markup=True)
    columns = [c for c in found.columns if everything or c.exceeds]
    if not columns:
        return
    to.print()
    to.print(measure_table(columns, everything))
    to.print()
    to.print(parts_table(found, everything))


def measure_table(columns: Iterable[kr5.gap.ColumnGap], everything: bool = True) -> tables.FittedTable:
    """The gap of each of these columns; where others are among them, those above their limit say so."""
    rows = []
    for c in columns:
        factor, unit = table_unit(c.unit)
        rows.append(
            [
                f"{c.experiment}.{c.column}",
                str(c.split),
                c.rows,
                f"{c.gap:.3f}",
                f"{c.limit:.3f}",
                f"{factor * c.rms:.3g}",
                f"{factor * c.noise:.3g}",
                unit,
                "exceeds" if everything and c.exceeds else "",
            ]
        )
    heads = ["column", "split", "rows", "gap [-]", "limit [-]", "RMS", "noise", "unit", ""]
    return tables.make_table("Columns" if everything else "Columns above the limit", heads, rows, text=(1, 7, 8))


def parts_table(found: kr5.gap.Measure, everything: bool = True) -> tables.FittedTable:
    """Where the gap is: by subsystem, target, channel, experiment, pose region and speed."""
    by: dict[str, list[Any]] = {}
    for part in found.parts:
        if everything or (part.exceeding and len(by.get(part.by, ())) < MOST_PARTS):
            by.setdefault(part.by, []).append(part)
    rows = [
        [
            "" if k else name,
            part.name,
            part.columns,
            part.exceeding,
            f"{part.gap:.3f}",
            f"{100 * part.share:.1f}" if part.share > 0 else NONE,
        ]
        for name, parts in by.items()
        for k, part in enumerate(parts)
    ]
    heads = ["by", "part", "columns", "above limit", "RMS gap [-]", "share of excess [%]"]
    return tables.make_table("Where", heads, rows, text=(1,))
