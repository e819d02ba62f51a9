"""`kr5 calibrate hand-eye` from pairs of poses, in every form in which others save them."""

import json
import shlex

import kr5
import numpy as np
import pytest
import yaml
from kr5 import calibration, cell
from kr5.files.paths import find_shipped_cell

X = kr5.from_xyzrpy([0.05, -0.03, 0.08, 0.1, -0.15, 1.6])  # what the flange carries: camera, or target
Z = kr5.from_xyzrpy([0.7, 0.1, 0.05, 3.1, 0.05, 0.4])  # what stands in the base: target, or camera


def pairs(count=14, seed=1, noise=3e-4, mount="eye_in_hand"):
    """Poses of the flange and of the target in the camera, with noise."""
    random = np.random.default_rng(seed)
    robot, seen = [], []
    for _ in range(count):
        M = kr5.to_pose([*random.uniform(-0.1, 0.1, 2), random.uniform(0.4, 0.7), *random.normal(0, 0.5, 3)])
        T = Z @ (np.linalg.inv(M) if mount == "eye_in_hand" else M) @ np.linalg.inv(X)
        robot.append(T @ kr5.to_pose(random.normal(0, noise, 6)))
        seen.append(M @ kr5.to_pose(random.normal(0, noise, 6)))
    return robot, seen


def quaternion(T):
    return calibration.to_row(T, calibration.PoseFormat())  # x y z qx qy qz qw


def write_csv(file, robot, seen, scale=1.0):
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")
    header = [p + n for p in ("robot_", "camera_") for n in names]
    rows = np.hstack([[quaternion(T) for T in robot], [quaternion(T) for T in seen]])
    rows[:, :3] *= scale
    file.write_text(",".join(header) + "\n" + "\n".join(",".join(map(repr, map(float, r))) for r in rows) + "\n")


def transform(T):
    x, y, z, qx, qy, qz, qw = map(float, quaternion(T))
    return {"translation": {"x": x, "y": y, "z": z}, "rotation": {"x": qx, "y": qy, "z": qz, "w": qw}}


def as_moveit_yaml(robot, seen):
    return yaml.safe_dump(
        [
            {"effector_wrt_world": T.ravel().tolist(), "object_wrt_sensor": M.ravel().tolist()}
            for T, M in zip(robot, seen)
        ]
    )


def as_moveit_json(robot, seen):
    return json.dumps([[T.tolist(), M.tolist()] for T, M in zip(robot, seen)])


def as_easy(robot, seen, kind="eye_in_hand"):
    parameters = {"name": "", "calibration_type": kind, "freehand_robot_movement": False}
    samples = [{"robot": transform(T), "tracking": transform(M)} for T, M in zip(robot, seen)]
    return yaml.safe_dump({"parameters": parameters, "samples": samples})


def as_easy_service(robot, seen):
    lists = {
        "hand_world_samples": {"transforms": [transform(T) for T in robot]},
        "camera_marker_samples": {"transforms": [transform(M) for M in seen]},
    }
    return yaml.safe_dump({"samples": lists})


def result_of(tmp_path):
    return json.loads((tmp_path / "r.json").read_text())


def check_place(data, T=X, tolerance=2e-3):
    assert np.allclose(np.array(data["result"]["T_mount_camera"]), T, atol=tolerance), data["result"]["T_mount_camera"]


@pytest.mark.parametrize(
    "name, text, source",
    [
        ("samples.yaml", as_moveit_yaml, "MoveIt"),
        ("samples.json", as_moveit_json, "MoveIt"),
        ("cell.samples", as_easy, "easy_handeye"),
        ("lists.yaml", as_easy_service, "easy_handeye"),
    ],
)
def test_samples_of_others_are_read(run_kr5, tmp_path, name, text, source):
    (tmp_path / name).write_text(text(*pairs()))
    done = run_kr5("calibrate", "hand-eye", name, "--mount", "eye_in_hand", "-o", "r.json")
    assert done.returncode == 0, done.stderr
    data = result_of(tmp_path)
    check_place(data)
    assert data["input"]["source"] == source and data["verdict"]["word"] == "good" and not data["causes"]
    assert data["held_out"]["position_rms_mm"] < 3 and data["result"]["sigma_camera_rotation"] > 0
    assert data["input"]["read_as"] == "T_base_flange and T_camera_target, as stated; the data agree"


