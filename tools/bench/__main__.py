"""Every comparison with other software, one after the other: `./tools/run bench`.

    ./tools/run bench                    all of them
    ./tools/run bench tags intrinsics    some of them
    ./tools/run bench --quick            all, with few trials

Each is a program of its own beside this one; `python tools/bench/NAME.py --help` tells what it measures. Times are
medians on whatever machine this is: read ratios, not milliseconds.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
BUILD = HERE.parents[1] / "build" / "release"

# name: what it measures, arguments, arguments with --quick
BENCHES = {
    "tags": ("tags found in photographs, detection speed", [], ["--repeat", "3"]),
    "corners": ("error of marker corners against rendered truth", [], ["--trials", "1"]),
    "intrinsics": ("camera calibration: fit, held-out error, speed", [], ["--splits", "3"]),
    "hand_eye": ("hand-eye: real sets left out view by view, synthetic truth", [], ["--trials", "30"]),
    "two_plane": ("hand-eye from one image of two planes, beside EPnP", [], ["--trials", "6"]),
    "clock_offset": ("offset of robot and camera clocks", [], ["--shifts", "4"]),
    "named_cause": ("right cause of a bad hand-eye recording named first", [str(BUILD)], [str(BUILD), "--quick"]),
    "contact": ("peg on tube: height, contacts and a roll beside brute force", [], ["--rows", "2000"]),
    "real_arms": ("cause of the gap on real arms with an effect withheld; six simulators beside motion capture", [], ["--quick"]),
    "dynamics": ("forward kinematics and inverse dynamics beside Pinocchio", [], ["--postures", "100000"]),
    "sim_speed": ("steps a second of the simulated cell beside MuJoCo", [], ["--steps", "20000"]),
    "simulated_cell": ("the simulated cell: recordings, dynamics, contact, energy, speed in one table", ["--full"], ["--quick"]),
    "insertion": ("feeling the way in: geometry, localisation, force loop, rates and times of insertions", [], ["--trials", "12"]),
    "sweep": ("insertions a second on two workers beside one", [], ["--trials", "60"]),
    "visual_servo": ("visual servoing over the tube from random starts, on a tag and on the bore", [], ["--starts", "2"]),
    "coverage": ("how often the 95 % regions hold the truth", [str(BUILD)], [str(BUILD), "--quick"]),
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
                                     prog="./tools/run bench")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(BENCHES)}; by default all")
    parser.add_argument("--quick", action="store_true", help="few trials")
    given = parser.parse_args()
    if unknown := [n for n in given.names if n not in BENCHES]:
        parser.error(f"no bench {unknown[0]!r}; there are {', '.join(BENCHES)}")
    failed = []
    for name in given.names or BENCHES:
        what, full, quick = BENCHES[name]
        print(f"\n== {name}: {what}", flush=True)
        start = time.monotonic()
        command = [sys.executable, str(HERE / f"{name}.py"), *(quick if given.quick else full)]
        if subprocess.run(command, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}).returncode:
            failed.append(name)
        print(f"({time.monotonic() - start:.0f} s)", flush=True)
    if failed:
        print("failed:", *failed, file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
