"""KUKA's RobotSensorInterface: time to read a telegram of the controller and to write the answer, a link over loopback
at a controller's pace, and any bytes for the codec.

    python tools/benchmarks/rsi.py BUILD [--repeat N] [--seconds S] [--fuzz-seconds S]

Measured in C++: BUILD is a folder of a build with -DKR5_BUILD_BENCH=ON. Telegrams are those of the usual layout of a
KR C4 (poses, axes, currents; corrections of the axes) and of the book's KR C2, which is twice as long. The link answers
a plain client of its own, alone and beside as many busy threads as there are processors. Where the preset "fuzz" is
built beside BUILD, its libFuzzer program looks for telegrams that the codec cannot stand.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import arguments
import comparison

WANTED = 5.0  # decode + encode [us]
LONGEST = 1e-3  # answer, p99.9 [s]
CORPUS = Path(__file__).resolve().parents[2] / "tests/fuzz/corpus/telegram"
FUZZER = "fuzz/tests/fuzz/telegram_fuzz"  # beside the build
EXECUTED = "stat::number_of_executed_units"  # of libFuzzer's final statistics
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


def link_row(build: Path, cycle: int, seconds: int, hogs: int = 0) -> comparison.Row:
    """What a link answers in time; beside busy threads that is only shown."""
    words = [str(program(build, "rsi_link")), str(cycle), str(seconds), str(hogs)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    f = json.loads(done.stdout.splitlines()[-1])
    beside = f" beside {hogs} busy threads" if hogs else ""
    priority = "" if f["priority"] == "given" else ", without real-time priority"
    times = ", ".join(f"{1e3 * f[key]:.2f}" for key in ("p50", "p99", "p999", "max"))
    return comparison.Row(
        f"link, {cycle} ms, {seconds} s{beside}{priority}: cycles missed; answer p50, p99, p99.9, max [ms]",
        f"{f['missed']}; {times}",
        "–" if hogs else "0; p99.9 ≤ 1",
        bool(hogs) or (f["missed"] == 0 and f["p999"] <= LONGEST),
    )


def fuzz_row(fuzzer: Path, seconds: int) -> comparison.Row:
    """What libFuzzer found in telegrams, with the sanitizers of its build."""
    with tempfile.TemporaryDirectory() as folder:
        new = Path(folder) / "new"
        new.mkdir()
        words = [str(fuzzer), str(new), str(CORPUS), f"-max_total_time={seconds}", "-print_final_stats=1"]
        done = subprocess.run(words, capture_output=True, text=True, cwd=folder)
    units = [line.split()[-1] for line in done.stderr.splitlines() if line.startswith(EXECUTED)]
    found = "no finding" if done.returncode == 0 else f"a finding: {summary(done.stderr)}"
    return comparison.Row(
        f"codec, {seconds} s of libFuzzer with ASan and UBSan: telegrams tried",
        f"{units[-1] if units else 'unknown number'}, {found}",
        "no finding",
        done.returncode == 0,
    )


def summary(text: str) -> str:
    """The line in which a sanitizer says what it found."""
    lines = [line for line in text.splitlines() if line.startswith("SUMMARY:")]
    return lines[-1] if lines else "without summary"


def program(build: Path, name: str) -> Path:
    out = build / "tools/benchmarks" / name
    if not out.exists():
        raise SystemExit(f"error: {out}: not built; configure with -DKR5_BUILD_BENCH=ON")
    return out


def main() -> int:
    parser = arguments.parser(__doc__)
    parser.add_argument("build", type=Path, help="folder of a C++ build with KR5_BUILD_BENCH")
    parser.add_argument("--repeat", type=int, default=500, help="blocks of a thousand telegrams")
    parser.add_argument("--seconds", type=int, default=1800, help="length of each run of the link")
    parser.add_argument("--fuzz-seconds", type=int, default=600, help="time of libFuzzer")
    given = parser.parse_args()
    words = [str(program(given.build, "rsi_speed")), str(given.repeat)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    rows = codec_rows(json.loads(done.stdout.splitlines()[-1]))
    rows += [link_row(given.build, cycle, given.seconds) for cycle in (4, 12)]
    rows += [link_row(given.build, cycle, min(given.seconds, 60), os.cpu_count() or 1) for cycle in (4, 12)]
    fuzzer = given.build.parent / FUZZER
    if fuzzer.exists():
        rows.append(fuzz_row(fuzzer, given.fuzz_seconds))
    else:
        print(f"no row of libFuzzer: {fuzzer} is not built (cmake --preset fuzz)", file=sys.stderr)
    comparison.print_comparisons(rows, "Link to a KUKA controller")
    return 0 if all(row.reached for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
