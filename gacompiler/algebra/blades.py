"""Basis blades as bitmaps, and their exact product under any symmetric metric.

Bit ``k`` of a bitmap represents basis vector ``k``; a bitmap is the outer product of its vectors in ascending order.
The geometric product of two basis blades under a Gram matrix follows from two facts alone (Dorst, Fontijne & Mann,
*Geometric Algebra for Computer Science*, 2007, ch. 19): ``a B = a ^ B + a . B`` for a vector ``a``, and associativity.
No change of basis is made, so null and oblique bases are supported like orthonormal ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction

Rational = int | Fraction
"""An entry of a Gram matrix; symbolic metrics have `gacompiler.rings.symbolic.Expanded` in the same places."""
Gram = tuple[tuple[Rational, ...], ...]
Terms = Mapping[int, Rational]


def grade(blade: int) -> int:
    """Return the grade of a basis blade, the number of its basis vectors."""
    return blade.bit_count()


def bits(blade: int) -> Iterator[int]:
    """Iterate over the basis vectors of a blade, as bitmaps in ascending order."""
    while blade:
        vector = blade & -blade
        yield vector
        blade ^= vector


def reordering_sign(a: int, b: int) -> int:
    """Return the sign of sorting the vectors of `a` followed by those of `b` into ascending order.

    The sort is stable: equal vectors are not exchanged.
    """
    swaps = 0
    while a:
        vector = a & -a
        swaps += (b & (vector - 1)).bit_count()
        a ^= vector
    return -1 if swaps & 1 else 1


def outer(a: int, b: int) -> int:
    """Return the sign of the outer product of two basis blades, 0 if they share a vector; its blade is ``a | b``."""
    return 0 if a & b else reordering_sign(a, b)


def reverse_sign(k: int) -> int:
    """Return the sign of reversing the order of the vectors of a blade of grade `k`: ``(-1)**(k (k-1) / 2)``."""
    return -1 if k & 2 else 1


def exact(value: Rational) -> Rational:
    """Return `value`, as an int if it is an integer, so that equal numbers have equal types."""
    if type(value) is int:  # Most numbers are, and the test is several times faster than that for fractions.
        return value
    return value.numerator if isinstance(value, Fraction) and value.denominator == 1 else value


class BladeProducts:
    """The geometric products of basis blades under one Gram matrix, computed on demand and cached.

    Memory and time are proportional to the number of pairs of blades that occur, not to ``4**n``.
    """

    def __init__(self, gram: Gram) -> None:
        self._gram = gram
        n = len(gram)
        self._partners = tuple(tuple(j for j in range(n) if gram[i][j] != 0) for i in range(n))
        self._diagonal = all(set(self._partners[i]) <= {i} for i in range(n))
        self._memory: dict[tuple[int, int], Terms] = {}
        self._partner_bits = tuple(sum(1 << j for j in each) for each in self._partners)

    def __call__(self, a: int, b: int) -> Terms:
        """Return the product as a mapping from blade to coefficient, without zeros."""
        key = (a, b)
        known = self._memory.get(key)
        if known is None:
            known = self._memory[key] = self._orthogonal(a, b) if self._diagonal else self._general(a, b)
        return known

    def partners(self, blade: int) -> int:
        """Return the bitmap of the basis vectors that are not orthogonal to every vector of a blade."""
        found = 0
        for vector in bits(blade):
            found |= self._partner_bits[vector.bit_length() - 1]
        return found

    def _orthogonal(self, a: int, b: int) -> Terms:
        value: Rational = reordering_sign(a, b)
        common = a & b
        while common:
            k = (common & -common).bit_length() - 1
            value = value * self._gram[k][k]
            common &= common - 1
        return {a ^ b: exact(value)} if value else {}

    def _general(self, a: int, b: int) -> Terms:
        """``(v ^ A) B = v (A B) - (v . A) B`` with ``v`` the first vector of the left blade."""
        if not a:
            return {b: 1}
        k = (a & -a).bit_length() - 1
        rest = a & (a - 1)
        result: dict[int, Rational] = {}
        for blade, value in self(rest, b).items():
            for target, factor in self._vector_times(k, blade):
                result[target] = result.get(target, 0) + value * factor
        for blade, value in self._contract(k, rest):
            for target, factor in self(blade, b).items():
                result[target] = result.get(target, 0) - value * factor
        return {blade: exact(value) for blade, value in sorted(result.items()) if value}

    def _vector_times(self, k: int, blade: int) -> list[tuple[int, Rational]]:
        terms = self._contract(k, blade)
        if not blade >> k & 1:
            terms.append((blade | 1 << k, reordering_sign(1 << k, blade)))
        return terms

    def _contract(self, k: int, blade: int) -> list[tuple[int, Rational]]:
        """Return the left contraction of basis vector `k` onto a basis blade; the signs alternate along the blade."""
        return [
            (blade ^ 1 << j, self._gram[k][j] * (-1 if (blade & (1 << j) - 1).bit_count() & 1 else 1))
            for j in self._partners[k]
            if blade >> j & 1
        ]
