"""The log of an arm on torque servos, and models of it, for tests: needs MuJoCo, which reads them."""

import kr5.cell
import kr5.io
import kr5.predict
import numpy as np
from kr5.models.reading import read_model

ARM = """<mujoco model="two links"><compiler angle="radian"/><option timestep="0.005"/>
  <worldbody><body name="upper" pos="0 0 0.1">
    <joint name="shoulder" axis="0 1 0" armature="{armature}" frictionloss="{dry}"/>
    <inertial pos="0.06 0 0" mass="0.2" diaginertia="1e-4 2e-4 2e-4"/>
    <body name="lower" pos="0.12 0 0">
      <joint name="elbow" axis="0 1 0" armature="{armature}" frictionloss="{dry}"/>
      <inertial pos="0.05 0 0" mass="0.1" diaginertia="1e-4 2e-4 2e-4"/></body></body></worldbody>
  <actuator><position name="a" joint="shoulder" kp="{kp}" kv="{kv}"/>
    <position name="b" joint="elbow" kp="{kp}" kv="{kv}"/></actuator>
</mujoco>
"""
TRUE = {"armature": 0.02, "dry": 0.05, "kp": 18.0, "kv": 0.8}
MODEL = {"armature": 0.001, "dry": 0.0, "kp": 900.0, "kv": 5.0}


def write_servo_log(folder):
    """`log.csv` of the arm of `true.xml` in rounded positions, and `model.xml` whose gains are fifty times too high."""
    (folder / "true.xml").write_text(ARM.format(**TRUE))
    (folder / "model.xml").write_text(ARM.format(**MODEL))
    t = 0.02 * np.arange(1500)
    rise = np.clip(t - 1.0, 0.0, 2.0) / 2.0
    swing = [0.5 * np.sin(1.7 * t) + 0.15 * np.sin(6.1 * t), 0.6 * np.sin(1.1 * t + 1.0) + 0.15 * np.sin(7.3 * t)]
    command = np.column_stack([rise * s for s in swing])
    motion = kr5.cell.Experiment(name="m", kind="motion", file="m.csv", split="fit")
    motion.data = kr5.io.Table(["t", "qc1", "qc2"], np.column_stack([t, command]))
    shown = kr5.predict.FastSimulator().predict(read_model(folder / "true.xml").cell, motion)
    tick = 2 * np.pi / 4096
    measured = np.column_stack([np.round(np.asarray(shown[f"q{k}"]) / tick) * tick for k in (1, 2)])
    head = "time,cmd_shoulder,cmd_elbow,position_shoulder,position_elbow"
    np.savetxt(folder / "log.csv", np.column_stack([t, command, measured]), delimiter=",", header=head, comments="")
