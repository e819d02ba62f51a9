"""A sweep of insertions with one worker and with two: how much sooner two are done, and whether they find the same.

    python tools/benchmarks/sweep.py [--trials 1000]

Wall-clock time of the whole command `kr5 sweep insertion`, its start and its page with it; one worker is the
command's own process. Two workers can only be as quick as two cores are: run nothing beside it. Cores that share
what is in them (threads of one core, virtual ones) are slower when both are busy; how much, two sweeps of half the
trials tell that run at once, two processes that know nothing of each other."""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import arguments
import comparison

WANTED = 1.8
PLACES = 10  # of the grid below
CELL = Path(__file__).resolve().parents[2] / "share/cells/kr5_arc.yaml"


def sweep_command(folder: Path, workers: int, each: int, name: str, seed: int = 1) -> list[str]:
    return [
        sys.executable,
        "-m",
        "kr5_tools",
        "sweep",
        "insertion",
        "--cell",
        str(CELL),
        "--tilts",
        "5:25:5",
        "--clearances",
        "0.05,0.5",
        "--trials",
        str(each),
        "--workers",
        str(workers),
        "--seed",
        str(seed),
        "-o",
        str(folder / name),
        "--json",
        str(folder / f"{name}.json"),
    ]


def run_timed(*commands: list[str]) -> float:
    """Until all of them, begun at once, are done [s]."""
    start = time.monotonic()
    running = [subprocess.Popen(c, stdout=subprocess.DEVNULL) for c in commands]
    if any([process.wait() for process in running]):  # noqa: C419, waits for all
        raise SystemExit("error: a sweep failed; what it said is above")
    return time.monotonic() - start


def main() -> int:
    parser = arguments.parser(__doc__)
    parser.add_argument("--trials", type=int, default=1000, help=f"of all places together; a multiple of {2 * PLACES}")
    half = max(1, parser.parse_args().trials // (2 * PLACES))
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        one = run_timed(sweep_command(folder, 1, 2 * half, "one"))
        two = run_timed(sweep_command(folder, 2, 2 * half, "two"))
        apart = run_timed(sweep_command(folder, 1, half, "left"), sweep_command(folder, 1, half, "right", seed=2))
        same = json.loads((folder / "one.json").read_text()) == json.loads((folder / "two.json").read_text())
    lines = [
        comparison.Row(
            f"{2 * half * PLACES} insertions on two workers beside one, ratio of times [-]",
            f"{one / two:.2f} ({one:.1f} s, {two:.1f} s)",
            f"{WANTED}",
            one / two >= WANTED,
        ),
        comparison.Row(
            "two processes apart beside one, half of them each: what these cores can [-]",
            f"{one / apart:.2f} ({apart:.1f} s)",
            "–",
            True,
        ),
        comparison.Row("the same trials and tables", str(same), "True", same),
    ]
    comparison.print_comparisons(lines, "Sweep of insertions")
    return 0 if all(line.reached for line in lines) else 1


if __name__ == "__main__":
    raise SystemExit(main())
