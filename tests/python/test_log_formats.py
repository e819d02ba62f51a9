"""Logs of servo arms in the formats in which they are recorded: each is found by what is in it, with one answer."""

import shlex
import subprocess
import sys

import kr5
import numpy as np
import pytest
from kr5.logs import read_logs, read_motion_log, row_chunks
from kr5.logs.column_names import find_families
from kr5.logs.episodes import parse_episodes
from kr5.logs.log_file import episodes_of, read_log

import servo_log_files as files
from arm_logs import written_bag

pytest.importorskip("pyarrow", reason="pip install 'kr5[parquet]'")
pytest.importorskip("h5py", reason="pip install 'kr5[hdf5]'")

FORMS = {
    "lerobot v2.1": (files.lerobot_21, {}),
    "lerobot v3": (files.lerobot_3, {}),
    "lerobot table": (files.lerobot_table, {}),
    "parquet": (files.plain_parquet, {}),
    "aloha": (files.aloha, {"every": 1 / files.RATE}),
    "robomimic": (files.robomimic, {}),
    "droid": (files.droid, {}),
    "pace": (files.pace, {}),
    "sage": (files.sage, {}),
    "headerless": (files.headerless, {"columns": "t,cmd{1-3},pos{1-3}"}),
}


@pytest.fixture(scope="module")
def motions():
    return [files.moved(seed) for seed in (1, 2, 3)]


@pytest.fixture
def model(tmp_path):
    return files.file_of(tmp_path, files.servo_arm())


def assert_holds(experiments, truth):
    """Commands and positions are those that were written, at their times, nearly all of them."""
    rows = np.concatenate([np.round(np.asarray(e["t"]) * files.RATE).astype(int) for e in experiments])
    assert len(rows) > 0.85 * len(truth.t)  # the first second may be simulated alone
    for stem, values in (("qc", truth.qc), ("q", truth.q)):
        found = np.vstack([np.column_stack([e[f"{stem}{k + 1}"] for k in range(3)]) for e in experiments])
        assert np.abs(found - values[rows]).max() < 1e-6


@pytest.mark.parametrize("form", FORMS)
def test_commands_and_positions_are_those_that_were_written(form, motions, model, tmp_path):
    write, options = FORMS[form]
    several = form.startswith("lerobot") or form == "robomimic"
    found = read_logs(write(tmp_path, motions), model, **options, **({"episodes": "1"} if several else {}))
    assert_holds(found.recording.experiments, motions[1 if several else 0])
    assert {str(e.split) for e in found.recording.experiments} == {"fit", "check"}


@pytest.mark.parametrize("form", ["lerobot v2.1", "lerobot v3", "lerobot table", "robomimic"])
def test_several_episodes_are_fitted_and_judged_by_name(form, motions, model, tmp_path):
    data_set = FORMS[form][0](tmp_path, motions)
    assert episodes_of(data_set) == [0, 1, 2]
    found = read_logs(data_set, model, episodes="0,2")
    assert len(found.recording.experiments) == 2
    split = next(proposal for item, proposal, _ in found.reasons if item == "split of motion")
    assert split == f"{data_set.name} episode 0 to fit, {data_set.name} episode 2 to check"
    for experiment, truth in zip(found.recording.experiments, (motions[0], motions[2]), strict=True):
        assert_holds([experiment], truth)
    assert found.inputs["episodes"] == "0,2" and "--episodes 0,2" in found.command


def test_logs_that_judge_are_chosen_by_name(motions, model, tmp_path):
    logs = []
    for k, m in enumerate(motions):
        (tmp_path / f"part{k}").mkdir()
        logs.append(files.sage(tmp_path / f"part{k}", [m]))
    found = read_logs(logs, model, check="part0")
    assert [str(e.split) for e in found.recording.experiments] == ["check", "fit", "fit"]
    assert found.inputs["check"] == "part0"
    data_set = files.lerobot_21(tmp_path / "set", motions)
    found = read_logs(data_set, model, check="0-1")
    assert [str(e.split) for e in found.recording.experiments] == ["check", "check", "fit"]
    with pytest.raises(kr5.InvalidArgument, match="--check: found 'part9', which is none of the logs: part0, part1"):
        read_logs(logs, model, check="part9")
    with pytest.raises(kr5.InvalidArgument, match="--check: found every log, expected one to fit"):
        read_logs(logs, model, check="part0,part1,part2")


