"""Orthogonal frames of vectors with the squares 1 and -1, with rational coordinates in the basis of an algebra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache, reduce
from itertools import chain, combinations
from operator import xor
from typing import Any, NamedTuple

from ..algebra.algebra import Algebra
from ..algebra.coefficients import EXACT
from ..algebra.multivector import Multivector
from ..errors import InexactError

LEAST, MOST = 6, 8
"""Numbers of basis vectors; algebras of fewer have closed forms."""


class Signature(NamedTuple):
    """An algebra with an orthogonal basis of vectors with the squares 1 and -1."""

    algebra: Algebra
    squares: tuple[int, ...]

    @property
    def n(self) -> int:
        """The number of vectors."""
        return len(self.squares)

    @property
    def blades(self) -> tuple[int, ...]:
        """The even blades, by the number that remains without the last vector, which the parity determines."""
        last = 1 << (self.n - 1)
        return tuple(k if k.bit_count() % 2 == 0 else k | last for k in range(last))


def signature_of(algebra: Algebra) -> Signature | None:
    """Return the signature of an algebra for which this file has functions, or None."""
    n, gram = algebra.dimension, algebra.gram
    orthogonal = all(gram[i][j] == 0 for i in range(n) for j in range(i))
    squares = [gram[i][i] for i in range(n)]
    if not LEAST <= n <= MOST or not orthogonal or any(abs(each) != 1 for each in squares):
        return None
    return Signature(algebra, tuple(int(each) for each in squares))


class Frame(NamedTuple):
    """Orthogonal vectors with the squares 1 and -1 of an algebra whose own basis is oblique or null.

    Attributes
    ----------
    space : Signature
    to_frame, from_frame : mapping of int to multivector
        The images of even blades under the change of basis and back, in rational numbers.
    """

    space: Signature
    to_frame: Mapping[int, Multivector]
    from_frame: Mapping[int, Multivector]


@cache
def frame_of(algebra: Algebra) -> Frame | None:
    """Return a frame with rational coordinates, or None if there is none or the basis itself is one."""
    n = algebra.dimension
    if not LEAST <= n <= MOST or signature_of(algebra) is not None:
        return None
    vectors = _orthonormal(algebra.gram)
    if vectors is None:
        return None
    squares = [int(_inner(algebra.gram, v, v)) for v in vectors]
    space = Signature(Algebra(f"{algebra.name}_frame", algebra.vectors, squares), tuple(squares))
    # The coordinates of an old vector are its inner products with those of the frame.
    units = [[Fraction(i == j) for j in range(n)] for i in range(n)]
    coordinates = [
        [square * _inner(algebra.gram, v, x) for v, square in zip(vectors, squares, strict=True)] for x in units
    ]
    even = [b for b in algebra.blades() if b.bit_count() % 2 == 0]
    to_frame = _images(space.algebra, coordinates, even)
    return Frame(space, to_frame, _images(algebra, vectors, even))


def _inner(gram: Sequence[Sequence[Any]], x: Sequence[Fraction], y: Sequence[Fraction]) -> Fraction:
    n = len(gram)
    return sum((x[i] * gram[i][j] * y[j] for i in range(n) for j in range(n) if x[i] and y[j]), Fraction(0))


def _orthonormal(gram: Sequence[Sequence[Any]]) -> list[list[Fraction]] | None:
    """Orthogonalise the basis by symmetric elimination (LDL^T); a null pair `a`, `b` gives ``a + b / (2 a.b)``."""
    n = len(gram)
    rest, found = [[Fraction(i == j) for j in range(n)] for i in range(n)], list[list[Fraction]]()
    while rest:
        # Each candidate is given with the vector that it replaces.
        sums = (
            ([x + y / (2 * _inner(gram, a, b)) for x, y in zip(a, b, strict=True)], b)
            for a, b in combinations(rest, 2)
            if _inner(gram, a, b)
        )
        sizes = ((v, old, _inner(gram, v, v)) for v, old in chain(((v, v) for v in rest), sums))
        roots = ((v, old, size) for v, old, square in sizes if (size := _root(abs(square))))
        unit, replaced = next((([x / size for x in v], old) for v, old, size in roots), (None, None))
        if unit is None:
            return None
        found.append(unit)
        square, others = _inner(gram, unit, unit), list[list[Fraction]]()
        for v in rest:
            if v is not replaced:
                factor = square * _inner(gram, unit, v)
                others.append([x - factor * y for x, y in zip(v, unit, strict=True)])
        rest = others
    return found


def _root(value: Fraction) -> Fraction | None:
    try:
        return Fraction(EXACT["sqrt"](value))
    except InexactError:
        return None


def _images(algebra: Algebra, vectors: Sequence[Sequence[Fraction]], blades: Sequence[int]) -> dict[int, Multivector]:
    """Return the outer products of vectors with these coordinates, by the bitmap of the vectors."""
    ends = [Multivector(algebra, {1 << k: x for k, x in enumerate(v)}) for v in vectors]
    one = Multivector(algebra, {0: 1})
    return {blade: reduce(xor, (ends[k] for k in range(len(ends)) if blade >> k & 1), one) for blade in blades}
