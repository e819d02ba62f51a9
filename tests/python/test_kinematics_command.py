"""`kr5 calibrate kinematics`, `kr5 identify axes` and what Python has of them."""

import json
import re
import shutil

import kr5
import numpy as np
import pytest
from kr5 import calibration, cell, kinematics
from kr5.files.paths import find_shipped_cell


@pytest.fixture(scope="module")
def arm():
    """The nominal arm and a true one that is off by millimetres."""
    believed = cell.load_cell(find_shipped_cell())
    random = np.random.default_rng(4)
    true = believed.nominal_chain()
    joints = [
        kinematics.DhJoint(
            b=j.b + random.normal(0, 1e-3),
            theta_offset=j.theta_offset + random.normal(0, 2e-3),
            a=j.a + random.normal(0, 1e-3),
            alpha=j.alpha + random.normal(0, 2e-3),
        )
        for j in true.joints
    ]
    return believed, kinematics.DhChain(joints, true.T_base_0)


def measured(true, count, seed, noise=5e-5):
    random = np.random.default_rng(seed)
    q = random.uniform(-1.2, 1.2, (count, 6))
    base = kr5.to_pose([1.0, -0.5, 0.3, 0.2, -0.1, 0.7])
    places = np.array([(base @ true.flange(row) @ [0.1, -0.05, 0.15, 1])[:3] for row in q])
    return q, places + random.normal(0, noise, places.shape)


def write(file, q, places, angle=1.0, length=1.0, names="q{}"):
    header = [names.format(k + 1) for k in range(q.shape[1])] + ["x", "y", "z"]
    rows = np.hstack([angle * q, length * places])
    file.write_text(",".join(header) + "\n" + "\n".join(",".join(map(repr, map(float, row))) for row in rows) + "\n")


@pytest.fixture
def folder(tmp_path, arm):
    believed, true = arm
    cell.save_cell(believed, tmp_path / "cell.yaml")
    write(tmp_path / "postures.csv", *measured(true, 60, 1))
    write(tmp_path / "further.csv", *measured(true, 20, 2))
    return tmp_path


def test_postures_give_the_arm_judged_on_further_postures_and_written_into_a_cell(folder, run_kr5):
    done = run_kr5(
        *("calibrate", "kinematics", "postures.csv", "--cell", "cell.yaml", "--check", "further.csv"),
        *("-o", "kinematics.json", "--write-cell", "identified.yaml", "--png", "plots"),
    )
    assert done.returncode == 0, done.stderr
    data = json.loads((folder / "kinematics.json").read_text())
    assert data["format"] == "kr5-kinematics/1" and data["verdict"]["word"] == "good"
    assert data["held_out"]["mean_mm"] < 0.2 < 1 < data["held_out"]["nominal_mean_mm"]
    assert data["result"]["sigma_position"] == pytest.approx(5e-5, rel=0.3)
    assert data["result"]["unidentifiable"] and "Not determined" in done.stdout
    identified = cell.load_cell(folder / "identified.yaml").nominal_chain()
    assert identified.joints[1].a == pytest.approx(data["result"]["arm"]["joints"][1]["a"], abs=1e-12)
    assert run_kr5("report", "kinematics.json", "-o", "page.html").returncode == 0
    page = (folder / "page.html").read_text()
    assert "Kinematic calibration" in page
    assert (folder / "plots/parameter_changes.png").read_bytes()[:4] == b"\x89PNG"
    coordinates = data["result"]["coordinates"]
    changed = [c["name"] for c in coordinates if abs(c["value"] - c["nominal"]) > 3 * c["std"]]
    alike = [c["name"] for c in coordinates if c["name"] not in changed]
    count = sum(name.startswith("arm.") for name in changed)
    assert alike and data["verdict"]["text"].startswith(f"{count} parameters differ from the cell, of ")
    for text in (done.stdout, page):
        assert f"{len(alike)} parameters are within 3 standard deviations" in text
        assert all(name.removeprefix("arm.") in text for name in changed if name.startswith("arm."))
    assert f">{alike[0].removeprefix('arm.')}, change<" not in page
    assert "False" not in page