def test_of_many_episodes_some_are_read_and_the_option_is_named(motions, model, tmp_path):
    m = motions[0]
    short = [files.Motion(m.t[:300], m.qc[:300] + k * files.TICK, m.q[:300] + k * files.TICK) for k in range(25)]
    found = read_logs(files.lerobot_21(tmp_path / "set", short), model)
    note = next(n for n in found.notes if "25 episodes" in n)
    assert "0, 3, 5, 8, 11, 13, 16, 19, 21, 24 are read" in note and "--episodes 0-9" in note


def test_episodes_are_chosen_in_words(motions, tmp_path):
    assert parse_episodes("3,7-9") == [3, 7, 8, 9]
    for text in ("a", "9-7", "", "3,,4"):
        with pytest.raises(kr5.InvalidArgument, match="such as 3,7-12"):
            parse_episodes(text or ",")
    data_set = files.lerobot_3(tmp_path / "set", motions)
    with pytest.raises(kr5.FileError, match="has 3 episodes .0 to 2.; choose one with --episodes 0"):
        read_log(data_set)
    with pytest.raises(kr5.FileError, match="has no episode 7; it has 3, from 0 to 2: --episodes 0-2"):
        read_logs(data_set, files.file_of(tmp_path, files.servo_arm()), episodes="7")
    with pytest.raises(kr5.FileError, match="no data set with episodes; leave --episodes out"):
        read_logs(files.plain_parquet(tmp_path, motions), files.file_of(tmp_path, files.servo_arm()), episodes="0")


def test_a_gripper_is_left_out_with_a_word(motions, model, tmp_path):
    named = read_logs(files.lerobot_3(tmp_path / "set", motions), model, episodes="0")
    assert any("action.gripper is left out" in note for note in named.notes)
    unnamed = read_logs(files.aloha(tmp_path, motions), model, every=0.02)
    assert any("observations/qpos[3] is left out, taken for a gripper" in note for note in unnamed.notes)


@pytest.mark.parametrize("grippers", [True, False])
def test_of_two_arms_the_one_that_is_chosen_is_read(grippers, motions, model, tmp_path):
    log = files.two_arms(tmp_path, motions[:2], grippers)
    with pytest.raises(kr5.FileError, match="two arms of 3 joints would have as many numbers") as error:
        read_logs(log, model, every=1 / files.RATE)
    _, *choices = str(error.value).split(" arm with ")
    for choice, truth in zip(choices, motions[:2], strict=True):
        options = shlex.split(choice.split(", or ")[0])
        assert options[::2] == ["--set", "--set"]
        found = read_logs(log, model, every=1 / files.RATE, settings=options[1::2])
        assert_holds(found.recording.experiments, truth)
        motion = read_motion_log(log, files.servo_arm(), every=1 / files.RATE, settings=options[1::2])
        assert np.abs(motion.positions - truth.q).max() < 1e-12 and np.abs(motion.commands - truth.qc).max() < 1e-12
    last = 7 if grippers else 6
    assert f"'columns.q.from=observations/qpos[{last - 3}:{last}]'" in str(error.value)


def test_of_two_arms_whose_joints_have_names_one_is_chosen_by_them(motions, model, tmp_path):
    joints = [f"{side}_{name}" for side in ("left", "right") for name in [*files.NAMES, "gripper"]][:-1]
    left, right = motions[:2]
    beside = [np.column_stack([left.with_gripper(a), b]) for a, b in ((left.qc, right.qc), (left.q, right.q))]
    both = files.Motion(left.t, *beside)
    log = files.lerobot_3(tmp_path / "set", [both], joints=joints)
    with pytest.raises(kr5.FileError, match="two arms of 3 joints") as error:
        read_logs(log, model)
    second = str(error.value).split("of the second arm with ")[1]
    found = read_logs(log, model, settings=shlex.split(second)[1::2])
    assert_holds(found.recording.experiments, motions[1])


def test_components_of_a_vector_are_as_many_as_the_joints(motions, model, tmp_path):
    log = files.two_arms(tmp_path, motions[:2], grippers=True)
    with pytest.raises(kr5.IoError, match="found 4 names, expected 3"):
        read_logs(log, model, every=0.02, settings=["columns.q.from=observations/qpos[4:8]"])


