"""LLVM values with Python operators, so that formulas in Python generate LLVM instructions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .llvm import ll

POLYNOMIALS: dict[str, dict[str, tuple[float, ...]]] = {
    "float64": {
        "sin": (
            -0.16666666666666666,
            0.008333333333330948,
            -0.00019841269836758574,
            2.755731610255244e-06,
            -2.5051131845003624e-08,
            1.5918129294866608e-10,
        ),
        "cos": (
            0.041666666666666664,
            -0.0013888888888887398,
            2.480158729876569e-05,
            -2.7557317271729793e-07,
            2.08761462684032e-09,
            -1.1382632425521717e-11,
        ),
        "exp": (
            0.5000000000000001,
            0.16666666666666669,
            0.041666666666624164,
            0.008333333333330065,
            0.0013888888917196719,
            0.00019841269863040545,
            2.4801521322368692e-05,
            2.7557268480310024e-06,
            2.7620075879983367e-07,
            2.5100375832561234e-08,
        ),
        "log": (
            0.666666666666667,
            0.39999999999899505,
            0.28571428625975487,
            0.2222221113479508,
            0.18182889125261723,
            0.15331721600556042,
            0.14616449685043406,
        ),
        "atan": (
            -0.2591604972657936,
            0.11081482513071414,
            -0.054814840604579904,
            0.029135862645225958,
            -0.016172974900145312,
            0.009243096224092707,
            -0.005394792734515503,
            0.0031991751955030576,
            -0.0019209389488175712,
            0.0011650648417818904,
            -0.000712529877324769,
            0.0004387712318266148,
            -0.0002713884068435811,
            0.00016895422802807932,
            -0.00010789905799306997,
            6.77580169120214e-05,
            -3.504433556095341e-05,
            2.2095024431396628e-05,
            -2.8373324902198374e-05,
            1.806195461861215e-05,
        ),
        "asin": (
            0.16666666666666669,
            0.07499999999998433,
            0.04464285714635543,
            0.030381944138531247,
            0.02237217294214989,
            0.017352392720869973,
            0.013971212973552933,
            0.011479177415184906,
            0.01032281435018578,
            0.005457506718640358,
            0.01740087944269402,
            -0.014851887071247204,
            0.028757851367421566,
        ),
    },
    "float32": {
        "sin": (
            -0.166666641831398,
            0.008332747966051102,
            -0.00019587890710681677,
        ),
        "cos": (
            0.0416666641831398,
            -0.001388830249197781,
            2.454794230288826e-05,
        ),
        "exp": (
            0.5,
            0.16666577756404877,
            0.041666556149721146,
            0.008363173343241215,
            0.0013926175888627768,
        ),
        "log": (
            0.6666668653488159,
            0.3998878002166748,
            0.29579949378967285,
        ),
        "atan": (
            -0.25916048884391785,
            0.11081462353467941,
            -0.054814718663692474,
            0.029146425426006317,
            -0.01617945171892643,
            0.009093896485865116,
            -0.00530332000926137,
            0.00395978195592761,
            -0.0023869972210377455,
        ),
        "asin": (
            0.1666666567325592,
            0.07500094175338745,
            0.04459940269589424,
            0.031100662425160408,
            0.017149237915873528,
            0.03369084745645523,
        ),
    },
}
"""Of the transcendental functions, for each type; the lowest term first."""


class Term:
    """A number, an integer word or a condition. Other operands are terms of the same type, or constants."""

    def __init__(self, builder: Any, value: Any) -> None:
        self._builder, self.value = builder, value

    def __add__(self, other: Any) -> Term:
        return self._of(self._arithmetic("add")(self.value, self._operand(other)))

    def __sub__(self, other: Any) -> Term:
        return self._of(self._arithmetic("sub")(self.value, self._operand(other)))

    def __mul__(self, other: Any) -> Term:
        return self._of(self._arithmetic("mul")(self.value, self._operand(other)))

    def __truediv__(self, other: Any) -> Term:
        return self._of(self._builder.fdiv(self.value, self._operand(other)))

    def __neg__(self) -> Term:
        return self._of(self._builder.fneg(self.value))

    def __and__(self, other: Any) -> Term:
        return self._of(self._builder.and_(self.value, self._operand(other)))

    def __xor__(self, other: Any) -> Term:
        return self._of(self._builder.xor(self.value, self._operand(other)))

    def __lshift__(self, count: int) -> Term:
        return self._of(self._builder.shl(self.value, self._operand(count)))

    def __rshift__(self, count: int) -> Term:
        return self._of(self._builder.lshr(self.value, self._operand(count)))

    def __gt__(self, other: Any) -> Term:
        return self._of(self._builder.fcmp_ordered(">", self.value, self._operand(other)))

    def __lt__(self, other: Any) -> Term:
        return self._of(self._builder.fcmp_ordered("<", self.value, self._operand(other)))

    def equals(self, other: Any) -> Term:
        """Whether two numbers are equal."""
        return self._of(self._builder.fcmp_ordered("==", self.value, self._operand(other)))

    def chosen(self, a: Any, b: Any) -> Term:
        """Return `a` if this condition holds, else `b`; at least one of them is a term."""
        kind = (a if isinstance(a, Term) else b).value.type
        return self._of(self._builder.select(self.value, self._operand(a, kind), self._operand(b, kind)))

    def like(self, value: float) -> Term:
        """Return a constant of the same type."""
        return self._of(self._operand(value))

    @property
    def is_double(self) -> bool:
        """Whether a number is in double precision."""
        return isinstance(self.value.type, ll.DoubleType)

    @property
    def type_name(self) -> str:
        """The dtype of a number."""
        return "float64" if self.is_double else "float32"

    def bits(self) -> Term:
        """Return the bits of a number as a word."""
        return self._of(self._builder.bitcast(self.value, ll.IntType(64 if self.is_double else 32)))

    def number(self) -> Term:
        """Return the number with the bits of this word."""
        return self._of(self._builder.bitcast(self.value, ll.DoubleType() if self._width == 64 else ll.FloatType()))

    def is_odd(self) -> Term:
        """Whether a word is odd."""
        return self._of(self._builder.trunc(self.value, ll.IntType(1)))

    def is_negative(self) -> Term:
        """Whether the sign bit of a number is set, also for zeros and NaN."""
        bits = self.bits()
        return (bits >> (bits._width - 1)).is_odd()

    def absolute(self) -> Term:
        """Return the absolute value of a number."""
        bits = self.bits()
        return (bits & ((1 << (bits._width - 1)) - 1)).number()

    def flipped_by(self, word: Term) -> Term:
        """Return the number with its sign flipped if the highest bit of `word` is 1."""
        return (self.bits() ^ (word & (1 << (word._width - 1)))).number()

    def root(self) -> Term:
        """Return the square root."""
        root = self._builder.module.declare_intrinsic("llvm.sqrt", [self.value.type])
        return self._of(self._builder.call(root, [self.value]))

    def fused(self, factor: Any, summand: Any) -> Term:
        """Return ``self * factor + summand``, rounded once."""
        return self._of(self._builder.fma(self.value, self._operand(factor), self._operand(summand)))

    def polynomial(self, name: str) -> Term:
        """Evaluate one of `POLYNOMIALS` in two halves, which processors compute in parallel."""
        square, terms = self * self, POLYNOMIALS[self.type_name][name]
        return self.fused(self._horner(square, terms[1::2]), self._horner(square, terms[0::2]))

    def _horner(self, x: Term, terms: Sequence[float]) -> Term:
        found = self.like(terms[-1])
        for term in reversed(terms[:-1]):
            found = x.fused(found, term)
        return found

    @property
    def _width(self) -> int:
        """The number of bits of a word."""
        return int(self.value.type.width)

    def _of(self, value: Any) -> Term:
        return Term(self._builder, value)

    def _operand(self, other: Any, kind: Any = None) -> Any:
        return other.value if isinstance(other, Term) else ll.Constant(kind or self.value.type, other)

    def _arithmetic(self, name: str) -> Any:
        words = isinstance(self.value.type, ll.IntType)
        return getattr(self._builder, name if words else f"f{name}")
