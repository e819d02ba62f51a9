"""`kr5 rsi emulate` and kr5.rsi.Emulator against a client that is written from the description of the interface, not
with the code of kr5."""

import contextlib
import json
import math
import os
import re
import signal
import statistics
import subprocess
import sys
import threading
import time

import kr5
import kr5.cell
import pytest
from kr5 import rsi

from kr5_tools.rsi import emulator_setup
from rsi_client import TcpClient, UdpClient, answer_to, ipoc_of, value

sim = pytest.importorskip("kr5.sim", reason="this kr5 was built without DART")

SLOW = {"cycle": 0.012, "answer_time": 0.012}  # long enough for a busy machine


@pytest.fixture(params=[UdpClient, TcpClient], ids=["udp", "tcp"])
def client(request):
    out = request.param()
    yield out
    out.close()


@pytest.fixture
def udp():
    out = UdpClient()
    yield out
    out.close()


def layout_for(client, controller="krc2", corrections="axes"):
    layout = rsi.usual_layout(controller, space=corrections)
    layout.address, layout.port, layout.transport = "127.0.0.1", client.port, rsi.Transport(client.transport)
    return layout


def emulator_for(client, share, controller="krc2", corrections="axes", rules=SLOW, **options):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    rules = rsi.ControllerRules(**{**rsi.usual_rules(controller).to_dict(), **rules})
    program = rsi.EmulationOptions(rules=rules, count_from="answer", **options.pop("program", {}))
    robot = sim.CellRobot(cell, sim.CellRobotOptions(cycle=rules.cycle, noise=False))
    quiet = {"priority": 0, "lock_memory": False}
    layout = layout_for(client, controller, corrections)
    emulator = rsi.Emulator(
        layout, cell.sensor_model(), rsi.EmulatorOptions(controller=program, real_time=quiet, **options), robot
    )
    return emulator, robot


def soon(test):
    end = time.monotonic() + 5
    while not test() and time.monotonic() < end:
        time.sleep(0.01)
    return test()


def test_a_client_guides_the_arm_of_a_cell(client, share):
    emulator, robot = emulator_for(client, share)
    greeting = client.receive()
    assert greeting == '<Rob Type="KUKA"><IPOC>0</IPOC></Rob>'
    first = client.receive()
    start = value(first, "AIPos", "A1")
    client.send(answer_to(first))
    for k in range(120):
        telegram = client.receive()
        assert ipoc_of(telegram) == str(12 * (k + 2))
        client.send(answer_to(telegram, (min(0.05 * k, 3.0), 0, 0, 0, 0, 0)))
    telegram = client.receive()
    assert value(telegram, "AIPos", "A1") - start == pytest.approx(3.0, abs=0.01)
    assert value(telegram, "ASPos", "A1") == pytest.approx(start, abs=1e-3)
    assert math.degrees(robot.actual().position[0]) - start == pytest.approx(3.0, abs=0.01)
    statistics = emulator.statistics()
    assert str(statistics.controller.phase) == "running" and statistics.controller.telegrams.faulty() == 0
    assert {str(e.kind) for e in emulator.events()} >= {"started", "answered"}


def test_a_wrong_ipoc_is_no_answer_and_ends_the_program(client, share):
    emulator, _ = emulator_for(client, share)
    client.receive()  # the greeting
    for _ in range(3):
        client.send(answer_to(client.receive()))
    with pytest.raises((ConnectionError, TimeoutError)):
        if client.transport == "udp":
            client.socket.settimeout(1)
        for _ in range(60):
            telegram = client.receive()
            client.send(answer_to(telegram).replace(ipoc_of(telegram), str(int(ipoc_of(telegram)) + 1)))
    assert str(emulator.statistics().controller.stop.reason) == "late_answers"
    assert emulator.statistics().controller.missing_now == 10
    assert "RSI stopped" in rsi.stop_message("krc2", emulator.statistics().controller.stop)


def test_the_tool_follows_the_servo_of_the_path(udp, share):
    emulator, _ = emulator_for(udp, share, "krc4", corrections="cartesian")
    start = None
    for _ in range(300):
        telegram = udp.receive()
        start = value(telegram, "RIst", "Z") if start is None else start
        udp.send(answer_to(telegram, (0, 0, 2.0, 0, 0, 0), "RKorr"))
    passed = value(udp.receive(), "RIst", "Z") - start
    assert passed == pytest.approx(2.0, abs=0.1)
    assert emulator.tool_correction()[2, 3] == pytest.approx(0.002)