def test_joints_of_other_names_are_taken_in_their_order_and_told(motions, model, tmp_path):
    found = read_logs(files.sage(tmp_path, motions, ["Rotation", "Pitch", "Elbow", "Jaw"]), model)
    told = (
        "Rotation, Pitch, Elbow of state.positions are taken in this order for shoulder_pan, shoulder_lift, elbow_flex"
    )
    assert any(told in note for note in found.notes)
    assert any("Jaw is left out, since a gripper" in note for note in found.notes)


def test_of_lerobot_without_times_the_rate_of_the_set_is_taken(motions, tmp_path):
    m = motions[0]
    files.write_info(tmp_path, "v2.1")
    columns = files.parquet_columns(m, 0)
    del columns["timestamp"], columns["frame_index"]
    files.write_parquet(tmp_path / "data" / "chunk-000" / "episode_000000.parquet", columns)
    log = read_log(tmp_path, episode=0)
    assert np.abs(log.columns[log.clocks[""]] - m.t).max() < 1e-9


def test_a_joint_without_a_number_is_found_beside_columns_with_numbers(tmp_path):
    t = 0.005 * np.arange(500)
    file = tmp_path / "log.csv"
    table = np.column_stack([t, np.full_like(t, 30.0), np.sin(t), np.sin(t - 0.02)])
    np.savetxt(file, table, delimiter=",", header="t,temperature_7,goal_position,position", comments="")
    found = find_families(read_log(file), [], 1)
    assert found.first("q").columns == ["position"] and found.first("qc").columns == ["goal_position"]


def test_joints_in_another_order_are_found_by_their_names(motions, model, tmp_path):
    turned = [2, 0, 1]
    other = [files.Motion(m.t, m.qc[:, turned], m.q[:, turned]) for m in motions]
    data_set = files.lerobot_3(tmp_path / "set", other, joints=[files.NAMES[k] for k in turned])
    found = read_logs(data_set, model, episodes="0")
    assert_holds(found.recording.experiments, motions[0])


def test_torques_without_a_sign_are_not_compared(motions, model, tmp_path):
    folders = [tmp_path / name for name in ("monday", "today")]
    for k, folder in enumerate(folders):
        folder.mkdir()
        files.sage(folder, motions[k:])
    found = read_logs(folders, model)
    assert not any("tau1" in e.data for e in found.recording.experiments)
    assert sum("never change their sign" in note for note in found.notes) == 1  # of both logs


def test_rows_without_motor_are_left_out(tmp_path):
    t = 0.005 * np.arange(1000)
    log = files.bam(tmp_path / "log.json", t, np.sin(t), np.sin(t - 0.02), on=t < 2)
    found = read_log(log)
    assert len(found.columns["position"]) == 400
    assert any("torque_enable is 0 in 600 of 1000 rows" in note and "rows 1 to 400" in note for note in found.notes)
    assert any("kp 100" in note for note in found.notes)


def test_rows_without_motor_are_simulated_so_where_commands_move_the_arm(tmp_path):
    motion = files.moved(seconds=10.0)
    off = motion.t >= 6.0
    columns = {"t": motion.t, **{f"cmd_{k + 1}": motion.qc[:, k] for k in range(3)}}
    columns |= {f"pos_{k + 1}": motion.q[:, k] for k in range(3)} | {"torque_enabled": 1.0 - off}
    log = files.csv(tmp_path / "log.csv", columns)
    found = read_logs([log], files.file_of(tmp_path, files.servo_arm()), trust=True)
    gains = np.concatenate([e.data["servo_gain"] for e in found.recording.experiments])
    assert set(gains.tolist()) == {0.0, 1.0}
    assert any("no command moves the arm there, and it is simulated so" in note for note in found.notes)
    assert set(read_motion_log(log, files.servo_arm()).servo_gain.tolist()) == {0.0, 1.0}


def test_gains_of_the_firmware_are_in_proportion_to_that_of_the_first_log(tmp_path):
    arm = files.pendulum(tmp_path)
    t = 0.01 * np.arange(600)
    logs = [files.bam(tmp_path / f"{kp}.json", t, np.sin(t), 0.9 * np.sin(t - 0.1), kp=kp) for kp in (200, 800)]
    found = read_logs(logs, arm, check="800.json", settings=files.PENDULUM_SERVO)
    by_split = {str(e.split): e for e in found.recording.experiments}
    assert "servo_gain" not in by_split["fit"].data
    assert set(by_split["check"].data["servo_gain"].tolist()) == {4.0}
    assert any("gains of the firmware (kp) of 200, 800" in note for note in found.notes)


