"""Constructors of single elements by one compiled call, for programs that create many.

A constructor converts its arguments, checks them, and applies several operations. After `OFTEN` calls with arguments of
the same types, the operations are compiled together, and calls take the coefficients of all arguments at once. If the
result is not finite, or the arguments are not clearly valid, the constructor runs as before and raises its errors.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from operator import sub
from typing import Any, NamedTuple

from ..algebra.algebra import Algebra
from ..algebra.catalog import CGA2, CGA3, PGA2, PGA3, QUATERNIONS, VGA3
from ..algebra.layout import SCALAR, Layout
from ..errors import GacError
from .calls import packed
from .definitions import Definition
from .expressions import is_symbolic
from .layouts import layout_of
from .native import extension
from .operators import OBSERVERS, operator_of
from .spaces import define, in_algebra

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
    more: tuple[float, ...] = ()
    """Numbers for the last of the layouts, which are no arguments."""


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
    """Whether the numbers are the coordinates of two different points."""
    half = len(numbers) // 2
    return sum(map(abs, map(sub, numbers[:half], numbers[half:]))) > _CLEARLY * _size(numbers)


def _are_corners(numbers: Numbers) -> bool:
    """Whether the numbers are the coordinates of three points of a triangle."""
    d = len(numbers) // 3
    p, q, r = numbers[:d], numbers[d : 2 * d], numbers[2 * d :]
    a, b = [*map(sub, q, p)], [*map(sub, r, p)]
    area = sum(abs(a[i] * b[k] - a[k] * b[i]) for i, k in ((0, 1), (0, d - 1), (1, d - 1)))
    return area > _CLEARLY * _size(numbers) * max(*map(abs, a), *map(abs, b))


def _are_vertices(numbers: Numbers) -> bool:
    """Whether the numbers are the coordinates of four points of space that are no plane."""
    p, q, r, s = (numbers[k : k + 3] for k in (0, 3, 6, 9))
    a, b, c = [*map(sub, q, p)], [*map(sub, r, p)], [*map(sub, s, p)]
    volume = sum(a[i] * (b[j] * c[k] - b[k] * c[j]) for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)))
    return abs(volume) > _CLEARLY * _size(numbers) * _size([*a, *b, *c]) ** 2


def _is_conformal_line(numbers: Numbers) -> bool:
    """Whether the first six numbers are a line of CGA3 that is not at infinity."""
    e12, e13, e23, e1, e2, e3, *_ = numbers
    return _is_line((e3, e2, e1, e23, e13, e12))


def _has_direction(numbers: Numbers) -> bool:
    """Whether the second half of the numbers is a direction, in the scale of the first half, a point."""
    half = len(numbers) // 2
    return _CLEARLY * _size(numbers) < sum(map(abs, numbers[half:])) < 1e100


def _has_normal(numbers: Numbers) -> bool:
    """Whether the first of the numbers, all but the last, are a normal."""
    return 1e-100 < sum(map(abs, numbers[:-1])) < 1e100


def _has_normal_and_radius(numbers: Numbers) -> bool:
    return _has_axis(numbers[3:6]) and _has_radius(numbers)


def _has_radius(numbers: Numbers) -> bool:
    return numbers[-1] >= 0


def _size(numbers: Numbers) -> float:
    return max(map(abs, numbers))


_SCREW = "ga.exp(-angle / 2 * AXIS) * (1 + distance / 2 * (AXIS * {A}.multivector({'e0123': 1})))"
_THROUGH_ORIGIN = "ga.normalize({A}.multivector({'e123': 1}) & axis)"
_TRANSLATED = (
    "1 - (t['e032'] * {A}.multivector({'e01': 1}) + t['e013'] * {A}.multivector({'e02': 1})"
    " + t['e021'] * {A}.multivector({'e03': 1})) / 2"
)
_NORMAL = "ga.normalize(n['e032'] * {A}.e1 + n['e013'] * {A}.e2 + n['e021'] * {A}.e3)"
_TRANSLATED2 = "1 + (t['e01'] * {A}.e20 - t['e20'] * {A}.e01) / 2"
_SPHERE = "(centre - radius * radius / 2 * {A}.einf) * {A}.pseudoscalar"
_CIRCLE = (
    "((ga.normalize(n) + ga.scalar_product(ga.normalize(n), centre) * {A}.einf)"
    " ^ (centre - radius * radius / 2 * {A}.einf)) * {A}.pseudoscalar"
)
# A line times the pseudoscalar is the bivector that generates the rotations about it; its square is a number.
_ABOUT = "(line * {A}.pseudoscalar / ga.sqrt(ga.scalar_product(line, line)))"
ROTATE = define("rotor", "line angle", f"ga.cos(angle / 2) - ga.sin(angle / 2) * {_ABOUT}", unit=True)
SCREW = define(
    "motor", "line angle distance",
    f"(ga.cos(angle / 2) - ga.sin(angle / 2) * {_ABOUT})"
    f' * (1 + distance / 2 * ({_ABOUT} * {{A}}.multivector({{"e123inf": 1}})))',
    unit=True,
)  # fmt: skip
_TURNED3 = "ga.exp(-angle / 2 * ga.normalize(axis) * {A}.e123)"
_DIRECTION, _LINE = PGA3.DIRECTION, PGA3.LINE
_VECTOR2, _VECTOR3 = (layout_of(each, each.blades(1)[: each.dimension - 2]) for each in (CGA2, CGA3))
_P2, _P3, _C2, _C3 = (each.POINT for each in (PGA2, PGA3, CGA2, CGA3))
_ABOUT_LINE, _ABOUT_AXIS = (_SCREW.replace("AXIS", axis) for axis in ("ga.normalize(axis)", _THROUGH_ORIGIN))


def _motor(layouts: tuple[Layout, ...], parameters: str, text: str) -> Direct:
    return _versor("motor", layouts, parameters, text, _is_line if layouts[0] == _LINE else _has_axis)


def _versor(
    name: str, layouts: tuple[Layout, ...], parameters: str, text: str, valid: Callable[[Numbers], bool]
) -> Direct:
    return Direct(define(name, parameters, _with_blades(text), unit=True), layouts, valid)


def _blade(
    name: str, layouts: tuple[Layout, ...], parameters: str, text: str, valid: Callable[[Numbers], bool]
) -> Direct:
    return Direct(define(name, parameters, _with_blades(text)), layouts, valid)


def _with_blades(text: str) -> str:
    """Return a text with ``{A}.e12`` for basis blades, which algebras have not as attributes."""
    return re.sub(r"\{A\}\.(e\w+)", r"{A}.multivector({'\1': 1})", text)


def _flats(point: Layout, vector: Layout) -> dict[str, list[Direct]]:
    """Return the forms that the plane and space of conformal algebra have in common."""
    return {
        "translator": [_versor("translator", (vector,), "t", "1 - t * {A}.einf / 2", _is_moderate)],
        "line": [
            _blade("line", (point, point), "p q", "p ^ q ^ {A}.einf", _are_apart),
            _blade("line", (point, vector), "p d", "p ^ d ^ {A}.einf", _has_direction),
        ],
        "point_pair": [_blade("point_pair", (point, point), "p q", "p ^ q", _are_apart)],
        "circle": [_blade("circle", (point, point, point), "p q r", "p ^ q ^ r", _are_corners)],
    }


_COMMON2, _COMMON3 = _flats(_C2, _VECTOR2), _flats(_C3, _VECTOR3)
_FORMS: dict[tuple[Algebra, str], list[Direct]] = {
    (VGA3, "rotor"): [_versor("rotor", (VGA3.VECTOR, SCALAR), "axis angle", _TURNED3, _has_axis)],
    (QUATERNIONS, "rotation"): [
        _versor(
            "rotation", (QUATERNIONS.VECTOR, SCALAR), "axis angle", "ga.exp(angle / 2 * ga.normalize(axis))", _has_axis
        )
    ],
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
        # About an axis through the origin, too, the result is a motor.
        _motor((_DIRECTION, SCALAR, SCALAR), "axis angle distance", _ABOUT_AXIS)._replace(more=(0.0,)),
    ],
    (PGA3, "translator"): [_versor("translator", (_DIRECTION,), "t", _TRANSLATED, _is_moderate)],
    (PGA3, "plane"): [
        _blade("plane", 4 * (SCALAR,), "a b c d", "a * {A}.e1 + b * {A}.e2 + c * {A}.e3 + d * {A}.e0", _has_axis),
        _blade("plane", (_DIRECTION, SCALAR), "n distance", f"{_NORMAL} - distance * {{A}}.e0", _has_normal),
        _blade("plane", (_P3, _P3, _P3), "p q r", "p & q & r", _are_corners),
    ],
    (PGA3, "line"): [
        _blade("line", (_P3, _P3), "p q", "p & q", _are_apart),
        _blade("line", (_P3, _DIRECTION), "p d", "p & d", _has_direction),
    ],
    (PGA2, "line"): [
        _blade("line", (_P2, _P2), "p q", "p & q", _are_apart),
        _blade("line", (_P2, PGA2.DIRECTION), "p d", "p & d", _has_direction),
        _blade("line", 3 * (SCALAR,), "a b c", "a * {A}.e1 + b * {A}.e2 + c * {A}.e0", _has_normal),
    ],
    (PGA2, "translator"): [_versor("translator", (PGA2.DIRECTION,), "t", _TRANSLATED2, _is_moderate)],
    (PGA2, "rotor"): [
        _versor("rotor", (SCALAR, _P2), "angle centre", "ga.exp(-angle / 2 * centre)", _is_moderate),
        # About the origin, too, the result is a motor.
        _versor(
            "rotor", (SCALAR, SCALAR), "angle distance", "ga.exp(-angle / 2 * {A}.e12) * (1 + distance * {A}.e01)",
            _is_moderate,
        )._replace(more=(0.0,)),
    ],
    (PGA2, "motor"): [
        _versor(
            "motor", (SCALAR, PGA2.DIRECTION), "angle t", f"({_TRANSLATED2}) * ga.exp(-angle / 2 * {{A}}.e12)",
            _is_moderate,
        )
    ],
    **{(CGA2, name): forms for name, forms in _COMMON2.items()},
    **{(CGA3, name): forms for name, forms in _COMMON3.items()},
    (CGA2, "circle"): [*_COMMON2["circle"], _blade("circle", (_C2, SCALAR), "centre radius", _SPHERE, _has_radius)],
    (CGA2, "motor"): [
        _versor(
            "motor", (SCALAR, _VECTOR2), "angle t", "(1 - t * {A}.einf / 2) * ga.exp(-angle / 2 * {A}.e12)",
            _is_moderate,
        )
    ],
    (CGA3, "circle"): [
        *_COMMON3["circle"],
        _blade("circle", (_C3, _VECTOR3, SCALAR), "centre n radius", _CIRCLE, _has_normal_and_radius),
    ],
    (CGA3, "sphere"): [
        _blade("sphere", (_C3, SCALAR), "centre radius", _SPHERE, _has_radius),
        _blade("sphere", 4 * (_C3,), "p q r s", "p ^ q ^ r ^ s", _are_vertices),
    ],
    (CGA3, "plane"): [
        _blade(
            "plane", (_VECTOR3, SCALAR), "n distance",
            "-(ga.normalize(n) + distance * {A}.einf) * {A}.pseudoscalar", _has_normal,
        ),
        _blade("plane", (_C3, _C3, _C3), "p q r", "p ^ q ^ r ^ {A}.einf", _are_corners),
    ],
    (CGA3, "rotor"): [
        _versor("rotor", (_VECTOR3, SCALAR), "axis angle", _TURNED3, _has_axis),
        Direct(ROTATE, (CGA3.LINE, SCALAR), _is_conformal_line),
    ],
    (CGA3, "motor"): [
        Direct(SCREW, (CGA3.LINE, SCALAR, SCALAR), _is_conformal_line),
        _versor(
            "motor", (_VECTOR3, SCALAR, SCALAR), "axis angle distance",
            f"(1 - distance / 2 * (ga.normalize(axis) * {{A}}.einf)) * {_TURNED3}", _has_axis,
        ),
        _versor(
            "motor", (_VECTOR3, SCALAR, _VECTOR3), "axis angle t", f"(1 - t * {{A}}.einf / 2) * {_TURNED3}", _has_axis
        ),
    ],
}  # fmt: skip
_PLACES = (
    _P2, _P3, _C2, _C3, PGA2.DIRECTION, PGA3.DIRECTION, _VECTOR2, _VECTOR3, VGA3.VECTOR, QUATERNIONS.VECTOR
)  # fmt: skip
"""Layouts whose elements may be passed as lists of coordinates."""


def form_of(algebra: Algebra, name: str, arguments: Sequence[Any]) -> Direct | None:
    """Return the form of a constructor for arguments: elements, numbers, and lists of coordinates."""
    for form in _FORMS.get((algebra, name), ()):
        if len(form.layouts) - len(form.more) == len(arguments) and all(map(_fits, form.layouts, arguments)):
            return form
    return None


def _fits(layout: Layout, x: Any) -> bool:
    if type(x) in (list, tuple):
        return layout in _PLACES and len(x) == layout.size
    # The type of single elements has one layout, unlike that of arrays, and of elements made before the extension.
    return layout is SCALAR if type(x) in (float, int) else bool(getattr(type(x), "layout", None) == layout)


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
        made = call(holder(*numbers, *form.more))
    except (TypeError, ValueError, OverflowError, GacError):  # other things than numbers
        return None
    return made if math.isfinite(sum(made._numbers())) else None


_DIRECT: dict[tuple[Any, ...], Any] = {}
"""For arguments of the same types the number of calls, -1 if they are never compiled, or the compiled form."""


def quickly(space: Any, name: str, arguments: Sequence[Any]) -> Any:
    """Return the object by one compiled call if that is known; otherwise count the call, and return None."""
    look = type(space), name, *look_of(arguments)
    direct = None if OBSERVERS else _DIRECT.get(look, 0)
    if type(direct) is tuple:
        form, holder, call = direct
        return called(form, holder, call, arguments)
    if type(direct) is int and direct >= 0 and not is_symbolic(arguments):
        _count(space, look, name, arguments)
    return None


def _count(space: Any, look: tuple[Any, ...], name: str, arguments: Sequence[Any]) -> None:
    """Count calls with arguments of the same types, and compile the constructor for them if there are many."""
    count = _DIRECT[look] = _DIRECT.get(look, 0) + 1
    if count < OFTEN:
        return
    form = form_of(space.algebra, name, arguments)
    if form is None or extension() is None:
        _DIRECT[look] = -1
        return
    definition = in_algebra(form.definition, space.algebra)
    made = packed(definition, form.layouts, operator_of(definition, form.layouts))
    if made is not None:
        _DIRECT[look] = form, made.holder, made.call
