"""Identification on drawn truth: drives, contact stiffness, servo, force/torque sensor and payload; the error over its
stated standard deviation, how often the 95 % interval holds the truth, and the formula of the book beside it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from kr5 import cell as kr5_cell
from kr5 import identification, kinematics
from kr5.logs.joint_motion import arm_model
from kr5.tables.options import TableOptions

from comparison import Row, exact_interval, format_rate, progress
from kr5_tools.identify.drives import read_readings
from kr5_tools.identify.identified_cell import believed_parameters, standard_parameters

SHARE = Path(__file__).resolve().parents[2] / "share"
KR5 = SHARE / "cells/kr5_arc.yaml"
GEARS = (125.04, 125.05, 86.98, 74.59, 42.00, 24.13)  # of Table B.2
FORCE_NOISE, TORQUE_NOISE, PATH_NOISE = 0.15, 0.008, 5e-5  # [N], [N m], [m]
NORMAL_95 = 1.96
Draw = Callable[[np.random.Generator], tuple[np.ndarray, np.ndarray, np.ndarray]]


def structure_rows() -> list[Row]:
    readings = read_readings(SHARE / "data/drives/kr5_table_b2.csv", TableOptions(angle="deg"))
    found = identification.identify_drives(readings, identification.DriveOptions(common_zero=True))
    ratios = np.diag(np.asarray(found.structure))
    rows = [
        Row(
            "structure matrix: ratios of Table B.2",
            " ".join(f"{x:.2f}" for x in ratios),
            "within 1 %",
            bool((np.abs(ratios / GEARS - 1) < 0.01).all()),
            " ".join(f"{x:.2f}" for x in GEARS) + " (wanted)",
            "σ " + " ".join(f"{x:.2f}" for x in np.diag(np.asarray(found.sigma))),
        )
    ]
    S = np.diag(GEARS)
    S[4, 3] = S[5, 3] = -1.0
    S[5, 4] = 1.0
    random = np.random.default_rng(3)
    q = random.uniform(-1, 1, (40, 6))
    noisy = identification.DriveReadings(motor=q @ S.T, joint=q + random.normal(0, np.radians(0.005), q.shape))
    got = np.asarray(identification.identify_drives(noisy).structure)
    worst = float(np.abs(got[S != 0] / S[S != 0] - 1).max())
    exact = bool(((got != 0) == (S != 0)).all())
    rows.append(
        Row(
            "structure matrix: couplings of a synthetic log",
            f"worst element {100 * worst:.2g} % off, {'no' if exact else 'a'} false or missed coupling",
            "within 1 %, none false",
            exact and worst < 0.01,
        )
    )
    return rows


def judged_rows(what: str, names: tuple[str, ...], draw: Draw, trials: int, seed: int, formula: str = "–") -> list[Row]:
    """A row a parameter. `draw` gives error and standard deviation of each, and the error by the formula of the
    book."""
    random, errors, sigmas, book = np.random.default_rng(seed), [], [], []
    for _ in progress(range(trials), what):
        error, sigma, by_formula = draw(random)
        errors.append(error)
        sigmas.append(sigma)
        book.append(by_formula)
    e, s, b = np.array(errors), np.array(sigmas), np.array(book)
    out = []
    for k, name in enumerate(names):
        inside = int((np.abs(e[:, k]) < NORMAL_95 * s[:, k]).sum())
        low, high = exact_interval(inside, trials)
        rate = inside / trials
        peer = "–"
        if k < b.shape[1] and np.isfinite(b[:, k]).any():
            seen = np.isfinite(b[:, k])
            factor = np.sqrt((b[seen, k] ** 2).mean() / (e[seen, k] ** 2).mean())
            peer = f"{formula}: RMS error {factor:.2f} times ours ({seen.sum()} of {trials})"
        out.append(
            Row(
                f"{what}: {name}",
                f"RMS error {np.sqrt((e[:, k] ** 2).mean()):.3g}, {np.sqrt(((e / s)[:, k] ** 2).mean()):.3f} σ;"
                f" inside 95 %: {inside} of {trials}",
                "0.93 to 0.97 inside",
                0.93 <= rate <= 0.97 if trials >= 2000 else bool(high >= 0.93 and low <= 0.97),
                peer,
                format_rate(inside, trials),
            )
        )
    return out


def draw_contact(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ten readings 0.1 mm apart, as in the book; relative error of the stiffness."""
    k, touch = np.exp(random.uniform(np.log(8e3), np.log(60e3))), random.uniform(-2e-4, 2e-4)
    depth = np.linspace(-2.5e-4, 6.5e-4, 10)
    force = k * np.maximum(depth - touch, 0) + random.normal(0, FORCE_NOISE, 10)
    found = identification.identify_contact_stiffness(identification.ContactLog(depth=depth, force=force))
    assert found.fit.usable, found.fit.message
    pressed = depth > touch + 5e-5
    book = float(np.mean(force[pressed] / (depth[pressed] - touch)))
    sigma = np.sqrt(np.diag(np.asarray(found.covariance)))
    return (
        np.array([found.stiffness / k - 1, found.position - touch]),
        np.array([sigma[0] / k, sigma[1]]),
        np.array([book / k - 1]),
    )


