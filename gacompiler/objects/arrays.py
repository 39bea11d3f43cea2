"""Numeric multivectors with a layout: single ones and arrays of any shape.

If the extension of generated modules can be built, a single multivector of doubles stores its coefficients in the
object itself, and its operators call the compiled function directly from the interpreter. All other objects are a numpy
array and a layout. Both kinds are in one file because each creates objects of the other.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple, Self, overload

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.layout import SCALAR, SCALARS, Layout
from ..algebra.methods import Unordered
from ..algebra.multivector import Multivector
from ..algebra.operations import Kind, Operation
from ..algebra.versors import n_vectors
from ..errors import AlgebraError, LayoutError, OperandError, ZeroDivisorError
from ..frontend.expression import Expression
from ..frontend.operands import own_operations
from ..gac_runtime.annotations import Numbers, Real
from ..gac_runtime.array_element import OPERATORS, ArrayElement, Element, adopt, next_index
from ..gac_runtime.arrays import refuse_mask
from ..gac_runtime.layout import Layout as PlainLayout
from ..gac_runtime.layout import check_unit
from .caches import key_of
from .checks import check_relations
from .definitions import BINARY, FUNCTIONS, UNARY, Definition, grade_of, normalize_of, power_of
from .exponentials import MOST_VECTORS, exponential, layout_of_exponential, longer
from .geometry import Geometry
from .inverses import inverted
from .layouts import chosen_layout, layout_from_plain, layout_of, plain_layout
from .logarithms import versor_logarithm
from .methods import Engine, Operations, curried, run_by
from .native import extension, extension_is_settled
from .normalizing import normalized
from .numpy_functions import NumpyFunctions
from .operators import OBSERVERS, Operator, operator_of
from .printing import latex_of, repr_of, text_of
from .scalars import Scalar
from .tables import table_of

SYMBOLS = {
    (symbol, each.row.operands): (UNARY if each.row.operands == 1 else BINARY)[each]
    for each in Operation
    if each.row.kind is not Kind.SCALAR
    for symbol in (each.row.operator, *each.row.object_operators)
    if symbol
}
"""Definitions of Python's operators by symbol and number of operands; ``()`` is the call ``m(x)``."""


QUOTIENT = Definition("quotient", ("a", "b"), "a * ~b")
"""Division by a unit versor, whose inverse is its reverse; other divisors are inverted first."""


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

_LARGEST_POWER = 3
"""Largest power with a kernel of its own; higher powers are products of these."""


def run_operation(name: str, *operands: Any) -> Any:
    """Apply an operation of the kernel language to objects and numbers, for functions such as `gacompiler.reverse`."""
    if name in ("normalize", "inverse", *FUNCTIONS, "power"):
        return getattr(operands[0], name)(*operands[1:])
    table = UNARY if len(operands) == 1 else BINARY
    if name in table:
        return apply(table[name], *operands)
    first = next(each for each in operands if own_operations((each,)) is not None)
    raise OperandError(f"{name}()", f"a {first.layout}", "numbers")


if TYPE_CHECKING:
    from .signatures import Operators
