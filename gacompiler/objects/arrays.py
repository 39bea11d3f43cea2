"""Numeric multivectors with a layout: single ones and arrays of any shape.

If the extension of generated modules can be built, a single multivector of doubles stores its coefficients in the
object itself, and its operators call the compiled function directly from the interpreter. All other objects are a numpy
array and a layout. Both kinds are in one file because each creates objects of the other; `calls.py` has the operators.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, Sequence
from decimal import Decimal
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Self, overload

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.layout import SCALAR, SCALARS, Layout
from ..algebra.methods import Unordered
from ..algebra.multivector import Multivector
from ..algebra.versors import n_vectors
from ..errors import AlgebraError, LayoutError, OperandError
from ..gac_runtime.annotations import Array, Numbers, Real, Truth
from ..gac_runtime.array_element import ArrayElement, Element, adopt
from ..gac_runtime.arrays import refuse_mask
from ..gac_runtime.layout import Layout as PlainLayout
from ..gac_runtime.layout import check_unit
from .caches import key_of
from .checks import check_relations, number_of
from .definitions import BINARY, UNARY, Definition, grade_of, normalize_of
from .exponentials import MOST_VECTORS, exponential, layout_of_exponential, longer
from .geometry import Geometry
from .inverses import inverted
from .layouts import chosen_layout, layout_from_plain, layout_of, plain_layout
from .logarithms import versor_logarithm
from .methods import Operations, applied, curried
from .native import extension, extension_is_settled
from .normalizing import normalized
from .numpy_functions import NumpyFunctions, joined
from .printing import latex_of, repr_of, text_of
from .scalars import Scalar


def _misused(where: str, shape: tuple[int, ...], expected: str, error: Exception) -> Exception:
    """Return an error for an argument that numpy refuses, whose messages count the axis of blades."""
    if isinstance(error, TypeError):
        return OperandError(where, f"shape {shape}", "integers")
    return LayoutError(where, f"shape {shape}", expected)


@cache
def _run_of(definition: Definition) -> list[Callable[[Any], Any]]:
    """Return `curried` of a definition that is created on demand, cached."""
    return curried(definition)


_grades: dict[tuple[type, tuple[int, ...]], list[Callable[[Any], Any]]] = {}
"""Functions that `MultivectorArray.grade` calls for single multivectors once the grades have been validated."""

_INVERSE, _EXP, _LOG, _SQRT, _POWER = map(
    curried, (UNARY["inverse"], UNARY["exp"], UNARY["log"], UNARY["sqrt"], BINARY["power"])
)
"""Functions of one kernel each; the last three require a unit versor or a number."""

_WORDS = {"log": "logarithm", "sqrt": "square root", "power": "power"}

LARGEST_POWER = 3
"""Largest power with a kernel of its own; higher powers are products of these."""


if TYPE_CHECKING:
    from .signatures import Operators
else:

    class Operators:
        """The operators, which `ArrayMultivector` and the types of single elements define."""

        __slots__ = ()


class MultivectorArray(Geometry, Operations, Unordered, Operators, NumpyFunctions, Element):
    """Immutable multivectors of one layout: a single one, with shape ``()``, or an array of any shape.

    Operators: ``+ -``, ``*`` geometric product, ``^`` outer product, ``&`` regressive product (join of points in
    projective algebras), ``|`` inner product, ``~`` reverse, ``/`` by a number or by an invertible multivector,
    ``m >> x`` and ``m(x)`` sandwich product, ``x ** n``. In Python ``^ & | >>`` have a lower precedence than ``+``: use
    parentheses. Shapes broadcast as in numpy. All other operations are methods with full names.

    Each operation is compiled when it is first applied to given layouts, which also determines the layout of the
    result: two points of PGA3 join to a line of six coefficients. Products of unit versors are assumed to be unit
    versors; after many thousands of products, `normalize` removes accumulated rounding errors.

    Functions of numpy work on objects, but not on lists of them: join these by `numpy.stack` first. The generators of
    `numpy.random` return coefficients without their blades: let them choose indices, ``x[rng.permutation(len(x))]``.

    Attributes
    ----------
    layout : Layout
        The stored coefficients, and the constraints on the others.
    algebra : Algebra
    values : numpy.ndarray
        The stored coefficients, with blades along the last axis. Read-only.
    shape : tuple of int
        Shape without the axis of blades.
    """

    __slots__ = ()
    _takes_over_multivector = True
    layout: Layout
    values: np.ndarray[Any, Any]
    if TYPE_CHECKING:
        scalar: Real

    @property
    def algebra(self) -> Algebra:
        """The algebra of the layout."""
        return self.layout.algebra

    @property
    def stored(self) -> tuple[Array, PlainLayout]:
        """The coefficients and their layout, which kernels of generated modules check."""
        return self.values, plain_layout(self.layout)

    _run_operation: ClassVar[Callable[..., Any]]
    _bind_power: ClassVar[Callable[..., None]]

    def require_unit(self, where: str) -> None:
        """Raise TypeError if ``x ~x`` differs from 1 by more than 1e-9, where a kernel takes unit elements only."""
        square: Any = self * ~self - 1
        check_unit(where, str(self.layout), getattr(square, "values", square), self.values)

    def like(self, layout: PlainLayout, values: Array) -> Self | Array:
        """Return multivectors from results of a generated kernel; an array if their algebra is not known here."""
        found = layout_from_plain(layout, self.algebra)
        return values if found is None else wrap(found, values)

    if TYPE_CHECKING:

        def __iter__(self) -> Iterator[Self]: ...
        @overload
        def __getitem__(self, index: str) -> Real: ...
        @overload
        def __getitem__(self, index: Any) -> Self: ...
        def __getitem__(self, index: Any) -> Any: ...

    def _is_of_algebra(self, other: Any) -> bool:
        is_equal = isinstance(other, MultivectorArray) and self.algebra == other.algebra  # whatever their names
        return is_equal or super()._is_of_algebra(other)

    def _part(self, values: np.ndarray[Any, Any]) -> Any:
        return wrap(self.layout, values)

    def _coefficient(self, name: str) -> Any:
        sign, blade = self.algebra.blade(name)
        for k, slot in enumerate(self.layout.stored):
            if slot.blade == blade:
                return number_of(self.values[..., k] * (sign * slot.sign))
        for slot, value in self.layout.fixed:
            if slot.blade == blade:
                return number_of(np.full(self.shape, float(value * sign * slot.sign)))
        for slot, function in self.layout.implied:
            if slot.blade == blade:
                named = {each: self.values[..., k] for k, each in enumerate(self.layout.blades)}
                return number_of(function(named) * (sign * slot.sign))
        return number_of(np.zeros(self.shape))

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Return a coefficient by the name of its blade, ``x.e12``; `scalar` is the coefficient of 1."""
            if not name.startswith("_"):
                try:
                    return self._coefficient("1" if name == "scalar" else name)
                except AlgebraError:
                    pass
            raise AttributeError(f"{type(self).__name__} has no method and {self.algebra.name} no blade {name!r}")

    def __dir__(self) -> list[str]:
        return sorted({*object.__dir__(self), *(name for name in self.layout.blades if name.isidentifier())})

    def exp(self) -> Self:
        """Return the exponential, which for a bivector in up to five dimensions is a unit versor; see `gacompiler.exp`.

        If the result has more than 16 coefficients, in six dimensions and more, it is computed by products, and the
        argument may be arbitrarily large. In other cases without a closed form, the result is NaN for arguments with
        norms far above 1000.
        """
        whole = layout_of_exponential(self.layout) if self.layout.algebra.dimension > MOST_VECTORS else None
        return _EXP[0](self) if whole is None else exponential(self, whole, wrap)

    def inverse(self) -> Self:
        """Return the element ``b`` with ``a b = 1``, where `a` is this object; see `gacompiler.inverse`.

        In more than five dimensions, versors are inverted by their reverse, and other elements as matrices; the
        residual of both is checked. In an array, elements without an inverse give NaN.

        Raises
        ------
        ZeroDivisorError
            If this is a single element without an inverse up to rounding: a null vector, a zero divisor, or 0.
        """
        return self._inverted() if type(self) is ArrayMultivector else self**-1  # which the extension runs

    def _inverted(self) -> Self:
        x: Any = self
        found: Self = inverted(x, _INVERSE[0], wrap, x._numbers() if is_single(type(x)) else None)
        return found

    def __pow__(self, exponent: Numbers) -> Self:
        """Return a product of equal factors; a negative integer exponent gives a power of the inverse."""
        operated: Self
        try:
            n = operator.index(exponent)  # type: ignore[arg-type]
        except TypeError:
            operated = self.power(exponent)
            if type(exponent) is float and self.layout.unit and is_single(type(operated)):
                self._bind_power(self, exponent)
            return operated
        if n < -1:
            return (self**-1) ** -n
        if n == -1 and type(self) is ArrayMultivector:
            return self._inverted()
        if n == 1:
            return self
        if n == 0:
            one: Any = wrap(SCALAR, np.ones(self.shape)) if self.shape else Scalar(1.0)
            return one
        if n <= LARGEST_POWER:  # or -1
            operated = self._operate(f"**{n}", self)
            return operated
        half = self ** (n // 2)
        return half * self * half if n % 2 else half * half

    def __rpow__(self, base: float) -> Self:
        return (np.log(base) * self).exp()

    def __pos__(self) -> Self:
        return self

    def __abs__(self) -> Real:
        return self.norm()

    def __round__(self, digits: int = 0) -> Self:
        found: Any = np.round(self, digits)
        return found

    def normalize(self) -> Self:
        """Scale this element to ``x ~x`` = 1, or to -1 if ``x ~x`` is negative.

        The result is ``x / sqrt(|x ~x|)`` if ``x ~x`` is a number, as for planes, spheres, circles and vectors of
        space-time. For motors and lines of projective and conformal space ``x ~x`` is a dual number, and the result
        also satisfies the Study condition. Other elements are divided by their norm. The result has a layout of unit
        elements only if the metric excludes -1.

        Null elements, for which ``x ~x`` is 0 up to rounding, cannot be normalized; in an array they give NaN.

        Raises
        ------
        ZeroDivisorError
            If this is a single null element.
        """
        return normalized(self, _run_of(_normalization(self.layout))[0], wrap)

    def grade(self, *grades: int) -> Self:
        """Return the part of the given grades."""
        known = _grades.get((type(self), grades))
        if known is not None:
            return known[0](self)
        n = self.algebra.dimension
        if not grades or not all(isinstance(k, int) and 0 <= k <= n for k in grades):
            raise AlgebraError("grade", f"grades {grades}", f"integers from 0 to {n}, as in x.grade(2)")
        run = _run_of(grade_of(grades))
        if type(self) is not ArrayMultivector:
            _grades[type(self), grades] = run
        return run[0](self)

    def log(self, *, tolerance: float = 1e-9, shorter: bool = True) -> Self:
        """Return the logarithm of a unit versor or of a number; see `gacompiler.log`.

        Parameters
        ----------
        tolerance : float
            How far ``x ~x`` may be from 1, for even elements whose layout does not guarantee it.
        shorter : bool
            Whether the result is the shorter of the motions of ``R`` and ``-R``, which are the same motion. Otherwise
            its exponential is ``R`` itself, also for rotors of more than half a turn.

        Raises
        ------
        LayoutError
            If a versor is not of unit norm within the `tolerance`.
        AlgebraError
            If the logarithm of a single element is not determined: the planes of rotation of ``e1234`` are not, nor is
            the axis of -1 in space. In an array, such elements give NaN.
        """
        versor = self._as_unit("log", tolerance)
        if _has_many_vectors(versor.layout):
            return self._determined("log", versor_logarithm(versor, wrap, shorter))
        found = _LOG[0](versor)
        if not (shorter or self.layout.is_scalar or self.algebra.conjugates):  # logarithms of numbers are exact
            found = longer(versor, found, wrap)
        return self._determined("log", found)

    def sqrt(self, *, tolerance: float = 1e-9, shorter: bool = True) -> Self:
        """Return the square root of a unit versor, half of its motion, or of a number; arguments as in `log`.

        By default it is half of the shorter motion: the square of the root of a rotor of more than half a turn is its
        negative.
        """
        if not shorter or _has_many_vectors(self.layout):
            return (self.log(tolerance=tolerance, shorter=shorter) / 2).exp()
        return self._determined("sqrt", _SQRT[0](self._as_unit("sqrt", tolerance)))

    def power(self, exponent: Numbers, *, tolerance: float = 1e-9, shorter: bool = True) -> Self:
        """Return ``exp(exponent * log(x))``, for a unit versor a fraction of its motion; arguments as in `log`."""
        factor: Any = float(exponent) if isinstance(exponent, int) else exponent
        if type(factor) is float and is_single(type(self)):
            factor = single_type(SCALAR)(factor)  # the extension runs what takes single elements
        if not shorter or _has_many_vectors(self.layout):
            return (factor * self.log(tolerance=tolerance, shorter=shorter)).exp()
        return self._determined("power", _POWER[0](self._as_unit("power", tolerance))(factor))

    def _determined(self, what: str, found: Any) -> Any:
        """Return a result; raise if a single one is NaN, or an infinite logarithm, although this element is finite."""
        if is_single(type(found)) and math.isfinite(sum(found._numbers())):
            return found
        is_missing = np.isnan if what != "log" else lambda values: ~np.isfinite(values)  # powers may overflow
        if not np.shape(found) and is_missing(found.values).any() and np.isfinite(self.values).all():
            raise AlgebraError(
                what, f"{self}, which has no {_WORDS[what]}, or many", f"a versor or number with one {_WORDS[what]}",
                "in an array, such elements give NaN",
            )  # fmt: skip
        return found

    def _as_unit(self, what: str, tolerance: float) -> Any:
        """Convert even elements to the layout of unit elements; return others, such as complex numbers, unchanged."""
        layout = self.layout
        if layout.unit or layout.has_relations or any(blade.bit_count() & 1 for blade in layout.support):
            return self
        unit = unit_layout(layout)
        return self if unit is None else self.as_layout(unit, tolerance=tolerance, what=what)

    def as_layout(self, layout: Layout, *, tolerance: float = 1e-9, what: str = "") -> Self:
        """Return the same multivectors in another layout.

        Raises
        ------
        LayoutError
            If the layout cannot represent them within `tolerance`, relative to the largest coefficient: a coefficient
            that it does not store is not zero, or one of its relations does not hold.
        """
        if not isinstance(layout, Layout):
            raise LayoutError("as_layout", f"an argument of type {type(layout).__name__}", "a layout, as in PGA3.POINT")
        if layout.algebra != self.algebra:
            raise mixed(what or "as_layout", self.algebra, layout.algebra)
        where = what or f"as_layout({layout})"
        size = np.max(np.abs(self.values), axis=-1, initial=1.0)
        for name in _other_slots(self.layout, layout):
            found = np.abs(np.asarray(self[name]))
            if np.any(found > tolerance * size):
                raise LayoutError(where, f"{name} = {np.max(found):.3g}", f"only {' '.join(layout.blades)}")
        for slot, value in layout.fixed:
            if np.any(np.abs(np.asarray(self[slot.name]) - float(value)) > tolerance * size):
                raise LayoutError(
                    where, f"{slot.name} = {np.ravel(self[slot.name])[0]:.6g}", f"{slot.name} = {value}",
                    "divide by the weight first",
                )  # fmt: skip
        stored = {name: np.asarray(self[name]) for name in layout.blades}
        for slot, function in layout.implied:
            own, implied = np.asarray(self[slot.name]), np.asarray(function(stored))
            far = np.abs(own - implied) > tolerance * size
            if np.any(far):
                raise LayoutError(where, f"{slot.name} = {own[far][0]:.6g}", f"{implied[far][0]:.6g} in a {layout}")
        values = np.stack(np.broadcast_arrays(*stored.values()), -1)
        if layout.has_relations:
            check_relations(where, layout, values, tolerance)
        return wrap(layout, values)

    def isclose(self, other: Self | Multivector | Numbers, rtol: float = 1e-9, atol: float = 1e-12) -> Truth:
        """Whether multivectors are equal within a tolerance, regardless of their layouts; an array of booleans."""
        other = joined(other)
        found = applied(BINARY["subtract"], self, other)
        difference = np.abs(found.values if isinstance(found, MultivectorArray) else np.asarray(found)[..., None])
        return number_of(np.all(difference <= atol + rtol * self._largest(other), axis=-1))

    def _largest(self, other: Any) -> Any:
        sizes = [np.max(np.abs(each.values), axis=-1) for each in (self, other) if isinstance(each, MultivectorArray)]
        return np.maximum(sizes[0], sizes[-1])[..., None]

    def exactly(self) -> Multivector:
        """Return this single multivector over the rationals, with every coefficient converted exactly."""
        if self.shape:
            raise LayoutError(
                "exactly", f"an array of shape {self.shape}", "a single multivector", "select an element first"
            )
        return self.layout.element([Fraction(float(x)) for x in self.values])

    def reshape(self, *shape: int | Sequence[int]) -> Self:
        """Return the same multivectors in another shape."""
        wanted = shape[0] if len(shape) == 1 and isinstance(shape[0], (tuple, list)) else shape
        try:
            return wrap(self.layout, self.values.reshape((*wanted, self.layout.size)))
        except (TypeError, ValueError) as error:
            raise _misused(f"reshape to {wanted}", self.shape, "as many elements", error) from None

    def transpose(self, *axes: int | tuple[int, ...]) -> Self:
        """Return the multivectors with their axes reversed, or in the order of `axes`."""
        order: Any = (axes[0] if len(axes) == 1 else axes) if axes else None
        found: Any = np.transpose(self, order)
        return found

    def sum(self, axis: int | tuple[int, ...] | None = None, keepdims: bool = False) -> Self:
        """Return the sum over all elements, or along axes."""
        try:
            found: Any = np.sum(self, axis=axis, keepdims=keepdims)
        except (TypeError, ValueError) as error:
            raise _misused(f"sum along axis {axis!r}", self.shape, "axes that there are, each once", error) from None
        return found

    def mean(self, axis: int | tuple[int, ...] | None = None, keepdims: bool = False) -> Self:
        """Return the mean of all elements, or along axes. The mean of points of projective space is a point."""
        try:
            found: Any = np.mean(self, axis=axis, keepdims=keepdims)
        except (TypeError, ValueError) as error:
            raise _misused(f"mean along axis {axis!r}", self.shape, "axes that there are, each once", error) from None
        return found

    def __str__(self) -> str:
        return text_of(self)

    def __format__(self, form: str) -> str:
        return text_of(self, form) if form else text_of(self)

    def __repr__(self) -> str:
        return repr_of(self)

    def _repr_latex_(self) -> str:
        return latex_of(self)

    def _latex(self, printer: object = None) -> str:
        """Return LaTeX without dollar signs, for `sympy.latex`."""
        return latex_of(self).strip("$")

    def __reduce__(self) -> Any:
        return wrap, (self.layout, np.array(self.values))


class ArrayMultivector(ArrayElement, MultivectorArray):
    """An array of multivectors, or a single one that is not of doubles or exists without the extension."""

    __slots__ = ()


_single_types: dict[Any, type | None] = {}
_by_identity: dict[int, tuple[type | None, Layout]] = {}
"""The same by the identity of the layout, because comparing layouts is slow; the entry keeps the layout alive."""
_normalizations: dict[int, tuple[Definition, Layout]] = {}


def single_type(layout: Layout) -> Any:
    """Return the type of single multivectors of a layout; None if the extension is not available (yet)."""
    known = _by_identity.get(id(layout))
    if known is not None:
        return known[0]
    if not extension_is_settled():
        return None
    key = key_of(layout)
    if key not in _single_types:
        found = _single_types[key] = _make_single_type(layout)
        if found is not None and layout == SCALAR:
            extension().set_number(found, Scalar)
        single_type(SCALAR)
    _by_identity[id(layout)] = _single_types[key], layout
    return _single_types[key]


def _normalization(layout: Layout) -> Definition:
    if id(layout) not in _normalizations:
        _normalizations[id(layout)] = normalize_of(layout), layout
    return _normalizations[id(layout)][0]


def _make_single_type(layout: Layout) -> type | None:
    found = extension()
    if found is None:
        return None

    body: dict[str, Any] = {
        "__slots__": (),
        "__doc__": f"One {layout}.",
        "__module__": __name__,
        "__hash__": found.Value.__hash__,
        "__eq__": found.Value.__eq__,
        "__ne__": found.Value.__ne__,
        "layout": layout,
        "values": property(np.frombuffer),
        "shape": (),
    }
    word = "".join(part.capitalize() for part in layout.name.split("_"))
    made = type(word if word.isidentifier() else "Multivector", (MultivectorArray, found.Value), body)
    plain = plain_layout(layout)
    # The layout of numbers has no blades there.
    adopt(made, plain._replace(blades=layout.blades), MultivectorArray._operate, coefficients_of)
    return made


def coefficients_of(cls: Any, arguments: tuple[Any, ...]) -> np.ndarray[Any, Any]:
    """Return the coefficients of a single multivector in the form that the extension expects."""
    layout: Layout = cls.layout
    array = np.asarray(arguments[0] if len(arguments) == 1 and np.ndim(arguments[0]) else arguments)
    if array.shape != (layout.size,):
        raise LayoutError(str(layout), f"coefficients of shape {array.shape}", f"({layout.size},)")
    made = np.empty(layout.size)  # the extension compares dtypes by identity, and unpickled arrays have other objects
    made[...] = array
    return made


def scalar_of(number: float, algebra: Algebra = SCALARS) -> MultivectorArray:
    """Return a number as the only coefficient of a multivector."""
    layout = SCALAR if algebra is SCALARS else algebra.layout("(1)", "1")
    return ArrayMultivector(layout, np.array([number]))


def wrap(layout: Layout, values: Any) -> Any:
    """Return multivectors of a layout from their stored coefficients; numbers if the layout is scalar."""
    values = np.asarray(values)
    if layout.is_scalar:
        return Scalar(values) if values.ndim == 0 and values.dtype == np.float64 else number_of(values)
    if values.ndim == 1 and values.dtype == np.float64:
        single = single_type(layout)
        if single is not None:
            return single(values)
    return ArrayMultivector(layout, values)


def of_rows(layout: Layout, rows: Any) -> Any:
    """Return `wrap` of stored coefficients along the last axis, which is present for numbers as well."""
    return wrap(layout, rows[..., 0] if layout.is_scalar else rows)


def values_of(where: str, operand: Any) -> tuple[Layout, np.ndarray[Any, Any]]:
    """Return the layout and the stored coefficients of an operand; those of numbers have no axis of blades."""
    if isinstance(operand, MultivectorArray):
        if operand.algebra is SCALARS:
            return SCALAR, operand.values[..., 0]
        return operand.layout, operand.values
    if isinstance(operand, Multivector):
        return values_of(where, from_exact(operand))
    refuse_mask(where, operand)
    values = np.asarray(float(operand) if isinstance(operand, (int, Fraction, Decimal)) else operand)
    if values.dtype.kind not in "fiubc":
        raise OperandError(where, f"an operand of type {type(operand).__name__}", "multivectors or numbers")
    return SCALAR, values.astype(np.float64) if values.dtype.kind in "iub" else values


def from_exact(element: Multivector) -> MultivectorArray:
    """Convert a multivector of the algebra layer, with its coefficients as doubles or complex doubles."""
    layout = layout_of(element.algebra, element.terms or {0})
    kind: Any = complex if any(isinstance(value, complex) for value in element.terms.values()) else float
    try:
        values = np.array([kind(element.terms.get(slot.blade, 0)) * slot.sign for slot in layout.stored])
    except TypeError as error:
        raise AlgebraError(
            "operand of an object",
            f"formulas as coefficients: {element}",
            "numbers",
            "substitute numbers, or convert the formula to a kernel with gacompiler.symbolic.to_kernel() and call that",
        ) from error
    return of_rows(layout, values)


def is_single(kind: type) -> bool:
    """Whether this is a type of single multivectors, whose coefficients the extension stores."""
    return issubclass(kind, MultivectorArray) and kind is not ArrayMultivector


def unit_layout(layout: Layout) -> Layout | None:
    """Return the layout of unit elements with the same coefficients; None if there is none."""
    found = chosen_layout(layout, True)
    return found if found.unit else None


def _has_many_vectors(layout: Layout) -> bool:
    """Return whether a layout has even versors over more vectors than kernels of logarithms support."""
    if layout.algebra.dimension <= MOST_VECTORS:
        return False
    blades = layout.support
    return n_vectors(blades) > MOST_VECTORS and not any(blade.bit_count() & 1 for blade in blades) and len(blades) > 2


def _other_slots(own: Layout, wanted: Layout) -> list[str]:
    kept = wanted.support
    return [
        s.name for s in (*own.stored, *(s for s, _ in own.fixed), *(s for s, _ in own.implied)) if s.blade not in kept
    ]


def objects_of(where: str, operands: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return operands with exact multivectors, and values of generated modules, which have a `family`, as objects.

    Raises
    ------
    OperandError
        If the algebra of a value is neither that of another operand nor in the catalog.
    """
    own = next((each.algebra for each in operands if isinstance(each, MultivectorArray)), SCALARS)
    return tuple(_object_of(where, each, own) for each in operands)


def _object_of(where: str, operand: Any, own: Algebra) -> Any:
    if not hasattr(type(operand), "family"):
        return from_exact(operand) if isinstance(operand, Multivector) else operand
    layout = layout_from_plain(operand.layout, own)
    if layout is None:
        found = f"{operand.layout.name} of {operand.module}, beside {own.name}"
        remedy = "convert one of them, as in PGA3.of(PGA3.MOTOR, x) or generated.pga3.Motor(x)"
        raise OperandError(where, found, "operands of one module", remedy)
    return wrap(layout, np.array(operand.values))


def mixed(where: str, a: Algebra, b: Algebra) -> AlgebraError:
    """Return the error for operands of two algebras."""
    return AlgebraError(
        where, f"multivectors of {a.name} and {b.name}", "one algebra",
        "transfer coefficients by name: algebra.multivector({...})",
    )  # fmt: skip


MultivectorArray._of_rows = staticmethod(of_rows)
MultivectorArray._values_of = staticmethod(values_of)
MultivectorArray._objects_of = staticmethod(objects_of)
