"""Determinants of inner products, by which products of blades are expanded instead of contracting coefficients.

The inner product of outer products of vectors is the determinant of the inner products of the vectors, their *Gram
matrix*. It takes few operations if the vectors are null, such as conformal points: the matrix then has a zero diagonal,
and its other elements are squared distances.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from itertools import combinations

from ..algebra.algebra import Algebra
from ..algebra.blades import Rational, exact
from ..algebra.operations import Operation
from ..frontend.expression import Expression, lift, node
from ..frontend.facts import has_grade
from .squares import square_of

Row = Sequence[Expression | None]
"""Elements of a matrix; None is zero."""

Binary = Callable[[Expression, Expression], Expression]
Pairing = Callable[[Expression, Expression], Expression | None]

LARGEST = 4
"""Determinants of more rows have more products than the coefficients of blades."""
FROM_LEFT = (Operation.LEFT_CONTRACTION, Operation.INNER_PRODUCT, Operation.HESTENES_PRODUCT)
FROM_RIGHT = (Operation.RIGHT_CONTRACTION, Operation.INNER_PRODUCT, Operation.HESTENES_PRODUCT)
OF_SCALARS = (Operation.NORM_SQUARED, Operation.SCALAR_PRODUCT, Operation.RIGHT_CONTRACTION, *FROM_LEFT)
"""Products that may be scalars for two factors of one grade."""
SIGNS: Mapping[Operation, Callable[[int], int]] = {
    Operation.NEGATE: lambda grade: -1,
    Operation.REVERSE: lambda grade: (-1) ** (grade * (grade - 1) // 2),
    Operation.GRADE_INVOLUTION: lambda grade: (-1) ** grade,
    Operation.CLIFFORD_CONJUGATE: lambda grade: (-1) ** (grade * (grade + 1) // 2),
}
"""Signs of the involutions by grade."""


@dataclass(frozen=True, slots=True)
class Blade:
    """An outer product of vectors, or a regressive product of pseudovectors, times a scalar.

    Attributes
    ----------
    factors : tuple of Expression
    scale : Expression, optional
        The scalar; None is 1.
    """

    factors: tuple[Expression, ...]
    scale: Expression | None = None

    def scaled(self, value: Expression) -> Expression:
        """Return the product of `value` and the scale."""
        return value if self.scale is None else self.scale * value


def blade_of(expression: Expression) -> Blade | None:
    """Return the outer product of at most `LARGEST` vectors that an expression is, or None.

    Scalar factors, negations and involutions are parts of the scale.
    """
    return _blade(expression, Operation.OUTER_PRODUCT, 1)


def meet_of(expression: Expression, largest: int = 2) -> Blade | None:
    """Return the regressive product of at most `largest` pseudovectors that an expression is, or None.

    The weights of pseudovectors are arbitrary, so subtracting them does not keep the digits of determinants of three.
    """
    found = _blade(expression, Operation.REGRESSIVE_PRODUCT, expression.algebra.dimension - 1)
    return None if found is None or len(found.factors) > largest else found


def _blade(expression: Expression, product: Operation, grade: int) -> Blade | None:
    factors: list[Expression] = []
    scale: Expression | None = None
    stack = [expression]
    while stack:
        each = stack.pop()
        if has_grade(each, grade):
            if len(factors) == LARGEST:
                return None
            factors.append(each)
        elif each.operation is product and not any(argument.is_scalar for argument in each.arguments):
            stack += reversed(each.arguments)
        elif (split := split_scale(each)) is not None:
            value, rest = split
            scale = value if scale is None else scale * value
            stack.append(rest)
        else:
            return None
    return Blade(tuple(factors), scale)


def chain_of(product: Expression, largest: int = LARGEST) -> tuple[Expression, ...] | None:
    """Return the factors of a geometric product of at most `largest` vectors, or None."""
    factors: list[Expression] = []
    stack = [product]
    while stack:
        each = stack.pop()
        if has_grade(each, 1):
            if len(factors) == largest:
                return None
            factors.append(each.arguments[0] if each.operation is Operation.REVERSE else each)
        elif each.operation is Operation.GEOMETRIC_PRODUCT:
            stack += reversed(each.arguments)
        elif each.operation is Operation.REVERSE and each.arguments[0].operation is Operation.GEOMETRIC_PRODUCT:
            stack += map(operator.invert, each.arguments[0].arguments)
        else:
            return None
    return tuple(factors)


def split_scale(expression: Expression) -> tuple[Expression, Expression] | None:
    """Return a scalar factor and the rest of a product, or None. Involutions of one grade are products with a sign."""
    operation, arguments = expression.operation, expression.arguments
    if operation in (Operation.GEOMETRIC_PRODUCT, Operation.OUTER_PRODUCT):
        a, b = arguments
        if a.is_scalar and not b.is_scalar:
            return a, b
        return (b, a) if b.is_scalar and not a.is_scalar else None
    if operation is Operation.DIVIDE:
        return 1 / arguments[1], arguments[0]
    if operation not in SIGNS or expression.algebra.conjugates:
        return None
    grades = {blade.bit_count() for blade in expression.blades}
    return (lift(SIGNS[operation](grades.pop())), arguments[0]) if len(grades) == 1 else None


def in_differences(vectors: Sequence[Expression]) -> tuple[Expression, ...] | None:
    """Subtract one of some vectors from the others, which does not change their outer product.

    The determinant of nearly equal vectors loses accuracy, that of one of them and of differences does not. Vectors
    with implied coefficients are not subtracted: squared distances of null vectors are differences already. Return None
    if some vector is a sum, so that differences are not subtracted again, or if none remains. The dual of an input is a
    vector like an input.
    """
    return _subtracted(vectors, lambda given: not given.data.layout.implied)


def in_all_differences(vectors: Sequence[Expression]) -> tuple[Expression, ...] | None:
    """Subtract one of some vectors from the others as `in_differences`, also those with implied coefficients."""
    return _subtracted(vectors, lambda given: True)


def _subtracted(vectors: Sequence[Expression], wanted: Callable[[Expression], bool]) -> tuple[Expression, ...] | None:
    places = []
    for k, each in enumerate(vectors):
        given = _input_of(each)
        if given is None:
            return None
        if wanted(given):
            places.append(k)
    if len(places) < 2:
        return None
    first, *others = places
    return tuple(each - vectors[first] if k in others else each for k, each in enumerate(vectors))


def _input_of(vector: Expression) -> Expression | None:
    if vector.operation in (Operation.DUAL, Operation.UNDUAL, Operation.POLARITY):
        vector = vector.arguments[0]
    return vector if vector.operation is Operation.INPUT else None


def scale_of_meets(algebra: Algebra, factors: int) -> Rational | None:
    """Return the ratio of ``<A B>`` to the determinant of ``<a b>`` for regressive products of pseudovectors.

    Pseudovectors are ``v I`` with vectors `v`, and their regressive product is the outer product of the vectors times
    `I`, but for a sign. The product ``I ~I`` occurs once in ``<A ~B>``, and in the determinant of ``<a ~b>`` once for
    each factor. Return None if it is zero.
    """
    n = algebra.dimension
    square = algebra.blade_product(algebra.everything, algebra.everything).get(0, 0)
    if not square:
        return None
    reverse = SIGNS[Operation.REVERSE]
    sign = reverse(n - 1) ** factors * reverse(n - factors)
    return exact(sign * Fraction(reverse(n) * square) ** (1 - factors))


def squared(vectors: Sequence[Expression]) -> Expression | None:
    """Return the determinant of the scalar products, the squared norm of an outer product; None is zero."""
    rows: list[list[Expression | None]] = [[None] * len(vectors) for _ in vectors]
    for i, a in enumerate(vectors):
        for j, b in enumerate(vectors[: i + 1]):
            rows[i][j] = rows[j][i] = inner(a, b)
    return _hollow(rows) if all(rows[k][k] is None for k in range(len(rows))) else _determinant(rows)


def contracted(
    left: Sequence[Expression], right: Sequence[Expression], pairing: Pairing | None = None, join: Binary = operator.xor
) -> Expression | None:
    """Return the left contraction of an outer product on a second one with as many factors or more; None is zero.

    It is the sum over the choices of factors of the second one, each replaced by a determinant (Laplace's expansion).
    A contraction with one vector is a derivation, whose terms for three and more factors share outer products:
    ``v . (A ^ b) = (v . A) ^ b + (-1)**k (v . b) A`` with `A` of grade `k`.

    Parameters
    ----------
    left, right : sequence of Expression
    pairing : callable, optional
        The product of a factor of each; `inner` by default.
    join : callable, optional
        The product of the other factors.
    """
    total: Expression | None = None
    if len(left) == 1 and len(right) > 2:
        first, value = contracted(left, right[:-1], pairing, join), determinant(left, right[-1:], pairing)
        total = None if first is None else join(first, right[-1])
        if value is not None:
            total = added(total, reduce(join, right[1:-1], value * right[0]), (-1) ** (len(right) - 1))
        return total
    for chosen, rest, sign in _choices(len(right), len(left)):
        value = determinant(left[::-1], [right[k] for k in chosen], pairing)
        if value is not None:
            total = added(total, value * reduce(join, [right[k] for k in rest]) if rest else value, sign)
    return total


def determinant(
    left: Sequence[Expression], right: Sequence[Expression], pairing: Pairing | None = None
) -> Expression | None:
    """Return the determinant of the products of two lists of factors, by default scalar products; None is zero."""
    product = pairing or inner
    return _determinant([[product(a, b) for b in right] for a in left])


def outer(factors: Sequence[Expression]) -> Expression:
    """Return the outer product of some factors."""
    return reduce(lambda a, b: a ^ b, factors)


def _choices(n: int, k: int) -> Iterator[tuple[tuple[int, ...], tuple[int, ...], int]]:
    """Yield the choices of `k` of `n` places, the other places, and the sign of the permutation of both together."""
    for chosen in combinations(range(n), k):
        rest = tuple(place for place in range(n) if place not in chosen)
        yield chosen, rest, (-1) ** (sum(chosen) - k * (k - 1) // 2)


def inner(a: Expression, b: Expression) -> Expression | None:
    """Return the inner product of two vectors. Both orders give the same expression."""
    square = square_of(a) if a == b else None
    if square is not None:
        return lift(square) if square else None
    return node(Operation.SCALAR_PRODUCT, *sorted((a, b), key=str))


def _determinant(rows: Sequence[Row]) -> Expression | None:
    """Return a determinant by minors of the last columns, each of which is computed once."""
    n = len(rows)
    minors: dict[tuple[int, ...], Expression | None] = {(): lift(1)}
    for column in reversed(range(n)):
        last, minors = minors, {}
        for chosen in combinations(range(n), n - column):
            total: Expression | None = None
            for k, i in enumerate(chosen):
                element, minor = rows[i][column], last[chosen[:k] + chosen[k + 1 :]]
                if element is not None and minor is not None:
                    total = added(total, element if column == n - 1 else element * minor, (-1) ** k)
            minors[chosen] = total
    return minors[tuple(range(n))]


def _hollow(rows: Sequence[Row]) -> Expression | None:
    """Return the determinant of a symmetric matrix whose diagonal is zero.

    For three rows it is twice the product of the elements. For four rows it is ``(p + q - r)**2 - 4 p q`` with the
    three products of opposite elements, which is Ptolemy's theorem if the elements are squared distances.
    """
    elements = [rows[i][j] for i, j in combinations(range(len(rows)), 2)]
    if any(each is None for each in elements) or len(rows) not in (3, 4):
        return _determinant(rows)
    first, *others = (each for each in elements if each is not None)
    if len(rows) == 3:
        return 2 * first * others[0] * others[1]
    p, q, r = first * others[4], others[0] * others[3], others[1] * others[2]
    rest = p + q - r
    return rest * rest - 4 * p * q


def added(total: Expression | None, term: Expression, sign: int) -> Expression:
    """Return the sum of a total and of a term with a sign; None is zero."""
    if total is None:
        return term if sign > 0 else -term
    return total + term if sign > 0 else total - term
