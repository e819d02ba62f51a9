"""`kr5 gap compare` and kr5.arm_log.compare_recordings."""

import json

import numpy as np
import pytest

from arm_logs import carrying, joint_states, moved
from conftest import ROOT

URDF = ROOT / "share/data/arm_log/arm.urdf"


@pytest.fixture(scope="module")
def arm():
    import kr5.cell

    return kr5.cell.import_urdf(URDF).cell


def log_file(folder, name, arm, seed):
    columns = joint_states(*moved(arm, seed=seed), names=list(arm.robot.joint_names))
    file = folder / name
    np.savetxt(file, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="")
    return file


def test_only_what_changed_between_two_logs_is_told(run_kr5, tmp_path, arm):
    before = carrying(arm, "coulomb_friction", "joint2", coulomb=6.0)
    after = carrying(before, "viscous_friction", "joint1", viscous=12.0)
    files = [log_file(tmp_path, f"{k}.csv", cell, k + 1) for k, cell in enumerate((before, after))]
    done = run_kr5("gap", "compare", *files, "--model", URDF, "--json", "change.json", "-o", "result.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "change.json").read_text())
    assert data["format"] == "kr5-gap-comparison/1"
    assert [(c["effect"], c["target"]) for c in data["changes"]] == [("viscous_friction", "joint1")]
    size = data["changes"][0]["parameters"][0]
    assert abs(size["second"][0] - size["first"][0] - 12.0) < 4 * size["std"][0]
    assert ("coulomb_friction", "joint2") in [(c["effect"], c["target"]) for c in data["common"]]
    assert "Viscous friction of joint 1" in done.stdout
    page = run_kr5("report", "result.json", "-o", "page.html")
    assert page.returncode == 0 and "Viscous friction of joint 1" in (tmp_path / "page.html").read_text()


def test_two_logs_of_one_arm_do_not_differ(run_kr5, tmp_path, arm):
    worn = carrying(arm, "coulomb_friction", "joint2", coulomb=6.0)
    files = [log_file(tmp_path, f"{k}.csv", worn, k + 1) for k in range(2)]
    done = run_kr5("gap", "compare", *files, "--model", URDF, "--json", "change.json")
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "change.json").read_text())["changes"] == []
    assert "do not differ by more than noise" in done.stdout


def test_a_missing_log_is_named(run_kr5, tmp_path, arm):
    file = log_file(tmp_path, "a.csv", arm, 1)
    done = run_kr5("gap", "compare", file, "absent.csv", "--model", URDF)
    assert done.returncode == 2 and "absent.csv" in done.stderr
