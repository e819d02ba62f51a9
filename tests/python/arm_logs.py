"""Logs of an arm with six joints, as controllers and robots of other people write them."""

import sys

import kr5.cell
import kr5.io
import kr5.predict
import numpy as np
from kr5 import physics

from conftest import ROOT

sys.path[:0] = [str(ROOT / "tools/benchmarks"), str(ROOT / "tools")]

import case_logs
from make_arm_log import NOISE, swing

NAMES = case_logs.JOINT_NAMES
QUICK = ["--max-effects", "1", "--refits", "4", "--beam", "1"]


def measured_motion(t, q, tau=None):
    """A motion on measured angles, with joint torques where there are some."""
    out = kr5.cell.Experiment(name="m", kind="motion", file="m.csv", split="fit")
    out.joint_reference = kr5.cell.JointReference("measured")
    families = {"qc": q} | ({} if tau is None else {"tau": tau})
    names = ["t", *(f"{stem}{k + 1}" for stem in families for k in range(6))]
    out.data = kr5.io.Table(names, np.column_stack([t, *families.values()]))
    return out


def moved(cell, rows=1500, step=0.008, seed=1, q_noise=1e-5, course=swing, noise=NOISE):
    """What a controller logs of the arm: time, measured angles, joint torques; rows x joints."""
    random = np.random.default_rng(seed)
    t = step * np.arange(rows)
    q = course(t)
    shown = kr5.predict.FastSimulator().predict(cell, measured_motion(t, q))
    family = "tau" if "tau1" in shown else "i"
    tau = np.column_stack([shown[f"{family}{k + 1}"] for k in range(6)])
    if family == "i":
        tau = physics.reported_torques(cell, tau)
    return t, q + random.normal(0, q_noise, q.shape), tau + random.normal(0, noise, tau.shape)


def joint_states(t, q, tau, names=NAMES):
    """Columns as PlotJuggler exports joint states, in alphabetical order."""
    out = {"__time": 1_700_000_000.0 + t}
    for name in sorted(names):
        k = names.index(name)
        out[f"/joint_states/{name}/position"] = q[:, k]
        out[f"/joint_states/{name}/effort"] = tau[:, k]
    return out


def carrying(arm, effect, target, **parameters):
    out = kr5.cell.parse_cell(arm.to_yaml())
    for name, value in parameters.items():
        out.set_effect(effect, target, name, value)
    return out


def causes(data):
    return sorted((c["effect"], c["target"]) for c in data["causes"])


def refused(diagnose, *words, text):
    """What is wrong is said in words, with the remedy, and no cause is named."""
    code, said, data = diagnose(*words)
    assert code == 2 and data == {}, said
    for part in (text,) if isinstance(text, str) else text:
        assert part in said, said
    assert "Causes" not in said and "Explained" not in said, said
    return said


def written_bag(folder, types, connections, messages):
    from rosbags.rosbag2 import StoragePlugin, Writer

    with Writer(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        made = {topic: writer.add_connection(topic, kind, typestore=types) for topic, kind in connections.items()}
        for topic, t, message in messages:
            writer.write(made[topic], int(t * 1e9), types.serialize_cdr(message, message.__msgtype__))
    return folder


def state(ros, t, names, q, tau):
    T = ros.types
    stamp = T["builtin_interfaces/msg/Time"](sec=int(t), nanosec=round((t - int(t)) * 1e9))
    header = T["std_msgs/msg/Header"](stamp=stamp, frame_id="")
    return T["sensor_msgs/msg/JointState"](
        header=header, name=list(names), position=q, velocity=np.zeros(0), effort=tau
    )


STATES = {"/joint_states": "sensor_msgs/msg/JointState"}
