"""How often the right cause of a bad hand-eye recording is named first: the confusion table over random synthetic faults.

    python tools/bench/named_cause.py BUILD_FOLDER [--quick]

Runs the test calibration_hand_eye_diagnosis_test of a C++ build and shows what it counted: 80 draws a fault, 400 sound ones
and 200 sound ones of an imprecise robot; with --quick 6, 30 and 20. The faults and their sizes stand in
tests/support/hand_eye_faults.hpp.
"""

import csv
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import arguments
from rich.console import Console

from kr5_tools.common import table, working


def count(program: Path, quick: bool) -> dict[str, dict[str, int]]:
    """For each true cause, how often each cause was named first."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "confusion.csv"
        env = {**os.environ, "KR5_CONFUSION": str(file)}
        env.pop("KR5_FULL", None)
        if not quick:
            env["KR5_FULL"] = "1"
        with working("Drawing faults"):
            done = subprocess.run([program, "sound recordings*,the right cause*"], env=env, capture_output=True, text=True)
        if not file.exists():
            sys.exit(f"{program} counted nothing:\n{done.stdout}{done.stderr}")
        counts: dict[str, dict[str, int]] = defaultdict(dict)
        for truth, named, n in csv.reader(file.open()):
            counts[truth][named] = int(n)
        return counts


def lower_bound(right: int, trials: int) -> float:
    """Exact lower end of the 95 % interval of a rate."""
    from scipy.stats import beta

    return float(beta.ppf(0.025, right, trials - right + 1)) if right else 0.0


def main() -> None:
    given = arguments.parser(__doc__, build=True).parse_args()
    program = given.build / "tests/calibration_hand_eye_diagnosis_test"
    if not program.exists():
        sys.exit(f"{program}: no such file; build it: cmake --build {given.build} --target {program.name}")
    rows = []
    for truth, named in count(program.resolve(), given.quick).items():
        wanted = "none" if truth.startswith("sound") else truth
        trials, right = sum(named.values()), named.get(wanted, 0)
        others = ", ".join(f"{name} {n}" for name, n in sorted(named.items()) if name != wanted)
        rows.append([truth, f"{right} of {trials}", f"{lower_bound(right, trials):.3f}", others])
    Console(width=160).print(table("Cause named first", ["fault", "right", "lower 95 % bound [-]", "otherwise"], rows))


if __name__ == "__main__":
    main()