def test_an_arm_that_is_as_its_cell_says_is_told_so_without_rows_of_nothing(tmp_path, arm, run_kr5):
    believed, _ = arm
    cell.save_cell(believed, tmp_path / "cell.yaml")
    write(tmp_path / "postures.csv", *measured(believed.nominal_chain(), 60, 1))
    write(tmp_path / "further.csv", *measured(believed.nominal_chain(), 20, 2))
    words = ("calibrate", "kinematics", "postures.csv", "--cell", "cell.yaml", "--check", "further.csv")
    done = run_kr5(*words, "-o", "arm.json")
    assert done.returncode == 0, done.stderr
    assert "Good: The arm is as its cell says" in done.stdout
    assert not re.search(
        r"^ joint\d", done.stdout, re.MULTILINE
    )  # base and reflector, which no cell states, are listed
    assert run_kr5("report", "arm.json", "-o", "page.html").returncode == 0
    page = (tmp_path / "page.html").read_text()
    assert "The arm is as its cell says" in page and "not listed" in page
    assert not re.search(r">joint\d[^<]*, change<", page)
    assert "device and measured point were placed on them" in page


def test_units_and_names_of_columns_are_options_and_wrong_ones_are_told(folder, arm, run_kr5):
    q, places = measured(arm[1], 60, 1)
    write(folder / "other.csv", q, places, 180 / np.pi, 1e3, "joint_{}")
    common = ("calibrate", "kinematics", "other.csv", "--cell", "cell.yaml")
    done = run_kr5(*common, "--joints", "joint_{}", "--length-unit", "mm", "--angle-unit", "deg", "--json", "out.json")
    assert done.returncode == 0, done.stderr
    assert json.loads((folder / "out.json").read_text())["result"]["sigma_position"] < 1e-4
    done = run_kr5(*common, "--joints", "joint_{}", "--angle-unit", "rad")
    assert done.returncode == 2 and "are they in degrees? (--angle-unit deg)" in done.stderr
    done = run_kr5(*common, "--joints", "joint_{}", "--json", "found.json")
    assert done.returncode == 0, done.stderr
    stated, found = (json.loads((folder / name).read_text())["figures"] for name in ("out.json", "found.json"))
    assert stated == found
    done = run_kr5(*common, "--json", "found.json")
    assert done.returncode == 0 and "joint_1 to joint_6 is read in deg" in done.stderr
    assert json.loads((folder / "found.json").read_text())["figures"] == stated
    done = run_kr5(*common, "--joints", "axis_{}")
    assert done.returncode == 2 and "axis_1" in done.stderr
    done = run_kr5("calibrate", "kinematics", "other.csv")
    assert done.returncode == 2 and "--cell" in done.stderr


IN_SOCKETS = (
    *("calibrate", "kinematics", "--cell", "cell.yaml", "--socket", "left=left.csv", "--socket", "right=right.csv"),
    *("--distance", "left,right,0.05"),
)


def touch_sockets(folder, believed, wrong=()):
    """Joint values with a ball in two sockets, beside the cell; those at the rows `wrong` of each file stand up to two
    degrees beside the socket. Gives the true arm.
    """
    cell.save_cell(believed, folder / "cell.yaml")
    random = np.random.default_rng(8)
    joints = believed.nominal_chain().joints
    for k, joint in enumerate(joints):
        joint.theta_offset += 0.0 if k == 0 else random.normal(0, 2e-3)
    true = kinematics.DhChain(joints, believed.nominal_chain().T_base_0)
    tip = np.array([0.05, 0.02, 0.2])
    for name, socket in (("left", [0.7, 0.1, 0.5]), ("right", [0.75, 0.1, 0.5])):
        rows = []
        while len(rows) < 40:
            T = kr5.to_pose([0, 0, 0, *random.normal(0, 0.5, 3)]) @ np.diag([1.0, -1.0, -1.0, 1.0])
            T[:3, 3] = socket - T[:3, :3] @ tip
            reached = kinematics.inverse_kinematics(true, T).postures
            if reached and reached[0].position_error < 1e-9:
                rows.append(reached[0].q + random.normal(0, 2e-5, 6))
        for k in wrong:
            rows[k] = rows[k] + random.choice([-1, 1], 6) * random.uniform(0.01, 0.04, 6)
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",")
    return true


