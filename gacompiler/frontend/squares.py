"""The form of the square of an element, determined from its blades: the cases of exponentials and logarithms.

If ``b b = s + q`` with a scalar ``s`` and a part ``q`` of other grades whose square is a scalar ``Q``, every power
series in ``b`` is ``F(s + q) + G(s + q) b``, and functions of ``s + q`` are functions of two numbers. This holds for
every bivector over up to five basis vectors, in every metric. For elements of anticommuting blades (vectors,
quaternions), ``q`` is zero.

The bivector is then a sum of two commuting simple bivectors, ``b = b1 + b2`` with ``b1 b1 = x1``, ``b2 b2 = x2``,
``s = x1 + x2``, ``q = 2 b1 b2`` and ``Q = 4 x1 x2``. The signs of the numbers ``x`` determine whether circular or
hyperbolic functions occur, and follow from the metric.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.multivector import Multivector
from ..algebra.signs import Signs, inertia
from .expression import Expression

Value = Any
"""A scalar: a number or a scalar expression."""


@dataclass(frozen=True, slots=True)
class Form:
    """The properties of the squares of elements with given blades.

    Attributes
    ----------
    s : Signs
        Signs of the scalar part of the square.
    rest : frozenset of int
        Grades of the other part, ``q``.
    q : Signs
        Signs of the square ``Q`` of that part.
    first, second : Signs
        Signs of the larger and of the smaller of the two numbers ``x``.
    vanishing : bool
        Whether the square of a part of the element can vanish although the part does not.
    nilpotent : bool
        Whether ``q`` can be large although ``s`` and ``Q`` are tiny, for example pure rounding errors.
    axis : int, optional
        The blade whose squared coefficient is ``s`` or ``-s``, or None.
    shifts : bool
        Whether some blades do not contribute to ``s``, like the translations of a screw motion.
    null : bool
        Whether ``s`` can vanish although the element does not.
    """

    s: Signs
    rest: frozenset[int]
    q: Signs
    first: Signs
    second: Signs
    vanishing: bool
    nilpotent: bool
    axis: int | None
    shifts: bool
    null: bool

    @property
    def isoclinic(self) -> bool:
        """Whether the two numbers ``x`` can be equal and not 0: two rotations by the same angle."""
        return self.q.positive


def blades_of(a: Any) -> frozenset[int]:
    """Return the bitmaps of the blades that `a` can have, an expression, a multivector or a numeric object."""
    found: frozenset[int] = a.blades if isinstance(a, (Expression, Multivector)) else a.layout.support
    return found


def grades_of(blades: Iterable[int]) -> frozenset[int]:
    """Return the grades of the given blades."""
    return frozenset(blade.bit_count() for blade in blades)


@cache
def form_of(algebra: Algebra, blades: frozenset[int]) -> Form | None:
    """Return the form of the squares of elements with these blades; None if two numbers do not describe them."""
    rest = _square_blades(algebra, blades) - {0}
    if _square_blades(algebra, rest) - {0}:
        return None
    (s, s_has_null), (q, has_null) = _signs(algebra, blades), _signs(algebra, rest)
    vectors = [k for k in range(algebra.dimension) if any(blade >> k & 1 for blade in blades)]
    positive, negative, null = inertia([[algebra.gram[i][j] for j in vectors] for i in vectors])
    first, second = _two_numbers(s, q, bool(rest), min(positive, negative))
    taking_part = [b for b in blades if any(algebra.blade_product(a, b).get(0) for a in blades)]
    return Form(
        s=s,
        rest=grades_of(rest),
        q=q,
        first=first,
        second=second,
        vanishing=s.both or (bool(rest) and min(positive, negative) > 0),
        nilpotent=bool(rest) and (min(positive, negative) + null > 1 if q.zero else q.both or has_null),
        axis=_axis(algebra, taking_part),
        shifts=len(taking_part) < len(blades),
        null=s.both or s_has_null,
    )


def _axis(algebra: Algebra, taking_part: Sequence[int]) -> int | None:
    """Return the only blade that contributes to the scalar part of the square, if its square is 1 or -1; else None."""
    if len(taking_part) != 1 or abs(algebra.blade_product(taking_part[0], taking_part[0])[0]) != 1:
        return None
    return taking_part[0]


def _two_numbers(s: Signs, q: Signs, is_sum: bool, opposite: int) -> tuple[Signs, Signs]:
    """Return the signs of the larger and the smaller ``x``, from ``x1 + x2 = s`` and ``4 x1 x2 = Q``."""
    if not is_sum or q.zero:
        return s, Signs(False, False)
    if not q.positive:
        return Signs(False, True), Signs(True, False)
    if not q.negative and not s.positive:
        return Signs(True, False), Signs(True, False)
    if opposite <= 1:  # of two orthogonal planes only one can have vectors with squares of both signs
        return Signs(True, True), Signs(True, False)
    return Signs(True, True), Signs(True, True)


def _square_blades(algebra: Algebra, blades: Iterable[int]) -> frozenset[int]:
    """Return the blades that squares can have; products of anticommuting blades cancel."""
    chosen = sorted(blades)
    found: set[int] = set()
    for a in chosen:
        for b in chosen:
            if b <= a:
                there, back = algebra.blade_product(a, b), algebra.blade_product(b, a)
                found |= {c for c in {*there, *back} if there.get(c, 0) + back.get(c, 0)}
    return frozenset(found)


def _signs(algebra: Algebra, blades: Iterable[int]) -> tuple[Signs, bool]:
    """Return the signs of the scalar part of squares, a quadratic form, and whether the form is degenerate."""
    chosen = sorted(blades)
    products = [[Fraction(algebra.blade_product(a, b).get(0, 0)) for b in chosen] for a in chosen]
    positive, negative, null = inertia(products)
    return Signs(negative > 0, positive > 0), null > 0
