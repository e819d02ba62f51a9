"""Ports for the two ends of a link, which stay free until one of them listens, however long a busy computer takes to
start it: a port of the kernel's own choice may be given to any other socket as soon as it is closed."""

import random
import socket
from pathlib import Path

FIRST = 20_000
RANGE = Path("/proc/sys/net/ipv4/ip_local_port_range")  # of the ports that the kernel chooses
TRIALS = 1000
_held: list[socket.socket] = []  # sockets of TCP, by which other tests see that a port of UDP is taken
_random = random.Random()


def free_port() -> int:
    """A port of UDP that no other test is given while this process runs."""
    end = int(RANGE.read_text().split()[0]) if RANGE.exists() else 32_768
    for _ in range(TRIALS):
        port = _random.randrange(FIRST, end)
        mark = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            mark.bind(("127.0.0.1", port))
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                probe.bind(("0.0.0.0", port))
        except OSError:
            mark.close()
        else:
            _held.append(mark)
            return port
    raise RuntimeError(f"no free port between {FIRST} and {end}")
