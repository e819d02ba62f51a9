"""Mistakes in logs of commands and positions: each is said in words, with what to type, and no cause is named."""

import re
import shlex

import kr5
import numpy as np
import pytest
from kr5.logs import read_logs, read_motion_log

import mujoco_servo_log
import servo_log_files as files
from arm_logs import QUICK, refused

DEGREE = np.pi / 180


@pytest.fixture(scope="module")
def motion():
    return files.moved(seed=11)


@pytest.fixture
def model(tmp_path):
    return files.file_of(tmp_path, files.servo_arm())


def log_of(tmp_path, t, **families):
    """A CSV with columns cmd1 ... and pos1 ..., or others by their names."""
    columns = {"t": t} | {f"{stem}{k + 1}": v for stem, values in families.items() for k, v in enumerate(values.T)}
    file = tmp_path / "log.csv"
    np.savetxt(file, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="")
    return file


def remedy_of(error):
    """The option that the text of an error names, as it is typed."""
    match = re.search(r"--set ('[^']*'|\S+)(?: --set ('[^']*'|\S+))?", str(error))
    assert match, error
    return [shlex.split(word)[0].rstrip(",") for word in match.groups() if word]


def problem(log, model, **options):
    with pytest.raises((kr5.Error, kr5.Errors)) as error:
        read_logs(log, model, **options)
    return error.value


def positions(recording):
    return np.vstack([np.column_stack([e[f"q{k + 1}"] for k in range(3)]) for e in recording.experiments])


def test_a_log_without_commands_and_efforts_is_refused(diagnose, motion, model, tmp_path):
    log = log_of(tmp_path, motion.t, pos=motion.q)
    refused(diagnose, log, "--model", model, *QUICK, text=("found no efforts or currents", "columns.tau.from"))


def test_commands_that_are_the_measurements_are_a_passive_log(diagnose, motion, model, tmp_path):
    for shift in (0, 1):
        qc = np.vstack([motion.q[shift:], motion.q[:shift]])[: len(motion.t) - shift]
        log = log_of(tmp_path, motion.t[: len(qc)], cmd=qc, pos=motion.q[: len(qc)])
        refused(
            diagnose,
            log,
            *("--model", model, *QUICK),
            text=("found the ", "the log is of an arm that was led", "--set columns.qc.from=measured"),
        )


def test_commands_that_are_speeds_are_told(diagnose, motion, model, tmp_path):
    log = log_of(tmp_path, motion.t, cmd=np.gradient(motion.qc, motion.t, axis=0), pos=motion.q)
    refused(diagnose, log, "--model", model, *QUICK, text=("are they speeds", "--set columns.qc.from=measured"))


def test_poses_of_the_tool_as_actions_are_told(diagnose, motion, model, tmp_path):
    tool = np.column_stack([0.1 * np.cos(3 * motion.t), 0.1 * np.sin(2 * motion.t), 0.2 + 0.1 * np.sin(5 * motion.t)])
    log = log_of(tmp_path, motion.t, action=tool, pos=motion.q)
    refused(diagnose, log, "--model", model, *QUICK, text=("do not follow", "are they poses of the tool"))


def test_normalised_actions_are_told_with_what_brings_them_to_radians(motion, model, tmp_path):
    scale, middle = np.array([2.2, 2.0, 2.4]), 0.3
    log = log_of(tmp_path, motion.t, action=(motion.qc - middle) / scale, pos=motion.q)
    error = problem(log, model)
    assert "in the unit of the positions" in str(error)
    found = read_logs(log, model, settings=remedy_of(error))
    off = [e[f"qc{k + 1}"] - e[f"q{k + 1}"] for e in found.recording.experiments for k in range(3)]
    assert max(np.abs(x).mean() for x in off) < 0.25


