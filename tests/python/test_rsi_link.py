"""`kr5 rsi doctor` and `kr5 rsi monitor` at a controller that is written here from the description of the interface,
and that misbehaves in chosen ways."""

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field

import kr5
import numpy as np
import pytest
from kr5 import rsi

from free_ports import free_port
from kr5_tools.rsi.findings import WORDS, finding_words

HOME = (10.0, -80.0, 95.0, 5.0, 60.0, -20.0)  # [deg]
POSE = (445.0, 20.0, 790.0, 10.0, 85.0, -5.0)  # [mm, deg]
PATIENCE = 25  # cycles
PRIORITY = 50  # below that of the link
PUNCTUAL = 0.03  # [s] by which a telegram may go late from a computer that has time for a controller
TRIALS = 5  # of a busy computer
LATENESS = {"jitter", "late_answers"}  # what a busy computer may add, and no more
CONFIGURATION = """<ROOT>
  <CONFIG><IP_NUMBER>127.0.0.1</IP_NUMBER><PORT>{port}</PORT><SENTYPE>ImFree</SENTYPE><ONLYSEND>FALSE</ONLYSEND></CONFIG>
  <SEND><ELEMENTS>
    <ELEMENT TAG="DEF_RIst" TYPE="DOUBLE" INDX="INTERNAL" />
    <ELEMENT TAG="DEF_RSol" TYPE="DOUBLE" INDX="INTERNAL" />
    <ELEMENT TAG="DEF_AIPos" TYPE="DOUBLE" INDX="INTERNAL" />
    <ELEMENT TAG="DEF_ASPos" TYPE="DOUBLE" INDX="INTERNAL" />
    <ELEMENT TAG="DEF_Delay" TYPE="LONG" INDX="INTERNAL" />
  </ELEMENTS></SEND>
  <RECEIVE><ELEMENTS>{receive}</ELEMENTS></RECEIVE>
</ROOT>
"""
RECEIVE = "".join(f'<ELEMENT TAG="AK.A{i}" TYPE="DOUBLE" INDX="{i}" HOLDON="1" />' for i in range(1, 7))


