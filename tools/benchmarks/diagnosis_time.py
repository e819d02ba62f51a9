"""Time and memory of `kr5 gap diagnose`, on one recording of each kind of effect.

    python tools/benchmarks/diagnosis_time.py [--reference FOLDER] [--recordings N]

Each diagnosis runs in a process of its own.
"""

import os
import subprocess
import sys
import time

import arguments
import comparison

MEMORY = 700.0  # [MiB]


def diagnose(recording: str) -> tuple[float, float]:
    """Time [s] and peak memory [MiB] of one diagnosis."""
    start = time.monotonic()
    process = subprocess.Popen(
        [sys.executable, "-m", "kr5_tools", "gap", "diagnose", recording], stdout=subprocess.DEVNULL
    )
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):
        raise SystemExit(f"error: the diagnosis of {recording} failed; what it said is above")
    return time.monotonic() - start, usage.ru_maxrss / 1024


def main() -> int:
    parser = arguments.parser(__doc__, reference=True)
    parser.add_argument("--recordings", type=int, default=14, help="how many of the folder's recordings")
    given = parser.parse_args()
    folders = sorted(p.parent for p in (given.reference / "cases").glob("*/recording.yaml"))[: given.recordings]
    if not folders:
        raise SystemExit(
            f"error: {given.reference / 'cases'}: no recording there; name another folder with --reference"
        )
    found = [diagnose(str(folder)) for folder in comparison.progress(folders, "Diagnoses")]
    times, memory = sorted(t for t, _ in found), max(m for _, m in found)
    rows = [
        comparison.Row(
            f"whole diagnosis of {len(found)} recordings: least, median, most [s]",
            f"{times[0]:.1f}, {times[len(times) // 2]:.1f}, {times[-1]:.1f}",
            "–",
            True,
        ),
        comparison.Row("its peak memory [MiB]", f"{memory:.0f}", f"{MEMORY:.0f}", memory <= MEMORY),
    ]
    comparison.print_comparisons(rows, "Time and memory of a diagnosis")
    return 0 if all(row.reached for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
