"""The page of a job as it runs: what it draws and tells, and how it ends."""

import json
import time
import urllib.error
import urllib.request
from types import SimpleNamespace

import numpy as np
import pytest
from kr5 import job, robot
from kr5.cell import load_cell

pytest.importorskip("kr5.work", reason="this kr5 was built without DART, ViSP, PCL or SQLite")

from kr5_tools.work import job_cell, live_view

POSTURE = np.array([-0.5, -1.2, 1.1, 0.1, 1.2, 0.3])
CONNECT = urllib.request.build_opener(urllib.request.ProxyHandler({}))


@pytest.fixture(scope="module")
def page(share):
    cell = job_cell.make_cell(load_cell(share / "cells/kr5_arc.yaml"), job_cell.JobSetup(2, 5, "nominal"))
    return live_view.live_page(cell, 2, share / "cells/kr5_arc.yaml")


def told(phase="pick", seconds=0.0, gripped=True):
    """State and reading of a made-up cycle, of a robot whose clock began long ago."""
    state = job.JobState(phase=phase, pellet=2, inserted=1)
    wrench = [3.0, 0, 4.0, 9, 9, 9]
    reading = robot.RobotReading(time=1000 + seconds, joints=POSTURE, wrench=wrench, status={"gripped": gripped})
    return state, reading


def messages(stream):
    """Name and value of each server-sent event, until the stream ends."""
    name = "message"
    for line in stream:
        word, _, rest = line.decode().strip().partition(": ")
        if word == "event":
            name = rest
        elif word == "data":
            yield name, json.loads(rest)
            name = "message"


def test_a_stream_tells_the_latest_cycle_ten_times_a_second_and_the_end(page):
    with live_view.LiveView(page) as live, CONNECT.open(f"{live.address}stream") as stream:
        live.show(*told("check_cell"))
        live.show(*told("pick", 2.5))
        coming = messages(stream)
        begun = time.monotonic()
        heard = [next(coming) for _ in range(4)]
        assert time.monotonic() - begun >= 2.5 * live_view.PERIOD
        assert heard[0] == (
            "message",
            {
                "time": 2.5,
                "q": POSTURE.tolist(),
                "force": 5.0,
                "gripped": True,
                "phase": "pick",
                "pellet": 2,
                "inserted": 1,
            },
        )
        live.end("good", "It is done.")
        live.end("unusable", "Too late.")
        assert list(coming)[-1] == ("end", {"look": "good", "text": "It is done."})


def test_a_server_is_gone_with_its_program_which_says_so(page):
    with live_view.LiveView(page) as live:
        assert live.address.startswith("http://127.0.0.1:")
        with CONNECT.open(live.address) as answer:
            assert answer.read().decode() == page
        with pytest.raises(urllib.error.HTTPError, match="404"):
            CONNECT.open(f"{live.address}etc/passwd")
        stream = CONNECT.open(f"{live.address}stream")
    with stream:
        assert list(messages(stream)) == [("end", {"look": "unusable", "text": live_view.CUT_SHORT})]
    with pytest.raises(urllib.error.URLError):
        CONNECT.open(live.address)


def test_a_browser_that_has_gone_does_no_harm(page, capfd):
    with live_view.LiveView(page) as live:
        live.show(*told())
        with CONNECT.open(f"{live.address}stream") as stream:
            next(messages(stream))
        time.sleep(3 * live_view.PERIOD)
        begun = time.monotonic()
        live.end("good", "It is done.")
        assert time.monotonic() - begun < live_view.LAST_WORD  # nobody is waited for
    assert capfd.readouterr().err == ""


def wait_for(browser, script):
    end = time.monotonic() + 20
    while not browser.evaluate(script):
        assert time.monotonic() < end, script
        time.sleep(0.05)


@pytest.mark.parametrize("width, theme", [(390, "dark"), (1400, "light")])
def test_the_page_draws_the_arm_as_it_moves_and_says_how_the_job_ended(page, browser, width, theme):
    picture = "document.getElementById('scene').toDataURL()"
    with live_view.LiveView(page) as live:
        browser.open(SimpleNamespace(as_uri=lambda: live.address), width, theme)
        empty = browser.evaluate(picture)
        live.show(*told(seconds=0, gripped=False))
        wait_for(browser, "kr5Live.posture()")
        assert browser.evaluate("document.getElementById('phase').textContent") == "Pellet 2: pick."
        assert browser.evaluate("document.getElementById('ending').checkVisibility()") is False
        drawn = browser.evaluate(picture)
        live.show(*told("approach", 12.3))
        wait_for(browser, "document.getElementById('time').textContent === '12.3 s'")
        assert len({empty, drawn, browser.evaluate(picture)}) == 3  # the pellet in the grip is drawn
        assert browser.evaluate("[...document.querySelectorAll('dd')].map((e) => e.textContent)") == [
            "1 of 2",
            "12.3 s",
            "5.0 N",
        ]
        live.end("unusable", "Stopped by force.")
        wait_for(browser, "document.getElementById('ending').checkVisibility()")
        assert browser.evaluate("document.querySelector('#ending strong').textContent") == "Stopped by force."
        assert browser.illegible() == [] and browser.complaints() == []
        assert browser.evaluate("document.documentElement.scrollWidth") <= width


def test_a_page_whose_stream_breaks_says_so(page, browser):
    live = live_view.LiveView(page)
    with live:
        browser.open(SimpleNamespace(as_uri=lambda: live.address), 1400)
        browser.evaluate("window.stop()")  # the last word does not come
    wait_for(browser, "document.getElementById('ending').checkVisibility()")
    assert browser.evaluate("document.querySelector('#ending strong').textContent") == "The program has ended."
