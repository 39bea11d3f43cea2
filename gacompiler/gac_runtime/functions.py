"""Implementations of the functions that appear in kernels: on numbers, and on arrays of any namespace."""

from __future__ import annotations

import builtins
import functools
import math
import sys
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from .definition import Definition


def _minimum(a: Any, b: Any) -> Any:
    return a if a < b or a != a else b


def _maximum(a: Any, b: Any) -> Any:
    return a if a > b or a != a else b


def _less(a: Any, b: Any) -> Any:
    return 1.0 if a < b else 0.0


def _less_equal(a: Any, b: Any) -> Any:
    return 1.0 if a <= b else 0.0


def _equal(a: Any, b: Any) -> Any:
    return 1.0 if a == b else 0.0


def _select(condition: Any, a: Any, b: Any) -> Any:
    return a if condition != 0 else b


SCALAR_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
    "atan2": math.atan2,
    "acos": math.acos,
    "exp": math.exp,
    "log": math.log,
    "abs": abs,
    "floor": np.floor,
    "minimum": _minimum,
    "maximum": _maximum,
    "less": _less,
    "less_equal": _less_equal,
    "equal": _equal,
    "select": _select,
}


OF_ANGLES = frozenset({"sin", "cos"})
"""Functions of angles, which vectorised code computes for angles of limited size."""


def bound(function: Callable[..., Any], names: dict[str, Any]) -> Any:
    """Return `function` with its free names bound to `names`."""
    assert isinstance(function, FunctionType)
    bound = FunctionType(function.__code__, {"__builtins__": builtins, **names}, function.__name__)
    bound.__module__, bound.__qualname__ = function.__module__, function.__qualname__
    return bound


def namespace_of(arrays: tuple[Any, ...]) -> Any:
    """Return the module whose functions operate on these arrays."""
    for array in arrays:
        root = type(array).__module__.partition(".")[0]
        if root in ("torch", "cupy"):
            return sys.modules[root]
        if root in ("jax", "jaxlib"):
            return sys.modules["jax.numpy"]
    return np


def namespace_operands(namespace: Any, arrays: tuple[Any, ...]) -> list[Any]:
    """Convert arguments to arrays of `namespace` on the device of the first such array.

    Numbers and lists do not widen the dtype.
    """
    own = [array for array in arrays if namespace_of((array,)) is namespace]
    found = functools.reduce(namespace.promote_types, [array.dtype for array in own])
    floating = (namespace.zeros((), dtype=found) + 0.5).dtype
    place = {"device": own[0].device} if namespace.__name__ == "torch" else {}
    moved = []
    for array in arrays:
        if namespace_of((array,)) is namespace:
            moved.append(array)
        elif isinstance(array, (np.ndarray, np.generic)):
            # A copy, since torch accepts neither read-only arrays nor negative strides.
            moved.append(namespace.asarray(np.array(array), **place))
        else:
            moved.append(namespace.asarray(array, dtype=floating, **place))
    return moved


def array_functions(namespace: Any) -> dict[str, Callable[..., Any]]:
    """Return the functions of a kernel's text for arrays of `namespace`.

    Numbers remain numbers, so that they do not widen the dtype.
    """

    def lifted(name: str, scalar: Callable[..., Any]) -> Callable[..., Any]:
        on_arrays = getattr(namespace, name)

        def function(*values: Any) -> Any:
            if not any(hasattr(value, "dtype") for value in values):
                return scalar(*values)
            return on_arrays(*(_lifted(namespace, value, values) for value in values))

        return function

    names = {"atan2": "arctan2", "acos": "arccos"}
    functions: dict[str, Callable[..., Any]] = {
        name: lifted(names.get(name, name), SCALAR_FUNCTIONS[name])
        for name in ("sqrt", "sin", "cos", "atan2", "acos", "exp", "log", "abs", "floor")
    }

    def choose(condition: Any, a: Any, b: Any, *others: Any) -> Any:
        if not hasattr(condition, "dtype"):
            return a if condition else b
        others = (a, b, *others)
        return namespace.where(condition, _lifted(namespace, a, others), _lifted(namespace, b, others))

    if namespace is not np:
        # The derivative of abs at zero is 0 in these namespaces; that of a kernel is the one from the negative side.
        functions["abs"] = lambda a: choose(a > 0, a, 0.0 - a)

    return functions | {
        "minimum": lambda a, b: choose((a < b) | (a != a), a, b),
        "maximum": lambda a, b: choose((a > b) | (a != a), a, b),
        "less": lambda a, b: choose(a < b, 1.0, 0.0, a, b),
        "less_equal": lambda a, b: choose(a <= b, 1.0, 0.0, a, b),
        "equal": lambda a, b: choose(a == b, 1.0, 0.0, a, b),
        "select": lambda condition, a, b: choose(condition != 0, a, b, condition),
    }


def _lifted(namespace: Any, value: Any, others: tuple[Any, ...]) -> Any:
    """Convert a number to an array like the first array among `others`."""
    if hasattr(value, "dtype"):
        return value
    return namespace.zeros_like(next(other for other in others if hasattr(other, "dtype"))) + value


def _like(namespace: Any, value: Any, like: Any) -> Any:
    """Broadcast `value`, a number or an array, to the shape of `like`."""
    if not hasattr(value, "dtype"):
        return namespace.zeros_like(like) + value
    return value if value.shape == like.shape else namespace.broadcast_to(value, like.shape)


def _components(array: Any, shape: tuple[int, ...], index: tuple[int, ...] = ()) -> Any:
    """Return the components of an array in nested tuples, the form in which a kernel expects them."""
    if len(index) == len(shape):
        return array[(..., *index)] if shape else array
    return tuple(_components(array, shape, (*index, k)) for k in range(shape[len(index)]))


def _entries(value: Any, shape: tuple[int, ...]) -> list[Any]:
    """Return the entries of nested tuples in C order."""
    return [entry for part in value for entry in _entries(part, shape[1:])] if shape else [value]


def _stacked(namespace: Any, parts: list[Any], shape: tuple[int, ...]) -> Any:
    if not shape:
        return parts[0]
    stacked = namespace.stack(parts, -1)
    return stacked if len(shape) == 1 else stacked.reshape((*stacked.shape[:-1], *shape))


def evaluate(definition: Definition, namespace: Any, operands: list[Any], leading: tuple[int, ...]) -> list[Any]:
    """Compute the results by array expressions on whole components."""
    parts = map(_components, operands, definition.shapes)
    with np.errstate(all="ignore"):
        found = bound(definition.function, array_functions(namespace))(*parts)
    results = [found] if len(definition.outputs) == 1 else found
    like = namespace.zeros(leading)
    for k, (operand, shape) in enumerate(zip(operands, definition.shapes, strict=True)):
        part = operand[(..., *(0 for _ in shape))] if shape else operand
        like = namespace.zeros_like(part if k else namespace.broadcast_to(part, leading)) + (like if k else 0)
    return [
        _stacked(namespace, [_like(namespace, part, like) for part in _entries(result, shape)], shape)
        for result, shape in zip(results, definition.out_shapes, strict=True)
    ]