@dataclass
class Controller(threading.Thread):
    """Sends a telegram each cycle, whatever comes back, and moves its axes by the corrections that it gets. What is not
    answered within PATIENCE counts as late; a real one waits a cycle, which is too short for a thread of Python."""

    port: int
    cycle: float = 0.004
    gain: float = 1.0
    sensor_type: str = "ImFree"
    lose: int = 0  # every so many telegrams one is not sent
    double: int = 0
    second: int = 0  # every so many cycles another sender sends one, too
    cut: int = 0
    restart: int = 0
    change: object = staticmethod(lambda text: text)
    axes: tuple = HOME
    pose: tuple = POSE
    over: threading.Event = field(default_factory=threading.Event)
    waiting: dict = field(default_factory=dict)  # IPOC of what is not answered, with its number
    heard: bool = False
    first_heard: int = 0  # telegram whose answer it was
    sent: int = 0
    late: int = 0
    most: float = 0.0  # motion of an axis [deg]
    delay: float = 0.0  # of the telegram that went out latest [s]

    def __post_init__(self):
        super().__init__(daemon=True)

    __hash__ = threading.Thread.__hash__

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.join()

    def telegram(self, ipoc, moved):
        def six(name, letters, values):
            return f"<{name} " + " ".join(f'{a}="{v:.4f}"' for a, v in zip(letters, values)) + " />"

        axes, names = [a + m for a, m in zip(self.axes, moved)], [f"A{i}" for i in range(1, 7)]
        text = six("RIst", "XYZABC", self.pose) + six("RSol", "XYZABC", self.pose)
        text += six("AIPos", names, axes) + six("ASPos", names, self.axes)
        text = f'<Rob TYPE="KUKA">{text}<Delay D="{self.late}" /><IPOC>{ipoc}</IPOC></Rob>'
        return self.change(text).encode()

    def run(self):
        with contextlib.suppress(PermissionError):  # where it may, it keeps its cycle beside other work, as a real one
            os.sched_setscheduler(threading.get_native_id(), os.SCHED_FIFO, os.sched_param(PRIORITY))
        self.ipoc, moved, correction, due = 4208163, np.zeros(6), np.zeros(6), time.monotonic()
        with (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
        ):
            end.setblocking(False)
            while not self.over.is_set():
                self.sent += 1
                # Counted from the first answer, so that who began to listen late meets no other pause.
                if self.restart and self.heard and (self.sent - self.first_heard) % self.restart == 0:
                    time.sleep(0.8)
                    self.ipoc, due = 1000, time.monotonic()
                    self.waiting.clear()
                self.send(end, other, moved)
                due += self.cycle
                time.sleep(max(due - time.monotonic(), 0.0))
                self.delay = max(self.delay, time.monotonic() - due)
                correction = self.take_answers(end, correction)
                moved += (self.gain * correction - moved) * 0.2
                self.most = max(self.most, np.abs(moved).max())

    def send(self, end, other, moved):
        """One telegram, as it is to be and as it is sent."""

        def now(every):
            return every and self.sent % every == 0

        self.ipoc += round(1000 * self.cycle)
        self.waiting[str(self.ipoc)] = self.sent
        data, to = self.telegram(self.ipoc, moved), ("127.0.0.1", self.port)
        if not now(self.lose):
            end.sendto(data[: len(data) // 2] if now(self.cut) else data, to)
        if now(self.double):
            end.sendto(data, to)
        if now(self.second):
            other.sendto(data, to)

    def take_answers(self, end, correction):
        """The correction of the last answer that is good."""
        for text in self.answers(end):
            if not self.heard:
                self.waiting.clear()  # before, nobody was there
                self.heard, self.first_heard = True, self.sent
            ipoc = re.search("<IPOC>(.*)</IPOC>", text)[1]
            if f'<Sen Type="{self.sensor_type}">' in text and ipoc in self.waiting:
                del self.waiting[ipoc]
                correction = np.array([float(v) for v in re.findall(r' A\d="([^"]*)"', text)])
        for ipoc in [i for i, sent in self.waiting.items() if self.sent - sent > PATIENCE]:
            del self.waiting[ipoc]
            self.late += 1
        return correction

    @staticmethod
    def answers(end):
        while True:
            try:
                yield end.recv(4096).decode()
            except OSError:
                return


@pytest.fixture
def layout_file(tmp_path):
    def write(port: int, **replaced: str):
        file = tmp_path / "cell_ethernet.xml"
        text = CONFIGURATION.format(port=port, receive=RECEIVE)
        for old, new in replaced.items():
            text = text.replace(old, new)
        file.write_text(text)
        return file

    return write


@pytest.fixture
def doctor(run_kr5, layout_file):
    """Runs the doctor at a controller; gives what it said and its JSON. It runs again where this computer was too busy
    to be a controller: then the link has faults that the test does not know of."""

    def run(*options, seconds=1.5, replaced=None, **behaviour):
        for _ in range(TRIALS):
            port = free_port()
            file = layout_file(port, **(replaced or {}))
            with Controller(port, **behaviour) as controller:
                done = run_kr5(
                    "rsi", "doctor", file, "--for", seconds, "--listen", "127.0.0.1", "--json", "o.json", *options
                )
            assert done.returncode in (0, 1), (done.returncode, done.stderr)
            if controller.delay < PUNCTUAL:
                break
        return done, json.loads((file.parent / "o.json").read_text()), controller

    return run


def kinds(data) -> set[str]:
    return {f["kind"] for f in data["findings"]}


def test_a_free_port_stays_free_until_somebody_listens():
    ports = [free_port() for _ in range(50)]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        assert max(ports) < other.getsockname()[1]  # the kernel has a range of its own
    assert len(set(ports)) == 50
    for port in ports:  # as another process that asks for one
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as mark, pytest.raises(OSError):
            mark.bind(("127.0.0.1", port))


def test_a_sound_link_is_called_sound(doctor, tmp_path):
    done, data, _ = doctor("--png", "plots")
    assert (tmp_path / "plots/link_times.png").read_bytes()[:4] == b"\x89PNG"
    tail = data["answer"]["tail"]
    assert tail == sorted(tail) and tail[-1] == data["answer"]["max"]
    assert kinds(data) <= LATENESS, done.stdout
    assert data["telegrams"]["good"] > 100 and data["cycle"] == pytest.approx(0.004, rel=0.1)
    if data["verdict"] == "sound":
        assert done.returncode == 0 and "Sound:" in done.stdout
    assert "p99 [ms]" in done.stdout


@pytest.mark.parametrize(
    "kind, behaviour, said",
    [
        ("lost_telegrams", {"lose": 20}, "were lost"),
        ("repeated_telegrams", {"double": 15}, "came twice"),
        ("damaged_telegrams", {"cut": 25}, "truncated"),
        ("second_sender", {"second": 10}, "127.0.0.1"),
        ("wrong_rate", {"cycle": 0.012}, "ms, expected every 4 ms"),
        ("answers_rejected", {"sensor_type": "KR5"}, "SENTYPE ('ImFree')"),
        ("controller_restarted", {"restart": 250}, "began anew"),
        ("missing_elements", {"change": lambda t: re.sub("<ASPos.*?/>", "", t)}, "lacked ASPos"),
        ("unknown_elements", {"change": lambda t: t.replace("<IPOC>", '<Krl V="1" /><IPOC>')}, "held Krl"),
        ("wrong_type", {"change": lambda t: t.replace("KUKA", "ROBOT")}, "Rob Type=ROBOT"),
        ("foreign_datagrams", {"change": lambda t: "GET / HTTP/1.1"}, "GET / HTTP/1.1"),
    ],
)
def test_what_is_wrong_is_named_with_a_remedy(doctor, kind, behaviour, said):
    done, data, _ = doctor(seconds=2.5, **behaviour)
    assert kinds(data) - LATENESS == {kind}, done.stdout
    assert said in done.stdout and "Remedy: " in done.stdout
    finding = next(f for f in data["findings"] if f["kind"] == kind)
    assert finding["text"] and finding["remedy"]
    assert done.returncode == (1 if any(f["severity"] == "fault" for f in data["findings"]) else 0)


def test_elements_in_another_order_are_named(doctor):
    def turned(text):
        delay = re.search("<Delay.*?/>", text)[0]
        return text.replace(delay, "").replace("<RIst", delay + "<RIst")

    done, data, _ = doctor(change=turned)
    assert kinds(data) - LATENESS == {"other_order"}
    assert "Delay RIst RSol AIPos ASPos, expected RIst RSol AIPos ASPos Delay" in done.stdout


def test_nothing_comes_and_why(run_kr5, layout_file, tmp_path):
    port = free_port()
    file = layout_file(port, **{"127.0.0.1": "192.0.2.1"})
    done = run_kr5("rsi", "doctor", file, "--for", 1, "--listen", "127.0.0.1", "--json", "o.json")
    assert done.returncode == 1 and "Faulty:" in done.stdout
    assert "192.0.2.1, which is no address of this computer" in done.stdout and "firewall" in done.stdout
    with Controller(free_port()):
        file = layout_file(port)
        done = run_kr5("rsi", "doctor", file, "--for", 2, "--listen", "127.0.0.1", "--json", "o.json")
    data = json.loads((tmp_path / "o.json").read_text())
    if data["datagrams_elsewhere"] is None:
        pytest.skip("this kernel does not count datagrams without a listener")
    assert kinds(data) == {"wrong_port"} and "--port" in done.stdout


def test_another_port_than_that_of_the_layout(run_kr5, layout_file, tmp_path):
    port = free_port()
    with Controller(port):
        options = ("--port", port, "--for", 1, "--listen", "127.0.0.1", "--json", "-")
        done = run_kr5("rsi", "doctor", layout_file(49152), *options)
    assert kinds(json.loads(done.stdout)) - LATENESS == {"other_port"}


def test_who_only_listens_does_not_move_or_answer(doctor):
    done, data, controller = doctor("--passive")
    assert not data["answering"] and not controller.heard
    assert kinds(data) <= {"jitter"}, done.stdout


def test_a_test_motion_tells_the_sign_of_corrections(doctor):
    done, data, controller = doctor("--move", seconds=10, gain=-1.0)
    assert kinds(data) - LATENESS == {"correction_sign"}, done.stdout
    assert "A1, A2, A3, A4, A5, A6 moved against the correction (gain -1.00)" in done.stdout
    assert 0.05 < controller.most < 0.11


def test_a_test_motion_needs_time_and_answers(run_kr5, layout_file):
    file = layout_file(free_port())
    done = run_kr5("rsi", "doctor", file, "--move", "--for", 2)
    assert done.returncode == 2 and "--for: the test motion takes 8.4 s" in done.stderr
    done = run_kr5("rsi", "doctor", file, "--move", "--passive")
    assert done.returncode == 2 and "--move" in done.stderr


def test_axis_values_in_radians_are_told_by_the_cell(doctor, share):
    cell = share / "cells" / "kr5_arc.yaml"
    import kr5.cell

    pose = 1e3 * kr5.cell.load_cell(cell).T_base_tool(np.radians(HOME))[:3, 3]
    done, data, _ = doctor("--cell", cell, pose=(*pose, 0.0, 0.0, 0.0))
    assert data["pose_compared"] and kinds(data) <= LATENESS, done.stdout
    done, data, _ = doctor("--cell", cell, pose=(*pose, 0.0, 0.0, 0.0), axes=tuple(np.radians(HOME)))
    assert kinds(data) - LATENESS == {"radian_axes"}
    done, data, _ = doctor("--cell", cell)
    assert kinds(data) - LATENESS == {"pose_mismatch"} and "active tool and base" in done.stdout


def test_bad_input_is_told_before_anything_is_listened_to(run_kr5, layout_file, tmp_path):
    for command in ("doctor", "monitor"):
        done = run_kr5("rsi", command, "nowhere.xml")
        assert done.returncode == 2 and "nowhere.xml" in done.stderr
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("127.0.0.1", 0))
            file = layout_file(taken.getsockname()[1])
            done = run_kr5("rsi", command, file, "--for", 1, "--listen", "127.0.0.1")
        assert done.returncode == 2 and "another program listens there" in done.stderr
        done = run_kr5("rsi", command, file, "--for", 1, "--listen", "robot")
        assert done.returncode == 2 and "192.168.1.60" in done.stderr
    done = run_kr5("rsi", "doctor", file, "--cycle", 4)
    assert done.returncode == 2 and "cycle" in done.stderr
    done = run_kr5("rsi", "monitor", file, "--log", "log.txt", "--for", 1)
    assert done.returncode == 2 and "expected .csv or .mcap" in done.stderr
    done = run_kr5("rsi", "doctor", file, "--json", file)
    assert done.returncode == 2 and "input" in done.stderr


def test_every_kind_has_words():
    layout = rsi.usual_layout("krc4")
    assert set(WORDS) == {str(kind) for kind in rsi.LinkFindingKind.__members__.values()}
    for kind in WORDS:
        finding = rsi.LinkFinding(
            kind=kind, count=3, of=10, first=0.5, measured_time=0.02, expected_time=0.004, distance=0.1,
            other_distance=0.001, gain=-1.0, names=["A1", "A2"], found="this", expected="that",
        )  # fmt: skip
        text, remedy = finding_words(finding, layout)
        assert len(text) > 15 and len(remedy) > 10 and not text.endswith(".") and "None" not in text + remedy


@pytest.mark.parametrize("ending", ["csv", "mcap"])
def test_the_log_of_the_monitor_loads_as_a_log(run_kr5, layout_file, tmp_path, ending):
    if ending == "mcap":
        pytest.importorskip("mcap")
    from kr5.logs.log_file import read_log

    port = free_port()
    with Controller(port, cut=50) as controller:
        options = (
            "--for",
            1.5,
            "--listen",
            "127.0.0.1",
            "--log",
            f"log.{ending}",
            "--json",
            "o.json",
            "--png",
            "plots",
        )
        done = run_kr5("rsi", "monitor", layout_file(port), *options)
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "o.json").read_text())
    log = read_log(tmp_path / f"log.{ending}")
    columns = {name.split(":")[-1]: values for name, values in log.columns.items()}
    assert len(columns["t"]) == data["rows"] > 100
    assert np.all(np.diff(columns["t"]) > 0)
    assert np.median(np.diff(columns["t"])) == pytest.approx(0.004)
    assert np.allclose(np.column_stack([columns[f"q{i}"] for i in range(1, 7)]), np.radians(HOME), atol=1e-6)
    assert np.allclose(columns["x"], 1e-3 * POSE[0])
    assert data["telegrams"]["truncated"] > 0 and data["faulty"][-1]["fault"] == "truncated"
    assert (tmp_path / "plots/link_times.png").is_file()
    assert f"log.{ending}: {data['rows']} rows" in done.stdout and controller.sent >= data["rows"]
    for word in ("period", "lateness", "p99 [ms]", "telegrams lost", "Last faulty telegrams"):
        assert word in done.stdout


