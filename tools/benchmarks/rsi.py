"""KUKA's RobotSensorInterface: time to read a telegram of the controller and to write the answer.

    python tools/benchmarks/rsi.py BUILD [--repeat N]

Measured in C++: BUILD is a folder of a build with -DKR5_BUILD_BENCH=ON. Telegrams are those of the usual layout of a
KR C4 (poses, axes, currents; corrections of the axes) and of the book's KR C2, which is twice as long.
"""

import json
import subprocess
from pathlib import Path
from typing import Any

import arguments
import comparison

WANTED = 5.0  # decode + encode [us]
NAMES = {"krc4": "KR C4", "book": "the book's KR C2"}


def codec_rows(figures: list[dict[str, Any]]) -> list[comparison.Row]:
    """Codec alone, and all that a link does in a cycle but the network."""
    rows = []
    for f in figures:
        what = f"{NAMES[f['layout']]}, {f['bytes']} bytes"
        rows.append(
            comparison.Row(
                f"codec: decode + encode, {what} [µs]", f"{f['codec_us']:.2f}", f"≤ {WANTED:g}", f["codec_us"] <= WANTED
            )
        )
        rows.append(
            comparison.Row(
                f"codec, units, limits and the shortest controller, {what} [µs]", f"{f['session_us']:.2f}", "–", True
            )
        )
    return rows


def main() -> int:
    parser = arguments.parser(__doc__)
    parser.add_argument("build", type=Path, help="folder of a C++ build with KR5_BUILD_BENCH")
    parser.add_argument("--repeat", type=int, default=500, help="blocks of a thousand telegrams")
    given = parser.parse_args()
    program = given.build / "tools/benchmarks/rsi_speed"
    if not program.exists():
        raise SystemExit(f"error: {program}: not built; configure with -DKR5_BUILD_BENCH=ON")
    done = subprocess.run([program, str(given.repeat)], capture_output=True, text=True, check=True)
    rows = codec_rows(json.loads(done.stdout.splitlines()[-1]))
    comparison.print_comparisons(rows, "Link to a KUKA controller")
    return 0 if all(row.reached for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