def test_a_correction_beyond_its_limit_ends_the_program(udp, share):
    emulator, robot = emulator_for(udp, share, "krc5")
    telegram = udp.receive()
    udp.send(answer_to(telegram, (0, 0, 0, 5.1, 0, 0)))
    assert soon(lambda: str(emulator.statistics().controller.phase) == "ended")
    stop = emulator.statistics().controller.stop
    assert (str(stop.reason), stop.axis) == ("axis_limit", 4)
    assert "A4" in rsi.stop_message("krc5", stop)
    before = robot.actual().position
    time.sleep(0.1)
    assert robot.actual().position == pytest.approx(before, abs=1e-9)


def test_an_arm_that_answers_nothing_stays(udp, share):
    emulator, robot = emulator_for(udp, share, "krc4")
    start = robot.actual().position
    for _ in range(20):
        udp.receive()
    assert robot.actual().position == pytest.approx(start, abs=1e-12)
    assert emulator.statistics().controller.missing == 0  # counted from the first answer on


def test_drives_emergency_stop_and_reset(udp, share):
    emulator, _ = emulator_for(udp, share, "krc4")
    for _ in range(5):
        udp.send(answer_to(udp.receive()))
    emulator.emergency_stop()
    assert str(emulator.statistics().controller.phase) == "emergency_stop"
    emulator.set_drives(True)
    assert str(emulator.statistics().controller.phase) == "running"
    with pytest.raises(kr5.InvalidArgument, match="override_share"):
        emulator.set_override(50)
    port = udp.peer
    emulator.reset_program()
    assert soon(lambda: emulator.statistics().controller.programs == 2)
    while ipoc_of(udp.receive()) != "0":
        pass
    assert udp.peer != port


def test_without_socket_and_clock(share):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    robot = sim.CellRobot(cell, sim.CellRobotOptions(cycle=0.004, noise=False))
    controller = rsi.EmulatedController(rsi.usual_layout("krc4"), cell.sensor_model(), rsi.EmulationOptions(), robot)
    telegram = controller.cycle().decode()
    assert str(controller.receive(answer_to(telegram).encode(), 0.001)) == "good"
    assert str(controller.receive(answer_to(telegram).encode(), 0.001)) == "repeated"
    assert str(controller.receive(b"hello", 0.001)) == "faulty"
    for _ in range(101):
        telegram = controller.cycle()
    assert telegram == b"" and str(controller.statistics.stop.reason) == "late_answers"
    assert [str(e.kind) for e in controller.events] == ["started", "answered", "missing", "ended"]


def answer_all(client, count):
    """Answers in the background until that many telegrams came, or none comes any more."""

    def run():
        try:
            for _ in range(count):
                telegram = client.receive()
                if "<AIPos" in telegram:
                    client.send(answer_to(telegram))
        except OSError:
            pass

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread


