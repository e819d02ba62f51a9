"""`kr5 recording import`: logs of every kind become recordings, and each thing that is wrong is named with its
remedy."""

import json
from types import SimpleNamespace

import kr5
import kr5.cell
import kr5.io
import kr5.kinematics
import kr5.predict
import numpy as np
import pytest
import yaml
from kr5.logs.log_file import read_log
from typer.testing import CliRunner

from kr5_tools.app import make_app

ROWS = 400
CUT = 3.0  # [s]
DEG = 180 / np.pi


@pytest.fixture(scope="module")
def arm(share):
    return kr5.cell.load_cell(share / "cells" / "kr5_arc.yaml")


def names(stem):
    return [f"{stem}{i + 1}" for i in range(6)]


@pytest.fixture(scope="module")
def truth(arm):
    """A motion of all joints as the simulator shows it, with the noise of the cell: columns by name. It rests at the
    beginning and where the map cuts it."""
    random = np.random.default_rng(5)
    t = 0.012 * np.arange(ROWS)
    pace = np.prod([1 - np.exp(-(((t - rest) / 0.25) ** 4)) for rest in (0.0, CUT - 0.05)], axis=0)
    phase = 0.012 * np.concatenate([[0.0], np.cumsum(pace[1:])])
    home = np.array([0.1, 0.2, -2.4, 0.3, -0.9, 0.2])
    swing = np.array([0.5, 0.35, 0.4, 0.6, 0.5, 0.8])
    beat = np.array([1.1, 1.7, 1.4, 2.3, 1.9, 2.9])
    qc = home + swing * (1 - np.cos(beat * phase[:, None])) / 2
    experiment = kr5.cell.Experiment(name="m", kind="motion", file="m.csv", split="fit")
    experiment.data = kr5.io.Table(["t", *names("qc")], np.column_stack([t, qc]))
    shown = kr5.predict.FastSimulator().predict(arm, experiment)
    noise = {c.name: getattr(arm.noise, c.noise) for c in kr5.cell.columns("motion", 6) if c.noise}
    out = {"t": t} | dict(zip(names("qc"), qc.T))
    return out | {n: np.array(shown[n]) + random.normal(0, noise[n], ROWS) for n in shown.columns}


@pytest.fixture
def log(truth):
    """The same as a controller may write it: ms, degrees, mA, other names."""
    out = {"time": 1e3 * truth["t"] + 5000}
    for k in range(6):
        out[f"cmd_{k + 1}"] = DEG * truth[f"qc{k + 1}"]
        out[f"pos_{k + 1}"] = DEG * truth[f"q{k + 1}"]
        out[f"cur_{k + 1}"] = 1e3 * truth[f"i{k + 1}"]
    for ours, theirs in zip(("fx", "fy", "fz", "tx", "ty", "tz"), ("Fx", "Fy", "Fz", "Mx", "My", "Mz")):
        out[theirs] = truth[ours]
    return out


@pytest.fixture
def given(share):
    return {
        "format": "kr5-map/1",
        "cell": str(share / "cells" / "kr5_arc.yaml"),
        "clock": {"column": "time", "unit": "ms"},
        "columns": {
            "qc": {"from": "cmd_{}", "unit": "deg"},
            "q": {"from": "pos_{}", "unit": "deg"},
            "i": {"from": "cur_{}", "unit": "mA"},
            "wrench": {"from": ["Fx", "Fy", "Fz", "Mx", "My", "Mz"], "unit": ["N", "N m"]},
        },
        "experiments": [
            {"name": "motion-1", "kind": "motion", "split": "fit", "to": 3.0},
            {"name": "motion-2", "kind": "motion", "split": "check", "from": 3.0},
        ],
    }


def write_csv(file, columns, delimiter=",", text=lambda v: "" if np.isnan(v) else f"{v:.12g}"):
    lines = [delimiter.join(columns)] + [delimiter.join(text(v) for v in row) for row in zip(*columns.values())]
    file.write_text("\n".join(lines) + "\n")
    return file


