"""`kr5 report` on every type of result, in a headless Chromium at desktop and phone width."""

import base64
import json
import os
import shutil
import socket
import struct
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

SAMPLES = sorted((Path(__file__).parent / "data").glob("*.json"))
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def kr5(*arguments, cwd):
    return subprocess.run([sys.executable, "-m", "kr5_tools", *map(str, arguments)], cwd=cwd, capture_output=True, text=True)


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """The page of every sample, by name."""
    folder = tmp_path_factory.mktemp("pages")
    for sample in SAMPLES:
        done = kr5("report", sample, "-o", f"{sample.stem}.html", "--png", f"{sample.stem}-png", cwd=folder)
        assert done.returncode == 0, done.stderr
    return folder


class Browser:
    """A headless Chromium, spoken to in its DevTools protocol over one WebSocket."""

    def __init__(self, folder):
        flags = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-component-update",
                 "--disable-background-networking", "--disable-sync", f"--user-data-dir={folder}", "--remote-debugging-port=0"]
        self.process = subprocess.Popen([CHROMIUM, *flags, "about:blank"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        port_file = Path(folder) / "DevToolsActivePort"
        deadline = time.monotonic() + 60
        while not port_file.is_file() or not port_file.read_text().strip():
            assert self.process.poll() is None and time.monotonic() < deadline, "Chromium does not start"
            time.sleep(0.1)
        port = int(port_file.read_text().split()[0])
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with opener.open(f"http://127.0.0.1:{port}/json/list") as answer:
            target = next(t for t in json.load(answer) if t["type"] == "page")
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60)
        path = target["webSocketDebuggerUrl"].split(str(port), 1)[1]
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        self.stream = self.socket.makefile("rb")
        while self.stream.readline().strip():
            pass
        self.number, self.events = 0, []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def _receive(self):
        text = b""
        while True:
            first, second = self.stream.read(2)
            length = second & 127
            if length > 125:
                length = struct.unpack("!H" if length == 126 else "!Q", self.stream.read(2 if length == 126 else 8))[0]
            text += self.stream.read(length)
            if first & 128:
                return json.loads(text)

    def call(self, method, **params):
        self.number += 1
        text = json.dumps({"id": self.number, "method": method, "params": params}).encode()
        length = bytes([254]) + struct.pack("!H", len(text)) if len(text) > 125 else bytes([128 | len(text)])
        mask = os.urandom(4)
        self.socket.sendall(b"\x81" + length + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(text)))
        while (message := self._receive()).get("id") != self.number:
            self.events.append(message)
        assert "error" not in message, message
        return message["result"]

    def open(self, page, width):
        self.events.clear()
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 500)
        self.call("Page.navigate", url=page.as_uri())
        while not any(e.get("method") == "Page.loadEventFired" for e in self.events):
            self.events.append(self._receive())
        self.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def evaluate(self, script):
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def complaints(self):
        bad = []
        for event in self.events:
            params = event.get("params", {})
            if event.get("method") == "Runtime.exceptionThrown" or (
                    event.get("method") == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert")):
                bad.append(params)
            if event.get("method") == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
                bad.append(params["entry"])
        return bad

    def requests(self):
        return [e["params"]["request"]["url"] for e in self.events if e.get("method") == "Network.requestWillBeSent"]

    def close(self):
        self.socket.close()
        self.process.terminate()
        self.process.wait(30)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if CHROMIUM is None:
        if os.environ.get("CI"):
            pytest.fail("Chromium is not installed; the pages cannot be looked at")
        pytest.skip("Chromium is not installed, so the pages are not looked at")
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("sample", SAMPLES, ids=lambda s: s.stem)
def test_a_page_opens_without_complaint_and_fits_the_width(pages, browser, sample, width):
    page = pages / f"{sample.stem}.html"
    browser.open(page, width)
    assert browser.complaints() == []
    assert browser.evaluate("document.documentElement.scrollWidth") <= width
    assert browser.evaluate("[...document.images].filter(i => !i.complete || i.naturalWidth === 0).length") == 0
    assert [url for url in browser.requests() if not url.startswith(("data:", page.as_uri()))] == []


def test_the_frames_are_drawn_and_turn_with_the_mouse(pages, browser):
    browser.open(pages / "hand_eye.html", 1280)
    picture = "document.getElementById('scene').toDataURL()"
    before = browser.evaluate(picture)
    browser.evaluate("document.getElementById('scene').scrollIntoView({block: 'center'})")
    x, y = browser.evaluate("(b => [b.x + b.width / 2, b.y + b.height / 2])(document.getElementById('scene').getBoundingClientRect())")
    for kind, dx in (("mousePressed", 0), ("mouseMoved", 90), ("mouseReleased", 90)):
        browser.call("Input.dispatchMouseEvent", type=kind, x=x + dx, y=y, button="left", buttons=1, clickCount=1)
    turned = browser.evaluate(picture)
    assert len(before) > 5000 and turned != before
    browser.evaluate("document.getElementById('scene').dispatchEvent(new MouseEvent('dblclick'))")
    assert browser.evaluate(picture) == before
    assert browser.complaints() == []


def test_a_page_says_what_the_file_says(pages):
    page = (pages / "hand_eye.html").read_text()
    for text in ("Doubtful.", "view_07.png", "98 % sure", "± 0.061", "30.021", "outlier", "kr5 calibrate hand-eye cell", "with kr5 0.1.0"):
        assert text in page
    assert len(page) < 3_000_000
    assert "http://" not in page.replace("http://www.w3.org", "") and "https://" not in page


@pytest.mark.parametrize("name,plots", [
    ("hand_eye", {"views", "robot_position", "robot_rotation", "residual_field", "residual_cloud", "correlation", "frames"}),
    ("camera", {"views", "residual_field", "residual_cloud", "coverage", "correlation", "models"}),
    ("tool", {"touches", "correlation", "frames"}), ("timed", {"alignment", "correlation", "frames"}),
    ("marker_map", {"views", "residual_field", "residual_cloud", "frames"}), ("detection", {"views"}),
])
def test_every_plot_is_written_as_png(pages, name, plots):
    files = {f.stem: f for f in (pages / f"{name}-png").glob("*.png")}
    assert set(files) == plots
    assert all(f.read_bytes().startswith(b"\x89PNG") for f in files.values())


def test_thumbnails_are_shown_when_the_images_are_there(tmp_path):
    from PIL import Image

    data = json.loads((Path(__file__).parent / "data" / "hand_eye.json").read_text())
    Image.new("L", (1280, 960), 128).save(tmp_path / "a.png")
    data["views"][0]["image"] = "a.png"
    data["views"][1]["image"] = "gone.png"
    (tmp_path / "r.json").write_text(json.dumps(data))
    assert kr5("report", "r.json", cwd=tmp_path).returncode == 0
    assert (tmp_path / "report.html").read_text().count("data:image/jpeg") == 1


def test_text_from_the_file_cannot_become_markup(tmp_path):
    data = {"format": "kr5-detection/1", "verdict": {"word": "good", "text": "<script>alert(1)</script>"},
            "frames": [{"name": "</script><b>", "parent": None, "T": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}]}
    (tmp_path / "r.json").write_text(json.dumps(data))
    assert kr5("report", "r.json", cwd=tmp_path).returncode == 0
    page = (tmp_path / "report.html").read_text()
    assert "<script>alert" not in page and "</script><b>" not in page


@pytest.mark.parametrize("content,complaint", [
    ("not json", "is no JSON"), ('{"format": "kr5-other/1"}', "kr5-other/1"), ("[1, 2]", "format"),
    ('{"format": "kr5-camera/1", "views": 3}', "views: found 3, expected a list"),
    ('{"format": "kr5-camera/1", "views": [{"name": "a", "rms_px": "bad"}]}', "views[0].rms_px"),
    ('{"format": "kr5-camera/1", "figures": [{"name": "fx"}]}', "figures[0].unit"),
    ('{"format": "kr5-camera/1", "residuals": [{"u": [1], "v": [1, 2], "du": [0], "dv": [0]}]}', "residuals[0]"),
    ('{"format": "kr5-camera/1", "residuals": [{"u": ["x"], "v": [1], "du": [0], "dv": [0]}]}', "r.json"),
    ('{"format": "kr5-camera/1", "frames": [{"name": "a", "T": [[1]]}]}', "frames[0].T"),
    ('{"format": "kr5-camera/1", "verdict": {"word": "fine", "text": ""}}', "verdict.word"),
])
def test_a_bad_result_file_is_refused_and_the_old_page_kept(tmp_path, content, complaint):
    (tmp_path / "r.json").write_text(content)
    (tmp_path / "report.html").write_text("old")
    done = kr5("report", "r.json", cwd=tmp_path)
    assert done.returncode == 2
    assert complaint in done.stderr and "r.json" in done.stderr and "Traceback" not in done.stderr
    assert (tmp_path / "report.html").read_text() == "old"


def test_a_missing_file_or_folder_is_named(tmp_path):
    done = kr5("report", "none.json", cwd=tmp_path)
    assert done.returncode == 2 and "none.json" in done.stderr
    sample = Path(__file__).parent / "data" / "tool.json"
    done = kr5("report", sample, "-o", "no/such/folder.html", cwd=tmp_path)
    assert done.returncode == 2 and "folder" in done.stderr
