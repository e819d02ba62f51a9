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


ONE = """
import sys
from kr5.cell import load_recording
from kr5.gap import diagnose
from kr5.predict import FastSimulator
print(diagnose(load_recording(sys.argv[1]), FastSimulator()).seconds_screening)
"""


def diagnose(recording: str) -> tuple[float, float, float]:
    """Time of one diagnosis, of the screening in it [s], and its peak memory [MiB]; in a process of its own."""
    start = time.monotonic()
    process = subprocess.Popen([sys.executable, "-c", ONE, recording], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    with process.stdout as pipe:
        printed = pipe.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"error: the diagnosis of {recording} failed; what it said is above")
    return time.monotonic() - start, float(printed), usage.ru_maxrss / 1024


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
    times, memory = sorted(t for t, _, _ in found), max(m for _, _, m in found)
    screening = sorted(s for _, s, _ in found)
    rows = [
        comparison.Row(
            f"whole diagnosis of {len(found)} recordings: least, median, most [s]",
            f"{times[0]:.1f}, {times[len(times) // 2]:.1f}, {times[-1]:.1f}",
            "–",
            True,
        ),
        comparison.Row("screening in it: median [s]", f"{screening[len(screening) // 2]:.1f}", "–", True),
        comparison.Row("its peak memory [MiB]", f"{memory:.0f}", f"{MEMORY:.0f}", memory <= MEMORY),
    ]
    comparison.print_comparisons(rows, "Time and memory of a diagnosis")
    return 0 if all(row.reached for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
