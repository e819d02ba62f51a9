"""Steps a second of the simulated cell on one core, beside MuJoCo: the arm with its drives, and a roll with contact.

    python tools/benchmarks/sim_speed.py [--steps 100000]

MuJoCo comes from PyPI: pip install 'mujoco<4'. Its arm has the same links, rotor inertias on the diagonal (it knows no
coupled gears), friction and gravity, and position actuators; its roll is the same peg on a tube of boxes. Processor
time counts: the machine may be busy with others.
"""

import time
from pathlib import Path

import numpy as np
from kr5.cell import load_cell
from kr5.robot import RobotCommand
from kr5.sim import DrivenArm, WorkCell, run_scene

import arguments
import comparison

SHARE = Path(__file__).resolve().parents[2] / "share"
START = np.array([0.2, 0.3, -2.6, 0.4, -0.5, 0.3])
SEGMENTS = 32  # boxes of MuJoCo's tube
WANTED = {"servos": 150_000, "currents": 150_000, "roll": 50_000}  # steps/s


def steps_per_second(run, steps: int, repeat: int = 3) -> float:
    """Most steps a second of several runs."""
    times = []
    for _ in range(repeat):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return steps / min(times)


def arm_xml(cell) -> str:
    body, close = "", ""
    S = np.array(cell.drives.structure)
    armature = np.diag(S.T @ np.diag(cell.drives.rotor_inertia) @ S)
    place = "0 0 0"
    quaternion = "1 0 0 0"
    for i, (row, link) in enumerate(zip(cell.robot.dh, cell.robot.links)):
        T = row.transform(0.0)
        com = T[:3, :3] @ link.com + T[:3, 3]
        inertia = T[:3, :3] @ link.inertia_matrix() @ T[:3, :3].T
        full = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
        body += (
            f'<body pos="{place}" quat="{quaternion}"><joint name="j{i}" axis="0 0 1" armature="{armature[i]}" '
            f'frictionloss="{cell.drives.friction.coulomb[i]}" damping="{cell.drives.friction.viscous[i]}"/>'
            f'<inertial pos="{format_values(com)}" mass="{link.mass}" fullinertia="{format_values(full)}"/>'
        )
        close += "</body>"
        place, quaternion = format_values(T[:3, 3]), format_values(quaternion_of(T[:3, :3]))
    actuators = "".join(f'<position joint="j{i}" kp="{2000 * a}" kv="{75 * a}"/>' for i, a in enumerate(armature + 1))
    return (
        f'<mujoco><compiler boundmass="1e-6"/><option timestep="0.001"/><worldbody>{body}{close}</worldbody>'
        f"<actuator>{actuators}</actuator></mujoco>"
    )


def roll_xml(cell) -> str:
    tube, peg = cell.tube, cell.peg
    middle, half = (tube.inner_radius + tube.outer_radius) / 2, (tube.outer_radius - tube.inner_radius) / 2
    boxes = ""
    for angle in np.arange(SEGMENTS) * 2 * np.pi / SEGMENTS:
        boxes += (
            f'<geom type="box" size="{half} {middle * np.tan(np.pi / SEGMENTS)} {tube.depth / 2}"'
            f' pos="{middle * np.cos(angle)} {middle * np.sin(angle)} {-tube.depth / 2}" euler="0 0'
            f' {np.degrees(angle)}"/>'
        )
    return (
        f'<mujoco><option timestep="0.00025"/><worldbody>{boxes}<body pos="0.001 0 0.003">'
        f'<joint name="z" type="slide" axis="0 0 1"/><geom type="cylinder" size="{peg.radius} {peg.length / 2}" '
        f'pos="0 0 {peg.length / 2}" euler="0 7.5 0" mass="2.4"/></body></worldbody></mujoco>'
    )


def format_values(values) -> str:
    return " ".join(f"{v:.12g}" for v in values)


def quaternion_of(R: np.ndarray) -> np.ndarray:
    w, v = np.linalg.eigh(
        np.array(
            [  # of the largest eigenvalue (Bar-Itzhack 2000)
                [R[0, 0] - R[1, 1] - R[2, 2], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0], R[2, 1] - R[1, 2]],
                [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], R[1, 2] + R[2, 1], R[0, 2] - R[2, 0]],
                [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], R[1, 0] - R[0, 1]],
                [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R[0, 0] + R[1, 1] + R[2, 2]],
            ]
        )
    )
    x, y, z, s = v[:, np.argmax(w)]
    return np.array([s, x, y, z])


def mujoco_rate(xml: str, steps: int, prepare) -> float:
    import mujoco

    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    prepare(data)
    return steps_per_second(lambda: mujoco.mj_step(model, data, nstep=steps), steps)


def all_rows(steps: int) -> list[comparison.Row]:
    """What is measured, judged."""
    cell = load_cell(SHARE / "cells/kr5_arc.yaml")
    command = START + 0.1 * np.sin(np.linspace(0, 20, steps))[:, None]
    arm = DrivenArm(cell)

    def servos() -> None:
        arm.reset(START)
        arm.follow_rows(command)

    def currents() -> None:
        arm.reset(START)
        arm.drive_rows(np.zeros((steps // 10, 6)))

    world = WorkCell(cell)
    steps_a_cycle = round(world.cycle / arm.step)

    def cycles() -> None:
        for _ in range(steps // 10 // steps_a_cycle):
            world.read()
            world.send(RobotCommand())

    scene = SHARE / "scenes/peg_roll.yaml"
    ours = {
        "servos": steps_per_second(servos, steps),
        "currents": steps_per_second(currents, steps // 10),
        "roll": steps_per_second(lambda: run_scene(scene), run_scene(scene).steps),
        "world": steps_per_second(cycles, steps // 10),
    }

    def at_start(data) -> None:
        data.qpos[:] = START
        data.ctrl[:] = START

    def pushed(data) -> None:
        data.qfrc_applied[:] = 2.4 * 9.81 - 15.0

    theirs = {
        "servos": mujoco_rate(arm_xml(cell), steps, at_start),
        "roll": mujoco_rate(roll_xml(cell), steps // 4, pushed),
    }
    what = {
        "servos": "arm, drives, servos; torques, currents and wrench each step",
        "currents": "arm under motor currents with dry friction; the same each step",
        "roll": "peg rolled on the tube, contact",
        "world": "work cell at rest, a reading and a command each 12 ms",
    }
    out = []
    for name, value in ours.items():
        wanted, other = WANTED.get(name), theirs.get(name)
        out.append(
            comparison.Row(
                f"steps/s: {what[name]}",
                f"{value:.0f}",
                f"{wanted}" if wanted else "–",
                wanted is None or value >= wanted,
                f"MuJoCo {other:.0f}" if other else "–",
            )
        )
    return out


def main() -> int:
    parser = arguments.parser(__doc__)
    parser.add_argument("--steps", type=int, default=100_000)
    judged = all_rows(parser.parse_args().steps)
    comparison.print_comparisons(judged, "Speed of the simulated cell")
    return 0 if all(line.reached for line in judged) else 1


if __name__ == "__main__":
    raise SystemExit(main())
