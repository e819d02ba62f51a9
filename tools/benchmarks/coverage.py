"""How often the 95 % regions hold the truth: the coverage tests of a C++ build with all their trials.

    python tools/benchmarks/coverage.py BUILD_FOLDER [--quick]

Every test judges its own count by its binomial limits, and the mean squared distance from the truth by chi-square
limits, and writes both down for the table here; --quick runs the part that CI runs."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import arguments
import comparison

PROGRAMS = ("calibration_tests", "fit_tests", "vision_tests")  # their tests with the tag "coverage"


def coverage_rows(build: Path, programs: tuple[str, ...], tag: str, quick: bool) -> tuple[int, list[comparison.Row]]:
    """How many programs failed, and a row for each region."""
    failed, lines = 0, []
    with tempfile.TemporaryDirectory() as folder:
        counts = Path(folder) / "counts.csv"
        environment = {**os.environ, "KR5_COVERAGE": str(counts)} | ({} if quick else {"KR5_FULL": "1"})
        for name in comparison.progress(programs, "Programs"):
            program = build.resolve() / "tests" / name
            if not program.exists():
                sys.exit(f"{program}: no such file; build it: cmake --build {build} --target {name}")
            done = subprocess.run(
                [program, "--use-colour", "no", tag],
                env=environment,
                capture_output=True,
                text=True,
            )
            failed += done.returncode != 0
            if done.returncode:
                print(done.stdout)
        for row in counts.read_text().splitlines():
            what, inside, trials, mean = row.rsplit(",", 3)
            low, high = comparison.exact_interval(int(inside), int(trials))
            rate = int(inside) / int(trials)
            reached = 0.93 <= rate <= 0.97 if int(trials) >= 2000 else high >= 0.93 and low <= 0.97
            lines.append(
                comparison.Row(
                    what,
                    f"{inside} of {trials}, mean {float(mean):.3f}",
                    "0.93 to 0.97",
                    reached,
                    interval=comparison.format_rate(int(inside), int(trials)),
                    figure="coverage",
                )
            )
    return failed, lines


def main() -> int:
    given = arguments.parser(__doc__, build=True).parse_args()
    failed, lines = coverage_rows(given.build, PROGRAMS, "[coverage]", given.quick)
    comparison.print_comparisons(
        lines,
        "How often the 95 % region holds the truth (below 2000 trials the interval must reach into what is wanted), "
        "and the mean squared distance over the stated one",
    )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
