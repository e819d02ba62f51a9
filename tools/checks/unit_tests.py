#!/usr/bin/env python3
"""Fails when a source of a module in TESTED has no test of its own name: tests/<module>/<source>_test.cpp with a test
case in it.

Usage: unit_tests.py [FOLDER]    the checkout, by default the one this file stands in
"""

import sys
from pathlib import Path

# Modules of which every source has one.
TESTED = ("gap",)


def check(root: Path, modules: tuple[str, ...] = TESTED) -> list[str]:
    """One line a violation."""
    problems = []
    for module in modules:
        sources = sorted((root / "libkr5/src" / module).rglob("*.cpp"))
        if not sources:
            problems.append(f"libkr5/src/{module}: no sources are there to be tested")
        for source in sources:
            test = Path("tests") / module / f"{source.stem}_test.cpp"
            name = source.relative_to(root).as_posix()
            if not (root / test).exists():
                problems.append(f"{name}: no test has its name; expected {test.as_posix()}")
            elif "TEST_CASE(" not in (root / test).read_text(encoding="utf-8"):
                problems.append(f"{name}: {test.as_posix()} holds no test case")
    return problems


def main() -> int:
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2]
    problems = check(root)
    print("\n".join(problems) if problems else f"every source of {', '.join(TESTED)} has a test of its name")
    return bool(problems)


if __name__ == "__main__":
    sys.exit(main())
