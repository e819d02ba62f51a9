"""Logs as other programs write them: where they are cut, and tables whose columns have rows of their own."""

import re

import kr5
import kr5.cell
import kr5.io
import kr5.predict
import numpy as np
import pytest

from arm_logs import NAMES, NOISE, QUICK, carrying, case_logs, causes, joint_states, moved, refused, swing

START = 1_700_000_000.0  # [s] of a clock that counts from an epoch
BROKEN = ("coulomb_friction", "joint3")


@pytest.fixture(scope="module")
def rubbing(named_arm):
    return carrying(named_arm, *BROKEN, coulomb=9.0)


def names_friction(answer):
    code, said, data = answer
    assert code == 0, said
    assert causes(data) == [BROKEN] and data["verdict"] == "explained", said
    value = data["causes"][0]["parameters"]["coulomb"]
    assert abs(value["value"] - 9.0) < 4 * value["std"] + 0.1
    return said


# Where a log is cut


def pausing(begin, end):
    """The swing with a pause of all joints."""

    def course(t):
        early, late = t < begin, t >= end
        own = np.where(early, t, np.where(late, t - (end - begin), begin))
        slow = lambda x: np.where(np.abs(x - begin) < 1, begin + np.sign(x - begin) * (x - begin) ** 2, x)
        return swing(slow(own))

    return course


def test_a_log_with_a_pause_is_cut_there(diagnose, rubbing, named_urdf, tmp_path):
    case_logs.write_csv(tmp_path / "log.csv", joint_states(*moved(rubbing, course=pausing(8.0, 9.0))))
    said = names_friction(
        diagnose("log.csv", "--model", named_urdf, "--all", "--write-recording", tmp_path / "recording", *QUICK)
    )
    assert "cut where the arm rests" in said
    fit, check = kr5.cell.load_recording(tmp_path / "recording").experiments
    assert (str(fit.split), str(check.split)) == ("fit", "check")
    assert 8.0 <= fit["t"][-1] <= check["t"][0] <= 9.1


def test_a_rest_before_the_motion_is_no_part_of_the_share_to_fit(diagnose, rubbing, named_urdf, tmp_path):
    case_logs.write_csv(
        tmp_path / "log.csv",
        joint_states(*moved(rubbing, rows=3000, course=lambda t: swing(np.maximum(t - 14.0, 0.0)))),
    )
    names_friction(diagnose("log.csv", "--model", named_urdf, "--write-recording", tmp_path / "recording", *QUICK))
    for part in kr5.cell.load_recording(tmp_path / "recording").experiments:
        assert min(np.ptp(part[f"qc{k + 1}"]) for k in range(6)) > 0.1


@pytest.fixture(scope="module")
def commanded(share):
    """A cell with servos, and what its controller logs from rest on: commands, positions and currents, with a fault or
    without."""
    cell = case_logs.named(kr5.cell.load_cell(share / "cells" / "kr5_arc.yaml"))

    def log(*effect, **parameters):
        true = carrying(cell, *effect, **parameters) if effect else cell
        t = cell.servo.cycle * np.arange(1500)
        experiment = kr5.cell.Experiment(name="m", kind="motion", file="m.csv", split="fit")
        qc = swing(t)
        experiment.data = kr5.io.Table(["t", *(f"qc{k + 1}" for k in range(6))], np.column_stack([t, qc]))
        shown = kr5.predict.FastSimulator().predict(true, experiment)
        random = np.random.default_rng(7)
        columns = {"time": t}
        for k, name in enumerate(NAMES):
            columns |= {
                f"{name}/command": qc[:, k],
                f"{name}/position": shown[f"q{k + 1}"] + random.normal(0, cell.noise.position, len(t)),
                f"{name}/current": shown[f"i{k + 1}"] + random.normal(0, cell.noise.current, len(t)),
            }
        return columns

    return cell, log


@pytest.mark.parametrize("effect", [(), ("coulomb_friction", "joint3")])
def test_a_commanded_log_that_never_rests_has_the_verdict_of_the_whole(diagnose, commanded, tmp_path, effect):
    cell, log = commanded
    kr5.cell.save_cell(cell, tmp_path / "cell.yaml")
    columns = log(*effect, coulomb=26.0) if effect else log()
    answers = {}
    for name, first in (("whole", 0), ("moving", 170)):
        case_logs.write_csv(tmp_path / f"{name}.csv", {key: values[first:] for key, values in columns.items()})
        code, said, data = diagnose(f"{name}.csv", "--model", "cell.yaml", "--all", *QUICK)
        assert code == 0, said
        answers[name] = said, data
    said, data = answers["moving"]
    assert "the arm never rests" in said and "the log begins while a joint moves" in said
    assert data["verdict"] == answers["whole"][1]["verdict"] == ("explained" if effect else "no_gap")
    assert causes(data) == causes(answers["whole"][1]) == ([effect] if effect else [])


