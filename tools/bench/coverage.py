"""How often the 95 % regions hold the truth: the coverage tests of a C++ build with all their trials.

    python tools/bench/coverage.py BUILD_FOLDER [--quick]

Every test judges its own count by its binomial limits; --quick runs the part that CI runs.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path

PROGRAMS = ("calibration_hand_eye_test", "calibration_tool_test", "calibration_timed_hand_eye_test",
            "vision_camera_calibration_test", "vision_target_pose_test", "vision_marker_map_test")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path, help="folder of a C++ build with tests")
    parser.add_argument("--quick", action="store_true", help="few trials, as in CI")
    given = parser.parse_args()
    environment = dict(os.environ) if given.quick else {**os.environ, "KR5_FULL": "1"}
    failed = 0
    for name in PROGRAMS:
        program = given.build.resolve() / "tests" / name
        if not program.exists():
            sys.exit(f"{program}: no such file; build it: cmake --build {given.build} --target {name}")
        done = subprocess.run([program, "--use-colour", "no"], env=environment, capture_output=True, text=True)
        failed += done.returncode != 0
        print(f"{name:34} {done.stdout.strip().splitlines()[-1]}", flush=True)
        if done.returncode:
            print(done.stdout)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
