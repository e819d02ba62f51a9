"""Results in the forms that other programs read, each read back by a reader of its own."""

import ast
import json
import re
import shlex
import xml.etree.ElementTree as xml
from pathlib import Path
from types import SimpleNamespace

import kr5
import numpy as np
import pytest
import yaml
from kr5 import calibration
from kr5.files.camera import load_camera
from kr5.files.results import read_result

from kr5_tools.cli.terminal import console
from kr5_tools.exports import camera_forms, pose_forms
from kr5_tools.exports.command_line import Exports
from kr5_tools.exports.forms import BY_NAME, FORMS, form_of
from kr5_tools.exports.items import ExportCamera, ExportPose, items_of
from test_hand_eye_pairs import X, pairs, write_csv
from test_report_formats import MAKERS
from test_report_formats import kr5 as kr5_in
from test_tool import TIP, streams, touches, write_kuka, write_stream

CLOSE = 1e-9
POSES = [
    kr5.from_xyzrpy([0.05, -0.03, 0.08, 0.1, -0.15, 1.6]),
    kr5.from_xyzrpy([1e-7, 2.0, -3.5, 3.0, np.pi / 2, -2.0]),  # where roll and yaw are one
    kr5.from_xyzrpy([0.1, 0.2, 0.3, -3.1, -np.pi / 2 + 1e-7, 1.0]),
    kr5.to_pose([0.0, 0.0, 0.0, np.pi, 0.0, 0.0]),
]
BROWN = (-0.21, 0.08, 1e-4, -2e-4, 0.003, 0.0, 0.0, 0.0)
RATIONAL = (0.3, -0.1, 1e-4, -2e-4, 0.01, 0.7, -0.05, 0.002)


def named(T, parent="tool0", child="camera_optical_frame"):
    return ExportPose("Camera on the flange", parent, child, T)


def lens(values=BROWN):
    return ExportCamera("Camera", "left", 1280, 1024, 1400.123456789012, 1401.5, 640.25, 511.0, values)


