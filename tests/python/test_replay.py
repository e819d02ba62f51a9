"""`kr5 replay`: the page in a headless Chromium, and what it refuses."""

import importlib.util
import json

import kr5.cell
import numpy as np
import pytest
import yaml

START = [0.0, -0.3, -1.9, 0.1, 0.5, 0.2]


@pytest.fixture
def recording(share, tmp_path):
    """Ten rows of motion, three poses and a step of the shipped cell."""
    folder = tmp_path / "monday"
    folder.mkdir()
    (folder / "cell.yaml").write_text((share / "cells" / "kr5_arc.yaml").read_text())
    joints = ",".join(f"qc{i}" for i in range(1, 7)) + "," + ",".join(f"q{i}" for i in range(1, 7))
    rows = [[0.012 * k, *([q + 0.02 * k for q in START] * 2)] for k in range(10)]
    (folder / "motion.csv").write_text(f"t,{joints}\n" + "\n".join(",".join(map(str, r)) for r in rows) + "\n")
    head = "pose,t," + ",".join(f"q{i}" for i in range(1, 7)) + ",x,y,z,qw,qx,qy,qz"
    rows = [[k, 5.0 * k, *(q + 0.1 * k for q in START), 0.5, 0, 0.5, 1, 0, 0, 0] for k in range(3)]
    (folder / "poses.csv").write_text(head + "\n" + "\n".join(",".join(map(str, r)) for r in rows) + "\n")
    (folder / "step.csv").write_text("run,t,zc,z\n0,0.0,0.0,0.0\n0,0.012,0.0,0.0\n")
    return folder


def describe(folder, *kinds):
    experiments = [{"name": f"{k}-1", "kind": k, "file": f"{k}.csv", "split": "fit"} for k in kinds]
    (folder / "recording.yaml").write_text(
        yaml.safe_dump({"format": "kr5-recording/1", "cell": "cell.yaml", "experiments": experiments})
    )
    return folder


@pytest.mark.parametrize("width", [1280, 390])
def test_the_arm_moves_through_the_recording_without_complaint(recording, run_kr5, browser, tmp_path, width):
    done = run_kr5("replay", describe(recording, "motion", "poses", "step"), "--json", "-")
    assert done.returncode == 0, done.stderr
    runs = json.loads(done.stdout)["runs"]
    assert [r["postures"] for r in runs] == [10, 3]  # steps have no joints
    browser.open_whole(tmp_path / "replay.html", width)
    picture = "document.getElementById('scene').toDataURL()"
    before = browser.evaluate(picture)
    browser.evaluate("(s => { s.value = 0.06; s.dispatchEvent(new Event('input')); })(document.getElementById('time'))")
    assert browser.evaluate(picture) != before
    np.testing.assert_allclose(browser.evaluate("kr5Replay.posture()"), np.array(START) + 0.1, atol=2e-3)
    browser.evaluate("document.getElementById('play').click()")
    browser.evaluate("new Promise(done => setTimeout(done, 400))")
    assert browser.evaluate("kr5Replay.time()") == pytest.approx(0.108)
    assert browser.evaluate("document.getElementById('play').textContent") == "Play"  # it stops at the end
    browser.evaluate("(s => { s.value = 1; s.dispatchEvent(new Event('change')); })(document.getElementById('run'))")
    assert "posture 1 of 3" in browser.evaluate("document.getElementById('told').textContent")
    assert browser.complaints() == []


@pytest.mark.parametrize("name", ["kr5_arc", "gantry_rrp"])
def test_the_page_places_the_links_where_the_library_does(share, run_kr5, browser, tmp_path, name):
    file = share / "cells" / f"{name}.yaml"
    assert run_kr5("replay", file).returncode == 0
    browser.open(tmp_path / "replay.html", 1280)
    cell = kr5.cell.load_cell(file)
    q = list(np.random.default_rng(1).normal(0, 1, cell.robot.joints))
    seen = np.array(browser.evaluate(f"kr5Replay.links({json.dumps(q)})"))
    np.testing.assert_allclose(seen[1:], cell.link_poses(q), atol=1e-12)
    assert browser.complaints() == []