def test_a_log_of_the_monitor_becomes_a_recording(run_kr5, layout_file, share, tmp_path):
    port = free_port()
    with Controller(port):
        file = layout_file(port)
        run_kr5("rsi", "monitor", file, "--for", 1.5, "--listen", "127.0.0.1", "--log", "log.csv")
    cell = share / "cells" / "kr5_arc.yaml"
    (tmp_path / "map.yaml").write_text(
        f"""format: kr5-map/1
cell: {cell}
clock: {{column: t, unit: s}}
columns:
  q: {{from: "q{{}}", unit: rad}}
  qc: {{from: "qc{{}}", unit: rad}}
experiments:
- {{name: rest, kind: motion, split: fit}}
"""
    )
    done = run_kr5("recording", "import", "log.csv", "--map", "map.yaml", "-o", "recording", "--trust")
    assert done.returncode == 0, done.stderr
    import kr5.cell

    recording = kr5.cell.load_recording(tmp_path / "recording")
    assert np.allclose(recording.experiments[0]["q2"], np.radians(HOME[1]), atol=1e-5)


def test_the_monitor_ends_by_ctrl_c_and_keeps_its_log(layout_file, tmp_path):
    port = free_port()
    file = layout_file(port)
    command = [sys.executable, "-m", "kr5_tools", "rsi", "monitor", file, "--listen", "127.0.0.1", "--log", "log.csv"]
    with Controller(port):
        running = subprocess.Popen(
            [*command, "--json", "o.json"], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env={**os.environ, "COLUMNS": "80"},
        )  # fmt: skip
        while sum(file.read_bytes().count(b"\n") for file in tmp_path.glob(".kr5-*.csv")) <= 51:
            assert running.poll() is None
            time.sleep(0.05)
        running.send_signal(signal.SIGINT)
        out, error = running.communicate(timeout=60)
    assert running.returncode == 0, error
    rows = json.loads((tmp_path / "o.json").read_text())["rows"]
    assert rows > 50 and len((tmp_path / "log.csv").read_text().splitlines()) == rows + 1
    assert f"log.csv: {rows} rows" in out


