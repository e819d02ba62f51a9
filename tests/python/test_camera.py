"""Camera calibration from Python and from the command; the mathematics is tested in C++."""

import json

import kr5
import numpy as np
import pytest
import yaml
from kr5 import vision
from kr5.files import camera as camera_files

CAMERA = {"width": 640, "height": 480, "fx": 540.0, "fy": 540.0, "cx": 325.0, "cy": 236.0, "k1": -0.2, "k2": 0.05}


def views(count=8, tilt=0.6, noise=0.1):
    """What a camera sees of a chessboard of 6 x 9 corners."""
    random, camera = np.random.default_rng(4), kr5.Pinhole(**CAMERA)
    points = np.zeros((3, 54))
    points[:2] = np.mgrid[0:9, 0:6].T.reshape(-1, 2).T * 0.025
    out = []
    while len(out) < count:
        T = kr5.to_pose(np.concatenate([[0, 0, 0], random.uniform(-tilt, tilt, 2), random.uniform(-0.5, 0.5, 1)]))
        centre = [*random.uniform(-0.08, 0.08, 2), random.uniform(0.3, 0.5)]
        seen = T[:3, :3] @ (points - points.mean(axis=1, keepdims=True)) + np.array(centre)[:, None]
        pixels = camera.project(seen)
        if (pixels > 1).all() and (pixels.T < [638, 478]).all():
            pixels = pixels + random.normal(0, noise, pixels.shape)
            out.append(kr5.View(name=f"{len(out)}.png", points=points, pixels=pixels, ids=list(range(54))))
    return out


def test_calibration_from_python():
    result = vision.calibrate_camera(views(), 640, 480, vision.CameraOptions(lens="k1k2", square_pixels=True))
    assert result.fit.usable
    assert abs(result.camera.fx - CAMERA["fx"]) < 5 * np.sqrt(result.covariance[0, 0])
    assert [m.chosen for m in result.models].count(True) == 1
    assert result.views[0].residuals.shape == (2, 54)
    json.dumps(result.to_dict())


def test_camera_of_visp_from_python():
    result = vision.calibrate_camera(views(), 640, 480, vision.CameraOptions(method="visp"))
    assert result.fit.usable and abs(result.camera.fx - CAMERA["fx"]) < 20


def test_bad_views_are_refused():
    with pytest.raises(kr5.InvalidArgument, match="no view"):
        vision.calibrate_camera([], 640, 480)
    with pytest.raises(kr5.InvalidArgument, match="outside the image"):
        vision.calibrate_camera(views(), 320, 240)


def same(camera, **expected):
    values = camera.to_dict()
    assert {k: values[k] for k in expected} == pytest.approx(expected)


def test_load_camera_from_every_form(tmp_path):
    file = tmp_path / "camera"
    file.write_text(yaml.safe_dump(CAMERA))
    same(camera_files.load_camera(file), **CAMERA)
    file.write_text(json.dumps({"format": "kr5-camera/1", "result": {"camera": CAMERA}}))
    same(camera_files.load_camera(file), **CAMERA)
    short = {k: CAMERA[k] for k in ("width", "height", "fx", "fy", "cx", "cy")}
    for distortion in ([-0.2, 0.05], {"model": "brown", "values": [-0.2, 0.05, 0, 0]}):
        file.write_text(yaml.safe_dump({"format": "kr5-cell/1", "camera": {**short, "distortion": distortion}}))
        same(camera_files.load_camera(file), **CAMERA)
    K, D = "540,0,325,0,540,236,0,0,1", "-0.2,0.05,0,0,0"
    file.write_text(
        f"%YAML:1.0\n---\nimage_width:640\nimage_height:480\n"
        f"camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ {K} ]\n"
        f"distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ {D} ]\n"
    )
    same(camera_files.load_camera(file), **CAMERA)
    file.write_text(
        "<?xml version='1.0'?>\n<opencv_storage><image_width>640</image_width><image_height>480</image_height>"
        "<camera_matrix type_id='opencv-matrix'><rows>3</rows><cols>3</cols><dt>d</dt>"
        f"<data>{K.replace(',', ' ')}</data></camera_matrix><distortion_coefficients type_id='opencv-matrix'>"
        f"<rows>1</rows><cols>5</cols><dt>d</dt><data>{D.replace(',', ' ')}</data></distortion_coefficients>"
        "</opencv_storage>"
    )
    same(camera_files.load_camera(file), **CAMERA)
    file.write_text(
        "<root><camera><image_width>640</image_width><image_height>480</image_height><model>"
        "<type>perspectiveProjWithDistortion</type><px>540</px><py>540</py><u0>325</u0><v0>236</v0>"
        "<kud>-0.2</kud></model></camera></root>"
    )
    same(camera_files.load_camera(file), **{**CAMERA, "k2": 0.0})


def test_load_camera_from_files_of_opencv_and_visp(reference):
    opencv = camera_files.load_camera(reference / "data/camera_opencv_stereo/left_intrinsics.yml")
    same(opencv, width=640, fx=535.91573396163199, k3=0.23839153080878486)
    visp = camera_files.load_camera(reference / "data/handeye_visp_franka/eye-in-hand/franka_camera.xml")
    same(visp, height=480, fx=607.5931396484375, cy=243.25529479980469)