@pytest.mark.parametrize("order", [[1, 0, 2], [2, 1, 0], [1, 2, 0], [2, 0, 1]], ids=str)
@pytest.mark.parametrize("named", ["neither", "positions", "commands"])
def test_joints_in_another_order_are_told_with_the_order_that_is_read(order, named, motion, model, tmp_path):
    wrong = "qc" if named == "positions" else "q"  # columns that name joints stand in the order of the model
    values = {"qc": motion.qc, "q": motion.q}
    values[wrong] = values[wrong][:, order]
    stems = {
        "qc": [f"cmd_{name}" for name in files.NAMES] if named == "commands" else ["cmd1", "cmd2", "cmd3"],
        "q": [f"position_{name}" for name in files.NAMES] if named == "positions" else ["pos1", "pos2", "pos3"],
    }
    log = tmp_path / "log.csv"
    table = np.column_stack([motion.t, values["qc"], values["q"]])
    np.savetxt(log, table, delimiter=",", header=",".join(["t", *stems["qc"], *stems["q"]]), comments="")
    error = problem(log, model)
    assert "exchange their names" in str(error)
    remedy = remedy_of(error)[0]
    assert remedy.startswith(f"columns.{wrong}.from=[")
    assert ("where the positions are in the order of the model" in str(error)) == (named == "neither")
    q = positions(read_logs(log, model, settings=[remedy]).recording)
    assert np.abs(q - motion.q[: len(q)]).max() < 1e-9


def test_components_of_vectors_are_exchanged_by_their_names(motion, model, tmp_path):
    pytest.importorskip("h5py", reason="pip install 'kr5[hdf5]'")
    other = files.Motion(motion.t, motion.qc, motion.q[:, [1, 0, 2]])
    log = files.aloha(tmp_path, [other])
    error = problem(log, model, every=1 / files.RATE)
    (remedy, *_) = remedy_of(error)
    q = positions(read_logs(log, model, settings=[remedy], every=1 / files.RATE).recording)
    assert np.abs(q - motion.q[: len(q)]).max() < 1e-9


def test_a_joint_that_never_moves_is_named(diagnose, motion, model, tmp_path):
    q = motion.q.copy()
    q[:, 1] = q[0, 1]
    log = log_of(tmp_path, motion.t, cmd=motion.qc, pos=q)
    refused(diagnose, log, "--model", model, *QUICK, text=("q2 (shoulder_lift)", "was its motor on"))


OFF = 777  # row from which on the motor of a joint is switched off


@pytest.fixture(scope="module")
def falling():
    """A motion in which the motor of the shoulder is switched off midway."""
    stiff = files.servo_arm()
    servo = stiff.servo
    servo.torque = [type(s)(stiffness=200.0, damping=5.0) for s in servo.torque]
    stiff.servo = servo
    out = files.moved(seed=12, cell=stiff)
    out.qc[OFF:, 1] = 0.9
    out.q[OFF:, 1] = out.q[OFF, 1] - 1.2 * (1 - np.exp(-10 * (out.t[OFF:] - out.t[OFF])))
    return out


def spans(recording):
    """Duration of the experiments of each file or episode, in their order [s]."""
    return [float(e["t"][-1]) for e in recording.experiments]


def assert_cut(error, log, model, entry, **options):
    """The remedy that is typed leaves out the rows without a motor, and no others."""
    assert "with its motor switched off" in str(error)
    (remedy,) = remedy_of(error)
    key, _, end = remedy.partition("=")
    assert key == entry
    found, end = read_logs(log, model, settings=[remedy], **options), float(end)
    assert (OFF - 1) / files.RATE <= end < OFF / files.RATE + 0.5
    assert any(item.startswith("end") and proposal == f"{end:g} s" for item, proposal, _ in found.reasons)
    return found.recording


def test_a_motor_switched_off_midway_is_named_with_a_cut_that_is_read(falling, model, tmp_path):
    log = log_of(tmp_path, falling.t, cmd=falling.qc, pos=falling.q)
    cut = assert_cut(problem(log, model), log, model, "end")
    assert {str(e.split) for e in cut.experiments} == {"fit", "check"}
    assert max(spans(cut)) < OFF / files.RATE + 0.5