def test_a_fifth_of_the_postures_beside_their_socket_is_named_by_line(tmp_path, arm, run_kr5):
    wrong = range(0, 40, 5)
    touch_sockets(tmp_path, arm[0], wrong)
    done = run_kr5(*IN_SOCKETS, "-o", "kinematics.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "kinematics.json").read_text())
    assert data["verdict"]["word"] == "doubtful"
    named = [v["name"] for v in data["views"]]
    assert named == [f"{name}.csv:{k + 1}" for name in ("left", "right") for k in wrong]
    assert np.linalg.norm(np.diff(np.array(data["result"]["sockets"]), axis=1)) == pytest.approx(0.05, abs=5e-5)


def test_a_ball_in_two_sockets_needs_no_device(tmp_path, arm, run_kr5):
    touch_sockets(tmp_path, arm[0])
    done = run_kr5(*IN_SOCKETS, "-o", "kinematics.json")
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "kinematics.json").read_text())["result"]
    spread = [p["position_error"] for p in result["postures"]]
    nominal = [p["nominal_error"] for p in result["postures"]]
    assert np.mean(spread) < 1e-4 < 1e-3 < np.mean(nominal)
    assert np.linalg.norm(np.diff(np.array(result["sockets"]), axis=1)) == pytest.approx(0.05, abs=5e-5)
    done = run_kr5("calibrate", "kinematics", "--cell", "cell.yaml", "--socket", "left.csv")
    assert done.returncode == 2 and "expected NAME=FILE" in done.stderr


