"""Kinds of geometric objects, and elements of other algebras as coefficients of conformal space.

Computations run on coefficients of `generated.cga3`. Elements of projective space and of the plane, which is embedded
as z = 0, are converted to them, and results return to the algebra of the arguments where it can represent them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from generated import cga2, cga3, pga2, pga3
from generated.gac_runtime.arrays import element_of, entries_of
from generated.gac_runtime.layout import Layout, converted

from ..arguments import Reals, real_array

LAYOUTS = {
    "point": cga3.POINT,
    "point pair": cga3.POINT_PAIR,
    "line": cga3.LINE,
    "circle": cga3.CIRCLE,
    "plane": cga3.PLANE,
    "sphere": cga3.SPHERE,
}
"""The layout of each kind."""
KINDS = {kind: len(layout.blades) for kind, layout in LAYOUTS.items()}
"""Kinds of objects, in the order used in tables, and the number of coefficients of each."""


Kind: TypeAlias = Literal["point", "point pair", "line", "circle", "plane", "sphere"]
"""The keys of `KINDS`, for annotations."""


class Form(NamedTuple):
    """A layout of another algebra for a kind, with its conversions."""

    kind: str
    layout: Layout
    embed: Callable[[Reals], Reals]
    """Takes coefficients of the layout, and returns those of the kind."""
    restore: Callable[[Reals], Reals] | None = None
    """The inverse; None if results have another layout."""


def _same(x: Reals) -> Reals:
    return x


def _with_zero(x: Reals) -> Reals:
    return np.concatenate([x, np.zeros_like(x[..., :1])], -1)


def _in_plane(x: Reals) -> Reals:
    return x[..., :2]


def _by_blades(kind: str, layout: Layout) -> Form:
    """Return the form for a layout of the conformal plane, whose blades have the same names in space."""
    wide = LAYOUTS[kind].blades
    places = [wide.index(blade) for blade in layout.blades]

    def embed(x: Reals) -> Reals:
        found = np.zeros((*x.shape[:-1], len(wide)), x.dtype)
        found[..., places] = x
        return found

    return Form(kind, layout, embed, lambda x: x[..., places])


def _line_of_plane(line: Reals) -> Reals:
    """Return the line ``a x + b y + c = 0`` in space; its direction is (b, -a)."""
    a, b, c = np.moveaxis(line, -1, 0)
    zero = np.zeros_like(a)
    direction = np.stack([b, -a, zero], -1)
    moment = np.stack([zero, zero, c], -1)  # p x d for p = -c (a, b) / (a a + b b)
    return np.asarray(cga3.line_from_direction_moment(direction, moment))


def _line_in_plane(line: Reals) -> Reals:
    direction, moment = cga3.line_to_direction_moment(line)
    return np.stack([-direction[..., 1], direction[..., 0], moment[..., 2]], -1)


def _projective_line(line: Reals) -> Reals:
    return np.asarray(pga3.line_from_direction_moment(*cga3.line_to_direction_moment(line)))


def _conformal_line(line: Reals) -> Reals:
    return np.asarray(cga3.line_from_direction_moment(*pga3.line_to_direction_moment(line)))


def _conformal_plane(plane: Reals) -> Reals:
    return np.asarray(cga3.plane_from_normal(plane[..., :3], -plane[..., 3]))


def _projective_plane(plane: Reals) -> Reals:
    return np.asarray(pga3.plane_from_normal(*cga3.plane_to_normal(plane)))


_FORMS = [
    Form("point", cga3.POINT, _same, _same),
    Form("point", cga3.FLAT_POINT, cga3.point_from_flat_point),
    Form("line", cga3.DUAL_LINE, cga3.line_from_dual),
    Form("point pair", cga3.POINT_PAIR, _same, _same),
    Form("line", cga3.LINE, _same, _same),
    Form("plane", cga3.PLANE, _same, _same),
    Form("plane", cga3.DUAL_PLANE, cga3.plane_from_dual),
    Form("circle", cga3.CIRCLE, _same, _same),
    Form("sphere", cga3.SPHERE, _same, _same),
    Form("point", pga3.POINT, _same, _same),
    Form("point", pga3.TRIVECTOR, pga3.point_from_trivector),
    Form("line", pga3.LINE, _conformal_line, _projective_line),
    Form("plane", pga3.PLANE, _conformal_plane, _projective_plane),
    Form("point", cga2.POINT, _with_zero, _in_plane),
    Form("point", cga2.FLAT_POINT, lambda x: _with_zero(cga2.point_from_flat_point(x))),
    _by_blades("point pair", cga2.POINT_PAIR),
    _by_blades("line", cga2.LINE),
    _by_blades("circle", cga2.CIRCLE),
    Form("point", pga2.POINT, _with_zero, _in_plane),
    Form("point", pga2.BIVECTOR, lambda x: _with_zero(pga2.point_from_bivector(x))),
    Form("line", pga2.LINE, _line_of_plane, _line_in_plane),
]
"""The first form to which an element of its algebra can be converted exactly is its kind: special ones come first."""
_EXACT = {cga3.DUAL_LINE.identity, cga3.DUAL_PLANE.identity}
"""Layouts that have to be those of the element: their blades are also blades of other kinds."""


class Given(NamedTuple):
    """An argument: its kind, its coefficients in conformal space, and the element that was passed, if it was one."""

    kind: str
    values: Reals
    element: Any = None

    def returned(self, kind: str, values: Reals) -> Any:
        """Return a result as an element, of the algebra of this argument if possible; as an array for arrays."""
        if self.element is None:
            return values
        algebra = self.element.stored[1].algebra
        for form in _FORMS:
            if (form.kind, form.layout.algebra) == (kind, algebra) and form.restore is not None:
                return self.element.like(form.layout, form.restore(values))
        return self.element.like(LAYOUTS[kind], values)


def given(where: str, arguments: tuple[Any, ...], names: tuple[str, ...]) -> list[Given]:
    """Return the arguments of a function: elements, or the name of a kind before each of them.

    Raises
    ------
    TypeError
        If the number of arguments is wrong, an array is passed without its kind, or an element has another kind.
    ValueError
        If a kind is unknown, or a shape is wrong.
    """
    if len(arguments) == len(names):
        return [_element(name, value) for name, value in zip(names, arguments, strict=True)]
    if len(arguments) != 2 * len(names):
        listed = ", ".join(names)
        raise TypeError(
            f"{where}: {len(arguments)} arguments; expected the elements {listed}, or the name of its kind before each"
        )
    triples = zip(arguments[::2], arguments[1::2], names, strict=True)
    return [named(kind, value, name) for kind, value, name in triples]


def named(kind: Any, value: Any, name: str) -> Given:
    """Return an argument of a known kind: an element or an array of coefficients."""
    if not isinstance(kind, str) or kind not in KINDS:
        raise ValueError(f"{name}: kind {kind!r}; expected {listed(list(KINDS))}")
    element = element_of(value)
    if element is not None:
        found = _element(name, value)
        if found.kind != kind:
            raise TypeError(f"{name} is a {found.kind}, {element.stored[1].name}; expected a {kind}")
        return found
    return Given(kind, real_array(value, name, (KINDS[kind],), f"a {kind}"))


def _element(name: str, value: Any) -> Given:
    """Return an element, or a list of elements of one kind as an array of them."""
    value, is_list = entries_of(value)
    if is_list:
        parts = [_element(f"{name}[{k}]", each) for k, each in enumerate(value)]
        kinds = list(dict.fromkeys(part.kind for part in parts))
        if len(kinds) > 1:
            raise TypeError(f"{name} is a list of {' and '.join(kinds)}; expected one kind")
        if len({part.values.shape for part in parts}) > 1:
            raise ValueError(f"{name} is a list of elements of different shapes; expected one shape")
        return Given(kinds[0], np.stack([part.values for part in parts]), parts[0].element)
    stored = getattr(value, "stored", None)
    if stored is None:
        raise TypeError(
            f"{name} is {type(value).__name__}, which does not say what it is; expected an element, such as a point of "
            f"PGA3, or its kind before it: {listed(list(KINDS))}"
        )
    values, own = stored
    for form in _FORMS:
        if form.layout.algebra != own.algebra or (
            form.layout.identity in _EXACT and form.layout.identity != own.identity
        ):
            continue
        try:
            coefficients = converted(name, values, own, form.layout)
        except TypeError:
            continue
        if form.layout.blades[0] in ("e123", "e12") and form.kind == "point" and not np.all(coefficients[..., 0]):
            raise TypeError(f"{name} is a {own.name} at infinity, a direction; expected a point")
        return Given(form.kind, form.embed(coefficients), value)
    known = ", ".join(form.layout.name for form in _FORMS)
    raise TypeError(f"{name} is {own.name}; expected one of {known}")


def listed(kinds: list[str]) -> str:
    """Return names as in a sentence: ``a, b or c``."""
    return ", ".join(kinds[:-1]) + f" or {kinds[-1]}" if len(kinds) > 1 else kinds[0]
