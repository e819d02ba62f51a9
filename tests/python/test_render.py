"""The renderer from Python and from the command line, and targets to print."""

import json
import re

import kr5
import kr5.vision
import numpy as np
import pytest

from command_runner import run_command

CAMERA = {"width": 320, "height": 240, "fx": 300.0, "fy": 300.0, "cx": 159.5, "cy": 119.5}
SCENE = """
camera: {width: 320, height: 240, fx: 300, fy: 300, cx: 159.5, cy: 119.5, k1: -0.1}
targets:
- {target: "chessboard:3x4:0.03", T_camera_target: [-0.04, -0.03, 0.4, 0.2, 0.1, 0.1]}
options: {blur: 0.7, noise: 2, seed: 4}
"""


def square_on(z):
    T = np.eye(4)
    T[2, 3] = z
    return T


def test_an_image_is_an_array_and_agrees_with_its_truth():
    target, camera = kr5.parse_target("chessboard:3x4:0.03"), kr5.Pinhole(**CAMERA)
    image = kr5.vision.render([kr5.vision.PlacedTarget(target=target, T_camera_target=square_on(0.4))], camera)
    assert image.shape == (240, 320) and image.dtype == np.uint8
    truth = kr5.vision.visible_points(target, square_on(0.4), camera)
    assert truth.ids == list(range(12))
    u, v = np.round(truth.pixels[:, 5]).astype(int)  # an inner corner: black and white across from each other
    assert image[v - 5, u - 5] == image[v + 5, u + 5] != image[v - 5, u + 5] == image[v + 5, u - 5]


def test_options_are_keywords_and_checked():
    options = kr5.vision.RenderOptions(noise=3.0, seed=7)
    assert options.noise == 3.0 and "[px]" in kr5.vision.RenderOptions.blur.__doc__
    camera = kr5.Pinhole(**CAMERA)
    assert (kr5.vision.render([], camera, options) == kr5.vision.render([], camera, options)).all()
    with pytest.raises(kr5.InvalidArgument, match="noise"):
        kr5.vision.render([], camera, kr5.vision.RenderOptions(noise=-1.0))


def test_an_image_goes_to_a_file_and_back(tmp_path):
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)
    kr5.vision.save_image(image, str(tmp_path / "a.png"))
    assert (kr5.vision.load_image(str(tmp_path / "a.png")) == image).all()
    with pytest.raises(kr5.IoError, match="none.png"):
        kr5.vision.load_image(str(tmp_path / "none.png"))
    with pytest.raises(ValueError, match="grey"):
        kr5.vision.save_image(np.zeros((3, 4, 3), np.uint8), str(tmp_path / "a.png"))


def test_kr5_render_writes_image_and_truth(tmp_path):
    (tmp_path / "scene.yaml").write_text(SCENE)
    done = run_command("render", "scene.yaml", "-o", "view.png", "--truth", "view.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert kr5.vision.load_image(str(tmp_path / "view.png")).shape == (240, 320)
    assert len(json.loads((tmp_path / "view.json").read_text())[0]["ids"]) == 12


@pytest.mark.parametrize(
    "old,new,complaint",
    [
        ("width:", "widht:", "width"),
        ("chessboard:3x4", "chess:3x4", "chess:3x4"),
        ("0.2, 0.1, 0.1]", "0.2]", "T_camera_target"),
        ("targets:", "boards:", "targets"),
        ("blur: 0.7", "blur: -1", "blur"),
        ("options:", "opitons:", "opitons"),
    ],
)
def test_a_bad_scene_is_refused(tmp_path, old, new, complaint):
    assert old in SCENE
    (tmp_path / "scene.yaml").write_text(SCENE.replace(old, new))
    done = run_command("render", "scene.yaml", "-o", "view.png", cwd=tmp_path)
    assert done.returncode == 2 and complaint in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "view.png").exists()


