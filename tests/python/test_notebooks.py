"""The notebooks: they run from any folder, find the truth, and show what was committed with them."""

import json
import sys

import pytest

from conftest import ROOT

sys.path.insert(0, str(ROOT / "tools"))
import notebooks

NOTEBOOKS = sorted((ROOT / "share/notebooks").glob("*.ipynb"))
LARGEST = 400_000  # bytes, pictures included

# What the last cell of each would have to state, for it to have found the truth.
CHECKS = {
    "my_hand_eye": """
from kr5 import uncertainty

off = kr5.pose_difference(result.T_mount_camera, truth["T_flange_camera"])
assert off @ np.linalg.solve(result.covariance, off) < uncertainty.chi_square_quantile(0.999, 6)
assert str(diagnosis.verdict) == "good" and [v.name for v in result.views if v.outlier] == ["view 11"]
assert {fault: [c for c in causes if c != "outlier_views"] for fault, causes in named.items()} == {
    "board stated as a tenth smaller than it is": ["target_size_wrong"],
    "flange in base taken for base in flange": ["poses_inverted"],
    "two photographs in the wrong order": ["out_of_order"],
    "one photograph lost, so all poses are one too early": ["shifted_by_one"],
}
""",
    "my_robots_gap": """
import yaml

truth = yaml.safe_load((folder / "truth.yaml").read_text())["effects"]
assert str(diagnosis.verdict) == "explained"
assert {(c.effect, c.target) for c in diagnosis.causes} == {(e, t) for e, at in truth.items() for t in at}
for cause in diagnosis.causes:
    for p in cause.parameters:
        true = truth[cause.effect][cause.target][p.name]
        assert np.all(np.abs(np.asarray(p.value) - true) < 4 * np.asarray(p.std)), p
assert kr5.gap.measure(folder, cell=tuned).gap < 1.1 < 6 < measured.gap
assert gaps["without tool_offset"]["poses-2.x"] > 10 > 1.2 > gaps["tuned"]["poses-2.x"]
assert gaps["without stribeck_friction"]["motion-4.i2"] > 2 > 1.2 > gaps["tuned"]["motion-4.i2"]
assert "stribeck_friction" in kr5.cell.load_cell("tuned.yaml").effects.to_dict()
""",
}


def printed(book):
    """What each cell printed, in however many pieces it came."""
    outputs = [c.get("outputs", []) for c in book["cells"]]
    texts = ["".join("".join(o["text"]) for o in of_cell if o.get("name") == "stdout") for of_cell in outputs]
    return [text for text in texts if text]


def test_every_notebook_is_checked():
    assert {file.stem for file in NOTEBOOKS} == set(CHECKS)


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_was_committed_with_its_outputs_and_is_small(file):
    book = json.loads(file.read_text())
    assert file.stat().st_size < LARGEST
    code = [c for c in book["cells"] if c["cell_type"] == "code"]
    assert [c["execution_count"] for c in code] == list(range(1, len(code) + 1))
    kinds = {key for c in code for o in c["outputs"] for key in o.get("data", {})}
    assert {"text/html", "image/png"} <= kinds
    assert not any(o["output_type"] == "error" or o.get("name") == "stderr" for c in code for o in c["outputs"])
    assert str(ROOT) not in file.read_text()


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_runs_and_finds_the_truth(file, tmp_path):
    book = notebooks.execute(file, tmp_path, CHECKS[file.stem])
    assert printed(book) == printed(json.loads(file.read_text()))
