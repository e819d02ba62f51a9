"""`read_table`: the one reader of tables, logs and lists of poses of all commands.

A file comes from `kr5.logs.log_file`, whatever its format, as columns by name. Here the columns of what a
command needs are found, brought to SI, and checked. Errors and notes say the same in the same words for every command.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import kr5
from kr5.logs.column_list import NamedColumn, parse_columns
from kr5.logs.log import Log
from kr5.logs.log_file import read_log
from kr5.tables.checks import check_finite
from kr5.tables.column_search import ColumnSearch
from kr5.tables.column_units import read_name, unit_of
from kr5.tables.pose_columns import add_poses
from kr5.tables.roles import AnyRole, PointsRole, PoseRole, Role, TextRole, Units
from kr5.tables.table import Table


def read_table(
    source: Path,
    roles: Sequence[AnyRole],
    units: Units | None = None,
    convention: str | None = None,
    *,
    columns: str | None = None,
    given: dict[str, str] | None = None,
    counts: dict[str, int] | None = None,
    episode: int | None = None,
) -> Table:
    """What a command needs of a file in any format of logs (`kr5.logs.ENDINGS`).

    roles: what is needed. units: those that options of the command state; without, they are as the names say, or told
    by the size of the numbers. convention: form of the rotations of poses; without, as the names say. columns: names of
    the columns in their order, see `column_list`. given: by role, names of its columns as an option of the command
    states them. counts: by role, the number of its columns, where the command knows it. episode: which
    recording of a data set that has several.

    Raises kr5.IoError or kr5.InvalidArgument with file, line, column and remedy.
    """
    listed = parse_columns(columns) if columns else []
    log = read_log(source, [c.name for c in listed] or None, unnamed=True, episode=episode)
    units = units or Units()
    search = ColumnSearch(log, roles, given or {}, counts or {}, _in_order(listed, log, roles))
    table = Table(source, 0, log.names(), lines=log.lines)
    if log.form:
        table.notes.append(f"{source.name}: {', '.join(log.form)}")
    table.notes += log.notes
    signs = {c.name: c.sign for c in listed if c.sign < 0}
    chosen = {role.name: names for role in roles if isinstance(role, Role) and (names := search.columns_of(role))}
    rows = _Rows(log, chosen, roles)
    for role in roles:
        if isinstance(role, Role) and role.name in chosen:
            _add_numbers(table, log, role, search, rows, units, signs)
        elif isinstance(role, TextRole):
            _add_words(table, log, role, search)
        elif isinstance(role, PointsRole):
            _add_points(table, log, role, search, units)
        elif isinstance(role, PoseRole):
            add_poses(table, log, role, search, convention, units)
    sizes = [len(v) for part in (table.numbers, table.words, table.pose_rows) for v in part.values()]
    table.rows = sizes[0] if sizes else 0
    table.notes += rows.notes
    return table


def column_names(source: Path, columns: str | None = None) -> list[str]:
    """Names of the columns of a file in small letters, without units."""
    listed = parse_columns(columns) if columns else []
    log = read_log(source, [c.name for c in listed] or None, unnamed=True)
    return [read_name(column).plain for column in log.names()]


def _in_order(listed: list[NamedColumn], log: Log, roles: Sequence[AnyRole]) -> dict[str, str]:
    """Columns by role, where a list names columns of a file in the order of the roles, which have one each."""
    single = [r for r in roles if isinstance(r, Role) and not r.counted and r.name != "run"]
    names = [c.name for c in listed]
    if not listed or len(single) < len([r for r in roles if r.name != "run"]) or not set(names) <= set(log.names()):
        return {}
    if log.renamed:
        return {}
    needed = [r for r in single if r.needed]
    if not len(needed) <= len(names) <= len(single):
        wanted = ",".join(r.name for r in needed) + "".join(f"[,{r.name}]" for r in single if not r.needed)
        raise kr5.InvalidArgument(f"--columns: found {len(names)} names, expected {wanted}")
    return {role.name: name for role, name in zip(single, names, strict=False)}


class _Rows:
    """The rows of the table: those of the stream of its first needed quantity. Columns with other instants, as those
    of another topic, are interpolated at these."""

    def __init__(self, log: Log, chosen: dict[str, list[str]], roles: Sequence[AnyRole]):
        self.log, self.notes = log, list[str]()
        first = next(
            (chosen[r.name][0] for r in roles if r.name in chosen and isinstance(r, Role) and r.quantity != "time"),
            next(iter(chosen.values()), [""])[0],
        )
        self.stream = log.streams.get(first)
        self.count = len(log.columns[first]) if first else 0
        self.first = first

    def values(self, column: str) -> np.ndarray:
        """A column at the rows of the table."""
        own = self.log.columns[column]
        stream = self.log.streams[column]
        if stream == self.stream:
            return own
        clocks = self.log.clocks
        if stream in clocks and self.stream in clocks:
            t, at = self.log.columns[clocks[stream]], self.log.columns[clocks[self.stream]]
            self.notes.append(f"{column} is interpolated at the times of {self.first}")
            return np.asarray(np.interp(at, t, own, left=np.nan, right=np.nan))
        self.log.require_rows(column, self.count, self.first)
        return own


def _add_numbers(
    table: Table, log: Log, role: Role, search: ColumnSearch, rows: _Rows, units: Units, signs: dict[str, float]
) -> None:
    names = search.columns_of(role)
    raw = np.column_stack([rows.values(n) * signs.get(n, 1.0) if n else np.full(rows.count, np.nan) for n in names])
    there = [n for n in names if n]
    check_finite(log, there, raw[:, [bool(n) for n in names]], role.may_lack)
    followed = role.follows in table.units and not any(search.name_of(n).unit for n in there)
    if followed:
        rate = "/s" if "turn rate" in role.quantities else ""
        factor, unit = table.factors[role.follows], table.units[role.follows] + rate
    else:
        factor, unit, notes = unit_of(role, [search.name_of(n) for n in there], raw, units, log.file)
        table.notes += [f"{log.file.name}: {note}" for note in notes]
    values = factor * raw
    table.numbers[role.name] = values if role.counted else values[:, 0]
    table.names[role.name], table.units[role.name], table.factors[role.name] = names, unit, factor


def _add_points(table: Table, log: Log, role: PointsRole, search: ColumnSearch, units: Units) -> None:
    names = search.columns_of_points(role, needed=role.needed and role.instead not in table)
    if not names:
        return
    raw = log.stacked(names)
    check_finite(log, names, raw)
    length = Role(role.name, role.what, "length", option=role.option)
    factor, unit, notes = unit_of(length, [search.name_of(n) for n in names], raw, units, log.file)
    table.notes += [f"{log.file.name}: {note}" for note in notes]
    table.numbers[role.name] = (factor * raw).reshape(len(raw), -1, 3)
    table.names[role.name], table.units[role.name] = names, unit


def _add_words(table: Table, log: Log, role: TextRole, search: ColumnSearch) -> None:
    name = search.column_of_words(role)
    if name is None:
        return
    cells = log.texts.get(name)
    words = list(cells) if cells is not None else [_as_word(v) for v in log.columns[name]]
    if "" in words:
        row = words.index("")
        raise kr5.IoError(f"{log.file}: {log.row(row)}, column '{name}': is missing; expected {role.what}")
    table.words[role.name], table.names[role.name] = words, [name]


def _as_word(value: float) -> str:
    """A number that only names something."""
    return "" if np.isnan(value) else str(int(value)) if value == np.floor(value) else repr(float(value))