def pose_of(arguments):
    """What static_transform_publisher makes of its arguments."""
    values = dict(zip(arguments[::2], arguments[1::2]))
    row = [float(values[f"--{key}"]) for key in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    T = calibration.to_poses([row], calibration.PoseFormat())[0]
    return T, values["--frame-id"], values["--child-frame-id"]


@pytest.mark.parametrize("T", POSES)
def test_a_pose_reads_back_from_the_commands_and_launch_files_of_ros(T):
    command = shlex.split(pose_forms.ros_command([named(T)]))
    assert command[:4] == ["ros2", "run", "tf2_ros", "static_transform_publisher"]
    found = [pose_of(command[4:])]
    node = xml.fromstring(pose_forms.launch_xml([named(T)])).find("node")
    assert (node.get("pkg"), node.get("exec")) == ("tf2_ros", "static_transform_publisher")
    found.append(pose_of(shlex.split(node.get("args"))))
    found.append(pose_of(launched(pose_forms.launch_python([named(T)]))))
    for back, parent, child in found:
        assert np.abs(back - T).max() < CLOSE
        assert (parent, child) == ("tool0", "camera_optical_frame")


def launched(text):
    """Arguments of the one node of a launch file in Python, run with stand-ins of launch and launch_ros."""
    tree = ast.parse(text)
    tree.body = [item for item in tree.body if not isinstance(item, ast.ImportFrom)]
    nodes = []
    scope = {"Node": lambda **values: nodes.append(SimpleNamespace(**values)), "LaunchDescription": list}
    exec(compile(tree, "x.launch.py", "exec"), scope)
    scope["generate_launch_description"]()
    assert [(n.package, n.executable) for n in nodes] == [("tf2_ros", "static_transform_publisher")]
    return nodes[0].arguments


@pytest.mark.parametrize("T", POSES)
def test_a_pose_reads_back_from_a_urdf(T, tmp_path):
    root = xml.fromstring(pose_forms.urdf([named(T)]))
    assert [link.get("name") for link in root.findall("link")] == ["tool0", "camera_optical_frame"]
    arm = (
        '<robot name="arm"><link name="base"/><joint name="j" type="continuous"><parent link="base"/>'
        f'<child link="tool0"/></joint><link name="tool0"/>{pose_forms.urdf_joint(named(T))}</robot>'
    )
    (tmp_path / "arm.urdf").write_text(arm)
    found = kr5.cell.import_urdf(tmp_path / "arm.urdf")
    assert found.tip == "camera_optical_frame"
    assert np.abs(found.cell.T_base_tool([0.0]) - T).max() < CLOSE


@pytest.mark.parametrize("T", POSES)
def test_a_pose_reads_back_from_plain_files(T, tmp_path):
    (tmp_path / "T.txt").write_text(pose_forms.matrix_text([named(T), named(np.linalg.inv(T), "a", "b")]))
    assert np.array_equal(np.loadtxt(tmp_path / "T.txt"), np.vstack([T, np.linalg.inv(T)]))
    head, row = pose_forms.csv([named(T)]).splitlines()
    values = dict(zip(head.split(","), row.split(",")))
    arguments = [word for k in ("x", "y", "z", "qx", "qy", "qz", "qw") for word in (f"--{k}", values[k])]
    back, *_ = pose_of([*arguments, "--frame-id", values["parent"], "--child-frame-id", values["child"]])
    assert np.abs(back - T).max() < CLOSE
    (pose,) = json.loads(pose_forms.json_text([named(T)]))["poses"]
    assert np.array_equal(pose["matrix"], T)
    assert np.abs(kr5.from_xyzrpy([*pose["xyz"], *pose["rpy"]]) - T).max() < CLOSE


@pytest.mark.parametrize("values", [BROWN, RATIONAL, (0.0,) * 8])
def test_a_camera_reads_back_from_ros_and_opencv(values, tmp_path):
    cv2 = pytest.importorskip("cv2")
    camera = lens(values)
    info, storage = tmp_path / "info.yaml", tmp_path / "opencv.yml"
    info.write_text(camera_forms.camera_info(camera))
    storage.write_text(camera_forms.opencv([camera], [named(POSES[0])]))
    ros = yaml.safe_load(info.read_text())
    assert ros["distortion_model"] == ("rational_polynomial" if values == RATIONAL else "plumb_bob")
    assert (ros["image_width"], ros["image_height"], ros["camera_name"]) == (1280, 1024, "left")
    assert np.array_equal(np.reshape(ros["camera_matrix"]["data"], (3, 3)), camera.matrix)
    assert np.array_equal(np.reshape(ros["projection_matrix"]["data"], (3, 4))[:, :3], camera.matrix)
    read = cv2.FileStorage(str(storage), cv2.FILE_STORAGE_READ)
    assert np.abs(read.getNode("camera_matrix").mat() - camera.matrix).max() < CLOSE
    D = read.getNode("distortion_coefficients").mat().ravel()
    assert np.abs(D - ros["distortion_coefficients"]["data"]).max() < CLOSE
    assert int(read.getNode("image_width").real()) == 1280
    assert np.abs(read.getNode("T_tool0_camera_optical_frame").mat() - POSES[0]).max() < CLOSE
    point = np.array([[[0.3, -0.2, 1.4]]])
    expected, _ = cv2.projectPoints(point, np.zeros(3), np.zeros(3), camera.matrix, D)
    for file in (info, storage):  # as our own commands read them
        own = load_camera(file, (1280, 1024))
        assert np.abs(own.project(point[0].T).ravel() - expected.ravel()).max() < 1e-9


def test_the_name_of_a_file_or_an_option_says_the_form():
    names = [form_of(Path(f), None).name for f in ("a.sh", "a.launch.py", "b.launch.xml", "c.URDF", "c.yml", "d.json")]
    assert names == ["ros2-command", "launch-py", "launch-xml", "urdf", "opencv", "json"]
    assert form_of(Path("a.cfg"), "matrix").name == "matrix"
    assert len({ending for form in FORMS for ending in form.endings}) == sum(len(form.endings) for form in FORMS)


def run_pairs(run_kr5, folder, *options):
    write_csv(folder / "pairs.csv", *pairs())
    return run_kr5("calibrate", "hand-eye", "pairs.csv", "--mount", "eye_in_hand", *options)


def test_hand_eye_writes_its_pose_under_the_names_of_the_robot(run_kr5, tmp_path):
    names = ("--export-parent", "tool0", "--export-child", "camera_link")
    files = [
        word
        for file in ("c.sh", "c.launch.xml", "c.urdf", "c.txt", "c.csv", "c.json", "c.yml")
        for word in ("--export", file)
    ]
    done = run_pairs(run_kr5, tmp_path, "-o", "result.json", *files, *names)
    assert done.returncode == 0, done.stderr
    assert "export: c.sh (ROS 2 command)\nexport: c.launch.xml (ROS 2 launch file in XML)\n" in done.stdout
    assert done.stdout.endswith("export: c.json (JSON)\nexport: c.yml (OpenCV)\n")
    T = np.array(json.loads((tmp_path / "result.json").read_text())["result"]["T_mount_camera"])
    assert np.abs(T - X).max() < 5e-3
    back, parent, child = pose_of(shlex.split((tmp_path / "c.sh").read_text())[4:])
    assert np.abs(back - T).max() < CLOSE and (parent, child) == ("tool0", "camera_link")
    assert np.array_equal(np.loadtxt(tmp_path / "c.txt"), T)
    assert len((tmp_path / "c.csv").read_text().splitlines()) == 2  # the target is not what was calibrated
    assert 'link="tool0"' in (tmp_path / "c.urdf").read_text()
    assert "T_tool0_camera_link" in (tmp_path / "c.yml").read_text()


def test_other_calibrations_write_theirs(run_kr5, tmp_path):
    write_kuka(tmp_path / "touches.csv", touches())
    done = run_kr5("calibrate", "tool", "touches.csv", "--export", "tool.urdf", "--json", "-")
    assert done.returncode == 0 and json.loads(done.stdout)["format"] == "kr5-tool/1"
    assert done.stderr.endswith("export: tool.urdf (URDF)\n")
    origin = xml.parse(tmp_path / "tool.urdf").getroot().find("joint/origin")
    assert np.abs(np.array(origin.get("xyz").split(), float) - TIP).max() < 1e-3
    th, hands, tc, cameras = streams()
    write_stream(tmp_path / "hand.csv", th, hands)
    write_stream(tmp_path / "camera.csv", tc, cameras)
    done = run_kr5("calibrate", "timed", "hand.csv", "camera.csv", "--export", "T.out", "--export-format", "matrix")
    assert done.returncode == 0, done.stderr
    expected = kr5.to_pose([0.05, 0.02, 0.1, 0.1, 0.2, 1.5])
    assert np.abs(np.loadtxt(tmp_path / "T.out") - expected).max() < 2e-3


def test_camera_and_folder_of_images_write_camera_info(run_kr5, tmp_path, share):
    demo = share / "data/demo"
    done = run_kr5(
        "calibrate",
        "hand-eye",
        demo,
        "--max-views",
        "8",
        "--export",
        "c.yaml",
        "--export",
        "c.urdf",
        "--export-child",
        "wrist_camera",
    )
    assert done.returncode == 0, done.stderr
    given, written = load_camera(demo / "camera.yaml"), load_camera(tmp_path / "c.yaml")
    assert yaml.safe_load((tmp_path / "c.yaml").read_text())["camera_name"] == "wrist_camera"
    for key in ("width", "height", "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"):
        assert getattr(written, key) == getattr(given, key)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--export", "a.step"), "found the ending '.step', expected .sh (ros2-command)"),
        (("--export", "a.txt", "--export-format", "tf"), "--export-format: found tf, expected one of ros2-command"),
        (("--export-parent", "tool0"), "--export-parent: --export is missing"),
        (("--export", "a.txt", "--export-child", "my camera"), "--export-child: found 'my camera'"),
        (("--export", "a.txt", "--export-child", "a", "--export-parent", "a"), "which is the parent, too"),
        (("--export", "nowhere/a.txt"), "no such folder"),
        (("--export", "touches.csv"), "is an input of this command"),
        (("--export", "a.yaml"), "--export: a.yaml: camera-info holds a camera, and this result has poses"),
    ],
)
def test_options_that_make_no_sense_are_refused_before_anything_is_done(run_kr5, tmp_path, options, word):
    write_kuka(tmp_path / "touches.csv", touches())
    before = (tmp_path / "touches.csv").read_text()
    failed = run_kr5("calibrate", "tool", "touches.csv", "-o", "tool.json", *options)
    assert failed.returncode == 2
    assert word in failed.stderr and len(failed.stderr.splitlines()) == 1
    assert not (tmp_path / "tool.json").exists()
    assert (tmp_path / "touches.csv").read_text() == before


