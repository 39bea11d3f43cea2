"""Random numbers inside kernels, computed from a seed and a counter, with the same bits on all targets.

The pair of numbers ``(left, right)`` that a counter stands for is encrypted by a Feistel network with cubes modulo a
prime as its round function, that of MiMC (Albrecht, Grassi, Rechberger, Roy and Tiessen, ASIACRYPT 2016). No state is
needed: number `counter` of a sequence is computed without the previous ones, in any order and in any thread. Distinct
counters have distinct pairs, since every round is invertible.

All intermediate values are integers below 2**53, so that no operation is rounded, with fused multiply-adds or without.
Quotients are rounded down by a factor that is slightly too small and corrected, which gives the exact remainders. Each
remainder is the result of a selection, which the compiler does not expand into products of larger numbers.
"""

from __future__ import annotations

from fractions import Fraction
from math import isqrt
from typing import Any

from .operations import floor, select

PRIME = 33554393
"""The largest prime below 2**25, so that the product of a remainder and the sum of two is below 2**52."""
_INVERSE = Fraction(2**53 // PRIME - 1, 2**53)
"""Less than 1 / `PRIME` by 2**-28 of it, more than any rounding. Quotients below 2**27 are at most 1 too small, and so
often that proofs with random operands reach both cases of the correction."""
# Four rounds with random functions cannot be distinguished from a random permutation (Luby and Rackoff, SIAM J. Comput.
# 17, 1988). There are twice as many, since cubes are not random functions.
_ROUNDS = tuple(isqrt(prime * PRIME**2) % PRIME for prime in (2, 3, 5, 7, 11, 13, 17, 19))
"""The constant of each round: the first digits of the square roots of primes."""


def uniform(seed: Any, counter: Any) -> Any:
    """Return a random number of the interval [0, 1).

    Parameters
    ----------
    seed, counter : scalars
        Integers from 0 to 2**49; fractional parts are ignored. Each seed gives another sequence, and each counter
        another number of it.

    Returns
    -------
    expression or number
        A multiple of ``1 / PRIME**2``, about 2**-50, in double precision.

    Notes
    -----
    Numbers have the same bits on all targets. They are not suitable for cryptography. Single precision is not
    supported, since it rounds the products: kernels convert arguments to double precision. The derivative is 0.

    Numbers of one sequence are without repetition: a counter below ``PRIME**2`` has a number of its own.
    """
    left, right = _encrypted(seed, counter)
    return (left * PRIME + right) * Fraction(1, PRIME**2)


def random_integer(seed: Any, counter: Any, n: Any) -> Any:
    """Return a random integer from 0 to ``n - 1``.

    Parameters
    ----------
    seed, counter : scalars
        See `uniform`.
    n : scalar
        The number of integers, at most 2**25. For a larger number use `uniform`.

    Returns
    -------
    expression or number
        The integer below `n` times `uniform`, in exact arithmetic. No integer is more frequent than another one by more
        than n * 2**-49 of its frequency.

    Notes
    -----
    The notes of `uniform` apply.
    """
    left, right = _encrypted(seed, counter)
    low, _ = _divided(right * n)
    return _divided(left * n + low)[0]


def _encrypted(seed: Any, counter: Any) -> tuple[Any, Any]:
    """Return the pair of remainders of a counter."""
    keys = _divided(floor(seed))
    left, right = _divided(floor(counter))
    for k, constant in enumerate(_ROUNDS):
        base = right + _reduced(keys[k % 2] + constant)
        square = _divided(base * base)[1]
        left, right = right, _divided(square * base + left)[1]
    return left, right


def _divided(x: Any) -> tuple[Any, Any]:
    """Return the quotient and the remainder of an integer from 0 to 2**52 and the prime."""
    quotient = floor(x * _INVERSE)
    rest = x - quotient * PRIME
    is_low = rest >= PRIME
    return select(is_low, quotient + 1, quotient), select(is_low, rest - PRIME, rest)


def _reduced(x: Any) -> Any:
    """Return the remainder of an integer below twice the prime."""
    return select(x >= PRIME, x - PRIME, x)
