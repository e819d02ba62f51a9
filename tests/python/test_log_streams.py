"""Logs of several streams, names and clocks as publishers and exports write them, and what the user states of them."""

import re

import kr5.cell
import numpy as np
import pytest
from kr5.logs.column_names import find_families
from kr5.logs.kind_guess import log_parts
from kr5.logs.log import Log
from kr5.logs.log_file import read_log
from kr5.logs.map_guess import guess_map
from kr5.logs.messages import MessageTable

from arm_logs import NAMES, QUICK, STATES, case_logs, joint_states, moved, refused, state, swing, written_bag

EPOCH = 1_700_000_000
WRENCH = {"/wrench": "geometry_msgs/msg/WrenchStamped"}


def stop_and_go(t, from_, to):
    """The swing of the arm, with a rest."""
    share = 1 / (1 + np.exp((t - from_) / 0.05)) + 1 / (1 + np.exp((to - t) / 0.05))
    return swing(np.concatenate([[0.0], np.cumsum(share[1:] * np.diff(t))]))


def wrench(ros, t):
    T = ros.types
    stamp = T["builtin_interfaces/msg/Time"](sec=int(t), nanosec=round((t - int(t)) * 1e9))
    zero = T["geometry_msgs/msg/Vector3"](x=0.1, y=0.2, z=0.3)
    return T["geometry_msgs/msg/WrenchStamped"](
        header=T["std_msgs/msg/Header"](stamp=stamp, frame_id=""),
        wrench=T["geometry_msgs/msg/Wrench"](force=zero, torque=zero),
    )


def guessed(files, cell, tmp_path):
    return guess_map(files, cell, tmp_path / "cell.yaml").entry


# One origin of time


def test_a_topic_that_begins_earlier_moves_no_cut(named_arm, tmp_path, ros):
    t = 0.008 * np.arange(1500)
    q = stop_and_go(t, 8.0, 9.5)
    tau = np.zeros(6)
    messages = [("/joint_states", EPOCH + a, state(ros, EPOCH + a, NAMES, b, tau)) for a, b in zip(t, q)]
    messages += [("/wrench", EPOCH + a - 7.0, wrench(ros, EPOCH + a - 7.0)) for a in np.arange(0, 19, 0.1)]
    bag = written_bag(tmp_path / "bag", ros, STATES | WRENCH, messages)
    fit, check = guessed([bag], named_arm, tmp_path)["experiments"]
    assert fit["to"] == check["from"] and 8.0 < fit["to"] - 7.0 < 9.5


def test_rows_without_positions_before_the_first_move_no_cut(named_arm, tmp_path):
    t = 0.008 * np.arange(1500)
    q = stop_and_go(t, 8.0, 9.5)
    q[:400] = np.nan
    case_logs.write_csv(tmp_path / "log.csv", joint_states(t, q, np.ones_like(q)))
    fit, _ = guessed([tmp_path / "log.csv"], named_arm, tmp_path)["experiments"]
    assert 8.0 < fit["to"] < 9.5


def test_commands_and_states_of_different_rates_are_cut_at_a_rest(share, tmp_path):
    cell = case_logs.named(kr5.cell.load_cell(share / "cells" / "kr5_arc.yaml"))
    t, fine = 0.012 * np.arange(1000), 0.004 * np.arange(3000)
    log = Log(tmp_path / "log")
    for topic, times in (("/joint_states", t), ("/arm/joint_commands", fine)):
        log.add(f"{topic}:header.stamp", EPOCH + times, topic)
        log.clocks[topic] = f"{topic}:header.stamp"
        for name, values in zip(NAMES, stop_and_go(times, 8.0, 9.5).T):
            log.add(f"{topic}:position.{name}", values, topic)
    parts, families = log_parts(log, NAMES, 6)
    assert families.first("qc").columns[0].startswith("/arm/joint_commands")
    from kr5.logs import map_guess
    from kr5.logs.overrides import GivenEntries

    out = map_guess.GuessedMap({})
    raw, _, _ = map_guess._read_part(parts[0], cell, GivenEntries(), out, "log")
    assert len(raw.motion.t) == len(t) and np.allclose(np.diff(raw.motion.t), 0.012, atol=1e-6)
    assert raw.motion.commanded


# What the user states is taken before the rest is guessed


def csv(tmp_path, columns, name="log.csv"):
    return case_logs.write_csv(tmp_path / name, columns).name


