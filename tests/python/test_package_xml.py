"""The description of the package for ROS (REP 149), by which colcon builds it."""

import json
import re
import xml.etree.ElementTree as xml

from conftest import ROOT

PACKAGE = xml.parse(ROOT / "package.xml").getroot()
# Libraries of libkr5/CMakeLists.txt, by the rosdep key that installs each.
KEYS = {
    "Eigen3": "eigen",
    "yaml-cpp": "yaml-cpp",
    "pugixml": "pugixml-dev",
    "Boost": "libboost-dev",
    "Ceres": "libceres-dev",
    "OpenCV": "libopencv-dev",
    "apriltag": "apriltag",
    "VISP": "visp",
    "PCL": "libpcl-all-dev",
    "SQLite3": "libsqlite3-dev",
}
WITHOUT_KEY = {"DART"}


def test_the_package_is_one_of_cmake_in_format_3():
    assert (PACKAGE.tag, PACKAGE.get("format"), PACKAGE.findtext("name")) == ("package", "3", "kr5")
    assert PACKAGE.findtext("export/build_type") == "cmake"
    assert PACKAGE.find("maintainer").get("email")
    assert PACKAGE.findtext("description").strip()


def test_its_version_is_that_of_cmake():
    version = re.search(r"project\(kr5 VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
    assert PACKAGE.findtext("version") == version


def test_its_licence_is_that_of_the_source():
    (licence,) = PACKAGE.findall("license")
    text = (ROOT / licence.get("file")).read_text()
    assert licence.text == "BSD-3-Clause" and text.startswith("BSD 3-Clause License")


def test_it_depends_on_what_the_modules_are_built_with():
    table = (ROOT / "libkr5/CMakeLists.txt").read_text()
    used = set()
    for packages in re.findall(r'PACKAGES ((?:"[^"]+"\s*|[\w-]+\s*)+?)(?=LINKS|FOLDER|\))', table):
        used |= {name.split()[0] for name in re.findall(r'"([^"]+)"', packages)} or {packages.split()[0]}
    assert used - WITHOUT_KEY == set(KEYS)
    assert {d.text for d in PACKAGE.findall("depend")} == set(KEYS.values())


def test_colcon_leaves_out_the_tests():
    assert json.loads((ROOT / "colcon.pkg").read_text()) == {"cmake-args": ["-DKR5_BUILD_TESTS=OFF"]}