def test_of_several_logs_the_one_without_a_motor_is_cut(motion, falling, model, tmp_path):
    logs = []
    for k, (m, begin) in enumerate([(motion, 40.0), (falling, 70.0), (motion, 100.0)]):  # by one clock
        (tmp_path / f"{k}").mkdir()
        log = log_of(tmp_path / f"{k}", begin + m.t, cmd=m.qc, pos=m.q)
        logs.append(log.rename(log.with_name(f"run{k}.csv")))
    cut = assert_cut(problem(logs, model), logs, model, "end.run1.csv")
    whole = motion.t[-1] + 0.1
    for end, begin, least, most in zip(
        spans(cut), (40, 70, 100), (19, 15, 19), (whole, OFF / files.RATE + 0.5, whole), strict=True
    ):
        assert begin + least < end < begin + most


def test_of_logs_of_one_name_the_one_that_is_cut_is_named_by_its_folder(motion, falling, model, tmp_path):
    logs = []
    for folder, m in (("a", motion), ("b", falling)):
        (tmp_path / folder).mkdir()
        logs.append(log_of(tmp_path / folder, m.t, cmd=m.qc, pos=m.q))
    cut = assert_cut(problem(logs, model), logs, model, f"end.{logs[1]}")
    assert spans(cut)[0] > 19 > OFF / files.RATE + 0.5 > spans(cut)[1]


@pytest.mark.parametrize("chosen", ["1", "0-1"])
def test_of_a_data_set_the_episode_without_a_motor_is_cut(chosen, motion, falling, model, tmp_path):
    pytest.importorskip("pyarrow", reason="pip install 'kr5[parquet]'")
    data_set = files.lerobot_3(tmp_path / "set", [motion, falling])
    error = problem(data_set, model, episodes=chosen)
    cut = assert_cut(error, data_set, model, "end" if chosen == "1" else "end.1", episodes=chosen)
    assert spans(cut)[-1] < OFF / files.RATE + 0.5
    assert chosen == "1" or spans(cut)[0] > 19


def test_an_end_of_no_log_is_refused(motion, model, tmp_path):
    log = log_of(tmp_path, motion.t, cmd=motion.qc, pos=motion.q)
    for setting, text in (
        ("end.other.csv=3", "names none of the logs: log.csv"),
        ("end=-1", "expected the seconds from the beginning of the log"),
        ("end=soon", "expected the seconds from the beginning of the log"),
    ):
        with pytest.raises(kr5.InvalidArgument, match=text):
            read_logs(log, model, settings=[setting])


def test_times_that_count_rows_are_asked_for(diagnose, motion, model, tmp_path):
    log = log_of(tmp_path, np.arange(len(motion.t)), cmd=motion.qc, pos=motion.q)
    refused(diagnose, log, "--model", model, *QUICK, text=("t counts rows", "--every SECONDS"))
    assert read_logs(log, model, every=0.02).recording.experiments


def test_of_a_log_without_a_clock_the_interval_is_asked_for(diagnose, motion, model, tmp_path):
    log = tmp_path / "log.csv"
    head = ",".join(f"{stem}{k}" for stem in ("cmd", "pos") for k in (1, 2, 3))
    np.savetxt(log, np.column_stack([motion.qc, motion.q]), delimiter=",", header=head, comments="")
    refused(diagnose, log, "--model", model, *QUICK, text=("no column looks like time", "--every SECONDS"))
    found = read_logs(log, model, every=1 / files.RATE)
    assert max(float(e["t"][-1]) for e in found.recording.experiments) == pytest.approx(motion.t[-1], abs=0.02)


def test_the_time_step_of_a_simulator_is_no_interval_of_a_log(diagnose, motion, tmp_path):
    pytest.importorskip("mujoco", reason="pip install 'kr5[mujoco]'")
    mujoco_servo_log.write_servo_log(tmp_path)
    table = np.loadtxt(tmp_path / "log.csv", delimiter=",", skiprows=1)
    head = "cmd_shoulder,cmd_elbow,position_shoulder,position_elbow"
    np.savetxt(tmp_path / "bare.csv", table[:, 1:], delimiter=",", header=head, comments="")
    model = tmp_path / "true.xml"
    refused(diagnose, tmp_path / "bare.csv", "--model", model, *QUICK, text=("no column looks like time", "--every"))
    found = read_logs(tmp_path / "bare.csv", model, every=0.02)
    assert max(float(e["t"][-1]) for e in found.recording.experiments) == pytest.approx(table[-1, 0], abs=0.02)


