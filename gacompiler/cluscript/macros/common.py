"""Shared helpers of the tables of macros."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

from ...algebra.algebra import Algebra
from ...algebra.layout import SCALARS
from ...algebra.multivector import Multivector
from ...frontend.expression import Expression
from ...frontend.operations import hestenes_product, outer_product
from ..values import sqrt

Function = Callable[..., Any]
Table = dict[tuple[str, int], Function]

HALF = Fraction(1, 2)


def basis(algebra: Algebra) -> dict[str, Multivector]:
    """Return the basis vectors by name."""
    return dict(zip(algebra.vectors, algebra.basis(), strict=True))


def wedge(*factors: Any) -> Any:
    """Return the outer product of all arguments."""
    result = factors[0]
    for factor in factors[1:]:
        result = outer_product(result, factor)
    return result


def dot(a: Any, b: Any) -> Any:
    """Return ``a . b`` as defined in scripts: zero if one factor is a scalar."""
    return hestenes_product(a, b)


def total(*terms: Any) -> Any:
    """Return the sum of all arguments."""
    result = terms[0]
    for term in terms[1:]:
        result = result + term
    return result


def length(*components: Any) -> Any:
    """Return the root of the sum of squares."""
    return sqrt(total(*(component * component for component in components)))


def combination(vectors: list[Multivector], components: tuple[Any, ...]) -> Any:
    """Return the sum of vectors times components."""
    return total(*(component * vector for component, vector in zip(components, vectors, strict=True)))


def part(x: Any, name: str) -> Any:
    """Return the coefficient of a blade other than 1, of a multivector or a number."""
    return x[name] if isinstance(x, (Expression, Multivector)) and x.algebra != SCALARS else Fraction(0)


def times(factor: Any) -> Function:
    """Return the macro that multiplies its argument by `factor` from the right: a dual."""
    return lambda x: x * factor
