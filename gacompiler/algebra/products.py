"""Every bilinear product as one rule: which grades of the geometric product it keeps.

For operands of grade ``p`` and ``q`` the geometric product has parts of grade ``r``; a product is the predicate
``(p, q, r)`` that selects them (Dorst, Fontijne & Mann 2007, §19.4; Hestenes & Sobczyk 1984, §1-1). The metric enters
only through the geometric product of basis blades.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from .blades import grade, outer
from .coefficients import Coefficient, is_zero, scale

if TYPE_CHECKING:
    from .algebra import Algebra

Terms = Mapping[int, Coefficient]

GRADE_RULES: Mapping[str, Callable[[int, int, int], bool]] = {
    "geometric_product": lambda p, q, r: True,
    "outer_product": lambda p, q, r: r == p + q,
    "left_contraction": lambda p, q, r: r == q - p,
    "right_contraction": lambda p, q, r: r == p - q,
    "inner_product": lambda p, q, r: r == abs(p - q),
    "hestenes_product": lambda p, q, r: r == abs(p - q) and p != 0 and q != 0,
    "scalar_product": lambda p, q, r: r == 0,
}


def product(algebra: Algebra, name: str, a: Terms, b: Terms) -> dict[int, Coefficient]:
    """The terms of the product `name` of two sums of basis blades, without coefficients that are zero by form."""
    rule = GRADE_RULES[name]
    only_disjoint = name == "outer_product"
    result: dict[int, Coefficient] = {}
    for left, x in a.items():
        p = grade(left)
        for right, y in b.items():
            if only_disjoint:
                sign = outer(left, right)
                targets: Mapping[int, object] = {left | right: sign} if sign else {}
            else:
                targets = algebra.blade_product(left, right)
            if not targets:
                continue
            q = grade(right)
            xy = None
            for blade, factor in targets.items():
                if rule(p, q, grade(blade)):
                    if xy is None:
                        xy = x * y
                    term = scale(xy, factor)  # type: ignore[arg-type]
                    result[blade] = result[blade] + term if blade in result else term
    return {blade: result[blade] for blade in sorted(result) if not is_zero(result[blade])}
