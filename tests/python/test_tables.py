"""Every command reads a table in any form as it reads the plain CSV, and refuses a bad one with place and remedy."""

import json
from dataclasses import dataclass, field

import kr5
import numpy as np
import pytest
import yaml
from kr5 import identification
from kr5.logs.column_list import parse_columns
from kr5.tables.read_table import read_table
from kr5.tables.roles import RUN, TIME, Role, Units, joints_role

CELL = "cells/kr5_arc.yaml"


@dataclass
class Case:
    """A command with its main table, as names and rows."""

    words: list[str]
    names: list[str]
    rows: np.ndarray
    angles: list[str] = field(default_factory=list)  # columns in rad
    more: dict[str, str] = field(default_factory=dict)  # further files
    points: list[str] | None = None  # a first column of words


def poses(count, seed=1, spread=0.6):
    """Poses of a hand that turns enough, as 4 x 4."""
    random = np.random.default_rng(seed)
    return [
        kr5.from_xyzrpy([*(0.3 * random.normal(size=3) + [0.6, 0, 0.5]), *(spread * random.normal(size=3))])
        for _ in range(count)
    ]


def rpy_rows(T):
    return np.array([kr5.to_xyzrpy(pose) for pose in T])


def servo_case(_):
    t = 0.012 * np.arange(300)
    command = np.where(t > 0.2, 0.024, 0.0)
    response = 0.024 * (1 - np.exp(-8 * np.maximum(t - 0.2, 0)) * (1 + 8 * np.maximum(t - 0.2, 0)))
    response += np.random.default_rng(1).normal(0, 1e-5, len(t))
    return Case(["identify", "servo", "FILE"], ["t", "command", "response"], np.column_stack([t, command, response]))


def contact_case(_):
    depth = np.linspace(-0.25e-3, 0.65e-3, 40)
    force = 23380 * np.maximum(depth, 0) + np.random.default_rng(1).normal(0, 0.1, 40)
    return Case(["identify", "contact", "FILE"], ["depth", "force"], np.column_stack([depth, force]))


def force_torque_case(_):
    random = np.random.default_rng(1)
    gravity = random.normal(size=(40, 3))
    gravity *= 9.81 / np.linalg.norm(gravity, axis=1)[:, None]
    wrench = np.hstack([2.4 * gravity, np.cross([0, 0, 0.12], gravity)])
    wrench = wrench + np.array([1, 2, 3, 0.1, 0.2, 0.3])
    wrench += random.normal(size=(40, 6)) * np.repeat([0.15, 0.008], 3)
    names = ["gx", "gy", "gz", "fx", "fy", "fz", "tx", "ty", "tz"]
    return Case(["identify", "force-torque", "FILE"], names, np.hstack([gravity, wrench]))


def drives_case(share):
    text = (share / "data/drives/kr5_table_b2.csv").read_text().splitlines()
    names, rows = text[0].split(","), np.array([line.split(",") for line in text[1:]], float)
    angles = [n for n in names if n[0] in "qm"]
    at = [names.index(n) for n in angles]
    rows[:, at] = np.radians(rows[:, at])
    return Case(["identify", "drives", "FILE", "--angle-unit", "ANGLE", "--common-zero"], names, rows, angles)


def elasticity_case(_):
    random = np.random.default_rng(1)
    tau = random.uniform(-300, 300, (60, 2))
    link = random.uniform(-1, 1, (60, 2))
    motor = link + tau / [50e3, 30e3] + random.normal(0, 1e-5, (60, 2))
    names = ["q1", "q2", "m1", "m2", "tau1", "tau2"]
    rows = np.hstack([link, motor, tau])
    return Case(
        ["identify", "elasticity", "FILE", "--angle-unit", "ANGLE", "--torque-noise", "1"], names, rows, names[:4]
    )


def gravity_case(share):
    import kr5.cell

    from test_identify_motion import slow_log

    file = share / CELL
    folder = servo_case.folder
    slow_log(kr5.cell.load_cell(file), folder / "slow.csv", samples=250)
    text = (folder / "slow.csv").read_text().splitlines()
    names, rows = text[0].split(","), np.array([line.split(",") for line in text[1:]], float)
    return Case(
        ["identify", "gravity", str(file), "FILE", "--angle-unit", "ANGLE"],
        names,
        rows,
        [n for n in names if n[0] == "q"],
    )