def test_a_tracker_that_took_no_part_is_placed_before_it_judges_sockets(tmp_path, arm, run_kr5):
    true = touch_sockets(tmp_path, arm[0])
    q, places = measured(true, 30, 2)
    write(tmp_path / "further.csv", q, places)
    done = run_kr5(*IN_SOCKETS, "--check", "further.csv", "-o", "kinematics.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "kinematics.json").read_text())
    held_out = data["held_out"]
    assert held_out["placed_on_them"] and held_out["mean_mm"] < 0.3 * held_out["nominal_mean_mm"]
    assert held_out["mean_mm"] < 1
    assert "on 30 further postures, on which device and measured point were placed, mean" in data["verdict"]["text"]
    write(tmp_path / "few.csv", q[:5], places[:5])
    done = run_kr5(*IN_SOCKETS, "--check", "few.csv")
    assert done.returncode == 2 and "--check: found 5 postures, expected at least 6" in done.stderr


def test_the_nominal_arm_is_judged_with_the_same_knowledge(tmp_path, arm, run_kr5):
    """A wrong zero of joint 1 looks like a turned device: with a known base it is an error of the arm."""
    believed, _ = arm
    cell.save_cell(believed, tmp_path / "cell.yaml")
    joints = believed.nominal_chain().joints
    joints[0].theta_offset += 5e-3
    true = kinematics.DhChain(joints, believed.nominal_chain().T_base_0)
    random = np.random.default_rng(9)
    q = random.uniform(-1.2, 1.2, (60, 6))
    places = np.array([(true.flange(row) @ [0.1, -0.05, 0.15, 1])[:3] for row in q]) + random.normal(0, 5e-5, (60, 3))
    write(tmp_path / "postures.csv", q[:40], places[:40])
    write(tmp_path / "further.csv", q[40:], places[40:])
    nominal = {}
    for options in ((), ("--known-base",)):
        done = run_kr5(
            *("calibrate", "kinematics", "postures.csv", "--cell", "cell.yaml", "--check", "further.csv"),
            *("--sigma-position", "5e-5", "--json", "out.json", *options),
        )
        assert done.returncode == 0, done.stderr
        held_out = json.loads((tmp_path / "out.json").read_text())["held_out"]
        assert held_out["mean_mm"] < 0.15 and not held_out["placed_on_them"]
        nominal[options] = held_out["nominal_mean_mm"]
    assert nominal[()] < 0.15
    T = np.array([believed.nominal_chain().flange(row) for row in q])
    back = np.einsum("nji,nj->ni", T[:, :3, :3], places - T[:, :3, 3])  # the point in the flange, by each posture
    assert nominal["--known-base",] == pytest.approx(
        1e3 * np.linalg.norm(back[40:] - back[:40].mean(axis=0), axis=1).mean(), rel=1e-3
    )


def test_a_joint_that_did_not_move_is_named(folder, arm, run_kr5):
    q, _ = measured(arm[1], 60, 1)
    q[:, 4] = 0.3
    base = kr5.to_pose([1.0, -0.5, 0.3, 0.2, -0.1, 0.7])
    random = np.random.default_rng(6)
    places = [(base @ arm[1].flange(row) @ [0.1, -0.05, 0.15, 1])[:3] + random.normal(0, 5e-5, 3) for row in q]
    write(folder / "still.csv", q, np.array(places))
    done = run_kr5("calibrate", "kinematics", "still.csv", "--cell", "cell.yaml", "-o", "out.json")
    assert done.returncode == 0, done.stderr
    verdict = json.loads((folder / "out.json").read_text())["verdict"]
    assert verdict["word"] == "doubtful" and "joint 5 did not move" in verdict["text"]


def test_outliers_are_named_with_their_line(folder, run_kr5):
    lines = (folder / "postures.csv").read_text().splitlines()
    wrong = lines[7].split(",")
    wrong[-1] = repr(float(wrong[-1]) + 0.02)
    lines[7] = ",".join(wrong)
    (folder / "postures.csv").write_text("\n".join(lines) + "\n")
    done = run_kr5("calibrate", "kinematics", "postures.csv", "--cell", "cell.yaml", "-o", "kinematics.json")
    assert done.returncode == 0
    verdict = json.loads((folder / "kinematics.json").read_text())["verdict"]
    assert verdict["word"] == "doubtful" and "postures.csv:8" in verdict["text"]


def test_axes_and_chains_from_python(arm):
    _, true = arm
    q = np.array([0.1, -0.4, 0.5, 0.2, 0.7, -0.3])
    found = kinematics.chain_from_axes(kinematics.axes_of(true, q), q, true.flange(q))
    rest = np.linalg.inv(found.flange(q)) @ true.flange(q)
    other = np.array([-0.5, 0.3, 0.2, 1.0, -0.6, 0.8])
    assert np.allclose(found.flange(other) @ rest, true.flange(other), atol=1e-9)
    J = kinematics.parameter_jacobian(true, q)
    assert J.shape == (6, 30)
    samples = [
        calibration.JointSample(points=(true.flange([v, *q[1:]]) @ [0.1, 0, 0.1, 1])[:3, None], q=v)
        for v in np.linspace(-0.4, 0.4, 12)
    ]
    axis = calibration.identify_joint_axis(samples)
    assert abs(axis.axis.direction @ kinematics.axes_of(true, q)[0].direction - 1) < 1e-9
    chosen = calibration.choose_postures(
        true, list(np.random.default_rng(1).normal(size=(40, 6))), calibration.PostureChoiceOptions(count=12)
    )
    assert len(set(chosen.chosen)) == 12


HOME = np.array([0.1, -0.5, 0.6, 0.3, 0.7, 0.2])


def turns(chain, arc=0.5, noise=1e-5, count=20):
    """One joint after the other turns about HOME, under a tracker."""
    random = np.random.default_rng(5)
    q = np.repeat(HOME[None], 6 * count, axis=0)
    for k in range(6):
        q[k * count : (k + 1) * count, k] += np.linspace(-arc / 2, arc / 2, count)
    base = kr5.to_pose([2.0, 1.0, 0.5, 0.3, 0.2, -1.0])
    places = np.array([(base @ chain.flange(row) @ [0.15, 0.05, 0.2, 1])[:3] for row in q])
    return q, places + random.normal(0, noise, places.shape)


def test_joints_moved_one_at_a_time_give_axes_and_parameters(tmp_path, arm, run_kr5):
    chain = arm[0].nominal_chain()
    write(tmp_path / "turns.csv", *turns(chain))
    done = run_kr5("identify", "axes", "turns.csv", "-o", "axes.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "axes.json").read_text())
    assert data["format"] == "kr5-axes/1" and data["verdict"]["word"] == "good"
    figures = {f["name"]: f for f in data["figures"]}
    for k in range(5):
        for name, scale in (("a", 1e3), ("alpha", 180 / np.pi)):
            figure, truth = figures[f"joint{k + 1}.{name}"], scale * getattr(chain.joints[k], name)
            assert abs(abs(figure["value"]) - abs(truth)) < max(4 * figure["std"], 1e-3), figure
            assert figure["std"] < 1.0
    result = data["result"]
    count = len(result["parameters"])
    assert count == len(figures) and np.shape(result["covariance"]) == (count, count)
    for one, variance in zip(result["parameters"], np.diag(result["covariance"]), strict=True):
        name = {"theta": "theta_offset"}.get(one["parameter"], one["parameter"])
        scale = 1e3 if name in ("a", "b") else 180 / np.pi
        figure = figures[f"joint{one['joint'] + 1}.{name}"]
        assert scale * one["value"] == pytest.approx(figure["value"], rel=1e-3, abs=1e-3)
        # each with the degrees of freedom of its own axes, the covariance with those of all
        assert 0 < one["std"] <= 1.2 * np.sqrt(variance)
    assert result["findings"]["home_jumps"] == [] and len(result["axes"]) == 6 and len(result["arm"]["joints"]) == 6
    assert run_kr5("report", "axes.json", "-o", "page.html").returncode == 0


def test_turns_that_tell_no_axis_are_refused_in_words(tmp_path, arm, run_kr5):
    q, places = turns(arm[0].nominal_chain())
    both = q.copy()
    both[3, 1] += 0.2
    write(tmp_path / "two.csv", both, places)
    done = run_kr5("identify", "axes", "two.csv")
    assert done.returncode == 2 and "line 5: q1, q2" in done.stderr and "one joint at a time" in done.stderr
    still = q.copy()
    still[:, 5] = HOME[5]
    write(tmp_path / "still.csv", still, places)
    done = run_kr5("identify", "axes", "still.csv")
    assert done.returncode == 2 and "joint 6 did not move" in done.stderr
    write(tmp_path / "short.csv", *turns(arm[0].nominal_chain(), arc=0.01, noise=1e-3))
    done = run_kr5("identify", "axes", "short.csv")
    assert done.returncode == 2 and "joint 1 (line 2 to line" in done.stderr


def test_postures_are_chosen_within_limits_and_measure_more_than_others(tmp_path, arm, run_kr5):
    believed, _ = arm
    cell.save_cell(believed, tmp_path / "cell.yaml")
    done = run_kr5(
        *("calibrate", "postures", "--cell", "cell.yaml", "--count", "15", "--draw", "300", "--angle-unit", "deg"),
        *("--criterion", "determinant"),
        *("-o", "postures.csv", "--json", "postures.json"),
    )
    assert done.returncode == 0, done.stderr
    q = np.radians(np.loadtxt(tmp_path / "postures.csv", delimiter=",", skiprows=1))
    result = json.loads((tmp_path / "postures.json").read_text())["result"]
    assert q.shape == (15, 6) and np.abs(q - result["q"]).max() < 1e-6
    limits = believed.robot.limits
    assert (q >= limits.lower).all() and (q <= limits.upper).all()
    chain = believed.nominal_chain()
    assert min(chain.flange(row)[2, 3] for row in q) >= 0.1
    others = np.array(result["candidates"])[:15]
    options = calibration.PostureChoiceOptions(
        count=15, criterion="determinant", point=believed.tool.T_flange_tool[:3, 3], exchanges=1
    )
    alone = calibration.choose_postures(chain, list(others), options)  # there is nothing to choose
    assert result["value"] > alone.value  # of the information
    assert run_kr5("report", "postures.json", "-o", "page.html", "--png", "plots").returncode == 0
    assert {"posture_value.png", "posture_spread.png"} <= {f.name for f in (tmp_path / "plots").iterdir()}


def test_chosen_postures_see_the_board(tmp_path, arm, run_kr5):
    believed, _ = arm
    cell.save_cell(believed, tmp_path / "cell.yaml")
    done = run_kr5(
        *("calibrate", "postures", "--cell", "cell.yaml", "--count", "12", "--draw", "60", "--see-board"),
        *("--measures-pose", "-o", "postures.csv"),
    )
    assert done.returncode == 0, done.stderr
    camera, T_flange_camera = believed.camera.pinhole(), believed.T_flange_camera()
    points = np.array(kr5.target_points(believed.board.target())[0])
    for q in np.loadtxt(tmp_path / "postures.csv", delimiter=",", skiprows=1):
        T = np.linalg.inv(believed.nominal_chain().flange(q) @ T_flange_camera) @ believed.board.T_base_target
        pixels = camera.project(T[:3, :3] @ points + T[:3, 3:])
        assert ((pixels > -1) & (pixels < [[camera.width], [camera.height]])).all()


def test_postures_that_cannot_be_chosen_are_refused_in_words(folder, arm, run_kr5):
    done = run_kr5("calibrate", "postures", "--cell", "cell.yaml", "--candidates", "postures.csv", "--count", "61")
    assert done.returncode == 2 and "60 candidates" in " ".join(done.stderr.split())
    believed = cell.load_cell(folder / "cell.yaml")
    believed.board = None
    cell.save_cell(believed, folder / "blind.yaml")
    done = run_kr5("calibrate", "postures", "--cell", "blind.yaml", "--see-board")
    assert done.returncode == 2 and "the cell has no board" in done.stderr


# Case of the shared set, the effect, its parameters in the result with the true values, and a value of the cell.
GEOMETRIC_CASES = [
    ("case-000", "encoder_offset", {"arm.joint6.theta_offset": 0.0025456440416700807}),
    ("case-011", "link_length", {"arm.joint4.b": 0.6216475153213981 - 0.62}),
    (
        "case-007",
        "tool_offset",
        {"tool.x": 0.001499173276008533, "tool.y": -0.0004132797505737894, "tool.z": 0.00038096921571394984},
    ),
]
GEOMETRY = {"encoder_offset", "link_length", "link_twist", "tool_offset", "hand_eye", "transmission_error", "base_tilt"}


@pytest.mark.parametrize(("case", "effect", "true"), GEOMETRIC_CASES)
def test_calibration_and_diagnosis_agree_and_the_refined_cell_leaves_no_geometric_cause(
    tmp_path, reference, run_kr5, case, effect, true
):
    recording = reference / "cases" / case
    done = run_kr5("calibrate", "kinematics", recording, "-o", "kinematics.json", "--write-cell", "refined.yaml")
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "kinematics.json").read_text())["result"]
    found = {c["name"]: c for c in result["coordinates"]}
    size = np.linalg.norm(list(true.values()))
    for name, value in true.items():
        change = found[name]["value"] - found[name]["nominal"]
        assert abs(change - value) < 2 * found[name]["std"], (name, change, found[name]["std"])
        assert found[name]["std"] < 0.02 * size
    # The diagnosis blames the same effect with the same size.
    assert run_kr5("gap", "diagnose", recording, "--json", "before.json").returncode == 0
    causes = {c["effect"]: c for c in json.loads((tmp_path / "before.json").read_text())["causes"]}
    (parameter,) = causes[effect]["parameters"].values()
    nominal = {"link_length": 0.62}.get(effect, 0.0)
    blamed, spread = np.ravel(parameter["value"]) - nominal, np.ravel(parameter["std"])
    for (name, _), value, std in zip(true.items(), blamed, spread, strict=True):
        change = found[name]["value"] - found[name]["nominal"]
        assert abs(change - value) < 3 * np.hypot(found[name]["std"], std), (name, change, value)
    # With the refined cell in its place the recording has no geometric cause left.
    after = tmp_path / "after"
    shutil.copytree(recording, after)
    shutil.copy(tmp_path / "refined.yaml", after / "cell.yaml")
    assert run_kr5("gap", "diagnose", after, "--json", "after.json").returncode == 0
    # The views tell micrometres: a remainder of the noise may stay, but nothing that is more likely than not.
    causes = json.loads((tmp_path / "after.json").read_text())["causes"]
    assert not {c["effect"] for c in causes if c["probability"] > 0.5} & GEOMETRY, causes