def test_a_form_that_pairs_of_poses_cannot_fill_is_refused_and_nothing_is_written(run_kr5, tmp_path):
    done = run_pairs(run_kr5, tmp_path, "-o", "result.json", "--export", "c.txt", "--export", "c.yaml")
    assert done.returncode == 2 and done.stdout == ""  # before anything is computed
    assert "--export: c.yaml: camera-info holds a camera, and this result has poses" in done.stderr
    assert [f.name for f in tmp_path.iterdir()] == ["pairs.csv"]


def test_a_form_that_a_result_cannot_fill_ends_the_command():
    exports = Exports([Path("c.txt")], [BY_NAME["matrix"]])
    with pytest.raises(
        kr5.InvalidArgument, match="--export: c.txt: matrix holds poses, which this result does not have"
    ):
        exports.write({"format": "kr5-kinematics/1", "result": {"T_world_base": np.eye(4).tolist()}}, console())


def test_a_form_of_poses_is_refused_by_a_camera(run_kr5, share, tmp_path):
    images = share / "data/demo/images"
    done = run_kr5("calibrate", "camera", images, "--target", "grid:36h11:5x7:0.03:0.01", "--export", "c.sh")
    assert done.returncode == 2 and done.stdout == ""
    assert "--export: c.sh: ros2-command holds poses, and this result has a camera" in done.stderr
    assert not (tmp_path / "c.sh").exists()