def axes_case(share):
    import kr5.cell

    chain = kr5.cell.load_cell(share / CELL).nominal_chain()
    home = np.array([0.1, -1.2, 1.4, 0.2, 0.9, 0.3])
    q = [home, *(home + d * np.eye(6)[k] for k in range(6) for d in np.linspace(-0.8, 0.8, 8))]
    rows = np.array([[*v, *rpy] for v in q for rpy in [kr5.to_xyzrpy(chain.flange(v))]])
    rows[:, 6:] += np.random.default_rng(1).normal(0, 1e-5, (len(rows), 6))
    names = [*(f"q{k + 1}" for k in range(6)), "x", "y", "z", "roll", "pitch", "yaw"]
    return Case(["identify", "axes", "FILE", "--angle-unit", "ANGLE"], names, rows, [*names[:6], *names[9:]])


def tool_case(_):
    tip = np.array([0.01, -0.02, 0.2])
    T = poses(10)
    for pose in T:
        pose[:3, 3] = [0.8, 0.1, 0.2] - pose[:3, :3] @ tip + np.random.default_rng(3).normal(0, 1e-4, 3)
    return Case(
        ["calibrate", "tool", "FILE", "--angle-unit", "ANGLE"],
        ["x", "y", "z", "roll", "pitch", "yaw"],
        rpy_rows(T),
        ["roll", "pitch", "yaw"],
    )


def hand_eye_case(share):
    text = (share / "data/pairs/pairs.csv").read_text().splitlines()
    rows = np.array([line.split(",") for line in text[1:]], float)
    return Case(["calibrate", "hand-eye", "FILE", "--mount", "eye_in_hand"], text[0].split(","), rows)


def repeatability_case(_):
    random = np.random.default_rng(2)
    T = [kr5.from_xyzrpy([*place, 0.1, 0.2, 0.3]) for place in ([0.5, 0, 0.4], [0.6, 0.3, 0.5])]
    rows = [kr5.to_xyzrpy(T[k % 2] @ kr5.from_xyzrpy(random.normal(0, 5e-5, 6))) for k in range(24)]
    words = ["repeatability", "FILE", "--angle-unit", "ANGLE"]
    names = ["x", "y", "z", "roll", "pitch", "yaw"]
    return Case(words, names, np.array(rows), names[3:], points=["P one", "P2"] * 12)


def timed_case(_):
    t = 0.05 * np.arange(240)
    hand = [
        kr5.from_xyzrpy(
            [
                0.5 + 0.1 * np.sin(s),
                0.1 * np.cos(1.3 * s),
                0.4,
                0.5 * np.sin(1.1 * s),
                0.4 * np.cos(0.7 * s),
                0.6 * np.sin(0.5 * s),
            ]
        )
        for s in t
    ]
    X, W = kr5.from_xyzrpy([0.05, 0.02, 0.1, 0.1, 0.2, 0.3]), kr5.from_xyzrpy([1, 0, 0, 0, 0, 0.5])
    camera = [np.linalg.inv(W) @ T @ X for T in hand]
    names = ["t", "x", "y", "z", "roll", "pitch", "yaw"]
    seen = np.column_stack([t, rpy_rows(camera)])
    return Case(
        ["calibrate", "timed", "FILE", "camera.csv", "--angle-unit", "ANGLE"],
        names,
        np.column_stack([t, rpy_rows(hand)]),
        names[4:],
        {"camera.csv": (names, seen)},
    )


def laser_case(_):
    from test_laser_command import TARGETS, make_scans, write_profiles

    profiles, T, targets = make_scans()
    write_profiles(servo_case.folder / "profiles.csv", profiles, targets)
    names = ["x", "y", "z", "roll", "pitch", "yaw"]
    return Case(
        ["calibrate", "laser", "profiles.csv", "FILE", *TARGETS, "--angle-unit", "ANGLE"], names, rpy_rows(T), names[3:]
    )


