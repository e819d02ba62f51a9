"""`kr5 identify gravity` and `kr5 identify excitation`."""

import json
import re

import numpy as np
import pytest
from kr5 import cell, identification, kinematics
from kr5.files.paths import find_shipped_cell

FEW = ("--duration", "10", "--starts", "3", "--exchanges", "40")


@pytest.fixture
def believed():
    return cell.load_cell(find_shipped_cell())


def slow_log(believed, file, noise=0.5, current=False, links=None, samples=500):
    """Every joint to and fro, slowly, with friction; torques, or currents."""
    t = np.linspace(0, 100, samples)
    chain = believed.nominal_chain()
    n = len(chain.joints)
    phase = np.outer(t, 0.2 + 0.03 * np.arange(n)) + np.arange(n)
    middle = 0.5 * (np.asarray(believed.robot.limits.lower) + np.asarray(believed.robot.limits.upper))
    q, qd = middle + 0.9 * np.sin(phase), 0.9 * (0.2 + 0.03 * np.arange(n)) * np.cos(phase)
    arm = kinematics.Dynamics(chain, links or believed.robot.links, believed.robot.gravity)
    tau = np.array([arm.gravity_torques(row) for row in q])
    tau += np.sign(qd) * 5.0 + np.random.default_rng(1).normal(0, noise, tau.shape)
    names, values = "tau", tau
    if current:
        names = "i"
        values = tau @ np.linalg.inv(believed.drives.structure) / believed.drives.torque_constant
    header = ["t", *(f"q{k + 1}" for k in range(n)), *(f"{names}{k + 1}" for k in range(n))]
    rows = [",".join(f"{v:.9g}" for v in row) for row in np.column_stack([t, q, values])]
    file.write_text("\n".join([",".join(header), *rows]) + "\n")
    return q


def load(folder, name):
    return json.loads((folder / name).read_text())


