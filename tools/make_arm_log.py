"""Makes share/data/arm_log: a robot description and a log of the arm, as another program would write them.
`python tools/make_arm_log.py [FOLDER]`

The arm is the KUKA KR5 Arc of share/cells/kr5_arc.yaml with the joint names of its URDF, without motors and servos. The
arm that moved has more friction in one joint than the URDF says, and noise in angles and torques.
"""

import argparse
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import kr5.io
import kr5.predict
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
NAMES = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
FRICTION = 9.0  # of the elbow [N m]; the URDF says none
NOISE = np.array([0.4, 0.5, 0.25, 0.1, 0.06, 0.03])  # of a joint torque [N m]
ANGLE_NOISE = 1e-5  # [rad]
ROWS, STEP, SEED = 1500, 0.01, 7
START = 1_700_000_000.0  # [s]
HOME = np.array([0.1, 0.2, -2.4, 0.3, -0.9, 0.2])  # [rad]
SIZE = np.array([0.5, 0.35, 0.4, 0.6, 0.5, 0.8])  # [rad]
RATE = np.array([1.1, 1.7, 1.4, 2.3, 1.9, 2.9])  # [rad/s]


def described_arm() -> Any:
    """The arm as its URDF states it: bodies and names of joints."""
    cell = kr5.cell.load_cell(ROOT / "share/cells/kr5_arc.yaml")
    robot = cell.robot
    robot.joint_names = NAMES
    return kr5.cell.Cell(robot=robot, tool=cell.tool, name="arm")


def swing(t: np.ndarray) -> np.ndarray:
    """All joints from rest, each at a rate of its own [rad]; a row an instant."""
    start = 1 - np.exp(-(t[:, None] ** 2))
    return HOME + SIZE * (1 - np.cos(RATE * t[:, None])) / 2 * start


def joint_states(cell: Any) -> dict[str, np.ndarray]:
    """Columns as PlotJuggler exports joint states, in alphabetical order."""
    random = np.random.default_rng(SEED)
    t = STEP * np.arange(ROWS)
    q = swing(t)
    experiment = kr5.cell.Experiment(name="motion", kind="motion", file="motion.csv", split="fit")
    experiment.joint_reference = kr5.cell.JointReference("measured")
    experiment.data = kr5.io.Table(["t", *(f"qc{k + 1}" for k in range(6))], np.column_stack([t, q]))
    shown = kr5.predict.FastSimulator().predict(cell, experiment)
    torques = np.column_stack([shown[f"tau{k + 1}"] for k in range(6)]) + random.normal(0, NOISE, q.shape)
    q = q + random.normal(0, ANGLE_NOISE, q.shape)
    out = {"__time": START + t}
    for name in sorted(NAMES):
        k = NAMES.index(name)
        out[f"/joint_states/{name}/position"], out[f"/joint_states/{name}/effort"] = q[:, k], torques[:, k]
    return out


def write(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    arm = described_arm()
    kr5.cell.export_urdf(arm, folder / "arm.urdf")
    true = kr5.cell.parse_cell(arm.to_yaml())
    true.set_effect("coulomb_friction", "joint3", "coulomb", FRICTION)
    columns = joint_states(true)
    digits = ["%.2f", *("%.6f" if "position" in name else "%.3f" for name in list(columns)[1:])]
    np.savetxt(
        folder / "joint_states.csv",
        np.column_stack(list(columns.values())),
        fmt=digits,
        delimiter=",",
        header=",".join(columns),
        comments="",
    )
    (folder / "truth.yaml").write_text(f"coulomb_friction:\n  joint3: {{coulomb: {FRICTION}}}  # elbow_joint [N m]\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "share/data/arm_log")
    write(parser.parse_args().folder)


if __name__ == "__main__":
    main()
