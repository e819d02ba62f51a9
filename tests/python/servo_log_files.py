"""Logs of an arm whose motors are servos, written as the recorders of others write them, never by kr5."""

import collections
import io
import json
import pickle
import sys
import types
import zipfile
from dataclasses import dataclass, field
from pathlib import Path

import kr5.cell
import kr5.io
import kr5.predict
import numpy as np

NAMES = ["shoulder_pan", "shoulder_lift", "elbow_flex"]
TICK = 2 * np.pi / 4096
RATE = 50.0  # [Hz]
ARM = """
format: kr5-cell/1
name: servo arm
robot:
  joint_names: [shoulder_pan, shoulder_lift, elbow_flex]
  dh:
  - {b: 0.06, a: 0.0, alpha: 1.5707963267948966}
  - {b: 0.0, a: 0.12, alpha: 0.0}
  - {b: 0.0, a: 0.11, alpha: 0.0}
  limits: {lower: [-2.2, -2.0, -2.4], upper: [2.2, 2.0, 2.4], velocity: [10.0, 10.0, 10.0]}
  gravity: [0.0, 0.0, -9.81]
  links:
  - {mass: 0.15, com: [0.0, 0.0, 0.0], inertia: [2.0e-4, 3.0e-4, 3.0e-4, 0, 0, 0]}
  - {mass: 0.12, com: [-0.06, 0.0, 0.0], inertia: [2.0e-4, 3.0e-4, 3.0e-4, 0, 0, 0]}
  - {mass: 0.10, com: [-0.05, 0.0, 0.0], inertia: [2.0e-4, 3.0e-4, 3.0e-4, 0, 0, 0]}
drives:
  structure: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
  rotor_inertia: [0.02, 0.02, 0.02]
  torque_constant: [1, 1, 1]
  friction: {coulomb: [0.05, 0.05, 0.05], viscous: [0.1, 0.1, 0.1]}
servo:
  cycle: 0.02
  torque: {stiffness: 20.0, damping: 0.7}
"""


@dataclass
class Motion:
    """What was commanded and measured [rad], rows x joints, and by which names [s]."""

    t: np.ndarray
    qc: np.ndarray
    q: np.ndarray
    gripper: np.ndarray = field(init=False)

    def __post_init__(self):
        self.gripper = 0.3 + 0.2 * np.sin(1.7 * self.t)

    def with_gripper(self, values):
        return np.column_stack([values, self.gripper])


def servo_arm():
    out = kr5.cell.parse_cell(ARM)
    out.tool = kr5.cell.Tool()
    return out


def commands(t, seed):
    random = np.random.default_rng(seed)
    s = np.maximum(t - 1.0, 0.0)
    rise = np.minimum(s / 2.0, 1.0)
    slow, fast = random.uniform(0.15, 0.4, 3), random.uniform(0.6, 1.2, 3)
    at = random.uniform(-0.3, 0.3, 3)
    waves = 0.5 * np.sin(2 * np.pi * np.outer(s, slow)) + 0.12 * np.sin(2 * np.pi * np.outer(s, fast))
    return at + rise[:, None] * waves


def moved(seed=1, seconds=20.0, cell=None):
    """A motion of the arm, its encoders of 4096 steps a turn."""
    cell = cell or servo_arm()
    settling = round(2.0 * RATE)  # rows in which the arm comes to rest, before the log begins
    rows = round(seconds * RATE)
    t = np.arange(rows + settling) / RATE
    qc = commands(t - t[settling], seed)
    experiment = kr5.cell.Experiment(name="m", kind="motion", file="m.csv", split="fit")
    experiment.data = kr5.io.Table(["t", "qc1", "qc2", "qc3"], np.column_stack([t, qc]))
    shown = kr5.predict.FastSimulator().predict(cell, experiment)
    q = np.column_stack([shown[f"q{k + 1}"] for k in range(3)])
    return Motion(t[:rows], qc[settling:], np.round(q / TICK)[settling:] * TICK)


# Writers


def parquet_columns(m, episode, first=0):
    n = len(m.t)
    return {
        "action": list(m.with_gripper(m.qc).astype(np.float32)),
        "observation.state": list(m.with_gripper(m.q).astype(np.float32)),
        "timestamp": m.t.astype(np.float32),
        "frame_index": np.arange(n),
        "episode_index": np.full(n, episode),
        "index": first + np.arange(n),
        "task_index": np.zeros(n, int),
    }


