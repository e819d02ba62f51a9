"""Messages of a log, flattened to columns of numbers."""

import dataclasses
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

import kr5
from kr5 import arm_log
from kr5.logs.log import Log

LONGEST_LIST = 256  # numbers of one message; longer ones are images or clouds
# Steps back in time, of all steps of a stream, above which two publishers write to one topic.
MIXED_SHARE = 0.05
STAMP_FIELDS = (("sec", "nanosec"), ("secs", "nsecs"))  # of a time in ROS 2 and ROS 1


class MessageTable:
    """Collects messages topic by topic. A message that lists names of joints has a stream for each list of names, so
    that two publishers of different joints stay apart."""

    def __init__(self, file: Path):
        self.file = file
        self.streams: dict[tuple[str, tuple[str, ...]], dict[str, list[float]]] = {}

    def add(self, topic: str, time: float, message: object) -> None:
        values: dict[str, float] = {"log_time": time}
        names: list[str] = []
        _flatten(message, "", values, names)
        if len(values) == 1:
            return  # no number but its time
        columns = self.streams.setdefault((topic, tuple(sorted(names))), {})  # in any order
        rows = len(columns["log_time"]) if columns else 0
        for name in [n for n in values if n not in columns]:
            columns[name] = [np.nan] * rows
        for name, column in columns.items():
            column.append(values.get(name, np.nan))

    def log(self) -> Log:
        """The columns, such as `/joint_states:position.a1`; `header.stamp` is the clock where a message has one."""
        out = Log(self.file)
        for topic in dict.fromkeys(topic for topic, _ in self.streams):
            self._refuse_shared_names(topic)
            parts = [key for key in self.streams if key[0] == topic]
            for number, key in enumerate(parts):
                stream = topic if number == 0 else f"{topic}#{number + 1}"
                columns = self.streams[key]
                clock = "header.stamp" if _usable_stamp(columns.get("header.stamp")) else "log_time"
                self._refuse_mixed(topic, columns, clock)
                for name, values in columns.items():
                    column = f"{topic}:{name}"
                    out.add(column if column not in out.columns else f"{stream}:{name}", values, stream)
                out.clocks[stream] = f"{topic if f'{topic}:{clock}' not in out.clocks.values() else stream}:{clock}"
        return out

    def _refuse_shared_names(self, topic: str) -> None:
        lists = [names for t, names in self.streams if t == topic and names]
        for k, names in enumerate(lists):
            for other in lists[:k]:
                if shared := set(names) & set(other):
                    raise kr5.FileError(
                        self.file,
                        f"topic {topic}: found '{sorted(shared)[0]}' in messages that list"
                        f" {_listed(other)} and in messages that list {_listed(names)}: two publishers write to this"
                        " topic",
                        remedy="record the log again with one of them, or give each a topic of its own",
                    )

    def _refuse_mixed(self, topic: str, columns: dict[str, list[float]], clock: str) -> None:
        steps = np.diff(np.asarray(columns[clock]))
        back = int((steps < 0).sum())
        if len(steps) > 20 and back > MIXED_SHARE * len(steps):
            raise kr5.FileError(
                self.file,
                f"topic {topic}: time goes back at {back} of {len(steps)} messages: two publishers with"
                " clocks of their own seem to write to this topic",
                remedy="record the log again with one of them",
            )
        for name in columns:
            if name.startswith("position.") and arm_log.written_in_turn(np.asarray(columns[name])):
                raise kr5.FileError(
                    self.file,
                    f"topic {topic}: {name} jumps to and fro from message to message: two publishers seem"
                    " to take turns on this topic; record the log again with one of them, or give each a topic of its"
                    " own",
                )


def _listed(names: Iterable[str]) -> str:
    all_names = list(names)
    return ", ".join(all_names[:8]) + (" ..." if len(all_names) > 8 else "")


def _usable_stamp(values: list[float] | None) -> bool:
    """Stamps that a publisher filled in."""
    return values is not None and len(set(values[:10])) > min(1, len(values) - 1) and values[0] > 0


def _flatten(
    value: object, name: str, out: dict[str, float], names: list[str], labels: Sequence[str] | None = None
) -> None:
    """Numbers by where they stand. Lists as long as the names of joints that a message lists, on any level of it, are
    told apart by them."""
    if isinstance(value, (bool, int, float, np.number)):
        out[name] = float(value)
        return
    fields = _fields(value)
    if fields is not None:
        if (stamp := _stamp(fields)) is not None:
            out[name] = stamp
            return
        own: Any = next((fields[k] for k in ("name", "names", "joint_names") if _are_names(fields.get(k))), None)
        if own is not None:
            names.extend(n for n in map(str, own) if n not in names)
            labels = own
        for key, item in fields.items():
            _flatten(item, f"{name}.{key}" if name else str(key), out, names, labels)
    elif _is_list(value) and labels is not None and len(value) == len(labels) and not _are_names(value):
        for label, item in zip(labels, value):
            _flatten(item, f"{name}.{label}", out, names)
    elif _is_list(value) and len(value) <= LONGEST_LIST:
        for k, item in enumerate(value):
            _flatten(item, f"{name}[{k}]", out, names, labels)


def _fields(value: object) -> dict[str, Any] | None:
    """What a message is made of; nothing for what is no message."""
    if isinstance(value, dict):
        return value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: getattr(value, f.name) for f in dataclasses.fields(value) if f.name != "__msgtype__"}
    if hasattr(value, "__slots__") and not isinstance(value, (str, bytes, np.ndarray)):
        return {key: getattr(value, key) for key in value.__slots__}
    return None


def _are_names(value: object) -> bool:
    return _is_list(value) and len(value) > 0 and all(isinstance(v, str) for v in value)


def _is_list(value: object) -> TypeGuard[Sequence[object]]:
    return isinstance(value, (list, tuple, np.ndarray)) or type(value).__name__ == "array"


def _stamp(value: dict[str, Any]) -> float | None:
    """Seconds of a ROS time."""
    for seconds, rest in STAMP_FIELDS:
        if set(value) == {seconds, rest}:
            return float(value[seconds] + 1e-9 * value[rest])
    return None
