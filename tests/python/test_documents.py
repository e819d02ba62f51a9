"""The reader of documents: what it refuses, and how it says so."""

import json
import os
import pickle
from typing import Literal

import kr5
import pytest
from kr5.files.documents import (
    Document,
    PoseMatrix,
    check_names,
    parse_json,
    parse_yaml,
    read_text,
    validate_document,
)
from pydantic import Field

BOMB = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 10)
)


class Move(Document):
    name: str
    frequency: float = Field(1.0, gt=0, description="frequency [Hz]")
    count: int = 1
    begin: float | None = Field(None, alias="from")
    kind: Literal["line", "arc"] = "line"
    scale: float | list[float] = 1.0
    T: PoseMatrix | None = None


class Plan(Document):
    moves: list[Move] = Field(description="a list of moves")
    home: list[float] | None = Field(None, min_length=2)


def refusal(function, *args) -> str:
    with pytest.raises(kr5.FileError) as ended:
        function(*args)
    assert "\n" not in str(ended.value) and ended.value.file
    return str(ended.value)


@pytest.mark.parametrize(
    "text, content",
    [
        ("a: 1e-3", {"a": 0.001}),
        ("a: -1.5e+3", {"a": -1500.0}),
        ("a: &x [1]\nb: [*x, *x]", {"a": [1], "b": [[1], [1]]}),
        ("a: &x {p: 1}\nb: {<<: *x, q: 2}", {"a": {"p": 1}, "b": {"p": 1, "q": 2}}),
        ("M: !!opencv-matrix {rows: 1, data: [2]}", {"M": {"rows": 1, "data": [2]}}),
    ],
)
def test_yaml_is_read(text, content):
    assert parse_yaml(text, "f.yaml") == content


@pytest.mark.parametrize(
    "text, problem",
    [
        ("a: 1\nb: 1\na: 2", "f.yaml:3: is not valid YAML (the key 'a' occurs twice); expected a plan"),
        ("[" * 100_000, "nested deeper than 64 levels"),
        ("a: " + "{a: " * 70, "nested deeper than 64 levels"),
        (BOMB, "more than 1000000 values, aliases unfolded"),
        ("a: &x [*x]", "the alias 'x' refers to itself"),
        ("a: [1, 2", "f.yaml:2: is not valid YAML"),
        ("a: 2001-99-99", "month must be in 1..12"),
        ("? [a]\n: 1", "unhashable key"),
        ("a: !!int ''", "is not valid YAML"),
        ("a: !!python/object:os.system x", "could not determine a constructor"),
        ("1" * 6000, "is not valid YAML"),
        ("\x01", "control characters"),
        ("a: 1\n---\nb: 2", "another document"),
    ],
)
def test_bad_yaml_is_refused(text, problem):
    assert problem in refusal(parse_yaml, text, "f.yaml", "a plan")


@pytest.mark.parametrize(
    "text, problem",
    [
        ('{"a": 1, "a": 2}', "the key 'a' occurs twice"),
        ("[" * 70 + "]" * 70, "nested deeper than 64 levels"),
        ('{"a": NaN}', "NaN is not a number"),
        ("{", "f.json: is not valid JSON"),
        ("[" * 200_000, "nested deeper"),
    ],
)
def test_bad_json_is_refused(text, problem):
    assert problem in refusal(parse_json, text, "f.json")


def test_brackets_inside_texts_are_no_nesting():
    data = {"a": '"' + "[" * 100, "b": "\\"}
    assert parse_json(json.dumps(data), "f.json") == data


