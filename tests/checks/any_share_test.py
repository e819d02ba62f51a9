"""The check of types finds parameters without one, and no more of them in the project than it allows."""

import ast
import importlib.util
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CHECK = ROOT / "tools/checks/any_share.py"
spec = importlib.util.spec_from_file_location("any_share", CHECK)
any_share = importlib.util.module_from_spec(spec)
spec.loader.exec_module(any_share)


def untyped(text: str) -> list[str]:
    return [p.arg for p in any_share.parameters(ast.parse(text)) if any_share.is_untyped(p)]


def run(typed: int, others: int) -> subprocess.CompletedProcess:
    """The check of a project with so many parameters of both kinds, in two files."""
    with tempfile.TemporaryDirectory() as folder:
        for name, number, kind in (("typed", typed, "int"), ("others", others, "Any")):
            file = Path(folder) / f"tools/kr5_tools/{name}.py"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text("".join(f"def f{k}(a: {kind}): ...\n" for k in range(number)))
        command = [sys.executable, CHECK, "--list", folder]
        return subprocess.run(command, capture_output=True, text=True, check=False)


class AnyShareTest(unittest.TestCase):
    def test_the_project_keeps_its_own_rule(self):
        found, every = any_share.count(ROOT)
        self.assertGreater(every, 1000)
        self.assertLessEqual(sum(found.values()), any_share.MAX_SHARE * every)

    def test_any_is_found_wherever_it_stands(self):
        text = "def f(a: Any, b: Any | None, /, c: list[Any], *d: typing.Any, e: 'dict[str, Any]' = 1, **g: Any): ..."
        self.assertEqual(untyped(text), ["a", "b", "c", "e", "d", "g"])

    def test_no_annotation_is_none(self):
        self.assertEqual(untyped("class A:\n  async def f(self, a, b=1):\n    def g(c): ...\n"), ["a", "b", "c"])

    def test_types_are_none_of_it(self):
        self.assertEqual(
            untyped("class A:\n  def f(self, a: int, *b: 'Anything', c: object): return lambda d: d\n"), []
        )

    def test_what_a_function_returns_does_not_count(self):
        self.assertEqual(untyped("def f(a: int) -> Any: ..."), [])

    def test_the_limit(self):
        at, above = run(95, 5), run(94, 6)
        self.assertEqual((at.returncode, above.returncode), (0, 1))
        self.assertIn("6 of 100 parameters are typed Any: 6.0 %", above.stdout)
        self.assertIn("6  tools/kr5_tools/others.py", above.stdout)
        self.assertNotIn("tools/kr5_tools/typed.py", above.stdout)

    def test_a_folder_with_nothing_to_count_is_no_success(self):
        self.assertEqual(run(0, 0).returncode, 1)


if __name__ == "__main__":
    unittest.main()
