"""Reading of PLY files: text and both binary forms."""

from __future__ import annotations

import re
from collections.abc import Sequence
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
        As they are in the file, so that NaN is possible.
    normals : array, (n, 3), or None
        None if the vertices do not have all of nx, ny and nz.
    faces : tuple of int arrays
        The rows of the corners of each face.
    properties : dict of str to array, (n,)
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
    names: list[str]
    types: list[tuple[str, str]]
    """Types of the count, empty for a number, and of the numbers."""

    @property
    def has_lists(self) -> bool:
        return any(count for count, _ in self.types)


def read_ply(path: str | Path) -> Ply:
    """Read points, normals and faces from a PLY file.

    Other elements, and lists of vertices, are checked and left out.

    Parameters
    ----------
    path : str or Path
        A text or binary file, not compressed. Lines may end in a line feed, a carriage return or both.

    Returns
    -------
    Ply

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is not a valid PLY file, or its rows do not agree with the counts of the header. The message states the
        line of the header or of the text, or the byte.
    """
    data = Path(path).read_bytes()
    order, elements, start, line = _header(data, str(path))
    if order:
        tables = _binary(data, start, order, elements, str(path))
    else:
        tables = _text(data[start:], line, elements, str(path))
    vertices = tables.get("vertex", {})
    columns = {name: column for name, column in vertices.items() if isinstance(column, np.ndarray)}
    if not all(name in columns for name in "xyz"):
        names = ", ".join(vertices) or "nothing"
        raise ValueError(f"{path}: no element vertex with numbers x, y, z; found {names}")
    points = np.column_stack([columns.pop(name).astype(float) for name in "xyz"])
    normals = None
    if all(name in columns for name in ("nx", "ny", "nz")):
        normals = np.column_stack([columns.pop(name).astype(float) for name in ("nx", "ny", "nz")])
    lists = tables.get("face", {})
    corners = lists.get("vertex_indices", lists.get("vertex_index", []))
    return Ply(points, normals, _faces(corners, len(points), str(path)), columns)


def _faces(corners: Sequence[Any] | NDArray[Any], count: int, path: str) -> tuple[NDArray[np.int64], ...]:
    """Return faces, whose corners are rows of `count` vertices."""
    if isinstance(corners, np.ndarray):
        raise ValueError(f"{path}: one corner for each face; expected a list of them")
    lengths = np.array([len(face) for face in corners], np.int64)
    flat = np.concatenate([np.zeros(0, np.int64), *corners])
    wrong = np.flatnonzero(~((flat >= 0) & (flat < count) & (flat == np.floor(flat))))
    if len(wrong):
        face = int(np.searchsorted(np.cumsum(lengths), wrong[0], side="right"))
        raise ValueError(f"{path}: face {face} has corner {flat[wrong[0]]}; expected rows of {count} vertices")
    return tuple(np.split(flat.astype(np.int64), np.cumsum(lengths)[:-1])) if len(lengths) else ()


def _header(data: bytes, path: str) -> tuple[str, list[_Element], int, int]:
    """Return the byte order, the elements, the byte after the header, and the number of its lines."""
    order: str | None = None
    elements: list[_Element] = []
    start = line = 0
    first = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data)
    if first is None:
        text = data[:60].split(b"\n")[0].decode("ascii", "replace")
        found = "a compressed file" if data.startswith(b"\x1f\x8b") else repr(text)
        raise ValueError(f"{path}, line 1: {found}; expected 'ply'")
    # In files whose lines end in a carriage return alone, a line feed may be the first byte of the numbers.
    ending = b"\r" if first[1] == b"\r" else b"\n"
    while True:
        end = data.find(ending, start)
        if end < 0:
            raise ValueError(f"{path}, line {line + 1}: the file ends in the header; expected end_header")
        words = data[start:end].decode("ascii", "replace").split()
        start, line = end + 1, line + 1
        where = f"{path}, line {line}: {' '.join(words)[:60]!r}"
        if not words or words[0] in ("comment", "obj_info") or line == 1:
            continue
        if words[0] == "end_header":
            break
        if words[0] == "format" and len(words) == 3 and words[1] in _ORDERS and order is None:
            order = _ORDERS[words[1]]
        elif words[0] == "element" and len(words) == 3 and re.fullmatch(r"[0-9]{1,18}", words[2]):
            if words[1] in (one.name for one in elements):
                raise ValueError(f"{where}; expected an element that the header does not have yet")
            elements.append(_Element(words[1], int(words[2]), [], []))
        elif words[0] == "property" and elements and _is_property(words):
            if words[-1] in elements[-1].names:
                raise ValueError(f"{where}; expected a property that the element does not have yet")
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
    counts = len(words) == 5 and words[1] == "list" and words[2] in _TYPES and words[3] in _TYPES
    return counts and _TYPES[words[2]][0] != "f"


