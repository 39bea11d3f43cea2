"""Exact numbers ``a + b sqrt(d)`` with rational `a` and `b`: coefficients of the rotors of polyhedra."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import sqrt
from typing import Any

from ..errors import AlgebraError


@dataclass(frozen=True, slots=True)
class QuadraticNumber:
    """``a + b sqrt(d)``, a real number.

    Attributes
    ----------
    a, b : Fraction
    d : int
        Positive and not a square, the same for all operands.

    Examples
    --------
    >>> root = QuadraticNumber.root(2)
    >>> print(root * root, 1 / root)
    2 1/2*sqrt(2)
    """

    a: Fraction
    b: Fraction
    d: int

    @classmethod
    def root(cls, d: int) -> QuadraticNumber:
        """Return ``sqrt(d)``."""
        return cls(Fraction(0), Fraction(1), d)

    @property
    def is_zero(self) -> bool:
        """Return whether the number is 0."""
        return not self.a and not self.b

    def _of(self, other: Any) -> QuadraticNumber | None:
        if isinstance(other, QuadraticNumber):
            if other.d != self.d:
                raise AlgebraError("quadratic number", f"sqrt({other.d}) and sqrt({self.d})", "the same root")
            return other
        return QuadraticNumber(Fraction(other), Fraction(0), self.d) if isinstance(other, (int, Fraction)) else None

    def __add__(self, other: Any) -> QuadraticNumber:
        o = self._of(other)
        return NotImplemented if o is None else QuadraticNumber(self.a + o.a, self.b + o.b, self.d)

    __radd__ = __add__

    def __neg__(self) -> QuadraticNumber:
        return QuadraticNumber(-self.a, -self.b, self.d)

    def __sub__(self, other: Any) -> QuadraticNumber:
        o = self._of(other)
        return NotImplemented if o is None else self + -o

    def __rsub__(self, other: Any) -> QuadraticNumber:
        o = self._of(other)
        return NotImplemented if o is None else o - self

    def __mul__(self, other: Any) -> QuadraticNumber:
        o = self._of(other)
        if o is None:
            return NotImplemented
        return QuadraticNumber(self.a * o.a + self.b * o.b * self.d, self.a * o.b + self.b * o.a, self.d)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> QuadraticNumber:
        o = self._of(other)
        if o is None:
            return NotImplemented
        norm = o.a * o.a - o.b * o.b * self.d
        return self * QuadraticNumber(o.a / norm, -o.b / norm, self.d)

    def __rtruediv__(self, other: Any) -> QuadraticNumber:
        o = self._of(other)
        return NotImplemented if o is None else o / self

    def __pow__(self, exponent: int) -> QuadraticNumber:
        result = QuadraticNumber(Fraction(1), Fraction(0), self.d)
        for _ in range(exponent):
            result = result * self
        return result

    def __abs__(self) -> QuadraticNumber:
        return -self if self < 0 else self

    def __lt__(self, other: Any) -> bool:
        """Compare exactly, by the signs of the parts or their squares."""
        o = self._of(other)
        if o is None:
            return NotImplemented
        a, b = self.a - o.a, self.b - o.b
        if a <= 0 and b <= 0:
            return bool(a or b)
        if a >= 0 and b >= 0:
            return False
        return a * a > b * b * self.d if a < 0 else a * a < b * b * self.d

    def __eq__(self, other: object) -> bool:
        o = self._of(other)
        return NotImplemented if o is None else (self.a, self.b) == (o.a, o.b)

    def __hash__(self) -> int:
        return hash(self.a) if not self.b else hash((self.a, self.b, self.d))

    def __float__(self) -> float:
        return float(self.a) + float(self.b) * sqrt(self.d)

    def __str__(self) -> str:
        root = f"{self.b}*sqrt({self.d})"
        return str(self.a) if not self.b else root if not self.a else f"{self.a} + {root}"
