#!/usr/bin/env python3
"""Fails when an effect's id stands in code outside its row, its law, the tests and the blind check.

Usage: effect_ids.py [FOLDER]    the checkout, by default the one this file stands in

An effect is a row (libkr5/src/cell/effect_rows/) and a law (libkr5/src/physics/): everything else asks the row.
"""

import re
import sys
from pathlib import Path

LOOK_IN = ("libkr5", "sim", "bindings", "tools")
SUFFIXES = (".cpp", ".hpp", ".py", ".html", ".js")
ALLOWED = (
    "libkr5/src/cell/effect_rows/",
    "libkr5/src/physics/",
    "libkr5/include/kr5/physics/",
    "tools/blind_check/",
    "tools/benchmarks/",
    "tools/examples/",
    "tools/checks/",
    "tools/make_arm_log.py",
)
# Ids that also name a field, a file or a command, and where they do.
OTHER_MEANING: dict[str, tuple[str, ...]] = {
    "servo_damping": ("libkr5/include/kr5/force/insertion.hpp",),
    "torque_dead_band": ("libkr5/include/kr5/cell/drives.hpp",),
    "torque_limit": ("libkr5/include/kr5/cell/drives.hpp", "bindings/kr5/models/forms.py"),
    "hand_eye": ("tools/kr5_tools/",),
    "payload": (
        "libkr5/include/kr5/cell/import_urdf.hpp",
        "libkr5/include/kr5/cell/update_urdf.hpp",
        "libkr5/src/cell/urdf/arm_path.hpp",
        "tools/kr5_tools/command_table.py",
    ),
    "rotor_inertia": ("libkr5/include/kr5/cell/drives.hpp", "libkr5/include/kr5/identification/dynamics_model.hpp"),
    "torque_constant": (
        "libkr5/include/kr5/cell/drives.hpp",
        "libkr5/include/kr5/identification/current_model.hpp",
        "bindings/kr5/logs/log_recording.py",
    ),
    "tube_tilt": (
        "sim/include/kr5/sim/insertion.hpp",
        "sim/include/kr5/sim/work_cell_options.hpp",
        "sim/src/insertion.cpp",
        "tools/kr5_tools/insertion/",
    ),
    "viscous_friction": ("bindings/kr5/models/isaac_actuators.py",),
}


def read_ids(root: Path) -> list[str]:
    """Ids of all rows."""
    rows = sorted((root / "libkr5/src/cell/effect_rows").glob("*_rows.cpp"))
    return [name for file in rows for name in re.findall(r'\.id = "(\w+)"', file.read_text())]


def check(root: Path, other_meaning: dict[str, tuple[str, ...]]) -> list[str]:
    """One line a string that is an effect's id or names it as `effects.<id>`, and one an allowance without use."""
    ids = read_ids(root)
    if not ids:
        return ["no rows found"]
    names = "|".join(ids)
    pattern = re.compile(rf"[\"'`]({names})[\"'`]|\beffects\.({names})\b")
    found = []
    unused = {(name, place) for name, places in other_meaning.items() for place in places}
    for folder in LOOK_IN:
        for file in sorted((root / folder).rglob("*")):
            place = file.relative_to(root).as_posix()
            if file.suffix not in SUFFIXES or place.startswith(ALLOWED):
                continue
            for number, line in enumerate(file.read_text(errors="replace").splitlines(), 1):
                for alone, in_path in pattern.findall(line):
                    allowed = {(alone, start) for start in other_meaning.get(alone, ()) if place.startswith(start)}
                    unused -= allowed
                    if not allowed:
                        found.append(f"{place}:{number}: '{alone or in_path}' is an effect: ask its row")
    found += [f"OTHER_MEANING: '{name}' does not stand in {place}" for name, place in sorted(unused)]
    return found


def main() -> int:
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2]
    found = check(root, OTHER_MEANING)
    print(*found, sep="\n")
    print(
        f"{len(found)} strings of effect ids outside the table, laws, tests and blind check, or allowances without use"
    )
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
