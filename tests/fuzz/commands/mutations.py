"""Ways in which a file that a command reads may be wrong. Each takes a random generator and the file, and changes
it.
"""

import contextlib
import io
import json
import os
import random
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

Mutation = Callable[[random.Random, Path], None]

NUMBERS = [
    "nan",
    ".nan",
    "inf",
    ".inf",
    "-.inf",
    "1e308",
    "-1e308",
    "1e12",
    "0",
    "-1",
    "-0.5",
    "1e-300",
    "1e9999",
    "9223372036854775808",
    "1" * 400,
    "0x10",
    "1_000",
    "",
    "text",
    "null",
    "~",
    "true",
    "[]",
    "{}",
    "[1, 2]",
    "[null]",
    "1e9",
    "3.5",
]
VALUES: list[Any] = [
    None,
    True,
    "",
    "text",
    "[bold]",
    "<!--<script>",
    [],
    {},
    [None],
    [[]],
    {"a": 1},
    0,
    -1,
    3.5,
    1e308,
    -1e308,
    1e-300,
    float("inf"),
    float("nan"),
    1e12,
    10**30,
    [1, 2],
    ["a"],
    "ä" * 300,
]
CELL_NUMBERS = [".inf", "-.inf", "1e308", "-1e308", "0", "-1", "1e-300", ".nan"]
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])")


# Any file


def truncate(r: random.Random, file: Path) -> None:
    data = file.read_bytes()
    file.write_bytes(data[: r.randrange(len(data) + 1)])


def flip(r: random.Random, file: Path) -> None:
    data = bytearray(file.read_bytes())
    for _ in range(r.choice([1, 1, 2, 8, 64]) if data else 0):
        data[r.randrange(len(data))] = r.randrange(256)
    file.write_bytes(data)


def set_bytes(r: random.Random, file: Path) -> None:
    """A length or offset of a binary file that is believed."""
    data = bytearray(file.read_bytes())
    if len(data) > 8:
        at = r.randrange(len(data) - 8)
        data[at : at + r.choice([1, 2, 4, 8])] = r.choice(
            [b"\xff" * 8, b"\x00" * 8, b"\x00" * 7 + b"\x10", b"\xff" * 7 + b"\x7f"]
        )[: r.choice([1, 2, 4, 8])]
    file.write_bytes(data)


def cut_out(r: random.Random, file: Path) -> None:
    data = file.read_bytes()
    a, b = sorted(r.randrange(len(data) + 1) for _ in range(2))
    file.write_bytes(data[:a] + data[b:])


def repeat(r: random.Random, file: Path) -> None:
    data = file.read_bytes()
    a, b = sorted(r.randrange(len(data) + 1) for _ in range(2))
    file.write_bytes(data[:b] + data[a:])


def empty(_: random.Random, file: Path) -> None:
    file.write_bytes(b"")


def link_loop(_: random.Random, file: Path) -> None:
    file.unlink()
    file.symlink_to(file.name)


def folder(_: random.Random, file: Path) -> None:
    file.unlink()
    file.mkdir()


def missing(_: random.Random, file: Path) -> None:
    file.unlink()


def dangling_link(_: random.Random, file: Path) -> None:
    file.unlink()
    file.symlink_to("nowhere")


def pipe(_: random.Random, file: Path) -> None:
    """To which nobody writes, so that who reads it waits without end."""
    file.unlink()
    os.mkfifo(file)


def device(r: random.Random, file: Path) -> None:
    file.unlink()
    file.symlink_to(r.choice(["/dev/null", "/dev/zero"]))


BYTES: list[Mutation] = [
    truncate,
    flip,
    flip,
    set_bytes,
    cut_out,
    repeat,
    empty,
    link_loop,
    folder,
    missing,
    dangling_link,
    pipe,
    device,
]


# Text files


def _encoded(encoding: str, mark: str = "") -> Mutation:
    def mutation(r: random.Random, file: Path) -> None:
        text = file.read_text(encoding="utf-8")
        if mark:
            at = r.randrange(len(text) + 1)
            text = text[:at] + mark + text[at:]
        file.write_bytes(text.encode(encoding, errors="replace"))

    mutation.__name__ = f"as {encoding}"
    return mutation


def line_ends(_: random.Random, file: Path) -> None:
    file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))