else:

    class Operators:
        """The operators, which `_Array` and the types of single elements define."""

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
    takes_over_multivector = True
    layout: Layout
    values: np.ndarray[Any, Any]
    if TYPE_CHECKING:
        scalar: Real

    @property
    def algebra(self) -> Algebra:
        """The algebra of the layout."""
        return self.layout.algebra

    @property
    def stored(self) -> tuple[np.ndarray[Any, Any], PlainLayout]:
        """The coefficients and their layout, which kernels of generated modules check."""
        return self.values, plain_layout(self.layout)

    def require_unit(self, where: str) -> None:
        """Raise TypeError if ``x ~x`` differs from 1 by more than 1e-9, where a kernel takes unit elements only."""
        square = operate("*", self, operate("~", self)) - 1
        check_unit(where, str(self.layout), getattr(square, "values", square), self.values)

    def like(self, layout: PlainLayout, values: np.ndarray[Any, Any]) -> Any:
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

    def _part(self, values: np.ndarray[Any, Any]) -> Any:
        return wrap(self.layout, values)

    def _coefficient(self, name: str) -> Any:
        sign, blade = self.algebra.blade(name)
        for k, slot in enumerate(self.layout.stored):
            if slot.blade == blade:
                return _number(self.values[..., k] * (sign * slot.sign))
        for slot, value in self.layout.fixed:
            if slot.blade == blade:
                return _number(np.full(self.shape, float(value * sign * slot.sign)))
        for slot, function in self.layout.implied:
            if slot.blade == blade:
                named = {each: self.values[..., k] for k, each in enumerate(self.layout.blades)}
                return _number(function(named) * (sign * slot.sign))
        return _number(np.zeros(self.shape))

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
        return inverted(self, _INVERSE[0], wrap)

    def __pow__(self, exponent: Numbers) -> Self:
        """Return a product of equal factors; a negative integer exponent gives a power of the inverse."""
        try:
            n = operator.index(exponent)  # type: ignore[arg-type]
        except TypeError:
            return self.power(exponent)
        if n < 0:
            return self.inverse() ** -n
        if n < 2:
            return self if n else wrap(SCALAR, np.ones(self.shape))
        if n <= _LARGEST_POWER:
            found = _run_of(power_of(n))[0](self)
            if _is_single(type(self)) and extension() is not None:
                _bind_operation(f"**{n}", power_of(n), self)
            return found
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
        if type(self) is not _Array:
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
        if not shorter or _has_many_vectors(self.layout):
            return (factor * self.log(tolerance=tolerance, shorter=shorter)).exp()
        return self._determined("power", _POWER[0](self._as_unit("power", tolerance))(factor))

    def _determined(self, what: str, found: Any) -> Any:
        """Return a result; raise if a single one is NaN, or an infinite logarithm, although this element is finite."""
        if _is_single(type(found)) and math.isfinite(sum(found._numbers())):
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
            raise _mixed(what or "as_layout", self.algebra, layout.algebra)
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

    def isclose(self, other: Self | Multivector | Numbers, rtol: float = 1e-9, atol: float = 1e-12) -> Any:
        """Whether multivectors are equal within a tolerance, regardless of their layouts; an array of booleans."""
        found = apply(BINARY["subtract"], self, other)
        difference = np.abs(found.values if isinstance(found, MultivectorArray) else np.asarray(found)[..., None])
        return _number(np.all(difference <= atol + rtol * self._largest(other), axis=-1))

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

    def reshape(self, *shape: int | tuple[int, ...]) -> Self:
        """Return the same multivectors in another shape."""
        wanted = shape[0] if len(shape) == 1 and isinstance(shape[0], tuple) else shape
        return wrap(self.layout, self.values.reshape((*wanted, self.layout.size)))

    @staticmethod
    def _of_rows(layout: Layout, rows: Any) -> Any:
        return of_rows(layout, rows)

    @staticmethod
    def _values_of(where: str, operand: Any) -> tuple[Layout, np.ndarray[Any, Any]]:
        return values_of(where, operand)

    @staticmethod
    def _operate(symbol: str, *operands: Any) -> Any:
        return operate(symbol, *operands)

    run_operation = staticmethod(run_operation)

    def transpose(self, *axes: int | tuple[int, ...]) -> Self:
        """Return the multivectors with their axes reversed, or in the order of `axes`."""
        order: Any = (axes[0] if len(axes) == 1 else axes) if axes else None
        found: Any = np.transpose(self, order)
        return found

    def sum(self, axis: int | tuple[int, ...] | None = None, keepdims: bool = False) -> Self:
        """Return the sum over all elements, or along axes."""
        found: Any = np.sum(self, axis=axis, keepdims=keepdims)
        return found

    def mean(self, axis: int | tuple[int, ...] | None = None, keepdims: bool = False) -> Self:
        """Return the mean of all elements, or along axes. The mean of points of projective space is a point."""
        found: Any = np.mean(self, axis=axis, keepdims=keepdims)
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


class _Array(ArrayElement, MultivectorArray):
    """An array of multivectors, or a single one that is not of doubles or exists without the extension."""

    __slots__ = ()


