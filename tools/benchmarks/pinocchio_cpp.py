"""Time of Pinocchio's inverse dynamics and regressor in C++, whose headers the PyPI wheel `pin` carries; compiled once
(about a minute)."""

import importlib.util
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

SOURCE = Path(__file__).with_name("pinocchio_rnea.cpp")
PROGRAM = Path(__file__).resolve().parents[2] / "build" / "bench" / "pinocchio_rnea"
DEFINES = (
    "BOOST_MPL_LIMIT_LIST_SIZE=30",
    "BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    "BOOST_FUSION_INVOKE_MAX_ARITY=10",
    "NDEBUG",
)


def program() -> Path:
    """The compiled comparison, made again when its source is newer."""
    if PROGRAM.exists() and PROGRAM.stat().st_mtime > SOURCE.stat().st_mtime:
        return PROGRAM
    found = importlib.util.find_spec("pinocchio")
    if found is None or found.origin is None:
        raise SystemExit("error: Pinocchio is not installed: pip install pin")
    prefix = next((p for p in Path(found.origin).parents if p.name == "cmeel.prefix"), None)
    if prefix is None or not (prefix / "include/pinocchio").is_dir():
        raise SystemExit(f"error: {found.origin}: no headers beside it; the wheel `pin` from PyPI has them")
    PROGRAM.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run(
        [
            os.environ.get("CXX", "c++"),
            "-std=c++17",
            "-O3",
            *(f"-D{d}" for d in DEFINES),
            f"-I{prefix / 'include'}",
            "-I/usr/include/eigen3",
            str(SOURCE),
            "-o",
            str(PROGRAM),
        ],
        check=True,
    )
    return PROGRAM


class Times(NamedTuple):
    """Least processor time of a call [s], each with a sum over all states."""

    rnea: float
    torque_sum: float  # of the torques of the first joint
    regressor: float
    regressor_sum: float  # of its first row, in the column of the last link's mass


def times(places: list[np.ndarray], links: list[Any], gravity: Any, states: np.ndarray) -> Times:
    """Times of Pinocchio's rnea and computeJointTorqueRegressor.

    `places`: 4 x 4 of each joint (turning about its Z) in the one before; `links`: (mass, com, inertia 3 x 3) in the
    frame of the joint; `states`: a row each, positions, speeds and accelerations."""
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
        print(len(places), file=file)
        print(*gravity, file=file)
        for T, (mass, com, inertia) in zip(places, links):
            print(*(f"{x:.17g}" for x in (*np.ravel(T), mass, *com, *np.ravel(inertia))), file=file)
        print(len(states), file=file)
        np.savetxt(file, states, "%.17g")
        file.flush()
        out = subprocess.run([str(program()), file.name], check=True, capture_output=True, text=True).stdout.split()
    return Times(*map(float, out))