def draw_servo(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A step of 24 mm at 12 ms."""
    servo = kr5_cell.SecondOrder(
        natural_frequency=random.uniform(2, 8),
        damping_ratio=random.uniform(0.5, 0.85),
        delay=random.uniform(0.01, 0.06),
    )
    t = 0.012 * np.arange(500)
    command = np.where(t > 0.2, 0.024, 0.0)
    log = identification.ServoLog(t=t, command=command, response=step_response(servo, t - 0.204, 0.024))
    log.response = np.asarray(log.response) + random.normal(0, PATH_NOISE, len(t))
    found = identification.identify_servo(log)
    assert found.fit.usable, found.fit.message
    sigma = np.sqrt(np.diag(np.asarray(found.covariance)))[:3]
    book = np.full(2, np.nan)
    if (seen := found.overshoot) is not None:
        book = np.array([seen.natural_frequency - servo.natural_frequency, seen.damping_ratio - servo.damping_ratio])
    got = found.servo
    error = [
        got.natural_frequency - servo.natural_frequency,
        got.damping_ratio - servo.damping_ratio,
        got.delay - servo.delay,
    ]
    return np.array(error), sigma, book


def step_response(servo: Any, t: np.ndarray, size: float) -> np.ndarray:
    """Of a damped second-order system in closed form, a step at t = 0."""
    w, zeta = servo.natural_frequency, servo.damping_ratio
    wd, s = w * np.sqrt(1 - zeta**2), np.maximum(t - servo.delay, 0)
    decay = np.exp(-zeta * w * s) * (np.cos(wd * s) + zeta / np.sqrt(1 - zeta**2) * np.sin(wd * s))
    return np.asarray(size * np.where(t > servo.delay, 1 - decay, 0.0))


def draw_force_torque(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Twenty postures of a tool at rest. The simple way beside it: bias as the mean, mass from the sizes of forces."""
    mass, com = random.uniform(0.5, 5), random.uniform(-0.1, 0.1, 3)
    bias = np.concatenate([random.normal(0, 3, 3), random.normal(0, 0.2, 3)])
    gravity = random.normal(size=(20, 3))
    gravity *= 9.81 / np.linalg.norm(gravity, axis=1)[:, None]
    wrench = np.hstack([mass * gravity, np.cross(mass * com, gravity)]) + bias
    wrench += random.normal(size=wrench.shape) * np.repeat([FORCE_NOISE, TORQUE_NOISE], 3)
    readings = [identification.ForceTorqueReading(wrench=w, gravity=g) for w, g in zip(wrench, gravity, strict=True)]
    found = identification.identify_force_torque(readings)
    assert found.fit.usable, found.fit.message
    told = {p.name: p for p in found.parameters}
    got = [told["tool.mass"], told["bias.fz"], told["bias.tx"]]
    by_mean = np.linalg.norm(wrench[:, :3] - wrench[:, :3].mean(0), axis=1).mean() / 9.81
    return (
        np.array([p.value for p in got]) - [mass, bias[2], bias[3]],
        np.array([p.std for p in got]),
        np.array([by_mean - mass, wrench[:, 2].mean() - bias[2], wrench[:, 3].mean() - bias[3]]),
    )


class PayloadDraw:
    """The KR5 in a motion designed for it, once without a load and once with: both with noise of their own."""

    def __init__(self) -> None:
        cell = kr5_cell.load_cell(KR5)
        options = identification.ExcitationOptions(duration=15.0, starts=5, exchanges=150)
        design = identification.design_excitation(cell, identification.motion_limits(cell), options)
        assert design.fit.usable, design.fit.message
        self.motion = design.motion.sampled(0.012)
        self.model = arm_model(cell, [identification.JointTerms()] * cell.robot.joints)
        self.regressor = identification.DynamicsRegressor(self.model)
        self.chi = believed_parameters(cell, self.model)
        self.bare = np.asarray(self.regressor.torques(self.motion, self.chi))
        self.sigma = 0.02 * np.sqrt((self.bare**2).mean(0))

    def torques(self, exact: np.ndarray, random: np.random.Generator) -> Any:
        m = self.motion
        tau = exact + random.normal(size=exact.shape) * self.sigma
        return identification.JointMotion(t=m.t, q=m.q, qd=m.qd, qdd=m.qdd, tau=tau)

    def __call__(self, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        mass, com = random.uniform(0.5, 5), random.uniform((-0.1, -0.1, 0.0), (0.1, 0.1, 0.2))
        body = kinematics.Body(mass=mass, com=com, inertia=[0.01 * mass] * 3 + [0.0] * 3)
        chi = self.chi.copy()
        chi[13 * 5 : 13 * 5 + 10] += standard_parameters(body)
        loaded = self.torques(np.asarray(self.regressor.torques(self.motion, chi)), random)
        arm = identification.identify_dynamics(
            self.torques(self.bare, random), self.model, identification.DynamicsOptions(held_out=0.0)
        )
        found = identification.identify_payload(loaded, arm)
        assert found.fit.usable, found.fit.message
        error = [found.body.mass - mass, *(np.asarray(found.body.com) - com)]
        return np.array(error), np.array([found.mass_deviation, *np.asarray(found.com_deviation)]), np.empty(0)


def drawn_rows(trials: int) -> list[Row]:
    servo = ("natural frequency (rad/s)", "damping ratio", "delay (s)")
    payload = ("mass (kg)", "centre x (m)", "centre y (m)", "centre z (m)")
    return [
        *judged_rows(
            "contact", ("stiffness, relative", "position (m)"), draw_contact, trials, 21, "mean of F / depth, z_e known"
        ),
        *judged_rows("servo", servo, draw_servo, trials, 22, "eqs. 5.11, 5.12"),
        *judged_rows(
            "force/torque", ("mass (kg)", "bias fz (N)", "bias tx (N m)"), draw_force_torque, trials, 23, "means"
        ),
        *judged_rows("payload, with and without it", payload, PayloadDraw(), trials, 24),
    ]
