"""Mistakes of loggers and exports: what can be read all the same is, what cannot is refused with its remedy."""

from datetime import UTC, datetime

import kr5
import numpy as np
import pytest
from kr5.arm_log import guess_time_unit
from kr5.logs import diagnose_logs, read_logs
from kr5.logs.log_file import read_log

from arm_logs import NAMES, QUICK, case_logs, joint_states, moved, refused


@pytest.fixture
def columns(named_arm):
    return joint_states(*moved(named_arm, rows=900))


def no_gap(diagnose, named_urdf, *words):
    code, said, data = diagnose(*words, "--model", named_urdf, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said
    return said


def test_a_repeated_line_of_names_is_left_out(diagnose, named_urdf, columns, tmp_path):
    case_logs.write_csv(tmp_path / "log.csv", columns)
    lines = (tmp_path / "log.csv").read_text().splitlines()
    (tmp_path / "log.csv").write_text("\n".join([*lines[:400], lines[0], *lines[400:]]))
    assert "1 repeated header was skipped" in no_gap(diagnose, named_urdf, "log.csv")


def test_lines_that_were_written_twice_are_read_once(diagnose, named_urdf, columns, tmp_path):
    case_logs.write_csv(tmp_path / "log.csv", {name: np.repeat(values, 2) for name, values in columns.items()})
    assert "900 duplicate lines were skipped" in no_gap(diagnose, named_urdf, "log.csv")


def test_equal_readings_at_rest_are_not_taken_for_lines_written_twice(tmp_path):
    (tmp_path / "log.csv").write_text("a,b\n1,2\n1,2\n1,3\n1,2\n")
    assert len(read_log(tmp_path / "log.csv").columns["a"]) == 4


@pytest.mark.parametrize("rows", ["0\n0\n0\n1\n2\n2\n2\n3\n", "5\n" * 6])
def test_what_rises_with_rests_or_never_is_no_clock_of_lines_written_twice(tmp_path, rows):
    (tmp_path / "log.csv").write_text("q1\n" + rows)
    assert len(read_log(tmp_path / "log.csv").columns["q1"]) == rows.count("\n")


def test_a_time_that_stands_still_throughout_keeps_its_rows(tmp_path):
    (tmp_path / "log.csv").write_text("time,q1\n" + "5,1\n" * 6)
    assert len(read_log(tmp_path / "log.csv").columns["q1"]) == 6


def test_a_counter_of_milliseconds_is_no_time_of_this_century():
    assert str(guess_time_unit(1.2e9 + 4 * np.arange(50.0))) == "ms"
    assert str(guess_time_unit(1.7e9 + 0.6 * np.arange(50.0))) == "s"


def test_options_of_the_caller_stay_as_they_are(named_urdf, columns, tmp_path):
    case_logs.write_csv(tmp_path / "log.csv", columns)
    options = kr5.gap.DiagnoseOptions(max_effects=1, beam=1)
    diagnose_logs(tmp_path / "log.csv", named_urdf, options=options)
    assert options.to_dict() == kr5.gap.DiagnoseOptions(max_effects=1, beam=1).to_dict()
    assert not options.simulator_errors


def dated(file, columns, zone="", clock="__time"):
    dates = [datetime.fromtimestamp(t, UTC).strftime("%Y-%m-%dT%H:%M:%S.%f") + zone for t in columns["__time"]]
    rows = zip(dates, *(columns[name] for name in columns if name != "__time"))
    names = [clock if name == "__time" else name for name in columns]
    file.write_text("\n".join([",".join(names), *(",".join(map(str, row)) for row in rows)]))


@pytest.mark.parametrize(("zone", "clock"), [("", "__time"), ("Z", "datetime"), ("+02:00", "date")])
def test_dates_with_times_are_a_clock(diagnose, named_urdf, columns, tmp_path, zone, clock):
    dated(tmp_path / "log.csv", columns, zone, clock)
    no_gap(diagnose, named_urdf, "log.csv")


@pytest.mark.parametrize(
    ("line", "stands", "words"),
    [
        (1, "", "found no time"),
        (40, "N/A", "found no time"),
        (40, "noon", "line 41, column '__time': found 'noon', expected a date with a time"),
    ],
)
def test_a_date_that_is_missing_or_none_is_named(diagnose, named_urdf, columns, tmp_path, line, stands, words):
    dated(tmp_path / "log.csv", columns)
    lines = (tmp_path / "log.csv").read_text().splitlines()
    lines[line] = stands + lines[line][lines[line].index(",") :]
    (tmp_path / "log.csv").write_text("\n".join(lines))
    refused(diagnose, "log.csv", "--model", named_urdf, text=words)


def test_a_date_in_utc_is_a_clock(diagnose, named_urdf, columns, tmp_path):
    dated(tmp_path / "log.csv", columns, " UTC")
    no_gap(diagnose, named_urdf, "log.csv")


@pytest.mark.parametrize("after", [False, True])
@pytest.mark.parametrize("name", ["date", "utc"])
def test_a_coarse_time_beside_a_fine_one_is_no_clock(diagnose, named_urdf, columns, tmp_path, name, after):
    coarse = {name: np.floor(columns["__time"])}
    case_logs.write_csv(tmp_path / "log.csv", columns | coarse if after else coarse | columns)
    no_gap(diagnose, named_urdf, "log.csv")


def test_stamps_of_this_century_are_seconds_at_any_rate(diagnose, named_arm, named_urdf, tmp_path):
    case_logs.write_csv(tmp_path / "log.csv", joint_states(*moved(named_arm, rows=20, step=0.6)))
    refused(diagnose, "log.csv", "--model", named_urdf, text="found 20 rows of positions without a gap")


@pytest.mark.parametrize("rows", [12, 60])
def test_a_log_too_short_to_smooth_asks_for_a_longer_one(diagnose, named_arm, named_urdf, tmp_path, rows):
    case_logs.write_csv(tmp_path / "log.csv", joint_states(*moved(named_arm, rows=rows, step=0.02)))
    refused(diagnose, "log.csv", "--model", named_urdf, text="log a longer motion")


def test_efforts_that_are_never_measured_are_told(diagnose, named_urdf, columns, tmp_path):
    still = {name: 0 * values if "effort" in name else values for name, values in columns.items()}
    case_logs.write_csv(tmp_path / "log.csv", still)
    refused(
        diagnose,
        "log.csv",
        "--model",
        named_urdf,
        text=("the same value in every row", "check that the driver measures efforts"),
    )


def test_efforts_in_a_thousandfold_unit_are_told_with_the_scale(diagnose, named_urdf, columns, tmp_path):
    scaled = {name: values / 1000 if "effort" in name else values for name, values in columns.items()}
    case_logs.write_csv(tmp_path / "log.csv", scaled)
    refused(diagnose, "log.csv", "--model", named_urdf, text="--set columns.tau.scale=1000")
    no_gap(diagnose, named_urdf, "log.csv", "--set", "columns.tau.scale=1000")


@pytest.mark.parametrize(("field", "what"), [("", "positions"), ("/effort", "efforts")])
def test_a_joint_that_was_not_logged_is_named(diagnose, named_urdf, columns, tmp_path, field, what):
    kept = {name: values for name, values in columns.items() if f"{NAMES[4]}{field}" not in name}
    case_logs.write_csv(tmp_path / "log.csv", kept)
    refused(diagnose, "log.csv", "--model", named_urdf, text=(f"found {what} of some joints, but not of {NAMES[4]}",))


def test_joints_of_another_robot_are_named_as_the_log_names_them(diagnose, named_arm, columns, tmp_path):
    other = kr5.cell.parse_cell(named_arm.to_yaml())
    robot = other.robot
    robot.joint_names = [f"A{k + 1}" for k in range(6)]
    other.robot = robot
    kr5.cell.export_urdf(other, tmp_path / "other.urdf")
    case_logs.write_csv(tmp_path / "log.csv", columns)
    refused(
        diagnose, "log.csv", "--model", "other.urdf", text=f"the log names joints such as {', '.join(sorted(NAMES))}"
    )


def test_logs_are_diagnosed_from_python(named_urdf, columns, tmp_path):
    case_logs.write_csv(tmp_path / "log.csv", columns)
    options = kr5.gap.DiagnoseOptions(max_effects=1, refits=4, beam=1)
    assert str(diagnose_logs(tmp_path / "log.csv", named_urdf, options=options).verdict) == "no_gap"
    assert read_logs([tmp_path / "log.csv"], named_urdf).recording.cell.robot.joints == 6


def test_what_is_wrong_with_a_log_is_raised_in_python_with_every_problem(named_urdf, columns, tmp_path, capfd):
    still = {name: 0 * values if "effort" in name else values for name, values in columns.items()}
    case_logs.write_csv(tmp_path / "log.csv", still)
    with pytest.raises(kr5.Errors, match="(?s)the same value in every row.*do not fit together") as ended:
        read_logs(tmp_path / "log.csv", named_urdf)
    assert len(ended.value.messages) > 1
    with pytest.warns(kr5.Implausible, match="the same value in every row"):
        read_logs(tmp_path / "log.csv", named_urdf, trust=True)
    with pytest.raises(kr5.FileError, match=r"nosuch\.csv: no such file"):
        read_logs(tmp_path / "nosuch.csv", named_urdf)
    assert capfd.readouterr().err == ""
