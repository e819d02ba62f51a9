"""How a remedy names an entry of a map: by where it stands in the file, or as an option of a command without one."""

import json
import shlex
from dataclasses import dataclass
from typing import Any

import yaml


@dataclass(frozen=True)
class EntryWords:
    by_option: bool = False  # entries are given with --set

    def put(self, key: str, **values: object) -> str:
        """Entries to be set under a key, such as `unit: deg in columns.q` or `--set columns.q.unit=deg`."""
        if self.by_option:
            return " ".join(f"--set {shlex.quote(f'{key}.{name}={_text(value)}')}" for name, value in values.items())
        entries = ", ".join(f"{name}: {_text(value)}" for name, value in values.items())
        return f"{entries} in {key}" if "." in key else f"{key}: {{{entries}}} in the map"

    def end(self, seconds: float, log: str, experiment: str) -> str:
        """The end of a log, or of an experiment of a map. `log`: which of several, as an option names it."""
        if not self.by_option:
            return f"to: {_text(seconds)} in the experiment '{experiment}'"
        key = f"end.{log}" if log else "end"
        return f"--set {shlex.quote(f'{key}={_text(seconds)}')}"

    def interval(self, every: object) -> str:
        """The interval of even rows [s], as a map or a command takes it."""
        return f"--every {_text(every)}" if self.by_option else self.put("clock", every=every)


IN_MAP = EntryWords()


def _text(value: object) -> str:
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_text_in_list(v) for v in value)}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _text_in_list(value: object) -> str:
    """As YAML takes it in a list: what it would not read as this text stands in quotes."""
    if not isinstance(value, str):
        return _text(value)
    try:
        plain = yaml.safe_load(f"[{value}]") == [value]
    except yaml.YAMLError:
        plain = False
    return value if plain else json.dumps(value, ensure_ascii=False)