@pytest.mark.parametrize("name", ["</script><script>document.title='taken'</script>", "<!--<script>", "a\u2028b"])
def test_a_name_in_a_recording_ends_no_script(recording, run_kr5, browser, tmp_path, name):
    file = describe(recording, "motion", "poses") / "recording.yaml"
    data = yaml.safe_load(file.read_text())
    data["experiments"][0]["name"] = name
    file.write_text(yaml.safe_dump(data))
    done = run_kr5("replay", recording)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "replay.html").read_text()
    begin = page.index('<script id="replay-data"')
    shown = page[page.index(">", begin) + 1 : page.index("</script", begin)]
    assert json.loads(shown)["runs"][0]["name"] == f"{name} (motion)"
    browser.open_whole(tmp_path / "replay.html", 1280)
    assert browser.evaluate("document.title") != "taken"
    assert browser.evaluate("document.getElementById('run').options[0].textContent") == f"{name} (motion)"
    assert browser.complaints() == []


def test_what_cannot_be_shown_is_refused(recording, run_kr5, tmp_path):
    done = run_kr5("replay", describe(recording, "step"))
    assert done.returncode == 2 and "q1..q6" in done.stderr and "Traceback" not in done.stderr
    (tmp_path / "empty").mkdir()
    done = run_kr5("replay", tmp_path / "empty")
    assert done.returncode == 2 and "recording.yaml" in done.stderr
    done = run_kr5("replay", tmp_path / "none.yaml")
    assert done.returncode == 2 and "none.yaml" in done.stderr
    assert not (tmp_path / "replay.html").exists()


class FakeRerun:
    """Notes what a Rerun recording is given."""

    def __init__(self):
        self.logged, self.saved, self.t = [], None, None

    def RecordingStream(self, name):
        return self

    def save(self, file):
        self.saved = file

    def set_time(self, name, duration):
        self.t = duration

    def log(self, path, value, static):
        if value is not None:
            self.logged.append((path, None if static else self.t, value))

    def flush(self):
        pass

    @staticmethod
    def Scalars(value):
        return value

    @staticmethod
    def TransformAxes3D(length):
        return None

    @staticmethod
    def Transform3D(translation, mat3x3):
        return np.vstack([np.column_stack([mat3x3, translation]), [0, 0, 0, 1]])


def test_a_rerun_recording_holds_poses_of_links_and_columns_over_time(recording):
    from kr5_tools.replay import command, rerun_log

    data = kr5.cell.load_recording(describe(recording, "motion"))
    runs, sdk = command.recorded_runs(data, data.cell, 100), FakeRerun()
    rerun_log.write_log(rerun_log.log_entries(data.cell, runs, [data.experiments[0].data]), "out.rrd", sdk)
    assert sdk.saved == "out.rrd"
    poses = [entry for entry in sdk.logged if entry[0] == "motion-1_(motion)/link_6"]
    assert [t for _, t, _ in poses] == pytest.approx([0.012 * k for k in range(10)])
    np.testing.assert_allclose(poses[3][2], data.cell.link_poses(np.array(START) + 0.06)[5], atol=1e-5)
    column = [value for path, _, value in sdk.logged if path.endswith("/columns/q2")]
    assert column == pytest.approx([START[1] + 0.02 * k for k in range(10)])
    assert [t for path, t, _ in sdk.logged if path == "cell/T_tube"] == [None]


def test_without_the_extra_a_rerun_recording_is_refused_with_the_remedy(recording, run_kr5, tmp_path):
    if importlib.util.find_spec("rerun"):
        assert run_kr5("replay", describe(recording, "motion"), "--rerun", "out.rrd").returncode == 0
        assert (tmp_path / "out.rrd").stat().st_size > 1000
        return
    done = run_kr5("replay", describe(recording, "motion"), "--rerun", "out.rrd")
    assert done.returncode == 2 and "pip install 'kr5[rerun]'" in done.stderr and "Traceback" not in done.stderr
