"""numpy's functions on multivectors.

Functions that rearrange, select or add elements act on each coefficient separately, in a layout with the blades of all
operands. Universal functions map to operators and methods of multivectors. All other functions raise `TypeError`,
because numpy would treat coefficients as independent numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any, ClassVar

import numpy as np

from ..algebra.layout import SCALARS, Layout
from ..errors import AlgebraError
from .layouts import chosen_layout, layout_of

_REMEDY = "use a method of multivectors, or their coefficients: x.values, x['e12']"
_REFUSED = ("out", "dtype", "where", "initial", "prepend", "append", "casting", "returned", "subok")
"""Keywords of numpy's functions that are not supported for multivectors."""


class NumpyFunctions:
    """Base class of multivectors that support numpy's functions; subclasses define conversions to and from arrays."""

    __slots__ = ()

    layout: Layout
    values: np.ndarray[Any, Any]

    _of_rows: ClassVar[Callable[..., Any]]
    """Return multivectors, or numbers, from their stored coefficients along the last axis."""
    _values_of: ClassVar[Callable[..., tuple[Layout, np.ndarray[Any, Any]]]]
    """Return the layout and the stored coefficients of an operand; those of numbers have no axis of blades."""
    _objects_of: ClassVar[Callable[..., tuple[Any, ...]]]
    """Return operands with exact multivectors and values of generated modules as objects."""
    _equals: Callable[[Any], Any]
    _operate: ClassVar[Callable[..., Any]]
    """Apply a Python operator to operands that include a multivector."""

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        return array_function(self, function, args, kwargs)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        return array_ufunc(self, ufunc, method, inputs, kwargs)


def array_function(
    kind: NumpyFunctions, function: Callable[..., Any], args: Sequence[Any], kwargs: Mapping[str, Any]
) -> Any:
    """Implement ``__array_function__``: apply a function of numpy to operands that include a multivector.

    `kind` is one of the operands; its class provides the conversions. The functions called here use it likewise.

    Raises
    ------
    TypeError
        For functions and keywords that are not defined for multivectors.
    AlgebraError
        If operands belong to different algebras.
    """
    run = _TABLE.get(function)
    where = f"{function.__module__}.{function.__name__}".replace("numpy", "np", 1)
    if run is None:
        raise TypeError(f"{where} is not defined for multivectors; {_REMEDY}")
    for name in _REFUSED:
        if name in kwargs:
            raise TypeError(f"{where} of multivectors does not accept the argument {name!r}")
    if not args:
        raise TypeError(f"{where} of multivectors: no positional argument; pass the multivectors by position")
    return run(kind, where, function, *args, **kwargs)


def array_ufunc(
    kind: NumpyFunctions, ufunc: np.ufunc, method: str, inputs: Sequence[Any], kwargs: Mapping[str, Any]
) -> Any:
    """Implement ``__array_ufunc__``: apply a universal function to operands that include a multivector.

    Raises
    ------
    TypeError
        As in `array_function`.
    """
    where = f"np.{ufunc.__name__}" + (f".{method}" if method != "__call__" else "")
    reduced = _REDUCTIONS.get(ufunc) if method == "reduce" else None
    if reduced is not None:
        return array_function(kind, reduced, inputs, {"axis": 0} | dict(kwargs))
    if kwargs:
        raise TypeError(f"{where} of multivectors, which are immutable, does not accept {next(iter(kwargs))!r}")
    if method == "__call__" and ufunc in _OPERATORS:
        found = kind._operate(_OPERATORS[ufunc], *inputs)
        if found is not NotImplemented:
            return found
    if method == "__call__" and ufunc in _METHODS:
        return _METHODS[ufunc](*inputs)
    raise TypeError(f"{where} is not defined for multivectors; {_REMEDY}")


def _united(kind: NumpyFunctions, where: str, operands: Sequence[Any]) -> tuple[Layout, list[np.ndarray[Any, Any]]]:
    """Return a common layout of multivectors and numbers, and the coefficients of each in it.

    This is their own layout if it is the same for all, or a layout of unit elements if all are known to be units.
    """
    layouts, arrays = zip(*(kind._values_of(where, each) for each in operands), strict=True)
    if all(layout == layouts[0] for layout in layouts):
        return layouts[0], [a[..., None] if layouts[0].is_scalar else a for a in arrays]
    algebras = {layout.algebra.name: layout.algebra for layout in layouts if layout.algebra != SCALARS}
    if len(algebras) > 1:
        raise AlgebraError(where, f"multivectors of {' and '.join(algebras)}", "one algebra")
    (algebra,) = algebras.values()
    support = frozenset[int]().union(*(layout.support for layout in layouts))
    layout = chosen_layout(layout_of(algebra, support), all(each.unit for each in layouts))
    return layout, [_in_layout(kind, layout, each) for each in operands]


