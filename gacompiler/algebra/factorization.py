"""Factorization of blades and versors, join and meet, the delta product, and the split of bivectors.

The results are exact for exact coefficients (integers, fractions), in any metric. With floats or mpmath numbers,
coefficients below a tolerance, relative to the largest, count as zero. Join, meet and the factors of a blade do not
depend on the metric, because they are properties of subspaces. For arrays of many blades, see `algorithms.subspaces`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any

from ..errors import AlgebraError, ZeroDivisorError
from .blades import reordering_sign
from .coefficients import Coefficient, divide, is_zero, scalar_function
from .duality import regressive_product
from .multivector import Multivector
from .versors import inverse

TOLERANCE = 1e-9
"""The fraction of the largest coefficient below which inexact coefficients count as zero."""


@dataclass(frozen=True, slots=True)
class Factored:
    """A factorization into a number and vectors: an outer product for a blade, a geometric product for a versor."""

    scale: Coefficient
    vectors: tuple[Multivector, ...]


def spanning_vectors(blade: Multivector, tolerance: float = TOLERANCE) -> tuple[Multivector, ...]:
    """Return vectors that span a blade, computed without division in any commutative ring.

    The coordinates of the vectors are coefficients of the blade. With ``c`` the largest coefficient (the first, if
    coefficients cannot be compared), the vectors are ``c`` times those of `factorize_blade`, so their outer product is
    ``c**(k - 1)`` times the blade (Fontijne & Dorst 2010, the fast form).

    Raises
    ------
    AlgebraError
        If the element is zero, has mixed grades, or is not an outer product of vectors.
    """
    blade = significant(blade, tolerance)
    if not blade.terms:
        raise AlgebraError("factors of a blade", "zero", "a blade other than zero")
    if len(blade.grades) > 1:
        raise AlgebraError("factors of a blade", f"grades {blade.grades}", "a single grade", "take one with grade(k)")
    k = blade.grades[0]
    if k == 0:
        return ()
    pivot = _pivot(blade)
    vectors = tuple(_coordinates(blade, pivot, 1 << i) for i in _bits(pivot))
    product = blade.lift(1)
    for vector in vectors:
        product = product ^ vector
    power = _power(blade.terms[pivot], k - 1)
    expected = blade.map(lambda value: value * power)
    if significant(product - expected, tolerance, like=expected).terms:
        raise AlgebraError(
            "factors of a blade",
            f"an element of grade {k} that is not an outer product of vectors",
            "a blade",
            "split a bivector with split_bivector(), or test with classify()",
        )
    return vectors


def factorize_blade(blade: Multivector, tolerance: float = TOLERANCE) -> Factored:
    """Factorize a blade into a number and an outer product of vectors.

    The vectors are in reduced form: their coordinates on the vectors of the basis blade with the largest coefficient
    form the identity matrix, and that coefficient is the number. The vectors depend only on the subspace.

    Parameters
    ----------
    blade : Multivector
        An element of one grade, over a field.
    tolerance : float
        Relative tolerance for coefficients that are not exact.

    Returns
    -------
    Factored

    Raises
    ------
    AlgebraError
        If the element is zero or not a blade.
    """
    vectors = spanning_vectors(blade, tolerance)
    if not vectors:
        return Factored(blade.scalar, ())
    scale = blade.terms[_pivot(blade)]
    return Factored(scale, tuple(vector.map(lambda value: divide(value, scale)) for vector in vectors))


def join_and_meet(a: Multivector, b: Multivector, tolerance: float = TOLERANCE) -> tuple[Multivector, Multivector]:
    """Return the join of two blades, the smallest blade that contains both, and the meet, the largest in both.

    The metric is not used. The largest coefficient of the meet is 1. The join is ``a ^ c`` with ``b = meet ^ c``, so it
    scales with `a` and `b`; it does not depend on the choice of ``c``.

    Raises
    ------
    AlgebraError
        If one of them is zero or not a blade, or their algebras differ.
    """
    b = significant(a.lift(b), tolerance)
    a = significant(a, tolerance)
    spanning_vectors(a, tolerance)
    whole = a
    for vector in factorize_blade(b, tolerance).vectors:
        larger = whole ^ vector
        if significant(larger, tolerance, like=whole).terms:
            whole = larger
    outside = a.algebra.everything ^ _pivot(whole)
    meet = significant(regressive_product(a, b ^ Multivector(a.algebra, {outside: 1})), tolerance)
    pivot = _pivot(meet)
    largest = meet.terms[pivot]
    meet = meet.map(lambda value: divide(value, largest))
    rest = Multivector(
        b.algebra,
        {
            blade ^ pivot: value if reordering_sign(pivot, blade ^ pivot) > 0 else -value
            for blade, value in b.terms.items()
            if blade & pivot == pivot
        },
    )
    return a ^ rest, meet


def join(a: Multivector, b: Multivector, tolerance: float = TOLERANCE) -> Multivector:
    """Return the smallest blade that contains two blades; see `join_and_meet`."""
    return join_and_meet(a, b, tolerance)[0]


def meet(a: Multivector, b: Multivector, tolerance: float = TOLERANCE) -> Multivector:
    """Return the largest blade that is contained in two blades; see `join_and_meet`."""
    return join_and_meet(a, b, tolerance)[1]


def delta_product(a: Multivector, b: Multivector, tolerance: float = TOLERANCE) -> Multivector:
    """Return the delta product, the part of highest grade of ``a b``, or zero if the product is zero.

    In a definite metric it is the symmetric difference of two blades: its grade is the grade of the join minus that of
    the meet (Dorst, Fontijne & Mann 2007, ch. 21). This does not hold if shared directions are null; use
    `join_and_meet` in that case.
    """
    other = a.lift(b)
    product = significant(a * other, tolerance, like=_bound(a, other))
    return product.grade(product.grades[-1]) if product.terms else product


def factorize_versor(versor: Multivector, tolerance: float = TOLERANCE) -> Factored:
    """Factorize a versor into a number and a product of invertible vectors.

    The part of highest grade of a versor is the blade of the directions that it changes. Dividing the versor by a
    vector of this blade that is not null lowers the grade by one (Dorst, Fontijne & Mann 2007, ch. 21). If all vectors
    of the blade are null, as for ``1 + n m`` with a null plane, one more reflection is inserted first; this is Scherk's
    exception to the Cartan-Dieudonné theorem. The number of vectors is the grade of the blade, plus two in the
    exception.

    Parameters
    ----------
    versor : Multivector
        An element over the rationals, the reals or the complex numbers, in any metric, including degenerate ones.
    tolerance : float
        Relative tolerance for coefficients that are not exact.

    Returns
    -------
    Factored

    Raises
    ------
    AlgebraError
        If the element is not a product of invertible vectors.
    """
    versor = significant(versor, tolerance)
    if not versor.terms or len({k & 1 for k in versor.grades}) != 1:
        raise _not_versor(f"grades {versor.grades}" if versor.terms else "zero")
    rest, vectors = versor, ()  # type: tuple[Multivector, tuple[Multivector, ...]]
    while rest.grades[-1] > 0:
        step = _next_factor(rest, tolerance) or _next_two_factors(rest, tolerance)
        if step is None:
            raise _not_versor("a part of highest grade that is not divisible by a vector")
        rest, found = step
        vectors = (*found, *vectors)
    product = rest
    for vector in vectors:
        product = product * vector
    if significant(product - versor, tolerance, like=versor).terms:
        raise _not_versor("an element that differs from the product of its vectors")
    return Factored(rest.scalar, vectors)


def split_bivector(bivector: Multivector, tolerance: float = TOLERANCE) -> tuple[Multivector, ...]:
    """Split a bivector into a sum of at most two commuting simple bivectors, as in up to five dimensions.

    With ``W = (B ^ B) / 2``, the squares of the parts are the solutions of ``x**2 - <B B> x + W W = 0``, and a part is
    ``(x + W) / B`` (Roelfs & De Keninck, *Graded symmetry groups*, 2021).

    Raises
    ------
    AlgebraError
        If the element is not a bivector, if ``B ^ B ^ B`` is not zero, if both parts have the same square, so that the
        split is not unique, or if there is no real split.
    InexactError
        If the coefficients are exact and the squares of the parts are not rational.
    """
    bivector = significant(bivector, tolerance)
    if bivector.grades not in ((), (2,)):
        raise AlgebraError("split_bivector", f"grades {bivector.grades}", "grade 2")
    double = significant(bivector ^ bivector, tolerance, like=_bound(bivector, bivector))
    if not double.terms:
        return (bivector,) if bivector.terms else ()
    if significant(double ^ bivector, tolerance, like=_bound(double, bivector)).terms:
        raise AlgebraError(
            "split_bivector",
            "a bivector of three parts or more",
            "B ^ B ^ B = 0",
            "use algorithms.subspaces.split_bivectors, for numeric coefficients",
        )
    quartic = double.map(lambda value: divide(value, 2))
    square, product = (bivector * bivector).scalar, (quartic * quartic).scalar
    under = square * square - 4 * product
    size = max(_size(square * square), _size(product), key=_comparable)
    if _vanishes(under, size, tolerance):
        raise AlgebraError(
            "split_bivector", "two parts with the same square", "different squares, for which the split is unique"
        )
    if not isinstance(under, complex) and under < 0:
        raise AlgebraError("split_bivector", "parts with complex squares", "a bivector that has a real split")
    root = scalar_function("sqrt", under)
    larger = divide(square - root if square < 0 else square + root, 2)
    try:
        first = ((quartic + larger) * inverse(bivector)).grade(2)
    except ZeroDivisorError:
        raise AlgebraError("split_bivector", "a bivector of two parts without an inverse", "an inverse") from None
    return first, bivector - first


def significant(a: Multivector, tolerance: float, like: Multivector | None = None) -> Multivector:
    """Return `a` without the coefficients that are negligible relative to the largest of `like` (by default, `a`)."""
    sizes = [_size(value) for value in (like or a).terms.values()]
    largest = max(sizes, default=0, key=_comparable)
    return a.keep(lambda blade: not _vanishes(a.terms[blade], largest, tolerance))


def _next_factor(versor: Multivector, tolerance: float) -> tuple[Multivector, tuple[Multivector, ...]] | None:
    """Return a versor without its last factor, and that factor; None if all directions of the highest part are null."""
    top = versor.grades[-1]
    found = _best(_sums(_directions(versor, top, tolerance)), tolerance)
    if found is None:
        return None
    rest = _without(versor, found, tolerance)
    if not rest.terms or rest.grades[-1] != top - 1:
        raise _not_versor(f"grades {versor.grades}")
    return rest, (found,)


def _next_two_factors(versor: Multivector, tolerance: float) -> tuple[Multivector, tuple[Multivector, ...]] | None:
    """Return a versor without two factors, chosen so that the rest has directions that are not null (the exception)."""
    top = versor.grades[-1]
    for helper in _not_null(_sums(versor.algebra.basis()), tolerance):
        longer = significant(versor * helper, tolerance)
        if not longer.terms or longer.grades[-1] != top + 1:
            continue
        for vector in _not_null(_sums(_directions(longer, top + 1, tolerance)), tolerance):
            rest = _without(longer, vector, tolerance)
            if not rest.terms or rest.grades[-1] != top:
                continue
            if _best(_sums(_directions(rest, top, tolerance)), tolerance) is not None:
                return rest, (vector, inverse(helper))
    return None


def _directions(versor: Multivector, top: int, tolerance: float) -> tuple[Multivector, ...]:
    """Return vectors that span the part of highest grade, which is a blade for a versor."""
    try:
        return spanning_vectors(versor.grade(top), tolerance)
    except AlgebraError:
        raise _not_versor(f"a part of grade {top} that is not a blade") from None


def _without(versor: Multivector, vector: Multivector, tolerance: float) -> Multivector:
    return significant(versor * inverse(vector), tolerance)


def _sums(vectors: tuple[Multivector, ...]) -> Iterator[Multivector]:
    """Yield the vectors, and sums and differences of two. If all are null, the metric vanishes on their span."""
    yield from vectors
    for a, b in combinations(vectors, 2):
        yield a + b
        yield a - b


def _not_null(vectors: Iterator[Multivector], tolerance: float) -> Iterator[Multivector]:
    return (vector for vector in vectors if _steepness(vector, tolerance))


def _best(vectors: Iterator[Multivector], tolerance: float) -> Multivector | None:
    """Return the vector that is farthest from null, or None if all are null."""
    rated = [(_steepness(vector, tolerance), vector) for vector in vectors]
    steepest, vector = max(rated, key=lambda pair: _comparable(pair[0]))
    return vector if steepest else None


def _steepness(vector: Multivector, tolerance: float) -> Any:
    """Return the square of a vector relative to the sum of the squares of its coefficients; 0 for a null vector."""
    square = (vector * vector).scalar
    size = sum(_size(value) ** 2 for value in vector.terms.values())
    return 0 if not size or _vanishes(square, size, tolerance) else _size(square) / size


def _not_versor(found: str) -> AlgebraError:
    return AlgebraError(
        "factors of a versor", found, "a product of invertible vectors", "test the element with classify()"
    )


def _pivot(blade: Multivector) -> int:
    """Return the basis blade of the largest coefficient, the first one if several are equal."""
    return max(blade.terms, key=lambda bitmap: (_comparable(_size(blade.terms[bitmap])), -bitmap))


def _coordinates(blade: Multivector, pivot: int, vector: int) -> Multivector:
    """Return the vector of the blade's subspace with only `vector` of the pivot, times the largest coefficient.

    Its coordinates are coefficients of the blades in which that vector is replaced by another.
    """
    rest = pivot ^ vector
    sign = reordering_sign(vector, rest)
    terms = {}
    for blade_, value in blade.terms.items():
        if blade_ & rest == rest:
            other = blade_ ^ rest
            terms[other] = value if reordering_sign(other, rest) == sign else -value
    return Multivector(blade.algebra, terms)


def _bits(blade: int) -> list[int]:
    return [i for i in range(blade.bit_length()) if blade >> i & 1]


def _power(value: Coefficient, exponent: int) -> Coefficient:
    result: Coefficient = 1
    for _ in range(exponent):
        result = result * value
    return result


def _bound(a: Multivector, b: Multivector) -> Multivector:
    """Return the product of the largest coefficients of `a` and `b` as a scalar, a scale for those of their product."""
    one, two = (max((_size(v) for v in x.terms.values()), default=0, key=_comparable) for x in (a, b))
    return a.lift(one * two)


def _size(value: Coefficient) -> Any:
    """Return the absolute value of a number; for an element of another ring, 0 if it is zero by form, else 1."""
    try:
        return abs(value)
    except TypeError:
        return 0 if is_zero(value) else 1


def _comparable(size: Any) -> Any:
    """Return a value that `max` can compare; symbols have no order, so their size is 1."""
    return size if isinstance(size, (int, Fraction, float)) or type(size).__module__.startswith("mpmath") else 1


def _vanishes(value: Coefficient, size: Any, tolerance: float) -> bool:
    if isinstance(value, (int, Fraction)) or not _is_inexact(value):
        return is_zero(value) or bool(value == 0)
    return bool(abs(value) <= tolerance * size)


def _is_inexact(value: Coefficient) -> bool:
    return isinstance(value, (float, complex)) or type(value).__module__.startswith(("mpmath", "numpy"))


__all__ = [
    "Factored",
    "delta_product",
    "factorize_blade",
    "factorize_versor",
    "join",
    "join_and_meet",
    "meet",
    "significant",
    "spanning_vectors",
    "split_bivector",
]
