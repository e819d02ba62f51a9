"""Public logs of real arms, each brought in by one command with a URDF.

A log is cut in two: the first part is diagnosed, the second is held out. On that, `kr5 gap measure` gives the gap of
the model as it was and of the tuned one, and each cause is taken out of the tuned model alone: it is confirmed when the
gap is larger without it."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import kr5.cell
import kr5.gap
import kr5.predict
import numpy as np
import yaml
from kr5.logs.log_recording import LogOptions, record_logs

import published_arms
from comparison import Row, format_rate, progress
from gap_command import Answer, run_gap


@dataclass
class PublicLog:
    """A log below data/, the URDF of its arm (below data/ too, or the text of published numbers), and the options that
    this log needs."""

    name: str
    log: str
    model: str | Callable[[], str]
    of_model: list[str] = field(default_factory=list)  # which a tuned cell file does not need
    of_log: list[str] = field(default_factory=list)
    held_out: float = 0.35  # of the rows
    rows: int | None = None  # in use, from the first


TX40_GEARS = np.diag([32.0, 32, 45, -48, 45, 32])
TX40_GEARS[5, 4] = 32  # motor 6 turns with joints 5 and 6
TX40_ZERO = TX40_GEARS @ [0, -np.pi / 2, np.pi / 2, 0, 0, 0]
TIAGO_SCALE = np.array([0.136, 0.136, -0.087, -0.087, -0.0613, -0.0613, -0.0613]) * [100, 100, 100, 100, 336, 336, 336]
PUBLIC = (
    PublicLog(
        "Panda",
        "dyn_panda_gaz2019/panda_excitation.csv",
        lambda: published_arms.urdf("panda", published_arms.panda()),
    ),
    PublicLog(
        "UR10",
        "dyn_ur10_unisa/ur10_exciting_trajectory.csv",
        lambda: published_arms.urdf("ur10", published_arms.ur10()),
    ),
    PublicLog(  # its authors use the first 7.5 of 9 s; then the arm stands
        "TX40",
        "dyn_tx40_figaroh/tx40_motor_log.csv",
        "dyn_tx40_figaroh/tx40_mdh_modified.urdf",
        ["--set", f"cell.drives.structure={TX40_GEARS.tolist()}"],
        ["--set", f"columns.q.offset={TX40_ZERO.round(9).tolist()}"],
        rows=37500,
    ),
    PublicLog(  # the scale of the torso's effort is not known
        "TIAGo",
        "dyn_tiago_figaroh/tiago_log.csv",
        "dyn_tiago_figaroh/tiago_no_hand.urdf",
        ["--base", "torso_lift_link", "--tip", "arm_tool_link"],
        ["--set", f"columns.tau.scale={TIAGO_SCALE.round(9).tolist()}"],
    ),
    PublicLog(  # the arm rests for the first 6 of 16 s
        "LBR Med7",
        "dyn_lbr_med7_kcl/med7_measurements.csv",
        "dyn_lbr_med7_kcl/med7dock.urdf",
        ["--tip", "link_shaft"],
        ["--every", "0.01", "--set", "columns.tau.scale=-1"],
        held_out=0.25,
    ),
)


@dataclass
class HeldOut:
    """The gap on the rows held out [-]."""

    before: float
    after: float
    confirmed: list[str]  # causes without which it is larger
    not_confirmed: list[str]


def compare_public(data: Path, quick: bool) -> list[Row]:
    logs = PUBLIC[-1:] if quick else PUBLIC
    rows, brought, kept, named = [], 0, 0, 0
    for log in progress(logs, "Public logs"):
        with tempfile.TemporaryDirectory() as made:
            row, answer, held_out = compare_log(log, data, Path(made))
        rows.append(row)
        brought += answer.code == 0
        if held_out is not None:
            kept += len(held_out.confirmed)
            named += len(held_out.confirmed) + len(held_out.not_confirmed)
    rows.append(
        Row(
            "public logs brought in by one command",
            f"{brought}",
            f"{len(logs)}",
            brought == len(logs),
            interval=format_rate(brought, len(logs)),
            figure="public logs",
        )
    )
    if named:
        rate = format_rate(kept, named)
        rows.append(
            Row(
                "causes confirmed on rows held out",
                f"{kept} of {named}",
                "all",
                kept == named,
                "–",
                rate,
                "public logs",
            )
        )
    return rows


def compare_log(log: PublicLog, data: Path, folder: Path) -> tuple[Row, Answer, HeldOut | None]:
    """Diagnosis of the first part of a log, judged on the rest; and of the whole log, which must be brought in too."""
    first, rest = cut_log(log, data, folder)
    words = ["--model", model_file(log, data, folder), *log.of_model, *log.of_log]
    answer = run_gap("diagnose", folder, first, *words, "--write-cell", "tuned.yaml")
    held_out = judge(answer, rest, log, folder) if answer.code == 0 else None
    row = Row(f"{log.name}: {shown_command(log)}", answer.refusal, "brought in, causes confirmed", False)
    if held_out is None:
        return row, answer, None
    unconfirmed = f"; not confirmed: {', '.join(held_out.not_confirmed)}" if held_out.not_confirmed else ""
    causes = ", ".join(f"{effect} {target}" for effect, target in answer.causes) or "none"
    row.ours = (
        f"{answer.data['verdict']}; {causes}; held out: gap {held_out.before:.3g} to {held_out.after:.3g} times the"
        f" noise; {answer.seconds:.0f} s{unconfirmed}"
    )
    row.reached = held_out.after < held_out.before and not held_out.not_confirmed
    return row, answer, held_out


def shown_command(log: PublicLog) -> str:
    """The options that a person gives, with long lists cut off."""
    words = [w if len(w) < 40 else w.split("=")[0] + "=[...]" for w in [*log.of_model, *log.of_log]]
    return " ".join([f"`kr5 gap diagnose {Path(log.log).name} --model URDF", *words]) + "`"


def cut_log(log: PublicLog, data: Path, folder: Path) -> tuple[Path, Path]:
    """The rows to diagnose and those held out, as two logs."""
    head, *rows = (data / log.log).read_text().splitlines()
    rows = rows[: log.rows]
    at = round((1 - log.held_out) * len(rows))
    out = folder / "first.csv", folder / "rest.csv"
    for new, part in zip(out, (rows[:at], rows[at:])):
        new.write_text("\n".join([head, *part]) + "\n")
    return out


def model_file(log: PublicLog, data: Path, folder: Path) -> Path:
    """The URDF of the arm; one of published numbers is written."""
    if not callable(log.model):
        return data / log.model
    file = folder / "arm.urdf"
    file.write_text(log.model())
    return file


def judge(answer: Answer, rest: Path, log: PublicLog, folder: Path) -> HeldOut:
    tuned = yaml.safe_load((folder / "tuned.yaml").read_text())
    nominal = {key: value for key, value in tuned.items() if key != "effects"}
    (folder / "nominal.yaml").write_text(yaml.safe_dump(nominal, sort_keys=False))
    before, after = [
        run_gap("measure", folder, rest, "--model", cell, *log.of_log, "--trust").data["gap"]
        for cell in ("nominal.yaml", "tuned.yaml")
    ]
    recording = held_out_recording(rest, log, nominal)
    simulator = kr5.predict.FastSimulator()
    whole = kr5.gap.measure(recording, simulator, parsed(tuned)).gap
    confirmed: list[str] = []
    others: list[str] = []
    for effect, target in answer.causes:
        less = parsed(without_cause(tuned, effect, target))
        larger = kr5.gap.measure(recording, simulator, less).gap > whole
        (confirmed if larger else others).append(f"{effect} {target}")
    return HeldOut(before, after, confirmed, others)


def held_out_recording(rest: Path, log: PublicLog, cell: dict[str, Any]) -> Any:
    words = iter(log.of_log)
    options = LogOptions(trust=True)
    for option in words:
        if option == "--every":
            options.every = float(next(words))
        else:
            options.overrides.append(next(words))
    return record_logs([rest], parsed(cell), options, described=False).recording


def without_cause(cell: dict[str, Any], effect: str, target: str) -> dict[str, Any]:
    effects = {name: dict(targets) for name, targets in cell["effects"].items()}
    del effects[effect][target]
    return {**cell, "effects": effects}


def parsed(cell: dict[str, Any]) -> Any:
    return kr5.cell.parse_cell(yaml.safe_dump(cell, sort_keys=False))