def test_the_command_tells_what_there_was(client, share, run_kr5, tmp_path):
    answer_all(client, 10_000)
    done = run_kr5(
        "rsi", "emulate", share / "cells/kr5_arc.yaml", "--controller", "krc2", "--transport", client.transport,
        "--port", client.port, "--for", 2, "--do", "override=50@0.5", "--timeout", 1000, "--json", "out.json",
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    out = json.loads((tmp_path / "out.json").read_text())
    answered = out["statistics"]["controller"]["answered"]
    assert answered > 50 and out["message"] == "" and out["transport"] == client.transport
    assert f"{answered} of " in done.stdout and "override changed" in done.stdout and "median [ms]" in done.stdout
    assert out["statistics"]["controller"]["override_share"] == 0.5


def path_of_axis(client, count=400):
    """Programmed position of the first axis in each telegram [deg], of a client that answers nothing but zeros."""
    out = []
    try:
        for _ in range(count):
            telegram = client.receive()
            out.append(value(telegram, "ASPos", "A1"))
            client.send(answer_to(telegram))
    except (ConnectionError, TimeoutError):
        pass
    return out


def test_an_override_slows_the_path_that_the_command_is_given(udp, share, run_kr5):
    told = []
    listening = threading.Thread(target=lambda: told.extend(path_of_axis(udp)))
    listening.start()
    done = run_kr5(
        "rsi", "emulate", share / "cells/kr5_arc.yaml", "--port", udp.port, "--for", 3, "--timeout", 1000,
        "--rule", "cycle=0.012", "--rule", "answer_time=0.012", "--do", "override=50@1",
        "--path", "60,32.5,-178.5,0,-90,0", "--path-speed", 10,
    )  # fmt: skip
    udp.socket.settimeout(1)
    listening.join()
    assert done.returncode == 0, done.stdout + done.stderr
    assert "add --path" not in done.stderr
    steps = [later - earlier for earlier, later in zip(told, told[1:])]
    full, slowed = statistics.median(steps[:20]), statistics.median(steps[-20:])
    assert full == pytest.approx(10 * 0.012, rel=1e-2)  # degrees in a cycle
    assert slowed == pytest.approx(0.5 * full, rel=1e-2)


def test_an_override_without_anything_to_slow_is_told(udp, share, run_kr5):
    answer_all(udp, 10_000)
    words = ("rsi", "emulate", share / "cells/kr5_arc.yaml", "--port", udp.port, "--for", 0.5, "--timeout", 1000)
    assert "add --path" in run_kr5(*words, "--do", "override=50@0.1").stderr
    scaled = run_kr5(*words, "--do", "override=50@0.1", "--rule", "override_scales_corrections=true")
    assert "add --path" not in scaled.stderr


def test_rules_and_places_are_read_by_name_and_unit(share):
    given = ("max_late_share=0.25", "at_limit=hold", "greets=true", "first_ipoc=7", "idle_limit=60")
    rules = emulator_setup.make_rules(rsi.Controller.Krc4, 5, 1.0, None, given)
    assert (rules.max_late, rules.max_late_share, str(rules.at_limit)) == (5, 0.25, "hold")
    assert rules.greets is True and rules.first_ipoc == 7 and rules.idle_limit == 60
    assert (
        emulator_setup.make_rules(rsi.Controller.Krc2, None, None, None, ["max_late_share=none"]).max_late_share is None
    )
    robot = kr5.cell.load_cell(share / "cells/kr5_arc.yaml").robot
    assert emulator_setup.parse_place("90,0,-180,0,0,-30", robot) == pytest.approx(
        [math.pi / 2, 0, -math.pi, 0, 0, -math.pi / 6]
    )
    gantry = kr5.cell.load_cell(share / "cells/gantry_rrp.yaml").robot
    slides = [str(row.type) == "prismatic" for row in gantry.dh]
    place = emulator_setup.parse_place(",".join("50" if slide else "0" for slide in slides), gantry)
    assert any(slides) and place == [0.05 if slide else 0 for slide in slides]


@pytest.mark.parametrize(
    "text, complaint",
    [
        ("speed=1", "expected NAME=VALUE with NAME cycle"),
        ("max_late", "expected a number without fraction"),
        ("max_late=1.5", "expected a number without fraction"),
        ("greets=yes", "expected true or false"),
        ("at_limit=1", "expected stop or hold"),
        ("idle_limit=long", "expected a number, or none"),
        ("cycle=none", "expected a number"),
        ("cycle=nan", "expected a number"),
    ],
)
def test_a_rule_that_is_none_is_told(text, complaint):
    with pytest.raises(kr5.InvalidArgument, match=complaint):
        emulator_setup.parse_rule(text)


def test_the_command_loses_what_it_is_told_to(udp, share, run_kr5, tmp_path):
    answer_all(udp, 10_000)
    done = run_kr5(
        "rsi", "emulate", share / "cells/kr5_arc.yaml", "--port", udp.port, "--for", 2, "--fault", "lose@0.5x5",
        "--json", "-",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    statistics = json.loads(done.stdout)["statistics"]
    assert statistics["telegram_faults"]["lost"] == 5 and statistics["controller"]["missing"] >= 5


def test_the_command_ends_with_the_program(share, run_kr5):
    silent = UdpClient()
    done = run_kr5(
        "rsi", "emulate", share / "cells/kr5_arc.yaml", "--port", silent.port, "--strict", "--timeout", 20, "--for", 60
    )
    silent.close()
    assert done.returncode == 1
    assert f"No client gave a good answer at 127.0.0.1:{silent.port} (UDP)" in done.stdout
    assert "RSITimeout" in done.stdout  # among the events
    assert "None came." in done.stdout


def test_the_command_says_what_is_wrong_with_answers_of_which_none_is_good(udp, share, run_kr5):
    def answer_wrongly():
        with contextlib.suppress(OSError):
            while True:
                udp.send(re.sub("<IPOC>.*</IPOC>", "<IPOC>999999999</IPOC>", answer_to(udp.receive())))

    threading.Thread(target=answer_wrongly, daemon=True).start()
    done = run_kr5("rsi", "emulate", share / "cells/kr5_arc.yaml", "--port", udp.port, "--for", 2)
    assert done.returncode == 1
    assert "answers had an IPOC that was never sent: send the digits back as they came." in done.stdout


def test_ctrl_c_ends_it_with_its_tables(udp, share, tmp_path):
    answer_all(udp, 10_000)
    words = ["rsi", "emulate", str(share / "cells/kr5_arc.yaml"), "--port", str(udp.port), "--json", "out.json"]
    command = [sys.executable, "-m", "kr5_tools", *words]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        udp.socket.settimeout(60)
        assert soon_for(60, lambda: udp.peer[1] != 0)
        time.sleep(1)
        child.send_signal(signal.SIGINT)
        out, err = child.communicate(timeout=60)
    assert child.returncode == 130, err
    assert "had a good answer" in out and "stopped; written: out.json" in err
    assert json.loads((tmp_path / "out.json").read_text())["statistics"]["controller"]["answered"] > 0


def soon_for(seconds, test):
    end = time.monotonic() + seconds
    while not test() and time.monotonic() < end:
        time.sleep(0.05)
    return test()


def cell_with(share, tmp_path, change):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    change(cell)
    file = tmp_path / "cell.yaml"
    kr5.cell.save_cell(cell, file)
    return file


def test_bad_input_is_told_with_its_remedy(share, run_kr5, tmp_path, udp):
    cell = share / "cells/kr5_arc.yaml"

    def error(*args, file=cell):
        done = run_kr5("rsi", "emulate", file, "--for", 1, *args)
        assert done.returncode == 2, done.stdout + done.stderr
        return done.stderr

    taken = error("--own-port", udp.port, "--port", udp.port)
    assert str(udp.port) in taken and "another program" in taken
    assert "as lose@1.5x10" in error("--fault", "burn@1")
    assert "as drives_off@2.5" in error("--do", "drives_off")
    assert "override=PERCENT" in error("--do", "override=200@1")
    assert "expected 6 joint values" in error("--path", "1,2,3")
    assert "joint 3: found 0, the cell allows -265 to -92" in error("--path", "0,0,0,0,0,0")
    assert "path_speed" in error("--path", "0,0,-100,0,0,0", "--path-speed", 0)
    assert "--rule" in error("--rule", "nothing=1")
    assert "TCP is that of a KR C2 alone" in error("--controller", "krc4", "--transport", "tcp")
    assert "more than 1 together" in error("--lose", 0.7, "--late", 0.7)
    assert "192.168.1.60" in error("--address", "robot")
    assert "nowhere.xml" in error("--layout", tmp_path / "nowhere.xml")
    assert "nowhere.yaml" in error(file=tmp_path / "nowhere.yaml")
    without = cell_with(share, tmp_path, lambda c: setattr(c, "servo", None))
    said = error(file=without)
    assert "cell.yaml" in said and "servo.joint" in said
    assert "joints" in error(file=share / "cells/gantry_rrp.yaml") or "servo" in error(
        file=share / "cells/gantry_rrp.yaml"
    )


def test_published_answers_and_configurations_go_through(reference, share):
    folder = reference / "data/rsi_wire"
    if not folder.is_dir():
        pytest.skip(f"no folder {folder}")
    layout = rsi.load_layout(str(folder / "krc4_ros_rsi_ethernet.xml"))
    texts = {m["id"]: m["text"] for m in json.loads((folder / "messages.json").read_text())["messages"]}
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    robot = sim.CellRobot(cell, sim.CellRobotOptions(cycle=0.004))
    controller = rsi.EmulatedController(layout, cell.sensor_model(), rsi.EmulationOptions(), robot)
    telegram = controller.cycle().decode()
    names = [m.lower() for m in re.findall(r"<(\w+)", telegram)]
    assert names == [m.lower() for m in re.findall(r"<(\w+)", texts["rosi_simulator_first_rob"])]
    assert str(controller.receive(texts["rosi_hw_interface_zero_sen"].encode(), 0.001)) == "good"
    assert str(controller.receive(texts["fzi_writer_test_sen"].encode(), 0.001)) == "faulty"


def test_the_help_has_an_example(run_kr5):
    done = run_kr5("rsi", "emulate", "--help")
    assert done.returncode == 0 and "Example: kr5 rsi emulate" in " ".join(done.stdout.split())
    assert "emulate" in run_kr5("rsi", "--help").stdout


def test_no_process_is_left(share, udp, tmp_path):
    """An emulator that goes takes its thread with it."""
    before = len(os.listdir("/proc/self/task"))
    emulator, _ = emulator_for(udp, share, "krc4")
    udp.receive()
    del emulator
    assert soon(lambda: len(os.listdir("/proc/self/task")) <= before)
