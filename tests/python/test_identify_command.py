"""`kr5 identify axes` on images and bad input, lengths by parallel planes, and `kr5 identify study`."""

import json

import kr5
import numpy as np
import pytest
from kr5 import calibration, cell, kinematics, vision
from kr5.files.paths import find_shipped_cell

from test_kinematics_command import turns, write

QUARTER = np.pi / 2


@pytest.fixture(scope="module")
def chain():
    return cell.load_cell(find_shipped_cell()).nominal_chain()


def verdict_of(folder, run_kr5, *arguments):
    done = run_kr5("identify", "axes", *arguments, "-o", "axes.json")
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "axes.json").read_text())["verdict"]


def test_a_fifth_of_the_rows_gone_wrong_is_named_by_line(tmp_path, chain, run_kr5):
    q, places = turns(chain)
    random = np.random.default_rng(1)
    wrong = np.concatenate([20 * k + random.choice(20, 4, replace=False) for k in range(6)])
    places[wrong] += random.choice([-1, 1], (24, 3)) * random.uniform(0.01, 0.04, (24, 3))
    write(tmp_path / "turns.csv", q, places)
    verdict = verdict_of(tmp_path, run_kr5, "turns.csv")
    assert verdict["word"] == "doubtful"
    for row in wrong:
        assert f"line {row + 2}," in verdict["text"] + "," or f"line {row + 2};" in verdict["text"]


def test_a_device_that_moved_is_named_with_the_row(tmp_path, chain, run_kr5):
    q, places = turns(chain)
    between = places.copy()
    between[60:] += [0.003, 0.0, 0.001]
    write(tmp_path / "between.csv", q, between)
    verdict = verdict_of(tmp_path, run_kr5, "between.csv")
    assert verdict["word"] == "doubtful"
    assert "between joint 3 (to line 61) and joint 4 (from line 62)" in verdict["text"]
    within = places.copy()
    within[50:60] += [0.003, 0.0, 0.001]
    write(tmp_path / "within.csv", q, within)
    verdict = verdict_of(tmp_path, run_kr5, "within.csv")
    assert verdict["word"] == "doubtful" and "joint 3 (line 42 to line 61)" in verdict["text"]
    assert "the greatest step is before line 52" in verdict["text"]


def test_mirrored_scaled_and_shifted_measurements_are_told(tmp_path, chain, run_kr5):
    q, places = turns(chain)
    nominal = ("--cell", find_shipped_cell())
    write(tmp_path / "good.csv", q, places)
    assert verdict_of(tmp_path, run_kr5, "good.csv", *nominal)["word"] == "good"
    write(tmp_path / "mirrored.csv", q, places * [-1, 1, 1])
    assert "mirror image" in verdict_of(tmp_path, run_kr5, "mirrored.csv", *nominal)["text"]
    write(tmp_path / "scaled.csv", q, 1.05 * places)
    assert "every length is 1.05 times the cell's" in verdict_of(tmp_path, run_kr5, "scaled.csv", *nominal)["text"]
    write(tmp_path / "mm.csv", q, 1e3 * places)
    assert verdict_of(tmp_path, run_kr5, "mm.csv", *nominal)["word"] == "good"  # too large for metres
    done = run_kr5("identify", "axes", "mm.csv", "--length-unit", "m")
    assert done.returncode == 2 and "are they in millimetres? (--length-unit mm)" in " ".join(done.stderr.split())
    write(tmp_path / "ellipse.csv", q, places * [1.05, 1, 1])
    assert "times its readings" in verdict_of(tmp_path, run_kr5, "ellipse.csv")["text"]
    write(tmp_path / "shifted.csv", q[:-1], places[1:])
    verdict = verdict_of(tmp_path, run_kr5, "shifted.csv")
    assert verdict["word"] == "doubtful" and "shifted by a row" in verdict["text"]


def test_every_row_in_which_two_joints_stand_away_is_listed(tmp_path, chain, run_kr5):
    q, places = turns(chain)
    q[[3, 7, 9], 1] += 0.2
    write(tmp_path / "two.csv", q, places)
    done = run_kr5("identify", "axes", "two.csv")
    assert done.returncode == 2 and "line 5: q1, q2" in done.stderr and "line 9, line 11 likewise" in done.stderr