@pytest.mark.parametrize(
    "text, problem",
    [
        ("moves: 3", "p.yaml:1: moves: found 3, expected a list (a list of moves)"),
        ("moves:\n- {name: a}\n- {name: 3}", "p.yaml:3: moves[1].name: found 3, expected a text"),
        (
            "moves:\n- name: a\n  frequency: -1",
            "p.yaml:3: moves[0].frequency: found -1, expected more than 0 (frequency [Hz])",
        ),
        ("moves:\n- name: a\n  frequenzy: 1", "p.yaml:3: moves[0]: unknown key 'frequenzy', expected frequency"),
        ("{}", "moves: is missing; expected a list of moves"),
        ("moves: [{}]", "moves[0].name: is missing"),
        ("moves: []\nhome: [1]", "p.yaml:2: home: found 1 entries, expected at least 2"),
        ("moves: [{name: a, kind: curve}]", "moves[0].kind: found 'curve', expected line or arc"),
        ("moves: [{name: a, count: 1.5}]", "moves[0].count: found 1.5, expected a whole number"),
        ("moves: [{name: a, frequency: true}]", "moves[0].frequency: found true, expected a number"),
        ("moves: [{name: a, frequency: .inf}]", "moves[0].frequency: found inf, expected a finite number"),
        ("moves: [{name: a, from: b}]", "moves[0].from: found 'b', expected a number"),
        ("moves: [{name: a, scale: b}]", "moves[0].scale: found 'b', expected a number or a list"),
        ("moves: [{name: a, T: [[1]]}]", "moves[0].T: found [[1]], expected a 4 x 4 matrix"),
        ("[]", "p.yaml:1: found [], expected a map"),
        ("", "p.yaml: found null, expected a map"),
    ],
)
def test_a_mistake_is_said_with_line_field_found_and_expected(text, problem):
    assert problem in refusal(validate_document, parse_yaml(text, "p.yaml"), Plan, "p.yaml", text)


def test_the_place_in_a_larger_document_is_said():
    text = "a:\n  b: {name: 3}"
    said = refusal(validate_document, {"name": 3}, Move, "p.yaml", text, ("a", "b"))
    assert "p.yaml:2: a.b.name: found 3, expected a text" in said


def test_the_error_of_a_document_carries_file_line_field_and_problem():
    with pytest.raises(kr5.FileError) as ended:
        validate_document({"moves": 3}, Plan, "p.yaml", "# a plan\nmoves: 3")
    error = ended.value
    assert (error.file, error.line, error.field) == ("p.yaml", 2, "moves")
    assert error.problem == "found 3, expected a list (a list of moves)" and error.remedy == ""
    sent = pickle.loads(pickle.dumps(error))  # by a worker
    assert vars(sent) == vars(error) and str(sent) == str(error)


def test_several_errors_are_one_exception_that_lists_them():
    error = kr5.Errors(["one", "two"])
    assert error.messages == ("one", "two") and str(error) == "one\ntwo" and isinstance(error, ValueError)
    assert pickle.loads(pickle.dumps(error)).messages == error.messages


def test_names_stand_once():
    check_names(["a", "b"])
    with pytest.raises(ValueError, match="found two named 'a'"):
        check_names(["a", "b", "a"])


def test_a_file_is_text_of_bounded_size(tmp_path):
    file = tmp_path / "f.yaml"
    file.write_bytes("ä".encode("latin1"))
    assert "is not UTF-8 text (byte 0 is 0xe4); expected a plan" in refusal(read_text, file, "a plan")
    file.write_bytes("a: 1".encode("utf-16"))
    assert "is not UTF-8 text" in refusal(read_text, file)
    file.write_bytes(b"\xef\xbb\xbfa: 1\r\n")
    assert parse_yaml(read_text(file), file) == {"a": 1}
    with (tmp_path / "large").open("wb") as stream:
        stream.truncate(2 << 20)
    assert "is larger than 1 MiB" in refusal(read_text, tmp_path / "large", "", 1 << 20)
    assert "/dev/zero: is a device; expected a plan" in refusal(read_text, "/dev/zero", "a plan")
    os.mkfifo(tmp_path / "pipe")  # to which nobody writes
    assert "pipe: is a pipe or a socket; expected a file" in refusal(read_text, tmp_path / "pipe")
    assert "Is a directory" in refusal(read_text, tmp_path)
    assert "embedded null byte" in refusal(read_text, "a\0b")
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    assert "symbolic links" in refusal(read_text, loop)