def test_camera_and_board_of_the_cell_are_believed_unless_the_measurements_contradict_them(
    tmp_path, reference, run_kr5
):
    recording = tmp_path / "recording"
    shutil.copytree(reference / "cases/case-006", recording)  # without any effect
    believed = cell.load_cell(recording / "cell.yaml")
    right = np.array(believed.T_flange_camera())
    noise = believed.noise
    given = ("--sigma-position", noise.pose_position, "--sigma-rotation", noise.pose_rotation)
    given += ("--sigma-pixel", noise.pixel)

    def calibrate():
        done = run_kr5("calibrate", "kinematics", recording, *given, "--json", "out.json")
        assert done.returncode == 0, done.stderr
        data = json.loads((tmp_path / "out.json").read_text())
        assert data["camera_check"]["text"] in data["verdict"]["text"]
        assert data["camera_check"]["text"][:60] in " ".join(done.stdout.split())
        return data

    data = calibrate()
    assert data["camera_check"]["believed"] and data["camera_check"]["dof"] == 12
    assert data["camera_check"]["squared_distance"] < data["camera_check"]["limit"]
    assert np.allclose(data["result"]["T_flange_camera"], right, atol=1e-12)
    camera = believed.camera
    camera.T_tool_camera = camera.T_tool_camera @ kr5.to_pose([1e-4, 0, 0, 0, 0, 0])
    believed.camera = camera
    cell.save_cell(believed, recording / "cell.yaml")
    data = calibrate()
    assert not data["camera_check"]["believed"] and "the measurements contradict" in data["verdict"]["text"]
    assert np.linalg.norm(np.array(data["result"]["T_flange_camera"])[:3, 3] - right[:3, 3]) < 2e-5


