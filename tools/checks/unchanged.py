#!/usr/bin/env python3
"""Test programs that passed as they are, with the data they read: their tests need not run again.

Usage: unchanged.py list BUILD           the modules whose test program is as it was when all its tests passed
       unchanged.py note BUILD JUNIT     notes the modules all of whose tests passed in a run of ctest
"""

import hashlib
import json
import os
import sys
import xml.etree.ElementTree as xml
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = Path(os.environ.get("KR5_REFERENCE_DIR", ROOT.parent / "shared"))
PROGRAM = "_tests"


def data_digest() -> str:
    """Of what the tests read: shipped data by content, reference data by name, size and time."""
    digest = hashlib.sha256()
    for folder in (ROOT / "share", ROOT / "tests"):
        for file in sorted(
            f for f in folder.rglob("*") if f.is_file() and f.suffix not in (".cpp", ".hpp", ".py", ".pyc")
        ):
            digest.update(str(file.relative_to(ROOT)).encode() + b"\0" + file.read_bytes())
    for file in sorted(f for f in REFERENCE.rglob("*") if f.is_file()):
        digest.update(f"{file} {file.stat().st_size} {file.stat().st_mtime_ns}\n".encode())
    return digest.hexdigest()


def program_digests(build: Path) -> dict[str, str]:
    """Of each module that has a test program: the program and the data."""
    data = data_digest()
    programs = (f for f in (build / "tests").glob(f"*{PROGRAM}") if f.is_file())
    return {f.name.removesuffix(PROGRAM): data + hashlib.sha256(f.read_bytes()).hexdigest() for f in programs}


def read_passed(build: Path) -> dict[str, str]:
    file = build / "passed.json"
    return json.loads(file.read_text()) if file.exists() else {}


def list_unchanged(build: Path) -> None:
    passed = read_passed(build)
    print(*sorted(module for module, digest in program_digests(build).items() if passed.get(module) == digest))


def note_passed(build: Path, junit: Path) -> None:
    passed, failed, ran = read_passed(build), set(), set()
    for case in xml.parse(junit).getroot().iter("testcase"):
        module = case.get("name", "").split("/")[0]
        ran.add(module)
        if case.get("status") != "run":
            failed.add(module)
    now = program_digests(build)
    kept = {module: digest for module, digest in passed.items() if module not in ran}
    kept |= {module: now[module] for module in ran - failed if module in now}
    (build / "passed.json").write_text(json.dumps(kept, indent=1))


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["list", build]:
            list_unchanged(Path(build))
        case ["note", build, junit]:
            note_passed(Path(build), Path(junit))
        case _:
            sys.exit(__doc__)
