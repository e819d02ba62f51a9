"""A job as it runs, in a browser: a page of a server on this computer, which is told state and reading."""

import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import kr5
import numpy as np
from kr5.files import writing

from kr5_tools.cli.numbers import format_count
from kr5_tools.pages.rendering import render_page, script_json
from kr5_tools.replay.page import cell_scene, drawn_solid
from kr5_tools.work.remedies import words
from kr5_tools.work.run_page import plates_of

if TYPE_CHECKING:
    import kr5.job
    import kr5.robot
    import kr5.sim

PERIOD = 0.1  # [s] between two messages to a page
LAST_WORD = 0.3  # [s] at most until the pages have heard how the job ended
CUT_SHORT = "The program has ended before the job."


class LiveView:
    """Serves the page until the end of a `with` block, to programs on this computer alone."""

    def __init__(self, page: str) -> None:
        self._page = page.encode()
        self._latest: dict[str, Any] | None = None
        self._begun: float | None = None
        self._ending: dict[str, str] | None = None
        self._streams = 0
        self._changed = threading.Condition()
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)

    @property
    def address(self) -> str:
        """Of the page."""
        return f"http://127.0.0.1:{self._server.server_port}/"

    def show(self, state: "kr5.job.JobState", reading: "kr5.robot.RobotReading") -> None:
        """What the pages are told next."""
        self._begun = reading.time if self._begun is None else self._begun
        self._latest = snapshot(state, reading, self._begun)

    def end(self, look: str, text: str) -> None:
        """How the job ended, in words; `look`: good or unusable. Later endings change nothing."""
        with self._changed:
            self._ending = self._ending or {"look": look, "text": text}
            self._changed.notify_all()
            self._changed.wait_for(lambda: not self._streams, LAST_WORD)

    def __enter__(self) -> "LiveView":
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.end("unusable", CUT_SHORT)
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def send_page(self, to: BaseHTTPRequestHandler) -> None:
        to.send_response(200)
        to.send_header("Content-Type", "text/html; charset=utf-8")
        to.send_header("Content-Length", str(len(self._page)))
        to.end_headers()
        to.wfile.write(self._page)

    def send_stream(self, to: BaseHTTPRequestHandler) -> None:
        """Server-sent events: what there is, ten times a second, and as the last one, `end`."""
        to.send_response(200)
        to.send_header("Content-Type", "text/event-stream")
        to.send_header("Cache-Control", "no-store")
        to.end_headers()
        with self._changed:
            self._streams += 1
        try:
            ended = False
            while not ended:
                with self._changed:
                    ended = self._changed.wait_for(lambda: self._ending is not None, PERIOD)
                if self._latest is not None:
                    to.wfile.write(_message(self._latest))
            to.wfile.write(b"event: end\n" + _message(self._ending))
        finally:
            with self._changed:
                self._streams -= 1
                self._changed.notify_all()


def snapshot(state: "kr5.job.JobState", reading: "kr5.robot.RobotReading", begun: float) -> dict[str, Any]:
    """What a page is told of one cycle; the time since `begun` [s]."""
    return {
        "time": round(reading.time - begun, 3),
        "q": np.round(reading.joints, 5).tolist(),
        "force": round(float(np.linalg.norm(reading.wrench[:3])), 2),
        "gripped": reading.status.gripped,
        "phase": words(state.phase),
        "pellet": state.pellet,
        "inserted": state.inserted,
    }


def live_page(cell: "kr5.sim.WorkCell", pellets: int, source: Path) -> str:
    """The HTML: arm, bin, stand and tube, of which the arm moves as the stream tells."""
    scene = cell_scene(cell.believed, np.asarray(cell.truth().T_base_tubes[0]))
    return render_page(
        "live.html",
        brand="kr5 run",
        title=f"Job of {format_count(pellets, 'pellet')}, live",
        data=script_json({**scene, "solids": [drawn_solid(plate) for plate in plates_of(cell)], "pellets": pellets}),
        version=kr5.__version__,
        source=source.name,
    )


def _message(value: object) -> bytes:
    return f"data: {json.dumps(writing.to_plain(value), allow_nan=False)}\n\n".encode()


def _handler(view: LiveView) -> type[BaseHTTPRequestHandler]:
    """What answers one request."""
    answers = {"/": view.send_page, "/stream": view.send_stream}

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            try:
                if answer := answers.get(self.path):
                    answer(self)
                else:
                    self.send_error(404)
            except ConnectionError:  # the browser has gone
                self.close_connection = True

        def log_message(self, *_: object) -> None:
            """The terminal is for the job."""

    return Handler
