"""What the project says is made of fields and never read back: regular expressions stand only where a text comes from
elsewhere, each with its reason."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("tools/kr5_tools", "bindings/kr5")
LOGS = "names of columns, or values, of logs that others wrote"

# File -> the foreign text that it takes apart, and the functions and constants that do.
ALLOWED: dict[str, tuple[str, set[str]]] = {
    "bindings/kr5/files/documents.py": ("JSON and YAML that users write", {"", "_check_json_depth"}),
    "bindings/kr5/files/opencv_storage.py": ("YAML of OpenCV", {"as_yaml"}),
    "bindings/kr5/logs/column_list.py": ("lists of columns that users type", {"PARTS", "RANGE"}),
    "bindings/kr5/logs/column_names.py": (
        LOGS,
        {"NUMBER", "PLAIN_JOINT"} | {"_differing_words", "_group", "_holds", "_matched", "_replaced", "_spoken_names"},
    ),
    "bindings/kr5/logs/episodes.py": ("numbers and ranges of episodes that users type", {"PART"}),
    "bindings/kr5/logs/hdf5_file.py": (LOGS, {"DEMO", "TIMES", "_clock_rank"}),
    "bindings/kr5/logs/joint_columns.py": (LOGS, {"pattern_of"}),
    "bindings/kr5/logs/kind_guess.py": (LOGS, {"WRENCH"}),
    "bindings/kr5/logs/log.py": (LOGS, {"MOTOR_ON", "SECONDS"}),
    "bindings/kr5/logs/log_file.py": (LOGS, {"BLANKS_AND_DECIMAL_COMMAS", "DATE", "LIST", "_commented_names"}),
    "bindings/kr5/logs/map_file.py": ("components of a vector of a log that users type: `qpos[7:13]`", {"COMPONENTS"}),
    "bindings/kr5/logs/map_guess.py": (LOGS, {"_refuse_unknown"}),
    "bindings/kr5/models/isaac_actuators.py": (
        "names of joints, which Isaac Lab takes as regular expressions",
        {"_group_text"},
    ),
    "bindings/kr5/models/kinds.py": ("XML", {"_root_element"}),
    "bindings/kr5/models/mjcf_arm.py": ("error messages of MuJoCo", {"one_line"}),
    "bindings/kr5/models/mjcf_document.py": ("XML", {"read"}),
    "bindings/kr5/models/writing.py": ("XML", {"_with_meshes_of"}),
    "bindings/kr5/tables/column_search.py": (LOGS, {"_of_family", "_of_stem"}),
    "tools/kr5_tools/calibrate/opencv_pairs.py": (
        "names of matrices that others wrote",
        {"NUMBERED", "OF_CAMERA", "OF_ROBOT", "_forwards", "_joined", "_same_but_kind"},
    ),
    "bindings/kr5/_functions.py": ("signatures as pybind11 writes them", {"_signature"}),
    "tools/kr5_tools/calibrate/dataset_proposal.py": (
        "names of image files, YAML of other programs",
        {"_camera", "_family", "_hints", "_number"},
    ),
    "tools/kr5_tools/calibrate/target_guess.py": ("notes that people write beside images", {"_named", "_size"}),
    "tools/kr5_tools/identify/excitation_files.py": ("names in KRL, as the controller takes them", {"KRL_NAME"}),
    "tools/kr5_tools/identify/motion_logs.py": (LOGS, {"TEMPERATURE", "_numbered"}),
    "tools/kr5_tools/pages/rendering.py": ("SVG of Matplotlib", {"themed_svg"}),
    "tools/kr5_tools/rsi/emulator_setup.py": ("faults of the network that users type", {"parse_fault"}),
    "tools/kr5_tools/targets/sheet.py": ("short forms of targets that users type", {"parse_paper", "scale_lengths"}),
}
DIAGNOSES = ("tools/kr5_tools/gap/", "tools/kr5_tools/gap_report/", "tools/kr5_tools/report/")


def imports_expressions(tree: ast.AST) -> bool:
    """Whether a module imports `re` by this name and as a whole."""
    return any(
        name.name == "re" and name.asname is None
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for name in node.names
    )


def imports_otherwise(tree: ast.AST) -> bool:
    """Whether a module comes to regular expressions in a way that hides where it uses them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import) and any(
            name.name == "regex" or (name.name == "re" and name.asname) for name in node.names
        ):
            return True
        if isinstance(node, ast.ImportFrom) and node.module in ("re", "regex"):
            return True
        if isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) == "__import__":
            return True
    return False


def places(node: ast.AST, inside: str = "") -> set[str]:
    """The outermost functions, and the constants, in which a module uses `re`; types apart."""
    found = set()
    for part in ast.iter_child_nodes(node):
        name = inside
        if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef):
            name = inside or part.name
        elif isinstance(part, ast.Assign) and not inside:
            name = getattr(part.targets[0], "id", "")
        if isinstance(part, ast.Attribute) and getattr(part.value, "id", "") == "re" and part.attr != "Match":
            found.add(name)
        found |= places(part, name)
    return found


def users() -> dict[str, set[str]]:
    files = [file for package in PACKAGES for file in (ROOT / package).rglob("*.py")]
    assert len(files) > 150
    found = {}
    for file in files:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        name = file.relative_to(ROOT).as_posix()
        assert not imports_otherwise(tree), f"{name}: import re, so that it is seen where it is used"
        if imports_expressions(tree):
            found[name] = places(tree)
    return found


def test_regular_expressions_stand_only_where_a_text_is_not_ours():
    found = {f"{file}: {place}" for file, used in users().items() for place in used}
    allowed = {f"{file}: {place}" for file, (_, used) in ALLOWED.items() for place in used}
    assert sorted(found - allowed) == [], "no text of ours is read back; make a field of what is asked"
    assert sorted(allowed - found) == [], "these need no exception any more"


def test_nothing_that_shows_diagnoses_is_allowed_one():
    assert not [file for file in ALLOWED if file.startswith(DIAGNOSES)]


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("import os, re\nA = re.compile('a')", {"A"}),
        ("def f():\n    import re\n    def g():\n        return re.sub('a', 'b', c)", {"f"}),
        ("class A:\n    def f(self):\n        return lambda: re.match(a, b)", {"f"}),
        ("print(re.search(a, b))", {""}),
        ("def f(found: re.Match[str]): return found[0]", set()),
        ("import resource\nresource.compile(a)", set()),
    ],
)
def test_every_use_of_regular_expressions_is_seen(source, found):
    assert places(ast.parse(source)) == found


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("import re", False),
        ("from kr5_tools import re_exports", False),
        ("def f():\n    import os, re as expressions", True),
        ("from re import match", True),
        ("import regex", True),
        ("__import__('re')", True),
        ("builtins.__import__('re')", True),
    ],
)
def test_every_other_way_to_them_is_seen(source, found):
    assert imports_otherwise(ast.parse(source)) == found
