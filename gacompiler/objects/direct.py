"""Constructors of single elements by one compiled call, for programs that create many.

A constructor converts its arguments, checks them, and applies several operations. After `OFTEN` calls with arguments of
the same types, the operations are compiled together, and calls take the coefficients of all arguments at once. If the
result is not finite, or the arguments are not clearly valid, the constructor runs as before and raises its errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ..algebra.algebra import Algebra
from ..algebra.catalog import CGA3, PGA3
from ..algebra.layout import SCALAR, Layout
from .definitions import Definition
from .spaces import define

OFTEN = 1000
"""Compiling takes as long as some thousand calls of a constructor."""
_CLEARLY = 1e-6
"""Axes and distances of points of this size relative to the largest coefficient are not 0 by rounding."""

Numbers = Sequence[float]


class Direct(NamedTuple):
    """A constructor for arguments of some layouts."""

    definition: Definition
    layouts: tuple[Layout, ...]
    is_valid: Callable[[Numbers], bool]
    """Whether the coefficients of all arguments are clearly valid."""


def _has_axis(numbers: Numbers) -> bool:
    """Whether the first three numbers are an axis of moderate length."""
    x, y, z, *_ = numbers
    return 1e-100 < abs(x) + abs(y) + abs(z) < 1e100


def _is_moderate(numbers: Numbers) -> bool:
    return sum(map(abs, numbers)) < 1e100


def _is_line(numbers: Numbers) -> bool:
    """Whether the first six numbers are a line of PGA3 that is not at infinity."""
    e12, e13, e23, e01, e02, e03, *_ = numbers
    along, size = abs(e12) + abs(e13) + abs(e23), abs(e01) + abs(e02) + abs(e03)
    screw = abs(e12 * e03 - e13 * e02 + e23 * e01)
    return 1e-100 < along < 1e100 and _CLEARLY * size < along and screw <= 1e-12 * along * max(along, size)


def _are_apart(numbers: Numbers) -> bool:
    a, b, c, x, y, z = numbers
    return abs(a - x) + abs(b - y) + abs(c - z) > _CLEARLY * max(map(abs, numbers))


def _has_radius(numbers: Numbers) -> bool:
    return numbers[-1] >= 0


_SCREW = "ga.exp(-angle / 2 * AXIS) * (1 + distance / 2 * (AXIS * {A}.multivector({'e0123': 1})))"
_THROUGH_ORIGIN = "ga.normalize({A}.multivector({'e123': 1}) & axis)"
_TRANSLATED = (
    "1 - (t['e032'] * {A}.multivector({'e01': 1}) + t['e013'] * {A}.multivector({'e02': 1})"
    " + t['e021'] * {A}.multivector({'e03': 1})) / 2"
)
_PLANE = " + ".join(f"{each[0]} * {{A}}.multivector({{'{each[1:]}': 1}})" for each in ("ae1", "be2", "ce3", "de0"))
_DIRECTION, _LINE = PGA3.DIRECTION, PGA3.LINE
_ABOUT_LINE, _ABOUT_AXIS = (_SCREW.replace("AXIS", axis) for axis in ("ga.normalize(axis)", _THROUGH_ORIGIN))


def _motor(layouts: tuple[Layout, ...], parameters: str, text: str) -> Direct:
    return Direct(define("motor", parameters, text, unit=True), layouts, _is_line if layouts[0] == _LINE else _has_axis)


_FORMS: dict[tuple[Algebra, str], list[Direct]] = {
    (PGA3, "motor"): [
        _motor((_LINE, SCALAR, SCALAR), "axis angle distance", _ABOUT_LINE),
        _motor((_DIRECTION, SCALAR, SCALAR), "axis angle distance", _ABOUT_AXIS),
        _motor(
            (_DIRECTION, SCALAR, _DIRECTION), "axis angle t",
            f"({_TRANSLATED}) * ga.exp(-angle / 2 * {_THROUGH_ORIGIN})",
        ),
    ],
    (PGA3, "rotor"): [
        _motor((_LINE, SCALAR), "axis angle", "ga.exp(-angle / 2 * ga.normalize(axis))"),
    ],
    (PGA3, "translator"): [Direct(define("translator", "t", _TRANSLATED, unit=True), (_DIRECTION,), _is_moderate)],
    (PGA3, "plane"): [Direct(define("plane", "a b c d", _PLANE), 4 * (SCALAR,), _has_axis)],
    (PGA3, "line"): [Direct(define("line", "p q", "p & q"), (PGA3.POINT, PGA3.POINT), _are_apart)],
    (CGA3, "sphere"): [
        Direct(
            define(
                "sphere", "centre radius",
                "(centre - radius * radius / 2 * {A}.multivector({'einf': 1})) * {A}.pseudoscalar",
            ),
            (CGA3.POINT, SCALAR), _has_radius,
        )
    ],
}  # fmt: skip


def form_of(algebra: Algebra, name: str, arguments: Sequence[Any]) -> Direct | None:
    """Return the form of a constructor for arguments: elements, numbers, and lists of coordinates."""
    for form in _FORMS.get((algebra, name), ()):
        if len(form.layouts) == len(arguments) and all(map(_fits, form.layouts, arguments)):
            return form
    return None


def _fits(layout: Layout, x: Any) -> bool:
    if type(x) in (list, tuple):
        return layout in (PGA3.POINT, PGA3.DIRECTION, CGA3.POINT) and len(x) == 3
    return layout is SCALAR if type(x) in (float, int) else getattr(x, "layout", None) == layout and x.shape == ()


def look_of(arguments: Sequence[Any]) -> tuple[Any, ...]:
    """Return what the choice of a form depends on."""
    return tuple([type(x) if type(x) not in (list, tuple) else len(x) for x in arguments])


def called(form: Direct, holder: Any, call: Any, arguments: Sequence[Any]) -> Any:
    """Return the element, or None if the constructor has to look at its arguments."""
    numbers: list[float] = []
    for x in arguments:
        kind = type(x)
        if kind is float or kind is int:
            numbers.append(x)
        else:
            numbers += x if kind is list or kind is tuple else x._numbers()
    try:
        if not form.is_valid(numbers):
            return None
        made = call(holder(*numbers))
    except (TypeError, OverflowError):  # other things than numbers
        return None
    return made if math.isfinite(sum(made._numbers())) else None
