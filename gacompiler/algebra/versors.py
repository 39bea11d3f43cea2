"""Norms, inverses and sandwiches."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from ..errors import AlgebraError, ZeroDivisorError
from .coefficients import divide, scalar_function, scale
from .involutions import clifford_conjugate, grade_involution, reverse
from .multivector import Multivector
from .signs import norm_signs

T = TypeVar("T", bound=Any)


def norm_squared(a: Multivector) -> Multivector:
    """The scalar part of ``a ~a``."""
    return a.product("scalar_product", reverse(a))


def norm(a: Multivector) -> Multivector:
    """The root of the absolute value of `norm_squared`.

    An absolute value is taken only where the metric lets both signs occur.
    """
    square, signs = norm_squared(a).scalar, norm_signs(a.algebra, a.blades)
    if signs.both:
        square = scalar_function("abs", square)
    return a.lift(scalar_function("sqrt", -square if signs.negative and not signs.positive else square))


def normalize(a: Multivector) -> Multivector:
    """``a / norm(a)``.

    Raises
    ------
    ZeroDivisorError
        When `a` is null, as far as its form tells: an exact element always tells.
    """
    size = norm(a)
    if not size.terms:
        raise ZeroDivisorError("normalize", f"{a}, whose norm is 0", "an element that is not null")
    return a / size


def commutator(a: Multivector, b: Multivector) -> Multivector:
    """``(a b - b a) / 2``."""
    return a.product("commutator", b)


def anticommutator(a: Multivector, b: Multivector) -> Multivector:
    """``(a b + b a) / 2``."""
    return a.product("anticommutator", b)


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

    ``~a / (a ~a)`` where ``a ~a`` is a scalar (every versor, every blade); otherwise `conjugate_factors` where `a` lies
    in the algebra of up to five vectors, and above that the Faddeev-LeVerrier recursion of Shirokov (*Adv. Appl.
    Clifford Algebras* 31:70, 2021), which holds in any algebra.

    Raises
    ------
    ZeroDivisorError
        When `a` has no inverse, as far as its form tells: an exact element always tells.
    """
    if not a.terms:
        raise ZeroDivisorError("inverse", "an element that is zero", "an invertible element")
    squared = a * reverse(a)
    if squared.terms and not any(squared.terms):
        return reverse(a) / squared
    if n_vectors(a.blades) > SMALL_DIMENSION:
        return _inverse_by_recursion(a)
    (first, *others), norm = conjugate_factors(a, clifford_conjugate)
    if not norm.terms:
        raise ZeroDivisorError("inverse", f"the determinant of {a} is zero", "an invertible element")
    if not others:
        return first / norm
    reciprocal = divide(1, norm.scalar)
    rest = others[0] if len(others) == 1 else others[0] * others[1]
    return first * rest.map(lambda value: value * reciprocal)


def determinant(a: Multivector) -> Multivector:
    """The scalar that is zero exactly where `a` has no inverse.

    Up to sign the determinant of the matrices of the algebra (Shirokov 2021), of degree ``2**ceil(n/2)`` in the
    coefficients, where `n` is the dimension of the algebra, whatever blades `a` has.
    """
    if a.algebra.dimension <= SMALL_DIMENSION:
        return conjugate_factors(a, clifford_conjugate, complete=True)[1]
    return -_adjugate(a, a.algebra.dimension)[1].grade(0)


SMALL_DIMENSION = 5
"""Up to so many vectors an inverse is a product of conjugates (Hitzer & Sangwine, *Appl. Math. Comput.* 311, 2017)."""


def n_vectors(blades: Iterable[int]) -> int:
    """The number of basis vectors that take part in some blades."""
    union = 0
    for blade in blades:
        union |= blade
    return union.bit_count()


def conjugate_factors(a: T, conjugate: Callable[[T], T], complete: bool = False) -> tuple[list[T], T]:
    """Elements whose product with `a` is a scalar, and that scalar: for up to five vectors.

    ``a`` times its Clifford conjugate keeps the grades 0, 3 and 4 (up to four vectors), its square with 3 and 4 negated
    a scalar. With five vectors, ``a ~a`` keeps the grades 0, 1, 4 and 5; of that times itself with 1 and 4 negated the
    grades 0 and 5 are left, which is a number over the central pseudoscalar, and has a conjugate of its own.

    Parameters
    ----------
    a : Multivector or Expression
    conjugate : callable
        The Clifford conjugation of such.
    complete : bool
        Whether to go through all steps of the algebra; otherwise those are left out that the blades of `a` do not need.
    """
    n = a.algebra.dimension if complete else n_vectors(a.blades)
    centre, rest = ((0, 5), (1, 4)) if n > 4 else ((0,), (3, 4))
    factors = [~a if n > 4 else conjugate(a)]
    norm = (a * factors[0]).grade(*centre, *rest)
    for least, kept, negated in ((3, centre, rest), (5, (0,), (5,))):
        if n >= least if complete else norm.grade(*negated).blades:
            factors.append(norm.grade(*kept) - norm.grade(*negated))
            norm = (norm * factors[-1]).grade(*kept)
    return factors, norm


def _inverse_by_recursion(a: Multivector) -> Multivector:
    adjugate, power = _adjugate(a, n_vectors(a.blades))
    if 0 not in power.terms:
        raise ZeroDivisorError("inverse", f"the determinant of {a} is zero", "an invertible element")
    return adjugate / power.grade(0)


def _adjugate(a: Multivector, n: int) -> tuple[Multivector, Multivector]:
    """An element, and its product with `a`, which is minus the determinant of `a` as a matrix of `n` vectors."""
    size = 2 ** ((n + 1) // 2)
    power = adjugate = a
    for k in range(1, size):
        adjugate = power - divide(scale(power.scalar, size), k)
        power = a * adjugate
    return adjugate, power
