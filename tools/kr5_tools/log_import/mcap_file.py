"""MCAP logs: messages in JSON and of ROS 2, flattened to columns of numbers."""

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from kr5_tools.cli import terminal
from kr5_tools.log_import.log import Log

INSTALL = "pip install 'kr5[mcap]'"


def read_mcap(file: Path) -> Log:
    """Every number of every message: `/joint_states:position.a1` where a message lists names, else `...position[0]`."""
    try:
        from mcap.reader import make_reader
    except ImportError:
        terminal.fail(f"{file}: to read MCAP, the package mcap is needed: {INSTALL}")
    found: dict[str, dict[str, list[float]]] = {}
    try:
        for topic, time, message in _messages(file, make_reader):
            values = {"log_time": time}
            _flatten(message, "", values)
            columns = found.setdefault(topic, {name: [] for name in values})
            for name, column in columns.items():
                column.append(values.get(name, np.nan))
    except Exception as error:  # what the decoders raise at damaged bytes is no closed list
        why = str(error).split("\n")[0][:200] or type(error).__name__
        terminal.fail(
            f"{file}: cannot be read as MCAP: {why}; was the recording ended properly? 'mcap recover' repairs a "
            "file cut off"
        )
    log = Log(file)
    for topic, columns in found.items():
        for name, column in columns.items():
            log.add(f"{topic}:{name}", column, topic)
        log.clocks[topic] = f"{topic}:{'header.stamp' if 'header.stamp' in columns else 'log_time'}"
    if not log.columns:
        terminal.fail(f"{file}: contains no readable message; expected JSON messages, or ROS 2 ones (cdr)")
    return log


def _messages(file: Path, make_reader: Callable[..., Any]) -> Iterator[tuple[str, float, Any]]:
    """Topic, log time [s] and content of every message that can be decoded."""
    decoders: dict[int, Callable[..., Any] | None] = {}
    ros = _ros_factory(file)
    with file.open("rb") as opened:
        stream = BoundedStream(opened)
        for schema, channel, message in make_reader(cast(BinaryIO, stream)).iter_messages():
            if channel.id not in decoders:
                decoders[channel.id] = _decoder(channel.message_encoding, schema, ros)
            decode = decoders[channel.id]
            if decode is not None:
                yield channel.topic, message.log_time * 1e-9, decode(message.data)


class BoundedStream:
    """A file of which no more can be asked for than it holds; a damaged length would be given memory before it is
    found wrong.
    """

    def __init__(self, stream: BinaryIO):
        self.stream = stream
        self.size = os.fstat(stream.fileno()).st_size

    def read(self, count: int = -1) -> bytes:
        if count > self.size:
            raise ValueError(f"a record of {count} bytes in a file of {self.size}")
        return self.stream.read(count)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        return self.stream.seek(offset, whence)

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self.stream.tell()


def _ros_factory(file: Path) -> Any:
    try:
        from mcap_ros2.decoder import DecoderFactory
    except ImportError:
        terminal.errors.print(
            f"{file}: messages of ROS 2, if there are any, are left out; to read them: {INSTALL}", soft_wrap=True
        )
        return None
    return DecoderFactory()


def _decoder(encoding: str, schema: Any, ros: Any) -> Callable[..., Any] | None:
    if encoding == "json":
        return json.loads
    return ros.decoder_for(encoding, schema) if ros is not None else None


def _flatten(value: Any, name: str, out: dict[str, float]) -> None:
    if isinstance(value, (bool, int, float, np.number)):
        out[name] = float(value)
        return
    if hasattr(value, "__slots__") and not isinstance(value, dict):
        value = {key: getattr(value, key) for key in value.__slots__}
    if isinstance(value, dict):
        if (stamp := _stamp(value)) is not None:
            out[name] = stamp
            return
        labels: Any = value.get("name", value.get("names"))
        for key, item in value.items():
            inner = f"{name}.{key}" if name else key
            if _is_list(item) and _is_list(labels) and item is not labels and len(item) == len(labels):
                item = dict(zip(labels, item))
            _flatten(item, inner, out)
    elif _is_list(value):
        for k, item in enumerate(value):
            _flatten(item, f"{name}[{k}]", out)


def _is_list(value: Any) -> bool:
    return isinstance(value, (list, tuple, np.ndarray)) or type(value).__name__ == "array"


def _stamp(value: dict[str, Any]) -> float | None:
    """Seconds of a ROS time."""
    for seconds, rest in (("sec", "nanosec"), ("secs", "nsecs")):
        if set(value) == {seconds, rest}:
            return float(value[seconds] + 1e-9 * value[rest])
    return None
