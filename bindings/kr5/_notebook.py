"""How results look in a notebook: a table of their figures with uncertainty and unit, a verdict and causes first.

The extensions call `as_html` for every class that has no repr of its own.
"""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._display import (
    FEW,
    SMALL_ARRAY,
    Field,
    array_text,
    fields_of,
    is_enumeration,
    is_shown_by_fields,
    is_struct,
    short_fields,
    value_text,
)
from ._pose_figures import xyzrpy_with_std

MOST_ROWS = 12  # of a list
SHORT_TEXT = 40  # letters
ANSWERS = ("causes", "checks", "findings", "parameters", "pegs")  # lists that are not folded there
AXES = ("x", "y", "z", "roll", "pitch", "yaw")


def as_html(item: object) -> str:
    """A table of the fields: value, uncertainty, unit, meaning; a verdict and causes first, without empty fields."""
    cls = type(item)
    doc = (cls.__doc__ or "").split("\n", 1)[0]
    head = f"<p><b>{html.escape(cls.__name__)}</b>: {html.escape(doc)}</p>"
    return f"<div>{head}{_verdict(item)}{_table(item)}</div>"


def _verdict(item: object) -> str:
    fields = {f.name: f.value for f in fields_of(item)}
    if "verdict" in fields:
        text = fields.get("text") or getattr(item, "text", "")  # a field, or sentences made of the fields
        word = str(fields["verdict"]).replace("_", " ")
        return f"<p><b>{html.escape(word)}</b>{': ' + html.escape(text) if text else ''}</p>"
    if (fit := fields.get("fit")) is not None and not fit.usable:
        return f"<p><b>not usable</b>: {html.escape(fit.message)}</p>"
    return ""


COLUMNS = (("field", "left"), ("value", "right"), ("± std", "right"), ("unit", "left"), ("meaning", "left"))


def _table(item: object) -> str:
    fields = fields_of(item)
    rows: list[tuple[str, ...]] = []  # as COLUMNS
    answers: list[str] = []  # that stand below a verdict
    blocks: list[str] = []
    spread = _standard_deviations(fields)
    judged = any(f.name == "verdict" for f in fields)
    hidden = {"verdict", "text"} if _verdict(item) else set()
    for f in fields:
        if f.name in hidden or f.name in spread.used or (judged and _is_empty(f.value)):
            continue
        if f.name in spread.poses:
            rows += _pose_rows(f, spread.poses[f.name])
        elif isinstance(f.value, list | tuple) and f.value and is_shown_by_fields(f.value[0]):
            (answers if judged and f.name in ANSWERS else blocks).append(_list_block(f))
        elif is_shown_by_fields(f.value):
            estimated = spread.parts.get(f.name, {})
            rows += _part_rows(f, estimated)
            figures = "" if estimated else ", ".join(short_fields(f.value, texts=False))
            blocks.append(_folded(f.name, f"{figures} – {f.text}" if figures else f.text, _table(f.value)))
        else:
            std = spread.values.get(f.name)
            rows.append((f.name, _cell(f.value, std), _std_cell(std), f.unit, f.text))
    if not rows:
        return "".join(answers + blocks)
    shown = [k for k, (name, _) in enumerate(COLUMNS) if name in ("field", "value") or any(row[k] for row in rows)]
    table = _rows_table([COLUMNS[k] for k in shown], [[row[k] for k in shown] for row in rows])
    return "".join(answers) + table + "".join(blocks)


def _is_empty(value: object) -> bool:
    return value is None or (isinstance(value, str | list | tuple | dict) and not value)


def _rows_table(columns: Sequence[tuple[str, str]], rows: Iterable[Sequence[str]]) -> str:
    """A table of texts; of a column its name and the side of its texts."""

    def cell(kind: str, text: str, side: str) -> str:
        # What is short stays on a line, what is long is not squeezed into a column of single words.
        width = "white-space:nowrap" if len(text) < SHORT_TEXT else "min-width:14em"
        return f'<{kind} style="text-align:{side};{width}">{html.escape(text)}</{kind}>'

    def line(kind: str, texts: Iterable[str]) -> str:
        return f"<tr>{''.join(cell(kind, text, side) for text, (_, side) in zip(texts, columns))}</tr>"

    body = "".join(line("td", row) for row in rows)
    return f"<table><thead>{line('th', (name for name, _ in columns))}</thead><tbody>{body}</tbody></table>"


@dataclass
class _Spread:
    values: dict[str, Any]  # standard deviation of a field
    poses: dict[str, np.ndarray]  # covariance of a pose
    parts: dict[str, dict[str, float]]  # standard deviations of numbers in a struct
    used: set[str]  # fields that say only that


