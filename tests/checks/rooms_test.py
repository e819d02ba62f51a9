"""The check of file names finds a source without a header of its name, and nothing in a sound tree."""

import importlib.util
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
spec = importlib.util.spec_from_file_location("rooms", ROOT / "tools/checks/rooms.py")
rooms = importlib.util.module_from_spec(spec)
spec.loader.exec_module(rooms)


def problems(files: list[str], exceptions: dict[str, str]) -> list[str]:
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        for name in files:
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).touch()
        return rooms.check(root, exceptions)


class RoomsTest(unittest.TestCase):
    def test_the_project_keeps_its_own_rule(self):
        self.assertEqual(rooms.check(ROOT, rooms.EXCEPTIONS), [])

    def test_a_header_stands_beside_the_source_or_is_public(self):
        self.assertEqual(problems(["libkr5/src/core/a.cpp", "libkr5/src/core/a.hpp"], {}), [])
        self.assertEqual(problems(["libkr5/src/core/deep/a.cpp", "libkr5/include/kr5/core/a.hpp"], {}), [])
        self.assertEqual(problems(["sim/src/a.cpp", "sim/include/kr5/sim/a.hpp"], {}), [])

    def test_a_source_without_one_is_named(self):
        for header in ("libkr5/src/core/b.hpp", "libkr5/include/kr5/geometry/a.hpp", "libkr5/src/geometry/a.hpp"):
            (line,) = problems(["libkr5/src/core/a.cpp", header], {})
            self.assertIn("libkr5/src/core/a.cpp", line)

    def test_exceptions_need_a_reason_a_source_and_are_few(self):
        many = [f"libkr5/src/core/{k}.{ending}" for k in range(40) for ending in ("cpp", "hpp")]
        one = [*many, "libkr5/src/core/a.cpp"]
        self.assertEqual(problems(one, {"libkr5/src/core/a.cpp": "a table of data"}), [])
        self.assertEqual(len(problems(one, {"libkr5/src/core/a.cpp": " "})), 1)
        self.assertEqual(len(problems(many, {"libkr5/src/core/a.cpp": "gone"})), 1)
        few = ["libkr5/src/core/a.cpp"]
        self.assertIn("at most", problems(few, {few[0]: "a table of data"})[0])


if __name__ == "__main__":
    unittest.main()
