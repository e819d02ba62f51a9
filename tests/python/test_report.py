"""`kr5 report` on every type of result, in a headless Chromium at desktop and phone width."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from kr5 import vision

from command_runner import run_command
from test_tool import streams, write_stream

DATA = Path(__file__).parent / "data"
RESULTS = ("camera", "detection", "hand_eye", "marker_map", "timed", "tool")


@pytest.fixture(scope="module")
def pages(tmp_path_factory, share):
    """A result of every type and its page, by name: what quick commands write, and what slow ones wrote."""
    folder = tmp_path_factory.mktemp("pages")
    for file in DATA.glob("*.json"):
        shutil.copy(file, folder)
    th, hands, tc, cameras = streams(noise=3e-4)
    write_stream(folder / "hand.csv", th, hands)
    write_stream(folder / "camera.csv", tc, cameras)
    vision.save_image(np.full((720, 960), 128, np.uint8), str(folder / "empty.png"))
    demo = share / "data/demo"
    seen = [*(demo / f"images/view_0{i}.png" for i in (1, 2, 3)), "empty.png"]
    for command in (
        ["calibrate", "tool", share / "data/touches", "-o", "tool.json"],
        ["calibrate", "timed", "hand.csv", "camera.csv", "-o", "timed.json"],
        [
            "detect",
            *seen,
            "--target",
            "grid:36h11:5x7:0.03:0.01",
            "--camera",
            demo / "camera.yaml",
            "-o",
            "seen",
            "--json",
            "detection.json",
        ],
        *(["report", f"{name}.json", "-o", f"{name}.html", "--png", f"{name}-png"] for name in RESULTS),
    ):
        done = run_command(*command, cwd=folder)
        assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("name", RESULTS)
def test_a_page_opens_without_complaint_and_fits_the_width(pages, browser, name, width):
    browser.open_whole(pages / f"{name}.html", width)


def test_the_frames_are_drawn_and_turn_with_the_mouse(pages, browser):
    browser.open(pages / "hand_eye.html", 1280)
    picture = "document.getElementById('scene').toDataURL()"
    before = browser.evaluate(picture)
    browser.evaluate("document.getElementById('scene').scrollIntoView({block: 'center'})")
    x, y = browser.evaluate(
        "(b => [b.x + b.width / 2, b.y + b.height / 2])(document.getElementById('scene').getBoundingClientRect())"
    )
    for kind, dx in (("mousePressed", 0), ("mouseMoved", 90), ("mouseReleased", 90)):
        browser.call("Input.dispatchMouseEvent", type=kind, x=x + dx, y=y, button="left", buttons=1, clickCount=1)
    turned = browser.evaluate(picture)
    assert len(before) > 5000 and turned != before
    browser.evaluate("document.getElementById('scene').dispatchEvent(new MouseEvent('dblclick'))")
    assert browser.evaluate(picture) == before
    assert browser.complaints() == []


def test_a_page_says_what_the_file_says(pages):
    page = (pages / "hand_eye.html").read_text()
    for text in (
        "Doubtful.",
        "view_07.png",
        "98 % sure",
        "± 0.061",
        "30.021",
        "outlier",
        "kr5 calibrate hand-eye cell",
        "with kr5 0.1.0",
    ):
        assert text in page
    assert len(page) < 3_000_000
    assert "http://" not in page.replace("http://www.w3.org", "") and "https://" not in page


@pytest.mark.parametrize(
    "name,plots",
    [
        (
            "hand_eye",
            {"views", "robot_position", "robot_rotation", "residual_field", "residual_cloud", "correlation", "frames"},
        ),
        ("camera", {"views", "residual_field", "residual_cloud", "coverage", "correlation", "models"}),
        ("tool", {"touches", "correlation", "frames"}),
        ("timed", {"alignment", "correlation", "frames"}),
        ("marker_map", {"views", "residual_field", "residual_cloud", "frames"}),
        ("detection", {"views"}),
    ],
)
def test_every_plot_is_written_as_png(pages, name, plots):
    files = {f.stem: f for f in (pages / f"{name}-png").glob("*.png")}
    assert set(files) == plots
    assert all(f.read_bytes().startswith(b"\x89PNG") for f in files.values())


def test_a_page_of_a_detection_shows_every_image_with_what_was_seen_in_it(pages):
    data = json.loads((pages / "detection.json").read_text())
    assert len(data["views"]) == 4 and len(data["found"]) == 3
    page = (pages / "detection.html").read_text()
    assert page.count("data:image/jpeg") == 4  # three drawings and the image in which nothing is
    for item in data["found"]:
        row = next(
            line for line in page.splitlines() if f'<th scope="row">{item["view"]}</th><td>tag_grid</td>' in line
        )
        noise = np.median([s for s in item["sigma"] if s > 0])
        for text in (
            f"{len(item['ids'])} points, numbers {min(item['ids'])} to {max(item['ids'])}",
            f"<td>{noise:.3f}</td>",
            f"<td>{item['rms_px']:.3f}</td>",
            "ambiguous" if item["pose"]["ambiguous"] else "clear",
        ):
            assert text in row
        assert f'<th scope="row">{item["view"]} tag_grid</th>' in page  # its pose
    assert data["not_found"][0]["message"][:20] in page


def test_a_drawing_that_is_gone_is_replaced_by_the_image_with_its_points(pages, tmp_path):
    data = json.loads((pages / "detection.json").read_text())
    data["views"][0]["drawing"] = str(tmp_path / "gone.png")
    (tmp_path / "r.json").write_text(json.dumps(data))
    assert run_command("report", "r.json", cwd=tmp_path).returncode == 0
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/jpeg") == 4
    assert page.count("<circle") == min(len(data["found"][0]["ids"]), 150)


def test_thumbnails_are_shown_when_the_images_are_there(tmp_path):
    from PIL import Image

    data = json.loads((DATA / "hand_eye.json").read_text())
    Image.new("L", (1280, 960), 128).save(tmp_path / "a.png")
    data["views"][0]["image"] = "a.png"
    data["views"][1]["image"] = "gone.png"
    (tmp_path / "r.json").write_text(json.dumps(data))
    assert run_command("report", "r.json", cwd=tmp_path).returncode == 0
    assert (tmp_path / "report.html").read_text().count("data:image/jpeg") == 1


def test_text_from_the_file_cannot_become_markup(tmp_path):
    data = {
        "format": "kr5-detection/1",
        "verdict": {"word": "good", "text": "<script>alert(1)</script>"},
        "frames": [
            {"name": "</script><b>", "parent": None, "T": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}
        ],
    }
    (tmp_path / "r.json").write_text(json.dumps(data))
    assert run_command("report", "r.json", cwd=tmp_path).returncode == 0
    page = (tmp_path / "report.html").read_text()
    assert "<script>alert" not in page and "</script><b>" not in page


@pytest.mark.parametrize(
    "content,complaint",
    [
        ("not json", "is not valid JSON"),
        ('{"format": "kr5-other/1"}', "kr5-other/1"),
        ("[1, 2]", "format"),
        ('{"format": "kr5-camera/1", "views": 3}', "views: found 3, expected a list"),
        ('{"format": "kr5-camera/1", "views": [{"name": "a", "rms_px": "bad"}]}', "views[0].rms_px"),
        ('{"format": "kr5-camera/1", "figures": [{"name": "fx"}]}', "figures[0].unit"),
        ('{"format": "kr5-camera/1", "residuals": [{"u": [1], "v": [1, 2], "du": [0], "dv": [0]}]}', "residuals[0]"),
        ('{"format": "kr5-camera/1", "residuals": [{"u": ["x"], "v": [1], "du": [0], "dv": [0]}]}', "r.json"),
        ('{"format": "kr5-camera/1", "frames": [{"name": "a", "T": [[1]]}]}', "frames[0].T"),
        ('{"format": "kr5-camera/1", "verdict": {"word": "fine", "text": ""}}', "verdict.word"),
        (
            (
                '{"format": "kr5-detection/1", "found": [{"view": "a", "what": "tag", "ids": [1], "sigma": [],'
                ' "pixels": [[1], []]}]}'
            ),
            "expected pixels: u and v of 1 points",
        ),
        (
            (
                '{"format": "kr5-detection/1", "found": [{"view": "a", "what": "tag", "ids": [1], "sigma": ["x"],'
                ' "pixels": [[1], [2]]}]}'
            ),
            "found[0].sigma[0]: found 'x', expected a number",
        ),
        (
            (
                '{"format": "kr5-detection/1", "found": [{"view": "a", "what": "t", "ids": [1], "sigma": [1], "pixels":'
                ' [[1], [2]], "pose": {"x": 1}}]}'
            ),
            "is not a valid result file",
        ),
        ('{"format": "kr5-detection/1", "not_found": [{"view": "a"}]}', "not_found[0].message"),
    ],
)
def test_a_bad_result_file_is_refused_and_the_old_page_kept(tmp_path, content, complaint):
    (tmp_path / "r.json").write_text(content)
    (tmp_path / "report.html").write_text("old")
    done = run_command("report", "r.json", cwd=tmp_path)
    assert done.returncode == 2
    assert complaint in done.stderr and "r.json" in done.stderr and "Traceback" not in done.stderr
    assert (tmp_path / "report.html").read_text() == "old"


def test_a_figure_with_its_cause_corrected_stands_beside_it(tmp_path, browser):
    data = json.loads((DATA / "hand_eye.json").read_text())
    data["figures"][0]["corrected"] = [-85.9123, 0.7123]
    (tmp_path / "r.json").write_text(json.dumps(data))
    assert run_command("report", "r.json", cwd=tmp_path).returncode == 0
    page = (tmp_path / "report.html").read_text()
    assert "<td>-85.91 ± 0.71</td>" in page and "with the first cause corrected" in page
    browser.open_whole(tmp_path / "report.html", 390)
    data["figures"][0]["corrected"] = [1.0]
    (tmp_path / "r.json").write_text(json.dumps(data))
    done = run_command("report", "r.json", cwd=tmp_path)
    assert done.returncode == 2 and "figures[0].corrected" in done.stderr


def test_a_missing_file_or_folder_is_named(tmp_path):
    done = run_command("report", "none.json", cwd=tmp_path)
    assert done.returncode == 2 and "none.json" in done.stderr
    done = run_command("report", DATA / "camera.json", "-o", "no/such/folder.html", cwd=tmp_path)
    assert done.returncode == 2 and "folder" in done.stderr
