"""MCAP logs: messages in JSON and of ROS 2, flattened to columns of numbers."""

import json
import os
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, cast

import kr5
from kr5.logs.log import Log
from kr5.logs.messages import MessageTable

INSTALL = "pip install 'kr5[mcap]'"


def read_mcap(file: Path) -> Log:
    """Every number of every message: `/joint_states:position.a1` where a message lists names, else `...position[0]`."""
    try:
        from mcap.reader import make_reader
    except ImportError:
        raise kr5.FileError(file, f"to read MCAP, the package mcap is needed: {INSTALL}") from None
    table = MessageTable(file)
    try:
        for topic, time, message in _messages(file, make_reader):
            table.add(topic, time, message)
    except Exception as error:  # what the decoders raise at damaged bytes is no closed list
        why = str(error).split("\n")[0][:200] or type(error).__name__
        raise kr5.FileError(
            file,
            f"cannot be read as MCAP: {why}; was the recording ended properly? 'mcap recover' repairs a file cut off",
        ) from error
    log = table.log()
    if not log.columns:
        raise kr5.FileError(file, "contains no readable message; expected JSON messages, or ROS 2 ones (cdr)")
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
        text = f"{file}: messages of ROS 2, if there are any, are left out; to read them: {INSTALL}"
        warnings.warn(text, kr5.Caution, stacklevel=2)
        return None
    return DecoderFactory()


def _decoder(encoding: str, schema: Any, ros: Any) -> Callable[..., Any] | None:
    if encoding == "json":
        return json.loads
    return ros.decoder_for(encoding, schema) if ros is not None else None