def kinematics_case(share):
    import kr5.cell

    chain = kr5.cell.load_cell(share / CELL).nominal_chain()
    random = np.random.default_rng(1)
    q = random.uniform(-1.2, 1.2, (60, 6))
    base = kr5.to_pose([1.0, -0.5, 0.3, 0.2, -0.1, 0.7])
    places = np.array([(base @ chain.flange(row) @ [0.1, -0.05, 0.15, 1])[:3] for row in q])
    rows = np.hstack([q, places + random.normal(0, 5e-5, places.shape)])
    names = [*(f"q{k + 1}" for k in range(6)), "x", "y", "z"]
    words = ["calibrate", "kinematics", "FILE", "--cell", str(share / CELL), "--angle-unit", "ANGLE"]
    return Case(words, names, rows, names[:6])


def cell_case(share):
    """The first stops of the demo, the arm held: that its table is read is what is asked."""
    demo, folder = share / "data/demo", servo_case.folder / "demo"
    (folder / "images").mkdir(parents=True)
    stops = sorted((demo / "images").iterdir())[:5]
    for file in [*stops, demo / "dataset.yaml", demo / "camera.yaml"]:
        (folder / file.relative_to(demo)).symlink_to(file)
    (folder / "poses.csv").write_text("".join((demo / "poses.csv").open().readlines()[: 1 + len(stops)]))
    q = np.array(yaml.safe_load((demo / "truth.yaml").read_text())["joint_angles"])[: len(stops)]
    names = [f"q{k + 1}" for k in range(6)]
    words = ["calibrate", "cell", "demo", "--joint-values", "FILE", "--cell", str(share / CELL), "--hold", "arm"]
    return Case([*words, "--angle-unit", "ANGLE"], names, q, names)


def postures_case(share):
    q = np.random.default_rng(1).uniform(-1.2, 1.2, (80, 6))
    names = [f"q{k + 1}" for k in range(6)]
    words = ["calibrate", "postures", "--candidates", "FILE", "--cell", str(share / CELL), "--count", "20"]
    return Case([*words, "--angle-unit", "ANGLE"], names, q, names)


CASES = {
    "servo": servo_case, "contact": contact_case, "force-torque": force_torque_case, "drives": drives_case,
    "elasticity": elasticity_case, "gravity": gravity_case, "axes": axes_case, "tool": tool_case,
    "hand-eye": hand_eye_case, "repeatability": repeatability_case, "timed": timed_case,
    "laser": laser_case, "kinematics": kinematics_case, "cell": cell_case, "postures": postures_case,
}  # fmt: skip
FORMS = ["semicolon", "tab", "headerless", "npz", "degrees"]


def written(case, form, names, rows):
    """The texts of a table in a form: ending, content and the list of its columns."""
    words = case.points
    cells = [[repr(float(v)) for v in row] for row in rows]
    if words is not None and names is case.names:
        names, cells = ["point", *names], [[w, *c] for w, c in zip(words, cells, strict=True)]
    if form == "degrees":
        at = [names.index(n) for n in case.angles]
        cells = [[repr(float(np.degrees(float(c)))) if k in at else c for k, c in enumerate(row)] for row in cells]
        names = [f"{n} [deg]" if n in case.angles else n for n in names]
    lines = [names, *cells]
    if form == "semicolon":
        return ".csv", "\n".join(";".join(line).replace(".", ",") for line in lines)
    if form == "tab":
        return ".tsv", "\n".join("\t".join(line) for line in lines)
    if form == "headerless":
        return ".csv", "\n".join(",".join(line) for line in cells)
    return ".csv", "\n".join(",".join(line) for line in lines)


def save(folder, name, case, form, names, rows):
    if form == "npz":
        np.savez(folder / f"{name}.npz", **dict(zip(names, rows.T, strict=True)))
        return f"{name}.npz"
    ending, text = written(case, form, names, rows)
    (folder / f"{name}{ending}").write_text(text + "\n")
    return f"{name}{ending}"


def run_case(run, folder, case, form, angle="rad"):
    """Exit code, output and result of the command on its table in a form."""
    if form == "degrees":
        angle = None
    files = {"FILE": save(folder, "table", case, form, case.names, case.rows)}
    for name, (names, rows) in case.more.items():
        files[name] = save(folder, name.split(".")[0], case, form, names, rows)
    words = [files.get(w, w) for w in case.words]
    if angle is None and "ANGLE" in words:
        at = words.index("ANGLE")
        del words[at - 1 : at + 1]
    words = [angle if w == "ANGLE" else w for w in words]
    if form == "headerless":
        words.append("--columns=" + ",".join([*(["point"] if case.points else []), *case.names]))
    done = run(*words, "--json", "out.json")
    data = json.loads((folder / "out.json").read_text()) if done.exit_code == 0 else {}
    return done, data


