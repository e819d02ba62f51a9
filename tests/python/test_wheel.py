"""The wheel that brings its libraries, where nothing but Python is installed (tools/wheel)."""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from conftest import ROOT

sys.path.insert(0, str(ROOT / "tools/wheel"))
import bare_system
import libraries

HOUSE = Path(os.environ.get("KR5_WHEELHOUSE", ROOT / "build/wheelhouse"))
LARGEST = 90_000_000  # bytes


@pytest.fixture(scope="module")
def wheel():
    found = sorted(HOUSE.glob("kr5-*.whl"))
    lacking = None if found else f"no wheel in {HOUSE}: ./tools/run wheel makes it"
    if not shutil.which("bwrap"):
        lacking = "bwrap is not installed (Debian: bubblewrap), so there is no bare system to try the wheel in"
    if lacking and os.environ.get("CI"):
        pytest.fail(lacking)
    if lacking:
        pytest.skip(lacking)
    (file,) = found
    return file


@pytest.fixture(scope="module")
def bare(wheel, tmp_path_factory):
    """Runs a command in a system that has Python and an environment with the wheel, and nothing else of ours."""
    folder = tmp_path_factory.mktemp("bare")
    root, environment, work = folder / "root", folder / "environment", folder / "work"
    root.mkdir()
    work.mkdir()
    bare_system.make(root)
    subprocess.run(["/usr/bin/python3", "-m", "venv", environment], check=True)
    pip = [environment / "bin/python", "-m", "pip", "install", "--disable-pip-version-check", "-q", wheel]
    done = subprocess.run(pip, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr

    def run(*words, readable=()):
        command = bare_system.command(
            root, [str(environment / "bin" / words[0]), *map(str, words[1:])], [environment, *readable], [work], {}
        )
        command[-len(words) : -len(words)] = ["--chdir", str(work)]
        return subprocess.run(command, capture_output=True, text=True, timeout=500)

    run.work = work
    run.packages = next(environment.glob("lib/python3.*/site-packages"))
    return run


def test_the_bare_system_has_none_of_the_libraries(bare):
    code = "import ctypes, sys; ctypes.CDLL(sys.argv[1])"
    for name in (
        "libopencv_core.so.406",
        "libvisp_core.so.3.5",
        "libdart.so.6.12",
        "libpcl_common.so.1.13",
        "libglog.so.1",
    ):
        done = bare("python", "-c", code, name)
        assert done.returncode and "cannot open shared object file" in done.stderr, name


def test_every_library_comes_from_the_wheel_or_is_the_systems(bare):
    code = (
        "import kr5.vision, kr5.picking, kr5.sim\n"
        "print(*{line.split()[-1] for line in open('/proc/self/maps') if '.so' in line.split()[-1]}, sep='\\n')"
    )
    done = bare("python", "-c", code)
    assert done.returncode == 0 and not done.stderr, done.stderr
    ours = {Path(name) for name in done.stdout.split() if "site-packages" in name}
    assert sum(path.parent.name == "kr5.libs" for path in ours) > 40
    for extension in bare.packages.glob("kr5/*.so"):
        there = {path.name for path in bare.packages.glob("kr5.libs/*")}
        for name in libraries.needed(extension):
            assert name in there or libraries.SYSTEM.match(name), f"{extension.name} needs {name}"


def test_the_command_starts_and_tells_what_there_is(bare):
    done = bare("kr5", "--help")
    assert done.returncode == 0 and not done.stderr
    assert "calibrate" in done.stdout and "gap" in done.stdout


def test_the_demo_finds_its_data_and_the_truth(bare):
    """Camera and hand-eye from images, a recording of a worn cell with its gap, an insertion in DART."""
    done = bare("kr5", "demo", "-o", "demo", "--json", "demo.json")
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads((bare.work / "demo.json").read_text())
    assert found["region_99_9"] < 1 and found["insertion"]["inserted"]
    assert (bare.work / "demo/hand_eye.html").stat().st_size > 100_000


def test_a_diagnosis_writes_its_page(bare):
    case = bare.packages / "kr5/share/data/recording"
    done = bare("kr5", "gap", "diagnose", case, "--report", "gap.html", "--json", "gap.json")
    assert done.returncode == 0, done.stderr
    causes = json.loads((bare.work / "gap.json").read_text())["causes"]
    assert [c["effect"] for c in causes] == ["stribeck_friction", "tool_offset"]
    assert "stribeck" in (bare.work / "gap.html").read_text()


@pytest.mark.parametrize("example", ["02_camera", "05_own_effect", "14_picking"])
def test_an_example_runs_as_typed(bare, example):
    folder = ROOT / "tools/examples"
    done = bare("python", folder / f"{example}.py", readable=[folder])
    assert done.returncode == 0, done.stderr
    assert done.stdout == (folder / f"{example}.txt").read_text()


def test_images_of_every_kind_are_read_and_others_are_refused(bare):
    """Also without the libraries of OpenCV that were left out of the wheel."""
    code = """
import numpy as np
from kr5 import vision
image = (np.arange(48 * 64).reshape(48, 64) % 251).astype(np.uint8)
for ending in ("png", "tif", "bmp", "pgm", "jpg"):
    vision.save_image(image, f"image.{ending}")
    seen = vision.load_image(f"image.{ending}").astype(int)
    assert seen.shape == image.shape
    assert ending == "jpg" or np.array_equal(seen, image), ending
open("image.dcm", "wb").write(b"\\0" * 128 + b"DICM" + b"\\0" * 64)
open("image.ntf", "wb").write(b"NITF02.10" + b" " * 400)
for ending in ("dcm", "ntf"):
    try:
        vision.load_image(f"image.{ending}")
    except OSError as error:
        print(error)
"""
    done = bare("python", "-c", code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("expected PNG, JPEG, TIFF, BMP or PGM") == 2


def test_the_licence_of_every_library_is_in_the_wheel(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        index = archive.read(next(n for n in names if n.endswith("licenses/bundled/README.md"))).decode()
    bundled = [Path(n).name for n in names if n.startswith("kr5.libs/lib")]
    assert len(bundled) > 40
    for name in bundled:
        plain = re.sub(r"-[0-9a-f]{8}", "", name, count=1).split(".so")[0]
        if plain == "libkr5_left_out":
            continue
        (row,) = [line for line in index.splitlines() if re.search(rf"[| ]{re.escape(plain)}\.so[.\w]*[, ]", line)]
        licence = row.rstrip("| ").rsplit("|", 1)[1].strip()
        assert any(n.endswith(f"licenses/bundled/{licence}") for n in names), licence
    assert any(n.endswith("bundled/GPL-3.txt") for n in names)


def test_the_wheel_says_for_which_systems_it_is_and_is_not_large(wheel):
    assert re.search(r"-manylinux_2_\d+_x86_64\.whl$", wheel.name)
    assert wheel.stat().st_size < LARGEST


def test_a_library_that_is_left_out_throws_when_it_is_called(tmp_path):
    """The stub: functions throw, data are zero, what must do nothing does nothing."""
    from left_out import stub_source
    from libraries import Symbol

    symbols = [Symbol("fails", "", "T", 0), Symbol("GDALAllRegister", "", "T", 0), Symbol("number", "", "D", 8)]
    main = """
#include <cstdio>
#include <stdexcept>
extern "C" { void fails(); void GDALAllRegister(); extern long number; }
int main() {
  GDALAllRegister();
  if (number != 0) return 2;
  try { fails(); } catch (const std::runtime_error& error) { std::puts(error.what()); return 0; }
  return 1;
}
"""
    (tmp_path / "main.cpp").write_text(main)
    (tmp_path / "stub.cpp").write_text(stub_source(symbols))
    program = tmp_path / "program"
    subprocess.run(["c++", "-o", program, tmp_path / "main.cpp", tmp_path / "stub.cpp"], check=True)
    done = subprocess.run([program], capture_output=True, text=True)
    assert done.returncode == 0 and "left out of the wheel" in done.stdout
