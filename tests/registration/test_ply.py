"""PLY files of other programs, with unusual headers and lists, and files that are damaged."""

from __future__ import annotations

import gzip
import io
from pathlib import Path

import numpy as np
import pytest

from algorithms.registration import Ply, read_ply
from tests.support.all_cases import all_cases

FORMS = ["ascii", "binary_little_endian", "binary_big_endian"]
HEADER = """ply
format {} 1.0
comment one: element vertex 7
obj_info by hand
element marker 0
property float size
element vertex 5
property uchar grey
property list uchar float weights
property double x
property double y
property double z
property short label
element face 6
property list ushort int vertex_indices
property float quality
element edge 2
property int first
property int second
end_header
"""
VERTEX = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
POINTS = np.array([[0, 0, 1e-9], [1.5, -2, 3], [1e6, 0, 0.25], [-1, 4, 5], [2, 2, 2]])
WEIGHTS = [[], [0.5], [1, 2, 3], [0.25], []]
FACES = [[0, 1, 2], [0, 1, 2, 3], [], [4, 3, 2, 1, 0], [1, 2, 3], [2, 3, 4]]


def body(form: str) -> bytes:
    """The rows of all elements."""
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    out = io.BytesIO()

    def put(*numbers: tuple[str, float]) -> None:
        if order:
            out.write(b"".join(np.array(number, order + kind).tobytes() for kind, number in numbers))
        else:
            out.write(" ".join(repr(float(x)) if kind[0] == "f" else str(x) for kind, x in numbers).encode() + b"\n")

    for k, (point, weights) in enumerate(zip(POINTS.tolist(), WEIGHTS, strict=True)):
        listed = [("u1", len(weights)), *(("f4", x) for x in weights)]
        put(("u1", 250 + k), *listed, *(("f8", x) for x in point), ("i2", -300 * k))
    for k, face in enumerate(FACES):
        put(("u2", len(face)), *(("i4", corner) for corner in face), ("f4", k / 4))
    put(("i4", 0), ("i4", 1))
    put(("i4", 1), ("i4", 2))
    return out.getvalue()


def read(tmp_path: Path, data: bytes) -> Ply:
    path = tmp_path / "a.ply"
    path.write_bytes(data)
    return read_ply(path)


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("form", FORMS)
def test_lists_and_other_elements(form: str, ending: str, tmp_path: Path) -> None:
    rows = body(form)
    rows = rows.replace(b"\n", ending.encode()) if form == "ascii" else rows
    found = read(tmp_path, HEADER.format(form).replace("\n", ending).encode() + rows)
    assert np.array_equal(found.points, POINTS) and found.normals is None
    assert [face.tolist() for face in found.faces] == FACES
    assert {name: column.tolist() for name, column in found.properties.items()} == {
        "grey": [250, 251, 252, 253, 254], "label": [0, -300, -600, -900, -1200],
    }  # fmt: skip


def test_a_binary_file_may_begin_with_a_line_feed(tmp_path: Path) -> None:
    header = VERTEX.format("binary_little_endian", 1).replace("float", "uchar") + "end_header\n"
    for ending in ("\n", "\r\n", "\r"):
        assert read(tmp_path, header.replace("\n", ending).encode() + b"\n\r\n").points.tolist() == [[10, 13, 10]]


