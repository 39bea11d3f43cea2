"""Constructors of multivectors for any algebra, from coefficients by the names of blades and layouts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar, overload

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.immutable import Immutable
from ..algebra.layout import Layout
from ..algebra.multivector import Multivector
from ..errors import AlgebraError, LayoutError
from ..frontend.expression import Expression
from ..gac_runtime.annotations import Numbers, Stored
from ..gac_runtime.arrays import element_of, plain, refuse_mask
from .arrays import MultivectorArray, of_rows, single_type, wrap
from .caches import cached_by_name
from .calls import apply
from .checks import check_relations, refuse
from .definitions import Definition
from .expressions import assembled, by_blade, is_symbolic
from .expressions import unit as symbolic_unit
from .layouts import layout_from_plain, layout_of, plain_layout

if TYPE_CHECKING:
    from .names import AnySpace

M = TypeVar("M", bound=MultivectorArray)
"""The elements of a space, whose coefficients have the names of its blades."""
Argument: TypeAlias = Numbers | Multivector | Expression | M
"""An argument of a constructor: coordinates or numbers, an exact element, elements, or an expression in a kernel."""


class Space(Immutable, Generic[M]):
    """An algebra with constructors of multivectors.

    Basis blades in any spelling (``space.e12``) and the layouts of the algebra (``space.MOTOR``) are attributes, so
    that a space can be used instead of its algebra in declarations of kernels.

    Parameters
    ----------
    algebra : Algebra or int
        The algebra, or the numbers `p`, `q` and `r` of basis vectors with the squares 1, -1 and 0, as for `Algebra`.

    Examples
    --------
    >>> from gacompiler import Algebra
    >>> G = Space(Algebra("G", "a b", [1, -1]))
    >>> G.vector(1, 2) * G.a
    G.even(1 - 2 ab)
    """

    if TYPE_CHECKING:
        # The spaces of the catalog have attributes with the names of their blades and layouts, others have any.
        algebra: Algebra

        def __new__(cls, algebra: Algebra | int, q: int = 0, r: int = 0) -> AnySpace: ...

    else:

        def __init__(self, algebra: Algebra | int, q: int = 0, r: int = 0) -> None:
            self.algebra = Algebra(algebra, q, r) if isinstance(algebra, int) else algebra
            if not isinstance(self.algebra, Algebra):
                expected = "an algebra, or the numbers of squares 1, -1 and 0"
                raise AlgebraError("Space()", f"{algebra!r}", expected, "as in Space(3, 0, 1)")
            if self.algebra.has_symbolic_metric:
                raise AlgebraError(
                    "Space()", f"{self.algebra.name}, whose metric has symbols", "an algebra with numbers as metric",
                    "use gacompiler.symbolic.multivector(algebra, {...})",
                )  # fmt: skip

        def __getattr__(self, name: str) -> Any:
            if name.startswith("_") or name == "algebra":
                raise AttributeError(name)
            known = _ATTRIBUTES.get((id(self.algebra), name))
            if known is not None:
                return known[0]
            try:
                sign, blade = self.algebra.blade(name)
            except AlgebraError:
                found = getattr(self.algebra, name)
                is_final = isinstance(found, Layout)
            else:
                layout = layout_of(self.algebra, {blade})
                found = of_rows(layout, np.array([float(sign * layout.stored[0].sign)]))
                is_final = single_type(layout) is not None  # otherwise it is an array until the extension exists
            if is_final:
                _ATTRIBUTES[id(self.algebra), name] = found, self.algebra
            return found

    def __eq__(self, other: object) -> bool:
        """Whether two spaces have the same constructors in the same algebra."""
        return type(self) is type(other) and self.algebra == other.algebra

    def __hash__(self) -> int:
        return hash((type(self), self.algebra))

    def __repr__(self) -> str:
        return f"Space({self.algebra!r})"

    def __iter__(self) -> Iterator[Any]:
        raise AlgebraError(
            "a space", "it cannot be unpacked or iterated", "one name", "as in G = Cl(3), where G.e12 is a basis blade"
        )

    def __dir__(self) -> list[str]:
        return sorted({*object.__dir__(self), *self.algebra.layouts, *self.algebra.full.blades[1:]})

    @overload
    def of(self, layout: Stored | Sequence[Stored], /) -> M: ...
    @overload
    def of(self, layout: Layout, *coefficients: Argument[M] | Stored) -> M: ...
    def of(self, layout: Layout | Stored | Sequence[Stored], *coefficients: Argument[M] | Stored) -> M:
        """Create multivectors of a layout from its stored coefficients, or from multivectors of another layout.

        Parameters
        ----------
        layout : Layout or multivector
            A layout of this algebra, or only an element of it or a list of elements, such as values of a generated
            module: ``PGA3.of(x)``.
        *coefficients : array_like or multivector
            One array with the blades along its last axis, or an array for each blade; these broadcast. Multivectors
            are converted as by `MultivectorArray.as_layout`.

        Raises
        ------
        LayoutError
            If the number of coefficients is wrong, or a relation of the layout does not hold within 1e-9, for example
            if a motor is not of unit norm.
        """
        if not isinstance(layout, Layout):
            return self._of_element("of", layout, *coefficients)
        if layout.algebra is not self.algebra and layout.algebra != self.algebra:
            raise AlgebraError("of", f"the layout {layout}", f"one of {self.algebra.name}")
        single = single_of_numbers(layout, coefficients)
        if single is not None:
            return single
        if is_symbolic(coefficients):
            return assembled(layout, coefficients)
        if len(coefficients) == 1 and isinstance(coefficients[0], MultivectorArray):
            element: Any = coefficients[0]
            return element.as_layout(layout)
        own = plain_layout(layout) if len(coefficients) == 1 else None  # several are numbers
        given = tuple(plain(str(layout), each, own) for each in coefficients)
        values = stacked(str(layout), layout.blades, given)
        if layout.has_relations:
            check_relations(str(layout), layout, values)
        return of_rows(layout, values)

    def _element_in(self, where: str, x: Any) -> Any:
        """Return elements of this algebra as multivectors, and None for all that are no elements."""
        if isinstance(x, MultivectorArray) and (x.algebra is self.algebra or x.algebra == self.algebra):
            return x
        return None if element_of(x) is None else self._of_element(where, x)

    def _of_element(self, where: str, element: Any, *others: Any) -> M:
        """Return an element, or a list of them, as multivectors of this algebra, in the layout of the first one."""
        first = element_of(element)
        if first is None or others:
            found = f"{type(element).__name__} as first argument"
            remedy = "as in PGA3.of(PGA3.POINT, 1, 2, 3), or PGA3.of(x) for an element x"
            raise AlgebraError(where, found, "a layout, or only an element", remedy)
        layout = first.stored[1]
        own = layout_from_plain(layout, self.algebra)
        if own is None or own.algebra != self.algebra:
            raise AlgebraError(where, f"an element of {layout.name}", f"one of {self.algebra.name}")
        return self.of(own, element)

    def multivector(self, coefficients: Mapping[str, Numbers | complex]) -> M:
        """Create multivectors from numbers or arrays by blade, ``{"1": 2, "e12": [0, 1]}``; arrays broadcast."""
        if not isinstance(coefficients, Mapping):
            kind = type(coefficients).__name__
            raise LayoutError("multivector", f"coefficients of type {kind}", 'coefficients by blade, as in {"1": 2}')
        key = id(self.algebra), *coefficients
        given: Mapping[str, Any] = coefficients
        known = _BY_NAMES.get(key)
        if known is not None and _NUMBERS.issuperset(map(type, given.values())):
            found: M = known[0](*[sign * given[name] for name, sign in known[1]])
            return found
        if not coefficients:
            raise LayoutError("multivector", "no coefficients", 'coefficients by blade, as in {"1": 2}')
        blades = {name: self.algebra.blade(name) for name in coefficients}
        if is_symbolic(list(coefficients.values())):
            signed = {blade: given[name] * sign for name, (sign, blade) in blades.items()}
            return by_blade(self.algebra, signed)
        layout = layout_of(self.algebra, {blade for _, blade in blades.values()})
        if layout.size == len(blades) and not layout.is_scalar and (single := single_type(layout)) is not None:
            names = {blade: (name, sign) for name, (sign, blade) in blades.items()}
            signed_names = [(names[slot.blade][0], names[slot.blade][1] * slot.sign) for slot in layout.stored]
            _BY_NAMES[key] = single, signed_names, self.algebra
        parts: dict[int, Any] = {}
        for name, (sign, blade) in blades.items():
            parts[blade] = parts.get(blade, 0) + sign * numbers(f"coefficient of {name}", coefficients[name])
        values = _broadcast("multivector", [np.asarray(parts[slot.blade] * slot.sign) for slot in layout.stored])
        return of_rows(layout, values)

    def parse(self, text: str, layout: Layout | None = None) -> M:
        """Create multivectors from text: a sum of blades in any spelling, or printed multivectors.

        Parameters
        ----------
        text : str
            ``1 + 2*e12 - 0.5e01``, ``[e1, 2 e2]``, or any output of `str`, `repr` and `format`. The exponent of a
            number must have a sign, ``2e+12``; ``2e12`` is twice the blade ``e12``.
        layout : Layout, optional
            The layout of the result. By default the layout named in the output of `repr`, else one with the blades in
            the text.

        Returns
        -------
        MultivectorArray
            A number if the text has no blade. `str` and `repr` print six digits, ``f"{x:.17g}"`` prints all; unit
            elements with fewer digits are normalized.

        Raises
        ------
        AlgebraError, LayoutError
            If the text has none of these forms, or does not match the layout within 1e-5.

        Examples
        --------
        >>> from gacompiler.objects import PGA3
        >>> print(PGA3.parse("1 + 2*e21 - 0.5e01"))
        1 - 2 e12 - 0.5 e01
        """
        from .parsing import parse

        return parse(self.algebra, text, layout)

    def vector(self, *coordinates: Argument[M]) -> M:
        """Create vectors from one coordinate per basis vector, or an array with the coordinates along its last axis."""
        return self.of(self._of_grade[0], *coordinates)

    def bivector(self, *coordinates: Argument[M]) -> M:
        """Create bivectors from one coordinate per basis bivector, in the order of their bitmaps: e12 e13 e23 ..."""
        return self.of(self._of_grade[1], *coordinates)

    @cached_property
    def _of_grade(self) -> tuple[Layout, Layout]:
        """The layouts of vectors and bivectors."""
        return layout_of(self.algebra, self.algebra.blades(1)), layout_of(self.algebra, self.algebra.blades(2))

    def basis(self) -> tuple[M, ...]:
        """Return the basis vectors."""
        return tuple(getattr(self, name) for name in self.algebra.vectors)

    @property
    def pseudoscalar(self) -> M:
        """The unit pseudoscalar, with the orientation of its name."""
        return getattr(self, self.algebra.spelling(self.algebra.everything)[1])

    def _make(self, definition: Definition, *operands: Any) -> Any:
        """Apply a definition in this algebra, also to operands that are all numbers."""
        return apply(in_algebra(definition, self.algebra), *operands)

    def _directions(self, what: str, names: str, coordinates: tuple[Any, ...]) -> Any:
        """Create multivectors with these blades from coordinates; multivectors are returned unchanged."""
        if len(coordinates) == 1 and isinstance(coordinates[0], MultivectorArray):
            return self._element_in(what, coordinates[0])
        layout = _layout_with(self.algebra, names)
        single = single_of_numbers(layout, coordinates)
        if single is not None:
            return single
        if len(coordinates) == 1 and (found := self._element_in(what, coordinates[0])) is not None:
            return found
        return wrap(layout, stacked(what, tuple(names.split()), coordinates))


_NUMBERS = frozenset((float, int, np.float64))
_SINGLE: dict[int, tuple[Any, int, Layout]] = {}
"""The types of single multivectors and their sizes by the identity of layouts, which are kept alive."""
_ATTRIBUTES: dict[tuple[int, str], tuple[Any, Algebra]] = {}
"""Basis blades and layouts by the identity of an algebra, which is kept alive, and their names."""
_BY_NAMES: dict[tuple[Any, ...], tuple[Any, list[tuple[str, int]], Algebra]] = {}
"""Types of single multivectors and the names of their blades with signs, by an algebra, kept alive, and given names."""


def single_of_numbers(layout: Layout, coefficients: Sequence[Any]) -> Any:
    """Return a single multivector from numbers, without the arrays that take most of the time; None for all else."""
    known = _SINGLE.get(id(layout))
    if known is None:
        single = None if layout.has_relations or layout.is_scalar else single_type(layout)
        if single is None:
            return None
        known = _SINGLE[id(layout)] = single, layout.size, layout
    single, size, _ = known
    if len(coefficients) == 1:
        (given,) = coefficients
        if type(given) is np.ndarray:
            return single(given) if given.shape == (size,) and given.dtype == np.float64 else None
        if size > 1 and (type(given) is list or type(given) is tuple):
            coefficients = given
    if len(coefficients) != size:
        return None
    for each in coefficients:
        if type(each) not in _NUMBERS:
            return None
    return single(*coefficients)


@cached_by_name
def _layout_with(algebra: Algebra, names: str) -> Layout:
    return layout_of(algebra, {algebra.blade(name)[1] for name in names.split()})


def define(name: str, parameters: str, text: str, *, unit: bool = False) -> Definition:
    """Define a constructor by one line of the kernel language; with `unit` its result is declared a unit versor."""
    return _defined(name, tuple(parameters.split()), " ".join(text.split()), unit)


@cache
def _defined(name: str, parameters: tuple[str, ...], text: str, unit: bool) -> Definition:
    return Definition(name, parameters, text, unit=_always if unit else None)


@cached_by_name
def in_algebra(definition: Definition, algebra: Algebra) -> Definition:
    """Return a definition for operands of an algebra, also where all of them are numbers."""
    return replace(definition, algebra=algebra)


def _always(layouts: tuple[Layout, ...]) -> bool:
    return True


def unit(where: str, direction: Any) -> Any:
    """Divide directions by their length, which must not be 0."""
    if isinstance(direction, Expression):
        return symbolic_unit(direction)
    v = direction.values
    if v.dtype.kind == "c":
        return direction
    if not direction.shape and (length := math.hypot(*v.tolist())):
        return of_floats(direction, [x / length for x in v.tolist()])
    with np.errstate(all="ignore"):
        scaled = v / np.max(np.abs(v), axis=-1, keepdims=True, initial=0.0)
        made = wrap(direction.layout, scaled / np.sqrt(np.sum(scaled * scaled, axis=-1, keepdims=True)))
    return refuse(where, made, np.all(v == 0, axis=-1), "an axis or normal of length 0", "a nonzero one")


def of_floats(like: Any, coefficients: list[float]) -> Any:
    """Return a single element of the layout of another one."""
    single = single_type(like.layout)
    return wrap(like.layout, np.array(coefficients, like.values.dtype)) if single is None else single(*coefficients)


def is_element(x: Any) -> bool:
    """Whether a value is an element of any kind, or a list of numeric ones."""
    return isinstance(x, (MultivectorArray, Multivector, Expression)) or element_of(x) is not None


def numbers(what: str, value: Any) -> np.ndarray[Any, Any]:
    """Convert a value to an array of real or complex numbers; an element is none, since it is more than numbers."""
    if (element := element_of(value)) is not None:
        found = f"an element of {element.stored[1].name}"
        raise LayoutError(what, found, "numbers", "those of an element x are x.values")
    return array_of(what, value)


def array_of(what: str, value: Any) -> np.ndarray[Any, Any]:
    """Convert a value that is no element to an array of real or complex numbers."""
    refuse_mask(what, value)
    try:
        array = np.asarray(float(value) if isinstance(value, (Fraction, Decimal)) else value)
    except ValueError as error:
        raise LayoutError(what, f"not an array of numbers ({error})", "numbers") from None
    if array.dtype.kind not in "fiubc":
        raise LayoutError(what, f"{type(value).__name__} of dtype {array.dtype}", "numbers")
    return array.astype(np.float64) if array.dtype.kind in "iub" else array


def stacked(what: str, names: tuple[str, ...], coordinates: tuple[Any, ...]) -> np.ndarray[Any, Any]:
    """Return coordinates, given one by one or as one array, as an array with coordinates along the last axis."""
    n = len(names)
    if len(coordinates) == 1 and (n > 1 or np.ndim(coordinates[0])):
        array = numbers(what, coordinates[0])
        if array.ndim and array.shape[-1] == n:
            return array.copy()  # multivectors are immutable, but the caller may change the array later
        raise LayoutError(what, f"an array of shape {array.shape}", f"(..., {n}) with last axis {' '.join(names)}")
    if len(coordinates) != n:
        raise LayoutError(what, f"{len(coordinates)} coordinates", f"{n}: {' '.join(names)}")
    return _broadcast(what, [numbers(f"{what}: {name}", x) for name, x in zip(names, coordinates, strict=True)])


def _broadcast(what: str, arrays: Sequence[np.ndarray[Any, Any]]) -> np.ndarray[Any, Any]:
    try:
        return np.stack(np.broadcast_arrays(*arrays), -1)
    except ValueError:
        shapes = ", ".join(str(array.shape) for array in arrays)
        raise LayoutError(what, f"coordinates of shapes {shapes}", "shapes that broadcast") from None
