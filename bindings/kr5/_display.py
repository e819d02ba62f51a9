"""How results look at the prompt, made from the fields of a class and what is said of them.

The extensions call `as_text` for every class that has no repr of its own.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

names_only = False  # while an extension makes the signatures of its functions, in which defaults stand by name

WIDTH = 100
SMALL_ARRAY = 16  # numbers that are shown one by one
FEW = 4  # structs of a list that are shown one by one


@dataclass(frozen=True)
class Field:
    """One field of an object, with what its documentation says."""

    name: str
    value: Any
    doc: str

    @property
    def unit(self) -> str:
        """Empty for a plain number."""
        from ._kr5 import _unit_of  # which imports this module

        return str(_unit_of(self.doc))

    @property
    def text(self) -> str:
        """The documentation without the unit."""
        from ._kr5 import _without_unit

        return str(_without_unit(self.doc))


def fields_of(item: object) -> list[Field]:
    """The fields of a struct in their order; of any other class its properties."""
    named = {
        name: member
        for owner in reversed(type(item).__mro__)
        for name, member in vars(owner).items()
        if isinstance(member, property)
    }
    if is_struct(item):  # what may only be read follows from the fields
        named = {name: member for name, member in named.items() if member.fset is not None}
    return [Field(name, getattr(item, name), member.__doc__ or "") for name, member in named.items()]


def is_struct(item: object) -> bool:
    return hasattr(type(item), "to_dict") and hasattr(type(item), "fields")


def is_shown_by_fields(item: object) -> bool:
    return hasattr(type(item), "_repr_html_") and type(item).__module__.startswith("kr5.")


def as_text(item: object) -> str:
    """`Name(field=value, ...)`: on one line where it fits, in filled lines where every field is short, else a line a
    field."""
    name = type(item).__name__
    if names_only:
        return f"{name}()"
    parts = [f"{f.name}={value_text(f.value, depth=0)}" for f in fields_of(item)]
    line = f"{name}({', '.join(parts)})"
    if len(line) <= WIDTH and "\n" not in line:
        return line
    if all(len(p) <= WIDTH // 3 and "\n" not in p for p in parts):
        return textwrap.fill(
            line, WIDTH, subsequent_indent=" " * (len(name) + 1), break_long_words=False, break_on_hyphens=False
        )
    return f"{name}(\n" + "".join(f"  {_indented(p)},\n" for p in parts) + ")"


def _indented(part: str) -> str:
    """The lines of an array or a filled struct one below the other, those of a long struct two columns in."""
    first = part.split("\n", 1)[0]
    column = 2 if first.endswith("(") else 2 + len(first.split("=", 1)[0]) + 1
    return part.replace("\n", "\n" + " " * column)


def value_text(value: object, depth: int) -> str:
    if isinstance(value, np.ndarray):
        return array_text(value)
    if isinstance(value, str):
        return shortened(value, 4 * WIDTH)
    if isinstance(value, dict):
        items = [f"{k!r}: {value_text(v, depth + 1)}" for k, v in list(value.items())[:FEW]]
        return "{" + ", ".join([*items, *([f"{len(value)} in all"] if len(value) > FEW else [])]) + "}"
    if isinstance(value, list | tuple):
        return _list_text(value, depth)
    if is_shown_by_fields(value):
        if depth == 0:
            return as_text(value)
        return f"{type(value).__name__}({', '.join(short_fields(value))})"
    return scalar_text(value)


def short_fields(item: object, texts: bool = True) -> Iterable[str]:
    """The fields that say something in a word or a number; without texts, the numbers."""
    for f in fields_of(item):
        if not texts and not isinstance(f.value, int | float):
            continue
        if isinstance(f.value, bool | int | float | str) or is_enumeration(f.value):
            if f.value != "":
                yield f"{f.name}={shortened(f.value, WIDTH // 2) if isinstance(f.value, str) else scalar_text(f.value)}"
        elif is_struct(f.value) or f.value is None:
            continue
        elif (isinstance(f.value, list | tuple | dict) and f.value) or isinstance(f.value, np.ndarray):
            text = value_text(f.value, depth=1)
            yield f"{f.name}={text if len(text) <= WIDTH and chr(10) not in text else '…'}"


def _list_text(values: Sequence[object], depth: int) -> str:
    if not values:
        return "[]"
    kind = type(values[0])
    if isinstance(values[0], bool | int | float | str) or is_enumeration(values[0]):
        texts = [scalar_text(v) for v in values]
        if len(texts) > 2 * FEW:
            texts = [*texts[:FEW], "…", texts[-1]]
        return f"[{', '.join(texts)}]" + (f" ({len(values)} in all)" if len(values) > 2 * FEW else "")
    if len(values) > FEW or depth > 0 or isinstance(values[0], list | tuple | np.ndarray):
        return f"[{len(values)} x {'array' if kind is np.ndarray else kind.__name__}]"
    return "[" + ",\n ".join(value_text(v, depth + 1) for v in values) + "]"


def is_enumeration(value: object) -> bool:
    return hasattr(type(value), "__members__")


def shortened(text: str, length: int) -> str:
    return repr(text) if len(text) <= length else repr(text[:length].rstrip() + " …")


def scalar_text(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if is_enumeration(value):
        return repr(str(value))
    return repr(value)


def array_text(array: np.ndarray) -> str:
    """The numbers of a small array, aligned; of a large one the shape and its corners."""
    if array.size > SMALL_ARRAY:
        shape = " x ".join(map(str, array.shape)) if array.ndim > 1 else str(array.size)
        return f"array {shape}: {_rows_text(array, edge=2)}".replace("\n", "")
    return _rows_text(array)


def _rows_text(array: np.ndarray, edge: int | None = None) -> str:
    if array.dtype.kind not in "fiu":
        return repr(array.tolist())
    largest = np.max(np.abs(array), initial=0.0, where=np.isfinite(array))
    near_zero = 1e-12 * largest  # what is left of a zero by rounding
    texts = np.array([f"{0.0 if abs(v) < near_zero else v:.5g}" for v in array.ravel()] or [""]).reshape(
        array.shape if array.size else (1,)
    )

    def cut(items: list[str], between: str) -> list[str]:
        return items if edge is None or len(items) <= 2 * edge else [*items[:edge], between, *items[-edge:]]

    if texts.ndim < 2:
        return f"[{', '.join(cut(list(np.atleast_1d(texts)), '…'))}]"
    width = 0 if edge else max(map(len, texts.ravel()))
    rows = [f"[{', '.join(cut([t.rjust(width) for t in row], '…'))}]" for row in texts.reshape(len(texts), -1)]
    return f"[{(', ' if edge else ',' + chr(10) + ' ').join(cut(rows, '…'))}]"