def _in_layout(kind: NumpyFunctions, layout: Layout, x: Any) -> np.ndarray[Any, Any]:
    if not isinstance(x, NumpyFunctions):
        x = kind._of_rows(layout_of(layout.algebra, {0}), np.asarray(x)[..., None])
        return np.stack([x if name == "1" else np.zeros_like(x) for name in layout.blades], -1)
    coefficients: Any = x
    return np.stack(np.broadcast_arrays(*(np.asarray(coefficients[name]) for name in layout.blades)), -1)


def _plain(layout: Layout) -> Layout:
    """Return the layout of sums, to which constraints on the elements do not apply."""
    known = layout.fixed or layout.implied or layout.has_relations
    return layout_of(layout.algebra, layout.support) if known else layout


def _mean(layout: Layout) -> Layout:
    """Return the layout of means, which have the same fixed coefficients as the elements."""
    return _plain(layout) if layout.implied or layout.has_relations else layout


def _blade_by_blade(kind: NumpyFunctions, layout: Layout, columns: Sequence[Any]) -> Any:
    """Return multivectors from one result for each blade; results may be lists of arrays."""
    if isinstance(columns[0], (list, tuple)):
        return [_blade_by_blade(kind, layout, each) for each in zip(*columns, strict=True)]
    return kind._of_rows(layout, np.stack(columns, -1))


def _one(of: Callable[[Layout], Layout]) -> Any:
    """Return the implementation for a function of one operand; `of` gives the layout of the result."""

    def run(kind: NumpyFunctions, where: str, function: Any, x: Any, *args: Any, **kwargs: Any) -> Any:
        if not isinstance(x, NumpyFunctions):
            raise TypeError(f"{where}: multivectors are supported as the first argument only; {_REMEDY}")
        layout = of(x.layout)
        values = x.values if layout == x.layout else _in_layout(kind, layout, x)
        columns = [function(values[..., k], *args, **kwargs) for k in range(layout.size)]
        return _blade_by_blade(kind, layout, columns)

    return run


def _list(kind: NumpyFunctions, where: str, function: Any, operands: Any, *args: Any, **kwargs: Any) -> Any:
    """Apply a function of a list of operands."""
    operands = list(operands)
    layout, arrays = _united(kind, where, operands)
    columns = [function([a[..., k] for a in arrays], *args, **kwargs) for k in range(layout.size)]
    return _blade_by_blade(kind, layout, columns)


def _append(kind: NumpyFunctions, where: str, function: Any, first: Any, second: Any, axis: int | None = None) -> Any:
    return _list(kind, where, lambda pair: function(*pair, axis=axis), (first, second))


def _where(kind: NumpyFunctions, where: str, function: Any, condition: Any, *choices: Any) -> Any:
    if len(choices) != 2 or isinstance(condition, NumpyFunctions):
        raise TypeError(f"{where} of multivectors: expected a condition of booleans, and two operands")
    return _list(kind, where, lambda pair: function(condition, *pair), choices)


def _broadcast_arrays(kind: NumpyFunctions, where: str, function: Any, *operands: Any) -> Any:
    arrays = [kind._values_of(where, each) for each in operands]
    shapes = [a.shape if layout.is_scalar else a.shape[:-1] for layout, a in arrays]
    shape = np.broadcast_shapes(*shapes)
    return tuple(
        kind._of_rows(layout, np.broadcast_to(a[..., None] if layout.is_scalar else a, (*shape, layout.size)))
        for layout, a in arrays
    )


def _product(kind: NumpyFunctions, where: str, function: Any, x: Any, axis: int | None = None) -> Any:
    """Return the geometric product of elements in order."""
    if axis is None:
        x, axis = x.reshape(x.size), 0
    factors = list(np.moveaxis(x, axis, 0))
    return (
        reduce(lambda a, b: a * b, factors)
        if factors
        else kind._of_rows(layout_of(x.algebra, {0}), np.ones((*x.shape[1:], 1)))
    )


def _closeness(
    kind: NumpyFunctions, where: str, function: Any, a: Any, b: Any, rtol: float = 1e-9, atol: float = 1e-12
) -> Any:
    first: Any
    first, second = (a, b) if isinstance(a, NumpyFunctions) else (b, a)
    return first.isclose(second, rtol=rtol, atol=atol)