@pytest.mark.parametrize(
    ("command", "parts"), [("camera", {"camera"}), ("tool", {"poses"}), ("cell", {"camera", "poses"})]
)
def test_the_help_offers_the_forms_that_the_command_takes_and_no_others(run_kr5, command, parts):
    shown = run_kr5("calibrate", command, "--help", width=300).stdout
    told = re.search(r"other programs: (.*)\. Repeatable", shown)[1]
    names = re.search(r"that of their ending: (.*?)\. ", shown)[1].split(", ")
    expected = [form for form in FORMS if set(form.takes) & parts]
    assert told == ", ".join(f"{form.endings[0]} ({form.title})" for form in expected)
    assert names == [form.name for form in expected] and 2 <= len(names) <= len(FORMS)
    assert ("--export-parent" in shown) == ("poses" in parts)


# Of each format: the frames that are exported, and where its result says the pose.
EXPORTED = {
    "kr5-hand-eye/1": {"flange>camera": "T_mount_camera"},
    "kr5-timed-hand-eye/1": {"hand>camera": "T_hand_camera"},
    "kr5-tool/1": {"flange>tool": "tip"},
    "kr5-kinematics/1": {"world>base": "T_world_base"},  # of a point on the tool alone no pose is estimated
    "kr5-cell-calibration/1": {"flange>camera": "T_mount_camera"},
    "kr5-laser/1": {"flange>scanner": "T_flange_scanner"},
    "kr5-marker-map/1": {f"map>marker_{k}": "" for k in range(35)},
}


@pytest.mark.parametrize("format", EXPORTED)
def test_a_result_of_a_command_exports_its_poses(tmp_path, format):
    kr5_in(*MAKERS[format](tmp_path), "--export", "poses.json", cwd=tmp_path)
    data = read_result(tmp_path / "r.json", format)
    poses = {f"{p['parent']}>{p['child']}": p for p in json.loads((tmp_path / "poses.json").read_text())["poses"]}
    assert set(poses) == set(EXPORTED[format])
    result = data["result"]
    markers = {f"map>marker_{m['id']}": m["T_target_marker"] for m in (result.get("target") or {}).get("map", ())}
    for name, pose in poses.items():
        key = EXPORTED[format][name]
        expected = markers[name] if not key else result[key]
        if key == "tip":
            assert pose["xyz"] == expected and np.array_equal(np.array(pose["matrix"])[:3, :3], np.eye(3))
        else:
            assert np.array_equal(pose["matrix"], expected)
    assert items_of({**data, "result": {**result, "fit": {"usable": False}}}).poses == []


def test_a_camera_beside_the_robot_is_exported_in_the_base():
    T = POSES[0].tolist()
    result = {"mount": "eye_to_hand", "T_mount_camera": T, "T_fixed_target": T}
    items = items_of({"format": "kr5-hand-eye/1", "result": result})
    assert [f"{p.parent}>{p.child}" for p in items.poses] == ["base>camera", "flange>target"]


def test_the_page_offers_what_can_be_copied(run_kr5, tmp_path, browser):
    done = run_pairs(run_kr5, tmp_path, "-o", "result.json")
    assert run_kr5("report", "result.json", "-o", "page.html").returncode == 0, done.stderr
    page = (tmp_path / "page.html").read_text()
    T = np.array(json.loads((tmp_path / "result.json").read_text())["result"]["T_mount_camera"])
    browser.open_whole(tmp_path / "page.html", 390)
    shown = browser.evaluate("[...document.querySelectorAll('.copyable pre')].map(e => e.textContent)")
    command = next(text for text in shown if text.startswith("ros2 run"))
    assert np.abs(pose_of(shlex.split(command)[4:])[0] - T).max() < CLOSE
    # Without a clipboard, as on a page opened from a file, the text is selected and copied by the document.
    browser.evaluate(
        "navigator.clipboard.writeText = async () => { throw new Error('none'); };"
        "window.copied = [];"
        "document.execCommand = what => { copied.push([what, String(getSelection())]); return true; };"
        "document.querySelector('.copyable button').click(); 1"
    )
    assert browser.evaluate("new Promise(done => setTimeout(() => done(copied), 50))")[0] == [
        "copy",
        shown[0].rstrip("\n"),
    ]
    assert browser.evaluate("document.querySelector('.copyable button').textContent") == "Copied"
    assert "http://" not in page.split("<section>")[-1]
