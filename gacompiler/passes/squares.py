"""Computation of one coefficient of a vector with a known square from the other coefficients.

A conformal point is null, and remains null when it is moved. For weight 1, its ``einf`` coefficient is half the sum of
the squares of the others, which is much cheaper than the expression that results from the sandwich product.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from ..algebra.algebra import Algebra
from ..algebra.blades import Rational
from ..algebra.layout import Layout
from ..algebra.operations import Operation
from ..frontend.expression import Expression
from ..frontend.facts import is_unit, is_vector
from ..rings.polynomial import Polynomial, PolynomialRing
from .sandwich_differences import sandwich_of_difference

_KEEPS_SQUARE = (Operation.REVERSE, Operation.GRADE_INVOLUTION, Operation.CLIFFORD_CONJUGATE, Operation.NEGATE)


def square_of(expression: Expression) -> Rational | None:
    """Return the constant value of ``x x`` if it can be derived by rules, else None.

    For a unit `m`, ``(m x ~m) (m x ~m) = m x x ~m``, so a sandwich preserves the square. So do the involutions.
    """
    operation, arguments = expression.operation, expression.arguments
    if operation is Operation.INPUT and expression.data.layout.implied:
        return _square_in_layout(expression.data.layout)
    if operation is Operation.CONSTANT:
        return _number((expression.data * expression.data).terms)
    if is_unit(expression) and is_vector(expression):
        return 1
    if operation in _KEEPS_SQUARE:
        return square_of(arguments[0])
    if operation is Operation.SANDWICH and is_unit(arguments[0]):
        return square_of(arguments[1])
    sandwich = sandwich_of_difference(expression)
    return None if sandwich is None else square_of(sandwich)


@cache
def _square_in_layout(layout: Layout) -> Rational | None:
    """Return the square of the elements of a layout if it does not depend on their stored coefficients, else None."""
    ring = PolynomialRing()
    element = layout.element([ring.variable(name) for name in layout.blades])
    values = {blade: ring.lift(value).constant_value for blade, value in (element * element).terms.items()}
    return None if None in values.values() else _number(values)


def _number(terms: Mapping[int, Rational | None]) -> Rational | None:
    return terms.get(0, 0) if not any(value for blade, value in terms.items() if blade) else None


def solvable(algebra: Algebra, coefficients: Mapping[int, Polynomial]) -> int | None:
    """Return the blade whose coefficient can be computed from the square of a vector, or None.

    The basis vector of this blade is null, and its inner product is nonzero with exactly one other basis vector, whose
    coefficient in the vector must be constant. The longest coefficient is chosen if there are several.
    """
    occurring = {blade: value for blade, value in coefficients.items() if not value.is_zero}
    if any(blade.bit_count() != 1 for blade in occurring):
        return None
    found = [
        blade
        for blade, value in occurring.items()
        if value.degree > 1 and (partner := _partner(algebra, blade)) and _is_number(occurring.get(partner))
    ]
    return max(found, key=lambda blade: (len(occurring[blade].terms), -blade), default=None)


def _is_number(value: Polynomial | None) -> bool:
    return value is not None and value.constant_value is not None


def _partner(algebra: Algebra, blade: int) -> int | None:
    """Return the only basis vector whose inner product with the null vector `blade` is nonzero, or None."""
    seen = [k for k, value in enumerate(algebra.gram[blade.bit_length() - 1]) if value]
    return 1 << seen[0] if len(seen) == 1 and 1 << seen[0] != blade else None


def solve(algebra: Algebra, blade: int, others: Mapping[int, Polynomial], square: Rational) -> Polynomial:
    """Return the coefficient of `blade` in a vector of the given square, from the other coefficients."""
    partner = _partner(algebra, blade)
    assert partner is not None
    ring = others[partner].ring
    rest = ring.constant(square)
    places = [(b.bit_length() - 1, value) for b, value in others.items() if b.bit_count() == 1 and b != blade]
    for i, x in places:
        for j, y in places:
            if algebra.gram[i][j]:
                rest = rest - algebra.gram[i][j] * (x * y)
    inner = algebra.gram[blade.bit_length() - 1][partner.bit_length() - 1]
    return rest / (2 * inner * others[partner])
