#!/usr/bin/env python3
"""Fails when a source file does not carry the name of a header that it implements: one beside it, or a public one of
its module. What cannot follow the rule stands in EXCEPTIONS with its reason, at most 3 % of all sources.

Usage: rooms.py [FOLDER]    the checkout, by default the one this file stands in
"""

import sys
from pathlib import Path

GREATEST_SHARE = 0.03

# Source -> why no header carries its name.
EXCEPTIONS: dict[str, str] = {
    **{
        f"libkr5/src/cell/effect_rows/{part}_rows.cpp": "a part of the one table that effect_rows.hpp declares"
        for part in ("arm", "drive", "sensor", "servo", "task")
    },
    **{
        f"libkr5/src/force/insertion/{part}_phases.cpp": "phases of the state machine in force/insertion/machine.hpp"
        for part in ("entry", "search")
    },
    **{
        f"libkr5/src/job/{part}.cpp": "phases and ways of the state machine in job/machine.hpp"
        for part in ("bin_phases", "travel", "tube_phases")
    },
}


def sources(root: Path) -> list[tuple[Path, Path]]:
    """Every source with the folder of its module's public headers."""
    out = []
    for file in sorted((root / "libkr5/src").rglob("*.cpp")):
        module = file.relative_to(root / "libkr5/src").parts[0]
        out.append((file, root / "libkr5/include/kr5" / module))
    out += [(file, root / "sim/include/kr5/sim") for file in sorted((root / "sim/src").rglob("*.cpp"))]
    return out


def has_header(file: Path, public: Path) -> bool:
    name = file.stem + ".hpp"
    return file.with_suffix(".hpp").exists() or any(public.rglob(name))


def check(root: Path, exceptions: dict[str, str]) -> list[str]:
    """One line a violation."""
    files = sources(root)
    bare = [file.relative_to(root).as_posix() for file, public in files if not has_header(file, public)]
    problems = [
        f"{name}: no header has this name; name the file after the header it implements, or give it one"
        for name in bare
        if name not in exceptions
    ]
    problems += [f"{name}: listed in EXCEPTIONS, but it needs none" for name in exceptions if name not in bare]
    problems += [f"{name}: the exception has no reason" for name, reason in exceptions.items() if not reason.strip()]
    if len(exceptions) > GREATEST_SHARE * len(files):
        problems.append(
            f"EXCEPTIONS: {len(exceptions)} of {len(files)} sources, at most {100 * GREATEST_SHARE:.0f} % are allowed"
        )
    return problems


def main() -> int:
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2]
    problems = check(root, EXCEPTIONS)
    print("\n".join(problems) if problems else "every source carries the name of a header")
    return bool(problems)


if __name__ == "__main__":
    sys.exit(main())
