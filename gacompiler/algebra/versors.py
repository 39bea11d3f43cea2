"""Norms, inverses and sandwiches."""

from __future__ import annotations

from ..errors import AlgebraError, ZeroDivisorError
from .coefficients import divide, scalar_function, scale
from .involutions import clifford_conjugate, grade_involution, reverse
from .multivector import Multivector


def norm_squared(a: Multivector) -> Multivector:
    """The scalar part of ``a ~a``."""
    return a.product("scalar_product", reverse(a))


def norm(a: Multivector) -> Multivector:
    """``sqrt(norm_squared(a))``; not a number where that is negative."""
    return a.lift(scalar_function("sqrt", norm_squared(a).scalar))


def normalize(a: Multivector) -> Multivector:
    """``a / norm(a)``."""
    return a / norm(a)


def commutator(a: Multivector, b: Multivector) -> Multivector:
    """``(a b - b a) / 2``."""
    return (a * b - b * a).map(lambda value: divide(value, 2))


def anticommutator(a: Multivector, b: Multivector) -> Multivector:
    """``(a b + b a) / 2``."""
    return (a * b + b * a).map(lambda value: divide(value, 2))


def sandwich(v: Multivector, x: Multivector) -> Multivector:
    """``v x ~v`` for an even versor, ``v grade_involution(x) ~v`` for an odd one.

    Raises
    ------
    AlgebraError
        When `v` has both even and odd parts: then it is no versor.
    """
    parities = {grade & 1 for grade in v.grades}
    if len(parities) > 1:
        raise AlgebraError(
            "sandwich",
            f"a versor of grades {v.grades}",
            "all grades even or all odd",
            "write v * x * ~v if that is meant",
        )
    return v * (grade_involution(x) if parities == {1} else x) * reverse(v)


def inverse(a: Multivector) -> Multivector:
    """The element ``b`` with ``a b = 1``.

    ``~a / (a ~a)`` where ``a ~a`` is a scalar (every versor, every blade); otherwise ``~a`` times the inverse of
    ``a ~a`` where that is scalar plus a part that squares to a scalar (dual and Study numbers); otherwise the
    Faddeev-LeVerrier recursion of Shirokov (*Adv. Appl. Clifford Algebras* 31:70, 2021), which holds in any algebra.

    Raises
    ------
    ZeroDivisorError
        When `a` has no inverse, as far as its form tells: an exact element always tells.
    """
    if not a.terms:
        raise ZeroDivisorError("inverse", "an element that is zero", "an invertible element")
    for conjugate in (reverse(a), clifford_conjugate(a)):
        squared = a * conjugate
        if not squared.terms:
            raise ZeroDivisorError("inverse", f"{a} times its conjugate is zero", "an invertible element")
        if not any(squared.terms):
            return conjugate / squared
        opposite = squared.grade(0) - (squared - squared.grade(0))
        determinant = squared * opposite
        if not determinant.terms:
            raise ZeroDivisorError("inverse", f"the norm of {a} is a zero divisor", "an invertible element")
        if not any(determinant.terms):
            return conjugate * opposite / determinant
    return _inverse_by_recursion(a)


def _inverse_by_recursion(a: Multivector) -> Multivector:
    size = 2 ** ((a.algebra.dimension + 1) // 2)
    power = adjugate = a
    for k in range(1, size):
        adjugate = power - divide(scale(power.scalar, size), k)
        power = a * adjugate
    if 0 not in power.terms:
        raise ZeroDivisorError("inverse", f"the determinant of {a} is zero", "an invertible element")
    return adjugate / power.grade(0)
