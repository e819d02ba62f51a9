#!/usr/bin/env python3
"""Fails when a file includes what its module may not use: the table in libkr5/CMakeLists.txt, applied to #include
lines.

Usage: includes.py [FOLDER]    the checkout, by default the one this file stands in
"""

import re
import sys
from pathlib import Path

# Folder of a third-party header -> the package whose PACKAGES entry allows it.
PACKAGE_OF = {
    "opencv2": "OpenCV",
    "visp3": "VISP",
    "apriltag": "apriltag",
    "ceres": "Ceres",
    "yaml-cpp": "yaml-cpp",
    "boost": "Boost",
    "pcl": "PCL",
    "pugixml.hpp": "pugixml",
    "sqlite3.h": "SQLite3",
    "dart": "DART",
}
NEVER = {"pybind11": "the library knows no Python", "catch2": "tests stay in tests/"}


def read_table(file: Path) -> dict[str, tuple[set[str], set[str]]]:
    """Module -> (modules it may use, itself among them; packages it may use in its sources)."""
    table: dict[str, tuple[set[str], set[str]]] = {}
    for name, body in re.findall(r"^kr5_module\((\w+)(.*?)\)\s*$", re.sub(r"#.*", "", file.read_text()), re.M | re.S):
        parts = dict(re.findall(r"(DEPENDS|PACKAGES|LINKS)\s+(.*?)(?=DEPENDS|PACKAGES|LINKS|$)", body, re.S))
        modules = {name}
        for other in parts.get("DEPENDS", "").split():
            modules |= table[other][0]
        entries = re.findall(r'"([^"]+)"|(\S+)', parts.get("PACKAGES", ""))
        table[name] = (modules, {(quoted or bare).split()[0] for quoted, bare in entries})
    return table


def verdict(header: str, module: str, public: bool, table: dict) -> str | None:
    """Why this module may not include this header; None when it may."""
    modules, packages = table[module]
    top, slash, rest = header.partition("/")
    if top == "kr5":
        other = rest.partition("/")[0]
        return None if other in modules else f"{module} does not use {other} (libkr5/CMakeLists.txt)"
    if top in NEVER:
        return NEVER[top]
    if public:
        standard = not slash and re.fullmatch(r"[a-z_0-9]+", header)
        return None if standard or top == "Eigen" else "public headers show Eigen, std and kr5 only"
    if top in PACKAGE_OF and PACKAGE_OF[top] not in packages:
        return f"{module} does not list the package {PACKAGE_OF[top]} (libkr5/CMakeLists.txt)"
    if slash and top in table and top != module:
        return f"a private header of {top}"
    return None


def check(root: Path) -> list[str]:
    """One line a violation."""
    library = root / "libkr5"
    table = read_table(library / "CMakeLists.txt")
    problems = []
    folders = [
        (library / "include/kr5", True),
        (library / "src", False),
        (root / "sim/include/kr5", True),
        (root / "sim/src", False),
    ]
    for folder, public in folders:
        for file in sorted(folder.rglob("*.[ch]pp")):
            module = "sim" if folder == root / "sim/src" else file.relative_to(folder).parts[0]
            place = file.relative_to(root)
            if module not in table:
                problems.append(f"{place}: no module '{module}' in libkr5/CMakeLists.txt")
                continue
            for number, line in enumerate(file.read_text().splitlines(), 1):
                match = re.match(r'\s*#\s*include\s*[<"](.+?)[>"]', line)
                if match and (why := verdict(match[1], module, public, table)):
                    problems.append(f"{place}:{number}: {match[1]}: {why}")
    return problems


def main() -> int:
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2]
    problems = check(root)
    print(*problems, sep="\n")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