def test_a_monitor_that_joins_a_moving_path_leaves_it_alone(share, run_kr5, tmp_path):
    layout = rsi.usual_layout("krc4")
    layout.address, layout.port = "127.0.0.1", free_port()
    (tmp_path / "link.xml").write_text(rsi.layout_xml(layout))
    (tmp_path / "settings.yaml").write_text("format: kr5-rsi-settings/1\ncurrent_units: [1, 1, 1, 1, 1, 1]\n")
    words = ["rsi", "emulate", str(share / "cells/kr5_arc.yaml"), "--layout", "link.xml", "--timeout", "100000"]
    words += ["--path", "20,-70,-110,0,30,0", "--path", "-40,0,-120,0,0,0", "--path-speed", "20", "--for", "9"]
    command = [sys.executable, "-m", "kr5_tools", *words, "--json", "emulated.json"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as emulator:
        time.sleep(3)
        options = ("--for", 2, "--listen", "127.0.0.1", "--log", "log.csv", "--settings", "settings.yaml")
        done = run_kr5("rsi", "monitor", "link.xml", *options)
        emulator.communicate(timeout=60)
    assert done.returncode == 0, done.stderr
    out = json.loads((tmp_path / "emulated.json").read_text())
    assert out["message"] == "" and out["statistics"]["controller"]["answered"] > 100
    log = np.genfromtxt(tmp_path / "log.csv", delimiter=",", names=True)
    ways = [np.ptp(log[f"qc{k}"]) for k in range(1, 7)]
    joint = 1 + int(np.argmax(ways))
    path, arm = log[f"qc{joint}"], log[f"q{joint}"]
    speed = np.gradient(path, log["t"])
    moving = np.abs(speed) > 0.5 * np.abs(speed).max()
    assert np.abs(speed).max() > 0.1
    lag = (path - arm)[moving] / speed[moving]
    assert 0 < np.median(lag) < 0.065  # [s] of the servos alone; twice that with it as a correction
    assert np.abs(log["i2"]).max() > 0.1


def test_settings_of_another_layout_are_refused(run_kr5, layout_file, tmp_path):
    for text, said in (
        ("format: kr5-rsi-settings/1\nmeanings: {Force: sensor_wrench}\n", "meanings.Force: the layout has no such"),
        ("format: kr5-rsi-settings/1\naxis: 3\n", "axis"),
    ):
        (tmp_path / "settings.yaml").write_text(text)
        done = run_kr5("rsi", "monitor", layout_file(free_port()), "--settings", "settings.yaml", "--for", 0.3)
        assert done.returncode == 2 and "settings.yaml" in done.stderr and said in done.stderr


def test_a_monitor_without_a_controller_says_who_knows_why(run_kr5, layout_file):
    done = run_kr5("rsi", "monitor", layout_file(free_port()), "--for", 0.3, "--listen", "127.0.0.1")
    assert done.returncode == 1 and "kr5 rsi doctor" in done.stderr


def test_what_was_observed_is_examined_in_python():
    layout = rsi.usual_layout("krc4")
    seen = rsi.LinkObservations(duration=5.0, port=layout.port)
    assert len(seen) == 0
    found = rsi.examine_link(seen, layout)
    assert str(found.verdict) == "faulty" and [str(f.kind) for f in found.findings] == ["no_telegrams"]
    with pytest.raises(kr5.InvalidArgument, match="^silence"):
        rsi.examine_link(seen, layout, rsi.DiagnosisOptions(silence=0.0))