def test_compliance_of_a_joint_is_found_from_a_recording(tmp_path, reference, run_kr5):
    recording = reference / "cases" / "case-012"  # joint 5 with 2584.37 N m/rad
    done = run_kr5("calibrate", "kinematics", recording, "--elasticity", "-o", "kinematics.json")
    assert done.returncode == 0, done.stderr
    coordinates = json.loads((tmp_path / "kinematics.json").read_text())["result"]["coordinates"]
    found = {c["name"]: c for c in coordinates if c["name"].endswith(".compliance")}
    assert len(found) == 6
    fifth = found["joint_errors.joint5.compliance"]
    assert fifth["value"] > 5 * fifth["std"]
    assert abs(fifth["value"] - 1 / 2584.3743855358803) < 3 * fifth["std"]


def calibrated(folder, run_kr5, q, places, *arguments):
    """What is said of measurements that are wrong: in the verdict, or in the error where no arm is the better one."""
    write(folder / "bad.csv", q, places)
    done = run_kr5("calibrate", "kinematics", "bad.csv", "--cell", "cell.yaml", *arguments, "-o", "bad.json")
    if done.returncode == 2 and "two places of the arm explain" in done.stderr:
        return " ".join(done.stderr.split())
    assert done.returncode == 0, done.stderr
    verdict = json.loads((folder / "bad.json").read_text())["verdict"]
    assert verdict["word"] == "doubtful", verdict
    return verdict["text"]