def test_easy_handeye_saves_the_inverse_of_the_robot_beside_a_fixed_camera(run_kr5, tmp_path):
    robot, seen = pairs(mount="eye_to_hand")
    (tmp_path / "s.yaml").write_text(as_easy([np.linalg.inv(T) for T in robot], seen, "eye_on_base"))
    done = run_kr5("calibrate", "hand-eye", "s.yaml", "-o", "r.json")
    assert done.returncode == 0, done.stderr
    data = result_of(tmp_path)
    check_place(data, Z)
    assert data["input"]["mount"] == data["result"]["mount"] == "eye_to_hand"
    assert "note" not in done.stderr  # as the format says


def test_a_csv_and_two_files_of_poses_give_the_same(run_kr5, tmp_path):
    robot, seen = pairs()
    write_csv(tmp_path / "pairs.csv", robot, seen)
    for name, poses in (("robot.csv", robot), ("camera.csv", seen)):
        rows = np.array([quaternion(T) for T in poses])
        text = "x,y,z,qx,qy,qz,qw\n" + "\n".join(",".join(map(repr, map(float, r))) for r in rows) + "\n"
        (tmp_path / name).write_text(text)
    common = ("--mount", "eye_in_hand", "-o", "r.json")
    assert run_kr5("calibrate", "hand-eye", "pairs.csv", *common).returncode == 0
    first = result_of(tmp_path)["result"]["T_mount_camera"]
    assert run_kr5("calibrate", "hand-eye", "robot.csv", "--camera-poses", "camera.csv", *common).returncode == 0
    assert np.allclose(first, result_of(tmp_path)["result"]["T_mount_camera"], atol=1e-9)


def test_which_way_round_poses_are_is_told_from_the_data(run_kr5, tmp_path):
    robot, seen = pairs()
    turned = {
        "T_flange_base and T_camera_target": ([np.linalg.inv(T) for T in robot], seen),
        "T_base_flange and T_target_camera": (robot, [np.linalg.inv(M) for M in seen]),
    }
    for words, (T, M) in turned.items():
        write_csv(tmp_path / "p.csv", T, M)
        done = run_kr5("calibrate", "hand-eye", "p.csv", "--mount", "eye_in_hand", "-o", "r.json")
        assert done.returncode == 0, done.stderr
        assert f"read as {words}" in done.stderr and "or the mount is the other one" in done.stderr
        check_place(result_of(tmp_path))
    stated = ("--robot-meaning", "T_base_flange", "--camera-meaning", "T_camera_target")
    done = run_kr5("calibrate", "hand-eye", "p.csv", "--mount", "eye_in_hand", *stated, "-o", "r.json")
    assert done.returncode == 1
    assert result_of(tmp_path)["causes"][0]["cause"] == "poses_inverted"


def test_a_camera_far_from_the_flange_is_doubted(run_kr5, tmp_path):
    robot, seen = pairs()
    write_csv(tmp_path / "p.csv", [np.linalg.inv(T) for T in robot], [np.linalg.inv(M) for M in seen])
    done = run_kr5("calibrate", "hand-eye", "p.csv", "--mount", "eye_in_hand", "-o", "r.json")
    assert done.returncode == 0 and "Are both inverted, or robot and camera exchanged" in done.stderr
    check_place(result_of(tmp_path), Z)
    stated = ("--robot-meaning", "T_flange_base", "--camera-meaning", "T_target_camera")
    assert run_kr5("calibrate", "hand-eye", "p.csv", "--mount", "eye_in_hand", *stated, "-o", "r.json").returncode == 0
    check_place(result_of(tmp_path))


