"""Public logs of real servos through `kr5 gap diagnose`: an SO-101 from either of its published models, and one XL330
with a pendulum."""

import json
import shlex
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import kr5.cell
import kr5.io
import kr5.physics
import kr5.predict
import numpy as np
from kr5.logs import MotionLog, read_motion_log
from kr5.models.mjcf_actuators import STATED_SERVOS
from kr5.models.mujoco_motion import CommandedMotion, MujocoArm
from kr5.models.reading import read_model

from comparison import Row
from gap_command import Answer, run_gap
from published_servo import XL330, mean_errors

SO101 = "data/servo_so101_sage"
PENDULUM = "data/servo_xl330_bam"
FITTED = 4  # of 12 motions of the SO-101
BETTER = 1.9  # times lower than the better nominal model
FOREIGN = ("payload", "link_mass", "link_com", "torque_ripple")  # which a sound arm of known links does not have
SURE = 2.0  # standard deviations of a difference
STARTS = shlex.split(STATED_SERVOS)  # as the error names them


def found_delay(answer: Answer) -> float:
    """Of the commands, which no MJCF holds [s]."""
    for cause in answer.data.get("causes", []):
        if cause["effect"] == "joint_delay":
            return float(np.ravel(cause["parameters"]["delay"]["value"])[0])
    return 0.0


def kr5_positions(cell: kr5.cell.Cell, motion: MotionLog, gain: float = 1.0) -> np.ndarray:
    """Where kr5 sees the arm of a cell, rows x joints [rad]. gain: of the firmware, that is the servo of the cell."""
    assert motion.commands is not None, "asked for with commands"
    joints = range(cell.robot.joints)
    experiment = kr5.cell.Experiment(name="m", kind="motion", file="m.csv", split="check")
    names = ["t", *(f"{stem}{k + 1}" for stem in ("qc", "q") for k in joints)]
    columns = [motion.times, motion.commands, motion.positions]
    if motion.servo_gain is not None:
        names, columns = [*names, "servo_gain"], [*columns, motion.servo_gain / gain]
    experiment.data = kr5.io.Table(names, np.column_stack(columns))
    shown = kr5.predict.FastSimulator().predict(cell, experiment)
    return np.column_stack([shown[f"q{k + 1}"] for k in joints])


def mujoco_positions(file: Path, motion: MotionLog, delay: float) -> np.ndarray:
    assert motion.commands is not None, "asked for with commands"
    arm, start = MujocoArm(file), motion.positions[0]
    given = CommandedMotion(motion.times, motion.commands, start, [delay] * len(start))
    return np.asarray(arm.positions(given)[0])


def mean_error(found: Sequence[np.ndarray], motions: Sequence[MotionLog]) -> float:
    """Over all rows and joints of all motions [rad]."""
    return float(
        np.mean(np.concatenate([np.abs(q - m.positions).ravel() for q, m in zip(found, motions, strict=True)]))
    )


# The arm


@dataclass
class FromModel:
    """What came of one nominal model."""

    name: str
    answer: Answer
    before: float  # mean absolute error of the model in MuJoCo on the motions to judge [rad]
    after: float = np.nan  # of the written one
    own: float = np.nan  # of the tuned cell in kr5
    tuned: kr5.cell.Cell | None = None


def nominal_models(folder: Path) -> dict[str, str]:
    """The MJCF as it is published, and with the servos of the defaults that are published beside it."""
    text = (folder / "so101_new_calib.xml").read_text(encoding="utf-8")
    given = ElementTree.fromstring((folder / "joints_properties.xml").read_text(encoding="utf-8"))
    root = ElementTree.fromstring(text)
    servos = {element.get("class"): element for element in given.iter("default")}["sts3215"]
    for default in root.iter("default"):
        for element in servos if default.get("class") == "sts3215" else ():
            if (own := default.find(element.tag)) is not None and element.tag in ("joint", "position"):
                own.attrib.update(element.attrib)
    return {"kp 998": text, "kp 17.8": ElementTree.tostring(root, encoding="unicode")}


