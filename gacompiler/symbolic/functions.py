"""The operations of the algebra on symbolic multivectors, under the names they have everywhere."""

from __future__ import annotations

from typing import Any

import sympy

from ..algebra.coefficients import is_zero
from ..algebra.multivector import Multivector
from ..algebra.operations import OPERATIONS
from ..errors import AlgebraError
from ..rings.symbolic import Expanded
from .multivector import SymbolicMultivector, required, symbolic
from .printing import common_factor
from .relations import reduce


def _apply(operation: str, *arguments: Any) -> SymbolicMultivector:
    algebra = next((a.algebra for a in arguments if isinstance(a, Multivector)), None)
    if algebra is None:
        raise AlgebraError(f"{operation}()", ", ".join(type(a).__name__ for a in arguments), "at least one multivector")
    zero = SymbolicMultivector(algebra, {})
    lifted = tuple(map(zero.lift, arguments))
    return symbolic(OPERATIONS[operation](*lifted), operation, *lifted)


def geometric_product(a: Any, b: Any) -> SymbolicMultivector:
    """``a * b``."""
    return _apply("geometric_product", a, b)


def outer_product(a: Any, b: Any) -> SymbolicMultivector:
    """``a ^ b``."""
    return _apply("outer_product", a, b)


def left_contraction(a: Any, b: Any) -> SymbolicMultivector:
    """Of grades p and q, the part of grade q - p of the geometric product."""
    return _apply("left_contraction", a, b)


def right_contraction(a: Any, b: Any) -> SymbolicMultivector:
    """Of grades p and q, the part of grade p - q of the geometric product."""
    return _apply("right_contraction", a, b)


def inner_product(a: Any, b: Any) -> SymbolicMultivector:
    """Of grades p and q, the part of grade \\|p - q\\|; scalars take part."""
    return _apply("inner_product", a, b)


def hestenes_product(a: Any, b: Any) -> SymbolicMultivector:
    """`inner_product`, but zero where one factor is a scalar."""
    return _apply("hestenes_product", a, b)


def scalar_product(a: Any, b: Any) -> SymbolicMultivector:
    """The scalar part of the geometric product."""
    return _apply("scalar_product", a, b)


def regressive_product(a: Any, b: Any) -> SymbolicMultivector:
    """``a & b``."""
    return _apply("regressive_product", a, b)


def commutator(a: Any, b: Any) -> SymbolicMultivector:
    """``(a b - b a) / 2``."""
    return _apply("commutator", a, b)


def anticommutator(a: Any, b: Any) -> SymbolicMultivector:
    """``(a b + b a) / 2``."""
    return _apply("anticommutator", a, b)


def reverse(a: Any) -> SymbolicMultivector:
    """``~a``."""
    return _apply("reverse", a)


def grade_involution(a: Any) -> SymbolicMultivector:
    """Every vector negated."""
    return _apply("grade_involution", a)


def clifford_conjugate(a: Any) -> SymbolicMultivector:
    """Reverse and grade involution."""
    return _apply("clifford_conjugate", a)


def dual(a: Any) -> SymbolicMultivector:
    """Right complement, metric-free: ``b ^ dual(b) = I`` for basis blades."""
    return _apply("dual", a)


def undual(a: Any) -> SymbolicMultivector:
    """The inverse of `dual`."""
    return _apply("undual", a)


def polarity(a: Any) -> SymbolicMultivector:
    """The metric dual ``a I**-1``; raises in a degenerate metric."""
    return _apply("polarity", a)


def sandwich(versor: Any, x: Any) -> SymbolicMultivector:
    """``v x ~v``; for an odd versor ``v grade_involution(x) ~v``."""
    return _apply("sandwich", versor, x)


def inverse(a: Any) -> SymbolicMultivector:
    """``b`` with ``a b = 1``."""
    return _apply("inverse", a)


