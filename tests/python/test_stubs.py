"""The stubs beside the extensions: there, complete, and of use to a type checker."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import kr5
import pytest

FOLDER = Path(kr5.__file__).parent
STUBS = sorted([*FOLDER.glob("_kr5*.pyi"), *FOLDER.glob("_kr5*/*.pyi")])

pytestmark = pytest.mark.skipif(
    not STUBS and "site-packages" not in kr5.__file__, reason="stubs come with the installed package only"
)


def test_the_package_says_it_is_typed():
    assert (FOLDER / "py.typed").exists() and STUBS


def test_every_public_name_of_the_extensions_stands_in_a_stub():
    import kr5._kr5 as extension

    modules = [
        extension,
        *(m for _, m in inspect.getmembers(extension, inspect.ismodule) if m.__name__.startswith("kr5._kr5.")),
    ]
    for module in modules:
        path = FOLDER.joinpath(*module.__name__.split(".")[1:])
        stub = path / "__init__.pyi" if path.is_dir() else path.with_suffix(".pyi")
        tree = ast.parse(stub.read_text())
        named = {n.name for n in tree.body if isinstance(n, (ast.ClassDef, ast.FunctionDef))}
        named |= {
            a.asname for n in tree.body if isinstance(n, ast.ImportFrom) for a in n.names
        }  # one type, two modules
        public = {n for n, v in vars(module).items() if n[0] != "_" and (inspect.isclass(v) or inspect.isroutine(v))}
        assert public <= named, public - named


GOOD = """
import kr5
import kr5.gap
import kr5.sim
import kr5.vision
import numpy as np
from kr5 import calibration
camera = kr5.Pinhole(width=640, height=480, fx=500.0)
x: float = camera.fx
pixels: np.ndarray = camera.project(np.zeros((3, 2)))
report = kr5.FitReport(status="converged")
view = kr5.View(points=np.zeros((5, 3)), pixels=kr5.points_from_rows([[1, 2], [3, 4]]))
found = kr5.gap.diagnose(kr5.share("data/recording"))
gap: float = kr5.gap.measure("folder", cell=found.cell).gap
fits = kr5.gap.fit_effects("folder", ["payload:tool"])
plan = kr5.gap.plan("folder", ["payload:tool", ["ft_bias:fz", kr5.gap.EffectName(effect="payload", target="tool")]])
table: str = found._repr_html_()
result = calibration.calibrate_hand_eye([], camera)
diagnosis = calibration.diagnose_hand_eye([calibration.HandEyeView()], camera, result)
"""


@pytest.mark.parametrize(
    "code, complaint",
    [
        (GOOD, None),
        ("import kr5\nkr5.Pinhole(widht=3)", "widht"),
        ("import kr5\nkr5.Pinhole().fx = 'wide'", "assignment"),
        ("import kr5.gap\nkr5.gap.diagnose(3)", "arg-type"),
    ],
)
def test_a_type_checker_accepts_what_is_right_and_finds_what_is_wrong(tmp_path, code, complaint):
    file = tmp_path / "script.py"
    file.write_text(code)
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--no-incremental", str(file)], capture_output=True, text=True, cwd=tmp_path
    )
    assert (done.returncode == 0) == (complaint is None), done.stdout
    assert complaint is None or complaint in done.stdout