def test_gravity_from_currents_goes_into_the_cell_and_gives_limits(run_kr5, tmp_path, believed):
    true = believed.robot.links
    links = list(believed.robot.links)
    links[2].com = links[2].com + np.array([0.03, 0.0, 0.01])  # what the cell does not know
    q = slow_log(believed, tmp_path / "slow.csv", current=True, links=links)
    done = run_kr5(
        "identify", "gravity", find_shipped_cell(), "slow.csv", "--max-speed", "1", "--write-cell", "new.yaml",
        "--contact-force", "400", "-o", "gravity.json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    data = load(tmp_path, "gravity.json")
    assert data["verdict"]["word"] == "good"
    assert np.allclose(data["result"]["coulomb"], 5.0, atol=0.3)
    new = cell.load_cell(tmp_path / "new.yaml")
    # The log is of an arm without the tool that the cell has: arm and tool together hold what was measured.
    tool, last = new.tool, new.robot.links[-1]
    T = np.asarray(tool.T_flange_sensor)
    moment = last.mass * last.com + tool.mass * (T[:3, :3] @ tool.com + T[:3, 3])
    together = list(new.robot.links)
    body = together[-1]
    body.com, body.mass = moment / (last.mass + tool.mass), last.mass + tool.mass
    together[-1] = body
    measured = kinematics.Dynamics(new.nominal_chain(), links)
    identified = kinematics.Dynamics(new.nominal_chain(), together)
    before = kinematics.Dynamics(new.nominal_chain(), true)
    for row in q[::100]:
        assert identified.gravity_torques(row) == pytest.approx(measured.gravity_torques(row), abs=0.5)
    assert max(np.abs(before.gravity_torques(row) - measured.gravity_torques(row)).max() for row in q) > 5.0
    limits = data["result"]["limits"]
    assert np.all(np.array(limits["limit"]) > np.abs(limits["holding"]))
    assert run_kr5("report", "gravity.json", "-o", "page.html", "--png", "plots").returncode == 0
    assert (tmp_path / "plots" / "slow_torques.png").exists()


def test_planar_gravity_and_a_urdf_without_drives(run_kr5, tmp_path, believed):
    assert run_kr5("cell", "export", find_shipped_cell(), "-o", "arm.urdf").returncode == 0
    arm = cell.import_urdf(tmp_path / "arm.urdf").cell
    chain = arm.nominal_chain()
    home = np.array([0.0, -0.4, -2.4, 0.0, -0.8, 0.0])
    q, qd = np.tile(home, (600, 1)), np.zeros((600, 6))
    for k, j in enumerate((4, 2, 1)):
        phase = np.linspace(0, 2 * np.pi, 200)
        q[200 * k : 200 * k + 200, j] += 0.4 * (1 - np.cos(phase))
        qd[200 * k : 200 * k + 200, j] = 0.4 * 2 * np.pi / 19.9 * np.sin(phase)
    dynamics = kinematics.Dynamics(chain, arm.robot.links, arm.robot.gravity)
    tau = np.array([dynamics.gravity_torques(row) for row in q]) + np.sign(qd) * 3
    header = ",".join(["t", *(f"{k}{j + 1}" for k in ("q", "qd", "tau") for j in range(6))])
    table = np.column_stack([np.arange(600) * 0.1, q, qd, tau])
    np.savetxt(tmp_path / "slow.csv", table, delimiter=",", header=header, comments="")
    done = run_kr5("identify", "gravity", "arm.urdf", "slow.csv", "--planar", "-o", "g.json")
    assert done.returncode == 0, done.stderr
    data = load(tmp_path, "g.json")
    assert [h["angle"]["joint"] for h in data["result"]["planar"]["joints"]] == [4, 2, 1]
    assert data["verdict"]["word"] == "doubtful" and "joint 1 did not move slowly" in data["verdict"]["text"]


def test_logs_that_tell_no_gravity_are_refused(run_kr5, tmp_path, believed):
    slow_log(believed, tmp_path / "slow.csv")
    text = (tmp_path / "slow.csv").read_text()

    def refused(name, content, *more):
        (tmp_path / name).write_text(content)
        done = run_kr5("identify", "gravity", find_shipped_cell(), name, *more, "-o", "no.json")
        assert done.returncode == 2 and "Traceback" not in done.stderr and not (tmp_path / "no.json").exists()
        return " ".join(done.stderr.split())

    assert "missing: tau1, tau2, … or i1, i2, … (torques or currents of the joints; see --columns)" in refused(
        "names.csv", text.replace("tau", "load")
    )
    assert "no joint moves slowly" in refused("fast.csv", text, "--max-speed", "0.006")
    assert "max_speed" in refused("speed.csv", text, "--max-speed", "0.001")
    lines = text.splitlines()
    degrees = [lines[0], *(",".join(str(57.3 * float(v)) for v in line.split(",")) for line in lines[1:])]
    assert "are they in degrees? (--angle-unit deg)" in refused(
        "degrees.csv", "\n".join(degrees) + "\n", "--angle-unit", "rad"
    )
    swapped = [lines[0], *lines[1:10], lines[20], *lines[10:]]
    assert "t: expected increasing times" in refused("order.csv", "\n".join(swapped) + "\n")
    stuck = [line.split(",") for line in lines]
    for row in stuck[200:320]:
        row[8] = stuck[200][8]
    assert "tau2: does not change although the arm moves from 39.8" in refused(
        "stuck.csv", "\n".join(",".join(row) for row in stuck) + "\n"
    )
    assert "short.csv: found 1 row, expected at least three" in refused("short.csv", "\n".join(lines[:2]) + "\n")
    timeless = [line.split(",", 1)[1] for line in lines[:3]]
    assert "postures.csv: found 2 rows, expected at least three" in refused("postures.csv", "\n".join(timeless) + "\n")
    assert refused("empty.csv", "")
    assert refused("nan.csv", text.replace(lines[5].split(",")[9], "nan"))


def test_excitation_keeps_its_limits_and_writes_its_files(run_kr5, tmp_path, believed):
    done = run_kr5(
        "identify", "excitation", find_shipped_cell(), *FEW, "--lowest", "0.1", "--csv", "motion.csv",
        "--krl", "Excite", "-o", "e.json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    data = load(tmp_path, "e.json")
    result = data["result"]
    assert result["base_parameters"] == 52 and "not limited" in done.stderr
    names = (tmp_path / "motion.csv").read_text().splitlines()[0].split(",")
    table = np.loadtxt(tmp_path / "motion.csv", delimiter=",", skiprows=1)
    columns = {name: table[:, k] for k, name in enumerate(names)}
    for j in range(6):
        assert columns[f"q{j + 1}"].min() >= believed.robot.limits.lower[j]
        assert columns[f"q{j + 1}"].max() <= believed.robot.limits.upper[j]
        assert np.abs(columns[f"qd{j + 1}"]).max() <= believed.robot.limits.velocity[j]
    assert np.diff(columns["t"])[0] == pytest.approx(believed.servo.cycle)
    motion = identification.JointMotion(
        t=columns["t"],
        **{key: np.column_stack([columns[f"{key}{j + 1}"] for j in range(6)]) for key in ("q", "qd", "qdd", "tau")},
    )
    assert np.allclose(identification.nominal_torques(believed, motion), motion.tau, rtol=1e-4, atol=1e-2)
    source, points = (tmp_path / f"Excite.{end}" for end in ("src", "dat"))
    assert "Run it in T1 first" in source.read_text() and source.read_text().startswith("DEF Excite( )")
    rows = re.findall(r"XP\d+=\{([^}]*)\}", points.read_text())
    first = [float(part.split()[1]) for part in rows[0].split(",")]
    assert first == pytest.approx(np.degrees([columns[f"q{j + 1}"][0] for j in range(6)]), abs=1e-3)
    assert source.read_text().count("SPTP XP") == len(rows) - 1
    assert run_kr5("report", "e.json", "-o", "page.html", "--png", "plots").returncode == 0
    assert {f.stem for f in (tmp_path / "plots").iterdir()} == {"motion", "limit_use", "condition_history"}


def test_strokes_of_an_arm_with_a_slide_become_krl(run_kr5, tmp_path, share):
    done = run_kr5(
        "identify", "excitation", share / "cells/gantry_rrp.yaml", *FEW, "--kind", "point_to_point", "--krl", "Go",
        "--json", "-",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)["result"]
    points = (tmp_path / "Go.dat").read_text()
    last = [float(part.split()[1]) for part in re.findall(r"XP1=\{([^}]*)\}", points)[0].split(",")]
    want = np.array(result["motion"]["points"][0]) * [1e3 if u == "m" else 180 / np.pi for u in result["units"]]
    assert last == pytest.approx(want, abs=1e-3)
    overrides = [int(v) for v in re.findall(r"#VEL_PTP, (\d+)", (tmp_path / "Go.src").read_text())]
    assert len(overrides) == len(result["motion"]["points"]) and all(1 <= v <= 90 for v in overrides)


def test_a_motion_below_the_base_is_doubtful_unless_the_floor_is_known(run_kr5, tmp_path):
    (tmp_path / "zones.yaml").write_text("keep_out:\n- {name: ground, kind: floor, T_B_O: [0, 0, -0.5, 0, 0, 0]}\n")
    verdicts = []
    for more in ((), ("--lowest", "-0.6"), ("--keep-out", "zones.yaml")):
        quick = ("--starts", "2", "--exchanges", "2", "--seed", "4")  # of which the free motion goes far down
        done = run_kr5("identify", "excitation", find_shipped_cell(), *quick, *more, "-o", "e.json")
        assert done.returncode == 0, done.stderr
        data = load(tmp_path, "e.json")
        assert more or data["result"]["lowest"] < 0
        verdicts.append(data["verdict"])
    free, *known = verdicts
    assert free["word"] == "doubtful" and "mm below the base: --lowest 0 keeps" in free["text"]
    assert all("below the base" not in verdict["text"] for verdict in known)


def test_an_excitation_keeps_clear_of_a_table_and_of_the_objects_of_the_cell(run_kr5, tmp_path, believed):
    (tmp_path / "zones.yaml").write_text(
        "keep_out:\n- {name: table, kind: box, T_B_O: [0.9, 0, 0.1, 0, 0, 0], size: [0.6, 1.2, 0.2]}\n"
        "- {name: ground, kind: floor}\n"
    )
    done = run_kr5(
        "identify", "excitation", find_shipped_cell(), *FEW, "--keep-out", "zones.yaml", "--link-radii", "0.12,0.08",
        "--margin", "0.03", "-o", "clear.json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    data = load(tmp_path, "clear.json")
    zones = data["input"]["options"]["keep_out"]
    assert {zone["name"] for zone in zones} == {"tube", "board", "sphere", "table", "ground"}
    assert data["result"]["clearance"] >= 0.03 and " to " in data["result"]["nearest"]
    assert any(row["name"].startswith("minimum clearance") for row in data["figures"])
    # The flange and the tool tip, a capsule of 0.08 m, at every sample shown.
    chain, tip = believed.nominal_chain(), np.asarray(believed.tool.T_flange_tool)
    table = next(identification.KeepOut(**zone) for zone in zones if zone["name"] == "table")
    for q in data["result"]["q"]:
        flange = np.asarray(chain.flange(np.array(q)))
        assert table.distance(flange[:3, 3], (flange @ tip)[:3, 3]) >= 0.08 + 0.03
        assert min(flange[2, 3], (flange @ tip)[2, 3]) >= 0.08 + 0.03


def test_an_excitation_that_cannot_be_is_refused(run_kr5, tmp_path):
    def refused(*args, arm=None):
        done = run_kr5("identify", "excitation", arm or find_shipped_cell(), *FEW, *args, "-o", "no.json")
        assert done.returncode == 2 and "Traceback" not in done.stderr and not (tmp_path / "no.json").exists()
        return " ".join(done.stderr.split())

    assert "start: joint 2 at 9" in refused("--start", "0,9,-2,0,0,0")
    assert "--start" in refused("--start", "0,nan,0,0,0,0")
    assert "expected 6 finite numbers" in refused("--torque", "1,2")
    assert "the torque of joint" in refused("--torque", "1,1,1,1,1,1")
    assert "harmonics must be at least 2" in refused("--harmonics", "1")
    assert "guarded point below" in refused("--lowest", "9")
    assert "expected a name of KRL" in refused("--krl", "1-motion")
    assert "--interval" in refused("--interval", "0")
    assert "--link-radii: found 8 numbers, expected at most 7" in refused("--link-radii", "1,1,1,1,1,1,1,1")
    assert "link_radii must have" in refused("--link-radii", "-0.1")
    assert "absent.yaml" in refused("--keep-out", "absent.yaml")
    lamp = "{name: lamp, kind: ball, T_B_O: [0.18, 0, 1.05, 0, 0, 0], radius: 0.1}"  # at the elbow
    (tmp_path / "zones.yaml").write_text(f"keep_out: [{lamp}]")
    assert "to lamp is -0." in refused("--keep-out", "zones.yaml", "--start", "0,0,-1.8,0,0,0")
    (tmp_path / "zones.yaml").write_text("keep_out: [{name: table, kind: box, size: [1, 1]}]")
    assert "zones.yaml:1: keep_out[0].size" in refused("--keep-out", "zones.yaml")
    (tmp_path / "bare.yaml").write_text("format: kr5-cell/1\nrobot:\n  dh:\n  - {a: 0.7}\n")
    assert "robot.limits: the cell states none" in refused(arm="bare.yaml")


def gravity_result(folder):
    slow_log(cell.load_cell(find_shipped_cell()), folder / "slow.csv")
    return "identify", "gravity", find_shipped_cell(), "slow.csv", "--max-speed", "1", "-o", "r.json"


RESULTS = {
    "kr5-gravity/1": gravity_result,
    "kr5-excitation/1": lambda _: ("identify", "excitation", find_shipped_cell(), *FEW, "-o", "r.json"),
}
