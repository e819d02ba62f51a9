"""The check of effect ids finds one that stands outside rows and laws, and an allowance that nothing needs."""

import importlib.util
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
spec = importlib.util.spec_from_file_location("effect_ids", ROOT / "tools/checks/effect_ids.py")
effect_ids = importlib.util.module_from_spec(spec)
spec.loader.exec_module(effect_ids)

ROW = {"libkr5/src/cell/effect_rows/task_rows.cpp": '{.id = "wobble"}, {.id = "sag"}'}


def problems(files: dict[str, str], other_meaning: dict[str, tuple[str, ...]] | None = None) -> list[str]:
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        for name, text in (ROW | files).items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        return effect_ids.check(root, other_meaning or {})


class EffectIdsTest(unittest.TestCase):
    def test_the_project_keeps_its_own_rule(self):
        self.assertEqual(effect_ids.check(ROOT, effect_ids.OTHER_MEANING), [])

    def test_rows_laws_and_other_words_may_have_them(self):
        self.assertEqual(problems({"libkr5/src/physics/tool.cpp": 'cell.effects.number("wobble", "mass")'}), [])
        self.assertEqual(problems({"sim/src/a.cpp": 'int wobble = 0; f("wobbles"); g("effects.other");'}), [])

    def test_an_id_alone_and_one_in_a_path_are_named(self):
        for text in (
            'f("wobble")',
            "f('wobble')",
            'f("effects.wobble.tool.mass: bad")',
            'f("tool and effects.wobble")',
        ):
            (line,) = problems({"sim/src/a.cpp": "\n" + text})
            self.assertIn("sim/src/a.cpp:2: 'wobble'", line)

    def test_an_allowance_holds_where_it_says_and_for_the_id_alone(self):
        allowed = {"sag": ("tools/x.py",)}
        self.assertEqual(problems({"tools/x.py": '"sag"'}, allowed), [])
        self.assertEqual(len(problems({"tools/x.py": '"sag"', "tools/y.py": '"sag"'}, allowed)), 1)
        self.assertEqual(len(problems({"tools/x.py": '"sag" "effects.sag"'}, allowed)), 1)

    def test_an_allowance_that_matches_nothing_is_named(self):
        (line,) = problems({}, {"sag": ("tools/x.py",)})
        self.assertIn("OTHER_MEANING: 'sag'", line)

    def test_a_tree_without_rows_fails(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(effect_ids.check(Path(folder), {}), ["no rows found"])


if __name__ == "__main__":
    unittest.main()
