"""Vertices of PLY files (ASCII, and binary of either byte order), as the format's author described it in 1994. Faces
and other elements are passed over. Ours, because the common reader is under the GPL and others bring meshes along."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import kr5
import numpy as np

TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float32": "f4",
    "float64": "f8",
}
BYTE_ORDERS = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
MAX_HEADER_LINES = 1000
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Property:
    """A number of each row, or a list of numbers that begins with their count."""

    name: str
    dtype: str
    count_dtype: str | None = None


@dataclass
class Element:
    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        return any(p.count_dtype for p in self.properties)

    @property
    def names(self) -> list[str]:
        return [p.name for p in self.properties]


def read_vertices(file: Path) -> np.ndarray:
    """The coordinates of the vertices of a file, n x 3.

    Raises ValueError with what is damaged, and kr5.FileError for a sound file without coordinates.
    """
    with file.open("rb") as stream:
        order, elements = _read_header(stream)
        vertex = next((e for e in elements if e.name == "vertex"), None)
        if vertex is None:
            raise kr5.FileError(file, "has no element vertex")
        missing = [axis for axis in AXES if axis not in vertex.names]
        if missing:
            raise kr5.FileError(file, f"vertex has no property {missing[0]}; found {', '.join(vertex.names)}")
        if any(p.name in AXES and p.count_dtype for p in vertex.properties):
            raise kr5.FileError(file, "found lists in place of the coordinates of a vertex, expected numbers")
        before = list(itertools.takewhile(lambda e: e is not vertex, elements))
        return _ascii_vertices(stream, before, vertex) if order is None else _Binary(stream, order).read(before, vertex)


def _read_header(stream: BinaryIO) -> tuple[str | None, list[Element]]:
    if stream.readline(16).strip() != b"ply":
        raise ValueError("the first line is not 'ply'")
    order: str | None = ""
    elements: list[Element] = []
    for _ in range(MAX_HEADER_LINES):
        words = stream.readline(4096).decode("ascii", "replace").split()
        match words:
            case ["end_header"]:
                if order == "":
                    raise ValueError("the header has no line 'format'")
                return order, elements
            case ["comment" | "obj_info", *_]:
                continue
            case ["format", name, "1.0"] if name in BYTE_ORDERS:
                order = BYTE_ORDERS[name]
            case ["element", name, count] if count.isascii() and count.isdigit():
                elements.append(Element(name, int(count)))
            case ["property", "list", count, kind, name] if elements and TYPES.get(count, "f")[0] in "iu":
                elements[-1].properties.append(Property(name, _dtype(kind), _dtype(count)))
            case ["property", kind, name] if elements:
                elements[-1].properties.append(Property(name, _dtype(kind)))
            case _:
                raise ValueError(f"found '{' '.join(words)[:60]}' in the header")
    raise ValueError(f"the header does not end within {MAX_HEADER_LINES} lines")


def _dtype(name: str) -> str:
    if name not in TYPES:
        raise ValueError(f"found the type '{name[:20]}', expected one of {', '.join(TYPES)}")
    return TYPES[name]


def _ends_early(element: Element, found: int) -> ValueError:
    return ValueError(f"ends after {found} of {element.count} rows of {element.name}")


def _ascii_vertices(stream: BinaryIO, before: list[Element], vertex: Element) -> np.ndarray:
    lines = (line for line in stream if line.strip())
    for element in before:
        skipped = sum(1 for _ in itertools.islice(lines, element.count if element.properties else 0))
        if element.properties and skipped < element.count:
            raise _ends_early(element, skipped)
    if vertex.count == 0:
        return np.empty((0, 3))
    rows = itertools.islice(lines, vertex.count)
    if vertex.has_lists:
        points = np.array([_ascii_row(line, vertex) for line in rows], float).reshape(-1, 3)
    else:
        columns = [vertex.names.index(axis) for axis in AXES]
        first = next(rows, None)
        if first is None:
            raise _ends_early(vertex, 0)
        text = (line.decode("ascii", "replace") for line in itertools.chain([first], rows))
        points = np.loadtxt(text, usecols=columns, comments=None, ndmin=2)
    if len(points) < vertex.count:
        raise _ends_early(vertex, len(points))
    return points


def _ascii_row(line: bytes, vertex: Element) -> list[float]:
    words: Iterator[bytes] = iter(line.split())
    values = {}
    try:
        for p in vertex.properties:
            if p.count_dtype:
                for _ in range(int(next(words))):
                    next(words)
            else:
                values[p.name] = float(next(words))
    except (StopIteration, ValueError):
        row = line.decode("ascii", "replace").strip()[:60]
        raise ValueError(f"found the row '{row}', expected {len(vertex.properties)} numbers or lists") from None
    return [values[axis] for axis in AXES]


class _Binary:
    """The rows of a binary file, which is read into memory."""

    def __init__(self, stream: BinaryIO, order: str) -> None:
        self.data, self.order, self.at = stream.read(), order, 0

    def read(self, before: list[Element], vertex: Element) -> np.ndarray:
        for element in before:
            if element.has_lists:
                for row in range(element.count):
                    self._row(element, row)
            else:
                self._table(element)
        if not vertex.has_lists:
            table = self._table(vertex)
            return np.column_stack([table[f"f{vertex.names.index(axis)}"] for axis in AXES]).astype(float)
        rows = [self._row(vertex, row) for row in range(vertex.count)]
        return np.array([[row[axis] for axis in AXES] for row in rows], float).reshape(-1, 3)

    def _table(self, element: Element) -> np.ndarray:
        kind = np.dtype([(f"f{i}", self.order + p.dtype) for i, p in enumerate(element.properties)])
        there = (len(self.data) - self.at) // kind.itemsize if kind.itemsize else element.count
        if there < element.count:
            raise _ends_early(element, there)
        if kind.itemsize == 0 or element.count == 0:
            return np.empty(0, kind)
        table = np.frombuffer(self.data, kind, element.count, self.at)
        self.at += kind.itemsize * element.count
        return table

    def _row(self, element: Element, row: int) -> dict[str, float]:
        values = {}
        for p in element.properties:
            if p.count_dtype:
                count = int(self._number(p.count_dtype, element, row))
                if count < 0:
                    raise ValueError(f"found a list of {count} numbers in row {row + 1} of {element.name}")
                self.at += count * np.dtype(p.dtype).itemsize
            else:
                values[p.name] = self._number(p.dtype, element, row)
        if self.at > len(self.data):
            raise _ends_early(element, row)
        return values

    def _number(self, dtype: str, element: Element, row: int) -> float:
        kind = np.dtype(self.order + dtype)
        if self.at + kind.itemsize > len(self.data):
            raise _ends_early(element, row)
        value = np.frombuffer(self.data, kind, 1, self.at)[0]
        self.at += kind.itemsize
        return float(value)
