#!/usr/bin/env python3
"""Fails when an effect's id stands in code outside its row, its law, the tests and the blind check.

Usage: effect_ids.py [FOLDER]    the checkout, by default the one this file stands in

An effect is a row (libkr5/src/cell/effect_rows/) and a law (libkr5/src/physics/): everything else asks the row.
"""

import re
import sys
from pathlib import Path

LOOK_IN = ("libkr5", "sim", "bindings", "tools")
ALLOWED = (
    "libkr5/src/cell/effect_rows/",
    "libkr5/src/physics/",
    "libkr5/include/kr5/physics/",
    "tools/blind_check/",
    "tools/benchmarks/",
    "tools/examples/",
    "tools/checks/",
)
# Ids that also name a field, a file or a command, and where they do.
OTHER_MEANING = {
    "hand_eye": ("tools/kr5_tools/",),
    "rotor_inertia": ("libkr5/include/kr5/cell/drives.hpp", "libkr5/src/cell/"),
    "torque_constant": ("libkr5/include/kr5/cell/drives.hpp", "libkr5/src/cell/"),
    "payload": ("tools/kr5_tools/",),
    "tube_tilt": ("sim/include/kr5/sim/insertion.hpp", "sim/src/insertion.cpp", "tools/kr5_tools/insertion/"),
}


def read_ids(root: Path) -> list[str]:
    """Ids of all rows."""
    rows = sorted((root / "libkr5/src/cell/effect_rows").glob("*_rows.cpp"))
    return [name for file in rows for name in re.findall(r'\.id = "(\w+)"', file.read_text())]


def check(root: Path) -> list[str]:
    """One line a string that is an effect's id."""
    ids = read_ids(root)
    if not ids:
        return ["no rows found"]
    pattern = re.compile(rf"[\"'`]({'|'.join(ids)})[\"'`]")
    found = []
    for folder in LOOK_IN:
        for file in sorted((root / folder).rglob("*")):
            place = file.relative_to(root).as_posix()
            if file.suffix not in (".cpp", ".hpp", ".py", ".html", ".js") or place.startswith(ALLOWED):
                continue
            for number, line in enumerate(file.read_text(errors="replace").splitlines(), 1):
                found += [
                    f"{place}:{number}: '{name}' is an effect: ask its row"
                    for name in pattern.findall(line)
                    if not place.startswith(OTHER_MEANING.get(name, ("\0",)))
                ]
    return found


def main() -> int:
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2]
    found = check(root)
    print(*found, sep="\n")
    print(f"{len(found)} strings of effect ids outside the table, laws, tests and blind check")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
