"""OpenCV's FileStorage in its three forms: YAML, XML and JSON."""

import math
import re
import xml.etree.ElementTree as xml
from pathlib import Path
from typing import Any

import kr5
from kr5.files.documents import parse_json, parse_yaml

XML_ROOT = "opencv_storage"
MATRIX = "opencv-matrix"
MAX_DEPTH = 64  # of XML


def parse_storage(text: str, file: Path | str, expected: str = "") -> Any:
    """What a FileStorage holds: maps, lists, numbers, texts, and matrices as maps of rows, cols, dt and data (a list of
    numbers, row by row), whichever of the three forms the text has. Nothing where it is no FileStorage."""
    start = text.lstrip()
    if start.startswith("%YAML"):
        return parse_yaml(as_yaml(text), file, expected)
    if start.startswith("<"):
        return _from_xml(text, file, expected) if f"<{XML_ROOT}" in text else None
    if start.startswith("{") and f'"{MATRIX}"' in text:
        return parse_json(text, file, expected)
    return None


def as_yaml(text: str) -> str:
    """OpenCV's files begin with a directive that is no YAML, and write `key:value` without a blank."""
    text = re.sub(r"^%YAML.*$", "", text, flags=re.MULTILINE)
    return re.sub(r"^(\w+):(?=[^\s])", r"\1: ", text, flags=re.MULTILINE)


def is_matrix(value: object) -> bool:
    return isinstance(value, dict) and {"rows", "cols", "data"} <= set(value)


def _from_xml(text: str, file: Path | str, expected: str) -> Any:
    wanted = f"; expected {expected}" if expected else ""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:  # entities unfold to huge documents
        raise kr5.FileError(file, f"found a declaration <!…>, which OpenCV does not write{wanted}")
    try:
        root = xml.fromstring(text)
    except xml.ParseError as error:
        raise kr5.FileError(file, f"is not valid XML ({error}){wanted}") from error
    return _value(root, file, MAX_DEPTH)


def _value(node: xml.Element, file: Path | str, depth: int) -> Any:
    if depth == 0:
        raise kr5.FileError(file, f"nested deeper than {MAX_DEPTH} levels")
    if node.get("type_id") == MATRIX:
        fields = {child.tag: (child.text or "").split() for child in node}
        return {key: _matrix_field(key, words, node.tag, file) for key, words in fields.items()}
    children = [_value(child, file, depth - 1) for child in node]
    if not children:
        return _scalar((node.text or "").strip())
    if all(child.tag == "_" for child in node):
        return children
    return {child.tag: value for child, value in zip(node, children, strict=True)}


def _matrix_field(key: str, words: list[str], name: str, file: Path | str) -> Any:
    if key == "dt":
        return " ".join(words)
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        raise kr5.FileError(file, f"holds something that is no number in {key}", field=name) from None
    if key == "data":
        return numbers
    if not all(math.isfinite(number) for number in numbers):
        raise kr5.FileError(file, f"found {' '.join(words)[:40]} in {key}, expected a whole number", field=name)
    return int(numbers[0]) if numbers else 0


def _scalar(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text
