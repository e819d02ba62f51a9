"""What the project says is made of fields and never read back: regular expressions stand only where a text comes from
elsewhere, each with its reason."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("tools/kr5_tools", "bindings/kr5")
LOGS = "names of columns, or values, of logs that others wrote"
DOCS = "fixed notation of the documentation of fields: `[unit]`, `Covariance of NAME`"

# File -> the foreign text, or the fixed notation, that it takes apart.
ALLOWED = {
    "bindings/kr5/_display.py": DOCS,
    "bindings/kr5/_notebook.py": DOCS,
    "tools/kr5_tools/cell/tables.py": DOCS,
    "tools/kr5_tools/cli/tables.py": "any text of a table: words for wrapping, whatever they mean",
    "tools/kr5_tools/dataset/command.py": "names of image files, YAML of other programs",
    "tools/kr5_tools/dataset/target_guess.py": "notes that people write beside images",
    "bindings/kr5/files/camera.py": "YAML of OpenCV",
    "bindings/kr5/files/documents.py": "JSON and YAML that users write",
    "tools/kr5_tools/identify/excitation_files.py": "names in KRL, as the controller takes them",
    "tools/kr5_tools/identify/motion_logs.py": LOGS,
    "bindings/kr5/logs/clock_guess.py": LOGS,
    "bindings/kr5/logs/column_list.py": "lists of columns that users type",
    "bindings/kr5/logs/column_names.py": LOGS,
    "bindings/kr5/logs/episodes.py": "numbers and ranges of episodes that users type",
    "bindings/kr5/logs/hdf5_file.py": LOGS,
    "bindings/kr5/logs/importer.py": "name of a column of a recording, exchanged for that of the log",
    "bindings/kr5/logs/joint_columns.py": LOGS,
    "bindings/kr5/logs/kind_guess.py": LOGS,
    "bindings/kr5/logs/log.py": LOGS,
    "bindings/kr5/logs/log_file.py": LOGS,
    "bindings/kr5/logs/log_recording.py": "file and line before an error in an entry that a user gave",
    "bindings/kr5/logs/map_guess.py": LOGS,
    "bindings/kr5/models/isaac_actuators.py": "names of joints, which Isaac Lab takes as regular expressions",
    "bindings/kr5/models/kinds.py": "XML",
    "bindings/kr5/models/mjcf_arm.py": "error messages of MuJoCo",
    "bindings/kr5/models/mjcf_document.py": "XML",
    "bindings/kr5/models/writing.py": "XML",
    "bindings/kr5/tables/column_search.py": LOGS,
    "bindings/kr5/tables/column_units.py": LOGS,
    "tools/kr5_tools/calibrate/pose_pairs.py": "names of columns of pairs that others wrote",
    "tools/kr5_tools/pages/rendering.py": "SVG of Matplotlib; any cell of a table: whether it is a number",
    "tools/kr5_tools/rsi/emulator_setup.py": "faults of the network that users type",
    "tools/kr5_tools/targets/sheet.py": "short forms of targets that users type",
}
DIAGNOSES = ("tools/kr5_tools/gap/", "tools/kr5_tools/gap_report/", "tools/kr5_tools/report/")


def uses_expressions(source: str) -> bool:
    """Whether a module imports `re`, or asks another one for it."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import) and any(name.name in ("re", "regex") for name in node.names):
            return True
        if isinstance(node, ast.ImportFrom) and node.module in ("re", "regex"):
            return True
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "__import__":
            return True
    return False


def users() -> set[str]:
    files = [file for package in PACKAGES for file in (ROOT / package).rglob("*.py")]
    assert len(files) > 150
    return {f.relative_to(ROOT).as_posix() for f in files if uses_expressions(f.read_text(encoding="utf-8"))}


def test_regular_expressions_stand_only_where_a_text_is_not_ours():
    found = users()
    assert sorted(found - ALLOWED.keys()) == [], "no text of ours is read back; make a field of what is asked"
    assert sorted(ALLOWED.keys() - found) == [], "these need no exception any more"


def test_nothing_that_shows_diagnoses_is_allowed_one():
    assert not [file for file in ALLOWED if file.startswith(DIAGNOSES)]


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("import re", True),
        ("def f():\n    import os, re as expressions", True),
        ("from re import match", True),
        ("__import__('re')", True),
        ("import resource", False),
        ("from kr5_tools import re_exports", False),
    ],
)
def test_every_way_to_regular_expressions_is_seen(source, found):
    assert uses_expressions(source) == found
