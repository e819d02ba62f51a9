"""ROS bags, of ROS 1 and of ROS 2 with SQLite storage or as a folder, read by `rosbags`."""

import warnings
from pathlib import Path
from typing import Any

import kr5
from kr5.files.documents import check_readable
from kr5.files.paths import plain_path
from kr5.logs.log import Log
from kr5.logs.messages import MessageTable

INSTALL = "pip install 'kr5[bags]'"
MAX_MESSAGE = 1 << 16  # bytes; larger ones are images and clouds
# What no joint or sensor of a cell publishes.
LEFT_OUT = ("Image", "CompressedImage", "PointCloud2", "CameraInfo", "TFMessage", "Log", "RobotDescription", "String")


PARTS = ("*.db3", "*.mcap")  # of a bag that was split


def is_bag_folder(path: Path) -> bool:
    """A folder as ROS 2 records it, or one with its parts alone."""
    return path.is_dir() and ((path / "metadata.yaml").is_file() or bool(_parts(path)))


def _parts(folder: Path) -> list[Path]:
    return sorted(file for pattern in PARTS for file in folder.glob(pattern))


def _files(path: Path) -> list[Path]:
    """What the reader is given: the file, the folder, or the parts of a folder that has no description."""
    whole = path.is_file() or (path / "metadata.yaml").is_file()
    return [path] if whole else _parts(path)


def read_bag(path: Path) -> Log:
    """Every number of every message: `/joint_states:position.a1` where a message lists names."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise kr5.FileError(path, f"to read a ROS bag, the package rosbags is needed: {INSTALL}") from None
    for file in path.iterdir() if path.is_dir() else ():
        if file.exists():  # beside the bag may be links to what is gone
            check_readable(file, "a file of a ROS bag")
    table, kinds = MessageTable(path), dict[str, str]()
    try:
        with (
            plain_path(path) as place,
            AnyReader(_files(place), default_typestore=get_typestore(Stores.LATEST)) as reader,
        ):
            kinds = {c.topic: c.msgtype for c in reader.connections}
            wanted = [c for c in reader.connections if c.msgtype.split("/")[-1] not in LEFT_OUT]
            if wanted:  # of none, rosbags would read all
                _read_messages(reader, wanted, table)
    except Exception as error:  # what the decoders raise at damaged bytes is no closed list
        why = str(error).split("\n")[0][:200] or type(error).__name__
        raise kr5.FileError(
            path,
            f"cannot be read as a ROS bag: {why}; was the recording ended properly? 'ros2 bag reindex' (ROS 2)"
            " and 'rosbag reindex' (ROS 1) repair a bag that was cut off",
        ) from error
    log = table.log()
    if not log.columns:
        topics = ", ".join(f"{t} ({k})" for t, k in sorted(kinds.items())[:12]) or "none"
        raise kr5.FileError(
            path,
            f"contains no message with numbers of joints or sensors; its topics are: {topics}; record /joint_states",
        )
    return log


def _read_messages(reader: Any, connections: list[Any], table: MessageTable) -> None:
    unknown: dict[str, str] = {}
    for connection, time, raw in reader.messages(connections=connections):
        if connection.topic in unknown or len(raw) > MAX_MESSAGE:
            continue
        try:
            message = reader.deserialize(raw, connection.msgtype)
        except KeyError:  # a type whose definition neither the bag nor rosbags has
            unknown[connection.topic] = connection.msgtype
            warnings.warn(
                f"{table.file}: topic {connection.topic} is left out: its type {connection.msgtype} is not known, since"
                " the bag does not hold its definition",
                kr5.Caution,
                stacklevel=2,
            )
            continue
        table.add(connection.topic, time * 1e-9, message)