@pytest.mark.parametrize("form", FORMS)
def test_many_faces_of_changing_lengths(form: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    lengths = np.concatenate([np.full(800, 3), rng.integers(3, 6, 800), np.full(800, 4)])
    faces = [rng.integers(0, 100, length) for length in lengths]
    header = f"ply\nformat {form} 1.0\nelement vertex 100\nproperty float x\nproperty float y\nproperty float z\n"
    header += f"element face {len(faces)}\nproperty list uchar uint vertex_index\nend_header\n"
    points = rng.normal(size=(100, 3)).astype(np.float32)
    if form == "ascii":
        rows = "\n".join(" ".join(map(repr, row)) for row in points.astype(float).tolist())
        rows += "\n" + "\n".join(f"{len(face)} {' '.join(map(str, face))}" for face in faces)
        data = rows.encode()
    else:
        order = "<" if "little" in form else ">"
        data = points.astype(order + "f4").tobytes()
        data += b"".join(bytes([len(face)]) + face.astype(order + "u4").tobytes() for face in faces)
    found = read(tmp_path, header.encode() + data)
    assert np.array_equal(found.points, points)
    assert all(np.array_equal(one, other) for one, other in zip(found.faces, faces, strict=True))


@pytest.mark.parametrize("form", FORMS)
def test_every_truncated_file_is_refused(form: str, tmp_path: Path) -> None:
    data = HEADER.format(form).encode() + body(form)
    path = tmp_path / "short.ply"
    # In text, a number that loses its last digits is another number.
    ends = range(0, len(data) - 1, 5) if form != "ascii" else [k for k, byte in enumerate(data[:-1]) if byte in b" \n"]
    for end in ends:
        path.write_bytes(data[:end])
        with pytest.raises(ValueError, match=r"short\.ply"):
            read_ply(path)


@all_cases(
    "text, message",
    [
        ("", "line 1: ''; expected 'ply'"),
        ("OFF\n", "line 1: 'OFF'; expected 'ply'"),
        (VERTEX.format("ascii", 2) + "end_header\n1 2 3\n", "1 rows of vertex; expected 2"),
        (VERTEX.format("ascii", 1) + "end_header\n1 2 3\n\n4 5 6\n", "line 10: more rows than the header has"),
        (VERTEX.format("ascii", 1) + "end_header\n1 2\n", "line 8: '1 2'; expected numbers for x, y, z|2 numbers"),
        (VERTEX.format("ascii", 1) + "end_header\n1 2 3 4\n", "line 8: 4 numbers; expected 3 for x, y, z"),
        (VERTEX.format("ascii", 10**17) + "end_header\n1 2 3\n", "1 rows of vertex; expected 1000000000"),
        (VERTEX.format("binary_little_endian", 10**17) + "end_header\n", "byte .*: 0 bytes left; expected 12000000"),
        (VERTEX.format("ascii", "1" * 5000) + "end_header\n", "line 3: 'element vertex 111.*; expected a format, an"),
        (VERTEX.format("ascii", -1) + "end_header\n", "line 3: 'element vertex -1'; expected a format"),
        (
            VERTEX.format("ascii", 1) + "property float x\nend_header\n",
            "line 7: 'property float x'; expected a property",
        ),
        (
            VERTEX.format("ascii", 1) + "element vertex 1\nend_header\n",
            "line 7: 'element vertex 1'; expected an element",
        ),
        (VERTEX.format("ascii", 1) + "property list float int v\nend_header\n", "line 7: 'property list float int v'"),
        (VERTEX.format("ascii", 1) + "format ascii 1.0\nend_header\n", "line 7: 'format ascii 1.0'"),
        (
            VERTEX.format("ascii", 1) + "property uchar c\nend_header\n1 2 3 256\n",
            "line 9: '1 2 3 256'; expected numbers",
        ),
        (VERTEX.format("ascii", 1) + "property char c\nend_header\n1 2 3 -129\n", "line 9: '1 2 3 -129'; expected"),
        (
            VERTEX.format("ascii", 1).replace("float x", "list uchar float x") + "end_header\n1 1 2 3\n",
            "with numbers x",
        ),
        (
            VERTEX.format("ascii", 1) + "element face 1\nproperty list int int vertex_index\nend_header\n1 2 3\n-1\n",
            "line 11: 1 numbers; expected more for vertex_index",
        ),
        (
            VERTEX.format("ascii", 1)
            + "element face 2\nproperty list int int vertex_index\nend_header\n1 2 3\n1 0\n1 -1\n",
            r"face 1 has corner -1; expected rows of 1 vertices",
        ),
        (
            VERTEX.format("ascii", 1)
            + "element face 1\nproperty list int float vertex_index\nend_header\n1 2 3\n1 0.5\n",
            r"face 0 has corner 0\.5; expected rows of 1 vertices",
        ),
        (
            VERTEX.format("ascii", 1) + "element face 1\nproperty int vertex_index\nend_header\n1 2 3\n0\n",
            "one corner for each face; expected a list",
        ),
        (
            VERTEX.format("binary_big_endian", 0)
            + "element face 1\nproperty list int int vertex_index\nend_header\n\x7f\x7f\x7f\x7f",
            "0 bytes left; expected 2139062143 numbers of 4 bytes in row 0 of face",
        ),
        (VERTEX.format("binary_big_endian", 0) + "end_header\nabc", "3 bytes left; expected the end of the file"),
    ],
)
def test_wrong_files_are_refused(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=message):
        read(tmp_path, text.encode("ascii"))


def test_negative_lengths_of_binary_lists_are_refused(tmp_path: Path) -> None:
    header = (
        VERTEX.format("binary_little_endian", 0) + "element face 1\nproperty list char int vertex_index\nend_header\n"
    )
    with pytest.raises(ValueError, match="a list of -1 numbers in row 0 of face"):
        read(tmp_path, header.encode() + b"\xff" + bytes(8))


def test_compressed_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="line 1: a compressed file; expected 'ply'"):
        read(tmp_path, gzip.compress(HEADER.encode()))
    with pytest.raises(FileNotFoundError):
        read_ply(tmp_path / "missing.ply")


def test_files_without_rows(tmp_path: Path) -> None:
    for form in FORMS:
        header = (
            VERTEX.format(form, 0)
            + "element face 0\nproperty list uchar int vertex_index\nelement nothing 99999999999\n"
        )
        found = read(tmp_path, (header + "end_header\n").encode())
        assert found.points.shape == (0, 3) and found.faces == () and found.properties == {}
    text = VERTEX.format("ascii", 2) + "end_header\nnan 1 2\n-inf 1e3 +2\n"
    assert np.array_equal(read(tmp_path, text.encode()).points, [[np.nan, 1, 2], [-np.inf, 1000, 2]], equal_nan=True)
