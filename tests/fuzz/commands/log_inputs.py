"""Logs of a real arm beside its model, in the formats that others write, and the commands that read them."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_job import Job

DATA = Path(__file__).resolve().parents[3] / "share/data/arm_log"
ROWS = 600  # of the log, which rests at its beginning and then moves
BEGIN = 1_700_000_000.0  # of the log, since 1970 [s]


def _measured(group: str, log: str, files: tuple[str, ...], weight: float = 1.0) -> Job:
    return Job(group, f"gap measure {log} --model arm.urdf --json out.json", "arm_logs", files, ("out.json",), weight)


JOBS = [
    Job(
        "logs with a model",
        "gap diagnose log.csv --model arm.urdf -o out.json --report page.html --write-model tuned.urdf",
        "arm_logs",
        ("log.csv", "arm.urdf"),
        ("out.json", "page.html", "tuned.urdf"),
        2,
    ),
    _measured("logs with a model", "log.csv", ("log.csv", "arm.urdf"), 2),
    _measured("bags", "bag", ("bag/*",), 2),
    _measured("bags", "log.db3", ("log.db3",)),
    _measured("bags", "log.bag", ("log.bag",), 2),
    _measured("bags", "states.mcap", ("states.mcap",)),
    _measured("other logs", "log.h5", ("log.h5",)),
    _measured("other logs", "log.parquet", ("log.parquet",)),
    _measured("other logs", "log.json", ("log.json",)),
    Job(
        "bags",
        "recording guess bag --cell arm.yaml -o guess.yaml",
        "arm_logs",
        ("bag/*",),
        ("guess.yaml",),
    ),
    Job(
        "other logs",
        "identify dynamics log.csv --cell arm.yaml -o out.json",
        "arm_logs",
        ("log.csv", "arm.yaml"),
        ("out.json",),
    ),
]


def prepare(folder: Path, run: Callable[..., None]) -> None:
    folder.mkdir()
    shutil.copy(DATA / "arm.urdf", folder)
    run(folder, "cell import arm.urdf -o arm.yaml")
    lines = (DATA / "joint_states.csv").read_text(encoding="utf-8").splitlines()[: ROWS + 1]
    (folder / "log.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    names = lines[0].split(",")
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    joints = [name.split("/")[2] for name in names[1::2]]
    t, q, tau = (np.ascontiguousarray(part) for part in (values[:, 0] - BEGIN, values[:, 1::2], values[:, 2::2]))
    _write_bags(folder, joints, t, q, tau)
    _write_arrays(folder, t, q, tau)


def _write_bags(folder: Path, joints: list[str], t: np.ndarray, q: np.ndarray, tau: np.ndarray) -> None:
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    for name, plugin in (("bag", StoragePlugin.SQLITE3), ("mcap", StoragePlugin.MCAP)):
        with Writer(folder / name, version=9, storage_plugin=plugin) as writer:
            types = get_typestore(Stores.ROS2_HUMBLE)
            _write_states(writer, types, types.serialize_cdr, joints, (t, q, tau))
    shutil.copy(next((folder / "bag").glob("*.db3")), folder / "log.db3")
    shutil.move(next((folder / "mcap").glob("*.mcap")), folder / "states.mcap")
    shutil.rmtree(folder / "mcap")
    with Writer1(folder / "log.bag") as writer:
        types = get_typestore(Stores.ROS1_NOETIC)
        _write_states(writer, types, types.serialize_ros1, joints, (t, q, tau))


def _write_states(writer: Any, types: Any, serialize: Any, joints: list[str], rows: tuple[np.ndarray, ...]) -> None:
    made = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=types)
    header, stamp = types.types["std_msgs/msg/Header"], types.types["builtin_interfaces/msg/Time"]
    state = types.types["sensor_msgs/msg/JointState"]
    for k, (at, q, tau) in enumerate(zip(*rows)):
        now = BEGIN + at
        at_head = {"stamp": stamp(sec=int(now), nanosec=round(1e9 * (now - int(now)))), "frame_id": ""}
        if "seq" in header.__dataclass_fields__:  # of ROS 1
            at_head["seq"] = k
        message = state(header=header(**at_head), name=joints, position=q, velocity=np.zeros(0), effort=tau)
        writer.write(made, round(1e9 * now), serialize(message, message.__msgtype__))


def _write_arrays(folder: Path, t: np.ndarray, q: np.ndarray, tau: np.ndarray) -> None:
    import json

    import h5py
    import pyarrow
    import pyarrow.parquet

    order = [2, 1, 0, 3, 4, 5]  # of the arm; the log has the names in the order of the alphabet
    q, tau = q[:, order], tau[:, order]
    with h5py.File(folder / "log.h5", "w") as file:
        for name, values in (("time", t), ("q", q), ("tau", tau)):
            file[name] = values
    columns = {"time": t, **{f"q{k + 1}": q[:, k] for k in range(6)}, **{f"tau{k + 1}": tau[:, k] for k in range(6)}}
    pyarrow.parquet.write_table(pyarrow.table(columns), folder / "log.parquet")
    data = {name: values.tolist() for name, values in (("time", t), ("q", q), ("tau", tau))}
    (folder / "log.json").write_text(json.dumps(data), encoding="utf-8")