@pytest.mark.parametrize("unit", [1e3, 1e6, 1e9])
def test_times_in_fractions_of_seconds_are_recognised(unit, motion, model, tmp_path):
    found = read_logs(log_of(tmp_path, np.round(unit * motion.t), cmd=motion.qc, pos=motion.q), model)
    assert max(float(e["t"][-1]) for e in found.recording.experiments) == pytest.approx(motion.t[-1], abs=0.02)


@pytest.mark.parametrize("unit", [1e3, 1e6, 1e9])
def test_times_of_an_hdf5_in_fractions_of_seconds_are_recognised(unit, motion, model, tmp_path):
    log = timed_hdf5(tmp_path, motion, np.round(1.7e9 * unit + unit * motion.t).astype(np.int64))
    found = read_logs(log, model)
    assert max(float(e["t"][-1]) for e in found.recording.experiments) == pytest.approx(motion.t[-1], abs=0.02)


def test_times_of_an_hdf5_that_count_rows_are_asked_for(diagnose, motion, model, tmp_path):
    log = timed_hdf5(tmp_path, motion, np.arange(len(motion.t)))
    refused(diagnose, log, "--model", model, *QUICK, text=("timestamp counts rows", "--every SECONDS"))


def timed_hdf5(folder, motion, stamps):
    h5py = pytest.importorskip("h5py", reason="pip install 'kr5[hdf5]'")
    with h5py.File(folder / "log.h5", "w") as file:
        file["action"], file["observations/qpos"], file["timestamp"] = motion.qc, motion.q, stamps
    return folder / "log.h5"


def test_of_commands_that_lack_a_row_the_interval_of_both_is_typed(motion, model, tmp_path):
    h5py = pytest.importorskip("h5py", reason="pip install 'kr5[hdf5]'")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["action"], file["observations/qpos"] = motion.qc[:-1], motion.q
    error = problem(tmp_path / "log.h5", model, every=1 / files.RATE)
    assert f"observations/qpos[0] and similar columns have {len(motion.t)} rows beside a clock of" in str(error)
    found = read_logs(tmp_path / "log.h5", model, every=1 / files.RATE, settings=remedy_of(error))
    q = positions(found.recording)
    assert len(q) > 0.85 * len(motion.t) and np.abs(q - motion.q[: len(q)]).max() < 1e-9


def test_tensors_with_other_rows_than_their_times_are_told(motion, model, tmp_path):
    content = {"time": motion.t, "dof_pos": motion.q[:-3], "des_dof_pos": motion.qc}
    tensors = {name: files.FakeTensor(str(k), values) for k, (name, values) in enumerate(content.items())}
    error = problem(files.torch_archive(tmp_path / "log.pt", tensors), model)
    assert f"dof_pos[0] has {len(motion.t) - 3} rows, and time, which looks like time, {len(motion.t)}" in str(error)


@pytest.mark.parametrize("write", [files.aloha, files.lerobot_3, files.sage], ids=lambda write: write.__name__)
def test_mistakes_are_told_whatever_the_format(write, motion, model, tmp_path):
    pytest.importorskip("h5py", reason="pip install 'kr5[hdf5]'")
    pytest.importorskip("pyarrow", reason="pip install 'kr5[parquet]'")
    options = {"every": 1 / files.RATE} if write is files.aloha else {}
    speeds = np.gradient(motion.qc, motion.t, axis=0)
    for k, (commands, told) in enumerate(
        [(motion.q, "the log is of an arm that was led"), (speeds, "are they speeds")]
    ):
        folder = tmp_path / str(k)
        folder.mkdir()
        error = problem(write(folder, [files.Motion(motion.t, commands, motion.q)]), model, **options)
        assert told in str(error) and "--set columns.qc.from=measured" in str(error)


