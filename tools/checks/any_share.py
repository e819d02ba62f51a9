#!/usr/bin/env python3
"""Fails when too many parameters of our Python say nothing of their type.

A parameter counts when it has no annotation, or one that names Any anywhere: Any, Any | None, list[Any], and also
dict[str, Any]. Counted are all functions and methods below FOLDERS, with *args and **kwargs, without self and cls.

Usage: any_share.py [--list] [FOLDER]    the checkout, by default the one this file stands in
"""

import argparse
import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

FOLDERS = ("bindings/kr5", "tools/kr5_tools")
MAX_SHARE = 0.05
LISTED = 20  # files with --list
ANY = re.compile(r"\bAny\b")


def parameters(tree: ast.AST) -> Iterator[ast.arg]:
    """Every parameter of every function, nested ones too; those of a lambda cannot be annotated."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            own = node.args
            rest = [arg for arg in (own.vararg, own.kwarg) if arg is not None]
            for arg in (*own.posonlyargs, *own.args, *own.kwonlyargs, *rest):
                if arg.arg not in ("self", "cls"):
                    yield arg


def is_untyped(parameter: ast.arg) -> bool:
    return parameter.annotation is None or bool(ANY.search(ast.unparse(parameter.annotation)))


def count(root: Path) -> tuple[Counter[str], int]:
    """Parameters that say nothing of their type, by file; and the number of all parameters."""
    untyped: Counter[str] = Counter()
    every = 0
    for folder in FOLDERS:
        for file in sorted((root / folder).rglob("*.py")):
            found = list(parameters(ast.parse(file.read_text(encoding="utf-8"))))
            every += len(found)
            untyped[file.relative_to(root).as_posix()] = sum(map(is_untyped, found))
    return +untyped, every


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="the files with most of them")
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).resolve().parents[2])
    given = parser.parse_args()
    untyped, every = count(given.folder)
    if every == 0:
        print(f"{given.folder}: found no parameters below {' and '.join(FOLDERS)}")
        return 1
    number = sum(untyped.values())
    share = number / every
    found = f"{number} of {every} parameters are typed Any: {100 * share:.1f} %"
    print(f"{found}, at most {100 * MAX_SHARE:.0f} % are allowed")
    if given.list:
        for name, own in untyped.most_common(LISTED):
            print(f"{own:4d}  {name}")
    return share > MAX_SHARE


if __name__ == "__main__":
    sys.exit(main())
