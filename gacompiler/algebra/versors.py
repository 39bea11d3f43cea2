"""Norms, inverses and sandwiches."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from ..errors import AlgebraError, ZeroDivisorError
from .coefficients import are_floats, divide, scalar_function, scale, solved
from .involutions import clifford_conjugate, grade_involution, reverse
from .multivector import Multivector
from .signs import norm_signs

T = TypeVar("T", bound=Any)
_EPS = sys.float_info.epsilon


def norm_squared(a: Multivector) -> Multivector:
    """Return the squared norm, the scalar part of ``a ~a``."""
    return a.product("scalar_product", reverse(a))


def norm(a: Multivector) -> Multivector:
    """Return the square root of the absolute value of `norm_squared`.

    The absolute value is computed only if both signs can occur in the metric.
    """
    square, signs = norm_squared(a).scalar, norm_signs(a.algebra, a.blades)
    if signs.both:
        square = scalar_function("abs", square)
    return a.lift(scalar_function("sqrt", -square if signs.negative and not signs.positive else square))


def normalize(a: Multivector) -> Multivector:
    """Return ``a / norm(a)``.

    Raises
    ------
    ZeroDivisorError
        If `a` is known to be null. This is always determined for exact coefficients.
    """
    size = norm(a)
    if not size.terms:
        raise ZeroDivisorError("normalize", f"{a}, whose norm is 0", "an element that is not null")
    return a / size


def commutator(a: Multivector, b: Multivector) -> Multivector:
    """Return the commutator ``(a b - b a) / 2``."""
    return a.product("commutator", b)


def anticommutator(a: Multivector, b: Multivector) -> Multivector:
    """Return the anticommutator ``(a b + b a) / 2``."""
    return a.product("anticommutator", b)


def sandwich(v: Multivector, x: Multivector) -> Multivector:
    """Return the sandwich product ``v x ~v`` for an even versor, or ``v grade_involution(x) ~v`` for an odd one.

    Raises
    ------
    AlgebraError
        If `v` has both even and odd parts, so that it is not a versor.
    """
    if v.algebra.conjugates:
        return v * x * ~v
    parities = {grade & 1 for grade in v.grades}
    if len(parities) > 1:
        raise AlgebraError(
            "sandwich",
            f"a versor of grades {v.grades}",
            "all grades even or all odd",
            "write v * x * ~v for the plain product",
        )
    return v * (grade_involution(x) if parities == {1} else x) * reverse(v)


def inverse(a: Multivector) -> Multivector:
    """Return the inverse of `a`, the element ``b`` with ``a b = 1``.

    The inverse is ``~a / (a ~a)`` if ``a ~a`` is a scalar, as for every versor and every blade. Otherwise it is
    computed with `conjugate_factors` if the blades of `a` contain at most five basis vectors, or with the
    Faddeev-LeVerrier recursion of Shirokov (*Adv. Appl. Clifford Algebras* 31:70, 2021), which is valid in any algebra.

    Raises
    ------
    ZeroDivisorError
        If `a` is known to have no inverse. This is always determined for exact coefficients.
    """
    if not a.terms:
        raise ZeroDivisorError("inverse", "an element that is zero", "an invertible element")
    squared = a * reverse(a)
    if squared.terms and not any(squared.terms):
        return reverse(a) / squared
    if n_vectors(a.blades) > SMALL_DIMENSION:
        return _inverse_of_floats(a, squared) if are_floats(a.terms.values()) else _inverse_by_recursion(a)
    (first, *others), norm = conjugate_factors(a, clifford_conjugate)
    if not norm.terms:
        raise ZeroDivisorError("inverse", f"the determinant of {a} is zero", "an invertible element")
    if not others:
        return first / norm
    reciprocal = divide(1, norm.scalar)
    rest = others[0] if len(others) == 1 else others[0] * others[1]
    return first * rest.map(lambda value: value * reciprocal)


def determinant(a: Multivector) -> Multivector:
    """Return the determinant of `a`, a scalar that is zero exactly if `a` has no inverse.

    It is, up to sign, the determinant of a matrix representation of the algebra (Shirokov 2021). Its degree in the
    coefficients is ``2**ceil(n/2)``, where `n` is the dimension of the algebra, for every set of blades of `a`.
    """
    if a.algebra.dimension <= SMALL_DIMENSION:
        return conjugate_factors(a, clifford_conjugate, complete=True)[1]
    return -_adjugate(a, a.algebra.dimension)[1].grade(0)


SMALL_DIMENSION = 5
"""The largest number of basis vectors for which an inverse is computed as a product of conjugates.