# Tables of several topics, as PlotJuggler writes them


def table_of_topics(*topics):
    """One table with a row for each instant of any topic (its times, its columns); cells of the others stay empty."""
    times = np.unique(np.concatenate([np.round(START + t, 6) for t, _ in topics]))
    out = {"__time": times}
    for t, columns in topics:
        rows = np.searchsorted(times, np.round(START + t, 6))
        for name, values in columns.items():
            out[name] = np.full(len(times), np.nan)
            out[name][rows] = values
    return out


def of_joints(word, values, names=NAMES):
    return {f"/joint_states/{name}/{word}": values[:, k] for k, name in enumerate(names)}


def test_topics_with_rows_of_their_own(diagnose, rubbing, named_urdf, tmp_path):
    """Joint states beside a faster topic that begins before them."""
    t, q, tau = moved(rubbing)
    imu = np.arange(-2.0, 13.0, 0.003)
    table = table_of_topics(
        (imu, {"/imu/angular_velocity/x": np.sin(imu)}), (t, of_joints("position", q) | of_joints("effort", tau))
    )
    case_logs.write_csv(tmp_path / "log.csv", table)
    names_friction(diagnose("log.csv", "--model", named_urdf, *QUICK))


def test_positions_and_efforts_in_rows_of_their_own_are_not_continued(diagnose, rubbing, named_urdf, tmp_path):
    """Efforts that come between positions, begin later, end earlier and have a gap."""
    t, q, _ = moved(rubbing)
    at, _, tau = moved(rubbing, course=lambda s: swing(s + 0.003), seed=5)
    kept = ((at > 0.5) & (at < 7.0)) | ((at > 7.6) & (at < 11.0))
    table = table_of_topics((t, of_joints("position", q)), (at[kept] + 0.003, of_joints("effort", tau[kept])))
    case_logs.write_csv(tmp_path / "log.csv", table)
    names_friction(diagnose("log.csv", "--model", named_urdf, "--write-recording", tmp_path / "recording", *QUICK))
    rows = np.concatenate([e["t"] for e in kr5.cell.load_recording(tmp_path / "recording").experiments])
    assert rows.min() > 0.5 and rows.max() < 11.01 and not ((rows > 7.01) & (rows < 7.6)).any()
    assert len(rows) > 900


def test_a_topic_for_each_joint(diagnose, rubbing, named_arm, named_urdf, tmp_path):
    topics = []
    for k, name in enumerate(NAMES):
        late = 0.001 * k
        t, q, tau = moved(rubbing, course=lambda s, late=late: swing(s + late), seed=10 + k)
        topics.append((t + late, {f"/{name}/state/position": q[:, k], f"/{name}/state/effort": tau[:, k]}))
    case_logs.write_csv(tmp_path / "log.csv", table_of_topics(*topics))
    names_friction(diagnose("log.csv", "--model", named_urdf, *QUICK))


def test_commands_in_rows_of_their_own(diagnose, commanded, tmp_path):
    cell, log = commanded
    kr5.cell.save_cell(cell, tmp_path / "cell.yaml")
    columns = log("coulomb_friction", "joint3", coulomb=26.0)
    t = columns.pop("time")
    commands = {k: v for k, v in columns.items() if k.endswith("/command")}
    sensed = {k: v for k, v in columns.items() if k not in commands}
    finer = np.arange(0.0, t[-1], 0.004) + 1e-4
    ahead = {k: np.interp(finer, t, v) for k, v in commands.items()}
    case_logs.write_csv(tmp_path / "log.csv", table_of_topics((finer, ahead), (t, sensed)))
    code, said, data = diagnose("log.csv", "--model", "cell.yaml", *QUICK)
    assert code == 0, said
    assert causes(data) == [BROKEN], said


def test_positions_and_efforts_of_different_times_are_refused(diagnose, named_arm, named_urdf, tmp_path):
    t, q, tau = moved(named_arm, rows=400)
    table = table_of_topics((t, of_joints("position", q)), (t + 10.0, of_joints("effort", tau)))
    case_logs.write_csv(tmp_path / "log.csv", table)
    refused(diagnose, "log.csv", "--model", named_urdf, text=("no numbers at the same time", "record them together"))


