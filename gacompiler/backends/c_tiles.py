"""Between elements in C order and vectors that hold one component of a few neighbours, as C text.

A tile is a vector of components for each number of an element, of as many elements as one vector takes. Most vectors
are read in halves, the lower from the first half of the elements and the upper from as far on in the others: then both
halves need the same turn, which stays within halves, where processors turn fastest. Four neighbours in double precision
are a vector and are read as one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple


class _Turn(NamedTuple):
    """A vector of the named places of two others, counted one after the other."""

    name: str
    first: str
    second: str
    places: tuple[int, ...]


class _Tile(NamedTuple):
    """Vectors that are read from offsets, how they become columns, how columns become halves, and where those go."""

    reads: dict[str, str]
    to_columns: list[_Turn]
    to_elements: list[_Turn]
    halves: dict[str, int]


def tile_helpers(sizes: Sequence[int]) -> list[dict[str, object]]:
    """Functions that load and store a tile, for each size of element."""
    helpers: list[dict[str, object]] = []
    for size in sizes:
        doubles, floats = _tile_of_doubles(size), _tile_of_floats(size)
        load = {"doubles": _load_lines(size, doubles), "floats": _load_lines(size, floats)}
        store = {"doubles": _store_lines(size, doubles, 2), "floats": _store_lines(size, floats, 4)}
        helpers.append({"size": size, "load": load, "store": store})
    return helpers


def _load_lines(size: int, tile: _Tile) -> list[str]:
    """Every vector is read where it is first needed, so that few are held at a time."""
    if size == 1:
        return ["COLUMN(0) = WHOLE(0);"]
    lines, reads = [], dict(tile.reads)
    for turn in tile.to_columns:
        for name in (turn.first, turn.second):
            if name in reads:
                lines.append(f"const NAME(tile) {name} = {reads.pop(name)};")
        lines.append(_turn_line(turn))
    return lines


def _store_lines(size: int, tile: _Tile, half: int) -> list[str]:
    """Two halves that are neighbours in memory are written as one vector."""
    if size == 1:
        return ["WHOLE(0) = COLUMN(0);"]
    lines: list[str] = []
    turns = {turn.name: turn for turn in tile.to_elements}
    rest = sorted(tile.halves.items(), key=lambda item: item[1])
    while rest:
        name, offset = rest.pop(0)
        after = next((item for item in rest if item[1] == offset + half), None)
        lines += _turns_for(name, turns)
        if after:
            rest.remove(after)
            lines += [*_turns_for(after[0], turns), f"WRITE_BOTH({offset}, {size}, {name}, {after[0]});"]
        else:
            lines.append(f"WRITE({offset}, {size}, {name});")
    return lines


def _turns_for(name: str, turns: dict[str, _Turn]) -> list[str]:
    """The lines that a vector needs and that are not written yet: they are taken from `turns`."""
    if name not in turns:
        return []
    turn = turns.pop(name)
    return [*_turns_for(turn.first, turns), *_turns_for(turn.second, turns), _turn_line(turn)]


def _turn_line(turn: _Turn) -> str:
    target = turn.name if turn.name.startswith("COLUMN") else f"const NAME(tile) {turn.name}"
    return f"{target} = SHUFFLE({turn.first}, {turn.second}, {', '.join(map(str, turn.places))});"


def _column(k: int) -> str:
    return f"COLUMN({k})"


def _in_halves(name: str, two: Sequence[str], places: Sequence[int]) -> _Turn:
    """A turn of two vectors of which each half has the named places of their halves."""
    first, second = two
    half = len(places)
    lower = [place + half * (place >= half) for place in places]
    return _Turn(name, first, second, (*lower, *(place + half for place in lower)))


def _tile_of_doubles(size: int) -> _Tile:
    """Two elements are `size` halves: those that columns become."""
    reads, to_columns = _pairs_of_doubles(size) if size < 4 else _fours_of_doubles(size)
    to_elements = []
    for k in range(size):
        (element, component), (next_element, next_component) = divmod(2 * k, size), divmod(2 * k + 1, size)
        columns = _column(component), _column(next_component)
        to_elements.append(_in_halves(f"a{k}", columns, (element, 2 + next_element)))
    return _Tile(reads, to_columns, to_elements, {f"a{k}": 2 * k for k in range(size)})


def _fours_of_doubles(size: int) -> tuple[dict[str, str], list[_Turn]]:
    """Four numbers of four elements are turned at once; one or two that are left come from halves of the last two."""
    reads: dict[str, str] = {}
    turns: list[_Turn] = []
    for done in range(0, size, 4):
        left = min(4, size - done)
        if left < 3:
            rows = [f"a{done}", f"a{done + 1}"]
            reads |= {row: f"READ({k * size + size - 2}, {size})" for k, row in enumerate(rows)}
            turns += [_in_halves(_column(size - 2 + k), rows, (k, 2 + k)) for k in range(2 - left, 2)]
            continue
        first = min(done, size - 4)
        rows = [f"a{done + k}" for k in range(4)]
        reads |= {row: f"WHOLE({k * size + first})" for k, row in enumerate(rows)}
        for k in range(4):
            turns.append(_in_halves(f"b{done + k}", rows[k // 2 * 2 : k // 2 * 2 + 2], (k % 2, 2 + k % 2)))
        for k in range(4 - left, 4):
            ends = (2, 3, 6, 7) if k // 2 else (0, 1, 4, 5)
            turns.append(_Turn(_column(first + k), f"b{done + k % 2}", f"b{done + k % 2 + 2}", ends))
    return reads, turns


def _pairs_of_doubles(size: int) -> tuple[dict[str, str], list[_Turn]]:
    """Two elements are `size` halves; a component of both is in two of them, and a half has two components."""
    turns = []
    for k in range(size):
        (first, place), (second, other) = divmod(k, 2), divmod(size + k, 2)
        turns.append(_in_halves(_column(k), (f"a{first}", f"a{second}"), (place, 2 + other)))
    return {f"a{k}": f"READ({2 * k}, {size})" for k in range(size)}, turns


def _tile_of_floats(size: int) -> _Tile:
    """Four elements are `size` halves. Four numbers of each are turned at once, the last four before what is left."""
    reads: dict[str, int] = {}
    if size in _FEW_FLOATS:
        reads = {f"a{k}": 4 * k for k in range(size)}
        to_columns, to_elements = _FEW_FLOATS[size]
        return _Tile(_reads(reads, size), to_columns, to_elements, reads)
    to_columns, to_elements = [], []
    for done in range(0, size, 4):
        first = min(done, size - 4)
        rows = [f"a{done + k}" for k in range(4)]
        columns = [_column(first + k) for k in range(4)]
        reads |= {row: k * size + first for k, row in enumerate(rows)}
        to_columns += _four_by_four(f"b{done}_", rows, columns, done - first)
        to_elements += _four_by_four(f"b{done}_", columns, rows)
    return _Tile(_reads(reads, size), to_columns, to_elements, reads)


def _reads(offsets: Mapping[str, int], size: int) -> dict[str, str]:
    return {name: f"READ({offset}, {size})" for name, offset in offsets.items()}


def _four_by_four(between: str, rows: Sequence[str], columns: Sequence[str], first: int = 0) -> list[_Turn]:
    """From halves of four numbers their columns, but for those before the `first`."""
    lower = [_in_halves(f"{between}{k}", rows[2 * k : 2 * k + 2], (0, 4, 1, 5)) for k in range(2) if first < 2]
    upper = [_in_halves(f"{between}{k + 2}", rows[2 * k : 2 * k + 2], (2, 6, 3, 7)) for k in range(2)]
    ends = [
        _in_halves(column, (f"{between}{k // 2 * 2}", f"{between}{k // 2 * 2 + 1}"), places)
        for k, (column, places) in enumerate(zip(columns, ((0, 1, 4, 5), (2, 3, 6, 7)) * 2, strict=True))
    ]
    return [*lower, *upper, *ends[first:]]


_X, _Y, _Z = map(_column, range(3))
_FEW_FLOATS: dict[int, tuple[list[_Turn], list[_Turn]]] = {
    1: ([], []),
    2: (
        [_in_halves(_X, ("a0", "a1"), (0, 2, 4, 6)), _in_halves(_Y, ("a0", "a1"), (1, 3, 5, 7))],
        [_in_halves("a0", (_X, _Y), (0, 4, 1, 5)), _in_halves("a1", (_X, _Y), (2, 6, 3, 7))],
    ),
    3: (
        [
            _in_halves("b0", ("a1", "a2"), (2, 3, 5, 6)),
            _in_halves("b1", ("a0", "a1"), (1, 2, 4, 5)),
            _in_halves(_X, ("a0", "b0"), (0, 3, 4, 6)),
            _in_halves(_Y, ("b1", "b0"), (0, 2, 5, 7)),
            _in_halves(_Z, ("b1", "a2"), (1, 3, 4, 7)),
        ],
        [
            _in_halves("b0", (_X, _Y), (0, 2, 4, 6)),
            _in_halves("b1", (_Y, _Z), (1, 3, 5, 7)),
            _in_halves("b2", (_Z, _X), (0, 2, 5, 7)),
            _in_halves("a0", ("b0", "b2"), (0, 2, 4, 6)),
            _in_halves("a1", ("b1", "b0"), (0, 2, 5, 7)),
            _in_halves("a2", ("b2", "b1"), (1, 3, 5, 7)),
        ],
    ),
}