def _binary(data: bytes, start: int, order: str, elements: list[_Element], path: str) -> dict[str, dict[str, Any]]:
    tables: dict[str, dict[str, Any]] = {}
    for element in elements:
        # A list has at least its count.
        kind = np.dtype([(f"p{k}", order + (count or of)) for k, (count, of) in enumerate(element.types)])
        need = element.count * kind.itemsize
        if len(data) - start < need:
            raise ValueError(
                f"{path}, byte {start}: {len(data) - start} bytes left; expected {need} for {element.count} rows "
                f"of {element.name}{', and its lists' if element.has_lists else ''}"
            )
        if not element.names:
            tables[element.name] = {}
        elif element.has_lists:
            tables[element.name], start = _lists(data, start, order, element, path)
        else:
            rows: NDArray[Any] = np.frombuffer(data, kind, element.count, start)
            tables[element.name] = {name: rows[f"p{k}"] for k, name in enumerate(element.names)}
            start += need
    if data[start:].strip():
        raise ValueError(f"{path}, byte {start}: {len(data) - start} bytes left; expected the end of the file")
    return tables


def _lists(data: bytes, start: int, order: str, element: _Element, path: str) -> tuple[dict[str, Any], int]:
    """Read the rows of an element with lists; the columns of its lists are lists of arrays."""
    columns: list[list[Any]] = [[] for _ in element.names]
    row, window = 0, 1024
    while row < element.count:
        # Rows with the same counts as the next one are read at once.
        counts = _counts(data, start, order, element, row, path)
        fields: list[Any] = []
        for k, ((counted, kind), count) in enumerate(zip(element.types, counts, strict=True)):
            fields += [(f"n{k}", order + counted)] if counted else []
            fields.append((f"p{k}", order + kind, (count,)) if counted else (f"p{k}", order + kind))
        layout = np.dtype(fields)
        size = min(element.count - row, (len(data) - start) // layout.itemsize, window)
        rows = np.frombuffer(data, layout, size, start)
        same = np.ones(size, bool)
        for k, ((counted, _), count) in enumerate(zip(element.types, counts, strict=True)):
            if counted:
                same &= rows[f"n{k}"] == count
        size = size if same.all() else int(np.argmin(same))
        # If counts often change, few rows are compared in vain.
        window = max(2 * size, 16)
        for k, column in enumerate(columns):
            column.extend(rows[f"p{k}"][:size])
        row, start = row + size, start + size * layout.itemsize
    found = {
        name: column if counted else np.array(column, kind)
        for name, column, (counted, kind) in zip(element.names, columns, element.types, strict=True)
    }
    return found, start


def _counts(data: bytes, start: int, order: str, element: _Element, row: int, path: str) -> list[int]:
    """Return how many numbers each property of a row has."""
    counts = []
    for counted, kind in element.types:
        count = 1
        if counted:
            own = np.dtype(order + counted)
            _require(data, start, 1, own.itemsize, f"row {row} of {element.name}", path)
            count, start = int(np.frombuffer(data, own, 1, start)[0]), start + own.itemsize
            if count < 0:
                raise ValueError(f"{path}, byte {start}: a list of {count} numbers in row {row} of {element.name}")
        size = np.dtype(kind).itemsize
        _require(data, start, count, size, f"row {row} of {element.name}", path)
        start += count * size
        counts.append(count)
    return counts


def _require(data: bytes, start: int, count: int, size: int, where: str, path: str) -> None:
    if len(data) - start < count * size:
        raise ValueError(
            f"{path}, byte {start}: {len(data) - start} bytes left; expected {count} numbers of {size} bytes in {where}"
        )


def _text(data: bytes, line: int, elements: list[_Element], path: str) -> dict[str, dict[str, Any]]:
    lines = [(line + k + 1, text.split()) for k, text in enumerate(data.splitlines()) if text.strip()]
    tables: dict[str, dict[str, Any]] = {}
    at = 0
    for element in elements:
        count = element.count if element.names else 0
        rows = lines[at : at + count]
        at += count
        if len(rows) < count:
            raise ValueError(f"{path}: {len(rows)} rows of {element.name}; expected {count}")
        columns: list[list[Any]] = [[] for _ in element.names]
        for number, words in rows:
            _row(words, element, columns, f"{path}, line {number}")
        tables[element.name] = {
            name: [np.array(found, kind) for found in column] if counted else np.array(column, kind)
            for name, column, (counted, kind) in zip(element.names, columns, element.types, strict=True)
        }
    if at < len(lines):
        raise ValueError(f"{path}, line {lines[at][0]}: more rows than the header has; expected the end of the file")
    return tables


def _row(words: list[bytes], element: _Element, columns: list[list[Any]], where: str) -> None:
    place = 0
    for column, (counted, kind) in zip(columns, element.types, strict=True):
        try:
            count = int(words[place]) if counted else 1
            place += bool(counted)
            found = [float(word) if kind[0] == "f" else _integer(word, kind) for word in words[place : place + count]]
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


def _integer(word: bytes, kind: str) -> int:
    """Return an integer that a type can represent."""
    number = int(word)
    bits = 8 * int(kind[1]) - (kind[0] == "i")
    if not (-(1 << bits) if kind[0] == "i" else 0) <= number < 1 << bits:
        raise ValueError(number)
    return number