def figures(data):
    return [[f.get("value"), f.get("std")] for f in data["figures"]]


@pytest.fixture
def case(request, share, tmp_path):
    servo_case.folder = tmp_path
    return CASES[request.param](share)


@pytest.mark.parametrize("case", CASES, indirect=True)
def test_a_table_in_any_form_gives_what_the_plain_one_gives(case, kr5_here, tmp_path):
    done, plain = run_case(kr5_here, tmp_path, case, "plain")
    assert done.exit_code == 0, done.output
    assert plain["figures"]
    for form in FORMS:
        if (form == "degrees" and not case.angles) or (form == "npz" and case.points):
            continue
        done, data = run_case(kr5_here, tmp_path, case, form)
        assert done.exit_code == 0, (form, done.output)
        assert [f["name"] for f in data["figures"]] == [f["name"] for f in plain["figures"]], form
        for (value, std), (other, other_std) in zip(figures(data), figures(plain), strict=True):
            assert value == pytest.approx(other, rel=1e-5, abs=1e-7), form
            assert (std is None) == (other_std is None) and (std is None or std == pytest.approx(other_std, rel=1e-3))


@pytest.mark.parametrize("case", CASES, indirect=True)
def test_a_bad_table_is_refused_with_its_place_and_the_remedy(case, kr5_here, tmp_path):
    _, text = written(case, "plain", case.names, case.rows)
    lines = text.splitlines()
    columns = len(lines[0].split(","))
    last = lines[0].split(",")[-1]
    cut = [*lines[:-1], lines[-1].rsplit(",", 1)[0]]
    word = [*lines[:3], ",".join([*lines[3].split(",")[:-1], "abc"]), *lines[4:]]
    infinite = [*lines[:3], ",".join([*lines[3].split(",")[:-1], "inf"]), *lines[4:]]
    twice = [lines[0].rsplit(",", 1)[0] + "," + lines[0].split(",")[-2], *lines[1:]]
    bad = {
        "empty": ([""], "is empty"),
        "cut off": (cut, f"line {len(lines)}: found {columns - 1} values, expected {columns}"),
        "word": (word, f"line 4, column '{last}': found 'abc', expected a number"),
        "infinite": (infinite, f"line 4, column '{last}': found 'inf', expected a finite number"),
        "name twice": (twice, "twice, expected a unique name for each column"),
        "no rows": (lines[:1], "no row of numbers"),
    }
    for name, (content, said) in bad.items():
        (tmp_path / "bad.csv").write_text("\n".join(content) + "\n")
        for other, (names, rows) in case.more.items():
            save(tmp_path, other.split(".")[0], case, "plain", names, rows)
        words = ["bad.csv" if w == "FILE" else "rad" if w == "ANGLE" else w for w in case.words]
        done = kr5_here(*words, "--json", "bad.json")
        told = " ".join(done.stderr.split())
        assert done.exit_code == 2 and done.exception.__traceback__ is not None, name
        assert "bad.csv" in told and said in told, (name, told)
        assert not (tmp_path / "bad.json").exists()


@pytest.mark.parametrize("case", CASES, indirect=True)
def test_missing_columns_are_told_in_the_same_words(case, kr5_here, tmp_path):
    (tmp_path / "bad.csv").write_text("u,v,w\n1,2,3\n4,5,6\n")
    for other, (names, rows) in case.more.items():
        save(tmp_path, other.split(".")[0], case, "plain", names, rows)
    words = ["bad.csv" if w == "FILE" else "rad" if w == "ANGLE" else w for w in case.words]
    done = kr5_here(*words)
    assert done.exit_code == 2
    assert "bad.csv: found the columns u, v, w; missing: " in done.stderr and "--columns" in done.stderr
    (tmp_path / "bad.csv").write_text("1,2,3\n4,5,6\n7,8,9\n")
    done = kr5_here(*words)
    assert done.exit_code == 2
    assert "found 3 columns without names; missing: " in done.stderr and "--columns " in done.stderr


def test_arrays_of_unequal_lengths_are_refused_with_both(kr5_here, tmp_path):
    np.savez(tmp_path / "log.npz", t=np.arange(9.0), command=np.zeros(10), response=np.zeros(10))
    done = kr5_here("identify", "servo", "log.npz")
    assert done.exit_code == 2 and "t has 9 values and command has 10" in done.stderr and "cut off" in done.stderr