def _all_close(kind: NumpyFunctions, where: str, function: Any, *operands: Any, **tolerances: Any) -> bool:
    return bool(np.all(_closeness(kind, where, function, *operands, **tolerances)))


def _array_equal(kind: NumpyFunctions, where: str, function: Any, a: Any, b: Any) -> bool:
    return np.shape(a) == np.shape(b) and bool(np.all(_equal(a, b)))


def _memory(kind: NumpyFunctions, where: str, function: Any, *operands: Any) -> Any:
    """Compare the memory of coefficients; the generators of numpy copy elements before they permute them."""
    return function(*(x.values if isinstance(x, NumpyFunctions) else x for x in operands))


def _attribute(name: str) -> Any:
    return lambda kind, where, function, x: getattr(x, name)


# Without annotations, mypy takes seconds to find a common type of overloaded functions.
_REARRANGING: tuple[Any, ...] = (
    np.reshape, np.ravel, np.transpose, np.swapaxes, np.moveaxis, np.rollaxis, np.squeeze, np.expand_dims,
    np.broadcast_to, np.repeat, np.tile, np.take, np.roll, np.flip, np.fliplr, np.flipud, np.rot90, np.atleast_1d,
    np.atleast_2d, np.atleast_3d, np.delete, np.compress, np.resize, np.copy, np.split, np.array_split, np.hsplit,
    np.vsplit, np.dsplit, np.diagonal, np.round, np.around,
)  # fmt: skip
"""Functions that rearrange elements, or round their stored coefficients."""

_SUMS: tuple[Any, ...] = (np.sum, np.cumsum, np.diff, np.nansum)
_MEANS: tuple[Any, ...] = (np.mean, np.average)
_JOINING: tuple[Any, ...] = (np.stack, np.concatenate, np.vstack, np.hstack, np.dstack)

_TABLE: Mapping[Any, Any] = {
    **{function: _one(lambda layout: layout) for function in _REARRANGING},
    **{function: _one(_plain) for function in _SUMS},
    **{function: _one(_mean) for function in _MEANS},
    **dict.fromkeys(_JOINING, _list),
    np.append: _append,
    np.where: _where,
    np.broadcast_arrays: _broadcast_arrays,
    np.prod: _product,
    np.isclose: _closeness,
    np.allclose: _all_close,
    np.array_equal: _array_equal,
    np.may_share_memory: _memory,
    np.shares_memory: _memory,
    np.shape: _attribute("shape"),
    np.ndim: _attribute("ndim"),
    np.size: _attribute("size"),
}

_REDUCTIONS: Mapping[np.ufunc, Any] = {np.add: np.sum, np.multiply: np.prod}

_OPERATORS: Mapping[np.ufunc, str] = {
    np.add: "+", np.subtract: "-", np.multiply: "*", np.true_divide: "/", np.bitwise_xor: "^", np.bitwise_and: "&",
    np.bitwise_or: "|", np.right_shift: ">>", np.invert: "~", np.negative: "-",
}  # fmt: skip


def _of_values(run: Callable[[Any], Any], together: Callable[..., Any]) -> Callable[[Any], Any]:
    return lambda x: together(run(x.values), axis=-1)[()]


def joined(x: Any) -> Any:
    """Return an array of elements for an array of objects some of which are elements; all else unchanged."""
    if type(x) is not np.ndarray or x.dtype != object or not any(isinstance(each, NumpyFunctions) for each in x.flat):
        return x
    found: Any = np.stack(list(x.flat))
    return found.reshape((*x.shape, *found.shape[1:]))


def _equal(a: Any, b: Any) -> Any:
    a, b = joined(a), joined(b)
    element, other = (a, b) if isinstance(a, NumpyFunctions) else (b, a)
    found = element._equals(other)
    return np.zeros(np.broadcast_shapes(np.shape(a), np.shape(b)), bool)[()] if found is NotImplemented else found


_METHODS: Mapping[np.ufunc, Callable[..., Any]] = {
    np.absolute: lambda x: x.norm(),
    np.positive: lambda x: x,
    np.exp: lambda x: x.exp(),
    np.log: lambda x: x.log(),
    np.sqrt: lambda x: x.sqrt(),
    np.square: lambda x: x * x,
    np.reciprocal: lambda x: x.inverse(),
    np.power: lambda x, y: x**y if isinstance(x, NumpyFunctions) else y.__rpow__(x),
    np.equal: _equal,
    np.not_equal: lambda a, b: np.logical_not(_equal(a, b)),
    np.isfinite: _of_values(np.isfinite, np.all),
    np.isnan: _of_values(np.isnan, np.any),
    np.isinf: _of_values(np.isinf, np.any),
}
