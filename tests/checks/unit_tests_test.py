"""The check of unit tests finds a source without a test of its name, and nothing in a sound tree."""

import importlib.util
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
spec = importlib.util.spec_from_file_location("unit_tests", ROOT / "tools/checks/unit_tests.py")
unit_tests = importlib.util.module_from_spec(spec)
spec.loader.exec_module(unit_tests)


def problems(files: dict[str, str]) -> list[str]:
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        for name, text in files.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text, encoding="utf-8")
        return unit_tests.check(root, ("gap",))


class UnitTestsTest(unittest.TestCase):
    def test_the_project_keeps_its_own_rule(self):
        self.assertEqual(unit_tests.check(ROOT), [])

    def test_a_source_in_any_folder_is_tested_by_its_name(self):
        self.assertEqual(
            problems({"libkr5/src/gap/deep/a.cpp": "", "tests/gap/a_test.cpp": 'TEST_CASE("a is right") {}'}), []
        )

    def test_a_source_without_one_is_named(self):
        (line,) = problems({"libkr5/src/gap/a.cpp": "", "tests/gap/b_test.cpp": "TEST_CASE("})
        self.assertIn("libkr5/src/gap/a.cpp", line)
        self.assertIn("tests/gap/a_test.cpp", line)

    def test_a_test_without_a_case_is_none(self):
        (line,) = problems({"libkr5/src/gap/a.cpp": "", "tests/gap/a_test.cpp": "// later"})
        self.assertIn("holds no test case", line)

    def test_a_module_without_sources_is_told(self):
        (line,) = problems({})
        self.assertIn("libkr5/src/gap", line)


if __name__ == "__main__":
    unittest.main()