def test_one_csv_a_joint_names_an_outlier_by_its_own_file(tmp_path, chain, run_kr5):
    _, places = turns(chain)
    places[25] += [0.02, -0.01, 0.01]  # sixth sample of joint 2
    for k in range(6):
        rows = [",".join(map(repr, map(float, row))) for row in places[20 * k : 20 * (k + 1)]]
        (tmp_path / f"J{k + 1}.csv").write_text("x,y,z\n" + "\n".join(rows) + "\n")
    verdict = verdict_of(tmp_path, run_kr5, *(f"J{k + 1}.csv" for k in range(6)))
    assert verdict["word"] == "doubtful"
    assert "joint 2: left out because they contradict the others: J2.csv line 7" in verdict["text"].split("; ")


def test_near_parallel_axes_show_beta_in_place_of_b(tmp_path, chain, run_kr5):
    joints = chain.joints
    joints[1].beta = 0.01  # axes 2 and 3 are parallel but for it
    q, places = turns(kinematics.DhChain(joints, chain.T_base_0))
    write(tmp_path / "turns.csv", q, places)
    assert run_kr5("identify", "axes", "turns.csv", "-o", "axes.json", "--png", "plots").returncode == 0
    assert list((tmp_path / "plots").glob("*.png"))
    figures = {f["name"]: f for f in json.loads((tmp_path / "axes.json").read_text())["figures"]}
    parameters = {k: {n.split(".")[1] for n in figures if n.startswith(f"joint{k}.")} for k in range(1, 6)}
    assert parameters[2] == {"a", "alpha", "beta", "theta_offset"}
    assert parameters[4] == {"a", "alpha", "b", "theta_offset"}
    beta = figures["joint2.beta"]
    assert 0 < beta["std"] < 0.1 and abs(beta["value"] - np.degrees(0.01)) < 4 * beta["std"]


def upright_turns(chain, noise):
    """Turns of the six joints with the forearm across axis 1, and of joint 6 with it along axis 1."""
    across = np.array([0.2, 0.03, 0.03 + np.pi, 0.0, 0.0, 0.3])
    upright = across.copy()
    upright[2] = 0.03 - QUARTER
    home_axes = [kinematics.axes_of(chain, across + k * QUARTER * np.eye(6)[4]) for k in range(4)]
    across[4] = QUARTER * int(np.argmax([abs(a[0].direction @ a[5].direction) for a in home_axes]))
    up_axes = [kinematics.axes_of(chain, upright + k * QUARTER * np.eye(6)[4]) for k in range(4)]
    upright[4] = QUARTER * int(np.argmax([abs(a[0].direction @ a[5].direction) for a in up_axes]))
    random = np.random.default_rng(3)
    base = kr5.to_pose([2.0, 1.0, 0.5, 0.3, 0.2, -1.0])

    def seen(q):
        return (base @ chain.flange(q) @ [0.25, 0.05, 0.2, 1])[:3] + random.normal(0, noise, 3)

    def turn(home, joint):
        return home + np.outer(np.linspace(-0.4, 0.4, 41), np.eye(6)[joint])

    rows = np.vstack([turn(across, k) for k in range(6)])
    last = turn(upright, 5)
    return rows, np.array([seen(q) for q in rows]), np.array([seen(q) for q in last])


