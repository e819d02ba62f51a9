"""How results look in a notebook: a table of their figures with uncertainty and unit, a verdict and causes first.

The extensions call `as_html` for every class that has no repr of its own.
"""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from dataclasses import field as dataclass_field
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
    spread = _standard_deviations(item, fields)
    judged = any(f.name == "verdict" for f in fields)
    hidden = {"verdict", "text"} if _verdict(item) else set()
    for f in fields:
        if f.name in hidden or f.name in spread.used or (judged and (_is_empty(f.value) or _is_computing_time(f))):
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
    """Whether a value beside a verdict says nothing: none, zero, or a struct of such."""
    if is_struct(value):
        return all(_is_empty(f.value) for f in fields_of(value))
    return value is None or (isinstance(value, str | list | tuple | dict | int | float) and not value)


def _is_computing_time(f: Field) -> bool:
    return f.unit == "s" and f.name.startswith("seconds")


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
    values: dict[str, Any] = dataclass_field(default_factory=dict)  # standard deviation of a field
    poses: dict[str, np.ndarray] = dataclass_field(default_factory=dict)  # covariance of a pose
    parts: dict[str, dict[str, float]] = dataclass_field(default_factory=dict)  # of numbers in a struct
    used: set[str] = dataclass_field(default_factory=set)  # fields that say only that

    def add_covariance(self, f: Field, owners: Sequence[str], named: dict[str, Field]) -> None:
        """What a field says of others: of a pose, of an array, or of as many numbers as it has rows."""
        if not owners or not isinstance(f.value, np.ndarray) or f.value.ndim != 2:
            return
        std = np.sqrt(np.maximum(np.diag(f.value), 0))
        value = named[owners[0]].value if len(owners) == 1 else None
        if isinstance(value, np.ndarray) and value.shape == (4, 4) and f.value.shape == (6, 6):
            self.poses[owners[0]] = f.value
        elif isinstance(value, np.ndarray) and len(std) == value.size:
            self.values[owners[0]] = std.reshape(value.shape)
        elif len(owners) == len(std):
            for owner, number in zip(owners, std):
                whole, _, part = owner.partition(".")
                if part:
                    self.parts.setdefault(whole, {})[part] = number
                else:
                    self.values[whole] = number
        else:
            return
        self.used.add(f.name)


def _standard_deviations(item: object, fields: list[Field]) -> _Spread:
    """Which fields are the uncertainty of which others: by `std` and `NAME_std`, and those that are covariances."""
    named = {f.name: f for f in fields}
    cls: Any = type(item)
    owners = {f["name"]: f["covariance_of"] for f in cls.fields()} if is_struct(item) else {}
    out = _Spread()
    for f in fields:
        owner = "value" if f.name == "std" else f.name.removesuffix("_std")
        if owner != f.name and owner in named:
            out.values[owner] = f.value
            out.used.add(f.name)
        out.add_covariance(f, owners.get(f.name, ()), named)
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
