"""Logs and models of other people through `kr5 gap diagnose LOG --model MODEL`: labelled recordings as CSV and as ROS
bags, public logs of real arms, and MuJoCo arms whose model is tuned and predicts another log.

    python tools/benchmarks/front_door.py [--only cases|public|mujoco] [--quick] [--reference FOLDER]

Nothing is written by hand: the command gets logs, a model, and for arms whose logs need it the options that are printed
beside. The diagnosis of a labelled recording must have the verdict and the causes that the recording has directly.
"""

import json
import tempfile
from pathlib import Path

import kr5.cell

import arguments
import case_logs
from comparison import Row, format_rate, print_comparisons, progress
from front_door_mujoco import compare_mujoco
from front_door_public import compare_public
from gap_command import Answer, run_gap

PARTS = ("cases", "public", "mujoco")


def same_answer(a: Answer, b: Answer) -> bool:
    return a.code == 0 and a.data["verdict"] == b.data["verdict"] and a.causes == b.causes


def compare_case(folder: Path) -> dict[str, tuple[bool, Answer, Answer]]:
    """A labelled recording directly, as CSV files, and with its motions as a bag."""
    with tempfile.TemporaryDirectory() as made:
        place = Path(made)
        direct = run_gap("diagnose", place, folder.resolve())
        recording = kr5.cell.load_recording(folder)
        kr5.cell.save_cell(case_logs.named(recording.cell), place / "model.yaml")
        csvs = run_gap("diagnose", place, *case_logs.case_csvs(recording, place), "--model", "model.yaml")
        bag = run_gap("diagnose", place, *case_logs.case_bag(recording, place), "--model", "model.yaml")
    return {"CSV": (same_answer(csvs, direct), csvs, direct), "bag": (same_answer(bag, direct), bag, direct)}


def compare_cases(folder: Path, quick: bool) -> list[Row]:
    names = sorted(json.loads((folder / "labels.json").read_text()))[: 2 if quick else None]
    found = {name: compare_case(folder / name) for name in progress(names, "Cases")}
    rows = []
    for form in ("CSV", "bag"):
        right = sum(results[form][0] for results in found.values())
        wrong = [
            f"{name}: {answer.data.get('verdict', answer.refusal)} {answer.causes} for {direct.causes}"
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


def main() -> None:
    parser = arguments.parser(__doc__, reference=True)
    parser.add_argument("--only", choices=PARTS, help="one part alone")
    parser.add_argument("--quick", action="store_true", help="two recordings, one public log, two MuJoCo arms")
    given = parser.parse_args()
    parts = [given.only] if given.only else PARTS
    rows: list[Row] = []
    if "cases" in parts:
        rows += compare_cases(given.reference / "cases", given.quick)
    if "public" in parts:
        rows += compare_public(given.reference / "data", given.quick)
    if "mujoco" in parts:
        rows += compare_mujoco(given.quick)
    print_comparisons(rows, "Logs and models of other people")


if __name__ == "__main__":
    main()
