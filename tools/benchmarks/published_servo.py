"""Published models of one servo with a pendulum, simulated under the commands of a log: friction that grows with the
load, with Stribeck's part (m4) and without (m3).

M. Duclusaud, G. Passault, V. Padois, O. Ly, "Extended friction models for the physics simulation of servo actuators",
2024; parameters of the XL330: github.com/Rhoban/bam, commit 11bb7ecc3b64cfb7d719515a1ef09b7b7adbd2d2, bam/params/xl330.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

GRAVITY = 9.80665  # [m/s^2]
DUTY = 0.00246  # duty cycle for an error of 1 rad and a firmware gain of 1
STEP = 1e-3  # of the simulation [s]


@dataclass(frozen=True)
class PublishedServo:
    """A motor with its gear and its friction."""

    name: str
    constant: float  # [N m/A]
    resistance: float  # [Ohm]
    inertia: float  # of the rotor, behind the gear [kg m^2]
    zero: float  # of the pendulum [rad]
    dry: float  # [N m]
    load: float  # share of the torque that the gear bears
    viscous: float  # [N m s/rad]
    stribeck: float = 0.0  # [N m]
    load_stribeck: float = 0.0
    stribeck_speed: float = 1.0  # [rad/s]


XL330 = (
    PublishedServo("m3", 0.29146661, 2.0, 2.5961313e-3, 0.015547202, 2.3196918e-3, 0.26407735, 0.016903884),
    PublishedServo(
        "m4",
        *(0.29154500, 2.0, 2.5782541e-3, 0.015495013, 2.1521768e-3, 0.25158745, 0.017819711),
        *(4.1427839e-4, 0.052028476, 0.11780577),
    ),
)


def mean_errors(servo: PublishedServo, file: Path) -> np.ndarray:
    """Sizes of what a model leaves of the positions in a log of BAM [rad]."""
    log = json.loads(file.read_text(encoding="utf-8"))
    entries = [e for e in log["entries"] if e["torque_enable"]]
    t, goal, measured = (np.array([e[key] for e in entries]) for key in ("timestamp", "goal_position", "position"))
    return np.abs(positions(servo, log, t, goal, measured[0]) - measured)


def positions(
    servo: PublishedServo, log: dict[str, float], t: np.ndarray, goal: np.ndarray, start: float
) -> np.ndarray:
    """Where the pendulum is at the times of a log [rad], from rest."""
    mass, length = log["mass"], log["length"]
    inertia = mass * length**2 + servo.inertia
    at = np.arange(t[0], t[-1] + STEP, STEP)
    wanted = goal[np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 1)]
    out, q, speed = np.empty(len(at)), start, 0.0
    for k, command in enumerate(wanted):
        out[k] = q
        volts = log["vin"] * np.clip(log["kp"] * DUTY * (command - q), -1.0, 1.0)
        motor = servo.constant * (volts - servo.constant * speed) / servo.resistance
        driving = motor - mass * GRAVITY * length * np.sin(q + servo.zero)
        stop = driving + inertia * speed / STEP  # the torque that would stop it within the step
        speed += (
            STEP * (driving - np.sign(stop) * min(abs(stop), friction(servo, driving - 2 * motor, speed))) / inertia
        )
        q += STEP * speed
    return np.interp(t, at, out)


def friction(servo: PublishedServo, borne: float, speed: float) -> float:
    """What friction can hold [N m]; borne: the torque of the load minus that of the motor, which the gear bears."""
    slow = np.exp(-abs(speed) / servo.stribeck_speed)
    load = (servo.load + servo.load_stribeck * slow) * abs(borne)
    return float(servo.dry + servo.stribeck * slow + load + servo.viscous * abs(speed))
