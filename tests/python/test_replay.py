"""`kr5 replay`: the page in a headless Chromium, and what it refuses."""

import base64
import importlib.util
import json
import shutil

import kr5.cell
import kr5.gap
import kr5.predict
import numpy as np
import pytest
import yaml

from command_runner import run_command
from kr5_tools.replay.signals import experiment_signals

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
    assert [r["postures"] for r in runs] == [10, 3, 2]
    browser.open_whole(tmp_path / "replay.html", width)
    picture = "document.getElementById('scene').toDataURL()"
    before = browser.evaluate(picture)
    set_time(browser, 0.06)
    assert browser.evaluate(picture) != before
    np.testing.assert_allclose(browser.evaluate("kr5Replay.posture()"), np.array(START) + 0.1, atol=2e-3)
    browser.evaluate("document.getElementById('play').click()")
    browser.evaluate("new Promise(done => setTimeout(done, 400))")
    assert browser.evaluate("kr5Replay.time()") == pytest.approx(0.108)
    assert browser.evaluate("document.getElementById('play').textContent") == "Play"  # it stops at the end
    choose_run(browser, 1)
    assert "posture 1 of 3" in browser.evaluate("document.getElementById('told').textContent")
    assert browser.complaints() == []


def set_time(browser, time):
    browser.evaluate(
        f"(s => {{ s.value = {time}; s.dispatchEvent(new Event('input')); }})(document.getElementById('time'))"
    )


def choose_run(browser, index):
    browser.evaluate(
        f"(s => {{ s.value = {index}; s.dispatchEvent(new Event('change')); }})(document.getElementById('run'))"
    )


