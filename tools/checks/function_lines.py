#!/usr/bin/env python3
"""Fails when the body of a function has more than MAX_LINES lines.

Counted are the lines of the body, empty ones and comments too: of Python those behind the signature (with all its
options) and the docstring, of C++ those between the braces of the body. What stands in a function, such as a lambda,
belongs to it. Tests do not count, nor do tables: functions whose body is a list of rows. They stand in TABLES.

Usage: function_lines.py [FOLDER]    the checkout, by default the one this file stands in
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

MAX_LINES = 60
FOLDERS = ("libkr5", "sim", "bindings", "tools")

# "file: function" -> of what it is the table.
TABLES: dict[str, str] = {
    **{
        f"libkr5/src/cell/effect_rows/{part}_rows.cpp: {part}_rows": "the effects that a cell may carry, one a row"
        for part in ("arm", "drive", "sensor", "servo", "task")
    },
    "libkr5/src/job/phase_table.cpp: usual_phases": "the phases of the job, one a row",
}


class Function(NamedTuple):
    name: str
    line: int  # of its name
    lines: int  # of its body


def python_functions(text: str) -> Iterator[Function]:
    """Every function and method, nested ones too."""
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            continue
        body = node.body[1:] if ast.get_docstring(node) is not None else node.body
        starts = [part.lineno for part in ast.walk(body[0]) if hasattr(part, "lineno")] if body else []
        lines = (body[-1].end_lineno or 0) - min(starts) + 1 if starts else 0
        yield Function(node.name, node.lineno, lines)


# What is no code of C++: comments, texts, characters, directives. `1'000` is a number.
NO_CODE = re.compile(
    r"""//[^\n]*|/\*.*?\*/
    |R"(?P<mark>[^()\s]*)\(.*?\)(?P=mark)"
    |"(?:\\.|[^"\\\n])*"
    |(?<![0-9A-Za-z_])'(?:\\.|[^'\\\n])+'
    |^[ \t]*\#(?:\\\n|[^\n])*""",
    re.VERBOSE | re.DOTALL | re.MULTILINE,
)
TEMPLATE_ARGUMENTS = re.compile(r"<[^<>]*>")
OPERATOR = re.compile(r"\boperator\s*(\(\)|\[\]|[^\s\w(]+)")
WITH_BRACKETS = re.compile(r"\[\[.*?\]\]|\b(?:alignas|decltype|explicit|noexcept|requires)\s*\([^()]*\)", re.DOTALL)
INNER_BRACKETS = re.compile(r"\([^()]*\)")
SCOPE = re.compile(r"\b(?:namespace|class|struct|union|extern)\b")
NAME = re.compile(r"((?:[\w~]+\s*::\s*)*[\w~]+)\s*$")


def code_only(text: str) -> str:
    """The text without what is no code, line by line where it was."""
    return NO_CODE.sub(lambda found: "\n" * found[0].count("\n"), text)


def plain(head: str) -> str:
    """What stands before a brace, without template arguments, signs of operators and words with brackets of their own;
    other brackets with what is in them as @."""
    head = WITH_BRACKETS.sub("", OPERATOR.sub("operator_", head))
    while (shorter := TEMPLATE_ARGUMENTS.sub("", head)) != head:
        head = shorter
    while (shorter := INNER_BRACKETS.sub("@", head)) != head:
        head = shorter
    return head


def function_name(head: str) -> str | None:
    """Of the function whose body begins behind this text; None when something else does: a type, a namespace, a value,
    an initialiser, an argument."""
    before, bracket, behind = plain(head).partition("@")
    name = NAME.search(before)
    if not bracket or not name or any(sign in before + behind for sign in "=("):
        return None
    initialised = ":" in behind.replace("::", "") and not behind.rstrip().endswith(("@", "}"))
    return None if initialised else "".join(name[1].split())


def cpp_functions(text: str) -> Iterator[Function]:
    """Every function and method with a body; those within a function are lines of it."""
    code = code_only(text)
    head, start = "", 0  # what may be a signature, and where it begins
    inner = 0  # open braces that are neither namespace nor type
    opened: list[tuple[str, int]] = []  # for every open brace what it belongs to, and where it is
    for part in re.finditer(r"([^{};]*)([{};]?)", code):
        at, sign = part.start(2), part[2]
        if inner == 0:
            head += part[1]
        if sign == "{":
            name = function_name(head) if inner == 0 else None
            scope = inner == 0 and name is None and bool(SCOPE.search(head)) and "(" not in plain(head)
            opened.append(("scope" if scope else name or "", at))
            inner += not scope
        elif sign == "}" and opened:
            owner, begin = opened.pop()
            inner -= owner != "scope"
            if inner == 0 and owner not in ("scope", ""):
                yield cpp_function(code, owner, (start, begin, at))
            elif owner == "":
                head += "{}" if inner == 0 else ""
                continue
        if inner == 0 and (sign != ";" or head.count("(") == head.count(")")):
            head, start = "", part.end()


def cpp_function(code: str, name: str, places: tuple[int, int, int]) -> Function:
    """Of this name, whose signature begins at the first place, and its braces stand at the others."""
    start, begin, end = places
    found = re.compile(rf"\b{re.escape(name.rpartition('::')[2])}\s*\(").search(code, start, begin)
    first, last = code.count("\n", 0, begin), code.count("\n", 0, end)
    return Function(name, code.count("\n", 0, found.start() if found else begin) + 1, max(last - first - 1, 0))


def functions(file: Path) -> Iterator[Function]:
    text = file.read_text(encoding="utf-8")
    return python_functions(text) if file.suffix == ".py" else cpp_functions(text)


def bodies(root: Path) -> Iterator[tuple[str, Function]]:
    """Every function with the file that it is in."""
    for folder in FOLDERS:
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in (".py", ".cpp", ".hpp"):
                place = file.relative_to(root).as_posix()
                yield from ((place, function) for function in functions(file))


def check(root: Path, tables: dict[str, str]) -> list[str]:
    """One line a violation."""
    problems = []
    number = 0
    unused = set(tables)
    for place, function in bodies(root):
        number += 1
        if function.lines <= MAX_LINES:
            continue
        key = f"{place}: {function.name}"
        if key not in tables:
            problems.append(f"{place}:{function.line}: {function.name} has {function.lines} lines: split it")
        unused.discard(key)
    problems += [f"TABLES: '{key}' is not there, or not long" for key in sorted(unused)]
    problems += [f"TABLES: '{key}' says not of what it is the table" for key, of in tables.items() if not of.strip()]
    return problems if number else [f"no functions below {', '.join(FOLDERS)}"]


def main() -> int:
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2]
    problems = check(root, TABLES)
    print("\n".join(problems) if problems else f"no function but tables has more than {MAX_LINES} lines")
    return bool(problems)


if __name__ == "__main__":
    sys.exit(main())
