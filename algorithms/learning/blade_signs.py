"""Signs of products of basis blades of a nondegenerate algebra, for the Gram matrices of Clifford kernels."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]
LARGEST = 6
"""Maximum number of vectors of an algebra."""


@dataclass(frozen=True, eq=False)
class Signs:
    """The products ``e_a e_b = sign[a, b] e_(a xor b)`` of basis blades, which are indexed by bitmap.

    Attributes
    ----------
    size : int
        The number of blades.
    sign : array, (size, size)
    square : array, (size,)
        The squares of blades, which are also the signs of their inverses.
    """

    size: int
    sign: Integers
    square: Integers

    def pairs(self, m: int) -> tuple[Integers, Integers]:
        """Return the blades and signs of ``<e_j K e_l^-1>``, which is ``sign[j, l]`` times the coefficient of K.

        Parameters
        ----------
        m : int
            The number of components j and l.
        """
        left, right = np.indices((m, m))
        return left ^ right, self.sign[left, left ^ right]

    def imaginary_unit(self) -> int:
        """Return the first blade whose square is -1."""
        found = np.flatnonzero(self.square < 0)
        if not len(found):
            raise ValueError("algebra: no basis blade has the square -1; expected one for the kernel 'gabor'")
        return int(found[0])


@cache
def blade_signs(p: int, q: int) -> Signs:
    """Return the table of an algebra with `p` vectors of square 1, and then `q` of square -1."""
    size = 1 << (p + q)
    bits = np.arange(size)
    count = np.array([int(b).bit_count() for b in bits])
    swaps = np.zeros((size, size), np.int64)
    for shift in range(1, p + q):
        swaps += count[(bits[:, None] >> shift) & bits]
    negative = bits[:, None] & bits & ~((1 << p) - 1)
    sign = 1 - 2 * ((swaps + count[negative]) & 1)
    sign.flags.writeable = False
    return Signs(size, sign, sign[bits, bits])


def signs_of_algebra(algebra: object) -> Signs:
    """Return the table of an algebra given by its signature.

    Raises
    ------
    TypeError
        If it is not a tuple of integers.
    ValueError
        If it is degenerate, or has more than six vectors.
    """
    if not isinstance(algebra, (tuple, list)) or not all(
        isinstance(k, (int, np.integer)) and not isinstance(k, bool) for k in algebra
    ):
        raise TypeError(f"algebra: {algebra!r}; expected a signature, a tuple of integers (p, q)")
    if len(algebra) not in (2, 3) or min(algebra) < 0 or sum(algebra) > LARGEST:
        raise ValueError(f"algebra: {algebra!r}; expected (p, q) with at most {LARGEST} vectors")
    if len(algebra) == 3 and algebra[2]:
        raise ValueError(
            f"algebra: {algebra!r} has vectors of square 0; expected a nondegenerate signature (p, q), "
            "because kernels use inverses of basis blades"
        )
    return blade_signs(int(algebra[0]), int(algebra[1]))