def test_lengths_follow_from_distances_of_parallel_axes(tmp_path, chain, run_kr5):
    q, places, last = upright_turns(chain, 1e-5)
    write(tmp_path / "turns.csv", q, places)
    header = "x,y,z\n"
    (tmp_path / "up.csv").write_text(header + "\n".join(",".join(map(repr, map(float, r))) for r in last) + "\n")
    done = run_kr5("identify", "axes", "turns.csv", "--upright", "up.csv", "-o", "axes.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "axes.json").read_text())
    figures = {f["name"]: f for f in data["figures"]}
    for name, value in (("a1", 180.0), ("a2", 600.0), ("a3", 120.0), ("b4", 620.0)):
        figure = figures[f"{name}, by parallel planes"]
        assert figure["std"] < 1.0
        assert abs(figure["value"] - value) < max(4 * figure["std"], 0.01), figure
    assert data["result"]["parallel_planes"]["a1_other"] == pytest.approx(0.68, abs=5e-3)
    # An arm for which the constraints do not hold.
    other = chain.joints
    other[4].b = 0.1
    q, places, last = upright_turns(kinematics.DhChain(other, chain.T_base_0), 1e-5)
    write(tmp_path / "other.csv", q, places)
    done = run_kr5("identify", "axes", "other.csv", "--upright", "up.csv")
    assert done.returncode == 2 and "the axes of the wrist do not meet in one point" in done.stderr


def test_images_of_a_marker_map_give_the_axis(tmp_path, run_kr5):
    """A camera that turns about an axis beside it, before markers that are not in one plane."""
    markers = [
        kr5.MapMarker(
            id=k,
            size=0.08,
            T_target_marker=kr5.to_pose([0.12 * (k % 3), 0.12 * (k // 3), 0.03 * (k % 2), 0, 0.2 * (k % 2), 0]),
        )
        for k in range(6)
    ]
    target = kr5.Target(kind="marker_map", family="36h11", map=markers)
    lens = kr5.Pinhole(width=800, height=600, fx=800, fy=800, cx=399.5, cy=299.5)
    (tmp_path / "camera.json").write_text(json.dumps(lens.to_dict()))
    (tmp_path / "map.json").write_text(json.dumps(kr5_plain(target.to_dict())))
    axis = kr5.to_pose([0.1, 0.3, -0.2, -QUARTER, 0.1, 0.0])  # of the joint, in the map
    camera_on_axis = np.linalg.inv(axis) @ kr5.to_pose([0.12, 0.06, -0.6, 0, 0, 0])
    folder = tmp_path / "joint1"
    folder.mkdir()
    for k, angle in enumerate(np.linspace(-0.15, 0.15, 9)):
        T_target_camera = axis @ kr5.to_pose([0, 0, 0, 0, 0, angle]) @ camera_on_axis
        placed = vision.PlacedTarget(target=target, T_camera_target=np.linalg.inv(T_target_camera))
        image = vision.render([placed], lens, vision.RenderOptions(noise=2, blur=0.6, seed=k))
        vision.save_image(image, str(folder / f"{k:02d}.png"))
    inputs = ("joint1", "--camera", "camera.json", "--target", "map.json")
    done = run_kr5("identify", "axes", *inputs, "-o", "axes.json")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "axes.json").read_text())["result"]["axes"][0]
    direction = np.array(found["axis"]["direction"])
    assert np.degrees(np.arccos(min(1.0, direction @ axis[:3, 2]))) < 0.3
    off = np.array(found["axis"]["point"]) - axis[:3, 3]
    assert np.linalg.norm(off - (off @ axis[:3, 2]) * axis[:3, 2]) < 3e-3
    assert np.degrees(found["arc"]) == pytest.approx(np.degrees(0.3), abs=0.2)
    done = run_kr5("identify", "axes", "joint1", "--target", "map.json")
    assert done.returncode == 2 and "--camera is missing" in done.stderr
    for file in list(folder.iterdir())[3:]:
        file.unlink()
    done = run_kr5("identify", "axes", *inputs)
    assert done.returncode == 2 and "expected at least 4" in done.stderr


def kr5_plain(value):
    """Arrays as lists and enumerations as their names."""
    if isinstance(value, dict):
        return {k: kr5_plain(v) for k, v in value.items()}
    if isinstance(value, list):
        return [kr5_plain(v) for v in value]
    return (
        value.tolist()
        if isinstance(value, np.ndarray)
        else value
        if isinstance(value, (int, float, bool))
        else str(value)
    )


def test_a_noise_study_reaches_what_the_source_did_and_repeats_with_its_seed(tmp_path, run_kr5):
    arguments = ("identify", "study", "--noise", "1", "--trials", "3")
    done = run_kr5(*arguments, "-o", "study.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "study.json").read_text())
    assert data["format"] == "kr5-axes-study/1"
    rows = {(r["device"], r["arc_deg"]): r for r in data["result"]["rows"]}
    tracker, camera = rows["laser_tracker", 20.0], rows["camera", 50.0]
    assert tracker["length_rms_mm"] <= 0.45 and tracker["angle_rms_deg"] <= 0.12
    assert camera["length_rms_mm"] <= 2.4 and camera["angle_rms_deg"] <= 0.08
    assert rows["laser_tracker", 50.0]["length_rms_mm"] < tracker["length_rms_mm"]
    assert rows["total_station", 50.0]["length_rms_mm"] > rows["camera", 50.0]["length_rms_mm"]
    # The RMS is that of the parameters, root of the mean square (I-12 of the digest).
    lengths = [v for k, v in camera["parameters"].items() if not k.startswith("alpha")]
    assert camera["length_rms_mm"] == pytest.approx(np.sqrt(np.mean(np.square(lengths))))
    assert rows["total_station", 20.0]["refused"] == 3 and "too short" in data["verdict"]["text"]
    page = run_kr5("report", "study.json", "-o", "page.html", "--png", "plots")
    assert page.returncode == 0, page.stderr
    assert (tmp_path / "plots/study_noise.png").exists() and (tmp_path / "plots/study_parameters.png").exists()
    run_kr5(*arguments, "--device", "laser_tracker", "--arc", "20", "--json", "again.json")
    run_kr5(*arguments, "--device", "laser_tracker", "--arc", "20", "--json", "twice.json")
    again, twice = (json.loads((tmp_path / f).read_text())["result"] for f in ("again.json", "twice.json"))
    for one, other in zip(again["rows"], twice["rows"], strict=True):
        assert one["parameters"] == pytest.approx(other["parameters"], rel=1e-6)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--device", "sextant"), "expected one of total_station, laser_tracker, camera"),
        (("--arc", "0"), "--arc: found 0"),
        (("--noise", "-1"), "--noise: found -1"),
        (("--home", "0,0"), "--home: found 2 values, expected 6"),
        (("--home", "a"), "--home: found 'a'"),
        (("--cell", "missing.yaml"), "missing.yaml"),
    ],
)
def test_a_study_that_cannot_be_is_refused_in_words(run_kr5, arguments, text):
    done = run_kr5("identify", "study", *arguments)
    assert done.returncode == 2 and text in done.stderr


def test_lengths_of_parallel_planes_from_python():
    distances = calibration.ParallelPlaneDistances(
        c_23=0.6, c_35=0.6315, c_16=0.8, c_16_upright=0.06, covariance=1e-8 * np.eye(4)
    )
    lengths = calibration.lengths_from_parallel_planes(distances)
    assert lengths.a1 == pytest.approx(0.18, abs=1e-5) and lengths.a1_other == pytest.approx(0.68, abs=1e-5)
    assert lengths.b4 == pytest.approx(0.62, abs=1e-5) and lengths.a3 == pytest.approx(0.12, abs=1e-5)


def test_an_arm_from_its_turns_in_python(chain):
    q, places = turns(chain)
    split = calibration.split_turns(q)
    assert split.usable and [len(rows) for rows in split.rows] == [20] * 6
    samples = [[calibration.JointSample(q=q[i, k], points=places[i][:, None]) for i in split.rows[k]] for k in range(6)]
    result = calibration.identify_arm_axes(samples, split.home)
    assert result.fit.usable and result.findings.empty
    found = {(p.joint, str(p.parameter)): p for p in result.parameters}
    assert (0, "b") not in found and (1, "beta") in found and (1, "b") not in found
    assert abs(found[2, "a"].value - 0.12) < 4 * found[2, "a"].std
    assert result.covariance.shape == (len(found), len(found))
    moved = np.array([[0.003], [0.0], [0.001]])
    for k in range(3, 6):
        samples[k] = [calibration.JointSample(q=s.q, points=np.asarray(s.points) + moved) for s in samples[k]]
    (jump,) = calibration.identify_arm_axes(samples, split.home).findings.home_jumps
    assert jump.joint == 3 and jump.distance == pytest.approx(np.hypot(0.003, 0.001), rel=0.05)
    assert jump.to_dict() == {"joint": 3, "distance": jump.distance, "std": jump.std}
    shorter = calibration.ArmAxesOptions(nominal=kinematics.DhChain(chain.joints[:5], chain.T_base_0))
    mismatch = calibration.identify_arm_axes(samples, split.home, shorter).findings.nominal_mismatch
    assert str(mismatch.kind) == "joint_count" and mismatch.nominal_joints == 5
    assert not calibration.split_turns(np.zeros((4, 2))).usable
    with pytest.raises(kr5.InvalidArgument, match="home: expected 6"):
        calibration.identify_arm_axes(samples, split.home[:5])