See Hitzer & Sangwine, *Appl. Math. Comput.* 311, 2017.
"""


def n_vectors(blades: Iterable[int]) -> int:
    """Return the number of basis vectors that occur in the given blades."""
    union = 0
    for blade in blades:
        union |= blade
    return union.bit_count()


def conjugate_factors(a: T, conjugate: Callable[[T], T], complete: bool = False) -> tuple[list[T], T]:
    """Return factors whose product with `a` is a scalar, and that scalar, for up to five basis vectors.

    For up to four vectors, ``a`` times its Clifford conjugate has only the grades 0, 3 and 4, and that product times
    itself with the grades 3 and 4 negated is a scalar. For five vectors, ``a ~a`` has only the grades 0, 1, 4 and 5,
    and that product times itself with the grades 1 and 4 negated has only the grades 0 and 5. The result is a number
    ``x + y I`` with the central pseudoscalar ``I``, whose product with ``x - y I`` is a scalar.

    Parameters
    ----------
    a : Multivector or Expression
    conjugate : callable
        The Clifford conjugation for the type of `a`.
    complete : bool
        Whether to perform all steps for the dimension of the algebra; by default, steps that the blades of `a` do not
        need are omitted.
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


def _inverse_of_floats(a: Multivector, squared: Multivector) -> Multivector:
    """Return an inverse in floating point, where ``a ~a`` of a versor is a scalar up to rounding errors only."""
    if squared.scalar:
        found: Multivector = reverse(a) / squared.scalar
        size = sum(abs(x) ** 2 for x in a.terms.values()) / abs(squared.scalar)
        # A coefficient of the product has the rounding errors of as many terms as `a` has.
        if _residual(a, found) <= _EPS * len(a.terms) * size:
            return found
    even = not any(blade.bit_count() & 1 for blade in a.terms)
    blades = [blade for blade in range(1 << a.algebra.dimension) if not (even and blade.bit_count() & 1)]
    columns = [a * Multivector(a.algebra, {blade: 1}) for blade in blades]
    rows = [[column.terms.get(blade, 0) for column in columns] for blade in blades]
    real = not any(isinstance(x, complex) for x in a.terms.values())
    terms = zip(blades, (x.real if real else x for x in solved(rows, [1, *[0] * (len(blades) - 1)])), strict=True)
    found = Multivector(a.algebra, {blade: x for blade, x in terms if x})
    if not _residual(a, found) <= math.sqrt(_EPS):
        raise ZeroDivisorError("inverse", f"the determinant of {a} is zero up to rounding", "an invertible element")
    return found


def _residual(a: Multivector, b: Multivector) -> float:
    return float(sum(abs(x) for x in (a * b - 1).terms.values()))


def _inverse_by_recursion(a: Multivector) -> Multivector:
    adjugate, power = _adjugate(a, n_vectors(a.blades))
    if 0 not in power.terms:
        raise ZeroDivisorError("inverse", f"the determinant of {a} is zero", "an invertible element")
    return adjugate / power.grade(0)


def _adjugate(a: Multivector, n: int) -> tuple[Multivector, Multivector]:
    """Return the adjugate of `a` up to sign, and its product with `a`, the negative determinant for `n` vectors."""
    size = 2 ** ((n + 1) // 2)
    power = adjugate = a
    for k in range(1, size):
        adjugate = power - divide(scale(power.scalar, size), k)
        power = a * adjugate
    return adjugate, power