def change_number(r: random.Random, file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    found = list(NUMBER.finditer(text))
    if found:
        at = r.choice(found)
        text = text[: at.start()] + r.choice(NUMBERS) + text[at.end() :]
    file.write_text(text, encoding="utf-8")


def swap_lines(r: random.Random, file: Path) -> None:
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    if len(lines) > 1:
        a, b = r.sample(range(len(lines)), 2)
        lines[a], lines[b] = lines[b], lines[a]
    file.write_text("".join(lines), encoding="utf-8")


def repeat_line(r: random.Random, file: Path) -> None:
    """In a YAML or JSON file often a key that stands twice."""
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    if lines:
        lines.insert(r.randrange(len(lines) + 1), r.choice(lines))
    file.write_text("".join(lines), encoding="utf-8")


def drop_line(r: random.Random, file: Path) -> None:
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    if lines:
        del lines[r.randrange(len(lines))]
    file.write_text("".join(lines), encoding="utf-8")


def control_character(r: random.Random, file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    at = r.randrange(len(text) + 1)
    file.write_text(text[:at] + r.choice("\x00\x01\x1b\x7f\u2028\ufeff") + text[at:], encoding="utf-8")


TEXT: list[Mutation] = [
    _encoded("utf-16"),
    _encoded("latin-1", "Grünewald"),
    _encoded("utf-8-sig"),
    _encoded("cp1252", "µ€"),
    line_ends,
    change_number,
    change_number,
    change_number,
    change_number,
    swap_lines,
    repeat_line,
    drop_line,
    control_character,
]


# Trees: YAML and JSON


def _load(file: Path) -> Any:
    text = file.read_text(encoding="utf-8")
    return json.loads(text) if file.suffix == ".json" else yaml.safe_load(text)


def _dump(data: Any, file: Path) -> None:
    text = json.dumps(data) if file.suffix == ".json" else yaml.safe_dump(data, sort_keys=False, allow_unicode=True)
    file.write_text(text, encoding="utf-8")


def _places(data: Any) -> list[tuple[Any, Any]]:
    """Every container with each of its keys; numbers in long lists are not counted one by one."""
    out, rest = [], [data]
    while rest:
        node = rest.pop()
        keys = list(node) if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
        for key in list(keys)[:40]:
            out.append((node, key))
            rest.append(node[key])
    return out


def _in_tree(change: Callable[[random.Random, Any, Any], None]) -> Mutation:
    def mutation(r: random.Random, file: Path) -> None:
        data = _load(file)
        if places := _places(data):
            change(r, *r.choice(places))
        _dump(data, file)

    mutation.__name__ = change.__name__.strip("_")
    return mutation


def _drop_key(_: random.Random, node: Any, key: Any) -> None:
    del node[key]


def _unknown_key(r: random.Random, node: Any, key: Any) -> None:
    if isinstance(node, dict):
        node[r.choice(["unknown", f"{key}s", "", 3, None, "[bold]"])] = r.choice(VALUES)
    else:
        node.append(r.choice(VALUES))


def _other_value(r: random.Random, node: Any, key: Any) -> None:
    node[key] = r.choice(VALUES)


def _wrapped(r: random.Random, node: Any, key: Any) -> None:
    node[key] = r.choice([[node[key]], {"value": node[key]}, [node[key], node[key]]])


def _shorter(r: random.Random, node: Any, key: Any) -> None:
    value = node[key]
    node[key] = value[: len(value) // 2] if isinstance(value, (list, str)) else None


def _renamed(r: random.Random, node: Any, key: Any) -> None:
    if isinstance(node, dict):
        node[f"{key}_"] = node.pop(key)


def other_top(r: random.Random, file: Path) -> None:
    _dump(r.choice(VALUES), file)


def deep(r: random.Random, file: Path) -> None:
    """Brackets nested deeper than a recursive reader bears, in the place of a value or of all."""
    depth = r.choice([300, 3000, 100000])
    nested = "[" * depth + "]" * depth if r.random() < 0.6 else '{"a":' * depth + "1" + "}" * depth
    text = file.read_text(encoding="utf-8")
    found = list(NUMBER.finditer(text))
    if found and r.random() < 0.7:
        at = r.choice(found)
        nested = text[: at.start()] + nested + text[at.end() :]
    file.write_text(nested, encoding="utf-8")


def alias_bomb(r: random.Random, file: Path) -> None:
    """YAML whose aliases stand for 9^9 values."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"] + [
        f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 9)
    ]
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".json" or r.random() < 0.5:
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return
    place = re.search(r"^(\w+):.*$", text, re.MULTILINE)
    bomb = "\n".join(lines) + "\n"
    text = bomb + (text[: place.start()] + f"{place[1]}: *a8\n" + text[place.end() + 1 :] if place else text)
    file.write_text(text, encoding="utf-8")


TREE: list[Mutation] = [
    *(
        _in_tree(f)
        for f in (
            _drop_key,
            _drop_key,
            _unknown_key,
            _other_value,
            _other_value,
            _other_value,
            _other_value,
            _wrapped,
            _shorter,
            _renamed,
        )
    ),
    other_top,
    deep,
    alias_bomb,
]


# Tables: CSV


def _in_table(change: Callable[[random.Random, list[list[str]]], None]) -> Mutation:
    def mutation(r: random.Random, file: Path) -> None:
        rows = [line.split(",") for line in file.read_text(encoding="utf-8").splitlines()]
        if len(rows) > 1:
            change(r, rows)
        file.write_text("\n".join(",".join(row) for row in rows) + "\n", encoding="utf-8")

    mutation.__name__ = change.__name__.strip("_")
    return mutation


def _column(r: random.Random, rows: list[list[str]]) -> int:
    return r.randrange(len(rows[0]))


def _swap_columns(r: random.Random, rows: list[list[str]]) -> None:
    a, b = _column(r, rows), _column(r, rows)
    for row in rows[1:]:
        row[a], row[b] = row[b], row[a]


def _drop_column(r: random.Random, rows: list[list[str]]) -> None:
    at = _column(r, rows)
    for row in rows:
        del row[at]


def _column_twice(r: random.Random, rows: list[list[str]]) -> None:
    at = _column(r, rows)
    for row in rows:
        row.append(row[at])


def _bad_cell(r: random.Random, rows: list[list[str]]) -> None:
    for _ in range(r.choice([1, 1, 5])):
        row = r.choice(rows[1:])
        row[r.randrange(len(row))] = r.choice(NUMBERS)


def _bad_column(r: random.Random, rows: list[list[str]]) -> None:
    at, value = _column(r, rows), r.choice(NUMBERS)
    for row in rows[1:]:
        row[at] = value


def _scaled_column(r: random.Random, rows: list[list[str]]) -> None:
    at, factor = _column(r, rows), r.choice([1e3, 1e6, 1e9, -1.0, 1e-9, 1e300])
    for row in rows[1:]:
        with contextlib.suppress(ValueError):
            row[at] = repr(float(row[at]) * factor)


def _shifted_stamps(r: random.Random, rows: list[list[str]]) -> None:
    """Epoch stamps, of which one may be 0."""
    for row in rows[1:]:
        with contextlib.suppress(ValueError):
            row[0] = repr(float(row[0]) + 1.7e9)
    if r.random() < 0.5:
        r.choice(rows[1:])[0] = "0"


def _ragged(r: random.Random, rows: list[list[str]]) -> None:
    row = r.choice(rows)
    if r.random() < 0.5 and len(row) > 1:
        row.pop()
    else:
        row.append("1")


def _few_rows(r: random.Random, rows: list[list[str]]) -> None:
    del rows[r.choice([1, 2, 3, 4]) :]


def _no_header(r: random.Random, rows: list[list[str]]) -> None:
    del rows[0]


def _odd_name(r: random.Random, rows: list[list[str]]) -> None:
    rows[0][_column(r, rows)] = r.choice(["", " ", "[bold]", "ä", "nan", "t", "q99999999999", "<!--<script>"])


TABLE: list[Mutation] = [
    _in_table(f)
    for f in (
        _swap_columns,
        _drop_column,
        _column_twice,
        _bad_cell,
        _bad_cell,
        _bad_column,
        _scaled_column,
        _shifted_stamps,
        _ragged,
        _few_rows,
        _no_header,
        _odd_name,
    )
]


# NPZ


def other_arrays(r: random.Random, file: Path) -> None:
    """Arrays of other lengths, types and shapes."""
    with np.load(file) as found:
        arrays = {name: found[name] for name in found.files}
    for _ in range(r.choice([1, 2])):
        name = r.choice(list(arrays))
        a = arrays[name]
        arrays[name] = r.choice(
            [
                a[: len(a) // 2],
                a[:0],
                a[:1],
                a.astype(complex),
                a.astype(str),
                np.array(3.0),
                a.astype(np.float16),
                a > 0,
                a[None],
                a.astype(np.int64),
                np.full_like(a, np.inf),
                np.array([None, 1], dtype=object),
                np.zeros((0, 3)),
                np.zeros((5, 0)),
                np.zeros(3, dtype=[("x", float)]),
                np.array(["2020-01-01"], dtype="datetime64[s]"),
            ]
        )
    np.savez(file, **arrays)


def other_header(r: random.Random, file: Path) -> None:
    """A header that tells of another shape or type than the data have."""
    with zipfile.ZipFile(file) as found:
        members = {name: found.read(name) for name in found.namelist()}
    name = r.choice(list(members))
    header = r.choice(
        [
            b"{'descr': '<f8', 'fortran_order': False, 'shape': (1152921504606846976,), }",
            b"{'descr': '<f8', 'shape': None}",
            b"[" * 3000,
            b"{'descr': '|O', 'fortran_order': False, 'shape': (3,), }",
            b"{'descr': '<f8', 'fortran_order': 3, 'shape': (-1,), }",
        ]
    )
    header = header.ljust(117) + b"\n"
    members[name] = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + members[name][128:]
    if r.random() < 0.2:
        members["notes.txt"] = b"no array"
    with zipfile.ZipFile(file, "w", r.choice([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])) as out:
        for key, value in members.items():
            out.writestr(key, value)


def zip_field(r: random.Random, file: Path) -> None:
    """A field of the zip's own records: method, sizes, flags."""
    data = bytearray(file.read_bytes())
    places = [m.start() for m in re.finditer(rb"PK\x01\x02|PK\x03\x04", bytes(data))]
    at = r.choice(places) + r.choice([4, 6, 8, 10, 14, 18, 20, 22, 24, 26, 28, 42])
    data[at : at + 2] = r.choice([b"\xff\xff", b"\x00\x00", b"\x63\x00", b"\x01\x00", b"\x09\x00"])
    file.write_bytes(data)


NPZ: list[Mutation] = [other_arrays, other_arrays, other_header, zip_field]

KINDS: dict[str, list[Mutation]] = {
    ".yaml": [*BYTES, *TEXT, *TREE],
    ".json": [*BYTES, *TEXT, *TREE],
    ".csv": [*BYTES, *TEXT, *TABLE],
    ".npz": [*BYTES, *NPZ],
    ".mcap": [*BYTES, flip, flip, set_bytes, set_bytes, set_bytes],
    ".urdf": [*BYTES, *TEXT],
    ".xml": [*BYTES, *TEXT],
}


LAST = (deep, alias_bomb, pipe, device)  # which nobody reads to its end, not even a further mutation


def mutate(r: random.Random, file: Path) -> str:
    """Changes a file in one to three ways, and says in which."""
    known, done = KINDS.get(file.suffix, BYTES), []
    for _ in range(r.choice([1, 1, 1, 2, 3])):
        mutation = r.choice(known)
        try:
            mutation(r, file)
            done.append(mutation.__name__)
            if mutation in LAST:
                break
        except (
            OSError,
            ValueError,
            TypeError,
            KeyError,
            IndexError,
            RecursionError,
            MemoryError,
            yaml.YAMLError,
            zipfile.BadZipFile,
            EOFError,
        ):
            pass  # what was done before has left nothing to change so
    return ", ".join(done)


def cell_numbers(text: str) -> list[tuple[int, int]]:
    """Where the numbers of a cell's text stand."""
    return [
        m.span()
        for m in NUMBER.finditer(re.sub(r"#.*", lambda m: " " * len(m[0]), text))
        if m.start() > text.index("\n")
    ]


def set_cell_number(text: str, span: tuple[int, int], value: str) -> str:
    return text[: span[0]] + value + text[span[1] :]


def name_of(file: Path, root: Path) -> str:
    return os.fspath(file.relative_to(root))


__all__ = ["CELL_NUMBERS", "cell_numbers", "io", "mutate", "name_of", "set_cell_number"]
