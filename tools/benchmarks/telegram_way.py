"""The network between a controller and a computer, over loopback: what is on its way may be changed, led elsewhere or
kept back, and others may join in.

The controller sends to the address of this computer that the way has, and the way on to that where the link listens;
answers go back to where the controller sent from."""

import contextlib
import os
import select
import socket
import threading
import time
from collections.abc import Callable, Iterable

from kr5 import rsi

HERE, THERE, ELSEWHERE = "127.0.0.1", "127.0.0.2", "127.0.0.3"  # of the link, the way, and strangers
LONGEST = 4096  # bytes of a datagram
LOOK = 0.05  # [s] after which it looks whether it is over
WAYS = ("telegrams", "answers")
PRIORITY = 50  # where it is permitted, as of a network that nothing delays

Change = Callable[[bytes], Iterable[bytes]]


def unchanged(data: bytes) -> Iterable[bytes]:
    return [data]


def nothing(data: bytes) -> Iterable[bytes]:
    return []


class TelegramWay(threading.Thread):
    """Passes datagrams on until it is closed. `telegrams` and `answers` say what becomes of each, and then those of
    `faults` happen to it; all of them, and `port`, may be replaced at any time."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.telegrams: Change = unchanged
        self.answers: Change = unchanged
        self.faults = {way: rsi.FaultyWay(rsi.LinkFaults()) for way in WAYS}
        self._controller_side = _udp_socket(THERE)
        self.controller_port: int = self._controller_side.getsockname()[1]
        self.port = self.controller_port  # of the link
        self._controller: tuple[str, int] | None = None
        self._ends: dict[tuple[str, int], socket.socket] = {}  # by where the controller sends from
        self._stranger = _udp_socket(ELSEWHERE)
        self._over = threading.Event()

    def __enter__(self) -> "TelegramWay":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self.join()
        for end in (self._controller_side, self._stranger, *self._ends.values()):
            end.close()

    def run(self) -> None:
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(threading.get_native_id(), os.SCHED_FIFO, os.sched_param(PRIORITY))
        while not self._over.is_set():
            due = min(way.next_time for way in self.faults.values()) - time.monotonic()
            ready, _, _ = select.select([self._controller_side, *self._ends.values()], [], [], min(max(due, 0), LOOK))
            for end in ready:
                self._take_telegram() if end is self._controller_side else self._take_answer(end)
            self._send_due()

    def to_link(self, data: bytes) -> None:
        """A datagram of somebody else to the link."""
        self._stranger.sendto(data, (HERE, self.port))

    def to_controller(self, data: bytes) -> None:
        """A datagram of somebody else to the controller."""
        if self._controller is not None:
            self._stranger.sendto(data, self._controller)

    def _take_telegram(self) -> None:
        data, self._controller = self._controller_side.recvfrom(LONGEST)
        if self._controller not in self._ends:
            self._ends[self._controller] = _udp_socket(THERE)
        for part in self.telegrams(data):
            self.faults["telegrams"].put(part, time.monotonic())

    def _take_answer(self, end: socket.socket) -> None:
        with contextlib.suppress(ConnectionError):  # nobody listened where a telegram went
            for part in self.answers(end.recv(LONGEST)):
                self.faults["answers"].put(part, time.monotonic())

    def _send_due(self) -> None:
        while self._controller and (data := self.faults["telegrams"].take(time.monotonic())):
            with contextlib.suppress(ConnectionError):
                self._ends[self._controller].sendto(data, (HERE, self.port))
        while self._controller and (data := self.faults["answers"].take(time.monotonic())):
            self._controller_side.sendto(data, self._controller)


def _udp_socket(address: str) -> socket.socket:
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.bind((address, 0))
    return out
