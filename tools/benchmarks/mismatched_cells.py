"""Cells that differ from the one an insertion is told: each draw changes the cell and the setup in which it is run.

What is changed here, no controller reads: effects, chamfers, and the radius of the peg, with the bore left as told."""

import dataclasses
from collections.abc import Callable

import kr5.cell
import kr5.sim
import numpy as np

MM = 1e-3
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
ARM = 0.1  # offsets of torques over those of forces [m]

Draw = Callable[[kr5.cell.Cell, kr5.sim.InsertionSetup, np.random.Generator], None]


@dataclasses.dataclass
class Difference:
    """What differs, in words, and how it is drawn."""

    what: str
    draw: Draw


def servo(cell: kr5.cell.Cell, _: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    """Of the path; its delay counts in whole cycles."""
    assert cell.servo is not None and cell.servo.tool is not None
    told = cell.servo.tool
    for effect, name in (
        ("tool_servo", "natural_frequency"),
        ("tool_damping", "damping_ratio"),
        ("tool_delay", "delay"),
    ):
        cell.set_effect(effect, "servo", name, rng.uniform(0.7, 1.3) * getattr(told, name))


def late_force(cell: kr5.cell.Cell, _: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    cell.set_effect("ft_lag", "force_torque", "time_constant", rng.uniform(0, 0.025))


def sensor(cell: kr5.cell.Cell, _: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    """Each component: scale, offset, and how fast that grows."""
    for component, name in enumerate(WRENCH):
        unit = 1.0 if component < 3 else ARM
        cell.set_effect("ft_gain", name, "gain", rng.uniform(0.9, 1.1))
        cell.set_effect("ft_bias", name, "bias", unit * rng.uniform(-5, 5))
        cell.set_effect("ft_drift", name, "rate", unit * rng.uniform(-0.05, 0.05))


def friction(cell: kr5.cell.Cell, _: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    cell.set_effect("contact_friction", "contact", "friction", rng.uniform(0.08, 0.35))


def tolerance(clearance: float) -> float:
    """Of a radius [m]: that of the grade IT10, less for a close fit."""
    return min(0.02 * MM, 0.2 * clearance)


def radii(cell: kr5.cell.Cell, setup: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    peg, bore = rng.uniform(-1, 1, 2) * tolerance(setup.clearance)
    assert cell.peg is not None and cell.tube is not None
    body = cell.peg
    body.radius += peg
    cell.peg = body
    setup.clearance -= peg
    cell.set_effect("tube_radius", "tube", "inner_radius", cell.tube.inner_radius + bore)


def chamfers(cell: kr5.cell.Cell, _: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    assert cell.peg is not None and cell.tube is not None
    body, tube = cell.peg, cell.tube
    body.chamfer, tube.chamfer = rng.uniform(0, 0.5 * MM, 2)
    cell.peg, cell.tube = body, tube


def play(cell: kr5.cell.Cell, _: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    """In each gear up to an arc minute."""
    for joint in range(cell.robot.joints):
        cell.set_effect("backlash", f"joint{joint + 1}", "gap", rng.uniform(0, 3e-4))


def jitter(cell: kr5.cell.Cell, setup: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    """Of each cycle, in which the controller believes that the same time passes."""
    assert cell.servo is not None
    setup.cycle_jitter = rng.uniform(0, 0.5) * cell.servo.cycle


def wedging(cell: kr5.cell.Cell, setup: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    """A peg that sits tilted in its grip, and rubs: it meets the bore at two points."""
    setup.grip_tilt = np.radians(rng.uniform(0.2, 0.6))
    cell.set_effect("contact_friction", "contact", "friction", rng.uniform(0.35, 0.5))


def slipping(_: kr5.cell.Cell, setup: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    setup.grip_force, setup.grip_torque = rng.uniform(20, 60), rng.uniform(0.5, 2)


SINGLE = [
    Difference("servo: frequency, damping, delay off by up to 30 %", servo),
    Difference("force late by 0 to 25 ms", late_force),
    Difference("force sensor: gain off by up to 10 %, offset by 5 N, drift by 0.05 N/s", sensor),
    Difference("friction 0.08 to 0.35", friction),
    Difference("radii within their tolerance of 0.02 mm, at most a fifth of the clearance", radii),
    Difference("chamfers of 0 to 0.5 mm on peg and tube", chamfers),
    Difference("play in the gears of up to an arc minute", play),
    Difference("cycles longer or shorter by up to half", jitter),
    Difference("wedging: friction 0.35 to 0.5, a peg tilted by 0.2 to 0.6 degrees (a standard deviation)", wedging),
    Difference("peg slips in the grip from 20 to 60 N, turns from 0.5 to 2 N m", slipping),
]


def everything(cell: kr5.cell.Cell, setup: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    for difference in SINGLE:
        if difference.draw is not wedging:  # another friction, beyond what is usual
            difference.draw(cell, setup, rng)


DIFFERENCES = [*SINGLE, Difference("all of these together but wedging", everything)]


def far_off(cell: kr5.cell.Cell, setup: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    assert cell.peg is not None
    distance, turn = cell.peg.radius * rng.uniform(1, 2), rng.uniform(0, 2 * np.pi)
    setup.offset = [distance * np.cos(turn), distance * np.sin(turn)]


def tilted_tube(cell: kr5.cell.Cell, _: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    angle, turn = np.radians(rng.uniform(2, 15)), rng.uniform(0, 2 * np.pi)
    cell.set_effect("tube_tilt", "tube", "tilt", [angle * np.cos(turn), angle * np.sin(turn)])


def tilted_base(cell: kr5.cell.Cell, _: kr5.sim.InsertionSetup, rng: np.random.Generator) -> None:
    """With more, the peg would stand in the tube from the beginning."""
    for name in ("roll", "pitch"):
        cell.set_effect("base_tilt", "base", name, np.radians(rng.uniform(-0.5, 0.5)))


HOPELESS = [
    Difference("tube off by one to two radii of the peg", far_off),
    Difference("tube tilted by 2 to 15 degrees", tilted_tube),
    Difference("base tilted by up to half a degree about each axis", tilted_base),
]
