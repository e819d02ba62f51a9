"""What the project says is made of fields and never read back: regular expressions, and searches for several words,
stand only where a text comes from elsewhere, each with its reason."""

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
    "bindings/kr5/logs/log.py": (LOGS, {"SECONDS"}),
    "bindings/kr5/logs/servo_gain.py": (LOGS, {"FIRMWARE_GAIN", "MOTOR_ON"}),
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
# File -> the text in which it looks for several words, and the outermost functions that do.
WORDS_ALLOWED: dict[str, tuple[str, set[str]]] = {
    "bindings/kr5/files/documents.py": ("error messages of PyYAML and pydantic", {"_expected", "parse_yaml"}),
    "bindings/kr5/tables/read_table.py": ("names of quantities, a field of a role", {"_add_numbers"}),
}
SEARCHES = {
    *("startswith", "endswith", "removeprefix", "removesuffix", "split", "rsplit", "partition", "rpartition"),
    *("replace", "find", "rfind", "index", "rindex", "count"),
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


def module_trees() -> dict[str, ast.Module]:
    """Every module of the packages, by its path in the checkout."""
    files = [file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py"))]
    assert len(files) > 150
    return {file.relative_to(ROOT).as_posix(): ast.parse(file.read_text(encoding="utf-8")) for file in files}


def has_words(node: ast.AST, constants: frozenset[str] = frozenset()) -> bool:
    """Whether a literal, or one of a tuple, has several words; `constants`: names of such literals."""
    if isinstance(node, ast.Name | ast.Attribute):
        return getattr(node, "id", getattr(node, "attr", "")) in constants
    if isinstance(node, ast.Tuple):
        return any(has_words(part, constants) for part in node.elts)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return has_words(node.left, constants) or has_words(node.right, constants)
    if isinstance(node, ast.JoinedStr):
        text = "".join(str(part.value) if isinstance(part, ast.Constant) else "x" for part in node.values)
    else:
        text = node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""
    return sum(any(map(str.isalpha, word)) for word in text.split()) > 1


def constants_of(tree: ast.Module) -> set[str]:
    """The constants of a module that are a literal of several words."""
    found = set()
    for part in tree.body:
        if not isinstance(part, ast.Assign):
            continue
        for target in part.targets:
            pairs = [(target, part.value)]
            if isinstance(target, ast.Tuple) and isinstance(part.value, ast.Tuple):
                pairs = list(zip(target.elts, part.value.elts))
            found |= {t.id for t, value in pairs if isinstance(t, ast.Name) and has_words(value)}
    return found


def word_searches(node: ast.AST, constants: frozenset[str] = frozenset(), inside: str = "") -> set[str]:
    """The outermost functions in which a module looks for several words in a text."""
    found = set()
    for part in ast.iter_child_nodes(node):
        name = inside
        if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef):
            name = inside or part.name
        if isinstance(part, ast.Compare):
            sides = [part.left, *part.comparators]
            pairs = zip(part.ops, sides)
            if any(isinstance(op, ast.In | ast.NotIn) and has_words(left, constants) for op, left in pairs):
                found.add(name)
        if (
            isinstance(part, ast.Call)
            and getattr(part.func, "attr", "") in SEARCHES
            and any(has_words(searched, constants) for searched in part.args[:1])
        ):
            found.add(name)
        found |= word_searches(part, constants, name)
    return found


def users() -> dict[str, set[str]]:
    found = {}
    for name, tree in module_trees().items():
        assert not imports_otherwise(tree), f"{name}: import re, so that it is seen where it is used"
        if imports_expressions(tree):
            found[name] = places(tree)
    return found


def test_regular_expressions_stand_only_where_a_text_is_not_ours():
    found = {f"{file}: {place}" for file, used in users().items() for place in used}
    allowed = {f"{file}: {place}" for file, (_, used) in ALLOWED.items() for place in used}
    assert sorted(found - allowed) == [], "no text of ours is read back; make a field of what is asked"
    assert sorted(allowed - found) == [], "these need no exception any more"


def test_several_words_are_looked_for_only_where_a_text_is_not_ours():
    trees = module_trees()
    constants = frozenset[str]().union(*(constants_of(tree) for tree in trees.values()))
    found = {f"{file}: {place}" for file, tree in trees.items() for place in word_searches(tree, constants)}
    allowed = {f"{file}: {place}" for file, (_, used) in WORDS_ALLOWED.items() for place in used}
    assert sorted(found - allowed) == [], "no text of ours is read back; make a field of what is asked"
    assert sorted(allowed - found) == [], "these need no exception any more"


def test_nothing_that_shows_diagnoses_is_allowed_one():
    assert not [file for file in {**ALLOWED, **WORDS_ALLOWED} if file.startswith(DIAGNOSES)]


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


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("def f(w): return 'the readings do not' in w", {"f"}),
        ("class A:\n    def f(self): return [w for w in self.w if 'two words' not in w]", {"f"}),
        ("a.startswith(('one', 'two words'))", {""}),
        ("def f(a): return a.replace('two words', '')", {"f"}),
        ("def f(a, b): return a.split(f'{b} word')", {"f"}),
        ("def f(a): return a.partition('two' + ' words here')", {"f"}),
        ("OTHER, TOLD = 'one', 'two words'\ndef f(a): return TOLD in a", {"f"}),
        ("import other\ndef f(a): return a.replace(other.TOLD, '')", {"f"}),
        ("def f(a): return a.replace('word', 'two words') or 'word' in a or ' - ' in a", set()),
        ("def f(a): return a in ('two words', 'three words more')", set()),
        ("TOLD = 'word'\ndef f(a): return OTHER in a", set()),
    ],
)
def test_every_search_for_several_words_is_seen(source, found):
    tree = ast.parse(source)
    of_others = {"TOLD"} if "import" in source else set()
    assert word_searches(tree, frozenset(constants_of(tree) | of_others)) == found