def mcap(file, times, fields):
    pytest.importorskip("mcap", reason="pip install 'kr5[mcap]'")
    from mcap.writer import Writer

    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema(name="any", encoding="jsonschema", data=b"{}")
        channel = writer.register_channel(schema_id=schema, topic="/j", message_encoding="json")
        for k, t in enumerate(times):
            stamp = round(1e9 * t) + 1_700_000_000_000_000_000
            data = json.dumps({name: values[k].tolist() for name, values in fields.items()}).encode()
            writer.add_message(channel, log_time=stamp, publish_time=stamp, data=data)
        writer.finish()


def test_a_bag_is_a_log_of_every_command_that_takes_one(kr5_here, share, tmp_path):
    case = servo_case(share)
    _, plain = run_case(kr5_here, tmp_path, case, "plain")
    mcap(tmp_path / "log.mcap", case.rows[:, 0], {"command": case.rows[:, 1], "response": case.rows[:, 2]})
    assert kr5_here("identify", "servo", "log.mcap", "--json", "bag.json").exit_code == 0
    data = json.loads((tmp_path / "bag.json").read_text())
    assert np.allclose([f[0] for f in figures(data)], [f[0] for f in figures(plain)], rtol=1e-3)

    servo_case.folder = tmp_path
    case = gravity_case(share)
    _, plain = run_case(kr5_here, tmp_path, case, "plain")
    mcap(tmp_path / "slow.mcap", case.rows[:, 0], {"q": case.rows[:, 1:7], "tau": case.rows[:, 7:]})
    done = kr5_here("identify", "gravity", share / CELL, "slow.mcap", "--json", "bag.json")
    assert done.exit_code == 0, done.output
    data = json.loads((tmp_path / "bag.json").read_text())
    assert np.allclose([f[0] for f in figures(data)], [f[0] for f in figures(plain)], rtol=1e-4)


def test_a_joint_among_others_is_found_for_a_servo(kr5_here, tmp_path):
    t = 0.01 * np.arange(400)
    command = 0.3 * np.sin(np.outer(t, [1.0, 2.0]))
    response = np.column_stack([np.interp(t - 0.03, t, c) for c in command.T])
    header = "t," + ",".join(f"q_cmd_{k},q_act_{k}" for k in (1, 2))
    rows = np.column_stack([t, command[:, 0], response[:, 0], command[:, 1], response[:, 1]])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header=header, comments="")
    np.savetxt(tmp_path / "one.csv", rows[:, [0, 3, 4]], delimiter=",", header="t,command,response", comments="")
    words = ("--joint", "2", "--command", "smooth", "--accepted-std", "10")
    for name in ("log", "one"):
        done = kr5_here("identify", "servo", f"{name}.csv", *words, "--json", f"{name}.json")
        assert done.exit_code == 0, done.output
    one, log = (json.loads((tmp_path / f"{name}.json").read_text()) for name in ("one", "log"))
    assert figures(one) == figures(log)