_single_types: dict[Any, type | None] = {}
_by_identity: dict[int, tuple[type | None, Layout]] = {}
"""The same by the identity of the layout, because comparing layouts is slow; the entry keeps the layout alive."""
_normalizations: dict[int, tuple[Definition, Layout]] = {}
_NUMBERS = (float, int, Scalar)
_MANY = frozenset((_Array, np.ndarray))
"""Types of operands of which there may be many elements, so that an operation does not go through the extension."""
_Number: Any = None
"""The type that the extension uses for numbers in operations with single multivectors."""


def single_type(layout: Layout) -> Any:
    """Return the type of single multivectors of a layout; None if the extension is not available (yet)."""
    global _Number
    known = _by_identity.get(id(layout))
    if known is not None:
        return known[0]
    if not extension_is_settled():
        return None
    key = key_of(layout)
    if key not in _single_types:
        found = _single_types[key] = _make_single_type(layout)
        if _Number is None and found is not None:
            _Number = single_type(SCALAR) if layout != SCALAR else found
            extension().set_number(_Number, Scalar)
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
    adopt(made, plain._replace(blades=layout.blades), operate, _coefficients)  # numbers have none there
    return made


def _coefficients(cls: Any, arguments: tuple[Any, ...]) -> np.ndarray[Any, Any]:
    """Return the coefficients of a single multivector in the form that the extension expects."""
    layout: Layout = cls.layout
    array = np.asarray(arguments[0] if len(arguments) == 1 and np.ndim(arguments[0]) else arguments)
    if array.shape != (layout.size,):
        raise LayoutError(str(layout), f"coefficients of shape {array.shape}", f"({layout.size},)")
    made = np.empty(layout.size)  # the extension compares dtypes by identity, and unpickled arrays have other objects
    made[...] = array
    return made


class _Role(NamedTuple):
    """The operation of a callable object of the extension, which may already hold the first operand."""

    definition: Definition
    layout: Layout | None


_roles: dict[type, _Role] = {}
_partial_types: dict[tuple[str, type], type] = {}


def role_type(definition: Definition, layout: Layout | None) -> Any:
    """Return a type of the extension for an operation; its only object is called with a single multivector.

    The call returns the result. For an operation with two operands, it returns an object that holds the coefficients of
    the first operand and is called with the second; its type depends on the layout of the first operand.
    """
    names = () if layout is None else layout.blades
    made: Any = type(definition.name, (extension().Value,), {"__slots__": (), "_names": names})
    made._adopt(next_index(), tuple(f"_{k}" for k in range(len(names))), operate, _coefficients, None)
    _roles[made] = _Role(definition, layout)
    return made


def _play(role: _Role, holder: Any, x: Any) -> Any:
    """Run the first call of an operation with operands of these types."""
    definition, layout = role
    if layout is not None:
        if type(x) in _NUMBERS and _Number is not None:
            return holder(_Number(x))
        return _second(definition, holder, wrap(layout, np.frombuffer(holder)), x)
    if len(definition.parameters) == 1:
        result = apply(definition, x)
        if _is_single(type(x)):
            found = operator_of(definition, (_layout(x),))
            native = found.native
            _bind("()", (type(holder), type(x)), found, native and native.marked)
        return result
    return lambda y: _second(definition, holder, x, y)


def _second(definition: Definition, holder: Any, x: Any, y: Any) -> Any:
    result = apply(definition, x, y)
    if _is_single(type(x)) and _is_single(type(y)) and table_of(definition, (_layout(x), _layout(y))) is None:
        found = operator_of(definition, (_layout(x), _layout(y)))
        native, key = found.native, (definition.name, type(x))
        if native is None:
            return result
        if key not in _partial_types:
            _partial_types[key] = role_type(definition, x.layout)
            extension().bind_operator("()", (type(holder), type(x)), _partial_types[key], native.left, False)
        _bind("()", (_partial_types[key], type(y)), found, native.element)
    return result


def scalar_of(number: float, algebra: Algebra = SCALARS) -> MultivectorArray:
    """Return a number as the only coefficient of a multivector."""
    layout = SCALAR if algebra is SCALARS else algebra.layout("(1)", "1")
    return _Array(layout, np.array([number]))


