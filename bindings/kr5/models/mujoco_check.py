"""What MuJoCo leaves of the measured positions with a model that was written: on the rows kept to judge."""

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

import kr5.cell
import kr5.predict
from kr5 import physics
from kr5.models.mjcf_actuators import AS_FOUND, DryFriction
from kr5.models.mujoco_motion import CommandedMotion, MujocoArm, commands_of
from kr5.models.writing import WrittenModel, composed_model, write_model

TIME_CONSTANTS = (0.02, 0.005)  # of dry friction in MuJoCo, the first its default [s]
IMPEDANCES = (0.9, 0.97, 0.99, 0.997)  # the first its default [-]
SCALES = (0.6, 0.75, 0.9, 1.1, 1.25)  # of frictionloss [-]
NEARER = (0.95, 1.05)  # of the best of them
MOST_FIT_STEPS = 15000  # of MuJoCo, in the motions by which dry friction is chosen
AGREES = 1.01  # ratio of errors below which two simulations are alike, and a choice of friction gains nothing
SHORTEST = 2  # time constants of MuJoCo in steps

Progress = Callable[[float], None]  # share of the work that is done


@dataclass
class MujocoCheck:
    """Errors of positions, RMS over the rows of the experiments to check, one a joint [rad or m]."""

    joints: list[str]
    slides: list[bool]  # whether a joint moves along its axis
    rows: int  # readings of each joint, of which some repeat the one before and are left out
    checked: bool  # whether they are of experiments that were kept to judge; else there are none
    before: list[float]  # MuJoCo with the model as it was read
    own: list[float]  # kr5 with the causes
    after: list[float]  # MuJoCo with the written model
    as_found: list[float] = field(default_factory=list)  # MuJoCo with dry friction as found, where other is written
    friction: DryFriction = AS_FOUND  # that is written
    seconds: float = 0.0  # of computing
    unstable: list[str] = field(default_factory=list)  # of "before", "after": whose motion grows beyond all bounds

    def to_dict(self) -> dict[str, Any]:
        return {**self.__dict__, "friction": dict(self.friction.__dict__)}

    @staticmethod
    def from_dict(data: dict[str, Any]) -> "MujocoCheck":
        return MujocoCheck(**{**data, "friction": DryFriction(**data["friction"])})

    def pooled(self, errors: Sequence[float], slides: bool = False) -> float | None:
        """Over the joints that turn, or those that slide; nothing where there are none [rad or m]."""
        own = [error for error, slide in zip(errors, self.slides) if slide == slides]
        return float(np.sqrt(np.mean(np.square(own)))) if own else None


@dataclass
class _Judged:
    """An experiment with what both simulators say of it."""

    motion: CommandedMotion
    nominal: CommandedMotion
    measured: np.ndarray  # NaN in rows that are not compared
    own: np.ndarray
    check: bool

    def beginning(self, rows: int) -> "_Judged":
        """The first rows."""
        motion, nominal = (replace(m, t=m.t[:rows], command=m.command[:rows]) for m in (self.motion, self.nominal))
        return _Judged(motion, nominal, self.measured[:rows], self.own[:rows], self.check)


def has_commanded_motions(recording: kr5.cell.Recording) -> bool:
    """Whether torque servos move an arm in it."""
    return recording.cell.has_torque_servos and any(_is_commanded(e) for e in recording.experiments)


def confirm_written(
    written: WrittenModel,
    recording: kr5.cell.Recording,
    tuned: kr5.cell.Cell,
    original: Path | None = None,
    base: str = "",
    tip: str = "",
    progress: Progress = lambda share: None,
) -> MujocoCheck:
    """Moves the arm of an MJCF that was written of a tuned cell, and writes it again with the dry friction that fits
    best in MuJoCo, where that is another. original, base, tip: as the model was written."""
    with tempfile.TemporaryDirectory() as folder:
        before = original or _made(Path(folder) / "before.xml", recording.cell)
        after = _made(Path(folder) / "after.xml", tuned, original, base, tip)
        out = check_in_mujoco(recording, tuned, before, after, base, tip, progress)
    if out.friction != AS_FOUND:
        again = write_model(tuned, written.file, original, base, tip, out.friction)
        written.changes, written.notes = again.changes, again.notes
    return out


def _made(file: Path, *of: Any) -> Path:
    """A model for MuJoCo, there at once."""
    file.write_text(composed_model(of[0], file, *of[1:])[1], encoding="utf-8")
    return file