def so101_rows(folder: Path, number: int | None = None) -> list[Row]:
    """number: of motions, where not all are wanted."""
    motions = sorted(p for p in folder.iterdir() if (p / "control.csv").is_file()) if folder.is_dir() else []
    if not motions:
        return []
    motions = motions[:number]
    fitted = FITTED if number is None else max(1, number // 3)
    found = [from_model(name, text, motions, fitted) for name, text in nominal_models(folder).items()]
    best = min(one.before for one in found)
    rows = [row for one in found for row in arm_rows(one, best, f"{fitted} of {len(motions)} motions fitted")]
    return [*rows, agreement_row(found)]


def from_model(name: str, text: str, motions: Sequence[Path], fitted: int) -> FromModel:
    with tempfile.TemporaryDirectory() as made:
        place = Path(made)
        (place / "nominal.xml").write_text(text, encoding="utf-8")
        judged_by = ",".join(p.name for p in motions[fitted:])
        answer = run_gap(
            "diagnose", place, *motions, "--model", "nominal.xml", "--check", judged_by, "--write-model", "tuned.xml",
            "--write-cell", "tuned.yaml",
        )  # fmt: skip
        cell = read_model(place / "nominal.xml").cell
        judged = [read_motion_log(p, cell) for p in motions[fitted:]]
        out = FromModel(
            name, answer, mean_error([mujoco_positions(place / "nominal.xml", m, 0.0) for m in judged], judged)
        )
        if answer.code == 0:
            delay, out.tuned = found_delay(answer), kr5.cell.load_cell(place / "tuned.yaml")
            out.after = mean_error([mujoco_positions(place / "tuned.xml", m, delay) for m in judged], judged)
            out.own = mean_error([kr5_positions(out.tuned, m) for m in judged], judged)
    return out


def arm_rows(one: FromModel, best: float, which: str) -> list[Row]:
    what = f"SO-101 from the model of {one.name}, {which}"
    if one.tuned is None:
        return [Row(what, f"refused: {one.answer.refusal}", f"≥ {BETTER} times lower", False)]
    ratio, causes = best / one.after, [effect for effect, _ in one.answer.causes]
    servo, rubs = (any(word in effect for effect in causes) for word in ("servo", "friction"))
    foreign = sorted({effect for effect in causes if effect in FOREIGN})
    used = f"{one.answer.seconds:.0f} s, {one.answer.memory:.2f} GiB"
    return [
        Row(
            f"{what}: mean absolute position error on the others, written XML in MuJoCo",
            f"{1e3 * one.after:.3g} mrad, {ratio:.2f} times lower; kr5 {1e3 * one.own:.3g} mrad; {used}",
            f"≥ {BETTER} times lower than the better nominal model",
            ratio >= BETTER,
            f"better nominal model {1e3 * best:.3g} mrad, this one {1e3 * one.before:.3g}",
        ),
        Row(
            f"{what}: causes",
            f"{one.answer.data['verdict']}: " + ", ".join(f"{e} {t}" for e, t in one.answer.causes),
            f"servo and friction, none of {', '.join(FOREIGN)}",
            servo and rubs and not foreign,
        ),
    ]


def agreement_row(found: Sequence[FromModel]) -> Row:
    """Whether both models end at the same values."""
    what, wanted = "SO-101: values from both models", "all within their uncertainty (two standard deviations)"
    first, second = found
    if first.tuned is None or second.tuned is None:
        return Row(what, "one was refused", wanted, False)
    values, others = joint_values(first), joint_values(second)
    apart = [
        f"{key} {a:.3g} and {b:.3g}"
        for key, (a, std) in values.items()
        if abs(a - (b := others[key][0])) > SURE * np.hypot(std, others[key][1])
    ]
    text = f"{len(values) - len(apart)} of {len(values)}" + (f"; apart: {', '.join(apart)}" if apart else "")
    return Row(what, text, wanted, not apart)


def joint_values(one: FromModel) -> dict[str, tuple[float, float]]:
    """Stiffness and dry friction of each joint, and their standard deviations (0: as the model states them)."""
    assert one.tuned is not None, "asked for with a cell"
    cell = kr5.physics.fold_effects(one.tuned, add_drives=True).cell
    assert cell.servo is not None and cell.drives is not None, "of a cell with torque servos"
    stds = {(c["effect"], c["target"]): c["parameters"] for c in one.answer.data["causes"]}

    def std(effect: str, joint: int, parameter: str) -> float:
        found: dict[str, Any] = stds.get((effect, f"joint{joint + 1}"), {})
        return float(np.ravel(found[parameter]["std"])[0]) if parameter in found else 0.0

    out = {}
    for k, name in enumerate(cell.robot.joint_names):
        out[f"stiffness of {name}"] = (cell.servo.torque_of(k).stiffness, std("servo_stiffness", k, "stiffness"))
        out[f"friction of {name}"] = (float(cell.drives.friction.coulomb[k]), std("coulomb_friction", k, "coulomb"))
    return out


# The pendulum


def pendulum_rows(folder: Path) -> list[Row]:
    """Fitted on the logs of one gain of the firmware and judged by those of the other, both ways."""
    logs: dict[int, list[Path]] = {}
    for file in sorted(folder.glob("*.json")):
        logs.setdefault(int(json.loads(file.read_text(encoding="utf-8"))["kp"]), []).append(file)
    pairs = [(gain, other) for gain in logs for other in logs if other != gain]
    return [pendulum_row(folder / "pendulum.urdf", gain, logs[gain], other, logs[other]) for gain, other in pairs]


def pendulum_row(model: Path, gain: int, fitted: Sequence[Path], other: int, judged: Sequence[Path]) -> Row:
    what = f"XL330, fitted on {len(fitted)} motions of gain {gain} and judged on {len(judged)} of gain {other}"
    wanted = "load_friction before Stribeck; error below the best published model's; ≤ 10 s"
    with tempfile.TemporaryDirectory() as made:
        place = Path(made)
        for file in (model, *fitted, *judged):
            shutil.copy(file, place)
        names, judged_by = [f.name for f in (*fitted, *judged)], ",".join(f.name for f in judged)
        answer = run_gap(
            "diagnose", place, *names, "--model", model.name, *STARTS, "--check", judged_by,
            "--write-cell", "tuned.yaml",
        )  # fmt: skip
        if answer.code != 0:
            return Row(what, f"refused: {answer.refusal}", wanted, False)
        tuned = kr5.cell.load_cell(place / "tuned.yaml")
        motions = [read_motion_log(f, tuned) for f in judged]
    error = float(np.mean(np.concatenate([errors_while_on(tuned, m, gain) for m in motions])))
    peers = {servo.name: float(np.mean(np.concatenate([mean_errors(servo, f) for f in judged]))) for servo in XL330}
    best = min(peers.values())
    causes = [effect for effect, _ in answer.causes]
    first = "load_friction" in causes and "stribeck_friction" not in causes
    return Row(
        what,
        f"{1e3 * error:.3g} mrad; {', '.join(causes)}; {answer.seconds:.0f} s, {answer.memory:.2f} GiB",
        wanted,
        first and error < best and answer.seconds <= 10,
        ", ".join(f"{name} {1e3 * value:.3g} mrad" for name, value in peers.items()),
    )


def errors_while_on(cell: kr5.cell.Cell, motion: MotionLog, gain: int) -> np.ndarray:
    """Sizes of what a cell leaves of the positions while the motor is on, as of the published models [rad]. gain: that
    of the logs by which the cell was fitted."""
    assert motion.servo_gain is not None, "BAM states it"
    errors = np.abs(kr5_positions(cell, motion, gain) - motion.positions)
    return np.asarray(errors[motion.servo_gain > 0].ravel())