def test_faults_of_pairs_are_named(run_kr5, tmp_path):
    robot, seen = pairs()
    cases = {"shifted_by_one": (robot[1:], seen[:-1], 1.0), "millimetres_for_metres": (robot, seen, 1e3)}
    flip = np.diag([1.0, -1.0, 1.0, 1.0])
    cases["mirrored_target"] = (robot, [flip @ M @ flip for M in seen], 1.0)
    for cause, (T, M, scale) in cases.items():
        write_csv(tmp_path / "p.csv", T, M, scale)
        done = run_kr5("calibrate", "hand-eye", "p.csv", "--mount", "eye_in_hand", "-o", "r.json")
        assert done.returncode == 1, (cause, done.stdout, done.stderr)
        assert result_of(tmp_path)["causes"][0]["cause"] == cause


def test_pairs_in_the_wrong_order_are_named_with_their_lines(run_kr5, tmp_path):
    robot, seen = pairs()
    order = np.random.default_rng(4).permutation(len(robot))
    order[order == 3], order[3] = order[3], 3  # one that is right
    write_csv(tmp_path / "p.csv", robot, [seen[k] for k in order])
    done = run_kr5("calibrate", "hand-eye", "p.csv", "--mount", "eye_in_hand", "-o", "r.json")
    assert done.returncode == 1, (done.stdout, done.stderr)
    (cause,) = result_of(tmp_path)["causes"]
    assert cause["cause"] == "out_of_order"
    assert cause["views"] == [int(k) for k in np.flatnonzero(order != np.arange(len(robot)))]
    assert "paired with the wrong pose: p.csv:" in cause["text"]


def test_a_stated_unit_that_cannot_be_is_refused(run_kr5, tmp_path):
    write_csv(tmp_path / "p.csv", *pairs())
    done = run_kr5("calibrate", "hand-eye", "p.csv", "--mount", "eye_in_hand", "--length-unit", "mm")
    assert done.returncode == 2 and "--length-unit" in done.stderr
    done = run_kr5("calibrate", "hand-eye", "p.csv", "--mount", "eye_in_hand", "--length-unit", "cm")
    assert done.returncode == 2 and "Traceback" not in done.stderr


def test_an_outlier_pair_is_named_with_its_line_and_shown_on_the_page(run_kr5, tmp_path):
    robot, seen = pairs()
    seen[4] = seen[4] @ kr5.to_pose([0.02, 0, 0, 0, 0.1, 0])
    write_csv(tmp_path / "p.csv", robot, seen)
    done = run_kr5("calibrate", "hand-eye", "p.csv", "--mount", "eye_in_hand", "-o", "r.json")
    assert done.returncode == 0, done.stdout
    data = result_of(tmp_path)
    assert "p.csv:6" in data["result"]["fit"]["message"]
    assert [v["name"] for v in data["views"] if v["outlier"]] == ["p.csv:6"]
    check_place(data)
    assert run_kr5("report", "r.json", "-o", "page.html", "--png", "plots").returncode == 0
    assert "p.csv:6" in (tmp_path / "page.html").read_text()
    assert {f.stem for f in (tmp_path / "plots").iterdir()} >= {"robot_position", "robot_rotation", "frames"}


def test_pairs_go_into_a_cell(run_kr5, tmp_path):
    believed = cell.load_cell(find_shipped_cell())
    cell.save_cell(believed, tmp_path / "cell.yaml")
    write_csv(tmp_path / "p.csv", *pairs())
    put = ("--cell", "cell.yaml", "--write-cell", "new.yaml")
    done = run_kr5("calibrate", "hand-eye", "p.csv", "--mount", "eye_in_hand", "-o", "r.json", *put)
    assert done.returncode == 0, done.stderr
    assert "covariance" in done.stderr
    found = cell.load_cell(tmp_path / "new.yaml")
    assert np.allclose(found.T_flange_camera(), result_of(tmp_path)["result"]["T_mount_camera"], atol=1e-9)
    done = run_kr5("calibrate", "hand-eye", "p.csv", "--mount", "eye_in_hand", "--write-cell", "new.yaml")
    assert done.returncode == 2 and "--cell is missing" in done.stderr