def wrap(layout: Layout, values: Any) -> Any:
    """Return multivectors of a layout from their stored coefficients; numbers if the layout is scalar."""
    values = np.asarray(values)
    if layout.is_scalar:
        return Scalar(values) if values.ndim == 0 and values.dtype == np.float64 else _number(values)
    if values.ndim == 1 and values.dtype == np.float64:
        single = single_type(layout)
        if single is not None:
            return single(values)
    return _Array(layout, values)


def of_rows(layout: Layout, rows: Any) -> Any:
    """Return `wrap` of stored coefficients along the last axis, which is present for numbers as well."""
    return wrap(layout, rows[..., 0] if layout.is_scalar else rows)


def _number(values: Any) -> Any:
    return values.item() if values.ndim == 0 else values


def apply(definition: Definition, *operands: Any) -> Any:
    """Apply an operation to multivectors and numbers.

    Raises
    ------
    OperandError
        If an operand is a list, or an array where one of numbers has no use but one of coordinates would have.
    """
    types = tuple(map(type, operands))
    known = _PACKED.get((id(definition), *types))
    if known is not None and not OBSERVERS:
        return known.call(known.holder(*_flat(operands)))
    if not _MANY.isdisjoint(types) and (result := _known_result(definition, operands)) is not None:
        return result
    symbolic = next((each for each in operands if isinstance(each, Expression)), None)
    if symbolic is not None:
        return definition.function(definition.algebra or symbolic.algebra)(*operands)
    algebra = definition.algebra
    refused = (list, tuple, np.ndarray) if definition in _OF_MULTIVECTORS else (list, tuple)
    operands = without_values(definition.name, operands)
    for each in operands:
        if isinstance(each, refused) and not np.ndim(each) == 0:
            raise OperandError(
                definition.name,
                f"{type(each).__name__}, numbers that do not say which blades they belong to",
                "multivectors",
                "make one of them, as in PGA3.point(1, 2, 3), or an array of numbers for multiples",
            )
        if isinstance(each, MultivectorArray) and each.algebra is not SCALARS:
            if algebra is not None and each.algebra is not algebra and each.algebra != algebra:
                raise _mixed(definition.name, algebra, each.algebra)
            algebra = each.algebra
    lifted = [values_of(definition.name, each) for each in operands]
    layouts = tuple(layout for layout, _ in lifted)
    table = table_of(definition, layouts)
    if table is not None:
        return wrap(table.result, table.product(*(values for _, values in lifted)))
    found = operator_of(definition, layouts)
    if found.native is not None:
        _pack(definition, operands, layouts, found)
    if not _MANY.isdisjoint(types) and not (np.ndarray in types and definition in _OF_MULTIVECTORS):
        key = _known_key(definition, operands)
        if key is not None:
            _KNOWN[key] = found, found.result.is_scalar, definition, layouts
    return wrap(found.result, found([values for _, values in lifted]))


_KNOWN: dict[tuple[int, ...] | None, tuple[Operator, bool, Definition, tuple[Layout, ...]]] = {}
"""Operations on arrays, and whether their results are numbers, by definition and layouts, which are kept alive."""


def _known_key(definition: Definition, operands: tuple[Any, ...]) -> tuple[int, ...] | None:
    """Return what identifies a definition and the kinds of its operands: layouts, numbers or arrays of doubles."""
    key = [id(definition)]
    for x in operands:
        kind = type(x)
        if kind in _NUMBERS or (kind is np.ndarray and x.dtype == np.float64):
            key.append(id(kind))
        elif isinstance(x, MultivectorArray) and x.layout.algebra is not SCALARS:
            key.append(id(x.layout))
        else:
            return None
    return tuple(key)


def _known_result(definition: Definition, operands: tuple[Any, ...]) -> Any:
    """Return the result of an operation that was applied to operands of these kinds before; None for all others."""
    known = _KNOWN.get(_known_key(definition, operands))
    if known is None:
        return None
    found, is_scalar, *_ = known
    out = found([x.values if isinstance(x, MultivectorArray) else np.asarray(x, float) for x in operands])
    return wrap(found.result, out) if is_scalar or out.ndim == 1 else _Array(found.result, out)


