"""`kr5 gap diagnose` and kr5.gap.diagnose."""

import json
from pathlib import Path

import kr5.cell
import kr5.gap
import pytest


def test_a_labelled_recording_is_diagnosed(run_kr5, reference, tmp_path):
    case = reference / "cases" / "case-008"
    if not case.exists():
        pytest.skip(f"no recording in {case}")
    done = run_kr5(
        "gap",
        "diagnose",
        case,
        "--json",
        tmp_path / "gap.json",
        "--write-cell",
        tmp_path / "cell.yaml",
        "--report",
        "gap.html",
        "-o",
        "result.json",
    )
    assert done.returncode == 0, done.stderr
    assert "tube_tilt" in done.stdout
    data = json.loads((tmp_path / "gap.json").read_text())
    assert data["format"] == "kr5-gap/2" and data["verdict"] == "explained"
    assert [(c["effect"], c["target"]) for c in data["causes"]] == [("tube_tilt", "tube")]
    tilt = data["causes"][0]["parameters"]["tilt"]
    assert tilt["unit"] == "rad" and len(tilt["value"]) == len(tilt["std"]) == 2
    assert data["shrink"]["after"] < 1.1 < data["shrink"]["before"]
    assert Path(data["written"]["cell"]).name == "cell.yaml"
    cell = kr5.cell.load_cell(tmp_path / "cell.yaml")
    assert list(cell.effects.get("tube_tilt", "tube", "tilt")) == pytest.approx(tilt["value"])
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["input"]["recording"] == str(case.resolve()) and result["causes"] == data["causes"]
    assert "Tilt of the tube" in (tmp_path / "gap.html").read_text()
    has_the_keys_of_the_format(data)


def has_the_keys_of_the_format(data):
    """Those of kr5-gap/2: the fields of a diagnosis, and beside them the sentences made of them."""
    renamed = {"reduction": "shrink"}
    fields = {renamed.get(name, name) for name in kr5.gap.Diagnosis().to_dict()}
    assert set(data) - {"written"} == (fields - {"seconds", "seconds_screening"}) | {"format", "text", "warnings"}
    assert data["text"].startswith("Cause: tilt of the tube")
    assert data["where"] and data["causes"]
    for place in data["where"]:
        assert set(place) == {"experiment", "column", "target", "gap", "share", "depends_on"}
        for dependence in place["depends_on"]:
            assert set(dependence) == {*kr5.gap.Dependence().to_dict(), "text"}
    for cause in data["causes"]:
        assert set(cause) == {"effect", "target", "probability", "parameters", "gap_closed", "tied_with"}
        assert all(set(p) == {"value", "std", "unit"} for p in cause["parameters"].values())
        assert all(set(tie) == {"effect", "target"} for tie in cause["tied_with"])
    assert all(set(place) == set(data["where"][0]) for place in data["unexplained"])
    assert set(data["shrink"]) == {"before", "after", "floor", "before_ci", "after_ci", "columns"}
    assert set(data["next_experiment"]) == {*kr5.gap.NextExperiment().to_dict(), "text"}


def test_bad_options_and_folders_are_refused(run_kr5, tmp_path):
    done = run_kr5("gap", "diagnose", tmp_path)
    assert done.returncode == 2 and str(tmp_path) in done.stderr
    with pytest.raises(kr5.InvalidArgument, match="false_alarms"):
        kr5.gap.DiagnoseOptions(false_alarms=2.0).validate()