@pytest.mark.parametrize(
    "text, words",
    [
        ("fx: 1\nfy: 1\ncx: 0\n", "cy is missing"),
        (yaml.safe_dump({**CAMERA, "fx": "wide"}), "fx: found 'wide'"),
        (yaml.safe_dump({**CAMERA, "fx": -5.0}), "fx"),
        ("- 1\n", "contains no camera"),
        ("{", "is not valid JSON"),
        ("<root/>", "<camera>"),
        ("<root", "is not valid XML"),
        ("camera_matrix: [1, 2]\n", "found 2 numbers"),
        (
            json.dumps({"format": "kr5-camera/1", "verdict": {"word": "unusable"}, "result": {"camera": CAMERA}}),
            "unusable",
        ),
    ],
)
def test_bad_camera_files_are_explained(tmp_path, text, words):
    file = tmp_path / "bad.yaml"
    file.write_text(text)
    with pytest.raises(kr5.FileError) as ended:
        camera_files.load_camera(file)
    assert ended.value.file == file and words in str(ended.value)


def test_command_calibrates_real_images(reference, run_kr5, tmp_path):
    images = sorted((reference / "data/camera_opencv_stereo").glob("left[0-9]*.jpg"))
    done = run_kr5("calibrate", "camera", *images, "--board", "chessboard:6x9:0.025", "-o", "camera.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "camera.json").read_text())
    assert data["format"] == "kr5-camera/1" and data["verdict"]["word"] in ("good", "doubtful")
    assert len(data["views"]) == len(data["residuals"]) == 13 and data["image_size"] == [640, 480]
    loaded = camera_files.load_camera(tmp_path / "camera.json")
    assert abs(loaded.fx - 533) < 8  # [px]; OpenCV: 532.8 to 536


def test_a_good_verdict_agrees_with_the_cause_below_it(share, run_kr5, tmp_path):
    images = share / "data/demo/images"
    done = run_kr5("calibrate", "camera", images, "--target", "grid:36h11:5x7:0.03:0.01", "-o", "camera.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "camera.json").read_text())
    assert data["verdict"]["word"] == "good" and "views_disagree" in [c["cause"] for c in data["causes"]]
    assert "its uncertainty is inflated, because they disagree by more than their noise" in data["verdict"]["text"]
    assert "views agree" not in done.stdout


def test_command_says_what_is_wrong(reference, run_kr5, tmp_path):
    images = sorted((reference / "data/camera_opencv_stereo").glob("left[0-9]*.jpg"))
    (tmp_path / "empty").mkdir()
    (tmp_path / "keep.json").write_text("old")
    vision.save_image(np.full((240, 320), 128, np.uint8), str(tmp_path / "small.png"))
    for arguments, words in (
        (["gone.png", "--target", "chessboard:6x9:0.025"], "gone.png"),
        (["empty", "--target", "chessboard:6x9:0.025"], "contains no image"),
        ([images[0], "--target", "chessboard:6x9"], "chessboard"),
        ([images[0], images[0], "--target", "chessboard:6x9:0.025"], "given twice"),
        (
            [images[0], "--target", "chessboard:4x4:0.025", "-o", "keep.json"],
            "found in 0 of 1 images, expected at least 1",
        ),
        (
            [images[0], "small.png", "--target", "chessboard:6x9:0.025"],
            "small.png: 320 x 240 px, but left01.jpg is 640 x 480 px",
        ),
    ):
        done = run_kr5("calibrate", "camera", *arguments)
        assert done.returncode == 2 and words in done.stderr and "Traceback" not in done.stderr, done.stderr
    done = run_kr5("calibrate", "camera", *images[:2], "--target", "chessboard:6x9:0.025", "-o", "keep.json")
    assert done.returncode == 2 and "at least 3 views" in done.stderr
    assert (tmp_path / "keep.json").read_text() == "old"


def test_the_demo_gives_back_the_camera_it_was_made_with(share):
    """Boards cut off by the image's edge, tags bent by the lens, and a principal point off the image's middle."""
    truth = yaml.safe_load((share / "data/demo/truth.yaml").read_text())["camera"]
    target = kr5.parse_target("grid:36h11:5x7:0.03:0.01")
    views = []
    for file in sorted((share / "data/demo/images").glob("*.png")):
        seen = vision.find_target(vision.load_image(str(file)), target)
        views.append(kr5.View(name=file.name, points=seen.view.points, pixels=seen.view.pixels, ids=seen.view.ids))
    options = vision.CameraOptions(lens="brown4", square_pixels=False, bent_target=False, folds=0)
    result = vision.calibrate_camera(views, truth["width"], truth["height"], options)
    assert not [v.name for v in result.views if v.outlier]
    assert max(np.abs(v.residuals).max() for v in result.views) < 0.1  # [px]
    names = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
    error = np.array([getattr(result.camera, n) - truth[n] for n in names])
    covariance = np.asarray(result.covariance)[:8, :8]
    assert (np.abs(error) < 3.3 * np.sqrt(np.diag(covariance))).all()  # 99.9 % each