def test_a_gap_of_a_column_is_refused_in_a_map_written_by_hand(run_kr5, share, tmp_path):
    """No values are made up across it."""
    cell = kr5.cell.load_cell(share / "cells" / "kr5_arc.yaml")
    t = cell.servo.cycle * np.arange(500)
    q = swing(t)
    columns = {"t": t} | {f"q{k + 1}": q[:, k] for k in range(6)}
    columns["i"] = np.where((t > 2) & (t < 2.5), np.nan, 1.0)
    case_logs.write_csv(tmp_path / "log.csv", columns)
    kr5.cell.save_cell(cell, tmp_path / "cell.yaml")
    (tmp_path / "map.yaml").write_text(
        "format: kr5-map/1\ncell: cell.yaml\nclock: {column: t, unit: s}\ncolumns:\n"
        "  qc: {from: measured, unit: rad}\n  q: {from: 'q{}', unit: rad}\n"
        "  i: {from: [i, i, i, i, i, i], unit: A, missing: interpolate}\n"
        "experiments: [{name: m, kind: motion, split: fit}]\n"
    )
    done = run_kr5("recording", "import", "log.csv", "--map", "map.yaml", "-o", "out")
    assert done.returncode == 2 and not (tmp_path / "out").exists()
    said = " ".join(done.stderr.split())
    assert (
        "column 'i': found no number for 0.516 s" in said and "make the parts before and after two experiments" in said
    )


# Clocks


@pytest.mark.parametrize(
    "seconds, rest, joined",
    [
        ("header.stamp.sec", "header.stamp.nanosec", "header.stamp"),
        (
            "/joint_states/header/stamp/sec",
            "/joint_states/header/stamp/nanosec",
            "/joint_states/header/stamp",
        ),
        ("header.stamp.secs", "header.stamp.nsecs", "header.stamp"),
        ("sec", "nanosec", "time"),
    ],
)
def test_stamps_in_two_columns_are_one_time(diagnose, rubbing, named_urdf, tmp_path, seconds, rest, joined):
    columns = joint_states(*moved(rubbing))
    t = columns.pop("__time")
    stamps = {seconds: np.floor(t), rest: np.round(1e9 * (t - np.floor(t)))}
    case_logs.write_csv(tmp_path / "log.csv", stamps | columns)
    said = names_friction(diagnose("log.csv", "--model", named_urdf, *QUICK))
    assert f"clock: {joined} [s]" in said


@pytest.mark.parametrize("name", ["timestamp", "header.stamp", "/joint_states/header/stamp"])
def test_ros_time_in_nanoseconds_is_told_by_its_steps(diagnose, rubbing, named_urdf, tmp_path, name):
    columns = joint_states(*moved(rubbing))
    t = columns.pop("__time")
    case_logs.write_csv(tmp_path / "log.csv", {name: np.round(1e9 * t)} | columns)
    said = names_friction(diagnose("log.csv", "--model", named_urdf, *QUICK))
    assert f"clock: {name} [ns]" in said


def test_stamps_that_nobody_filled_in_are_no_clock(diagnose, rubbing, named_urdf, tmp_path):
    columns = joint_states(*moved(rubbing))
    t = columns.pop("__time")
    unfilled = {"header.stamp.sec": 0 * t, "header.stamp.nanosec": 0 * t}
    case_logs.write_csv(tmp_path / "log.csv", unfilled | columns | {"recv_time": t})
    said = names_friction(diagnose("log.csv", "--model", named_urdf, *QUICK))
    assert "clock: recv_time [s]" in said


# Joints


