"""Labelled recordings written as people's logs: plain CSV with joint names, and ROS 2 bags."""

from pathlib import Path
from typing import Any

import numpy as np
from kr5 import physics

JOINT_NAMES = ["shoulder_yaw", "shoulder_pitch", "elbow_pitch", "wrist_roll", "wrist_pitch", "flange_roll"]
WRENCH = {"fx": "force_x", "fy": "force_y", "fz": "force_z", "tx": "torque_x", "ty": "torque_y", "tz": "torque_z"}
WORDS = {"qc": "command", "q": "position", "i": "current"}


def named(cell: Any) -> Any:
    """The cell with names of its joints, as a URDF gives them."""
    robot = cell.robot
    robot.joint_names = JOINT_NAMES
    cell.robot = robot
    return cell


def csv_columns(experiment: Any) -> dict[str, np.ndarray]:
    """Columns by the names that a logger gives; joints in alphabetical order, as joint states of ROS are."""
    data = {name: np.array(experiment[name]) for name in experiment.data.columns}
    joints = {f"{stem}{k + 1}" for stem in WORDS for k in range(len(JOINT_NAMES))}
    out = {WRENCH.get(name, "time" if name == "t" else name): v for name, v in data.items() if name not in joints}
    for joint in sorted(JOINT_NAMES):
        k = JOINT_NAMES.index(joint) + 1
        for stem, word in WORDS.items():
            if f"{stem}{k}" in data:
                out[f"{joint}/{word}"] = data[f"{stem}{k}"]
    return out


def write_csv(file: Path, columns: dict[str, np.ndarray]) -> Path:
    """A cell without a number stays empty."""
    rows = [",".join("" if np.isnan(v) else f"{v:.16g}" for v in row) for row in zip(*columns.values())]
    file.write_text("\n".join([",".join(columns), *rows]) + "\n")
    return file


def case_csvs(recording: Any, folder: Path) -> list[Path]:
    """A CSV an experiment, in their order."""
    return [write_csv(folder / f"{e.name}.csv", csv_columns(e)) for e in recording.experiments]


def case_bag(recording: Any, folder: Path) -> list[Path]:
    """The motions as a ROS 2 bag (joint states with efforts, commands of a controller, wrench); what no message of ROS
    shows as CSV."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_JAZZY)
    bag = folder / "bag"
    with Writer(bag, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        topics = {
            topic: writer.add_connection(topic, kind, typestore=types)
            for topic, kind in (
                ("/joint_states", "sensor_msgs/msg/JointState"),
                ("/position_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory"),
                ("/force_torque/wrench", "geometry_msgs/msg/WrenchStamped"),
            )
        }
        for experiment in [e for e in recording.experiments if str(e.kind) == "motion"]:
            _write_motion(writer, topics, types, recording.cell, experiment)
    return [bag, *(f for f in case_csvs(recording, folder) if not f.name.startswith("motion"))]


def _write_motion(writer: Any, topics: Any, types: Any, cell: Any, experiment: Any) -> None:
    T, n = types.types, len(JOINT_NAMES)
    stack = lambda stem: np.column_stack([experiment[f"{stem}{k + 1}"] for k in range(n)])
    q, qc, torque = stack("q"), stack("qc"), physics.reported_torques(cell, stack("i"))
    wrench = np.column_stack([experiment[name] for name in WRENCH])
    order = np.argsort(JOINT_NAMES)
    names = [JOINT_NAMES[k] for k in order]
    for row, t in enumerate(1_700_000_000.0 + np.asarray(experiment["t"])):
        stamp = T["builtin_interfaces/msg/Time"](sec=int(t), nanosec=round((t - int(t)) * 1e9))
        header = T["std_msgs/msg/Header"](stamp=stamp, frame_id="base")
        state = T["sensor_msgs/msg/JointState"](
            header=header, name=names, position=q[row, order], velocity=np.zeros(0), effort=torque[row, order]
        )
        point = T["trajectory_msgs/msg/JointTrajectoryPoint"](
            positions=qc[row, order],
            velocities=np.zeros(0),
            accelerations=np.zeros(0),
            effort=np.zeros(0),
            time_from_start=T["builtin_interfaces/msg/Duration"](sec=0, nanosec=0),
        )
        command = T["trajectory_msgs/msg/JointTrajectory"](header=header, joint_names=names, points=[point])
        vector = lambda v: T["geometry_msgs/msg/Vector3"](x=float(v[0]), y=float(v[1]), z=float(v[2]))
        sensed = T["geometry_msgs/msg/WrenchStamped"](
            header=header,
            wrench=T["geometry_msgs/msg/Wrench"](force=vector(wrench[row, :3]), torque=vector(wrench[row, 3:])),
        )
        for topic, message in zip(topics, (state, command, sensed)):
            raw = types.serialize_cdr(message, message.__msgtype__)
            writer.write(topics[topic], int(t * 1e9), raw)
