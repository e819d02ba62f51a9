"""Which columns of a file hold what a command needs, by their names."""

import re
from collections.abc import Sequence

import numpy as np

import kr5
from kr5.logs.column_names import find_families
from kr5.logs.log import Log
from kr5.tables.checks import missing_columns
from kr5.tables.column_units import ColumnName, read_name
from kr5.tables.roles import AnyRole, PointsRole, PoseRole, Role, TextRole

MOST_COUNTED = 99
FAMILIES = {"q": "q", "tau": "tau", "i": "i", "qd": "qd", "qc": "qc"}  # of a log, by role


class ColumnSearch:
    """Finds the columns of roles. `given`: names that an option of the command states; `ordered`: those that a list in
    the order of the roles states; `counts`: how many columns a role has."""

    def __init__(
        self,
        log: Log,
        roles: Sequence[AnyRole],
        given: dict[str, str],
        counts: dict[str, int],
        ordered: dict[str, str],
    ):
        self.log, self.roles, self.given, self.counts, self.ordered = log, roles, given, counts, ordered
        self.names = {column: read_name(column) for column in log.names()}
        self.by_plain: dict[str, str] = {}
        for column, name in self.names.items():
            self.by_plain.setdefault(name.plain, column)
        self.found: dict[str, list[str]] = {}

    def name_of(self, column: str) -> ColumnName:
        return self.names[column]

    def columns_of(self, role: Role) -> list[str]:
        """The columns of a role, `""` for one of several that may be absent; none where it is not there, which is an
        error where it is needed."""
        if role.name not in self.found:
            self.found[role.name] = self._checked(role, self._counted(role) if role.counted else self._single(role))
        return self.found[role.name]

    def columns_of_points(self, role: PointsRole, needed: bool) -> list[str]:
        """Three columns a point."""
        if role.name in self.given:
            names = [n.strip() for n in self.given[role.name].split(",")]
            if len(names) % 3:
                raise kr5.InvalidArgument(
                    f"{role.option}: found {len(names)} names, expected three a point, such as x,y,z or"
                    " x1,y1,z1,x2,y2,z2"
                )
        elif not self.log.named and len(self.log.names()) - self._stamps() == 3:
            names = self.log.names()[-3:]
        else:
            numbers = [k for k in range(1, MOST_COUNTED + 1) if self._named(f"x{k}")]
            names = [f"{axis}{k}" for k in numbers for axis in "xyz"] or ["x", "y", "z"]
        found = [(n, self._named(n)) for n in names]
        lacking = [n for n, c in found if c is None]
        if lacking and (needed or len(lacking) < len(names) or role.name in self.given):
            raise kr5.IoError(self.missing(lacking, role.option, role.what))
        columns = [c for _, c in found if c is not None]
        self._refuse_text(columns)
        return [] if lacking else columns

    def _stamps(self) -> int:
        """1 where columns without names begin with one that rises from row to row, as a clock does."""
        names = self.log.names()
        first = self.log.columns.get(names[0], np.empty(0)) if len(names) > 1 else np.empty(0)
        return int(len(first) > 2 and bool((np.diff(first) > 0).all()))

    def column_of_words(self, role: TextRole) -> str | None:
        """The column of a role of words."""
        wanted = [self.given[role.name]] if role.name in self.given else [role.name, *role.also]
        found = next((c for n in wanted if (c := self._named(n))), None)
        if found is None and (role.needed or role.name in self.given):
            raise kr5.IoError(self.missing([wanted[0]], role.option, role.what))
        return found

    def _named(self, name: str) -> str | None:
        """A column by its whole name, or by it in small letters without unit and topic."""
        return name if name in self.names else self.by_plain.get(name.lower())

    def _single(self, role: Role) -> list[str]:
        if role.name in self.ordered:
            return [self.ordered[role.name]]
        if role.name in self.given:
            return [self._stated(role, self.given[role.name])]
        for name in (role.name, *role.also):
            if column := self._named(name):
                return [column]
        if role.quantity == "time" and self.log.clocks:
            return [next(iter(self.log.clocks.values()))]
        return []

    def _stated(self, role: Role, name: str) -> str:
        if column := self._named(name):
            return column
        raise kr5.IoError(self.missing([name], role.option, role.what))

    def _counted(self, role: Role) -> list[str]:
        count = self.counts.get(role.name)
        if not self.log.named and len(self.roles) == 1 and count == len(self.log.names()):
            return self.log.names()
        if role.name in self.given:
            return self._given_columns(role, self.given[role.name], count)
        for stem in (role.name, *role.also):
            if found := self._numbered(role, stem, count):
                return found
        return self._of_family(role, count)

    def _given_columns(self, role: Role, pattern: str, count: int | None) -> list[str]:
        if "{}" in pattern and "," not in pattern:
            numbers = range(1, (count or MOST_COUNTED) + 1)
            names = [pattern.replace("{}", str(k)) for k in numbers]
            return [self._stated(role, n) for n in names] if count else [c for n in names if (c := self._named(n))]
        names = pattern.split(",")
        if count and len(names) != count:
            raise kr5.InvalidArgument(
                f"{role.option}: found {len(names)} names, expected {count}, one a joint, or a pattern such as"
                " joint_{}"
            )
        return [self._stated(role, n.strip()) for n in names]

    def _numbered(self, role: Role, stem: str, count: int | None) -> list[str]:
        """q1, q2, …; also q_1 and, of arrays, q[0]. Fewer than asked for are an error, told by what is missing."""
        may_skip = role.may_skip
        for form, first in (("{}{}", 1), ("{}_{}", 1), ("{}[{}]", 0)):
            names = [form.format(stem, k) for k in range(first, first + (count or MOST_COUNTED))]
            columns = [self._named(n) or "" for n in names]
            if not any(columns):
                continue
            if count is None:
                last = max(k for k, c in enumerate(columns) if c) if may_skip else columns.index("")
                names, columns = names[: last + may_skip], columns[: last + may_skip]
            lacking = [n for n, c in zip(names, columns, strict=True) if not c]
            if lacking and not may_skip:
                raise kr5.IoError(self.missing(lacking, role.option, role.what))
            if any(columns):
                return columns
        return []

    def _of_family(self, role: Role, count: int | None) -> list[str]:
        """Columns that name joints, or count them in another way, as logs do."""
        family = FAMILIES.get(role.name)
        if family is None or not self.log.named:
            return []
        stems = {re.sub(r"\d+", "#", c) for c in self.log.columns}
        sizes = [count] if count else sorted({len(self._of_stem(s)) for s in stems}, reverse=True)
        for size in sizes:
            if found := find_families(self.log, [], size).first(family):
                return found.columns
        return []

    def _of_stem(self, stem: str) -> list[str]:
        return [c for c in self.log.columns if re.sub(r"\d+", "#", c) == stem]

    def _checked(self, role: Role, columns: list[str]) -> list[str]:
        if not columns and role.needed:
            raise kr5.IoError(self.missing([role.columns_in_words()], role.option, role.what))
        self._refuse_text(columns)
        return columns

    def _refuse_text(self, columns: Sequence[str]) -> None:
        for column in columns:
            if column in self.log.text_columns:
                raise kr5.IoError(self.log.unreadable(column))

    def missing(self, lacking: Sequence[str], option: str, what: str = "") -> str:
        """The one sentence about columns that are not there."""
        columns = self.log.names()
        example = self._example()
        return missing_columns(self.log.file, columns, self.log.named, lacking, what, option, example)

    def _example(self) -> str:
        """A list of columns that the command could take."""
        names: list[str] = []
        for role in self.roles:
            if isinstance(role, PointsRole):
                names += ["x", "y", "z"] if role.needed else []
            elif isinstance(role, PoseRole):
                names += [role.prefix + n for n in ("x", "y", "z", "qx", "qy", "qz", "qw")] if role.needed else []
            elif role.needed and isinstance(role, Role) and role.counted:
                count = self.counts.get(role.name)
                names.append(f"{role.name}{{1-{count or 6}}}")
            elif role.needed:
                names.append(role.name)
        return ",".join(names) or "NAMES"