def refused(run_kr5, *args, words):
    done = run_kr5("calibrate", "hand-eye", *args, "-o", "r.json")
    assert done.returncode == 2, done.stdout + done.stderr
    text = " ".join(done.stderr.split())
    assert "Traceback" not in text
    for word in words:
        assert word in text, text


def test_files_that_hold_no_pairs_are_refused(run_kr5, tmp_path):
    robot, seen = pairs()
    mount = ("--mount", "eye_in_hand")
    refused(run_kr5, "none.csv", words=["no such file or folder"])
    (tmp_path / "empty.yaml").write_text("")
    refused(run_kr5, "empty.yaml", *mount, words=["empty.yaml", "found no pairs of poses"])
    (tmp_path / "cut.json").write_text(as_moveit_json(robot, seen)[:-40])
    refused(run_kr5, "cut.json", *mount, words=["is not valid JSON"])
    bad = yaml.safe_load(as_moveit_yaml(robot, seen))
    bad[2]["object_wrt_sensor"] = bad[2]["object_wrt_sensor"][:-1]
    (tmp_path / "short.yaml").write_text(yaml.safe_dump(bad))
    refused(run_kr5, "short.yaml", *mount, words=["short.yaml:", "object_wrt_sensor", "16 numbers"])
    bad = [T.copy() for T in seen]
    bad[1][:3, 0] *= -1
    (tmp_path / "left.yaml").write_text(as_moveit_yaml(robot, bad))
    refused(run_kr5, "left.yaml", *mount, words=["camera poses", "reflection", "left-handed"])
    write_csv(tmp_path / "p.csv", robot, seen)
    refused(run_kr5, "p.csv", words=["--mount"])
    refused(run_kr5, "p.csv", *mount, "--target", "chessboard:6x9:0.02", words=["--target", "only with a folder"])
    text = (tmp_path / "p.csv").read_text()
    (tmp_path / "p.csv").write_text(text.replace("camera_qw", "camera_q"))
    refused(run_kr5, "p.csv", *mount, words=["camera_qw"])
    lines = text.splitlines()
    (tmp_path / "p.csv").write_text("\n".join([lines[0], "nan" + lines[1][lines[1].index(",") :], *lines[2:]]) + "\n")
    refused(run_kr5, "p.csv", *mount, words=["p.csv: line 2", "finite number"])
    (tmp_path / "p.csv").write_text("\n".join(lines[:3]) + "\n")
    refused(run_kr5, "p.csv", *mount, words=["at least three pairs of poses, found 2"])
    (tmp_path / "p.csv").write_text("\n".join([*lines, lines[-1]]) + "\n")
    refused(run_kr5, "p.csv", *mount, words=["is the same as pair"])
    write_csv(
        tmp_path / "p.csv",
        robot[:1] * 8,
        [M @ kr5.to_pose([0.01 * i, 0, 0, 0, 0, 0]) for i, M in enumerate(seen[:1] * 8)],
    )
    refused(run_kr5, "p.csv", *mount, words=["the wrist turned by at most"])


@pytest.mark.parametrize("command", [("calibrate", "hand-eye"), ("dataset", "guess")])
def test_a_folder_of_pairs_is_refused_with_the_command_that_reads_it(run_kr5, tmp_path, command):
    folder = tmp_path / "my cell"
    folder.mkdir()
    (folder / "notes.csv").write_text("x,y\n1,2\n")
    (folder / "broken.csv").write_text("x,y\n1\n")
    write_csv(folder / "pairs.csv", *pairs())
    done = run_kr5(*command, "my cell")
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    told = done.stderr.partition("holds pairs of poses: kr5 ")[2].partition(" (or ")[0]
    assert run_kr5(*shlex.split(told)).returncode == 0, done.stderr
    (folder / "pairs.csv").unlink()
    done = run_kr5(*command, "my cell")
    assert done.returncode == 2 and "pairs of poses" not in done.stderr