def write_parquet(file, columns, rows_a_group=500):
    import pyarrow
    import pyarrow.parquet

    file.parent.mkdir(parents=True, exist_ok=True)
    pyarrow.parquet.write_table(pyarrow.table(columns), file, row_group_size=rows_a_group)
    return file


def info(version, joints=NAMES, suffix=""):
    names = [f"{name}{suffix}" for name in [*joints, "gripper"]]
    feature = {"dtype": "float32", "shape": [len(names)], "names": {"motors": names} if version == "v2.1" else names}
    return {
        "codebase_version": version,
        "robot_type": "so101",
        "fps": int(RATE),
        "features": {"action": feature, "observation.state": feature, "timestamp": {"dtype": "float32", "names": None}},
    }


def write_info(folder, version, **options):
    (folder / "meta").mkdir(parents=True)
    (folder / "meta" / "info.json").write_text(json.dumps(info(version, **options)))


def lerobot_21(folder, motions, **options):
    """A file an episode."""
    write_info(folder, "v2.1", **options)
    for k, m in enumerate(motions):
        write_parquet(folder / "data" / "chunk-000" / f"episode_{k:06d}.parquet", parquet_columns(m, k))
    return folder


def lerobot_3(folder, motions, **options):
    """All episodes in one file."""
    write_info(folder, "v3.0", **options)
    parts = [parquet_columns(m, k) for k, m in enumerate(motions)]
    joined = {name: [row for part in parts for row in part[name]] for name in parts[0]}
    write_parquet(folder / "data" / "chunk-000" / "file-000.parquet", joined)
    return folder


def lerobot_table(folder, motions):
    """One file of a data set, without its description."""
    parts = [parquet_columns(m, k) for k, m in enumerate(motions)]
    return write_parquet(folder / "episodes.parquet", {n: [r for p in parts for r in p[n]] for n in parts[0]})


def plain_parquet(folder, motions):
    m = motions[0]
    columns = {"time": m.t}
    for k, name in enumerate(NAMES):
        columns |= {f"cmd.{name}": m.qc[:, k], f"state.{name}": m.q[:, k]}
    return write_parquet(folder / "log.parquet", columns)


def aloha(folder, motions):
    import h5py

    m = motions[0]
    with h5py.File(folder / "episode_0.hdf5", "w") as file:
        file.attrs["sim"] = False
        file["action"] = m.with_gripper(m.qc)
        file["observations/qpos"] = m.with_gripper(m.q)
        file["observations/qvel"] = np.gradient(m.with_gripper(m.q), m.t, axis=0)
        file["observations/images/top"] = np.zeros((len(m.t), 4, 6, 3), np.uint8)
    return folder / "episode_0.hdf5"


def two_arms(folder, motions, grippers):
    """As ALOHA writes two arms: the joints of one after those of the other, each with its gripper or without."""
    import h5py

    def beside(values):
        return np.column_stack([m.with_gripper(v) if grippers else v for m, v in zip(motions, values, strict=True)])

    with h5py.File(folder / "both.hdf5", "w") as file:
        file["action"] = beside([m.qc for m in motions])
        file["observations/qpos"] = beside([m.q for m in motions])
    return folder / "both.hdf5"


def robomimic(folder, motions):
    import h5py

    with h5py.File(folder / "demo.hdf5", "w") as file:
        data = file.create_group("data")
        data.attrs["env_args"] = json.dumps({"env_name": "Lift", "env_kwargs": {"control_freq": RATE}})
        for k, m in enumerate(motions):
            data[f"demo_{k}/actions"] = m.with_gripper(m.qc)
            data[f"demo_{k}/obs/robot0_joint_pos"] = m.q
            data[f"demo_{k}/obs/robot0_joint_pos_sin"] = np.sin(m.q)
            data[f"demo_{k}/obs/robot0_eef_pos"] = m.q
    return folder / "demo.hdf5"


def droid(folder, motions):
    import h5py

    m = motions[0]
    with h5py.File(folder / "trajectory.h5", "w") as file:
        file["action/joint_position"] = m.qc
        file["action/cartesian_position"] = np.zeros((len(m.t), 6))
        file["action/gripper_position"] = m.gripper
        file["observation/robot_state/joint_positions"] = m.q
        file["observation/robot_state/gripper_position"] = m.gripper
        file["observation/timestamp/control/step_start"] = (1.7e12 + 1e3 * m.t).astype(np.int64)
    return folder / "trajectory.h5"


