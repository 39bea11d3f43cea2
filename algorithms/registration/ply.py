"""Reading of PLY files: text and both binary forms."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True, eq=False)
class Ply:
    """The vertices and faces of a PLY file.

    Attributes
    ----------
    points : array, (n, 3)
    normals : array, (n, 3), or None
    faces : tuple of int arrays
        The rows of the corners of each face.
    properties : dict of str to array
        All other numbers of vertices, such as colours, by name.
    """

    points: Reals
    normals: Reals | None
    faces: tuple[NDArray[np.int64], ...]
    properties: dict[str, NDArray[Any]]


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    line: int
    names: list[str]
    types: list[tuple[str, str]]
    """Types of the count, empty for a number, and of the numbers."""


def read_ply(path: str | Path) -> Ply:
    """Read points, normals and faces from a PLY file.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Ply

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is not a valid PLY file. The message states the line of the header or of the text, or the byte.
    """
    data = Path(path).read_bytes()
    order, elements, start, line = _header(data, str(path))
    if order:
        tables = _binary(data, start, order, elements, str(path))
    else:
        tables = _text(data[start:], line, elements, str(path))
    vertices = tables.get("vertex")
    if vertices is None or any(name not in vertices for name in "xyz"):
        raise ValueError(f"{path}: no element vertex with properties x, y, z; found {sorted(tables)}")
    columns = {name: np.asarray(column) for name, column in vertices.items() if not isinstance(column, list)}
    points = np.column_stack([columns.pop(name).astype(float) for name in "xyz"])
    normals = None
    if all(name in columns for name in ("nx", "ny", "nz")):
        normals = np.column_stack([columns.pop(name).astype(float) for name in ("nx", "ny", "nz")])
    lists = tables.get("face", {})
    corners = lists.get("vertex_indices", lists.get("vertex_index", []))
    faces = tuple(np.asarray(face, np.int64) for face in corners)
    for number, face in enumerate(faces):
        if len(face) and (face.min() < 0 or face.max() >= len(points)):
            raise ValueError(f"{path}: face {number} has corner {face.max()}; expected rows of {len(points)} vertices")
    return Ply(points, normals, faces, columns)


def _header(data: bytes, path: str) -> tuple[str, list[_Element], int, int]:
    """Return the byte order, the elements, the byte after the header, and the number of its lines."""
    order: str | None = None
    elements: list[_Element] = []
    start = line = 0
    while True:
        end = data.find(b"\n", start)
        if end < 0:
            raise ValueError(f"{path}, line {line + 1}: the file ends in the header; expected end_header")
        words = data[start:end].decode("ascii", "replace").split()
        start, line = end + 1, line + 1
        where = f"{path}, line {line}: {' '.join(words)[:60]!r}"
        if line == 1 and words != ["ply"]:
            raise ValueError(f"{where}; expected 'ply'")
        if not words or words[0] in ("ply", "comment", "obj_info"):
            continue
        if words[0] == "end_header":
            break
        if words[0] == "format" and len(words) == 3 and words[1] in _ORDERS:
            order = _ORDERS[words[1]]
        elif words[0] == "element" and len(words) == 3 and words[2].isdigit():
            elements.append(_Element(words[1], int(words[2]), line, [], []))
        elif words[0] == "property" and elements and _is_property(words):
            elements[-1].names.append(words[-1])
            elements[-1].types.append((_TYPES[words[2]] if len(words) == 5 else "", _TYPES[words[-2]]))
        else:
            raise ValueError(f"{where}; expected a format, an element with a count, a property of it, or a comment")
    if order is None:
        raise ValueError(f"{path}: no format in the header; expected one of {', '.join(_ORDERS)}")
    return order, elements, start, line


def _is_property(words: list[str]) -> bool:
    if len(words) == 3:
        return words[1] in _TYPES
    return len(words) == 5 and words[1] == "list" and words[2] in _TYPES and words[3] in _TYPES


def _binary(data: bytes, start: int, order: str, elements: list[_Element], path: str) -> dict[str, dict[str, Any]]:
    tables: dict[str, dict[str, Any]] = {}
    for element in elements:
        if any(count for count, _ in element.types):
            tables[element.name], start = _lists(data, start, order, element, path)
            continue
        kind = np.dtype([(f"p{k}", order + of) for k, (_, of) in enumerate(element.types)])
        need = element.count * kind.itemsize
        if len(data) - start < need:
            raise ValueError(
                f"{path}, byte {start}: {len(data) - start} bytes left; expected {need} for {element.count} rows "
                f"of {element.name}"
            )
        rows: NDArray[Any] = (
            np.frombuffer(data, kind, element.count, start) if kind.itemsize else np.zeros(element.count)
        )
        tables[element.name] = {name: rows[f"p{k}"] for k, name in enumerate(element.names)}
        start += need
    return tables


def _lists(data: bytes, start: int, order: str, element: _Element, path: str) -> tuple[dict[str, Any], int]:
    columns: list[list[Any]] = [[] for _ in element.names]

    def numbers(kind: str, count: int, row: int) -> NDArray[Any]:
        nonlocal start
        dtype = np.dtype(order + kind)
        if count < 0 or len(data) - start < count * dtype.itemsize:
            raise ValueError(
                f"{path}, byte {start}: {len(data) - start} bytes left; expected {count} numbers of {dtype.itemsize} "
                f"bytes in row {row} of {element.name}"
            )
        found = np.frombuffer(data, dtype, count, start)
        start += count * dtype.itemsize
        return found

    for row in range(element.count):
        for column, (counted, kind) in zip(columns, element.types, strict=True):
            found = numbers(kind, int(numbers(counted, 1, row)[0]) if counted else 1, row)
            column.append(found if counted else found[0])
    return dict(zip(element.names, columns, strict=True)), start


def _text(data: bytes, line: int, elements: list[_Element], path: str) -> dict[str, dict[str, Any]]:
    lines = [(line + k + 1, text.split()) for k, text in enumerate(data.split(b"\n")) if text.strip()]
    tables: dict[str, dict[str, Any]] = {}
    at = 0
    for element in elements:
        rows = lines[at : at + element.count]
        at += element.count
        if len(rows) < element.count:
            raise ValueError(f"{path}: {len(rows)} rows of {element.name}; expected {element.count}")
        columns: list[list[Any]] = [[] for _ in element.names]
        for number, words in rows:
            _row(words, element, columns, f"{path}, line {number}")
        tables[element.name] = {
            name: column if counted else np.array(column, kind)
            for name, column, (counted, kind) in zip(element.names, columns, element.types, strict=True)
        }
    return tables


def _row(words: list[bytes], element: _Element, columns: list[list[Any]], where: str) -> None:
    place = 0
    for column, (counted, kind) in zip(columns, element.types, strict=True):
        try:
            count = int(words[place]) if counted else 1
            place += bool(counted)
            found = [float(word) if kind[0] == "f" else int(word) for word in words[place : place + count]]
        except (ValueError, IndexError):
            raise ValueError(
                f"{where}: {b' '.join(words)[:60].decode('ascii', 'replace')!r}; expected numbers for "
                f"{', '.join(element.names)}"
            ) from None
        if len(found) != count or count < 0:
            raise ValueError(f"{where}: {len(words)} numbers; expected more for {', '.join(element.names)}")
        place += count
        column.append(found if counted else found[0])
    if place != len(words):
        raise ValueError(f"{where}: {len(words)} numbers; expected {place} for {', '.join(element.names)}")