def grippered(named_urdf, finger="<mimic joint='left_finger'/>"):
    """The description of an arm with a gripper behind its flange, so light that the logged arm may lack it."""
    text = named_urdf.read_text()
    flange = text[: text.rindex("</link>")].rsplit('<link name="', 1)[1].split('"')[0]
    body = (
        '<inertial><mass value="1e-4"/><inertia ixx="1e-8" iyy="1e-8" izz="1e-8" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    more = ""
    for side, mimic in (("left", ""), ("right", finger)):
        more += f'<link name="{side}_link">{body}</link><joint name="{side}_finger" type="prismatic">'
        more += f'<parent link="{flange}"/>'
        more += (
            f'<child link="{side}_link"/><axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="10" velocity="1"/>'
        )
        more += f"{mimic}</joint>"
    return text.replace("</robot>", more + "</robot>"), flange


def test_fingers_that_mimic_each_other_are_no_joints_of_the_arm(diagnose, rubbing, named_urdf, tmp_path):
    text, flange = grippered(named_urdf)
    (tmp_path / "named_arm.urdf").write_text(text)
    columns = joint_states(*moved(rubbing))
    for side in ("left", "right"):
        columns[f"/joint_states/{side}_finger/position"] = 0.01 + 0 * columns["__time"]
        columns[f"/joint_states/{side}_finger/effort"] = 0 * columns["__time"]
    case_logs.write_csv(tmp_path / "log.csv", columns)
    for tip in ((), ("--tip", flange)):
        names_friction(diagnose("log.csv", "--model", "named_arm.urdf", *tip, *QUICK))


def test_a_joint_of_the_arm_that_mimics_another_is_refused(diagnose, rubbing, named_urdf, tmp_path):
    text = named_urdf.read_text()
    at = text.index("</joint>", text.index(f'<joint name="{NAMES[2]}"'))
    (tmp_path / "named_arm.urdf").write_text(text[:at] + f'<mimic joint="{NAMES[1]}"/>' + text[at:])
    case_logs.write_csv(tmp_path / "log.csv", joint_states(*moved(rubbing, rows=400)))
    refused(
        diagnose,
        "log.csv",
        "--model",
        "named_arm.urdf",
        text=(
            f"joint {NAMES[2]} mimics another",
            "the joints of an arm must be independent",
            "remove its <mimic>",
            "(--tip link_2)",
        ),
    )


def test_two_publishers_with_clocks_of_their_own_are_refused(diagnose, named_arm, named_urdf, tmp_path):
    """In a table: rows of the second publisher stand between those of the first, at times that go back."""
    t, q, tau = moved(named_arm, rows=400)
    columns = joint_states(t, q, tau)
    mixed = {name: np.column_stack([values, values]).ravel() for name, values in columns.items()}
    mixed["__time"][1::2] -= 0.05
    case_logs.write_csv(tmp_path / "log.csv", mixed)
    refused(diagnose, "log.csv", "--model", named_urdf, text="time goes back")


def test_joints_whose_efforts_are_not_measured_are_not_judged(diagnose, rubbing, named_urdf, tmp_path):
    t, q, tau = moved(rubbing)
    random = np.random.default_rng(4)
    tau[:, 3:5] = random.normal(0, NOISE[3:5], tau[:, 3:5].shape) / 20
    case_logs.write_csv(tmp_path / "log.csv", joint_states(t, q, tau))
    said = names_friction(diagnose("log.csv", "--model", named_urdf, *QUICK))
    assert f"the loads of {NAMES[3]}, {NAMES[4]} show hardly anything" in said and "not judged" in said


def test_efforts_without_noise_are_not_taken_for_the_scale_of_the_gap(diagnose, named_arm, named_urdf, tmp_path):
    """A log that states efforts in coarse steps: the noise is that of the step."""
    t, q, tau = moved(named_arm)
    case_logs.write_csv(tmp_path / "log.csv", joint_states(t, q, np.round(tau / NOISE) * NOISE))
    code, said, data = diagnose("log.csv", "--model", named_urdf, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_stamps_that_lost_their_digits_are_replaced_by_the_interval_of_the_rows(
    diagnose, named_arm, named_urdf, tmp_path
):
    columns = joint_states(*moved(named_arm))
    columns["__time"] = np.array([float(f"{t:.12g}") for t in columns["__time"]])  # to 10 ms, of rows every 8 ms
    case_logs.write_csv(tmp_path / "log.csv", columns)
    said = refused(diagnose, "log.csv", "--model", named_urdf, text=("stands still", "too few digits"))
    every = re.search(r"--every ([\d.]+)", said)[1]
    code, said, data = diagnose("log.csv", "--model", named_urdf, "--every", every, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_a_clock_that_jumps_back_is_several_recordings(diagnose, rubbing, named_urdf, tmp_path):
    runs = [joint_states(*moved(rubbing, seed=seed)) for seed in (1, 2)]
    both = {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}
    case_logs.write_csv(tmp_path / "log.csv", both)
    refused(
        diagnose, "log.csv", "--model", named_urdf, text=("line 1502", "time goes back", "give the parts as two logs")
    )
    for number, run in enumerate(runs):
        case_logs.write_csv(tmp_path / f"run{number}.csv", run)
    names_friction(diagnose("run0.csv", "run1.csv", "--model", named_urdf, *QUICK))