# What a file may not do


class Harmful:
    def __reduce__(self):
        return exec, ("raise SystemExit('executed')",)


def test_a_pickle_that_names_a_function_is_refused_and_not_executed(tmp_path):
    file = files.torch_archive(tmp_path / "log.pt", {"a": Harmful()})
    with pytest.raises(kr5.FileError, match=r"it names \w+\.exec, which is no tensor, and is not executed"):
        read_log(file)


def test_a_tensor_beyond_its_storage_is_refused(tmp_path):
    tensor = files.FakeTensor("0", np.zeros((10, 3)))
    file = files.torch_archive(tmp_path / "log.pt", {"a": tensor})
    tensor.values = np.zeros((4, 3), np.float32)
    large = files.torch_archive(tmp_path / "cut.pt", {"a": files.FakeTensor("0", np.zeros((10, 3)))})
    data = large.read_bytes()
    assert list(read_log(file).columns) == ["a[0]", "a[1]", "a[2]"]
    large.write_bytes(data[: len(data) // 2])
    with pytest.raises(kr5.FileError, match="cannot be read as tensors of PyTorch"):
        read_log(large)


@pytest.mark.parametrize("ending", ["parquet", "hdf5", "h5", "pt", "json"])
def test_damaged_files_are_refused_by_name(ending, tmp_path):
    file = tmp_path / f"log.{ending}"
    file.write_bytes(b"no such format at all" * 10)
    with pytest.raises(kr5.FileError, match=f"log.{ending}"):
        read_log(file)


@pytest.mark.parametrize(("ending", "package", "extra"), [("parquet", "pyarrow", "parquet"), ("hdf5", "h5py", "hdf5")])
def test_without_the_package_the_extra_is_named(ending, package, extra, monkeypatch, motions, tmp_path):
    file = (files.plain_parquet if ending == "parquet" else files.aloha)(tmp_path, motions)
    for name in [n for n in sys.modules if n.split(".")[0] == package]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(kr5.FileError, match=rf"the package {package} is needed: pip install 'kr5\[{extra}\]'"):
        read_log(file)


def test_vectors_of_different_lengths_are_refused(motions, tmp_path):
    m = motions[0]
    rows = [row.tolist() for row in m.qc]
    rows[100] = rows[100][:2]
    file = files.write_parquet(tmp_path / "log.parquet", {"timestamp": m.t, "action": rows, "state": list(m.q)})
    with pytest.raises(kr5.FileError, match=r"log.parquet: column 'action': found vectors of different lengths"):
        read_log(file)


def test_a_list_of_another_length_in_a_cell_is_refused_with_its_line(motions, tmp_path):
    files.sage(tmp_path, motions)
    table = tmp_path / "control.csv"
    lines = table.read_text().splitlines()
    head, _, _ = lines[5].partition('"')
    lines[5] = f'{head}"[0.1, 0.2]"'
    table.write_text("\n".join(lines) + "\n")
    with pytest.raises(kr5.FileError, match=r"control.csv: line 6, .*expected a list of 4 numbers"):
        read_log(tmp_path)


def test_columns_without_names_are_asked_for_in_words(motions, model, tmp_path):
    log = files.headerless(tmp_path, motions)
    with pytest.raises(
        kr5.FileError, match="line 1: found only numbers, expected the names of its 7 columns.*--columns"
    ):
        read_logs(log, model)
    with pytest.raises(kr5.InvalidArgument, match="found 7 columns, expected the 6 that are named"):
        read_logs(log, model, columns="t,cmd{1-3},pos{1-2}")


@pytest.mark.parametrize("what", ["images alone", "no row"])
def test_an_hdf5_without_numbers_is_refused(what, tmp_path):
    import h5py

    with h5py.File(tmp_path / "log.hdf5", "w") as file:
        if what == "no row":
            file["observations/qpos"], file["action"] = np.zeros((0, 4)), np.zeros((0, 4))
        else:
            file["observations/images/top"] = np.zeros((50, 4, 6, 3), np.uint8)
    with pytest.raises(kr5.FileError, match="contains no array of numbers with a row an instant"):
        read_log(tmp_path / "log.hdf5")


@pytest.mark.parametrize("form", ["lerobot v2.1", "robomimic"])
def test_an_episode_that_is_not_there_is_refused_with_those_that_are(form, motions, model, tmp_path):
    data_set = FORMS[form][0](tmp_path, motions)
    with pytest.raises(kr5.FileError, match="has no episode 9; it has 3, from 0 to 2: --episodes 0-2"):
        read_logs(data_set, model, episodes="9")
    if form.startswith("lerobot"):
        (data_set / "meta" / "info.json").write_text("{")
        with pytest.raises(kr5.FileError, match=r"info.json: is no JSON"):
            read_logs(data_set, model, episodes="0")


READ = """
import resource, sys
from pathlib import Path
import h5py, pyarrow.parquet
from kr5.logs import row_chunks
from kr5.logs.log_file import read_log

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10

row_chunks.MOST_NUMBERS = int(sys.argv[2])
before = peak()
log = read_log(Path(sys.argv[1]))
print(max(len(v) for v in log.columns.values()), peak() - before)
"""


def read_apart(file, most_numbers):
    """Rows of the log, and by what the memory of a process grows at most that reads it [B]."""
    words = [sys.executable, "-c", READ, str(file), str(most_numbers)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return [int(word) for word in done.stdout.split()]


def test_of_a_table_larger_than_what_is_kept_the_joints_alone_are_read(tmp_path):
    import pyarrow
    import pyarrow.parquet

    rows, groups, width = 10_000, 10, 60
    names = ["time", *(f"cmd{k}" for k in range(6)), *(f"pos{k}" for k in range(6)), *(f"x{k}" for k in range(width))]
    schema = pyarrow.schema([(name, pyarrow.float64()) for name in names])
    random = np.random.default_rng(1)
    file = tmp_path / "log.parquet"
    with pyarrow.parquet.ParquetWriter(file, schema) as writer:
        for g in range(groups):
            columns = [np.arange(rows) + g * rows, *random.normal(size=(len(names) - 1, rows))]
            writer.write_table(pyarrow.table(dict(zip(names, columns)), schema))
    size = file.stat().st_size
    assert size > 55 << 20
    found, grown = read_apart(file, most_numbers=rows * groups * 13)
    assert found == rows * groups and grown < 0.7 * size
    found, _ = read_apart(file, most_numbers=rows * groups * 13 // 2)
    assert found == rows * groups // 2


READ_AS_A_MOTION = """
import resource, sys
from kr5.logs import read_logs

found = read_logs(sys.argv[1], sys.argv[2])
print(any("of which the first" in note for note in found.notes))
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10)
"""


@pytest.fixture(scope="module")
def large_table(tmp_path_factory):
    """Commands and positions of three joints, more than are kept of a log."""
    import pyarrow
    import pyarrow.parquet

    file, rows, groups = tmp_path_factory.mktemp("large") / "log.parquet", 250_000, 10
    vector = pyarrow.list_(pyarrow.float64(), 3)
    schema = pyarrow.schema([("timestamp", pyarrow.float64()), ("action", vector), ("observation.state", vector)])
    random = np.random.default_rng(1)
    with pyarrow.parquet.ParquetWriter(file, schema, use_dictionary=False) as writer:
        for g in range(groups):
            t = 0.02 * (g * rows + np.arange(rows))
            q = 0.5 * np.sin(np.outer(t, [0.3, 0.5, 0.7]))
            late = [q + 1e-3 * random.normal(size=q.shape), 0.5 * np.sin(np.outer(t - 0.05, [0.3, 0.5, 0.7]))]
            columns = [pyarrow.FixedSizeListArray.from_arrays(values.ravel(), 3) for values in late]
            writer.write_table(pyarrow.table([t, *columns], schema=schema), row_group_size=rows)
    assert rows * groups * 7 > row_chunks.MOST_NUMBERS
    return file, rows * groups


def test_the_numbers_of_a_table_are_held_once(large_table):
    file, rows = large_table
    found, grown = read_apart(file, most_numbers=rows * 7)
    assert found == rows and grown < 2 * 8 * 7 * rows


def test_a_log_of_more_than_is_kept_takes_less_than_a_gibibyte(large_table, model):
    words = [sys.executable, "-c", READ_AS_A_MOTION, str(large_table[0]), str(model)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    cut, peak = done.stdout.split()
    assert cut == "True" and int(peak) < 1 << 30


def test_of_a_set_with_images_the_vectors_alone_are_read(tmp_path, motions):
    import h5py

    file = files.aloha(tmp_path, motions)
    with h5py.File(file, "a") as opened:
        del opened["observations/images/top"]
        opened["observations/images/top"] = np.full((len(motions[0].t), 120, 160, 3), 7, np.uint8)
    size = file.stat().st_size
    assert size > 50 << 20
    found, grown = read_apart(file, most_numbers=1_000_000)
    assert found == len(motions[0].t) and grown < 0.2 * size


# Public data


def test_the_public_so101_is_read_from_folders(reference, tmp_path):
    folder = reference / "data" / "servo_so101_sage"
    if not folder.is_dir():
        pytest.skip(f"no public data: {folder}")
    log = read_log(folder / "pick_place")
    assert len(log.arrays["state.positions"]) == 6 and log.labels["command.positions.Jaw"] == "Jaw"
    times = log.columns[log.clocks["state_motor"]]
    assert len(times) == 4840 and 0.0195 < np.median(np.diff(times)) < 0.0205


def test_the_public_xl330_is_read_from_json(reference):
    folder = reference / "data" / "servo_xl330_bam"
    if not folder.is_dir():
        pytest.skip(f"no public data: {folder}")
    for file in sorted(folder.glob("*.json")):
        log = read_log(file)
        assert {"timestamp", "position", "goal_position"} <= set(log.columns)
        assert (log.columns["torque_enable"] == 1).all()


# Topics of ROS 2 control

POINT = """
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
"""
STATE = """
std_msgs/Header header
string[] joint_names
control_test_msgs/Point reference
control_test_msgs/Point feedback
control_test_msgs/Point error
control_test_msgs/Point output
"""


@pytest.fixture
def control(ros):
    """Messages with the fields of control_msgs/JointTrajectoryControllerState, which rosbags does not have."""
    from rosbags.typesys import get_types_from_msg

    ros.register(get_types_from_msg(POINT, "control_test_msgs/msg/Point"))
    ros.register(get_types_from_msg(STATE, "control_test_msgs/msg/ControllerState"))
    return ros


def controller_state(ros, t, qc, q, turned):
    T = ros.types
    none = np.zeros(0)

    def point(values):
        return T["control_test_msgs/msg/Point"](
            positions=np.asarray(values, float)[turned], velocities=none, accelerations=none, effort=none
        )

    stamp = T["builtin_interfaces/msg/Time"](sec=int(t), nanosec=round((t - int(t)) * 1e9))
    return T["control_test_msgs/msg/ControllerState"](
        header=T["std_msgs/msg/Header"](stamp=stamp, frame_id=""),
        joint_names=[files.NAMES[k] for k in turned],
        reference=point(qc),
        feedback=point(q),
        error=point(qc - q),
        output=point(0 * q),
    )


def control_bag(folder, ros, m, first=0, last=None):
    topic, kind = "/arm_controller/controller_state", "control_test_msgs/msg/ControllerState"
    rows = list(zip(m.t, m.qc, m.q))[first:last]
    messages = [(topic, 1.7e9 + t, controller_state(ros, 1.7e9 + t, qc, q, [2, 0, 1])) for t, qc, q in rows]
    return written_bag(folder, ros, {topic: kind}, messages)


def test_reference_and_feedback_of_a_controller_are_commands_and_positions(control, motions, model, tmp_path):
    found = read_logs(control_bag(tmp_path / "bag", control, motions[0]), model)
    assert_holds(found.recording.experiments, motions[0])


def test_a_link_beside_a_bag_to_what_is_gone_does_not_matter(control, motions, model, tmp_path):
    bag = control_bag(tmp_path / "bag", control, motions[0])
    (bag / "latest").symlink_to("gone")
    assert_holds(read_logs(bag, model).recording.experiments, motions[0])


def test_the_parts_of_a_split_bag_in_one_folder_are_one_log(control, motions, model, tmp_path):
    half = len(motions[0].t) // 2
    parts = [
        control_bag(tmp_path / "a", control, motions[0], 0, half),
        control_bag(tmp_path / "b", control, motions[0], half),
    ]
    (tmp_path / "split").mkdir()
    for k, part in enumerate(parts):
        next(part.glob("*.db3")).rename(tmp_path / "split" / f"split_{k}.db3")
    found = read_logs(tmp_path / "split", model)
    assert_holds(found.recording.experiments, motions[0])
