"""What a user's CMake sees: the installed package, one module alone, and the order of modules.

Usage: packages.py NAME_OF_CHECK --build FOLDER [--cmake CMAKE]     FOLDER is a build of everything
"""

import argparse
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HEAVY = ("opencv", "visp", "apriltag", "dart")


class Workshop:
    """Runs CMake in a folder of its own below the build folder."""

    def __init__(self, cmake: str, build: Path, name: str):
        self.cmake, self.build, self.folder = cmake, build, build / "checks" / name
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)

    def run(self, *args: object, fails: bool = False) -> str:
        done = subprocess.run([str(a) for a in args], capture_output=True, text=True, cwd=self.folder)
        text = done.stdout + done.stderr
        if (done.returncode != 0) != fails:
            sys.exit(f"{'succeeded' if fails else 'failed'}: {' '.join(map(str, args))}\n{text}")
        return text

    def configure(self, source: Path, into: str, *args: str, fails: bool = False) -> str:
        base = (self.cmake, "-G", "Ninja", "-S", source, "-B", self.folder / into)
        return self.run(*base, "-DCMAKE_BUILD_TYPE=Release", *args, fails=fails)

    def install(self) -> Path:
        prefix = self.folder / "prefix"
        self.run(self.cmake, "--install", self.build, "--prefix", prefix)
        return prefix

    def mentions(self, into: str, *words: str) -> list[str]:
        """Lines of the cache, the build rules and the package lookups that name one of the words."""
        files = [self.folder / into / "CMakeCache.txt", self.folder / into / "build.ninja"]
        pattern = re.compile("|".join(words), re.I)
        return [
            line
            for file in files
            for line in file.read_text().splitlines()
            if pattern.search(line.replace(str(ROOT), "").replace(str(self.folder), ""))
        ]


def expect_none(lines: list[str], what: str) -> None:
    if lines:
        sys.exit(f"{what}:\n" + "\n".join(lines[:10]))


def consumer(w: Workshop) -> None:
    """A project apart finds the installed module, builds, runs, and never searches for another module's packages."""
    prefix = w.install()
    w.configure(ROOT / "tests/consumer", "consumer", f"-DCMAKE_PREFIX_PATH={prefix}")
    w.run(w.cmake, "--build", w.folder / "consumer")
    print(w.run(w.folder / "consumer/consumer"))
    expect_none(w.mentions("consumer", *HEAVY), "a user of calibration searches for packages of vision")


def scene(w: Workshop) -> None:
    """A project apart runs a scene of its own, in its program and as a test of its ctest."""
    prefix = w.install()
    w.configure(ROOT / "tests/consumer", "consumer", f"-DCMAKE_PREFIX_PATH={prefix}", "-DCOMPONENT=sim")
    w.run(w.cmake, "--build", w.folder / "consumer")
    print(w.run(w.folder / "consumer/consumer", ROOT / "tests/consumer/scene.yaml"))
    w.run(Path(w.cmake).parent / "ctest", "--test-dir", w.folder / "consumer", "--no-tests=error")


def missing_component(w: Workshop) -> None:
    """Asking for a module that was not installed says so, and says what there is."""
    prefix = w.install()
    text = w.configure(
        ROOT / "tests/consumer", "consumer", f"-DCMAKE_PREFIX_PATH={prefix}", "-DCOMPONENT=simulation", fails=True
    )
    said = " ".join(text.split())
    if "kr5 was installed without the module 'simulation' (it has: core" not in said:
        sys.exit(f"the message does not help:\n{text}")


def calibration_alone(w: Workshop) -> None:
    """The calibration module alone neither finds nor links what vision uses."""
    w.configure(ROOT, "alone", "-DKR5_MODULES=calibration", "-DKR5_BUILD_TESTS=OFF")
    expect_none(w.mentions("alone", *HEAVY), "calibration alone mentions packages of vision")


def geometry_alone(w: Workshop) -> None:
    """Geometry alone finds Eigen and nothing else."""
    w.configure(ROOT, "alone", "-DKR5_MODULES=geometry", "-DKR5_BUILD_TESTS=OFF")
    expect_none(w.mentions("alone", "ceres", "yaml", "boost", *HEAVY), "geometry alone mentions other packages")


def order(w: Workshop) -> None:
    """A module that uses one declared below it stops the configuration with a plain sentence."""
    (w.folder / "CMakeLists.txt").write_text(
        f"cmake_minimum_required(VERSION 3.25)\nproject(order LANGUAGES CXX)\n"
        f'list(APPEND CMAKE_MODULE_PATH "{ROOT}/libkr5/cmake")\ninclude(Kr5Module)\n'
        "kr5_module(lower DEPENDS upper)\nkr5_module(upper)\n"
    )
    text = w.configure(w.folder, "build", fails=True)
    if "module 'lower' uses 'upper', which is not declared above it" not in " ".join(text.split()):
        sys.exit(f"the message does not help:\n{text}")


def main() -> None:
    checks = {f.__name__: f for f in (consumer, scene, missing_component, calibration_alone, geometry_alone, order)}
    parser = argparse.ArgumentParser()
    parser.add_argument("check", choices=checks)
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--cmake", default="cmake")
    given = parser.parse_args()
    checks[given.check](Workshop(given.cmake, given.build.resolve(), given.check))


if __name__ == "__main__":
    main()