class FakeTensor:
    """A tensor of float32, pickled as PyTorch pickles it."""

    def __init__(self, key, values):
        self.key, self.values = key, np.ascontiguousarray(values, np.float32)

    def __reduce_ex__(self, protocol):
        torch = sys.modules["torch"]
        strides = tuple(s // 4 for s in self.values.strides)
        storage = FakeStorage(self.key, self.values.size)
        arguments = (storage, 0, self.values.shape, strides, False, collections.OrderedDict())
        return torch._utils._rebuild_tensor_v2, arguments


@dataclass
class FakeStorage:
    key: str
    size: int


class TorchPickler(pickle.Pickler):
    def persistent_id(self, item):
        if isinstance(item, FakeStorage):
            return ("storage", sys.modules["torch"].FloatStorage, item.key, "cpu", item.size)
        return None


def torch_archive(file, content):
    """A file as torch.save writes it, without PyTorch."""
    torch, utils = types.ModuleType("torch"), types.ModuleType("torch._utils")
    exec("def _rebuild_tensor_v2(): pass", utils.__dict__)  # functions pickle by the module they were made in
    utils._rebuild_tensor_v2.__module__ = "torch._utils"
    torch.FloatStorage = type("FloatStorage", (), {"__module__": "torch"})
    torch._utils = utils
    before = {name: sys.modules.get(name) for name in ("torch", "torch._utils")}
    sys.modules |= {"torch": torch, "torch._utils": utils}
    try:
        stream = io.BytesIO()
        TorchPickler(stream, 2).dump(content)
    finally:
        for name, module in before.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(f"{file.stem}/data.pkl", stream.getvalue())
        archive.writestr(f"{file.stem}/byteorder", "little")
        for tensor in content.values():
            if isinstance(tensor, FakeTensor):
                archive.writestr(f"{file.stem}/data/{tensor.key}", tensor.values.tobytes())
        archive.writestr(f"{file.stem}/version", "3\n")
    return file


def pace(folder, motions):
    m = motions[0]
    content = {"time": m.t, "dof_pos": m.q, "des_dof_pos": m.qc}
    tensors = {name: FakeTensor(str(k), values) for k, (name, values) in enumerate(content.items())}
    return torch_archive(folder / "chirp_data.pt", tensors)


def sage(folder, motions, joints=(*NAMES, "gripper")):
    m = motions[0]
    for table, columns in (
        ("control", {"positions": m.with_gripper(m.qc)}),
        ("state_motor", {"positions": m.with_gripper(m.q), "torques": np.abs(m.with_gripper(m.qc - m.q))}),
    ):
        lines = [",".join(["type", "timestamp", *columns])]
        for k, t in enumerate(m.t):
            cells = [f'"{values[k].tolist()}"' for values in columns.values()]
            lines.append(",".join([table.upper(), repr(float(5.0 + 1e6 * t)), *cells]))
        (folder / f"{table}.csv").write_text("\n".join(lines) + "\n")
    (folder / "joint_list.txt").write_text("\n".join(joints) + "\n")
    return folder


def headerless(folder, motions):
    m = motions[0]
    file = folder / "log.csv"
    np.savetxt(file, np.column_stack([m.t, m.qc, m.q]), delimiter=",", fmt="%.17g")
    return file


def bam(file, t, qc, q, on=None, kp=100):
    keys = ("timestamp", "goal_position", "position", "torque_enable")
    on = np.ones(len(t), bool) if on is None else on
    entries = [dict(zip(keys, (float(a), float(b), float(c), bool(d)))) for a, b, c, d in zip(t, qc, q, on)]
    file.write_text(json.dumps({"mass": 0.49, "length": 0.1, "kp": kp, "motor": "xl330", "entries": entries}))
    return file


def csv(file, columns):
    np.savetxt(file, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="")
    return file


PENDULUM = """<robot name="pendulum"><link name="base"/><link name="arm"><inertial><origin xyz="0 0 -0.1"/>
<mass value="0.5"/><inertia ixx="2e-5" iyy="2e-5" izz="2e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="motor" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="1" velocity="12"/></joint></robot>"""
PENDULUM_SERVO = ["cell.servo.cycle=0.02", "cell.servo.torque={stiffness: 20, damping: 1}"]  # which no URDF states


def pendulum(folder: Path):
    file = folder / "pendulum.urdf"
    file.write_text(PENDULUM)
    return file


def file_of(folder: Path, cell):
    file = folder / "servo_arm.yaml"
    kr5.cell.save_cell(cell, file)
    return file