def test_a_servo_too_weak_for_its_link_is_named_as_a_joint_that_does_not_move(diagnose, model, tmp_path):
    weak = files.servo_arm()
    servo = weak.servo
    limits = [1.0, 0.06, 1.0]  # less than the weight that the shoulder bears
    (alike,) = servo.torque  # of all joints
    given = {"stiffness": alike.stiffness, "damping": alike.damping}
    servo.torque = [kr5.cell.TorqueServo(**given, torque_limit=limit) for limit in limits]
    weak.servo = servo
    m = files.moved(seed=5, cell=weak)
    log = log_of(tmp_path, m.t, cmd=m.qc, pos=m.q)
    refused(diagnose, log, "--model", model, *QUICK, text=("q2 (shoulder_lift)", "found a joint that moves by"))


def test_counts_of_an_encoder_are_recognised(motion, model, tmp_path):
    counts = np.round(2048 + motion.qc / files.TICK), np.round(2048 + motion.q / files.TICK)
    found = read_logs(log_of(tmp_path, motion.t, cmd=counts[0], pos=counts[1]), model)
    q = positions(found.recording)
    assert np.abs(q - motion.q[: len(q)]).max() < 1e-9


def test_degrees_are_recognised_also_of_small_commands(motion, model, tmp_path):
    small = files.Motion(motion.t, 0.15 * motion.qc / DEGREE, motion.q / DEGREE)
    found = read_motion_log(log_of(tmp_path, motion.t, cmd=small.qc, pos=small.q), files.servo_arm())
    assert found.units == {"positions": "deg", "commands": "deg"}
    assert np.abs(found.commands - 0.15 * motion.qc).max() < 1e-9


def test_per_cent_of_the_range_is_recognised_where_it_rests_at_its_end(motion, model, tmp_path):
    high = np.array([2.2, 2.0, 2.4])
    held = np.clip(100 * 3.4 * motion.q / high, -100, 100), np.clip(100 * 3.4 * motion.qc / high, -100, 100)
    found = read_motion_log(log_of(tmp_path, motion.t, cmd=held[1], pos=held[0]), files.servo_arm())
    assert found.units["positions"] == "signed_percent"
    assert np.abs(found.positions - held[0] / 100 * high).max() < 1e-9


def test_of_lerobot_degrees_or_per_cent_are_asked_for(motion, model, tmp_path):
    pytest.importorskip("pyarrow", reason="pip install 'kr5[parquet]'")
    high = np.array([2.2, 2.0, 2.4])
    percent = files.Motion(motion.t, 100 * motion.qc / high, 100 * motion.q / high)
    log = files.lerobot_3(tmp_path / "set", [percent], suffix=".pos")
    error = problem(log, model)
    assert "may be degrees, or per cent of the range" in str(error)
    assert "--set columns.qc.unit=deg" in str(error) and "--set columns.qc.unit=signed_percent" in str(error)
    units = [f"columns.{family}.unit=signed_percent" for family in ("q", "qc")]
    found = read_logs(log, model, settings=units)
    q = positions(found.recording)
    assert np.abs(q - motion.q[: len(q)]).max() < 1e-5


# The motion of any log


def test_the_motion_of_a_log_is_read_with_its_arm_and_without(motion, tmp_path):
    pytest.importorskip("h5py", reason="pip install 'kr5[hdf5]'")
    log = files.droid(tmp_path, [motion])
    for cell in (files.servo_arm(), None):
        found = read_motion_log(log, cell)
        assert np.abs(found.positions - motion.q).max() < 1e-12 and np.abs(found.commands - motion.qc).max() < 1e-12
        assert np.abs(found.times - motion.t).max() < 1e-3
        assert found.names == (files.NAMES if cell else ["joint1", "joint2", "joint3"])
        assert found.columns["commands"] == [f"action/joint_position[{k}]" for k in range(3)]


def test_without_an_arm_a_gripper_is_left_out_by_its_name(motion, tmp_path):
    found = read_motion_log(files.sage(tmp_path, [motion]))
    assert found.names == files.NAMES and found.positions.shape == motion.q.shape
    assert any("gripper" in note for note in found.notes)