class _Packed(NamedTuple):
    """An operation on single elements and numbers, whose coefficients are passed together."""

    holder: Any
    """The type of the extension that holds the coefficients of all operands."""
    call: Callable[[Any], Any]
    """Takes an object of this type."""
    definition: Definition
    """Kept alive, since the key has its identity."""


_PACKED: dict[tuple[Any, ...], _Packed] = {}
"""By the identity of the definition and the types of the operands."""
_HOLDERS: dict[int, Any] = {}
"""Types of holders by their number of coefficients."""


def _no_numbers(cls: Any, arguments: tuple[Any, ...]) -> Any:
    raise TypeError("operands are numbers")


def _flat(operands: tuple[Any, ...]) -> list[float]:
    numbers: list[float] = []
    for x in operands:
        if type(x) is float or type(x) is int:
            numbers.append(x)
        else:
            numbers += x._numbers()
    return numbers


def _pack(definition: Definition, operands: tuple[Any, ...], layouts: tuple[Layout, ...], found: Operator) -> None:
    """Let operations on operands of these types, single elements and Python's numbers, call the compiled function."""
    types = tuple(map(type, operands))
    if all(t is float or t is int or _is_single(t) for t in types):
        made = packed(definition, layouts, found)
        if made is not None:
            _PACKED[id(definition), *types] = made


def packed(definition: Definition, layouts: tuple[Layout, ...], found: Operator) -> _Packed | None:
    """Return an operation that takes all coefficients together; None if it is not compiled (yet)."""
    native = found.native
    result = Scalar if found.result.is_scalar else single_type(found.result)
    if native is None or result is None:
        return None
    size = sum(1 if layout.is_scalar else layout.size for layout in layouts)
    if size not in _HOLDERS:
        names = tuple(f"_{k}" for k in range(size))
        holder: Any = type("Operands", (extension().Value,), {"__slots__": (), "_names": names})
        holder._adopt(next_index(), names, operate, _no_numbers, None)
        _HOLDERS[size] = holder
    role = role_type(definition, None)
    extension().bind_operator("()", (role, _HOLDERS[size]), result, native.packed, False)
    return _Packed(_HOLDERS[size], role(), definition)


_OF_MULTIVECTORS = frozenset(
    each for name, each in BINARY.items() if name not in ("geometric_product", "add", "subtract", "divide", "power")
)
"""Operations whose operands are not arrays of numbers."""


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


def _is_operand(x: Any) -> bool:
    return isinstance(x, (MultivectorArray, Multivector, int, float, complex, np.ndarray, np.generic, list, tuple))


def _is_single(kind: type) -> bool:
    return issubclass(kind, MultivectorArray) and kind is not _Array


_ABSENT: Any = object()


def _predates_extension(x: _Array) -> bool:
    """Whether this is a single multivector that was created before the extension was available."""
    values = x.values
    is_single = values.ndim == 1 and values.dtype == np.float64 and not x.layout.is_scalar
    return is_single and single_type(x.layout) is not None


def _as_single(x: Any) -> Any:
    return wrap(x.layout, x.values) if type(x) is _Array and _predates_extension(x) else x


