"""LLVM code that transposes elements in C order into rows in registers, and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .llvm import ll, number

TILE = 32
"""Bytes of a vector. The number of elements of a tile is the number of lanes of a vector."""


class Tile:
    """Code that loads and stores a tile of elements."""

    def __init__(self, builder: Any, real: Any, width: int) -> None:
        self._builder, self._real, self._width = builder, real, width
        self.lanes = TILE // width
        self.half = self.lanes // 2
        """Number of components that are transposed together."""

    def load(self, start: Any, rows: Sequence[Any]) -> None:
        """Load the rows of the elements that begin at `start`."""
        size = len(rows)
        if size == 1 or size < self.half:
            found = [self._vector(self.after(start, number(k * self.lanes))) for k in range(size)]
            for k, row in enumerate(rows):
                self._put(self._picked(found, [i * size + k for i in range(self.lanes)]), row)
            return
        for k in self._blocks(size):
            self.load_block([self.after(start, number(i * size + k)) for i in range(self.lanes)], rows[k:])

    def store(self, rows: Sequence[Any], start: Any) -> None:
        """Store rows to the elements that begin at `start`."""
        size = len(rows)
        if size == 1 or size < self.half:
            found = [self._vector(row) for row in rows]
            for k in range(size):
                places = [n % size * self.lanes + n // size for n in range(k * self.lanes, (k + 1) * self.lanes)]
                self._put(self._picked(found, places), self.after(start, number(k * self.lanes)))
            return
        for k in self._blocks(size):
            self.store_block(rows[k:], [self.after(start, number(i * size + k)) for i in range(self.lanes)])

    def copy(self, rows: Sequence[Any], places: Sequence[Any]) -> None:
        """Store rows to the addresses of components whose elements have unit stride."""
        for row, place in zip(rows, places, strict=True):
            self._put(self._vector(row), place)

    def load_block(self, elements: Sequence[Any], rows: Sequence[Any]) -> None:
        """Load the first `half` rows from `half` consecutive numbers of each element."""
        halves = [self._vector(element, self.half) for element in elements]
        pairs = zip(halves[: self.half], halves[self.half :], strict=True)
        joined = [self._shuffle(*pair, *range(self.lanes)) for pair in pairs]
        for value, row in zip(self._turned(joined), rows, strict=False):
            self._put(value, row)

    def store_block(self, rows: Sequence[Any], elements: Sequence[Any]) -> None:
        """Store the first `half` rows to `half` consecutive numbers of each element."""
        turned = self._turned([self._vector(row) for row in rows[: self.half]])
        for n, element in enumerate(elements):
            value, first = turned[n % self.half], n // self.half * self.half
            self._put(self._shuffle(value, value, *range(first, first + self.half)), element)

    def after(self, start: Any, count: Any) -> Any:
        """Return the address `count` numbers after `start`."""
        return self._builder.gep(start, [count], source_etype=self._real)

    def _blocks(self, size: int) -> list[int]:
        """Return the starts of blocks; the last block may overlap with the one before."""
        return [min(k, size - self.half) for k in range(0, size, self.half)]

    def _vector(self, place: Any, count: int = 0) -> Any:
        kind = ll.VectorType(self._real, count or self.lanes)
        return self._builder.load(self._builder.bitcast(place, kind.as_pointer()), typ=kind, align=self._width)

    def _put(self, value: Any, place: Any) -> None:
        self._builder.store(value, self._builder.bitcast(place, value.type.as_pointer()), self._width)

    def _shuffle(self, a: Any, b: Any, *places: int) -> Any:
        mask = ll.Constant(ll.VectorType(ll.IntType(32), len(places)), list(places))
        return self._builder.shuffle_vector(a, b, mask)

    def _picked(self, vectors: Sequence[Any], places: Sequence[int]) -> Any:
        """Return a vector of the numbers at these indices in the concatenation of up to three vectors."""
        two = 2 * self.lanes
        found = self._shuffle(vectors[0], vectors[min(1, len(vectors) - 1)], *[n if n < two else 0 for n in places])
        if len(vectors) < 3:
            return found
        return self._shuffle(found, vectors[2], *[i if n < two else n - self.lanes for i, n in enumerate(places)])

    def _turned(self, v: Sequence[Any]) -> list[Any]:
        """Transpose vectors within each half: number k of vector i becomes number i of vector k."""
        if len(v) == 2:
            return [self._shuffle(*v, 0, 4, 2, 6), self._shuffle(*v, 1, 5, 3, 7)]
        low = [self._shuffle(*v[n : n + 2], 0, 8, 1, 9, 4, 12, 5, 13) for n in (0, 2)]
        high = [self._shuffle(*v[n : n + 2], 2, 10, 3, 11, 6, 14, 7, 15) for n in (0, 2)]
        ends = (0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)
        return [self._shuffle(*pair, *end) for pair in (low, high) for end in ends]
