"""The include check finds what is planted for it, and nothing in a sound tree."""

import importlib.util
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
spec = importlib.util.spec_from_file_location("includes", ROOT / "tools/checks/includes.py")
includes = importlib.util.module_from_spec(spec)
spec.loader.exec_module(includes)

TABLE = """
kr5_module(core     PACKAGES "Eigen3 3.4 NO_MODULE")
kr5_module(geometry DEPENDS core)
kr5_module(vision   DEPENDS geometry PACKAGES "OpenCV 4.6 COMPONENTS core"
           "VISP 3.5" LINKS opencv_core)
kr5_module(sim      DEPENDS geometry PACKAGES "DART 6.12 CONFIG" LINKS dart FOLDER sim)
"""


def problems(path: str, line: str) -> list[str]:
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        (root / "libkr5").mkdir()
        (root / "libkr5/CMakeLists.txt").write_text(TABLE)
        file = root / path
        file.parent.mkdir(parents=True)
        file.write_text(line + "\n")
        return includes.check(root)


class IncludesTest(unittest.TestCase):
    def test_the_project_keeps_its_own_table(self):
        self.assertEqual(includes.check(ROOT), [])

    def test_a_public_header_may_show_eigen_std_and_modules_above(self):
        for line in ("#include <Eigen/Core>", "#include <vector>", "#include <kr5/core/error.hpp>"):
            self.assertEqual(problems("libkr5/include/kr5/geometry/a.hpp", line), [])

    def test_a_public_header_may_show_nothing_else(self):
        for line in (
            "#include <opencv2/core.hpp>",
            "#include <kr5/vision/image.hpp>",
            '#include "detail.hpp"',
            "#  include <boost/math/x.hpp>",
            "#include <unistd.h>",
        ):
            self.assertEqual(len(problems("libkr5/include/kr5/geometry/a.hpp", line)), 1, line)

    def test_a_source_may_use_only_the_packages_its_module_lists(self):
        self.assertEqual(problems("libkr5/src/vision/a.cpp", "#include <visp3/core/vpMath.h>"), [])
        self.assertEqual(problems("libkr5/src/vision/a.cpp", "#include <opencv2/core.hpp>"), [])
        for line in (
            "#include <opencv2/core.hpp>",
            "#include <kr5/vision/image.hpp>",
            "#include <dart/x.hpp>",
            '#include "vision/detail.hpp"',
            "#include <pybind11/pybind11.h>",
        ):
            self.assertEqual(len(problems("libkr5/src/geometry/a.cpp", line)), 1, line)

    def test_only_the_sources_of_the_simulation_use_dart(self):
        self.assertEqual(problems("sim/src/a.cpp", "#include <dart/dynamics/Skeleton.hpp>"), [])
        for file in ("sim/include/kr5/sim/a.hpp", "libkr5/src/vision/a.cpp", "libkr5/src/core/a.cpp"):
            self.assertEqual(len(problems(file, "#include <dart/dynamics/Skeleton.hpp>")), 1, file)
        self.assertEqual(len(problems("libkr5/src/geometry/a.cpp", "#include <kr5/sim/arm.hpp>")), 1)

    def test_a_folder_that_is_no_module_is_found(self):
        self.assertEqual(len(problems("libkr5/src/stray/a.cpp", "")), 1)


if __name__ == "__main__":
    unittest.main()