def operate(symbol: str, a: Any, b: Any = _ABSENT) -> Any:
    """Apply a Python operator to operands that include a multivector, and bind it to the types of single ones."""
    first, second = type(a), type(b)
    if (first in _MANY or second in _MANY) and (symbol != "/" or second in _NUMBERS or second is np.ndarray):
        operands = (a,) if b is _ABSENT else (a, b)
        definition = SYMBOLS.get((symbol, len(operands)))
        if definition is not None and (result := _known_result(definition, operands)) is not None:
            return result
    if (first is _Array and _predates_extension(a)) or (second is _Array and _predates_extension(b)):
        return OPERATORS[symbol, 1 if b is _ABSENT else 2](*(_as_single(x) for x in (a, b) if x is not _ABSENT))
    if symbol == "/" and not np.shape(a) and second in (int, float, Scalar, np.float64) and b == 0:
        raise ZeroDivisorError(
            "division", f"{a} / 0", "a divisor other than zero", "in an array, such quotients are infinite or NaN"
        )
    if any(hasattr(kind, "family") for kind in (first, second)) and first not in _roles:
        a, b = without_values(f"a {symbol} b" if symbol != "()" else "a(b)", (a, b))
        return OPERATORS[symbol, 2](a, b)
    if symbol in ("()", ">>"):
        role = _roles.get(first)
        if role is not None:
            return _play(role, a, b)
        if isinstance(b, Expression) and isinstance(a, MultivectorArray):
            return apply(SYMBOLS[symbol, 2], a, b)
        if not _is_operand(b):
            raise TypeError(f"a versor can be applied to multivectors only; found {second.__name__}")
        if not isinstance(a, (MultivectorArray, Multivector)):
            raise TypeError(f"the left operand of >> must be a versor; found {first.__name__}")
    elif first in _NUMBERS and second is not _Array and _Number is not None:
        return OPERATORS[symbol, 2](_Number(a), b)
    elif second in _NUMBERS and first is not _Array and _Number is not None:
        return OPERATORS[symbol, 2](a, _Number(b))
    operands, types = ((a,), (first,)) if b is _ABSENT else ((a, b), (first, second))
    if not all(map(_is_operand, operands)):
        return NotImplemented
    definition = SYMBOLS[symbol, len(operands)]
    if symbol == "/" and isinstance(b, (MultivectorArray, Multivector)):
        other = b if isinstance(b, MultivectorArray) else from_exact(b)
        if other.algebra is not SCALARS:
            if isinstance(a, MultivectorArray) and a.algebra not in (SCALARS, other.algebra):
                raise _mixed("division", a.algebra, other.algebra)
            if not other.layout.unit:
                return a * other.inverse()
            definition = QUOTIENT
    result = apply(definition, *operands)
    if extension() is not None and all(map(_is_single, types)):
        _bind_operation(symbol, definition, *operands)
    return result


def _layout(x: Any) -> Layout:
    return SCALAR if x.layout.is_scalar else x.layout


def _bind_operation(symbol: str, definition: Definition, *operands: Any) -> None:
    """Let a Python operator on single multivectors of these types run the compiled function if there is one."""
    layouts = tuple(_layout(x) for x in operands)
    if table_of(definition, layouts) is None:
        found = operator_of(definition, layouts)
        native = found.native
        _bind(symbol, tuple(map(type, operands)), found, native and native.element)


def _bind(symbol: str, types: tuple[type, ...], found: Operator, address: int | None) -> None:
    """Let the extension run a compiled function on objects of these types from now on."""
    if address is not None:
        result = Scalar if found.result.is_scalar else single_type(found.result)
        extension().bind_operator(symbol, types, result, address, False)


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


def without_values(where: str, operands: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return operands with values of generated modules, which have a `family`, as multivectors.

    Raises
    ------
    OperandError
        If the algebra of a value is neither that of another operand nor in the catalog.
    """
    if not any(hasattr(type(each), "family") for each in operands):
        return operands
    own = next((each.algebra for each in operands if isinstance(each, MultivectorArray)), SCALARS)
    found = []
    for each in operands:
        is_value = hasattr(type(each), "family")
        layout = layout_from_plain(each.layout, own) if is_value else None
        if is_value and layout is None:
            names = " and ".join(f"{type(each).__module__}.{type(each).__name__}" for each in operands)
            remedy = "convert one of them, as in PGA3.of(PGA3.MOTOR, x) or generated.pga3.Motor(x)"
            raise OperandError(where, names, "operands of one module", remedy)
        found.append(each if layout is None else wrap(layout, np.array(each.values)))
    return tuple(found)


def _mixed(where: str, a: Algebra, b: Algebra) -> AlgebraError:
    return AlgebraError(
        where, f"multivectors of {a.name} and {b.name}", "one algebra",
        "transfer coefficients by name: algebra.multivector({...})",
    )  # fmt: skip


run_by(Engine(apply, role_type, scalar_of))
