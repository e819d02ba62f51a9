"""What `kr5 gap diagnose` and `kr5 gap measure` print for people."""

from pathlib import Path
from typing import Any

from rich.markup import escape

from kr5_tools.cli import tables
from kr5_tools.cli.numbers import format_number

WORDS = {
    "no_gap": ("green", "the nominal cell explains what the recording can show"),
    "explained": ("green", "with the causes below, no structure remains"),
    "partly_explained": ("yellow", "causes were found, but a structured gap remains"),
    "unknown": ("red", "no effect of the catalogue explains the gap above the floor"),
}


def print_diagnosis(found: Any, to: Any) -> None:
    """The diagnosis for people."""
    word = str(found.verdict)
    colour, text = WORDS[word]
    to.print(f"[bold {colour}]{word}[/]: {text}.", soft_wrap=True, markup=True)
    for limit in found.scope:
        to.print(f"[yellow]limit:[/yellow] {escape(limit)}.", soft_wrap=True, markup=True)
    for warning in found.warnings:
        to.print(f"[yellow]note:[/yellow] {escape(warning)}.", soft_wrap=True, markup=True)
    if found.scatter:
        to.print(
            f"Masses and torque constants are uncertain by about {100 * found.scatter:.1f} %,"
            " friction by twice as much; this is not a cause."
        )
    if found.where:
        to.print(_places("Where", found.where[:12], True))
    for cause in found.causes:
        to.print(_cause(cause), soft_wrap=True, markup=True)
    if found.reduction.columns:
        reduction = found.reduction
        low, high = reduction.after_ci.low, reduction.after_ci.high
        to.print(
            f"The gap falls from {reduction.before:.2f} to {reduction.after:.2f} ({low:.2f} to {high:.2f})"
            " times the noise, over the columns above the floor, on experiments not used for the fit.",
            soft_wrap=True,
        )
    if found.unexplained:
        to.print(_places("Remaining structure", found.unexplained[:12], False))
    if found.next_experiment.separates:
        to.print(
            f"To distinguish {', '.join(found.next_experiment.separates)}: {found.next_experiment.to_dict()['do']}.",
            soft_wrap=True,
        )


def _places(title: str, places: Any, share: bool) -> Any:
    rows = [
        [
            f"{p.experiment}.{p.column}",
            p.target,
            p.gap,
            *([p.share] if share else []),
            "; ".join(f"{d.variable}: {d.how}" for d in p.depends_on[:2]),
        ]
        for p in places
    ]
    out = tables.make_table(
        title, ["column", "target", "gap [-]", *(["share [-]"] if share else []), "depends on"], rows
    )
    for column in (1, -1):
        out.columns[column].justify = "left"
    return out


def _cause(cause: Any) -> str:
    values = []
    for p in cause.parameters:
        if len(p.value) == 16:
            values.append(f"{p.name} shifted, ± {max(p.std[:3]):.2g} m, ± {max(p.std[3:]):.2g} rad")
            continue
        numbers = ", ".join(
            f"{format_number(v, s)} ± {format_number(s, s)}" if s else f"{v:g}" for v, s in zip(p.value, p.std)
        )
        values.append(f"{p.name} {numbers} {p.unit}")
    tied = "".join(f"; not distinguishable from {t.effect} on {t.target}" for t in cause.tied_with)
    return (
        f"[bold]{cause.effect}[/bold] on {cause.target}, probability {cause.probability:.2f}: "
        f"{escape('; '.join(values))}; explains {100 * cause.explained_fraction:.0f} % of the"
        f" excess not explained by the other causes{tied}."
    )


def print_measure(folder: Path, found: Any, to: Any) -> None:
    """The gap of every column, and where it is, for people."""
    for refused in found.refused:
        to.print(f"[yellow]note:[/yellow] {escape(refused)}.", soft_wrap=True, markup=True)
    to.print(measure_table(folder, found))
    to.print(parts_table(found))
    to.print(
        f"RMS gap {found.gap:.3f} over {len(found.columns)} columns, {found.exceeding}"
        " of them above the limit of noise."
    )


def parts_table(found: Any) -> Any:
    """Where the gap is: by subsystem, target, channel, experiment, pose region and speed."""
    rows, before = [], ""
    for part in found.parts:
        rows.append(
            [
                "" if part.by == before else part.by,
                part.name,
                part.columns,
                part.exceeding,
                f"{part.gap:.3f}",
                f"{100 * part.share:.1f}" if part.share > 0 else "–",
            ]
        )
        before = part.by
    return tables.make_table(
        "Where", ["by", "name", "columns", "above limit", "RMS gap [-]", "share of excess [%]"], rows, text=(1, 2)
    )


def measure_table(folder: Path, found: Any) -> Any:
    rows = [
        [
            f"{c.experiment}.{c.column}",
            str(c.split),
            c.rows,
            f"{c.gap:.3f}",
            f"{c.limit:.3f}",
            f"{c.rms:.3g}",
            f"{c.noise:.3g}",
            c.unit,
            "exceeds" if c.exceeds else "",
        ]
        for c in found.columns
    ]
    heads = ["column", "split", "rows", "gap [-]", "limit [-]", "rms", "noise", "unit", ""]
    table = tables.make_table(f"Gap of {folder}", heads, rows, text=(1, 7, 8))
    for column in table.columns:
        column.no_wrap = True
    return table
