"""`--columns`: the columns of a table in their order, such as `t,q{1-6},qd{1-6} [deg/s],_,...`."""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import kr5

LEFT_OUT = "_"  # a column that is not used
REST = ("...", "…")  # and all that follow
RANGE = re.compile(r"\{(\d+)-(\d+)\}")
PARTS = re.compile(r",(?![^\[\](){}]*[\])}])")  # commas outside brackets
MOST = 10_000  # columns


@dataclass(frozen=True)
class NamedColumn:
    """A name as `--columns` gives it; a minus before it turns the sign."""

    name: str
    sign: float = 1.0


def parse_columns(text: str) -> list[NamedColumn]:
    """The columns that a text names; `q{1-6}` is q1 to q6."""
    out: list[NamedColumn] = []
    for part in (p.strip() for p in PARTS.split(text)):
        bare = part.removeprefix("-").strip()
        if not bare:
            raise kr5.InvalidArgument(
                f"--columns: found {text!r:.80}, expected names with commas, such as t,q{{1-6}},tau{{1-6}}"
            )
        out += [NamedColumn(name, -1.0 if part.startswith("-") else 1.0) for name in _expanded(bare)]
    if len(out) > MOST:
        raise kr5.InvalidArgument(f"--columns: found {len(out)} names, expected at most {MOST}")
    return out


def names_in_order(text: str) -> list[str]:
    """The names alone, for a reader of logs; signs are an entry of its map."""
    columns = parse_columns(text)
    if turned := next((c for c in columns if c.sign < 0), None):
        family = turned.name.rstrip("0123456789[]_ ") or turned.name
        raise kr5.InvalidArgument(
            f"--columns: found -{turned.name}; the sign of a quantity of a log is turned by its scale: -1 in the map,"
            f" or --set columns.{family}.scale=-1"
        )
    return [column.name for column in columns]


def header_entry(text: str) -> str:
    """The same as an entry of a map, as --set takes it."""
    return f"header={json.dumps(names_in_order(text))}"


def _expanded(name: str) -> list[str]:
    match = RANGE.search(name)
    if match is None:
        return [name]
    first, last = int(match[1]), int(match[2])
    if not first <= last < first + MOST:
        raise kr5.InvalidArgument(f"--columns: found {match[0]}, expected a range that counts up, such as {{1-6}}")
    return [name[: match.start()] + str(k) + name[match.end() :] for k in range(first, last + 1)]


def fitted_names(names: Sequence[str], own: Sequence[str], width: int, file: Path) -> list[str]:
    """Names of all columns of a table: its own where those that are given are among them, else the given ones, one a
    column; those that are left out are numbered."""
    named = [n for n in names if n != LEFT_OUT and n not in REST]
    if own and set(named) <= set(own):
        return list(own)
    open_end = bool(names) and names[-1] in REST
    count = len(names) - open_end
    if count != width and not (open_end and count < width):
        there = f" ({', '.join(own[:12])}{' …' if len(own) > 12 else ''})" if own else ""
        raise kr5.InvalidArgument(
            f"{file}: found {width} columns{there}, expected the {count} that are named; name each column in its order,"
            f" one that is not used {LEFT_OUT}, and all after the last ..."
        )
    twice = sorted({n for n in named if named.count(n) > 1})
    if twice:
        raise kr5.InvalidArgument(f"--columns: found '{twice[0]}' twice, expected a unique name for each column")
    given = [*names[:count], *([LEFT_OUT] * (width - count))]
    return [f"{LEFT_OUT}{k + 1}" if name == LEFT_OUT else name for k, name in enumerate(given)]
