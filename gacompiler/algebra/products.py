"""The bilinear products, defined by their rows in the table of operations: by the grades they select, or a bracket.

For operands of grades ``p`` and ``q`` the geometric product has parts of grades ``r``; a product is defined by the
predicate of ``(p, q, r)`` that selects its parts. The metric enters only through the geometric product of basis blades.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from math import lcm
from operator import itemgetter, mul
from typing import Protocol

from .blades import Rational, bits, grade, outer
from .blades import Terms as BladeTerms
from .coefficients import Coefficient, divide, is_zero, scale
from .operations import BY_NAME, Operation

Terms = Mapping[int, Coefficient]

MANY = 4
"""Products of at least this number of pairs of rational coefficients are computed with a common denominator."""

Row = dict[int, tuple[tuple[int, Rational], ...]]

_FEW = 32
"""The number of terms up to which all pairs of terms are visited."""
_DENSE = 64
"""Products of integers with at least this number of pairs are sums at places that are found once."""
_PLANS = 32
"""Number of lists of such places that are kept. A list of the largest products takes a megabyte."""


class BladeAlgebra(Protocol):
    """The interface of `Algebra` that products use."""

    def __hash__(self) -> int: ...

    def blade_product(self, a: int, b: int) -> BladeTerms:
        """Return the geometric product of two basis blades."""

    def partners(self, blade: int) -> int:
        """Return the bitmap of the basis vectors that are not orthogonal to every vector of a basis blade."""

    def product_row(self, name: str, left: int) -> Row:
        """Return the cached products `name` of one basis blade with others; `product` adds to the cache."""


def product(algebra: BladeAlgebra, name: str, a: Terms, b: Terms) -> dict[int, Coefficient]:
    """Return the terms of the product `name` of two sums of basis blades, without zeros (by form)."""
    if len(a) * len(b) >= MANY and (whole := _common_denominators(a, b)) is not None:
        numerators, others, denominator = whole
        terms = product(algebra, name, numerators, others)
        return {blade: divide(value, denominator) for blade, value in terms.items()}
    if len(a) * len(b) >= _DENSE and {*map(type, a.values()), *map(type, b.values())} == {int}:
        plan = _plan(algebra, name, tuple(a), tuple(b))
        if plan is not None:
            return _sums(plan, list(a.values()), list(b.values()))
    result: dict[int, Coefficient] = {}
    rights = tuple(b.items())
    near = _near(algebra, name, b) if len(rights) > _FEW else None
    for left, x in a.items():
        row = algebra.product_row(name, left)
        for right, y in rights if near is None else near(left):
            targets = row.get(right)
            if targets is None:
                targets = row[right] = kept(algebra, name, left, right)
            if not targets:
                continue
            xy = x * y
            for blade, factor in targets:
                term = xy if factor == 1 else -xy if factor == -1 else scale(xy, factor)
                result[blade] = result[blade] + term if blade in result else term
    return {blade: result[blade] for blade in sorted(result) if not is_zero(result[blade])}


Chosen = Callable[[Sequence[int]], tuple[int, ...]]
"""Returns the coefficients at certain places of a list."""
Plan = tuple[tuple[int, Chosen, Chosen], ...]


@lru_cache(_PLANS)
def _plan(algebra: BladeAlgebra, name: str, lefts: tuple[int, ...], rights: tuple[int, ...]) -> Plan | None:
    """Return the places of both factors of the terms of each blade, or None if terms have factors other than 1 and -1.

    The places in the right operand are those in a list of its coefficients, of these with the other sign, and of zero.
    """
    places: dict[int, tuple[list[int], list[int]]] = {}
    for i, left in enumerate(lefts):
        row = algebra.product_row(name, left)
        for j, right in enumerate(rights):
            targets = row.get(right)
            if targets is None:
                targets = row[right] = kept(algebra, name, left, right)
            for blade, factor in targets:
                if abs(factor) != 1:
                    return None
                first, second = places.setdefault(blade, ([0], [-1]))
                first.append(i)
                second.append(j if factor == 1 else len(rights) + j)
    return tuple((blade, itemgetter(*first), itemgetter(*second)) for blade, (first, second) in sorted(places.items()))


def _sums(plan: Plan, a: Sequence[int], b: Sequence[int]) -> dict[int, Coefficient]:
    signed = [*b, *(-value for value in b), 0]
    sums = ((blade, sum(map(mul, first(a), second(signed)))) for blade, first, second in plan)
    return {blade: value for blade, value in sums if value}


def _near(algebra: BladeAlgebra, name: str, b: Terms) -> Callable[[int], Sequence[tuple[int, Coefficient]]] | None:
    """Return the function that selects, for a left blade, the terms with which the product can be different from zero.

    The geometric product of blades of mutually orthogonal vectors is their outer product. None is returned for products
    that keep it, and for brackets.
    """
    keeps = BY_NAME[name].row.grades
    if keeps is None or BY_NAME[name] is Operation.OUTER_PRODUCT:
        return None
    terms, grades = tuple(b.items()), frozenset(map(grade, b))
    places: dict[int, list[int]] = {}
    for k, blade in enumerate(b):
        for vector in bits(blade):
            places.setdefault(vector, []).append(k)

    def near(left: int) -> Sequence[tuple[int, Coefficient]]:
        p = grade(left)
        if any(keeps(p, q, p + q) for q in grades):
            return terms
        found = {k for vector in bits(algebra.partners(left)) for k in places.get(vector, ())}
        return [terms[k] for k in sorted(found)]

    return near


def _common_denominators(a: Terms, b: Terms) -> tuple[Terms, Terms, int] | None:
    """Return integers in place of rational coefficients, and the common denominator of their products.

    Sums of integers are several times faster than sums of fractions. None is returned for other coefficients, and for
    integers.
    """
    kinds = {*map(type, a.values()), *map(type, b.values())}
    if Fraction not in kinds or not kinds <= {int, Fraction}:
        return None
    x, y = lcm(*(value.denominator for value in a.values())), lcm(*(value.denominator for value in b.values()))
    first = {blade: value.numerator * (x // value.denominator) for blade, value in a.items()}
    second = {blade: value.numerator * (y // value.denominator) for blade, value in b.items()}
    return first, second, x * y


def kept(algebra: BladeAlgebra, name: str, left: int, right: int) -> tuple[tuple[int, Rational], ...]:
    """Return the terms of the geometric product of two basis blades that the product `name` keeps."""
    operation = BY_NAME[name]
    if operation is Operation.OUTER_PRODUCT:
        sign = outer(left, right)
        return ((left | right, sign),) if sign else ()
    bracket, keeps = operation.row.bracket, operation.row.grades
    if bracket:
        # For basis blades that commute or anticommute, a bracket is the whole product or zero.
        there, back = algebra.blade_product(left, right), algebra.blade_product(right, left)
        sums = {blade: there.get(blade, 0) + bracket * back.get(blade, 0) for blade in sorted({*there, *back})}
        return tuple((blade, divide(value, 2)) for blade, value in sums.items() if value)
    if operation is Operation.GEOMETRIC_PRODUCT:
        return tuple(algebra.blade_product(left, right).items())
    if keeps is None:
        raise KeyError(f"{name} does not select parts of the geometric product")
    p, q = grade(left), grade(right)
    return tuple((blade, f) for blade, f in algebra.blade_product(left, right).items() if keeps(p, q, grade(blade)))
