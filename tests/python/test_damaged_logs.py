"""Logs that are damaged or lie about their size: refused in one line, within memory."""

import io
import json
import zipfile

import kr5
import numpy as np
import pytest
import typer
from kr5.files.camera import load_camera
from kr5.logs import log_file

from kr5_tools.calibrate import timed


def refusal(call):
    with pytest.raises(kr5.IoError) as end:
        call()
    return str(end.value)


def write_npz(file, members, method=zipfile.ZIP_STORED):
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return file


def npy(values, header=None):
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.asarray(values), allow_pickle=True)
    data = stream.getvalue()
    if header is None:
        return data
    text = header.ljust(117).encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + data[128:]


def test_arrays_of_numbers_are_read_and_others_left_out(tmp_path):
    file = tmp_path / "log.npz"
    np.savez(
        file,
        t=np.arange(4.0),
        q=np.ones((4, 2)),
        flag=np.array([True] * 4),
        word="text",
        one=3.0,
        none=np.zeros((0, 2)),
    )
    log = log_file.read_log(file)
    assert list(log.columns) == ["t", "q[0]", "q[1]", "flag"] and log.streams["q[1]"] == "4 rows"


HUGE = "{'descr': '<f8', 'fortran_order': False, 'shape': (1152921504606846976,), }"
NPZ = {
    "no zip": b"PK\x03\x04 and then nothing",
    "empty": b"",
    "an array alone": npy([1.0]),
    "believed shape": {"q.npy": npy([1.0, 2.0], HUGE)},
    "believed columns": {
        "q.npy": npy([1.0, 2.0], HUGE.replace("(1152921504606846976,)", "(2, 0, 1152921504606846976)"))
    },
    "negative shape": {"q.npy": npy([1.0], "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }")},
    "no shape": {"q.npy": npy([1.0], "{'descr': '<f8', 'fortran_order': False, 'shape': None, }")},
    "nested header": {"q.npy": npy([1.0], "[" * 110)},
    "objects": {"q.npy": npy(np.array([1, None], dtype=object))},
    "texts": {"q.npy": npy(np.array(["a", "b"]))},
    "no numpy": {"q.npy": b"text"},
    "other version": {"q.npy": b"\x93NUMPY\x09\x00" + bytes(200)},
    "many columns": {"q.npy": npy(np.zeros((100, 30_000), np.int8))},
}


@pytest.mark.parametrize("case", NPZ)
def test_a_bad_npz_is_refused(tmp_path, case):
    file = tmp_path / "log.npz"
    if isinstance(NPZ[case], bytes):
        file.write_bytes(NPZ[case])
    else:
        write_npz(file, NPZ[case])
    assert "log.npz" in refusal(lambda: log_file.read_log(file))


@pytest.mark.parametrize(
    "what, offset, value",
    [
        ("method", 10, b"\x63\x00"),
        ("flags", 8, b"\x01\x00"),
        ("checksum", 16, b"\x00\x01\x02\x03"),
        ("data", -80, b"\xff" * 20),
    ],
)
def test_a_damaged_npz_is_refused(tmp_path, what, offset, value):
    file = write_npz(tmp_path / "log.npz", {"q.npy": npy(np.arange(50.0))}, zipfile.ZIP_DEFLATED)
    data = bytearray(file.read_bytes())
    at = data.index(b"PK\x01\x02") + offset  # of the directory; before it are the data
    data[at : at + len(value)] = value
    file.write_bytes(data)
    assert "cannot be read as NPZ" in refusal(lambda: log_file.read_log(file))


