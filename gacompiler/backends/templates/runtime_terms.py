"""Numbers of LLVM with the operators of Python, so that formulas in Python write its instructions.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .runtime_llvm import _tools

_POLYNOMIALS: dict[str, dict[str, tuple[float, ...]]] = {}
"""Of the transcendental functions, for each type; the lowest term first."""


class _Term:
    """A number, a word of bits or a condition. Other operands are terms of its type, or constants."""

    def __init__(self, builder: Any, value: Any) -> None:
        self._builder, self.value = builder, value

    def __add__(self, other: Any) -> _Term:
        return self._of(self._arithmetic("add")(self.value, self._operand(other)))

    def __sub__(self, other: Any) -> _Term:
        return self._of(self._arithmetic("sub")(self.value, self._operand(other)))

    def __mul__(self, other: Any) -> _Term:
        return self._of(self._arithmetic("mul")(self.value, self._operand(other)))

    def __truediv__(self, other: Any) -> _Term:
        return self._of(self._builder.fdiv(self.value, self._operand(other)))

    def __neg__(self) -> _Term:
        return self._of(self._builder.fneg(self.value))

    def __and__(self, other: Any) -> _Term:
        return self._of(self._builder.and_(self.value, self._operand(other)))

    def __xor__(self, other: Any) -> _Term:
        return self._of(self._builder.xor(self.value, self._operand(other)))

    def __lshift__(self, count: int) -> _Term:
        return self._of(self._builder.shl(self.value, self._operand(count)))

    def __rshift__(self, count: int) -> _Term:
        return self._of(self._builder.lshr(self.value, self._operand(count)))

    def __gt__(self, other: Any) -> _Term:
        return self._of(self._builder.fcmp_ordered(">", self.value, self._operand(other)))

    def __lt__(self, other: Any) -> _Term:
        return self._of(self._builder.fcmp_ordered("<", self.value, self._operand(other)))

    def equals(self, other: Any) -> _Term:
        """Whether two numbers are equal."""
        return self._of(self._builder.fcmp_ordered("==", self.value, self._operand(other)))

    def chosen(self, a: Any, b: Any) -> _Term:
        """Of a condition: `a` where it holds, else `b`; at least one of them is a term."""
        kind = (a if isinstance(a, _Term) else b).value.type
        return self._of(self._builder.select(self.value, self._operand(a, kind), self._operand(b, kind)))

    def like(self, value: float) -> _Term:
        """A constant of the same type."""
        return self._of(self._operand(value))

    @property
    def is_double(self) -> bool:
        return isinstance(self.value.type, _tools().ll.DoubleType)

    @property
    def type_name(self) -> str:
        """Of a number."""
        return "float64" if self.is_double else "float32"

    def bits(self) -> _Term:
        """The word that a number is stored as."""
        return self._of(self._builder.bitcast(self.value, _tools().ll.IntType(64 if self.is_double else 32)))

    def number(self) -> _Term:
        """The number that is stored as this word."""
        ll = _tools().ll
        return self._of(self._builder.bitcast(self.value, ll.DoubleType() if self._width == 64 else ll.FloatType()))

    def is_odd(self) -> _Term:
        """Of a word."""
        return self._of(self._builder.trunc(self.value, _tools().ll.IntType(1)))

    def is_negative(self) -> _Term:
        """Whether a number has the sign -, as zeros and NaN may."""
        bits = self.bits()
        return (bits >> (bits._width - 1)).is_odd()

    def absolute(self) -> _Term:
        bits = self.bits()
        return (bits & ((1 << (bits._width - 1)) - 1)).number()

    def flipped_by(self, word: _Term) -> _Term:
        """With the other sign where the highest bit of a word is 1."""
        return (self.bits() ^ (word & (1 << (word._width - 1)))).number()

    def root(self) -> _Term:
        root = self._builder.module.declare_intrinsic("llvm.sqrt", [self.value.type])
        return self._of(self._builder.call(root, [self.value]))

    def fused(self, factor: Any, summand: Any) -> _Term:
        """``self * factor + summand``, rounded once."""
        return self._of(self._builder.fma(self.value, self._operand(factor), self._operand(summand)))

    def polynomial(self, name: str) -> _Term:
        """One of `_POLYNOMIALS`, in two halves that processors compute side by side."""
        square, terms = self * self, _POLYNOMIALS[self.type_name][name]
        return self.fused(self._horner(square, terms[1::2]), self._horner(square, terms[0::2]))

    def _horner(self, x: _Term, terms: Sequence[float]) -> _Term:
        found = self.like(terms[-1])
        for term in reversed(terms[:-1]):
            found = x.fused(found, term)
        return found

    @property
    def _width(self) -> int:
        """Bits of a word."""
        return int(self.value.type.width)

    def _of(self, value: Any) -> _Term:
        return _Term(self._builder, value)

    def _operand(self, other: Any, kind: Any = None) -> Any:
        return other.value if isinstance(other, _Term) else _tools().ll.Constant(kind or self.value.type, other)

    def _arithmetic(self, name: str) -> Any:
        words = isinstance(self.value.type, _tools().ll.IntType)
        return getattr(self._builder, name if words else f"f{name}")