def test_a_log_without_names_is_diagnosed_by_a_list_of_its_columns(kr5_here, share, tmp_path):
    lines = (share / "data/arm_log/joint_states.csv").read_text().splitlines()
    names = lines[0].split(",")
    model = share / "data/arm_log/arm.urdf"
    (tmp_path / "named.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "bare.csv").write_text("\n".join(lines[1:]) + "\n")
    (tmp_path / "other.csv").write_text(
        "\n".join(line.replace(",", ";").replace(".", ",") for line in lines[1:]) + "\n"
    )
    assert kr5_here("gap", "measure", "named.csv", "--model", model, "--json", "named.json").exit_code == 0
    plain = json.loads((tmp_path / "named.json").read_text())
    done = kr5_here("gap", "measure", "bare.csv", "--model", model)
    assert done.exit_code == 2 and f"names of its {len(names)} columns" in done.stderr and "--columns" in done.stderr
    for name in ("bare", "other"):
        done = kr5_here(
            "gap", "measure", f"{name}.csv", "--model", model, "--columns", ",".join(names), "--json", "b.json"
        )
        assert done.exit_code == 0, done.output
        assert json.loads((tmp_path / "b.json").read_text())["columns"] == plain["columns"]


# The reader itself


STEP = [TIME, Role("command", "command", "length"), Role("response", "response", "length"), RUN]


def step_table(file, text, columns=None, units=None):
    file.write_text(text)
    return read_table(file, STEP, units, columns=columns)


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("t,command,response\n0,0.5,1\n0.1,1.5,2\n", None),
        ("0;0,5;1\n0,1;1,5;2\n", "t,command,response"),
        ("0 0,5 1\n0,1 1,5 2\n", "t,command,response"),
        ("9,0,0.5,1,7\n9,0.1,1.5,2,7\n", "_,t,command,response,..."),
        ("# t command response\n0 0.5 1\n0.1 1.5 2\n", None),
        ("t|command|response\n0|0.5|1\n0.1|1.5|2\n", None),
        ("t [ms];command (mm);response (mm)\n0;500;1000\n100;1500;2000\n", None),
        ("t_ms,command_mm,response_mm\n0,500,1000\n100,1500,2000\n", None),
        ("s,a,b\n0,-0.5,-1\n0.1,-1.5,-2\n", "s,-a,-b"),
        ("t,response,command\n0,0.5,1\n0.1,1.5,2\n", "t,response,command"),
        ("0,500,1000\n100,1500,2000\n", "t [ms],command [mm],response [mm]"),
        ("t,command,response,\n0,0.5,1,\n0.1,1.5,2,\n", None),
    ],
)
def test_one_table_in_many_forms(tmp_path, text, columns):
    table = step_table(tmp_path / "log.csv", text, columns)
    assert np.allclose(table["t"], [0, 0.1])
    assert np.allclose(table["command"], [0.5, 1.5]) and np.allclose(table["response"], [1, 2])


def test_units_too_large_for_metres_are_found_unless_they_are_stated(tmp_path):
    text = "t,command,response\n0,500,1000\n0.1,1500,2000\n"
    table = step_table(tmp_path / "log.csv", text)
    assert np.allclose(table["command"], [0.5, 1.5])
    assert any("read in mm: 1500 is too large for m" in note for note in table.notes)
    with pytest.raises(
        kr5.IoError, match=r"command: lengths of up to 1500 m; are they in millimetres\? \(--length-unit mm\)"
    ):
        step_table(tmp_path / "log.csv", text, units=Units(length="m"))
    with pytest.raises(kr5.IoError, match="found the unit 'furlong', expected one of m, cm, mm, um"):
        step_table(tmp_path / "log.csv", text.replace("command", "command [furlong]"))


@pytest.mark.parametrize(
    ("header", "columns"),
    [
        ("time,q1,q2", None),
        ("time,theta_1,theta_2", None),
        ("time,q[0],q[1]", None),
        ("time,/joint_states/position[0],/joint_states/position[1]", None),
        ("time,J1,J2", None),
        ("a,b,c", "t,q{1-2}"),
    ],
)
def test_joint_values_are_found_by_the_names_of_logs(tmp_path, header, columns):
    (tmp_path / "log.csv").write_text(f"{header}\n0,0.1,0.2\n1,0.3,0.4\n")
    table = read_table(tmp_path / "log.csv", [TIME, joints_role()], columns=columns)
    assert np.allclose(table["q"], [[0.1, 0.2], [0.3, 0.4]])


def test_lists_of_columns():
    assert [c.name for c in parse_columns("t,q{1-3},tau{0-1} [N mm],_,...")] == [
        *("t", "q1", "q2", "q3", "tau0 [N mm]", "tau1 [N mm]", "_", "...")
    ]
    assert [c.sign for c in parse_columns("-a,b")] == [-1, 1]
    for text, said in (("t,,q", "found 't,,q'"), ("q{3-1}", "counts up"), ("q{1-99999999}", "counts up")):
        with pytest.raises(kr5.InvalidArgument, match=said):
            parse_columns(text)


def test_identification_takes_what_is_read(tmp_path):
    """A table is what the library takes: no unit is left to convert."""
    table = step_table(tmp_path / "log.csv", "t [ms],command [mm],response [mm]\n0,0,0\n12,24,0\n24,24,12\n")
    log = identification.ServoLog(t=table["t"], command=table["command"], response=table["response"])
    assert np.allclose(log.t, [0, 0.012, 0.024]) and np.allclose(log.command, [0, 0.024, 0.024])
