"""`kr5 identify elasticity`."""

import json

import numpy as np
import pytest
from kr5 import cell, identification
from kr5.files.paths import find_shipped_cell


def write(file, columns):
    rows = np.column_stack(list(columns.values()))
    file.write_text("\n".join([",".join(columns), *(",".join(f"{v:.12g}" for v in row) for row in rows)]) + "\n")


@pytest.fixture
def readings():
    """Two joints: a spring with play, and one without; angles in rad."""
    random = np.random.default_rng(4)
    tau = random.uniform(-60, 60, (200, 2))
    q = random.uniform(-1, 1, (200, 2))
    lead = 2e-4 + tau / [2e4, 8e3] + np.sign(tau) * [4e-4, 0]
    noise = random.normal(0, 1e-5, (200, 2))
    seen = tau + random.normal(0, 1, (200, 2))
    return {
        **{f"q{k + 1}": q[:, k] for k in range(2)},
        **{f"m{k + 1}": (q + lead + noise)[:, k] for k in range(2)},
        **{f"tau{k + 1}": seen[:, k] for k in range(2)},
    }


def test_stiffness_and_play_are_found_and_go_into_the_cell(tmp_path, run_kr5, readings):
    in_degrees = {name: v if name.startswith("tau") else np.degrees(v) for name, v in readings.items()}
    write(tmp_path / "readings.csv", in_degrees)
    words = ("--torque-noise", "1", "--angle-unit", "deg", "--cell", find_shipped_cell(), "--write-cell", "soft.yaml")
    done = run_kr5("identify", "elasticity", "readings.csv", *words, "-o", "e.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "e.json").read_text())
    assert data["format"] == "kr5-elasticity/1" and data["verdict"]["word"] == "good"
    first, second = data["result"]["joints"]
    assert first["stiffness"] == pytest.approx(2e4, rel=0.02) and first["gap"] == pytest.approx(8e-4, rel=0.05)
    assert second["stiffness"] == pytest.approx(8e3, rel=0.01) and second["gap"] == 0
    effects = cell.load_cell(tmp_path / "soft.yaml").effects
    assert effects.get("joint_elasticity", "joint1", "stiffness") == pytest.approx(first["stiffness"])
    assert effects.get("backlash", "joint1", "gap") == pytest.approx(first["gap"])
    assert run_kr5("report", "e.json", "-o", "page.html", "--png", "plots").returncode == 0
    assert {f.stem for f in (tmp_path / "plots").iterdir()} == {"joint_springs"}


def test_gravity_of_a_cell_is_the_torque_of_readings_at_rest(tmp_path, run_kr5):
    nominal = cell.load_cell(find_shipped_cell())
    random = np.random.default_rng(2)
    limits = nominal.robot.limits
    q = random.uniform(limits.lower, limits.upper, (60, 6))
    still = np.zeros((60, 6))
    states = identification.JointMotion(t=np.arange(60), q=q, qd=still, qdd=still, tau=still)
    tau = np.asarray(identification.nominal_torques(nominal, states))
    m = q + tau / 5e4 + random.normal(0, 1e-6, (60, 6))
    names = [f"{kind}{k + 1}" for kind in ("q", "m") for k in range(6)]
    write(tmp_path / "rest.csv", dict(zip(names, np.hstack([q, m]).T, strict=True)))
    done = run_kr5("identify", "elasticity", "rest.csv", "--cell", find_shipped_cell(), "--json", "-")
    assert done.returncode == 0, done.stderr
    data = json.loads(done.stdout)
    joints = data["result"]["joints"]
    for k in (1, 2, 4):  # that carry a weight
        assert joints[k]["stiffness"] == pytest.approx(5e4, rel=0.02)
    assert not joints[0]["told"] and "joint 1: the torques change too little" in data["verdict"]["text"]


def test_readings_that_cannot_be_are_refused(tmp_path, run_kr5, readings):
    def refused(*words, **changes):
        columns = {name: v for name, v in (readings | changes).items() if v is not None}
        write(tmp_path / "readings.csv", columns)
        done = run_kr5("identify", "elasticity", "readings.csv", *words, "-o", "no.json")
        assert done.returncode == 2 and "Traceback" not in done.stderr and not (tmp_path / "no.json").exists()
        return " ".join(done.stderr.replace("│", " ").split())

    assert "found no torques tau1" in refused(tau1=None, tau2=None)
    assert "missing: m1, m2, … (motor angles over the gear ratio; see --columns)" in refused(m1=None, m2=None)
    assert "torque: joint 1 deflects against its torque" in refused(tau1=-readings["tau1"])
    assert "over the gear ratio" in refused(m2=125 * readings["m2"])
    assert "'grad' is not one of 'rad', 'deg'" in refused("--angle-unit", "grad")
    assert "--torque-noise: found 'x'" in refused("--torque-noise", "x")
    assert "torque_noise: found 3 values, expected 1 or 2" in refused("--torque-noise", "1,1,1")
    assert "stiffness of 0 of 2 joints determined" in refused("--torque-noise", "50")
    assert "--write-cell: --cell is missing" in refused("--write-cell", "x.yaml")
    (tmp_path / "torn.csv").write_text("q1,m1,tau1\n1,2\n")
    done = run_kr5("identify", "elasticity", "torn.csv")
    assert done.returncode == 2 and "line 2: found 2 values, expected 3" in " ".join(
        done.stderr.replace("│", " ").split()
    )
    assert "no such file" in " ".join(run_kr5("identify", "elasticity", "absent.csv").stderr.split())


def result(folder):
    random = np.random.default_rng(4)
    tau, q = random.uniform(-60, 60, (200, 2)), random.uniform(-1, 1, (200, 2))
    lead = tau / [2e4, 8e3] + random.normal(0, 1e-5, tau.shape)
    columns = {"q": q, "m": q + lead, "tau": tau + random.normal(0, 1, tau.shape)}
    table = {f"{name}{k + 1}": values[:, k] for name, values in columns.items() for k in range(2)}
    write(folder / "readings.csv", table)
    return "identify", "elasticity", "readings.csv", "--torque-noise", "1", "-o", "r.json"


RESULTS = {"kr5-elasticity/1": result}

DAMAGED = [
    (
        "identification",
        "identify elasticity springs.csv --torque-noise 1 --cell cell.yaml --write-cell new.yaml -o out.json",
        "poses",
        ("springs.csv", "cell.yaml"),
        ("out.json", "new.yaml"),
    )
]
