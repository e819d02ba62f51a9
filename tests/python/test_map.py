"""`kr5 calibrate map`: markers in space from rendered images whose truth is known, and input that cannot work."""

import json

import kr5
import numpy as np
import pytest
from kr5 import cell, vision
from kr5.files.paths import find_shipped_cell

LENS = {"width": 1280, "height": 960, "fx": 1100, "fy": 1100, "cx": 639.5, "cy": 479.5}
SIZE = 0.05
MARKERS = {2: np.eye(4), 5: kr5.to_pose([0.10, 0.01, 0.03, 0, 0.8, 0]), 7: kr5.to_pose([-0.10, 0, 0.03, 0, -0.7, 0])}


@pytest.fixture
def photos(tmp_path):
    """Six images of three markers that do not lie on one plane, and the camera's file beside them."""
    markers = [kr5.MapMarker(id=i, size=SIZE, T_target_marker=T) for i, T in MARKERS.items()]
    target = kr5.Target(kind="marker_map", map=markers)
    (tmp_path / "photos").mkdir()
    random = np.random.default_rng(5)
    for k in range(6):
        T = kr5.to_pose(np.concatenate([[0, 0, 0.45], random.uniform(-0.4, 0.4, 3)]))
        placed = vision.PlacedTarget(target=target, T_camera_target=T)
        image = vision.render([placed], kr5.Pinhole(**LENS), vision.RenderOptions(blur=0.7, noise=2, seed=k))
        vision.save_image(image, str(tmp_path / "photos" / f"{k}.png"))
    (tmp_path / "camera.yaml").write_text(json.dumps(LENS))
    return tmp_path / "photos"


def make_map(run_kr5, *args):
    return run_kr5("calibrate", "map", *args, "--camera", "camera.yaml", "-o", "map.json")


def test_map_of_markers_lies_at_the_truth_and_its_page_shows_it(tmp_path, run_kr5, photos):
    done = make_map(run_kr5, photos, "--size", SIZE)
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "map.json").read_text())
    assert data["format"] == "kr5-marker-map/1" and data["verdict"]["word"] == "good"
    assert {"figures", "views", "residuals", "frames", "image_size", "result", "input"} <= data.keys()
    covariances = data["result"]["covariance"]
    for marker, covariance in zip(data["result"]["target"]["map"], covariances):
        d = kr5.pose_difference(np.array(marker["T_target_marker"]), MARKERS[marker["id"]])
        std = np.sqrt(np.diag(covariance))
        assert np.all(np.abs(d) < 5 * std + 1e-9), (marker["id"], d / np.maximum(std, 1e-12))
    residuals = np.hstack([np.array([r["du"], r["dv"]]) for r in data["residuals"]])
    assert np.sqrt(np.mean(residuals**2)) < 0.1
    done = run_kr5("report", "map.json", "-o", "map.html")
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "map.html").read_text()
    assert "Marker map" in page and "marker 5" in page
    done = run_kr5("detect", photos, "--target", "map.json", "--camera", "camera.yaml", "--json", "-")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["found"]
    assert len(found) == 6 and all(f["what"] == "marker_map" and f["rms_px"] < 0.2 for f in found)


def test_the_map_goes_into_the_cell_that_says_where_it_stands(tmp_path, run_kr5, photos):
    believed = cell.load_cell(find_shipped_cell())
    T_base_map = kr5.to_pose([0.7, 0.1, 0.2, 0, 0, 0.3])
    cell.save_cell(believed, tmp_path / "without.yaml")
    rough = [kr5.MapMarker(id=i, size=SIZE, T_target_marker=np.eye(4)) for i in MARKERS]
    believed.targets = [cell.Target(name="rig", kind="marker_map", map=rough, T_base_target=T_base_map)]
    cell.save_cell(believed, tmp_path / "cell.yaml")
    command = (photos, "--size", SIZE, "--write-cell", "new.yaml", "--cell")
    done = make_map(run_kr5, *command, "cell.yaml")
    assert done.returncode == 0, done.stderr
    (found,) = cell.load_cell(tmp_path / "new.yaml").targets
    assert found.name == "rig" and np.allclose(found.T_base_target, T_base_map)
    assert [m.id for m in found.map] == sorted(MARKERS)
    for marker in found.map:
        assert np.linalg.norm(kr5.pose_difference(marker.T_target_marker, MARKERS[marker.id])) < 5e-3
    (tmp_path / "new.yaml").unlink()
    done = make_map(run_kr5, *command, "without.yaml")
    assert done.returncode == 2 and "0 targets of the kind marker_map, expected one" in done.stderr
    assert not (tmp_path / "new.yaml").exists()


def test_images_of_two_sizes_are_refused_also_where_the_camera_says_none(tmp_path, run_kr5, photos):
    (tmp_path / "camera.yaml").write_text(json.dumps({k: v for k, v in LENS.items() if k not in ("width", "height")}))
    vision.save_image(np.full((480, 640), 128, np.uint8), str(photos / "9.png"))
    done = make_map(run_kr5, photos, "--size", SIZE)
    assert (
        done.returncode == 2
        and "is a camera of 1280 x 960 px" in done.stderr
        and "9.png has 640 x 480 px" in done.stderr
    )
    assert not (tmp_path / "map.json").exists()


@pytest.mark.parametrize(
    "args, words",
    [
        (("--size", "0"), ["size", "[m]"]),
        (("--size", "0.05", "--family", "25h9"), ["no marker of 25h9", "kr5 detect"]),
        (("--size", "0.05", "--reference", "40"), ["40"]),
        (("--size", "0.05", "--family", "nonsense"), ["nonsense"]),
    ],
)
def test_input_that_gives_no_map_is_refused_and_writes_nothing(tmp_path, run_kr5, photos, args, words):
    (tmp_path / "map.json").write_text("precious")
    done = make_map(run_kr5, photos, *args)
    assert done.returncode == 2, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in " ".join(done.stderr.split())
    assert (tmp_path / "map.json").read_text() == "precious"
