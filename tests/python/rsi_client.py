"""A client of KUKA's sensor interface, written from its description with regular expressions and str.format: none of
the code of kr5."""

import re
import socket

ANSWER = '<Sen Type="ImFree"><{element} {values} /><DiO>1</DiO><IPOC>{ipoc}</IPOC></Sen>'


def value(telegram: str, element: str, attribute: str) -> float:
    """A number of a telegram."""
    found = re.search(rf'<{element}\s[^>]*\b{attribute}="([^"]*)"', telegram)
    assert found, f"no {element} {attribute} in {telegram}"
    return float(found[1])


def ipoc_of(telegram: str) -> str:
    found = re.search(r"<IPOC>([0-9]+)</IPOC>", telegram)
    assert found, telegram
    return found[1]


def answer_to(telegram: str, values: tuple[float, ...] = (0.0,) * 6, element: str = "AKorr") -> str:
    names = "XYZABC" if element == "RKorr" else ["A1", "A2", "A3", "A4", "A5", "A6"]
    given = " ".join(f'{name}="{v:.6f}"' for name, v in zip(names, values))
    return ANSWER.format(element=element, values=given, ipoc=ipoc_of(telegram))


class UdpClient:
    """Listens on a free port, and answers where a telegram came from."""

    transport = "udp"

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(20)
        self.port = self.socket.getsockname()[1]
        self.peer: tuple[str, int] = ("", 0)

    def receive(self) -> str:
        data, self.peer = self.socket.recvfrom(8192)
        return data.decode()

    def send(self, answer: str) -> None:
        self.socket.sendto(answer.encode(), self.peer)

    def close(self) -> None:
        self.socket.close()


class TcpClient:
    """Takes the connection of a controller on a free port."""

    transport = "tcp"

    def __init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.listener.settimeout(20)
        self.port = self.listener.getsockname()[1]
        self.connection: socket.socket | None = None
        self.rest = ""

    def receive(self) -> str:
        if self.connection is None:
            self.connection, _ = self.listener.accept()
            self.connection.settimeout(20)
            self.rest = ""
        while "</Rob>" not in self.rest:
            data = self.connection.recv(8192)
            if not data:
                raise ConnectionResetError
            self.rest += data.decode()
        telegram, _, self.rest = self.rest.partition("</Rob>")
        return telegram + "</Rob>"

    def send(self, answer: str) -> None:
        assert self.connection
        self.connection.sendall(answer.encode())

    def close(self) -> None:
        if self.connection:
            self.connection.close()
        self.listener.close()