def test_columns_that_are_named_as_the_error_says_are_read(diagnose, named_arm, named_urdf, tmp_path):
    t, q, tau = moved(named_arm, rows=900)
    columns = {"time": t} | {f"alpha_{k}": q[:, k] for k in range(6)} | {f"beta_{k}": tau[:, k] for k in range(6)}
    log = csv(tmp_path, columns)
    refused(diagnose, log, "--model", named_urdf, text="--set 'columns.q.from=[...]'")
    names = [f"columns.q.from=[{','.join(f'alpha_{k}' for k in range(6))}]", "columns.tau.from=beta_{0}"]
    code, said, data = diagnose(log, "--model", named_urdf, "--set", names[0], "--set", names[1], *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_columns_of_joints_of_other_names_are_read_when_they_are_named(diagnose, named_arm, named_urdf, tmp_path):
    parts = ["base_turn", "upper", "lower", "roll", "nod", "spin"]
    log = csv(tmp_path, joint_states(*moved(named_arm, rows=900), names=parts))
    refused(
        diagnose, log, "--model", named_urdf, text=("--set 'columns.q.from=[...]'", "--set 'columns.tau.from=[...]'")
    )
    named = [
        f"columns.{family}.from=[{','.join(f'/joint_states/{p}/{word}' for p in parts)}]"
        for family, word in (("q", "position"), ("tau", "effort"))
    ]
    code, said, data = diagnose(log, "--model", named_urdf, "--set", named[0], "--set", named[1], *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_efforts_in_percent_are_read_once_their_scale_is_stated(diagnose, named_arm, named_urdf, tmp_path):
    t, q, tau = moved(named_arm, rows=900)
    rated = np.array([200.0, 300.0, 150.0, 40.0, 20.0, 10.0])
    columns = {"t": t} | {f"pos_{k + 1}": q[:, k] for k in range(6)}
    columns |= {f"torque_{k + 1}_%": 100 * tau[:, k] / rated[k] for k in range(6)}
    log = csv(tmp_path, columns)
    said = refused(diagnose, log, "--model", named_urdf, text="found per cent of a rated value")
    assert "--set 'columns.tau.scale=[...]'" in said and "--set 'columns.tau.unit=N m'" in said
    scale = f"columns.tau.scale=[{','.join(f'{r / 100:g}' for r in rated)}]"
    for more in ([], ["--set", "columns.tau.unit=N m"]):
        code, said, data = diagnose(log, "--model", named_urdf, "--set", scale, *more, *QUICK)
        assert code == 0 and data["verdict"] == "no_gap", said


def test_factors_that_differ_by_joint_are_mended_by_the_scale_that_is_asked_for(
    diagnose, named_arm, named_urdf, tmp_path
):
    t, q, tau = moved(named_arm, rows=900)
    rated = np.array([200.0, 300.0, 150.0, 40.0, 20.0, 10.0])
    columns = {"t": t} | {f"q{k + 1}": q[:, k] for k in range(6)}
    columns |= {f"effort{k + 1}": 100 * tau[:, k] / rated[k] for k in range(6)}
    log = csv(tmp_path, columns)
    refused(diagnose, log, "--model", named_urdf, text="a different factor for each joint")
    scale = f"columns.tau.scale=[{','.join(f'{r / 100:g}' for r in rated)}]"
    code, said, data = diagnose(log, "--model", named_urdf, "--set", scale, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_a_clock_that_does_not_go_on_is_replaced_by_the_one_that_is_named(diagnose, named_arm, named_urdf, tmp_path):
    t, q, tau = moved(named_arm, rows=900)
    columns = joint_states(t, q, tau)
    columns["__time"] = np.zeros_like(t)
    log = csv(tmp_path, columns | {"counter": 1e3 * t})
    refused(diagnose, log, "--model", named_urdf, text="--set clock.column=NAME")
    words = ["--set", "clock.column=counter", "--set", "clock.unit=ms"]
    for given in (words, words[:2]):
        code, said, data = diagnose(log, "--model", named_urdf, *given, *QUICK)
        assert code == 0 and data["verdict"] == "no_gap", said
        assert "counter [ms]" in said


def test_a_column_that_is_no_number_anywhere_is_replaced_by_the_one_that_is_named(
    diagnose, named_arm, named_urdf, tmp_path
):
    t, q, tau = moved(named_arm, rows=900)
    columns = joint_states(t, q, np.full(tau.shape, np.nan)) | {f"sensor_{k}": tau[:, k] for k in range(6)}
    log = csv(tmp_path, columns)
    refused(diagnose, log, "--model", named_urdf, text=("found no number in any row", "--set 'columns.tau.from=[...]'"))
    code, said, data = diagnose(log, "--model", named_urdf, "--set", "columns.tau.from=sensor_{0}", *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_rows_out_of_order_are_sorted_as_the_error_says(diagnose, named_arm, named_urdf, tmp_path):
    columns = joint_states(*moved(named_arm, rows=900))
    order = np.arange(900)
    order[[300, 301]] = [301, 300]
    log = csv(tmp_path, {name: values[order] for name, values in columns.items()})
    refused(diagnose, log, "--model", named_urdf, text=("time goes back", "--set clock.repair=sort"))
    code, said, data = diagnose(log, "--model", named_urdf, "--set", "clock.repair=sort", *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_missing_efforts_are_filled_as_the_map_is_told(diagnose, named_arm, named_urdf, tmp_path):
    t, q, tau = moved(named_arm, rows=900)
    tau[5, 2] = np.nan
    log = csv(tmp_path, joint_states(t, q, tau))
    code, said, _ = diagnose(log, "--model", named_urdf, "--set", "columns.tau.missing=drop", *QUICK)
    assert code == 0 and "1 of 900 rows without a number were left out" in said, said
    refused(
        diagnose,
        log,
        "--model",
        named_urdf,
        "--set",
        "columns.tau.missing=fail",
        text=("--set columns.tau.missing=interpolate", "--set columns.tau.missing=drop"),
    )


# Torque constants


def test_currents_of_a_model_with_damping_tell_torque_constants(diagnose, named_arm, named_urdf, tmp_path):
    damped = re.sub(r"(</joint>)", r'<dynamics damping="0.5" friction="0.1"/>\1', named_urdf.read_text())
    damped = re.sub(r"<dynamics[^>]*/>\s*(?=<dynamics)", "", damped)
    (tmp_path / "damped.urdf").write_text(damped)
    assert "damping" in damped
    constants = np.array([50.0, 60.0, 40.0, 12.0, 9.0, 6.0])
    t, q, tau = moved(kr5.cell.import_urdf(tmp_path / "damped.urdf").cell)
    columns = {"time_ms": 1e3 * t}
    for k in range(6):
        columns |= {f"pos_{k + 1}": np.degrees(q[:, k]), f"cur_{k + 1}_mA": 1e3 * tau[:, k] / constants[k]}
    log = csv(tmp_path, columns)
    code, said, data = diagnose(log, "--model", "damped.urdf", *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said
    told = re.search(r"torque constants from the log, for the masses of the model \[N m/A\]: ([^a-z]*)\.", said)
    values = np.array([[float(x) for x in one.split("±")] for one in told[1].split(",")])
    assert np.all(np.abs(values[:, 0] - constants) < 5 * values[:, 1] + 0.02 * constants)
    stated = f"cell.drives.torque_constant=[{','.join(map(str, constants))}]"
    code, said, _ = diagnose(log, "--model", "damped.urdf", "--set", stated, *QUICK)
    assert code == 0 and "torque constants from the log" not in said, said


# Names


def families_of(names, log=None):
    log = log or Log("log")
    for name in names:
        log.add(name, np.zeros(5), "")
    return {name: [f.columns[0] for f in found] for name, found in find_families(log, NAMES, 6).families.items()}


@pytest.mark.parametrize(
    ("stem", "family"),
    [
        ("/effort_controllers/joint_states:position.{}", "q"),
        ("/effort_controllers/joint_states/{}/position", "q"),
        ("/velocity_controller/joint_states:position.{}", "q"),
        ("/velocity_controller/joint_states:effort.{}", "tau"),
        ("/world/default/model/panda/joint_state:position.{}", "q"),
        ("/joint_trajectory_controller/state:feedback.positions.{}", "q"),
        ("/joint_trajectory_controller/state/feedback/positions/{}", "q"),
        ("/joint_trajectory_controller/state:desired.positions.{}", "qc"),
        ("/joint_trajectory_controller/state:reference.positions.{}", "qc"),
        ("/joint_trajectory_controller/state:error.positions.{}", None),
        ("/joint_trajectory_controller/joint_states:position.{}", "q"),
        ("/franka_state_broadcaster/external_joint_torques:effort.{}", None),
        ("/franka_state_controller/joint_states_desired:position.{}", "qc"),
        ("/joint_commands:position.{}", "qc"),
        ("/joint_states:velocity.{}", "qd"),
        ("{}/command", "qc"),
        ("actual_q_{}", "q"),
        ("target_q_{}", "qc"),
    ],
)
def test_the_field_says_what_a_column_is_before_its_topic(stem, family):
    expected = {} if family is None else {family: [stem.format(NAMES[0])]}
    assert families_of([stem.format(name) for name in NAMES]) == expected


def test_values_without_a_field_are_told_by_their_topic():
    names = [f"/forward_position_controller/commands:data[{k}]" for k in range(6)]
    assert families_of(names) == {"qc": names[:1]}
    assert families_of([n.replace("position", "effort") for n in names]) == {}


@pytest.mark.parametrize(
    ("stem", "family", "unit"),
    [
        ("cur_{}_mA", "i", "mA"),
        ("I{} [mA]", "i", "mA"),
        ("motor_current_mA_{}", "i", "mA"),
        ("torque_{}_%", "tau", "%"),
        ("torque_{} [%]", "tau", "%"),
        ("torque_{} [Nm]", "tau", "N m"),
        ("q{}_deg", "q", "deg"),
    ],
)
def test_units_in_names_are_read(stem, family, unit):
    log = Log("log")
    for k in range(6):
        log.add(stem.format(k + 1), np.zeros(5), "")
    found = find_families(log, [], 6).families
    assert {name: [f.unit for f in families] for name, families in found.items()} == {family: [unit]}


def test_a_motion_with_poses_of_the_tool_is_a_motion(diagnose, named_arm, named_urdf, tmp_path):
    t, q, tau = moved(named_arm, rows=900)
    tip = np.array([named_arm.T_base_tool(row)[:3, 3] for row in q])
    columns = {"t": t} | dict(zip("xyz", tip.T))
    columns |= {f"q{k + 1}": q[:, k] for k in range(6)} | {f"tau{k + 1}": tau[:, k] for k in range(6)}
    log = csv(tmp_path, columns)
    code, said, data = diagnose(log, "--model", named_urdf, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said
    assert "x, y, z are not used, since the log is one of a motion" in said


def test_columns_of_messages_keep_the_order_in_which_they_came(tmp_path):
    table = MessageTable(tmp_path)
    fields = [f"field_{k}" for k in np.random.default_rng(1).permutation(30)]
    table.add("/topic", 1.0, dict.fromkeys(fields, 0.5))
    table.add("/topic", 2.0, dict.fromkeys([*fields, "late_b", "late_a"], 0.5))
    expected = [f"/topic:{name}" for name in ["log_time", *fields, "late_b", "late_a"]]
    assert list(table.log().columns) == expected


# Clocks


@pytest.mark.parametrize(
    ("seconds", "rest"),
    [
        ("header.stamp.sec", "header.stamp.nanosec"),
        ("/joint_states/header/stamp/sec", "/joint_states/header/stamp/nanosec"),
        ("field.header.stamp.secs", "field.header.stamp.nsecs"),
    ],
)
def test_stamps_in_two_columns_are_one_clock(diagnose, named_arm, named_urdf, tmp_path, seconds, rest):
    t, q, tau = moved(named_arm, rows=900)
    columns = joint_states(t, q, tau)
    del columns["__time"]
    stamps = np.round(1e9 * t).astype(int)
    head = {seconds: EPOCH + stamps // 10**9, rest: stamps % 10**9}
    log = csv(tmp_path, {k: np.asarray(v, float) for k, v in head.items()} | columns)
    joined = read_log(tmp_path / log)
    assert next(iter(joined.columns)) == re.split(r"[./]secs?$", seconds)[0]
    assert np.allclose(next(iter(joined.columns.values())) - EPOCH, t, atol=1e-6)
    code, said, data = diagnose(log, "--model", named_urdf, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_a_clock_that_mostly_stands_still_tells_of_no_rest():
    from kr5.arm_log import rests

    t = np.repeat(np.arange(10.0), 20)
    assert rests(t, swing(t)) == []


@pytest.mark.parametrize(("unit", "step"), [("s", 0.2), ("s", 0.004), ("ms", 4.0), ("us", 1000.0), ("ns", 4e6)])
def test_the_unit_of_a_clock_without_one_is_told_by_its_steps(unit, step):
    from kr5.logs.clock_guess import guess_clock

    log = Log("log")
    log.add("time", step * np.arange(50), "")
    log.add("q1", np.zeros(50), "")
    assert guess_clock(log, "q1", None, {}).entry == {"column": "time", "unit": unit}


# Smoothing


def test_the_parts_of_a_log_are_smoothed_alike(diagnose, named_arm, named_urdf, tmp_path):
    t, q, tau = moved(named_arm, rows=2500, q_noise=1e-4)
    log = csv(tmp_path, joint_states(t, q, tau))
    code, said, data = diagnose(log, "--model", named_urdf, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said
    assert len(re.findall(r"positions were smoothed at", said)) == 1


@pytest.mark.parametrize("step", [0.0, 2 * np.pi / 2**17])
def test_a_sound_arm_at_a_fast_rate_with_noisy_or_coarse_encoders_has_no_gap(
    diagnose, named_arm, named_urdf, tmp_path, step
):
    t, q, tau = moved(named_arm, rows=9000, step=0.001, q_noise=1e-4 if step == 0 else 0.0)
    if step:
        q = step * np.round(q / step)
    log = csv(tmp_path, joint_states(t, q, tau))
    code, said, data = diagnose(log, "--model", named_urdf, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_degrees_that_were_stated_as_radians_are_mended_by_the_unit_of_what_was_measured(
    diagnose, named_arm, named_urdf, tmp_path
):
    t, q, tau = moved(named_arm, rows=900)
    log = csv(tmp_path, joint_states(t, np.degrees(q), tau))
    given = ["--set", "columns.q.unit=rad"]
    refused(diagnose, log, "--model", named_urdf, *given, text="--set columns.q.unit=deg")
    code, said, data = diagnose(log, "--model", named_urdf, "--set", "columns.q.unit=deg", *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def slide_log(tmp_path):
    """A carriage of 3 kg on a vertical slide: model, and columns of time, position [m] and force [N]."""
    cell = kr5.cell.Cell(
        name="slide",
        robot=kr5.cell.Robot(
            dh=[kr5.kinematics.DhJoint(type="prismatic")],
            limits=kr5.cell.Limits(lower=[-1.0], upper=[1.0], velocity=[2.0]),
            links=[kr5.cell.Link(mass=3.0, com=[0.0, 0.0, 0.0], inertia=[0.01] * 3 + [0.0] * 3)],
        ),
    )
    random = np.random.default_rng(1)
    t = 0.008 * np.arange(1500)
    z = 0.3 * (1 - np.cos(1.3 * t)) / 2 * (1 - np.exp(-(t**2)))
    force = 3.0 * (9.81 + np.gradient(np.gradient(z, t), t))
    return cell, t, z, force + random.normal(0, 0.05, len(t))


def test_a_single_slide_is_spoken_of_in_metres_and_newtons(diagnose, tmp_path):
    cell, t, z, force = slide_log(tmp_path)
    kr5.cell.save_cell(cell, tmp_path / "slide.yaml")
    kr5.cell.export_urdf(cell, tmp_path / "slide.urdf")
    log = csv(tmp_path, {"t": t, "q1": z, "tau1": force})
    code, said, data = diagnose(log, "--model", "slide.urdf", *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said
    assert "q: q1 [m]" in said and "tau: tau1 [N]" in said
    noise = float(re.search(r"noise of tau1, from neighbouring rows \[N\]: ([\d.]+)\.", said)[1])
    assert abs(noise - 0.05) < 0.005
    log = csv(tmp_path, {"t": t, "q1": z, "i1": force / 20.0})
    code, said, data = diagnose(log, "--model", "slide.urdf", *QUICK)
    assert code == 0, said
    told = re.search(r"torque constants from the log, for the masses of the model \[N/A\]: ([\d.]+) ±", said)
    assert abs(float(told[1]) - 20.0) < 0.2
    log = csv(tmp_path, {"t": t, "a": z, "b": force})
    refused(diagnose, log, "--model", "slide.urdf", text="found no column of the position of the joint, by its name")
    log = csv(tmp_path, {"t": t, "q1": z + 1.0, "tau1": force})
    said = refused(diagnose, log, "--model", "slide.yaml", text="motion-1: q1: found")
    assert re.search(r"to 1\.\d+ m, expected -1 to 1 m; ", said)
