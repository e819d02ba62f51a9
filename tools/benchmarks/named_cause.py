"""How often the right cause of a bad hand-eye recording is named first: the confusion table over random synthetic
faults.

    python tools/benchmarks/named_cause.py BUILD_FOLDER [--quick]

Runs the tests with the tag "cause_counts" of calibration_tests, of a C++ build, and shows what they counted: 80 draws a
fault, 400 sound ones and 200 sound ones of an imprecise robot; with --quick 6, 30 and 20. The faults and their sizes
stand in tests/support/hand_eye_faults.hpp."""

import csv
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import arguments
import comparison
from kr5_tools.cli.terminal import spinner


def count(program: Path, quick: bool) -> dict[str, dict[str, int]]:
    """For each true cause, how often each cause was named first."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "confusion.csv"
        env = {**os.environ, "KR5_CONFUSION": str(file)}
        env.pop("KR5_FULL", None)
        if not quick:
            env["KR5_FULL"] = "1"
        with spinner("Drawing faults"):
            done = subprocess.run([program, "[cause_counts]"], env=env, capture_output=True, text=True)
        if not file.exists():
            sys.exit(f"{program} counted nothing:\n{done.stdout}{done.stderr}")
        counts: dict[str, dict[str, int]] = defaultdict(dict)
        for truth, named, n in csv.reader(file.open()):
            counts[truth][named] = int(n)
        return counts


def main() -> None:
    given = arguments.parser(__doc__, build=True).parse_args()
    program = given.build / "tests/calibration_tests"
    if not program.exists():
        sys.exit(f"{program}: no such file; build it: cmake --build {given.build} --target {program.name}")
    lines = []
    for truth, named in count(program.resolve(), given.quick).items():
        sound = truth.startswith("sound")
        name = "none" if sound else truth
        trials, right = sum(named.values()), named.get(name, 0)
        others = ", ".join(f"{other} {n}" for other, n in sorted(named.items()) if other != name)
        reached = right >= 0.95 * trials if sound else comparison.exact_interval(right, trials)[0] >= 0.9
        wanted = "rate ≥ 0.95, nothing named" if sound else "lower bound ≥ 0.90"
        lines.append(
            comparison.Row(
                truth,
                f"{right} of {trials}",
                wanted,
                reached,
                f"named else: {others}" if others else "–",
                comparison.format_rate(right, trials),
            )
        )
    few = "; six draws a fault cannot reach the bound: that takes 36" if given.quick else ""
    comparison.print_comparisons(lines, f"Cause named first (no other software names one){few}")


if __name__ == "__main__":
    main()
