"""Logs and models of other people through `kr5 gap diagnose LOG --model MODEL`: labelled recordings as CSV and as ROS
bags, public logs of real arms, and a MuJoCo arm whose model is tuned and predicts another log.

    python tools/benchmarks/front_door.py [--only cases] [--quick] [--reference FOLDER]

Nothing is written by hand: the command gets logs, a model, and for arms whose logs need it the options that are printed
beside. The diagnosis of a labelled recording must have the verdict and the causes that the recording has directly.
"""

import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kr5.cell
import kr5.gap
import numpy as np

import case_logs
from comparison import Row, format_rate, progress

FRESH_GAP = 1.05  # of a fresh log under the tuned model, over its noise


@dataclass
class Answer:
    """What the command answered."""

    code: int
    data: dict[str, Any]
    said: str
    seconds: float

    @property
    def causes(self) -> list[tuple[str, str]]:
        return sorted((c["effect"], c["target"]) for c in self.data.get("causes", []))


def run_diagnosis(folder: Path, *words: Any) -> Answer:
    """`kr5 gap diagnose` in a folder, with its JSON."""
    start = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-m", "kr5_tools", "gap", "diagnose", *map(str, words), "--json", "gap.json"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    file = folder / "gap.json"
    data = json.loads(file.read_text()) if done.returncode == 0 and file.is_file() else {}
    return Answer(done.returncode, data, done.stdout + done.stderr, time.monotonic() - start)


def same_answer(a: Answer, b: Answer) -> bool:
    return a.code == 0 and a.data["verdict"] == b.data["verdict"] and a.causes == b.causes


def compare_case(folder: Path) -> dict[str, tuple[bool, Answer, Answer]]:
    """A labelled recording directly, as CSV files, and with its motions as a bag."""
    with tempfile.TemporaryDirectory() as made:
        place = Path(made)
        direct = run_diagnosis(place, folder.resolve())
        recording = kr5.cell.load_recording(folder)
        kr5.cell.save_cell(case_logs.named(recording.cell), place / "model.yaml")
        csvs = run_diagnosis(place, *case_logs.case_csvs(recording, place), "--model", "model.yaml")
        bag = run_diagnosis(place, *case_logs.case_bag(recording, place), "--model", "model.yaml")
    return {"CSV": (same_answer(csvs, direct), csvs, direct), "bag": (same_answer(bag, direct), bag, direct)}


def compare_cases(folder: Path, quick: bool) -> list[Row]:
    names = sorted(json.loads((folder / "labels.json").read_text()))[: 2 if quick else None]
    found = {name: compare_case(folder / name) for name in progress(names, "Cases")}
    rows = []
    for form in ("CSV", "bag"):
        right = sum(results[form][0] for results in found.values())
        wrong = [
            f"{name}: {answer.data.get('verdict', answer.said[-200:])} {answer.causes} for {direct.causes}"
            for name, results in found.items()
            for ok, answer, direct in [results[form]]
            if not ok
        ]
        rows.append(
            Row(
                f"{len(names)} labelled recordings as {form}, no file by hand: verdict and causes as directly",
                f"{right}" + (f" ({'; '.join(wrong)})" if wrong else ""),
                f"{len(names)}",
                right == len(names),
                interval=format_rate(right, len(names)),
                figure="cases",
            )
        )
    return rows


# Public logs: log, model, and the options that this log needs.
TX40 = [[32, 0, 0, 0, 0, 0], [0, 32, 0, 0, 0, 0], [0, 0, 45, 0, 0, 0], [0, 0, 0, -48, 0, 0], [0, 0, 0, 0, 45, 0]]
TX40.append([0, 0, 0, 0, 32, 32])
TX40_ZERO = (np.array(TX40) @ [0, -np.pi / 2, np.pi / 2, 0, 0, 0]).round(9).tolist()
TIAGO_SCALE = (
    np.array([1, 0.136, 0.136, -0.087, -0.087, -0.0613, -0.0613, -0.0613]) * [1, 100, 100, 100, 100, 336, 336, 336]
).tolist()
PUBLIC: list[tuple[str, str, str, list[str]]] = [
    (
        "LBR Med7",
        "dyn_lbr_med7_kcl/med7_measurements.csv",
        "dyn_lbr_med7_kcl/med7dock.urdf",
        ["--tip", "link_shaft", "--every", "0.01", "--set", "columns.tau.scale=-1"],
    ),
    (
        "TX40",
        "dyn_tx40_figaroh/tx40_motor_log.csv",
        "dyn_tx40_figaroh/tx40_mdh_modified.urdf",
        ["--set", f"cell.drives.structure={TX40}", "--set", f"columns.q.offset={TX40_ZERO}"],
    ),
    (
        "TIAGo",
        "dyn_tiago_figaroh/tiago_log.csv",
        "dyn_tiago_figaroh/tiago_no_hand.urdf",
        ["--tip", "arm_tool_link", "--set", f"columns.tau.scale={TIAGO_SCALE}"],
    ),
]