@pytest.fixture(scope="module")
def simulated(tmp_path_factory, share):
    """A recording of every kind of experiment, of a cell with friction; it holds the nominal cell."""
    folder = tmp_path_factory.mktemp("simulated")
    protocol = {
        "format": "kr5-protocol/1",
        "home": [0.0, 0.02, -2.75, 0.0, -0.3, 1.571],
        "experiments": [
            {"name": "swing", "kind": "motion", "split": "fit", "signal": "fourier", "duration": 4.0, "base": 0.5},
            {"name": "still", "kind": "poses", "split": "fit", "count": 12},
            {"name": "look", "kind": "views", "split": "fit", "count": 5},
            {"name": "sweep", "kind": "scan", "split": "fit", "passes": 1, "lines": 5},
            {"name": "jump", "kind": "step", "split": "fit", "duration": 2.0},
            {"name": "push", "kind": "press", "split": "fit", "speeds": [0.002, 0.001]},
            {"name": "roll", "kind": "profile", "split": "fit", "rows": 200},
        ],
    }
    (folder / "protocol.yaml").write_text(yaml.safe_dump(protocol))
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    kr5.cell.save_cell(cell, folder / "nominal.yaml")
    cell.set_effect("coulomb_friction", "joint5", "coulomb", 6.0)
    kr5.cell.save_cell(cell, folder / "worn.yaml")
    command = ["record", "--cell", "worn.yaml", "--protocol", "protocol.yaml", "-o", "monday", "--nominal"]
    done = run_command(*command, cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def page_data(page):
    text = page.read_text()
    begin = text.index('<script id="replay-data"')
    return json.loads(text[text.index(">", begin) + 1 : text.index("</script", begin)])


def unpack(packed):
    codes = np.frombuffer(base64.b64decode(packed["data"]), "<u2").astype(float)
    codes[codes == 65535] = np.nan
    return packed["low"] + packed["step"] * codes


def test_every_kind_of_experiment_is_shown_with_recorded_and_simulated_signals(simulated, run_kr5, tmp_path):
    done = run_kr5("replay", simulated / "monday", "--json", "-")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert [r["name"] for r in found["runs"]] == [
        "swing (motion)",
        "still (poses)",
        "look (views)",
        "sweep (scan)",
        "jump (step), run 1 of 2",
        "jump (step), run 2 of 2",
        "push (press), run 1 of 2",
        "push (press), run 2 of 2",
        "roll (profile), run 1 of 3",
        "roll (profile), run 2 of 3",
        "roll (profile), run 3 of 3",
    ]
    assert found["skipped"] == []
    shown = {r["name"]: r for r in page_data(tmp_path / "replay.html")["runs"]}
    for run in shown.values():
        compared = [s for s in run["signals"] if "residual" in s]
        assert compared and (run["q"] is None) == (run["peg"] is not None)
    assert [s["name"] for s in shown["still (poses)"]["signals"]] == ["x", "y", "z", "rx", "ry", "rz"]
    swing = {s["name"]: s for s in shown["swing (motion)"]["signals"]}
    assert {"qc1", "q6", "i1", "fz"} <= set(swing) and "recorded" not in swing["qc1"]


def test_residuals_are_those_of_the_library(simulated, run_kr5, tmp_path):
    assert run_kr5("replay", simulated / "monday").returncode == 0
    recording = kr5.cell.load_recording(simulated / "monday")
    columns = kr5.gap.residual_columns(recording, kr5.predict.FastSimulator())
    wanted = {(c.experiment, c.column): np.asarray(c.residuals)[:, 0] for c in columns}
    compared = 0
    for run in page_data(tmp_path / "replay.html")["runs"]:
        experiment = run["name"].split(" (")[0]
        for signal in run["signals"]:
            rows = wanted.get((experiment, signal["name"]))
            if rows is None or ", run" in run["name"] or len(rows) > 2000:
                continue
            shown = unpack(signal["residual"])
            both = np.isfinite(rows) & np.isfinite(shown)  # the library leaves out spikes
            assert both.sum() > 0.95 * len(rows)
            np.testing.assert_allclose(shown[both], rows[both], atol=2 * signal["residual"]["step"] + 1e-6)
            compared += 1
    assert compared > 20


def test_a_joint_with_noise_of_its_own_has_a_residual_in_units_of_it(simulated, run_kr5, tmp_path):
    """As in the cell of a log that was imported with a model: no noise that all joints share."""
    folder = tmp_path / "own"
    shutil.copytree(simulated / "monday", folder)
    recording = kr5.cell.load_recording(folder)
    shared = recording.cell.noise.current
    file = folder / "cell.yaml"
    content = yaml.safe_load(file.read_text())
    content["noise"] |= {"current": 0.0, "joint_current": [shared * (k + 1) for k in range(6)]}
    file.write_text(yaml.safe_dump(content))
    x = np.arange(len(recording.experiments[0].data), dtype=float)
    rows = np.arange(len(x))

    def residuals(recording):
        experiment = recording.experiments[0]
        predicted = kr5.predict.FastSimulator().predict(recording.cell, experiment)
        found = experiment_signals(recording.cell, experiment, x, rows, predicted)
        return {signal.name: signal.residual for signal in found}

    same, own = residuals(recording), residuals(kr5.cell.load_recording(folder))
    for k in range(6):
        np.testing.assert_allclose(own[f"i{k + 1}"] * (k + 1), same[f"i{k + 1}"])
    assert run_kr5("replay", folder).returncode == 0
    swing = page_data(tmp_path / "replay.html")["runs"][0]
    gaps = {s["name"]: s["gap"] for s in swing["signals"]}
    assert all(gaps[f"i{k + 1}"] is not None for k in range(6))


def test_signals_of_a_page_are_thinned_without_losing_a_peak():
    from kr5_tools.replay import signals

    values = np.random.default_rng(1).normal(0, 1, 50_000)
    values[31_415], values[27_182] = 90.0, -80.0
    x = np.arange(50_000) * 0.004
    values[100] = np.nan
    shown = signals.page_signal(signals.Signal("i1", "current", "A", "current", x, residual=values), 500)
    residual, times = unpack(shown["residual"]), unpack(shown["x"])
    assert len(residual) == len(times) <= 502
    assert residual[np.argmin(abs(times - x[31_415]))] == pytest.approx(90.0, abs=0.01)
    assert residual[np.argmin(abs(times - x[27_182]))] == pytest.approx(-80.0, abs=0.01)
    assert (times[0], times[-1]) == (0.0, pytest.approx(x[-1]))
    assert np.isnan(unpack(signals.pack(np.array([np.nan, 1.0, 2.0]))))[0]
    np.testing.assert_array_equal(unpack(signals.pack(np.full(3, 7.0))), [7.0] * 3)


@pytest.mark.parametrize("width", [1400, 390])
def test_one_cursor_follows_the_time_and_can_be_dragged(simulated, run_kr5, browser, tmp_path, width):
    assert run_kr5("replay", simulated / "monday").returncode == 0
    page = tmp_path / "replay.html"
    assert page.stat().st_size < 2_500_000
    browser.open_whole(page, width)
    assert browser.evaluate("document.querySelectorAll('#signals article').length") == 3
    place = "[...document.querySelectorAll('.moment')].map(m => m.getBoundingClientRect().x)"
    set_time(browser, 2.0)
    before = browser.evaluate(place)
    assert len(before) >= 5 and max(before) - min(before) < 1.5  # one line over all plots
    box = "(b => [b.x, b.y, b.width, b.height])(document.querySelector('.u-over').getBoundingClientRect())"
    browser.evaluate("document.querySelector('.u-over').scrollIntoView({block: 'center'})")
    x, y, wide, high = browser.evaluate(box)
    for kind, part in (("mousePressed", 0.5), ("mouseMoved", 0.75), ("mouseReleased", 0.75)):
        browser.call(
            "Input.dispatchMouseEvent",
            type=kind,
            x=x + part * wide,
            y=y + high / 2,
            button="left",
            buttons=1,
            clickCount=1,
        )
    length = page_data(page)["runs"][0]["t"][-1]
    assert browser.evaluate("kr5Replay.time()") == pytest.approx(0.75 * length, abs=0.02 * length)
    assert float(browser.evaluate("document.getElementById('time').value")) == pytest.approx(0.75 * length, abs=0.1)
    assert browser.evaluate(place)[0] == pytest.approx(x + 0.75 * wide, abs=3)
    assert browser.complaints() == []


def test_the_time_can_be_zoomed_and_columns_chosen(simulated, run_kr5, browser, tmp_path):
    assert run_kr5("replay", simulated / "monday").returncode == 0
    browser.open_whole(tmp_path / "replay.html", 1400)
    whole = browser.evaluate("kr5Replay.signals.span()")
    set_time(browser, 1.0)
    browser.evaluate("document.getElementById('zoom-in').click()")
    low, high = browser.evaluate("kr5Replay.signals.span()")
    assert high - low == pytest.approx((whole[1] - whole[0]) / 2) and low < 1.0 < high
    set_time(browser, 3.5)  # the shown part follows the cursor
    low, high = browser.evaluate("kr5Replay.signals.span()")
    assert low <= 3.5 <= high and high - low == pytest.approx((whole[1] - whole[0]) / 2)
    browser.evaluate("document.getElementById('zoom-all').click()")
    assert browser.evaluate("kr5Replay.signals.span()") == whole
    assert "i5" in browser.evaluate("kr5Replay.signals.shown()")  # the widest gaps first: friction of joint 5
    browser.evaluate("document.querySelector('#columns input[value=i2]').click()")
    assert "i2" in browser.evaluate("kr5Replay.signals.shown()")
    values = browser.evaluate("kr5Replay.signals.values('i2')[0]")  # times, recorded, simulated
    recorded = kr5.cell.load_recording(simulated / "monday").experiments[0]
    np.testing.assert_allclose(values[1], recorded["i2"], atol=1e-3)
    assert len(values) == 3 and browser.complaints() == []
    choose_run(browser, 8)
    assert browser.evaluate("kr5Replay.peg().length") == 5 and "mm" in browser.evaluate(
        "document.getElementById('told').textContent"
    )
    assert "qc1" not in browser.evaluate("document.getElementById('columns').textContent")
    assert browser.complaints() == []


def test_a_protocol_is_shown_as_planned(simulated, run_kr5, browser, tmp_path):
    done = run_kr5("replay", simulated / "protocol.yaml", "--cell", simulated / "worn.yaml", "--json", "-")
    assert done.returncode == 0, done.stderr
    assert len(json.loads(done.stdout)["runs"]) == 11
    browser.open_whole(tmp_path / "replay.html", 1400)
    swing = page_data(tmp_path / "replay.html")["runs"][0]
    signals = {s["name"]: s for s in swing["signals"]}
    assert "recorded" not in signals["i5"] and "residual" not in signals["i5"]
    planned = kr5.cell.Experiment(name="swing", kind="motion", file="swing.csv", split="fit")
    planned.data = kr5.cell.load_recording(simulated / "monday").experiments[0].data
    wanted = kr5.predict.FastSimulator().predict(kr5.cell.load_cell(simulated / "worn.yaml"), planned)
    np.testing.assert_allclose(unpack(signals["i5"]["simulated"]), wanted["i5"], atol=1e-3)
    assert browser.complaints() == []


def test_another_cell_is_simulated_where_one_is_named(simulated, run_kr5, tmp_path):
    gaps = {}
    for name in ("nominal", "worn"):
        done = run_kr5("replay", simulated / "monday", "--cell", simulated / f"{name}.yaml")
        assert done.returncode == 0, done.stderr
        run = page_data(tmp_path / "replay.html")["runs"][0]
        gaps[name] = next(s for s in run["signals"] if s["name"] == "i5")
    assert gaps["nominal"]["above"] and gaps["nominal"]["gap"] > 1.5
    assert not gaps["worn"]["above"] and gaps["worn"]["gap"] < 1.2


def without_contact(folder):
    """A press of which forces alone were recorded, and a cell that cannot simulate its height."""
    rows = "".join(f"0,{0.012 * k:.3f},0.002,0,0,23,0,0,0\n" for k in range(5))
    (folder / "press.csv").write_text("run,t,zc,fx,fy,fz,tx,ty,tz\n" + rows)
    cell = yaml.safe_load((folder / "cell.yaml").read_text())
    del cell["contact"]
    (folder / "other.yaml").write_text(yaml.safe_dump(cell))
    return folder / "other.yaml"


def test_what_is_not_shown_is_named_with_the_reason(recording, run_kr5, browser, tmp_path):
    other = without_contact(recording)
    done = run_kr5("replay", describe(recording, "motion", "press"), "--cell", other, "--json", "-")
    assert done.returncode == 0, done.stderr
    (skipped,) = json.loads(done.stdout)["skipped"]
    assert (
        skipped["name"] == "press-1 (press)" and "no column z" in skipped["reason"] and "contact" in skipped["reason"]
    )
    assert "press-1 (press) is not shown" in done.stderr
    browser.open_whole(tmp_path / "replay.html", 1400)
    assert "press-1 (press): no column z" in browser.evaluate("document.querySelector('main').innerText")


def test_what_is_not_simulated_is_shown_as_recorded_with_the_reason(recording, run_kr5, tmp_path):
    cell = yaml.safe_load((recording / "cell.yaml").read_text())
    del cell["servo"]
    (recording / "cell.yaml").write_text(yaml.safe_dump(cell))
    done = run_kr5("replay", describe(recording, "motion"))
    assert done.returncode == 0, done.stderr
    assert "servo.joint" in done.stderr
    (run,) = page_data(tmp_path / "replay.html")["runs"]
    assert "Not simulated" in run["remark"] and "servo.joint" in run["remark"]
    assert all("simulated" not in s for s in run["signals"])


def test_the_theme_of_a_replay_changes_while_it_is_open(simulated, run_kr5, browser, tmp_path):
    assert run_kr5("replay", simulated / "monday").returncode == 0
    browser.open_whole(tmp_path / "replay.html", 1400)
    scene, plot = "document.getElementById('scene').toDataURL()", "document.querySelector('.u-wrap canvas').toDataURL()"
    before = browser.evaluate(scene), browser.evaluate(plot)
    browser.evaluate("document.getElementById('theme').click()")
    after = browser.evaluate(scene), browser.evaluate(plot)
    assert before[0] != after[0] and before[1] != after[1]
    browser.evaluate("document.getElementById('theme').click()")
    assert (browser.evaluate(scene), browser.evaluate(plot)) == before
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
    assert browser.evaluate("document.getElementById('run').options[0].textContent").startswith(f"{name} (motion)")
    assert browser.complaints() == []


def test_what_cannot_be_shown_is_refused(recording, run_kr5, tmp_path, share):
    done = run_kr5("replay", describe(recording, "press"), "--cell", without_contact(recording))
    assert done.returncode == 2 and "press-1 (press): no column z" in done.stderr and "Traceback" not in done.stderr
    (tmp_path / "empty").mkdir()
    done = run_kr5("replay", tmp_path / "empty")
    assert done.returncode == 2 and "recording.yaml" in done.stderr
    done = run_kr5("replay", tmp_path / "none.yaml")
    assert done.returncode == 2 and "none.yaml" in done.stderr
    protocol = share / "protocols/standard.yaml"
    done = run_kr5("replay", protocol)
    assert done.returncode == 2 and "standard.yaml" in done.stderr and "--cell" in done.stderr
    done = run_kr5("replay", share / "cells/kr5_arc.yaml", "--cell", share / "cells/kr5_arc.yaml")
    assert done.returncode == 2 and "--cell" in done.stderr
    done = run_kr5("replay", describe(recording, "motion"), "--cell", share / "cells/gantry_rrp.yaml")
    assert done.returncode == 2 and "found 4 joints, expected the 6" in done.stderr
    lines = (recording / "motion.csv").read_text().splitlines()
    (recording / "motion.csv").write_text("\n".join([lines[0], lines[2], lines[1]]) + "\n")
    done = run_kr5("replay", describe(recording, "motion"))
    assert done.returncode == 2 and "motion.csv:3: t: found 0, expected time that increases" in done.stderr
    entry = {"name": "motion-1", "kind": "motion", "split": "fit", "given": "motion.csv"}
    (recording / "plan.yaml").write_text(yaml.safe_dump({"format": "kr5-protocol/1", "experiments": [entry]}))
    done = run_kr5("replay", recording / "plan.yaml", "--cell", recording / "cell.yaml")
    assert done.returncode == 2 and "motion-1 (motion): t: found times that do not increase" in done.stderr
    assert not (tmp_path / "replay.html").exists()


def test_an_experiment_whose_time_does_not_increase_is_left_out_and_the_others_are_shown(recording, run_kr5, tmp_path):
    lines = (recording / "motion.csv").read_text().splitlines()
    (recording / "back.csv").write_text("\n".join([lines[0], lines[2], lines[1]]) + "\n")
    entries = [{"name": name, "kind": "motion", "split": "fit", "given": f"{name}.csv"} for name in ("motion", "back")]
    (recording / "plan.yaml").write_text(yaml.safe_dump({"format": "kr5-protocol/1", "experiments": entries}))
    done = run_kr5("replay", recording / "plan.yaml", "--cell", recording / "cell.yaml", "--json", "-")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert [run["name"] for run in found["runs"]] == ["motion (motion)"]
    (skipped,) = found["skipped"]
    assert skipped["name"] == "back (motion)" and "found times that do not increase" in skipped["reason"]


class FakeRerun:
    """Notes what a Rerun recording is given."""

    def __init__(self):
        self.logged, self.sent, self.saved = {}, {}, None

    def RecordingStream(self, name):
        return self

    def save(self, file):
        self.saved = file

    def log(self, path, value, static):
        if value is not None:
            self.logged[path] = value

    def send_columns(self, path, indexes, columns):
        (times,) = indexes
        self.sent[path] = (times, columns)

    def flush(self):
        pass

    @staticmethod
    def TimeColumn(name, duration):
        return np.array(duration)

    @staticmethod
    def TransformAxes3D(length):
        return None

    class Scalars:
        @staticmethod
        def columns(scalars):
            return np.array(scalars)

    class Transform3D:
        def __init__(self, translation, mat3x3):
            self.place = translation

        @staticmethod
        def columns(translation, mat3x3):
            return np.concatenate([mat3x3, translation[:, :, None]], axis=2)


def test_a_rerun_recording_holds_poses_and_the_signals_of_the_page(simulated):
    from kr5_tools.replay import rerun_log, runs

    recording, sdk = kr5.cell.load_recording(simulated / "monday"), FakeRerun()
    shown, _ = runs.experiment_runs(recording.cell, list(recording.experiments), kr5.predict.FastSimulator(), 100)
    rerun_log.write_log(recording.cell, shown, "out.rrd", sdk)
    assert sdk.saved == "out.rrd" and "cell/T_tube" in sdk.logged
    swing = recording.experiments[0]
    t, poses = sdk.sent["swing_(motion)/link_6"]
    k = int(np.argmin(abs(np.asarray(swing["t"]) - t[3])))
    q = [float(swing[f"q{i + 1}"][k]) for i in range(6)]
    np.testing.assert_allclose(poses[3], recording.cell.link_poses(q)[5][:3], atol=1e-9)
    times, values = sdk.sent["swing_(motion)/signals/i5/recorded"]
    np.testing.assert_array_equal(values, swing["i5"])  # every row, not thinned
    assert len(times) == len(swing.data)
    noise = recording.cell.noise.current
    _, simulated_values = sdk.sent["swing_(motion)/signals/i5/simulated"]
    _, residual = sdk.sent["swing_(motion)/signals/i5/residual"]
    np.testing.assert_allclose(residual, (values - simulated_values) / noise)
    t, poses = sdk.sent["roll_(profile),_run_1_of_3/peg"]
    roll = recording.experiments[-1]
    place = np.array([roll["cx"][0], roll["cy"][0], roll["z"][0], 1.0])
    np.testing.assert_allclose(poses[0][:, 3], (recording.cell.tube.T_base_tube @ place)[:3], atol=1e-9)


def test_without_the_extra_a_rerun_recording_is_refused_with_the_remedy(recording, run_kr5, tmp_path):
    if importlib.util.find_spec("rerun"):
        assert run_kr5("replay", describe(recording, "motion"), "--rerun", "out.rrd").returncode == 0
        assert (tmp_path / "out.rrd").stat().st_size > 1000
        return
    done = run_kr5("replay", describe(recording, "motion"), "--rerun", "out.rrd")
    assert done.returncode == 2 and "pip install 'kr5[rerun]'" in done.stderr and "Traceback" not in done.stderr
