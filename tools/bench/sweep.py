"""A sweep of insertions with one worker and with two: how much sooner two are done, and whether they find the same.

    python tools/bench/sweep.py [--trials 1000]

Wall-clock time of the whole command `kr5 sweep insertion`, its start and its page with it; one worker runs without Dask. Two
workers can only be as quick as the cores that are free: run nothing beside it. Processor time, of all processes, tells what
free cores would give where others are busy too.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import arguments
import judge

WANTED = 1.8
PLACES = 10  # of the grid below
CELL = Path(__file__).resolve().parents[2] / "share/cells/kr5_arc.yaml"


def processor_time() -> float:
    """Of all processes that were started here and have ended [s]."""
    spent = os.times()
    return spent.children_user + spent.children_system


def sweep(folder: Path, workers: int, each: int) -> tuple[float, float, dict]:
    """Time of a sweep and its processor time [s], and its result."""
    out = folder / f"{workers}.json"
    command = [sys.executable, "-m", "kr5_tools", "sweep", "insertion", "--cell", str(CELL), "--tilts", "5:25:5", "--clearances", "0.05,0.5", "--trials", str(each),
               "--workers", str(workers), "-o", str(folder / str(workers)), "--json", str(out)]
    start, spent = time.monotonic(), processor_time()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.monotonic() - start, processor_time() - spent, json.loads(out.read_text())


def main() -> int:
    parser = arguments.parser(__doc__)
    parser.add_argument("--trials", type=int, default=1000, help=f"of all places together; a multiple of {PLACES}")
    each = max(1, parser.parse_args().trials // PLACES)
    with tempfile.TemporaryDirectory() as folder:
        (one, spent_one, first), (two, spent_two, second) = (sweep(Path(folder), workers, each) for workers in (1, 2))
    lines = [judge.Line(f"{each * PLACES} insertions on two workers beside one, ratio of times [-]", f"{one / two:.2f} ({one:.1f} s, {two:.1f} s)",
                        f"{WANTED}", one / two >= WANTED),
             judge.Line("by processor time, on free cores [-]", f"{2 * spent_one / spent_two:.2f} ({spent_one:.1f} s, {spent_two:.1f} s)", "–", True),
             judge.Line("the same trials and tables", str(first == second), "True", first == second)]
    judge.show(lines, "Sweep of insertions")
    return 0 if all(line.reached for line in lines) else 1


if __name__ == "__main__":
    raise SystemExit(main())
