"""`kr5 gap diagnose` and kr5.gap.diagnose."""

import json

import pytest

kr5_gap = pytest.importorskip("kr5.gap")


def test_a_labelled_recording_is_diagnosed(run_kr5, reference, tmp_path):
    import kr5.cell

    case = reference / "cases" / "case-008"
    if not case.exists():
        pytest.skip(f"no recording in {case}")
    done = run_kr5("gap", "diagnose", case, "--json", tmp_path / "gap.json", "--write-cell", tmp_path / "cell.yaml")
    assert done.returncode == 0, done.stderr
    assert "tube_tilt" in done.stdout
    data = json.loads((tmp_path / "gap.json").read_text())
    assert data["format"] == "kr5-gap/1" and data["verdict"] == "explained"
    assert [(c["effect"], c["target"]) for c in data["causes"]] == [("tube_tilt", "tube")]
    tilt = data["causes"][0]["parameters"]["tilt"]
    assert tilt["unit"] == "rad" and len(tilt["value"]) == len(tilt["std"]) == 2
    assert data["shrink"]["after"] < 1.1 < data["shrink"]["before"]
    cell = kr5.cell.load_cell(tmp_path / "cell.yaml")
    assert list(cell.effects.get("tube_tilt", "tube", "tilt")) == pytest.approx(tilt["value"])


def test_bad_options_and_folders_are_refused(run_kr5, tmp_path):
    done = run_kr5("gap", "diagnose", tmp_path)
    assert done.returncode == 2 and str(tmp_path) in done.stderr
    with pytest.raises(kr5_gap_error(), match="false_alarms"):
        kr5_gap.DiagnoseOptions(false_alarms=2.0).validate()


def kr5_gap_error():
    import kr5

    return kr5.InvalidArgument