def test_a_target_is_printed_to_scale(tmp_path):
    done = run_command(
        "target", "print", "--target", "chessboard:3x4:0.0254", "-o", "board.png", "--dpi", 200, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    image = kr5.vision.load_image(str(tmp_path / "board.png"))
    edges = np.flatnonzero(np.diff((image[200] < 128).astype(int)))  # along the first row of squares: 5 of one inch
    assert np.abs(np.diff(edges) - 200).max() <= 1 and len(edges) == 6
    done = run_command("target", "print", "--target", "chessboard:3x4:0.0254", "-o", "board.pdf", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")


def dark_runs(line):
    """First and last pixel of every dark stretch."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (line < 128).astype(int), [0]])))
    return edges[::2], edges[1::2]


@pytest.mark.parametrize(
    "paper,size", [("a4", (297.0, 210.0)), ("letter", (279.4, 215.9)), ("260x220", (260.0, 220.0))]
)
def test_a_target_is_printed_on_a_sheet_of_paper_with_a_ruler_of_100_mm(tmp_path, paper, size):
    board = "chessboard:5x8:0.025"
    done = run_command(
        "target", "print", "--target", board, "--paper", paper, "-o", "b.png", "--dpi", 254, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert "landscape" in done.stdout and "100 %" in done.stdout
    image = kr5.vision.load_image(str(tmp_path / "b.png"))
    assert np.abs(np.array(image.shape[::-1]) / 10 - size).max() <= 0.1  # ten pixels a millimetre
    dark = np.flatnonzero((image < 128).any(axis=1))
    first, last = dark_runs(image[dark[0] + 100])
    assert len(first) == 5 and np.abs(np.diff(first) - 500).max() <= 1 and np.abs(last - first - 250).max() <= 1
    rulers = [dark_runs(row) for row in image[dark[0] + 1500 :]]  # the line is the longest dark stretch below the board
    assert max((last - first).max(initial=0) for first, last in rulers) == pytest.approx(1000, abs=8)
    columns = np.flatnonzero((image < 128).any(axis=0))
    edges = (columns[0], dark[0], image.shape[1] - columns[-1], image.shape[0] - dark[-1])
    assert min(edges) >= 50  # what printers leave blank


def test_the_example_of_the_help_fits_on_a4(tmp_path):
    text = " ".join(run_command("target", "print", "--help", cwd=tmp_path).stdout.split())
    words = text.split("Example: kr5 ")[1].split()
    assert "a4" in words
    done = run_command(*words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "board.pdf").read_bytes()
    (box,) = re.findall(rb"/MediaBox \[([^\]]*)\]", page)
    assert [float(v) for v in box.split()] == pytest.approx([0, 0, 297 * 72 / 25.4, 210 * 72 / 25.4], abs=0.1)


@pytest.mark.parametrize(
    "words,complaint",
    [
        (["chessboard:6x9:0.025", "--paper", "a4"], "the largest that fits is chessboard:6x9:0.0235; or --paper"),
        (["chessboard:5x8:0.025", "--paper", "a4", "--orientation", "portrait"], "more than a4 portrait has"),
        (["grid:36h11:5x7:0.04:0.01", "--paper", "letter"], "grid:36h11:5x7:0.0"),
        (["chessboard:5x8:0.025", "--paper", "b4"], "--paper: found 'b4', expected one of a2"),
        (["chessboard:5x8:0.025", "--paper", "20x30"], "from 40 to 5000 mm"),
        (["chessboard:5x8:0.025", "--orientation", "landscape"], "--orientation"),
    ],
)
def test_a_target_that_does_not_fit_is_refused_with_the_largest_that_does(tmp_path, words, complaint):
    done = run_command("target", "print", "--target", *words, "-o", "b.png", cwd=tmp_path)
    assert done.returncode == 2 and complaint in " ".join(done.stderr.split()) and "Traceback" not in done.stderr
    assert not (tmp_path / "b.png").exists()
    if "the largest that fits is " in done.stderr:
        smaller = done.stderr.split("the largest that fits is ")[1].split(";")[0].strip()
        again = run_command(
            "target", "print", "--target", smaller, *words[1:], "-o", "b.png", "--dpi", 50, cwd=tmp_path
        )
        assert again.returncode == 0, again.stderr
    if proposed := re.search(r"or --paper (\w+)", " ".join(done.stderr.split())):
        orientation = words[words.index("--orientation") :] if "--orientation" in words else []
        on = ("--paper", proposed[1], *orientation, "-o", "b.png", "--dpi", 50)
        again = run_command("target", "print", "--target", words[0], *on, cwd=tmp_path)
        assert again.returncode == 0, again.stderr


@pytest.mark.parametrize(
    "board,file",
    [
        ("chessboard:3x4", "b.png"),
        ("chessboard:3x4:0.02", "b.gif"),
        ("none.yaml", "b.png"),
        ("chessboard:3x4:0.02", "no/such/b.png"),
    ],
)
def test_a_target_that_cannot_be_printed_is_named(tmp_path, board, file):
    done = run_command("target", "print", "--target", board, "-o", file, cwd=tmp_path)
    assert done.returncode == 2 and "Traceback" not in done.stderr and (board in done.stderr or file in done.stderr)
