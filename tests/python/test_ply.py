"""PLY files in every form of the format give the vertices that were written; damaged ones say what is wrong."""

import random
import struct

import kr5
import numpy as np
import pytest

from kr5_tools.picking.clouds import read_cloud
from kr5_tools.picking.ply import read_vertices

POINTS = np.array([[0.125, -2.5, 3.0], [1e-3, 0.5, -0.75], [4.0, 5.0, 6.0], [-7.0, 8.5, 9.25]])
CODES = {"uchar": "B", "int": "i", "float": "f", "double": "d", "short": "h", "uint8": "B", "int32": "i"}
FORMATS = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
FACES = ("face", [("list uchar int", "vertex_indices")], [[[0, 1, 2]], [[3, 2, 1, 0]]])


def write(file, form, *elements, newline="\n"):
    """Elements are (name, [(type, name)...], rows); written value by value, which is not how they are read."""
    head = ["ply", f"format {form} 1.0", "comment by a test"]
    for name, properties, rows in elements:
        head += [f"element {name} {len(rows)}", *(f"property {kind} {what}" for kind, what in properties)]
    body = b""
    for _, properties, rows in elements:
        for row in rows:
            words = []
            for (kind, _), value in zip(properties, row, strict=True):
                kinds = kind.split()[1:] if kind.startswith("list") else [kind]
                values = [len(value), *value] if kind.startswith("list") else [value]
                codes = [kinds[0], *[kinds[-1]] * (len(values) - 1)]
                words += [(CODES[c], v) for c, v in zip(codes, values, strict=True)]
            if FORMATS[form] is None:
                body += (" ".join(str(value) for _, value in words) + newline).encode()
            else:
                body += b"".join(struct.pack(FORMATS[form] + code, value) for code, value in words)
    file.write_bytes(newline.join([*head, "end_header", ""]).encode() + body)
    return file


def vertices(kind="double", more=(), values=()):
    rows = [[*values, *point] for point in POINTS.tolist()]
    return ("vertex", [*more, *((kind, axis) for axis in "xyz")], rows)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("kind", ["float", "double"])
def test_plain_vertices(tmp_path, form, kind):
    found = read_vertices(write(tmp_path / "a.ply", form, vertices(kind)))
    exact = POINTS if kind == "double" or form == "ascii" else POINTS.astype(np.float32)
    assert found.dtype == float and np.array_equal(found, exact)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize(
    "elements",
    [
        (vertices(), FACES),
        (FACES, vertices()),
        (("scanner", [("short", "id"), ("uchar", "kind")], [[-5, 7]]), FACES, vertices()),
        (vertices(more=[("uint8", "red"), ("short", "ring")], values=[200, -3]), FACES),
        (vertices(more=[("list uint8 int32", "seen_by"), ("uchar", "red")], values=[[4, 5, 6], 9]),),
        (vertices(more=[("list uint8 double", "weights")], values=[[]]),),
    ],
)
def test_other_elements_and_properties_are_passed_over(tmp_path, form, elements):
    assert np.array_equal(read_vertices(write(tmp_path / "a.ply", form, *elements)), POINTS)


def test_axes_in_another_order_and_lines_that_end_as_in_windows(tmp_path):
    turned = ("vertex", [("double", "z"), ("double", "y"), ("double", "x")], POINTS[:, ::-1].tolist())
    for form in FORMATS:
        assert np.array_equal(read_vertices(write(tmp_path / "a.ply", form, turned, newline="\r\n")), POINTS)


@pytest.mark.parametrize("form", FORMATS)
def test_no_vertices_are_an_empty_cloud(tmp_path, form):
    empty = ("vertex", vertices()[1], [])
    assert read_vertices(write(tmp_path / "a.ply", form, empty, FACES)).shape == (0, 3)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("elements", [(vertices(),), (FACES, vertices(more=[("list uchar int", "k")], values=[[1]]))])
def test_a_file_cut_short_says_where_it_ends(tmp_path, form, elements):
    file = write(tmp_path / "a.ply", form, *elements)
    data = file.read_bytes()
    body = data.index(b"end_header") + 11
    for length in range(body, len(data) - 20):
        file.write_bytes(data[:length])
        with pytest.raises(
            kr5.Error, match=r"a\.ply: is damaged or no PLY file: .*(ends after|expected 4 numbers|column)"
        ):
            read_cloud(file)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("plain text\n", "the first line is not 'ply'"),
        ("ply\nelement vertex 1\nproperty float x\nend_header\n1\n", "no line 'format'"),
        ("ply\nformat ascii 2.0\n", "found 'format ascii 2.0' in the header"),
        ("ply\nformat ascii 1.0\nelement vertex -1\n", "found 'element vertex -1'"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty long x\n", "found the type 'long'"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty list float int x\n", "found 'property list float"),
        ("ply\nformat ascii 1.0\n", "found ''"),
        ("ply\nformat ascii 1.0\nelement face 0\nend_header\n", "has no element vertex"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nend_header\n1\n", "no property y; found x"),
        (
            "ply\nformat binary_little_endian 1.0\nelement vertex 999999999999999\n"
            + "".join(f"property double {axis}\n" for axis in "xyz")
            + "end_header\n",
            "ends after 0 of 999999999999999 rows of vertex",
        ),
    ],
)
def test_what_is_wrong_is_said(tmp_path, head, words):
    (tmp_path / "a.ply").write_text(head)
    with pytest.raises(kr5.Error) as caught:
        read_cloud(tmp_path / "a.ply")
    assert words in str(caught.value)


@pytest.mark.parametrize("form", FORMATS)
def test_mutations_are_read_or_refused(tmp_path, form):
    """No input makes the reader raise what no caller expects, nor read beyond the file."""
    draw = random.Random(4)
    file = write(tmp_path / "a.ply", form, FACES, vertices(more=[("list uchar int", "k")], values=[[1, 2]]))
    sound, refused = file.read_bytes(), 0
    for _ in range(400):
        data = bytearray(sound)
        for _ in range(draw.randint(1, 4)):
            data[draw.randrange(len(data))] = draw.choice([0, 255, 10, 32, 45, 48, 57, draw.randrange(256)])
        file.write_bytes(bytes(data[: draw.choice([len(data), draw.randrange(len(data))])]))
        try:
            assert read_cloud(file).points.shape[1] == 3
        except kr5.Error:
            refused += 1
    assert 100 < refused < 400