def check_in_mujoco(
    recording: kr5.cell.Recording,
    tuned: kr5.cell.Cell,
    before: Path,
    written: Path,
    base: str = "",
    tip: str = "",
    progress: Progress = lambda share: None,
) -> MujocoCheck:
    """Moves the arm of two MJCF by the commands of a recording.

    before, written: of the cell of the recording, and of the tuned one; base, tip: as both were read. Where MuJoCo
    leaves more than kr5, the dry friction that fits best in it is found on the rows to fit: it belongs into the written
    model, in place of that of the tuned cell.
    """
    start = time.monotonic()
    judged = [_judged(e, recording.cell, tuned) for e in recording.experiments if _is_commanded(e)]
    checked = any(one.check for one in judged)
    check, fit = [x for x in judged if x.check == checked], [x for x in judged if not x.check]
    arm = MujocoArm(written, base, tip)
    first = MujocoArm(before, base, tip)
    fit = _beginnings(fit, MOST_FIT_STEPS * arm.step)
    friction = _best_friction(arm, fit, progress) if arm.rubs and fit else AS_FOUND
    arm.unstable = False  # with other friction does not count
    found = _errors(arm, check, [friction, AS_FOUND])
    before_errors = _rms([first.positions(x.nominal)[0] - x.measured for x in check])
    progress(1.0)
    return MujocoCheck(
        arm.names,
        arm.slides,
        sum(int(np.isfinite(x.measured).all(axis=1).sum()) for x in check),
        checked,
        before_errors,
        _rms([x.own - x.measured for x in check]),
        found[0],
        found[1] if friction != AS_FOUND else [],
        friction,
        time.monotonic() - start,
        [name for name, moved in (("before", first), ("after", arm)) if moved.unstable],
    )


def _is_commanded(e: kr5.cell.Experiment) -> bool:
    return str(e.kind) == "motion" and str(e.joint_reference) == "commanded" and "q1" in e.data.columns


def _judged(e: kr5.cell.Experiment, nominal: kr5.cell.Cell, tuned: kr5.cell.Cell) -> _Judged:
    whole = kr5.cell.with_lead_in(e)
    n, t = nominal.robot.joints, np.asarray(whole["t"])

    def stacked(table: Any, stem: str) -> np.ndarray:
        return np.column_stack([np.asarray(table[f"{stem}{k + 1}"]) for k in range(n)])

    measured, command = stacked(whole, "q"), stacked(whole, "qc")
    measured[: len(t) - len(np.asarray(e["t"]))] = np.nan
    simulator = kr5.predict.FastSimulator()
    own, start = (stacked(simulator.predict(cell, whole), "q") for cell in (tuned, nominal))
    folded = physics.fold_effects(tuned, add_drives=True).cell
    return _Judged(
        commands_of(folded, t, command, own[0]),
        commands_of(nominal, t, command, start[0]),
        measured,
        own,
        str(e.split) == "check",
    )


def _rms(residuals: list[np.ndarray]) -> list[float]:
    return [float(v) for v in np.sqrt(np.nanmean(np.square(np.concatenate(residuals)), axis=0))]


def _errors(arm: MujocoArm, judged: list[_Judged], frictions: Sequence[DryFriction]) -> list[list[float]]:
    """RMS of each joint, for each friction."""
    moved = [arm.positions(x.motion, frictions) for x in judged]
    return [_rms([q[k] - x.measured for q, x in zip(moved, judged)]) for k in range(len(frictions))]


def _best_friction(arm: MujocoArm, fit: list[_Judged], progress: Progress) -> DryFriction:
    """The dry friction by which MuJoCo comes nearest to the measured positions; as it was found, where nothing is
    to gain beside kr5."""
    own = np.maximum(_rms([x.own - x.measured for x in fit]), 1e-9)
    costs: dict[DryFriction, float] = {}

    def best(candidates: list[DryFriction]) -> DryFriction:
        new = [c for c in dict.fromkeys(candidates) if c not in costs]
        errors = _errors(arm, fit, new) if new else []
        costs.update({c: float(np.sqrt(np.mean((np.array(e) / own) ** 2))) for c, e in zip(new, errors)})
        progress(min(0.9, len(costs) / 25))
        return min(costs, key=costs.__getitem__)

    best([AS_FOUND])
    if costs[AS_FOUND] <= AGREES:
        return AS_FOUND
    pairs = [(t, i) for t in TIME_CONSTANTS if t >= SHORTEST * arm.step for i in IMPEDANCES]
    now = best([DryFriction(1.0, *pair) for pair in pairs])
    for scales in (SCALES, NEARER, NEARER):
        now = best([DryFriction(now.scale * s, now.time_constant, now.impedance) for s in scales])
    now = best([DryFriction(now.scale, *pair) for pair in pairs])
    return now if AGREES * costs[now] < costs[AS_FOUND] else AS_FOUND


def _beginnings(fit: list[_Judged], duration: float) -> list[_Judged]:
    """The first experiments, as long as they may last together [s]; the last of them is cut."""
    out = []
    for one in fit:
        rows = int(np.searchsorted(one.motion.t, one.motion.t[0] + duration, side="right"))
        if rows < 2:
            break
        out.append(one.beginning(rows))
        duration -= float(one.motion.t[rows - 1] - one.motion.t[0])
    return [one for one in out if np.isfinite(one.measured).any(axis=0).all()]