@pytest.fixture
def mcap_log(tmp_path):
    pytest.importorskip("mcap", reason="pip install 'kr5[mcap]'")
    from mcap.writer import CompressionType, Writer

    file = tmp_path / "log.mcap"
    with file.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        writer.start()
        schema = writer.register_schema(name="any", encoding="jsonschema", data=b"{}")
        channel = writer.register_channel(schema_id=schema, topic="/j", message_encoding="json")
        for k in range(20):
            writer.add_message(channel, log_time=k, publish_time=k, data=json.dumps({"q": [k, 2.0 * k]}).encode())
        writer.finish()
    assert list(log_file.read_log(file).columns) == ["/j:log_time", "/j:q[0]", "/j:q[1]"]
    return file


def test_every_byte_of_an_mcap_may_be_wrong(mcap_log):
    """Lengths of 2^56 and more among them: read or refused, but not believed."""
    whole = mcap_log.read_bytes()
    for at in range(8, len(whole), 3):
        for value in (0xFF, 0x00):
            data = bytearray(whole)
            data[at] = value
            mcap_log.write_bytes(data)
            try:
                log_file.read_log(mcap_log)
            except kr5.FileError as error:
                assert "log.mcap" in str(error)


def write_message(mcap_log, message):
    from mcap.writer import Writer

    with mcap_log.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema(name="any", encoding="jsonschema", data=b"{}")
        channel = writer.register_channel(schema_id=schema, topic="/j", message_encoding="json")
        writer.add_message(channel, log_time=1, publish_time=1, data=message)
        writer.finish()


@pytest.mark.parametrize("message", [b"[" * 100_000, b'{"q": ' + b"9" * 400 + b"}", b"\xff", b""])
def test_a_message_that_is_none_is_refused(mcap_log, message):
    write_message(mcap_log, message)
    assert "cannot be read as MCAP" in refusal(lambda: log_file.read_log(mcap_log))


def test_names_that_are_no_texts_name_nothing(mcap_log):
    write_message(mcap_log, b'{"name": [[1]], "q": [2]}')
    assert list(log_file.read_log(mcap_log).columns) == ["/j:log_time", "/j:name[0][0]", "/j:q[0]"]


@pytest.mark.parametrize(
    "text", [b"t,q\n1,\x00\n", b't,q\n1,"' + b"x" * 200_000 + b'"\n', b"\xff\xfet,q", b"t,q\n1\n", b"", b"\n\n"]
)
def test_a_bad_csv_is_refused(tmp_path, text):
    (tmp_path / "log.csv").write_bytes(text)

    def read():
        log_file.read_log(tmp_path / "log.csv").column("q", "map")

    assert "log.csv" in refusal(read)


# Stamps of two streams that belong together

T = np.arange(0.0, 10.0, 0.05)


@pytest.mark.parametrize("t", [T, T + 1.7e9, np.append(T, T[-1] + 60)])
def test_seconds_are_taken(tmp_path, t):
    timed.check_stamps(tmp_path / "hand.csv", t)


@pytest.mark.parametrize(
    "t, words",
    [
        (1e6 * T, "are these milliseconds"),
        (1e9 * T, "are these milliseconds"),
        (np.append(0.0, 1.7e9 + T), "row 2"),
        (np.append(T, 1e8), "row 201"),
        (np.where(T[7] == T, np.nan, T), "row 8"),
        (np.append(1.7e9 + T, 0.0), "row 201"),
    ],
)
def test_stamps_that_are_no_seconds_of_one_recording_are_refused(tmp_path, capsys, t, words):
    with pytest.raises(typer.Exit):
        timed.check_stamps(tmp_path / "hand.csv", np.asarray(t))
    said = " ".join(capsys.readouterr().err.split())
    assert "hand.csv" in said and words in said


@pytest.mark.parametrize("width", ["9223372036854775808", "1.0e+300", "0", "-640", ".nan", "[640]", "null"])
def test_a_camera_of_no_size_is_refused(tmp_path, width):
    file = tmp_path / "camera.yaml"
    file.write_text(f"width: {width}\nheight: 480\nfx: 500\nfy: 500\ncx: 320\ncy: 240\n")
    assert "camera.yaml: width" in refusal(lambda: load_camera(file))
