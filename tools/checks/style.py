#!/usr/bin/env python3
"""clang-format on all C++ files, clang-tidy on changed ones.

Usage: style.py format [--fix]
       style.py tidy --build FOLDER [--all] [--base COMMIT]
FOLDER is a configured build with compile_commands.json; where it joins sources (KR5_UNITY), they are looked at together
in a fifth of the time. Changed means: against --base, else against the merge base with
origin/main where that is behind, else against the commit before; and whatever is not committed.
"""

import argparse
import json
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OURS = r"/(libkr5|bindings|sim|tests)/.*\.[ch]pp$"


def git(*args: str) -> str:
    done = subprocess.run(["git", *args], cwd=ROOT, capture_output=True, text=True)
    return done.stdout.strip() if done.returncode == 0 else ""


def own_files() -> list[Path]:
    return [
        p
        for folder in ("libkr5", "bindings", "sim", "tests", "tools")
        for p in sorted((ROOT / folder).rglob("*.[ch]pp"))
    ]


def changed_files(base: str | None) -> set[Path]:
    if not base:
        merge_base = git("merge-base", "HEAD", "origin/main")
        base = merge_base if merge_base and merge_base != git("rev-parse", "HEAD") else git("rev-parse", "HEAD~1")
    names = git("diff", "--name-only", base or "HEAD").splitlines()
    return {ROOT / n for n in [*names, *git("ls-files", "--others", "--exclude-standard").splitlines()]}


def check_format(fix: bool) -> int:
    mode = ["-i"] if fix else ["--dry-run", "-Werror"]
    return subprocess.run(["clang-format", *mode, *own_files()], cwd=ROOT).returncode


def sources_of(compiled: Path) -> set[Path]:
    """The sources that one compiled file holds: several where CMake joins them, else the file itself."""
    if compiled.suffix != ".cxx":
        return {compiled}
    return {Path(name).resolve() for name in re.findall(r'^#include "(.+)"', compiled.read_text(), re.MULTILINE)}


def tidy_one(build: Path, file: Path) -> str:
    """What clang-tidy complains of in one compiled file: its sources, and the headers of ours that they include."""
    command: list[str | Path] = [
        "clang-tidy",
        "-p",
        build,
        "--quiet",
        "--warnings-as-errors=*",
        f"--header-filter={OURS}",
        file,
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    return "" if done.returncode == 0 else done.stdout + ("" if done.stdout else done.stderr)


def check_tidy(build: Path, everything: bool, base: str | None) -> int:
    entries = json.loads((build / "compile_commands.json").read_text())
    compiled = {file: sources_of(file) for file in {Path(e["directory"], e["file"]).resolve() for e in entries}}
    if everything:
        mine = list(compiled)
    else:
        changed = changed_files(base)
        # A header is looked at through the source of its name.
        stems = {f.stem for f in changed if f.suffix == ".hpp"}
        mine = [c for c, sources in compiled.items() if any(s in changed or s.stem in stems for s in sources)]
    print(f"clang-tidy looks at {sum(len(compiled[c]) for c in mine)} sources, joined in {len(mine)}")
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        complaints = [text for text in pool.map(lambda f: tidy_one(build, f), mine) if text]
    print(*complaints, sep="\n")
    return 1 if complaints else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("format", "tidy"))
    parser.add_argument("--fix", action="store_true")
    parser.add_argument("--build", type=Path)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--base")
    given = parser.parse_args()
    if given.what == "format":
        return check_format(given.fix)
    if not given.build:
        parser.error("tidy needs --build")
    return check_tidy(given.build.resolve(), given.all, given.base)


if __name__ == "__main__":
    sys.exit(main())
