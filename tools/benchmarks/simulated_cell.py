"""What the simulated cell is to reach, row by row: known recordings, dynamics, contact, energy, wrench and speed.

    python tools/benchmarks/simulated_cell.py [--full] [--quick]

The recordings of known effects are read from FOLDER/cases; with --full they are simulated step by step in DART too,
which takes some minutes. Pinocchio and MuJoCo come from PyPI: pip install 'mujoco<4' pin.
"""

import json
import time

import numpy as np
from kr5.cell import load_cell, load_recording, parse_cell
from kr5.kinematics import Body, Dynamics, SensorCut
from kr5.predict import FastSimulator
from kr5.sim import DrivenArm, DrivenArmOptions
from rich.console import Console

import arguments
import comparison
import contact
import dynamics
import sim_speed
from kr5_tools.gap import command as gap_command

CELL = sim_speed.SHARE / "cells/kr5_arc.yaml"


def recordings(cases, full: bool) -> list[comparison.Row]:
    """The widest column of 300 rows or more of every recording, and whether noise explains what is above 1.05."""
    labels = json.loads((cases / "labels.json").read_text(encoding="utf-8"))
    far, widest, healthy = [], (0.0, ""), (0.0, "")
    for name in comparison.progress(sorted(labels), "full grade" if full else "fast grade"):
        effects = labels[name]["effects"]
        found, _ = gap_command.measure_case(cases / name, effects, full)
        inexact = gap_command.has_inexact(effects)
        far += [
            f"{name} {c.experiment}.{c.column}"
            for c in found.columns
            if gap_command.is_far(c, len(found.columns), inexact)
        ]
        most = max(
            (c.gap, f"{name} {c.experiment}.{c.column}") for c in found.columns if c.rows >= gap_command.ENOUGH_ROWS
        )
        healthy = most if not effects else healthy
        widest = max(widest, most)
    grade = "full" if full else "fast"
    wanted = "1.05, above it what noise explains"
    return [
        comparison.Row(
            f"{len(labels)} recordings, effects set, {grade} grade: widest column",
            f"{widest[0]:.3f}",
            f"{wanted}; wrenches with backlash 2",
            not far,
            f"{widest[1]}; unexplained: {len(far)}",
        ),
        comparison.Row(
            f"the healthy one, {grade} grade",
            f"{healthy[0]:.3f}",
            wanted,
            not any(healthy[1].split()[0] in x for x in far),
            healthy[1],
        ),
    ]


def recording_time(cases):
    """Time of the fast grade on the longest recording, and with a gear that has play."""
    recording = load_recording(cases / "case-006")
    rows = sum(e.data.values.shape[0] for e in recording.experiments)
    play = parse_cell(recording.cell.to_yaml())
    play.set_effect("backlash", "joint2", "gap", 1e-3)
    for cell, what, peer in ((recording.cell, "", "NumPy reference 1.7 s"), (play, ", with backlash", "–")):
        seconds = dynamics.best_time(
            lambda cell=cell: [FastSimulator().predict(cell, e) for e in recording.experiments], 3
        )
        yield comparison.Row(
            f"a recording of {rows} rows, fast grade{what}", f"{seconds:.3f} s", "0.3 s", seconds <= 0.3, peer
        )


def drift(cell, step: float) -> float:
    """Energy that a free swing of 10 s gains or loses, over its greatest kinetic energy."""
    arm = DrivenArm(cell, DrivenArmOptions(step=step))
    arm.reset(sim_speed.START)
    start, least, most, lowest = arm.energy(), 0.0, 0.0, 0.0
    none = np.zeros(len(sim_speed.START))
    chain = Dynamics(cell.nominal_chain(), [Body(**link.to_dict()) for link in cell.robot.links], cell.robot.gravity)
    S = np.array(cell.drives.structure)
    rotors = S.T @ np.diag(cell.drives.rotor_inertia) @ S
    for k in range(round(10 / step)):
        arm.drive(none)
        least, most = min(least, arm.energy() - start), max(most, arm.energy() - start)
        if k % 50 == 0:
            now = arm.read()
            lowest = max(lowest, 0.5 * now.velocity @ (chain.mass_matrix(now.position) + rotors) @ now.velocity)
    return (most - least) / lowest


def energy() -> list[comparison.Row]:
    cell = load_cell(CELL)
    cell.drives = without_friction(cell.drives)
    fine, coarse = drift(cell, 1e-3), drift(cell, 2e-3)
    return [
        comparison.Row(
            "free swing of 10 s at 1 ms, drift of the energy", f"{100 * fine:.3f} %", "0.5 %", fine <= 0.005
        ),
        comparison.Row(
            "the same at 2 ms over 1 ms", f"{coarse / fine:.1f} times", "falls with the step", coarse > fine
        ),
    ]


def without_friction(drives):
    friction = drives.friction
    friction.coulomb, friction.viscous = 0 * friction.coulomb, 0 * friction.viscous
    drives.friction = friction
    return drives


def wrench() -> comparison.Row:
    """Of the arm in motion, against Newton-Euler on the same motion."""
    cell = load_cell(CELL)
    tool = Body(mass=cell.tool.mass, com=cell.tool.com, inertia=cell.tool.inertia)
    chain = Dynamics(cell.nominal_chain(), [Body(**link.to_dict()) for link in cell.robot.links], cell.robot.gravity)
    chain.add_body(len(cell.robot.dh) - 1, tool, cell.tool.T_flange_sensor)
    cut = SensorCut(link=len(cell.robot.dh) - 1, T_link_sensor=cell.tool.T_flange_sensor, body=tool)
    arm = DrivenArm(cell)
    arm.reset(sim_speed.START)
    worst = 0.0
    for k in range(500):
        arm.follow(sim_speed.START + 0.3 * np.sin(6e-3 * k) ** 2)
        now = arm.read()
        expected = -chain.loads(now.position[None], now.velocity[None], now.acceleration[None], cut)[1][0]
        worst = max(worst, np.abs(now.wrench - expected).max())
    return comparison.Row(
        "wrist wrench, greatest difference", f"{worst:.1e} N", "1e-9 N", worst <= 1e-9, "Newton-Euler"
    )


def main() -> int:
    parser = arguments.parser(__doc__, reference=True)
    parser.add_argument("--full", action="store_true", help="the recordings in the full grade too")
    parser.add_argument("--quick", action="store_true", help="few trials")
    given = parser.parse_args()
    cases, start = given.reference / "cases", time.monotonic()
    judged = recordings(cases, False) + (recordings(cases, True) if given.full else [])
    judged += dynamics.all_rows(100_000 if given.quick else 1_000_000)
    judged += contact.all_rows(2000 if given.quick else 20000, Console(width=120))
    judged += [*energy(), wrench(), *recording_time(cases)]
    judged += sim_speed.all_rows(20_000 if given.quick else 100_000)
    comparison.print_comparisons(judged, f"The simulated cell ({time.monotonic() - start:.0f} s)")
    return 0 if all(line.reached for line in judged) else 1


if __name__ == "__main__":
    raise SystemExit(main())