def refused(folder, run_kr5, q, places):
    """The error about measurements that do not belong to the joint values beside them; no result is written."""
    write(folder / "bad.csv", q, places)
    done = run_kr5("calibrate", "kinematics", "bad.csv", "--cell", "cell.yaml", "-o", "refused.json")
    text = " ".join(done.stderr.split())
    assert done.returncode == 2 and "put each measurement beside the joint values" in text, (done.returncode, text)
    assert not (folder / "refused.json").exists()
    return text


def test_measurements_wrong_as_a_whole_are_told_in_words(folder, arm, run_kr5):
    q, places = measured(arm[1], 60, 1)
    write(folder / "mm.csv", q, 1e3 * places)
    common = ("calibrate", "kinematics", "mm.csv", "--cell", "cell.yaml")
    done = run_kr5(*common, "-o", "mm.json")
    assert done.returncode == 0 and "is read in mm" in done.stderr, done.stderr
    assert json.loads((folder / "mm.json").read_text())["verdict"]["word"] == "good"
    done = run_kr5(*common, "--length-unit", "m")
    assert done.returncode == 2 and "are they in millimetres? (--length-unit mm)" in " ".join(done.stderr.split())
    assert "1.02 times as far apart" in calibrated(folder, run_kr5, q, 1.02 * places)
    assert "mirrored" in calibrated(folder, run_kr5, q, places * [1, -1, 1])
    text = refused(folder, run_kr5, q[1:], places[:-1])
    assert "one row before, from bad.csv:2 to bad.csv:60" in text and "shifted" in text
    assert "one row after" in refused(folder, run_kr5, q[:-1], places[1:])


def test_a_table_of_postures_may_be_in_any_order(folder, arm, run_kr5):
    q, places = measured(arm[1], 60, 1)
    order = np.random.default_rng(2).permutation(60)
    write(folder / "shuffled.csv", q[order], places[order])
    figures = []
    for file in ("postures.csv", "shuffled.csv"):
        done = run_kr5("calibrate", "kinematics", file, "--cell", "cell.yaml", "--json", "out.json")
        assert done.returncode == 0, done.stderr
        figures.append({f["name"]: f for f in json.loads((folder / "out.json").read_text())["figures"]})
    assert figures[0].keys() == figures[1].keys()
    for name, figure in figures[0].items():
        assert figures[1][name]["value"] == pytest.approx(figure["value"], abs=1e-3 * figure["std"]), name