@pytest.fixture
def bring_in(tmp_path, monkeypatch, log, given):
    """Writes log and map and runs the import in this process; gives what it said and the recording, or None."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    app = make_app(("recording", "import"))

    def run(log=log, given=given, *args, file=None):
        file = file or write_csv(tmp_path / "log.csv", log)
        (tmp_path / "map.yaml").write_text(yaml.safe_dump(given))
        done = CliRunner().invoke(app, ["recording", "import", str(file), "--map", "map.yaml", "-o", "out", *args])
        said = SimpleNamespace(returncode=done.exit_code, stdout=done.stdout, stderr=done.stderr)
        return said, kr5.cell.load_recording(tmp_path / "out") if done.exit_code == 0 else None

    return run


def same(recording, truth, columns, tolerance=1e-8):
    for column in columns:
        got = np.concatenate([e[column] for e in recording.experiments])
        np.testing.assert_allclose(got, truth[column][: len(got)], rtol=tolerance, atol=tolerance, err_msg=column)


def refused(bring_in, log, given, *words):
    done, recording = bring_in(log, given)
    assert done.returncode == 2 and recording is None, done.stdout + done.stderr
    for word in words:
        assert word in done.stderr, f"{word!r} not in: {done.stderr}"
    return done.stderr


EVERY = ["t", *names("qc"), *names("q"), *names("i"), "fx", "fy", "fz", "tx", "ty", "tz"]


def test_a_log_in_other_units_becomes_the_recording_that_was_made(bring_in, truth, tmp_path):
    done, recording = bring_in()
    assert done.returncode == 0, done.stderr
    same(recording, truth, EVERY)
    assert [(e.name, str(e.split)) for e in recording.experiments] == [("motion-1", "fit"), ("motion-2", "check")]
    assert recording.experiments[0]["t"][-1] < 3.0 <= recording.experiments[1]["t"][0]
    assert json.loads((tmp_path / "out" / "import.json").read_text())["problems"] == []
    assert kr5.cell.check(tmp_path / "out") == []


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_other_delimiters_decimal_commas_and_remarks(bring_in, log, truth, tmp_path, delimiter):
    file = write_csv(tmp_path / "log.csv", log, delimiter, lambda v: f"{v:.12g}".replace(".", ","))
    file.write_text("# from a controller\n" + file.read_text())
    done, recording = bring_in(file=file)
    assert done.returncode == 0, done.stderr
    same(recording, truth, EVERY)


def test_an_npz_with_arrays_of_joints(bring_in, given, truth, tmp_path):
    stack = {stem: np.column_stack([truth[n] for n in names(stem)]) for stem in ("qc", "q", "i")}
    np.savez(tmp_path / "log.npz", time=truth["t"], **stack)
    given["clock"]["unit"] = "s"
    given["columns"] = {
        "qc": {"from": "qc[{0}]", "unit": "rad"},
        "q": {"from": "q[{0}]", "unit": "rad"},
        "i": {"from": "i[{0}]", "unit": "A"},
    }
    done, recording = bring_in(given=given, file=tmp_path / "log.npz")
    assert done.returncode == 0, done.stderr
    same(recording, truth, [*names("q"), *names("i")])


@pytest.mark.parametrize("turned", [("qc", "q", "i"), ("q",), ()])
def test_an_npz_with_joints_in_rows_is_turned(bring_in, given, truth, tmp_path, turned):
    stack = {stem: np.column_stack([truth[n] for n in names(stem)]) for stem in ("qc", "q", "i")}
    stack |= {stem: stack[stem].T for stem in turned}
    np.savez(tmp_path / "log.npz", time=truth["t"], gains=np.ones(6), T=np.eye(4), **stack)
    given["clock"]["unit"] = "s"
    given["columns"] = {
        stem: {"from": f"{stem}[{{0}}]", "unit": "A" if stem == "i" else "rad"} for stem in ("qc", "q", "i")
    }
    done, recording = bring_in(given=given, file=tmp_path / "log.npz")
    assert done.returncode == 0, done.stderr
    same(recording, truth, [*names("q"), *names("i")])
    assert ("turned" in done.stdout) == bool(turned)
    if turned:
        shape = f"(6 x {len(truth['t'])})"
        expected = f"{', '.join(turned)} of log.npz {'have' if turned[1:] else 'has'} a row for each joint {shape}"
        assert expected in " ".join(done.stdout.split())


def shapes(arrays, tmp_path):
    """How many columns of which length each array becomes, and the notes."""
    np.savez(tmp_path / "log.npz", **{name: np.zeros(shape) for name, shape in arrays.items()})
    log = read_log(tmp_path / "log.npz")
    found = {name: [len(v) for c, v in log.columns.items() if c.partition("[")[0] == name] for name in arrays}
    return {name: (lengths[0], len(lengths)) for name, lengths in found.items()}, log.notes


def test_only_arrays_that_surely_have_joints_in_rows_are_turned(tmp_path):
    kept = {"t": (900,), "q": (900, 6), "square": (6, 6), "few": (6, 50), "limits": (2, 6)}
    found, notes = shapes(kept, tmp_path)
    assert notes == [] and all(found[name] == kept[name] for name in kept if name != "t")
    found, notes = shapes({"t": (50,), "q": (6, 50), "gains": (6,)}, tmp_path)  # 6 gains of 6 joints, or 6 times
    assert found["q"] == (6, 50) and notes == []
    found, notes = shapes({"t": (50, 1), "q": (6, 50)}, tmp_path)
    assert found["q"] == (50, 6) and len(notes) == 1
    found, notes = shapes({"q": (6, 900), "tau": (900, 6)}, tmp_path)
    assert found == {"q": (900, 6), "tau": (900, 6)} and notes[0].startswith("q of log.npz has a row for each joint")


def test_an_array_of_neither_size_is_refused(tmp_path):
    with pytest.raises(kr5.FileError, match=r"log.npz: q: found 6 x 900 values.*such as the time \(t has 800\)"):
        shapes({"t": (800,), "q": (6, 900)}, tmp_path)


def write_mcap(file, truth, ros):
    """Two topics: joints every 12 ms with commands, and a wrench half as often, half a step later."""
    if ros:
        writer_module = pytest.importorskip("mcap_ros2.writer")
        writer = writer_module.Writer(str(file))
        schema = writer.register_msgdef(
            "my/Joints", "float64[] command\n" + "string[] name\nfloat64[] position\nfloat64[] effort\n"
        )
        force = writer.register_msgdef("my/Force", "float64[] w\n")
        put = lambda topic, ns, message: writer.write_message(
            topic, schema if topic == "/joints" else force, message, log_time=ns, publish_time=ns
        )
        finish = writer.finish
    else:
        mcap = pytest.importorskip("mcap.writer")
        stream = file.open("wb")
        writer = mcap.Writer(stream)
        writer.start()
        channels = {
            t: writer.register_channel(t, "json", writer.register_schema(t, "jsonschema", b"{}"))
            for t in ("/joints", "/force")
        }
        put = lambda topic, ns, message: writer.add_message(channels[topic], ns, json.dumps(message).encode(), ns)
        finish = lambda: (writer.finish(), stream.close())
    start = 1_700_000_000_000_000_000
    value = lambda stem, k: [float(truth[n][k]) for n in names(stem)]
    for k in range(ROWS):
        ns = start + 12_000_000 * k
        put(
            "/joints",
            ns,
            {
                "command": value("qc", k),
                "name": [f"a{i}" for i in range(6)],
                "position": value("q", k),
                "effort": value("i", k),
            },
        )
        if k % 2 == 0:
            put("/force", ns + 6_000_000, {"w": [float(truth[c][k]) for c in ("fx", "fy", "fz", "tx", "ty", "tz")]})
    finish()
    return file


@pytest.mark.parametrize("ros", [False, True], ids=["json", "ros2"])
def test_an_mcap_with_topics_of_different_rates(bring_in, given, truth, tmp_path, ros):
    file = write_mcap(tmp_path / "log.mcap", truth, ros)
    del given["clock"]
    given["columns"] = {
        "qc": {"from": "/joints:command.a{0}", "unit": "rad"},
        "q": {"from": "/joints:position.a{0}", "unit": "rad"},
        "i": {"from": "/joints:effort.a{0}", "unit": "A"},
        "wrench": {"from": "/force:w[{0}]", "unit": ["N", "N m"]},
    }
    given["experiments"] = given["experiments"][:1]
    done, recording = bring_in(given=given, file=file)
    assert done.returncode == 0, done.stderr
    e = recording.experiments[0]
    np.testing.assert_allclose(e["q3"], np.interp(e["t"] + 0.0, truth["t"], truth["q3"]), atol=1e-6)
    late = truth["t"][::2] + 0.006
    np.testing.assert_allclose(e["fz"], np.interp(e["t"], late, truth["fz"][::2]), atol=1e-5)
    assert "a separate clock" in done.stdout


def test_mcap_without_its_package_says_what_to_install(tmp_path, given, share):
    import subprocess
    import sys

    (tmp_path / "log.mcap").write_bytes(b"")
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(given))
    code = (
        "import sys; sys.modules['mcap'] = None; sys.modules['mcap.exceptions'] = None; sys.argv = ['kr5', 'recording',"
        " 'import', 'log.mcap', '--map', 'map.yaml', '-o', 'out']; from kr5_tools.app import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2 and "pip install 'kr5[mcap]'" in done.stderr


def test_motor_side_angles_and_torques_pass_the_gears(bring_in, log, given, truth, arm):
    S, constant = np.asarray(arm.drives.structure), np.asarray(arm.drives.torque_constant)
    for ours, theirs in (("qc", "cmd_"), ("q", "pos_")):
        motor = np.column_stack([truth[n] for n in names(ours)]) @ S.T
        for k in range(6):
            log[f"{theirs}{k + 1}"] = motor[:, k]
    for k in range(6):
        log[f"cur_{k + 1}"] = 1e3 * constant[k] * truth[f"i{k + 1}"]
    for name in ("q", "qc"):
        given["columns"][name] |= {"unit": "rad", "side": "motor"}
    given["columns"]["i"] = {"from": "cur_{}", "unit": "mN m", "side": "motor"}
    done, recording = bring_in(log, given)
    assert done.returncode == 0, done.stderr
    same(recording, truth, [*names("q"), *names("i")])
    assert "structure matrix" in done.stdout and "torque constants" in done.stdout


def test_a_wrench_in_a_turned_and_shifted_frame(bring_in, log, given, truth):
    pose = [0.01, -0.02, 0.05, 0.0, 0.3, 1.2]
    T = kr5.from_xyzrpy(pose)
    R, p = T[:3, :3], T[:3, 3]
    force = np.column_stack([truth[c] for c in ("fx", "fy", "fz")])
    torque = np.column_stack([truth[c] for c in ("tx", "ty", "tz")])
    there = np.hstack([force @ R, (torque - np.cross(p, force)) @ R])
    for name, column in zip(("Fx", "Fy", "Fz", "Mx", "My", "Mz"), -there.T):
        log[name] = column
    given["columns"]["wrench"] |= {"frame": pose, "scale": -1}
    done, recording = bring_in(log, given)
    assert done.returncode == 0, done.stderr
    same(recording, truth, ["fx", "fy", "fz", "tx", "ty", "tz"])


def test_rows_are_spaced_evenly_and_smoothed_as_the_map_says(bring_in, log, given, truth):
    given["resample"] = {"every": 0.012, "method": "cubic", "low_pass": 15}
    given["experiments"] = [{"name": "m", "kind": "motion", "split": "fit"}]
    del given["columns"]["q"], given["columns"]["wrench"]
    done, recording = bring_in({name: column[::2] for name, column in log.items()}, given)
    assert done.returncode == 0, done.stderr
    e = recording.experiments[0]
    np.testing.assert_allclose(np.diff(e["t"]), 0.012, rtol=1e-9)
    middle = slice(40, -40)  # a filter has less to go by at the ends
    np.testing.assert_allclose(np.asarray(e["qc2"])[middle], truth["qc2"][: len(e["t"])][middle], atol=1e-4)
    assert np.std(np.diff(e["i1"], 3)) < 0.5 * np.std(np.diff(truth["i1"], 3))
    assert "Butterworth" in done.stdout and "cubic" in done.stdout


def test_smoothing_leaves_no_mark_where_a_motion_is_cut(bring_in, log, given, truth):
    given["resample"] = {"every": 0.012, "low_pass": 15}
    done, recording = bring_in(log, given)
    assert done.returncode == 0, done.stderr
    e = recording.experiments[1]
    first = round(e["t"][0] / 0.012)
    np.testing.assert_allclose(e["qc2"][:20], truth["qc2"][first : first + 20], atol=1e-5)


def test_measured_positions_may_stand_for_commands_that_were_not_logged(bring_in, log, given):
    given["columns"]["qc"] = {"from": "measured", "unit": "deg"}
    done, recording = bring_in(log, given)
    assert done.returncode == 0, done.stderr
    assert "q1" not in recording.experiments[0].data and "replace the commands" in done.stdout


@pytest.fixture
def touched(arm):
    """Twenty postures and the tool as a tracker sees it: its own frame, a mark beside the tip, mm."""
    random = np.random.default_rng(3)
    q = np.array([0.1, 0.2, -2.4, 0.3, -0.9, 0.2]) + random.uniform(-0.5, 0.5, (20, 6))
    device, mark = [0.4, -1.2, 0.3, 0.1, 0.2, 2.0], [0.02, 0.0, 0.03, 0.0, 0.0, 0.7]
    seen = [np.linalg.inv(kr5.from_xyzrpy(device)) @ arm.T_base_tool(row) @ kr5.from_xyzrpy(mark) for row in q]
    from scipy.spatial.transform import Rotation

    columns = {f"A{k + 1}": DEG * q[:, k] for k in range(6)}
    for k, axis in enumerate("XYZ"):
        columns[axis] = 1e3 * np.array([T[k, 3] for T in seen])
    for k, axis in enumerate(("qx", "qy", "qz", "qw")):
        columns[axis] = np.array([Rotation.from_matrix(T[:3, :3]).as_quat()[k] for T in seen])
    return columns, device, mark


@pytest.fixture
def poses_map(given, touched):
    del given["clock"]
    given["columns"] = {
        "q": {"from": "A{}", "unit": "deg"},
        "tool": {
            "from": ["X", "Y", "Z", "qx", "qy", "qz", "qw"],
            "position": "mm",
            "device": touched[1],
            "mark": touched[2],
        },
    }
    given["experiments"] = [{"name": "poses", "kind": "poses", "split": "fit"}]
    return given


def test_poses_of_a_tracker_are_brought_to_the_base_and_the_tool(bring_in, touched, poses_map, arm):
    done, recording = bring_in(touched[0], poses_map)
    assert done.returncode == 0, done.stderr
    e = recording.experiments[0]
    tips = np.array([arm.T_base_tool(np.array([e[n][k] for n in names("q")]))[:3, 3] for k in range(20)])
    np.testing.assert_allclose(np.column_stack([e[c] for c in "xyz"]), tips, atol=1e-8)


def test_poses_in_the_frame_of_the_tracker_are_noticed_and_its_pose_is_proposed(bring_in, touched, poses_map):
    del poses_map["columns"]["tool"]["device"], poses_map["columns"]["tool"]["mark"]
    said = refused(bring_in, touched[0], poses_map, "after a rigid transformation", "device: [")
    proposed = [float(x) for x in said.split("device: [")[1].split("]")[0].split(",")]
    np.testing.assert_allclose(proposed[:3], touched[1][:3], atol=0.06)  # the mark sits 36 mm beside the tip


def test_positions_of_poses_in_another_unit_are_noticed(bring_in, touched, poses_map):
    poses_map["columns"]["tool"]["position"] = "m"
    refused(bring_in, touched[0], poses_map, "poses: x y z", "position: mm")


# Wrong units, sides, signs and columns


def test_degrees_taken_for_radians_are_noticed(bring_in, log, given):
    given["columns"]["q"]["unit"] = "rad"
    refused(bring_in, log, given, "motion-1: q", "unit: deg in columns.q", "--trust")


def test_radians_taken_for_degrees_are_noticed(bring_in, log, given, truth):
    for k in range(6):
        log[f"cmd_{k + 1}"], log[f"pos_{k + 1}"] = truth[f"qc{k + 1}"], truth[f"q{k + 1}"]
    refused(bring_in, log, given, "unit: rad in columns.qc")


def test_motor_angles_taken_for_joint_angles_are_noticed(bring_in, log, given, arm):
    for k in range(6):
        log[f"pos_{k + 1}"] = log[f"pos_{k + 1}"] * abs(np.asarray(arm.drives.structure)[k, k])
    refused(bring_in, log, given, "side: motor", "columns.q")


def test_currents_a_thousand_times_too_large_are_noticed(bring_in, log, given):
    given["columns"]["i"]["unit"] = "A"
    refused(bring_in, log, given, "i1 to i6", "unit: mA")


def test_torques_of_the_motors_taken_for_currents_are_noticed(bring_in, log, given, arm):
    for k in range(6):
        log[f"cur_{k + 1}"] = (
            log[f"cur_{k + 1}"] * np.asarray(arm.drives.torque_constant)[k] * np.asarray(arm.drives.structure)[k, k]
        )
    refused(bring_in, log, given, "i1 to i6", "torques of the joints")


def test_the_opposite_sign_is_noticed(bring_in, log, given):
    given["columns"]["wrench"]["scale"] = -1
    refused(bring_in, log, given, "fx to fz", "opposite sign", "scale: -1")


def test_one_current_of_opposite_sign_is_noticed(bring_in, log, given):
    log["cur_2"] = -log["cur_2"]
    refused(bring_in, log, given, ": i2:", "opposite sign")


def test_a_clock_in_another_unit_is_noticed(bring_in, log, given):
    given["clock"]["unit"] = "s"
    given["experiments"] = [{"name": "m", "kind": "motion", "split": "fit"}]
    refused(bring_in, log, given, "m: t:", "unit: ms")


def test_swapped_positions_are_noticed(bring_in, log, given):
    log["pos_2"], log["pos_3"] = log["pos_3"], log["pos_2"]
    given["experiments"] = [{"name": "m", "kind": "motion", "split": "fit"}]
    assert "q2" in refused(bring_in, log, given, "q3")


def test_swapped_wrist_joints_within_limits_are_noticed(bring_in, log, given):
    log["pos_4"], log["pos_6"] = log["pos_6"] - 40, log["pos_4"]
    log["cmd_6"] = log["cmd_6"] - 40
    refused(bring_in, log, given, "follows qc6", "swapped")


def test_swapped_currents_are_noticed(bring_in, log, given):
    log["cur_2"], log["cur_3"] = log["cur_3"], log["cur_2"]
    refused(bring_in, log, given, "i2 and i3", "swapped")


def test_currents_from_which_gravity_was_taken_are_noticed(bring_in, log, given):
    random = np.random.default_rng(1)
    for k in range(6):
        log[f"cur_{k + 1}"] = random.normal(0, 20, ROWS)
    refused(bring_in, log, given, "gravity and inertia", "did the controller remove gravity")


def test_a_doubt_can_be_overruled(bring_in, log, given):
    given["columns"]["i"]["unit"] = "A"
    done, recording = bring_in(log, given, "--trust")
    assert done.returncode == 0 and "warning:" in done.stderr and len(recording.experiments) == 2


# Broken logs


def test_a_missing_number_is_refused_filled_or_left_out(bring_in, log, given, truth):
    log["cur_3"][[17, 40]] = np.nan
    refused(bring_in, log, given, "log.csv: line 19", "'cur_3'", "2 of 400", "missing: interpolate")
    given["columns"]["i"]["missing"] = "interpolate"
    done, recording = bring_in(log, given)
    assert done.returncode == 0 and "2 of 400 rows" in done.stdout, done.stderr
    assert recording.experiments[0]["i3"][17] == pytest.approx((truth["i3"][16] + truth["i3"][18]) / 2)


def test_rows_without_a_number_can_be_left_out(bring_in, log, given, tmp_path):
    log["cur_3"][17] = np.nan
    given["columns"]["i"]["missing"] = "drop"
    done, _ = bring_in(log, given, "--trust")
    assert done.returncode == 0 and "1 of 400 rows without a number were left out" in done.stdout
    assert sum(len(e.data) for e in kr5.cell.load_recording(tmp_path / "out").experiments) == ROWS - 1


def test_a_short_row_is_refused_by_line(bring_in, log, tmp_path):
    file = write_csv(tmp_path / "log.csv", log)
    lines = file.read_text().splitlines()
    lines[9] = ",".join(lines[9].split(",")[:5])
    file.write_text("\n".join(lines))
    done, _ = bring_in(file=file)
    assert done.returncode == 2 and "line 10: found 5 values, expected 25" in done.stderr
    lines[9], lines[-1] = lines[8], lines[-1][:40]
    file.write_text("\n".join(lines))
    done, _ = bring_in(file=file)
    assert done.returncode == 2 and "truncated" in done.stderr


def test_text_in_a_column_is_refused_by_line(bring_in, log, tmp_path):
    file = write_csv(tmp_path / "log.csv", log, text=lambda v: "ERR" if v == log["cur_2"][3] else f"{v:.12g}")
    done, _ = bring_in(file=file)
    assert done.returncode == 2 and "line 5, column 'cur_2': found 'ERR', expected a number" in done.stderr


def test_time_that_goes_back_is_refused_or_sorted(bring_in, log, given, truth):
    order = np.arange(ROWS)
    order[[100, 101]] = [101, 100]
    for name in log:
        log[name] = log[name][order]
    refused(bring_in, log, given, "line 103", "goes back", "repair: sort")
    given["clock"]["repair"] = "sort"
    done, recording = bring_in(log, given)
    assert done.returncode == 0, done.stderr
    same(recording, truth, [*names("q"), *names("i")])


def test_time_that_stands_still_is_refused(bring_in, log, given):
    log["time"][50] = log["time"][49]
    refused(bring_in, log, given, "line 52", "stands still")


def test_a_gap_is_refused_with_where_to_cut(bring_in, log, given):
    log["time"][246:] += 900
    given["experiments"] = [{"name": "m", "kind": "motion", "split": "fit"}]
    refused(bring_in, log, given, "line 248", "gap of 0.912 s", "to: 3.396, from: 3.396", "max_gap")
    given["experiments"] = [
        {"name": "a", "kind": "motion", "split": "fit", "to": 3.396},
        {"name": "b", "kind": "motion", "split": "check", "from": 3.396},
    ]
    done, recording = bring_in(log, given)
    assert done.returncode == 0, done.stderr
    assert [len(e.data) for e in recording.experiments] == [246, 154]


def test_a_column_that_is_not_there_is_refused_with_the_nearest(bring_in, log, given):
    given["columns"]["i"]["from"] = "curr_{}"
    refused(bring_in, log, given, "columns.i", "'curr_1'", "did you mean 'cur_1'?")


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda g: g.update(format="kr5-cell/1"), ["format", "kr5-map/1"]),
        (lambda g: g["columns"].update(torque={"from": "x{}"}), ["unknown key 'torque'"]),
        (lambda g: g["columns"]["q"].pop("unit"), ["columns.q", "unit: is missing"]),
        (lambda g: g["columns"]["q"].update(unit="degrees"), ["found 'degrees'", "deg"]),
        (lambda g: g["columns"]["q"].update(scale=[1, 2]), ["scale", "a list of 6"]),
        (lambda g: g["columns"].pop("qc"), ["columns.qc is missing", "from: measured"]),
        (lambda g: g["columns"]["q"].update({"from": "pos"}), ["where the joint is counted"]),
        (lambda g: g.update(clock={"unit": "ms"}), ["clock", "every: SECONDS"]),
        (lambda g: g.pop("clock"), ["needs a clock"]),
        (lambda g: g["experiments"][0].update(kind="movement"), ["experiments[0]", "motion"]),
        (lambda g: g["experiments"][0].update(name="motion-2"), ["found two named 'motion-2'"]),
        (lambda g: g["experiments"][0].update({"from": 90, "to": 95}), ["only 0 rows", "unit of the clock"]),
        (lambda g: g.update(resample={"low_pass": 60}), ["low_pass", "less than half the rate"]),
        (lambda g: g.update(cell="nowhere.yaml"), ["nowhere.yaml"]),
    ],
)
def test_a_wrong_map_is_refused_with_its_field(bring_in, log, given, change, words):
    change(given)
    refused(bring_in, log, given, *words)


def test_a_csv_without_names_is_refused_and_can_be_named(bring_in, log, given, truth, tmp_path):
    file = write_csv(tmp_path / "log.csv", log)
    file.write_text("\n".join(file.read_text().splitlines()[1:]))
    done, _ = bring_in(file=file)
    assert done.returncode == 2 and "header: [" in done.stderr
    given["header"] = list(log)
    done, recording = bring_in(given=given, file=file)
    assert done.returncode == 0, done.stderr
    same(recording, truth, EVERY)


def test_a_recording_that_is_there_is_not_written_over(bring_in, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("keep")
    done, _ = bring_in()
    assert (
        done.returncode == 2
        and "exists already" in done.stderr
        and (tmp_path / "out" / "mine.txt").read_text() == "keep"
    )


def test_a_map_that_is_not_there_is_named_with_the_command_that_makes_one(run_kr5, log, tmp_path):
    write_csv(tmp_path / "log.csv", log)
    for words in (("recording", "import", "log.csv", "-o", "out"), ("identify", "dynamics", "log.csv")):
        done = run_kr5(*words, "--map", "none.yaml")
        assert done.returncode == 2 and "none.yaml: No such file" in done.stderr
        assert "expected a map of columns (kr5-map/1); `kr5 recording guess LOG" in done.stderr


def test_a_guessed_map_brings_the_log_in(run_kr5, share, log, truth, tmp_path):
    write_csv(tmp_path / "log.csv", log)
    done = run_kr5("recording", "guess", "log.csv", "--cell", share / "cells" / "kr5_arc.yaml", "-o", "map.yaml")
    assert done.returncode == 0, done.stderr
    done = run_kr5("recording", "import", "log.csv", "--map", "map.yaml", "-o", "out")
    assert done.returncode == 0, done.stderr
    same(kr5.cell.load_recording(tmp_path / "out"), truth, EVERY)
