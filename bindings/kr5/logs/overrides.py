"""`--set KEY=VALUE`: single entries of a guessed map, or of the model's cell, in place of what was found, and the ends
of logs (`end=SECONDS`, `end.LOG=SECONDS`), before which a map is guessed."""

from dataclasses import dataclass, field
from typing import Any

import yaml

import kr5
from kr5.logs.entry_words import IN_MAP, EntryWords

CELL = "cell."
END = "end"
Override = tuple[list[str], Any]  # path of keys, value


@dataclass
class GivenEntries:
    """What of a map the user states, before the rest of it is guessed."""

    columns: dict[str, dict[str, Any]] = field(default_factory=dict)  # by family
    clock: dict[str, Any] = field(default_factory=dict)
    header: list[str] | None = None  # names of the columns of a text file without them
    words: EntryWords = IN_MAP  # by which errors say how to state more of them
    episodes: str = ""  # of data sets, such as 3,7-12; without, some of them
    check: str = ""  # of several logs or episodes, those that are kept to judge
    ends: dict[str, float] = field(default_factory=dict)  # by log or episode ("": each): rows from there are left out


def parse_overrides(texts: list[str]) -> tuple[list[Override], list[Override]]:
    """Those of the map, and those of the cell, as paths of keys with values (YAML)."""
    of_map: list[Override] = []
    of_cell: list[Override] = []
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise kr5.InvalidArgument(f"--set: found {text!r:.80}, expected KEY=VALUE, such as columns.tau.scale=0.001")
        try:
            parsed = yaml.safe_load(value)
        except yaml.YAMLError as error:
            raise kr5.InvalidArgument(
                f"--set {key}: found {value!r:.80}, which is no YAML value: {str(error).splitlines()[0]}"
            ) from error
        path = key.strip().removeprefix(CELL).split(".")
        (of_cell if key.strip().startswith(CELL) else of_map).append((path, parsed))
    return of_map, of_cell


def given_entries(overrides: list[Override]) -> GivenEntries:
    """The entries of columns and clock, given with --set; what has another form is left to the reader of maps, which
    refuses it."""
    data: dict[str, Any] = {}
    apply_overrides(data, of_guessed_map(overrides))
    columns, clock = data.get("columns"), data.get("clock")
    out = GivenEntries(clock=clock if isinstance(clock, dict) else {}, words=EntryWords(by_option=True))
    if isinstance(header := data.get("header"), list):
        out.header = [str(name) for name in header]
    for name, entry in columns.items() if isinstance(columns, dict) else ():
        out.columns[name] = entry if isinstance(entry, dict) else {"from": entry}
    out.ends = _ends(overrides)
    return out


def of_guessed_map(overrides: list[Override]) -> list[Override]:
    """Those that are entries of the map, in which ends of logs have become spans of experiments."""
    return [(path, value) for path, value in overrides if path[0] != END]


def _ends(overrides: list[Override]) -> dict[str, float]:
    out: dict[str, float] = {}
    for path, value in overrides:
        if path[0] != END:
            continue
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0:
            raise kr5.InvalidArgument(
                f"--set {'.'.join(path)}: found {value!r:.40}, expected the seconds from the beginning of the log up to"
                " which it is used, such as end=12.5"
            )
        out[".".join(path[1:])] = float(value)
    return out


def apply_overrides(data: dict[str, Any], overrides: list[Override]) -> None:
    """Sets the entries; those of columns in the maps of all experiments that have columns of their own."""
    for path, value in overrides:
        targets = [data]
        if path[0] in ("columns", "clock"):
            own = [e for e in data.get("experiments", []) if path[0] in e]
            targets = own or [data]
        for target in targets:
            _set(target, path, value)


def _set(target: dict[str, Any], path: list[str], value: object) -> None:
    for key in path[:-1]:
        inner = target.setdefault(key, {})
        if not isinstance(inner, dict):
            inner = target[key] = {"from": inner}
        target = inner
    family = target.get(path[-1]) if path[0] == "columns" else None
    if isinstance(family, dict) and isinstance(value, str):  # a family by the name of its columns alone
        family["from"] = value
    else:
        target[path[-1]] = value