def test_measurements_beside_the_joint_values_of_another_row_are_refused_with_their_rows(folder, arm, run_kr5):
    q, places = measured(arm[1], 60, 1)
    order = np.random.default_rng(2).permutation(60)  # place k is that of posture order[k]
    text = refused(folder, run_kr5, q, places[order])
    wrong = np.flatnonzero(order != np.arange(60))
    assert f"{len(wrong)} measurements stand beside the joint values of another row" in text
    assert f"that of bad.csv:{wrong[0] + 2} belongs to bad.csv:{order[wrong[0]] + 2}" in text
    by_text = sorted(range(60), key=lambda k: str(k + 1))  # 1, 10, 11, …, 2
    assert "that of bad.csv:3 belongs to bad.csv:11" in refused(folder, run_kr5, q, places[by_text])
    further, there = measured(arm[1], 20, 2)
    write(folder / "check.csv", further, there[::-1])
    done = run_kr5("calibrate", "kinematics", "postures.csv", "--cell", "cell.yaml", "--check", "check.csv")
    assert done.returncode == 2 and "that of check.csv:2 belongs to check.csv:21" in " ".join(done.stderr.split())


def test_measurements_of_something_else_are_told(folder, arm, run_kr5):
    q, places = measured(arm[1], 60, 1)
    elsewhere = np.random.default_rng(3).uniform(-1, 1, places.shape)
    assert "do not belong to these joint values" in calibrated(folder, run_kr5, q, elsewhere)


def test_a_device_that_moved_midway_is_told_with_the_row(folder, arm, run_kr5):
    q, places = measured(arm[1], 60, 1)
    places[33:] += [0.002, -0.001, 0.0]
    text = calibrated(folder, run_kr5, q, places)
    assert "from bad.csv:35 on the measured places are" in text and "did the device or the base move?" in text


def test_a_fifth_of_the_postures_gone_wrong_is_named_by_line(folder, arm, run_kr5):
    q, places = measured(arm[1], 60, 1)
    random = np.random.default_rng(3)
    wrong = random.choice(60, 12, replace=False)
    places[wrong] += random.choice([-1, 1], (12, 3)) * random.uniform(0.005, 0.05, (12, 3))
    text = calibrated(folder, run_kr5, q, places)
    named = text[text.index("contradict the others: ") :].split(";")[0]
    assert {f"bad.csv:{row + 2}" for row in wrong} <= set(named.removeprefix("contradict the others: ").split(", "))


def test_postures_that_excite_little_or_nothing_are_told(folder, arm, run_kr5):
    q, _ = measured(arm[1], 60, 1)
    base = kr5.to_pose([1.0, -0.5, 0.3, 0.2, -0.1, 0.7])
    random = np.random.default_rng(6)
    q[:, 3:] = 0.03 * random.uniform(-1, 1, (60, 3)) * [1, 0, 0] + [0.1, 0.2, 0.3]
    places = np.array([(base @ arm[1].flange(row) @ [0.1, -0.05, 0.15, 1])[:3] for row in q])
    text = calibrated(folder, run_kr5, q, places + random.normal(0, 5e-5, places.shape))
    assert "joint 5 did not move" in text and "joint 6 did not move" in text
    assert "joint 4 moved by 3." in text
    write(folder / "still.csv", np.repeat(q[:1], 20, axis=0), np.repeat(places[:1], 20, axis=0))
    done = run_kr5("calibrate", "kinematics", "still.csv", "--cell", "cell.yaml")
    assert done.returncode == 2 and "no joint moved" in done.stderr


def kinematics_result(folder):
    write(folder / "postures.csv", *measured(cell.load_cell(find_shipped_cell()).nominal_chain(), 40, 1))
    return "calibrate", "kinematics", "postures.csv", "--cell", find_shipped_cell(), "-o", "r.json"


def axes_result(folder):
    write(folder / "turns.csv", *turns(cell.load_cell(find_shipped_cell()).nominal_chain()))
    return "identify", "axes", "turns.csv", "-o", "r.json"


RESULTS = {"kr5-kinematics/1": kinematics_result, "kr5-axes/1": axes_result}
