"""How often the 95 % regions hold the truth: the coverage tests of a C++ build with all their trials.

    python tools/bench/coverage.py BUILD_FOLDER [--quick]

Every test judges its own count by its binomial limits; --quick runs the part that CI runs.
"""

import os
import subprocess
import sys

import arguments

PROGRAMS = ("calibration_hand_eye_test", "calibration_tool_test", "calibration_timed_hand_eye_test",
            "vision_camera_calibration_test", "vision_target_pose_test", "vision_marker_map_test")


def main() -> int:
    given = arguments.parser(__doc__, build=True).parse_args()
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
