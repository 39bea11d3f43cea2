"""Residues modulo a large prime: exact arithmetic for deep expressions, whose rational values have too many digits.

Two rational functions that agree at random residues agree everywhere, except with a probability of at most their degree
divided by the prime (Schwartz 1980, Zippel 1979). Unlike fractions, residues have the same size at every depth.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any

from ..errors import InexactError, ZeroDivisorError

PRIME = 2**127 - 1
"""The modulus, a Mersenne prime."""
SMALL = 2**60
"""Bound for numerators of the rational numbers that are recognised."""


class Residue:
    """A residue modulo `PRIME`, an immutable coefficient.

    Parameters
    ----------
    value : int
    """

    __slots__ = ("value",)

    def __init__(self, value: int) -> None:
        self.value = value % PRIME

    @property
    def is_zero(self) -> bool:
        """Whether the residue is zero."""
        return not self.value

    def near(self, denominator: int) -> Fraction | None:
        """Return a rational number with this residue, a small numerator and the given denominator, or None."""
        numerator = self.value * denominator % PRIME
        if numerator > PRIME // 2:
            numerator -= PRIME
        return Fraction(numerator, denominator) if abs(numerator) < SMALL else None

    def __add__(self, other: Any) -> Residue:
        value = _value(other)
        return NotImplemented if value is None else Residue(self.value + value)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Residue:
        value = _value(other)
        return NotImplemented if value is None else Residue(self.value - value)

    def __rsub__(self, other: Any) -> Residue:
        value = _value(other)
        return NotImplemented if value is None else Residue(value - self.value)

    def __mul__(self, other: Any) -> Residue:
        value = _value(other)
        return NotImplemented if value is None else Residue(self.value * value)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Residue:
        value = _value(other)
        return NotImplemented if value is None else Residue(self.value * _inverse(value))

    def __rtruediv__(self, other: Any) -> Residue:
        value = _value(other)
        return NotImplemented if value is None else Residue(value * _inverse(self.value))

    def __neg__(self) -> Residue:
        return Residue(-self.value)

    def __eq__(self, other: object) -> bool:
        value = _value(other)
        return value is not None and (self.value - value) % PRIME == 0

    def __hash__(self) -> int:
        return hash(self.value)

    def __repr__(self) -> str:
        return f"{self.value} (mod 2**127 - 1)"

    def scalar_function(self, name: str, arguments: tuple[Any, ...]) -> Any:
        """Refuse functions other than arithmetic; called by `gacompiler.algebra.coefficients.scalar_function`.

        Raises
        ------
        InexactError
            Always: residues have no order, and few of them have roots.
        """
        raise InexactError(name, "a residue has no such function", remedy="use mpmath numbers")


def residue(number: int | Fraction) -> Residue:
    """Return the residue of a rational number."""
    value = _value(number)
    assert value is not None
    return Residue(value)


def _value(other: Any) -> int | None:
    if isinstance(other, Residue):
        return other.value
    if isinstance(other, int):
        return other
    if isinstance(other, Fraction):
        return other.numerator * _inverse(other.denominator)
    return None


def _inverse(value: int) -> int:
    if value % PRIME == 0:
        raise ZeroDivisorError("division", "a residue / 0", "a divisor other than zero")
    return pow(value, -1, PRIME)


def rank(rows: Iterable[Mapping[int, int]]) -> int:
    """Return the rank of a sparse matrix of values modulo `PRIME`."""
    pivots: dict[int, dict[int, int]] = {}
    for given in rows:
        row = {k: value % PRIME for k, value in given.items() if value % PRIME}
        while row:
            first = min(row)
            if first not in pivots:
                inverse = _inverse(row[first])
                pivots[first] = {k: value * inverse % PRIME for k, value in row.items()}
                break
            factor = row[first]
            for k, value in pivots[first].items():
                total = (row.get(k, 0) - factor * value) % PRIME
                if total:
                    row[k] = total
                else:
                    row.pop(k, None)
    return len(pivots)