def determinant(a: Any) -> SymbolicMultivector:
    """A scalar that is zero exactly where `a` has no inverse."""
    return _apply("determinant", a)


def norm_squared(a: Any) -> SymbolicMultivector:
    """The scalar part of ``a ~a``."""
    return _apply("norm_squared", a)


def norm(a: Any) -> SymbolicMultivector:
    """``sqrt(|a ~a|)``, without the absolute value where the metric lets one sign occur only."""
    return _apply("norm", a)


def normalize(a: Any) -> SymbolicMultivector:
    """``a / norm(a)``: then ``a ~a`` has the scalar part 1, or -1 where it was negative."""
    return _apply("normalize", a)


def grade(a: Any, *grades: int) -> SymbolicMultivector:
    """The part of the given grades."""
    return required("grade()", a).grade(*grades)


def exp(a: SymbolicMultivector) -> SymbolicMultivector:
    """The exponential in closed form.

    Parameters
    ----------
    a : SymbolicMultivector
        A scalar plus a part `b` whose square is a scalar, or a scalar plus an element that squares to zero and
        commutes with `b`: blades and all bivectors up to three dimensions and of projective algebras.

    Raises
    ------
    AlgebraError
        When the square is of another form: split `a` into commuting blades and multiply their exponentials.

    Notes
    -----
    With ``b**2 = s + p`` and ``p**2 = 0``: ``exp(b) = C(s) + C'(s) p + (S(s) + S'(s) p) b`` where ``C(s) =
    cosh(sqrt(s))`` and ``S(s) = sinh(sqrt(s)) / sqrt(s)``; trigonometric functions where `s` is written as negative.
    """
    lifted = required("exp()", a)
    b = lifted.keep(bool)
    size, rest = _factor(b)
    square = reduce(rest * rest)
    p = square.keep(bool)
    if not (_vanishes(p * p) and _vanishes(rest * p - p * rest)):
        raise AlgebraError(
            f"exp({lifted})",
            f"a square of {square}",
            "a scalar, and perhaps a part that squares to zero",
            "split it into commuting blades and multiply their exponentials",
        )
    s = square["1"]
    cosine, sine = _even_and_odd(s, size)
    result = cosine + sine * rest
    if p.terms:
        slope = size**3 / 6 if s == 0 else (size * cosine - sine) / (2 * s)
        result = result + size * sine / 2 * p + slope * (p * rest)
    return symbolic(sympy.exp(lifted["1"]) * result)


def _factor(b: SymbolicMultivector) -> tuple[Any, SymbolicMultivector]:
    """A scalar and an element whose product `b` is, the element as free of symbols as may be."""
    if len(b.terms) == 1:
        ((blade, value),) = b.expressions.items()
        return value, SymbolicMultivector(b.algebra, {blade: 1})
    size, _ = common_factor(b)
    return size, symbolic(b / size)


def _even_and_odd(s: Any, size: Any) -> tuple[Any, Any]:
    """``cosh(size sqrt(s))`` and ``sinh(size sqrt(s)) / sqrt(s)``: the sign of the root is free."""
    if s == 0:
        return sympy.Integer(1), size
    negative = s.is_negative or (s.is_positive is not True and s.could_extract_minus_sign())
    root = signless(sympy.sqrt(sympy.factor(-s if negative else s)))
    cosine, sine = (sympy.cos, sympy.sin) if negative else (sympy.cosh, sympy.sinh)
    return cosine(size * root), sine(size * root) / root


def signless(root: Any) -> Any:
    """A root whose sign is free, without the absolute values of its factors."""
    factors = [power.as_base_exp() for power in sympy.Mul.make_args(root)]
    return sympy.Mul(*((b.args[0] if isinstance(b, sympy.Abs) else b) ** e for b, e in factors))


def _vanishes(x: SymbolicMultivector) -> bool:
    return all(is_zero(Expanded.of(sympy.simplify(value))) for value in x.expressions.values())
