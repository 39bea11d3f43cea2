"""Factors of symbolic blades and versors, computed with polynomials in the symbols and one quotient at the end."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import sympy

from ..algebra.factorization import factorize_blade as exact_factors
from ..errors import AlgebraError
from ..rings.symbolic import Expanded
from .functions import factor_of
from .multivector import SymbolicMultivector, required, symbolic
from .predicates import is_blade, without
from .relations import reduce

Factors = tuple[Any, tuple[SymbolicMultivector, ...]]


def factorize_blade(a: SymbolicMultivector) -> Factors:
    """Return a scalar and vectors whose outer product, times the scalar, is the blade `a`.

    The scalar is the first coefficient, which must not vanish. Each vector has the coefficient 1 in one direction.

    Raises
    ------
    AlgebraError
        If the element is zero, has mixed grades, or is not an outer product of vectors.
    """
    found = exact_factors(required("factorize_blade()", a))
    return Expanded.of(found.scale).expression, tuple(map(symbolic, found.vectors))


def factorize_versor(a: SymbolicMultivector, *given: Any) -> Factors:
    """Return a scalar and vectors whose geometric product, times the scalar, is the versor `a`.

    Vectors of the part of highest grade, which is a blade, are divided out of the versor one after the other (Dorst,
    Fontijne & Mann 2007, ch. 21). If all of them are null, as for ``1 + n m`` with a null plane, one more reflection is
    inserted first. The result is valid wherever the denominator of the scalar is not 0.

    Parameters
    ----------
    a : SymbolicMultivector
    *given
        Relations, as for `reduce`: multivectors made by `symbols`, such as a unit motor, or expressions that vanish.

    Raises
    ------
    AlgebraError
        If the element is not proved to be a product of invertible vectors.

    Examples
    --------
    ``scale, (v, w) = factorize_versor(rotor, rotor)``
    """
    versor = rest = reduce(required("factorize_versor()", a), *given)
    if len({k & 1 for k in versor.grades}) != 1:
        raise _not_versor(f"grades {versor.grades}" if versor.terms else "zero")
    vectors: list[SymbolicMultivector] = []
    while rest.grades[-1] > 1:
        rest, found = _step(rest, given)
        vectors = [*found, *vectors]
    product, size = rest, Expanded.of(1)
    for vector in vectors:
        product = reduce(product * vector, *given)
        size = size * _square(vector, given)
    if reduce(product - versor * size.expression, *given).terms:
        raise _not_versor("an element that differs from the product of its vectors")
    if rest.grades == (0,):
        return sympy.cancel(rest.scalar / size.expression), tuple(vectors)
    if not _square(rest, given):
        raise _not_versor("a null vector")
    number, first = factor_of(rest)
    return sympy.cancel(number / size.expression), (first, *vectors)


def _step(versor: SymbolicMultivector, given: tuple[Any, ...]) -> tuple[SymbolicMultivector, list[SymbolicMultivector]]:
    """Return the versor times one or two vectors, which lower its grade, and these vectors in reverse order."""
    top = versor.grades[-1]
    for vector in _directions(versor, given):
        return _times(versor, vector, top - 1, given), [vector]
    for helper in map(symbolic, versor.algebra.basis()):
        longer = reduce(versor * helper, *given)
        if not _square(helper, given) or longer.grades[-1] != top + 1:
            continue
        for vector in _directions(longer, given):
            rest = _times(longer, vector, top, given)
            if next(_directions(rest, given), None) is not None:
                return rest, [vector, helper]
    raise _not_versor("a part of highest grade in which all vectors are null")


def _directions(versor: SymbolicMultivector, given: tuple[Any, ...]) -> Iterator[SymbolicMultivector]:
    """Yield vectors of the part of highest grade whose squares do not vanish, those of fewest coefficients first."""
    top = versor.grade(versor.grades[-1])
    if not is_blade(top, *given):
        raise _not_versor(f"a part of grade {top.grades[0]} that is not a blade")
    # Without the vectors of a basis blade of one grade less, the blade is a vector within it.
    vectors = (without(blade, top) for blade in top.algebra.blades(top.grades[0] - 1))
    short = {vector: None for vector in (factor_of(each)[1] for each in vectors if each.terms)}
    for vector in sorted(short, key=lambda each: sum(len(value.terms) for value in each.terms.values())):
        if _square(vector, given):
            yield vector


def _square(vector: SymbolicMultivector, given: tuple[Any, ...]) -> Expanded:
    return Expanded.of(reduce(vector * vector, *given).scalar)


def _times(
    versor: SymbolicMultivector, vector: SymbolicMultivector, top: int, given: tuple[Any, ...]
) -> SymbolicMultivector:
    found = reduce(versor * vector, *given)
    if not found.terms or found.grades[-1] > top:
        raise _not_versor("a part of highest grade that is not divisible by a vector")
    return found


def _not_versor(found: str) -> AlgebraError:
    return AlgebraError(
        "factors of a versor", found, "a product of invertible vectors", "pass relations such as those of a unit motor"
    )
