"""`kr5 detect` and the Python surface of detection."""

import json
from pathlib import Path

import kr5
import numpy as np
import pytest
from kr5 import vision

from command_runner import run_command


def run(*words):
    return run_command("detect", *words, cwd=Path.cwd())


@pytest.fixture
def picture(tmp_path):
    """A rendered tag, its camera file, and the truth."""
    camera = kr5.Pinhole(width=640, height=480, fx=600, fy=600, cx=319.5, cy=239.5)
    target = kr5.parse_target("tag:36h11:10:0.05")
    T = np.eye(4)
    T[:3, 3] = 0.01, 0.02, 0.3
    file = tmp_path / "tag.png"
    vision.save_image(vision.render([vision.PlacedTarget(target=target, T_camera_target=T)], camera), str(file))
    (tmp_path / "camera.yaml").write_text("width: 640\nheight: 480\nfx: 600\nfy: 600\ncx: 319.5\ncy: 239.5\n")
    return file, tmp_path / "camera.yaml", T


def test_python_surface(picture):
    image = vision.load_image(str(picture[0]))
    tags = vision.find_tags(image)
    assert [t.id for t in tags] == [10] and tags[0].corners.shape == (2, 4)
    seen = vision.find_target(image, kr5.parse_target("tag:36h11:10:0.05"))
    assert str(seen.status) == "found"
    with pytest.raises(ValueError):
        vision.find_tags(np.zeros((4, 4, 3), np.uint8))


def test_draws_and_gives_the_pose(picture, tmp_path):
    file, camera, truth = picture
    out = run(
        file,
        "--target",
        "tag:36h11:10:0.05",
        "--camera",
        camera,
        "-o",
        tmp_path / "seen",
        "--json",
        tmp_path / "seen.json",
    )
    assert out.returncode == 0, out.stderr
    assert (tmp_path / "seen" / "tag_seen.png").stat().st_size > 1000
    data = json.loads((tmp_path / "seen.json").read_text())
    assert data["format"] == "kr5-detection/1"
    T = np.array(data["found"][0]["pose"]["T_camera_target"])
    assert np.abs(T[:3, 3] - truth[:3, 3]).max() < 1e-3


def test_drawings_of_images_of_one_name_are_kept_apart(picture, tmp_path):
    image = vision.load_image(str(picture[0]))
    files = [tmp_path / name for name in ("a/1.png", "b/1.png", "b/1.bmp")]
    for file in files:
        file.parent.mkdir(exist_ok=True)
        vision.save_image(image, str(file))
    for given, drawn in (
        (files[:2], {"a/1_seen.png", "b/1_seen.png"}),
        (files[1:], {"1.png_seen.png", "1.bmp_seen.png"}),
    ):
        folder = tmp_path / f"seen{len(drawn)}{len(list(tmp_path.iterdir()))}"
        out = run(*given, "--family", "36h11", "-o", folder, "--json", tmp_path / "seen.json")
        assert out.returncode == 0, out.stderr
        assert {str(f.relative_to(folder)) for f in folder.rglob("*.png")} == drawn
        data = json.loads((tmp_path / "seen.json").read_text())
        assert [Path(v["drawing"]).is_file() for v in data["views"]] == [True, True]
        assert [f["view"] for f in data["found"]] == [v["name"] for v in data["views"]]


def test_says_which_images_failed(picture, tmp_path):
    (tmp_path / "broken.png").write_bytes(b"no image")
    out = run(picture[0], tmp_path / "broken.png", "--family", "36h11")
    assert out.returncode == 0 and "unreadable" in out.stdout


@pytest.mark.parametrize(
    "words, said",
    [
        (["nowhere.png", "--family", "36h11"], "no such file"),
        (["{folder}", "--family", "36h11"], "contains no image"),
        (["{image}", "--family", "36h12"], "36h11"),
        (["{image}", "--target", "chess:6x9:1"], "chessboard:6x9"),
        (["{image}"], "either"),
        (["{image}", "--target", "tag:36h11:11:0.05"], "ids 10"),
    ],
)
def test_what_is_wrong_is_said_with_exit_code_2(picture, tmp_path, words, said):
    (tmp_path / "empty").mkdir()
    out = run(*[w.format(folder=tmp_path / "empty", image=picture[0]) for w in words])
    assert out.returncode == 2 and said in " ".join(out.stderr.split())