def _standard_deviations(fields: list[Field]) -> _Spread:
    """Which fields are the uncertainty of which others: by `std` and `NAME_std`, and by what a covariance says of
    itself ("Covariance of NAME", "Its covariance", "Covariance of fx fy cx cy" of a field that has these)."""
    named = {f.name: f for f in fields}
    out = _Spread({}, {}, {}, set())
    for before, f in zip([None, *fields], fields):
        if f.name == "std" and "value" in named:
            out.values["value"] = f.value
            out.used.add(f.name)
        elif f.name.endswith("_std") and f.name.removesuffix("_std") in named:
            out.values[f.name.removesuffix("_std")] = f.value
            out.used.add(f.name)
        elif f.name.startswith("covariance") and isinstance(f.value, np.ndarray) and f.value.ndim == 2:
            std = np.sqrt(np.maximum(np.diag(f.value), 0))
            about = re.match(r"Covariance of (?:the )?`?(\w+(?: \w+)*)", f.doc)
            words = about[1].split() if about else []
            owner = before if f.doc.startswith("Its covariance") else named.get(words[0]) if words else None
            if owner is None:
                part = next((g for g in fields if words and all(hasattr(g.value, word) for word in words)), None)
                if part and len(words) == len(std):
                    out.parts[part.name] = dict(zip(words, std))
                    out.used.add(f.name)
            elif isinstance(owner.value, np.ndarray):
                if owner.value.shape == (4, 4) and f.value.shape == (6, 6):
                    out.poses[owner.name] = f.value
                    out.used.add(f.name)
                elif len(std) == owner.value.size:
                    out.values[owner.name] = std.reshape(owner.value.shape)
                    out.used.add(f.name)
    return out


def _pose_rows(f: Field, covariance: np.ndarray) -> list[tuple[str, ...]]:
    """Position and roll, pitch, yaw of a pose, each with its standard deviation."""
    values, std = xyzrpy_with_std(f.value, covariance)
    return [
        (f"{f.name} {axis}", _cell(v, s), _std_cell(s), unit, f.text if k == 0 else "")
        for k, (axis, v, s, unit) in enumerate(zip(AXES, values, std, ["m"] * 3 + ["rad"] * 3))
    ]


def _part_rows(f: Field, std: dict[str, float]) -> list[tuple[str, ...]]:
    """The numbers of a struct that were estimated."""
    return [
        (f"{f.name}.{g.name}", _cell(g.value, std[g.name]), _std_cell(std[g.name]), g.unit, g.text)
        for g in fields_of(f.value)
        if std.get(g.name)
    ]


def _std_cell(std: npt.ArrayLike | None) -> str:
    """Standard deviations with two digits."""
    if std is None:
        return ""
    return (
        ", ".join(f"{s:#.2g}".rstrip(".") for s in np.ravel(std))
        if np.size(std) <= SMALL_ARRAY
        else array_text(np.asarray(std))
    )


def _cell(value: object, std: npt.ArrayLike | None = None) -> str:
    """A value as a table shows it; with a standard deviation, with its digits."""
    if value is None:
        return ""
    if isinstance(value, list | tuple | dict) and not value:
        return "none"
    if (
        isinstance(value, np.ndarray | list | tuple)
        and std is not None
        and np.size(value) == np.size(std) <= SMALL_ARRAY
    ):
        return ", ".join(_cell(float(v), float(s)) for v, s in zip(np.ravel(value), np.ravel(std)))
    if isinstance(value, list | tuple) and value and isinstance(value[0], int | float):
        return _cell(np.asarray(value, dtype=float))
    if isinstance(value, list | tuple) and all(isinstance(v, str) for v in value):
        return ", ".join(value[: 2 * FEW]) + (f", … ({len(value)} in all)" if len(value) > 2 * FEW else "")
    if isinstance(value, np.ndarray):
        return array_text(value).replace("\n", " ")
    if isinstance(value, float):
        if np.ndim(std) == 0 and std and np.isfinite(std) and np.isfinite(value):
            return f"{value:.{min(max(1 - int(np.floor(np.log10(std))), 0), 12)}f}"
        return f"{value:.4g}"
    if isinstance(value, str) or is_enumeration(value):
        return str(value)
    return value_text(value, depth=1)


def _list_block(f: Field) -> str:
    """A list of structs as a table of what is short in them; open where it is the answer."""
    fields = fields_of(f.value[0])
    columns = [(g.name + (f" [{g.unit}]" if g.unit else ""), "left") for g in fields]
    rows = [[_list_cell(getattr(item, g.name)) for g in fields] for item in f.value[:MOST_ROWS]]
    table = _rows_table(columns, rows)
    if len(f.value) > MOST_ROWS:
        table += f"<p>… {len(f.value) - MOST_ROWS} more</p>"
    return _folded(f"{f.name} ({len(f.value)})", f.text, table, is_open=f.name in ANSWERS)


def _list_cell(value: object) -> str:
    """A value within a row of structs; parameters with their uncertainty."""
    if isinstance(value, list | tuple) and value and is_struct(value[0]):
        if all(hasattr(v, "name") and hasattr(v, "value") for v in value):
            return "; ".join(_parameter_text(v) for v in value)
        return "; ".join(", ".join(short_fields(v)) for v in value[:FEW]) + (" …" if len(value) > FEW else "")
    if isinstance(value, list | tuple):
        return ", ".join(map(_cell, value[: 2 * FEW])) + (f" … ({len(value)})" if len(value) > 2 * FEW else "")
    if is_struct(value):
        return ", ".join(short_fields(value))
    return _cell(value)


def _parameter_text(p: object) -> str:
    std = getattr(p, "std", None)
    text = f"{p.name} {_cell(p.value, std)}"
    if std is not None:
        text += f" ± {_std_cell(std)}"
    return f"{text} {getattr(p, 'unit', '')}".strip()


def _folded(title: str, doc: str, body: str, is_open: bool = False) -> str:
    summary = f"<summary><b>{html.escape(title)}</b> {html.escape(doc)}</summary>"
    return f"<details{' open' if is_open else ''}>{summary}{body}</details>"
