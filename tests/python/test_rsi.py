"""kr5.rsi: layouts, files for controllers, the codec, the link and the side channel as Python sees them."""

import socket
import time

import kr5
import numpy as np
import pytest
from kr5 import rsi

from free_ports import free_port


def test_a_layout_goes_to_its_configuration_and_back():
    layout = rsi.usual_layout("krc2", space="cartesian")
    again = rsi.parse_layout(rsi.layout_xml(layout), "text")
    assert again.controller == rsi.Controller.Krc2
    assert [e.tag for e in again.receive] == ["RKorr.X", "RKorr.Y", "RKorr.Z", "RKorr.A", "RKorr.B", "RKorr.C", "DiO"]
    assert (again.receive[6].index, again.receive[6].hold, again.send[0].index) == (7, True, None)
    fields = rsi.telegram_fields(again.receive)
    assert (fields[3].element, fields[3].attribute, fields[3].component) == ("RKorr", "A", 3)
    assert str(fields[3].meaning) == "cartesian_correction"


def test_a_configuration_that_is_none_is_refused_with_its_line(tmp_path):
    with pytest.raises(kr5.IoError, match="text:1: .*no XML"):
        rsi.parse_layout("<ROOT", "text")
    with pytest.raises(kr5.IoError, match="nowhere.xml"):
        rsi.load_layout(str(tmp_path / "nowhere.xml"))


def test_files_for_a_controller():
    files = rsi.controller_files(rsi.usual_layout("iiqka"), rsi.ProgramOptions(name="cell_7", mode="relative"))
    assert [f.name for f in files.files] == ["cell_7.src", "cell_7_ethernet.xml", "cell_7.rsix"]
    assert "RSI_PROCESS_ON(#RELATIVE)" in files.files[0].text
    assert (files.unwired, files.unconfirmed) == ([], [])
    with pytest.raises(kr5.InvalidArgument, match="^cycle"):
        rsi.controller_files(rsi.usual_layout("krc2"), rsi.ProgramOptions(cycle=0.004))


def test_poses_of_kuka():
    T = rsi.from_kuka([100, 0, 0, 90, 0, 0])
    assert np.allclose(T[:3, 3], [0.1, 0, 0]) and np.allclose(T[:3, 0], [0, 1, 0])
    assert np.allclose(rsi.to_kuka(T), [100, 0, 0, 90, 0, 0])


def test_the_codec_reads_what_it_writes():
    codec = rsi.TelegramCodec(rsi.book_layout(), "computer")
    data = codec.encode({"RKorr.Z": -1.5, "EStr": "hello", "DiO": 125}, 4208163634)
    assert data.startswith(b'<Sen Type="ImFree"><EStr>hello</EStr><RKorr X="0.000000"')
    fault, values, ipoc = codec.decode(data)
    assert (fault, ipoc) == (rsi.TelegramFault.None_, "4208163634")
    assert (values["RKorr.Z"], values["EStr"], values["DiO"]) == (-1.5, "hello", 125)
    assert codec.decode(data[:50])[0] == rsi.TelegramFault.Truncated
    with pytest.raises(kr5.InvalidArgument, match="RKorr.Q"):
        codec.encode({"RKorr.Q": 1.0}, 1)
    with pytest.raises(kr5.InvalidArgument, match="finite"):
        codec.encode({"RKorr.X": float("nan")}, 1)


def test_a_link_answers_and_counts():
    layout = rsi.usual_layout("krc4")
    layout.port = free_port()
    controller = rsi.TelegramCodec(layout, "controller")
    options = rsi.LinkOptions(listen="127.0.0.1", real_time={"priority": 0, "lock_memory": False})
    link = rsi.Link(layout, options)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
        end.settimeout(5)
        for ipoc in range(1000, 1040, 4):
            end.sendto(controller.encode({"AIPos.A2": -90.0, "ASPos.A2": -90.0}, ipoc), ("127.0.0.1", link.port))
            fault, values, echoed = rsi.TelegramCodec(layout, "computer").decode(end.recv(4096))
            assert (str(fault), echoed, values["AKorr.A1"]) == ("none", str(ipoc), 0.0)
        end.sendto(b"hello", ("127.0.0.1", link.port))
        end.sendto(controller.encode({}, 1040), ("127.0.0.1", link.port))
        end.recv(4096)
    statistics = link.statistics()
    assert (statistics.telegrams.good, statistics.telegrams.foreign, statistics.sessions) == (11, 1, 1)
    assert statistics.to_dict()["state"] == "running"
    assert 0 < statistics.answer.p50 <= statistics.answer.max
    assert rsi.real_time_remedies(link.real_time) == []
    with pytest.raises(kr5.IoError, match=str(layout.port)):
        rsi.Link(layout, options)


def test_results_between_computers():
    port = rsi.SidePort(0, "127.0.0.1")
    sender = rsi.SideSender("127.0.0.1", port.port)
    assert port.latest("force") is None and port.age("force") is None
    assert sender.send(rsi.ForceResult(wrench=[0, 0, -10, 0, 0, 0]), rsi.side_now())
    for _ in range(500):
        if port.receive():
            break
        time.sleep(0.002)
    assert port.latest("force").force.wrench[2] == -10
    assert 0 <= port.age("force") < 10
    assert port.statistics.received == 1
