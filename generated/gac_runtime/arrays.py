"""Arrays of kernel calls: conversion of arguments, shapes and strides of batches, and overlaps in memory."""

from __future__ import annotations

import itertools
import re
from typing import Any

import numpy as np

from .definition import Definition
from .layout import Layout, converted

FLOAT32, FLOAT64 = np.dtype(np.float32), np.dtype(np.float64)
_NUMBERS = frozenset((float, int))

PATIENCE = 1 << 15
"""Largest work of a call that holds the GIL, a few microseconds, in bytes; an operation counts as four bytes."""


def as_array(definition: Definition, name: str, value: Any) -> np.ndarray[Any, Any]:
    """Convert an argument of a kernel to an array of a supported dtype.

    Integers and booleans are cast as numpy's functions cast them, to the smallest floating-point type that holds them.
    """
    given = isinstance(value, (np.ndarray, np.generic))
    value = plain(f"{definition.name}: argument {name}", value, definition.layouts.get(name))
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{definition.name}: argument {name} is not an array of numbers ({error})") from None
    if array.dtype.kind in "biu":
        array = array.astype(np.result_type(array.dtype, FLOAT32) if given else FLOAT64)
    if array.dtype.kind not in "fc" or array.dtype.itemsize not in ((4, 8) if array.dtype.kind == "f" else (8, 16)):
        raise TypeError(
            f"{definition.name}: argument {name} has dtype {array.dtype}; expected float32, float64"
            + (", complex64 or complex128" if definition.is_polynomial else "")
            + f"; convert it with {name}.astype(float)"
        )
    return array


def element_of(value: Any) -> Any:
    """Return an element, or the first one in a list, tuple or array of objects, also nested; None for all else."""
    value = _opened(value)
    if not isinstance(value, (list, tuple)):
        return value if hasattr(value, "stored") else None
    kinds = set(map(type, value))
    if kinds <= _NUMBERS:
        return None
    if any(hasattr(kind, "stored") for kind in kinds):
        return next(each for each in value if hasattr(each, "stored"))
    return element_of(value[0]) if value and isinstance(value[0], (list, tuple)) else None


def _opened(value: Any) -> Any:
    """Return the list, or the single entry, of an array of objects, and all else unchanged."""
    return value.tolist() if isinstance(value, np.ndarray) and value.dtype == object else value


def entries_of(value: Any) -> tuple[Any, bool]:
    """Return a value, of an array of elements its list or its single entry, and whether it is a list of elements."""
    if element_of(value) is None:
        return value, False
    entries = _opened(value)
    return entries, isinstance(entries, (list, tuple))


def plain(where: str, value: Any, layout: Layout | None) -> Any:
    """Return an argument without what an array cannot keep: an element in the layout of a kernel, numbers as they are.

    A list or an array of elements is converted element by element.

    Raises
    ------
    TypeError
        If an element cannot be converted to the layout, may not satisfy its relations, or is not of unit norm where it
        has to be, or if an array has masked entries.
    ValueError
        If the elements of a list have different shapes.
    """
    value, is_list = entries_of(value)
    if is_list:
        parts = [np.asarray(plain(f"{where}[{k}]", each, layout)) for k, each in enumerate(value)]
        if len({part.shape for part in parts}) > 1:
            shapes = ", ".join(str(part.shape) for part in parts)
            raise ValueError(f"{where} is a list of elements of shapes {shapes}; expected one shape")
        return np.stack(parts)
    refuse_mask(where, value)
    stored = getattr(value, "stored", None)
    if stored is None or layout is None:
        return value
    values, own = stored
    found = converted(where, values, own, layout)
    if layout.related and own.identity != layout.identity:
        raise TypeError(
            f"{where} is {own.name}; expected {layout.name}, whose relations it may not satisfy; convert it"
        )
    if layout.unit and not own.unit:
        value.require_unit(where)
    return found


def masked_in(where: str, value: Any) -> tuple[str, int] | None:
    """Return the place and the number of masked entries of an array, or of the first such array in a list; or None."""
    if isinstance(value, np.ma.MaskedArray):
        count = int(np.count_nonzero(np.ma.getmaskarray(value)))
        return (where, count) if count else None
    level: Any = value if type(value) in (list, tuple) else ()
    while not (kinds := set(map(type, level))) <= _NUMBERS:  # by levels, since lists may have many rows
        if any(issubclass(kind, np.ma.MaskedArray) for kind in kinds):
            found = (masked_in(f"{where}[{k}]", each) for k, each in enumerate(value))
            return next((each for each in found if each), None)
        level = list(itertools.chain.from_iterable(each for each in level if type(each) in (list, tuple)))
    return None


def refuse_mask(where: str, value: Any) -> None:
    """Raise an error for a masked array with masked entries, also in a list: numpy would use what is behind the mask.

    Raises
    ------
    TypeError
    """
    found = masked_in(where, value)
    if found:
        raise TypeError(
            f"{found[0]} has {found[1]} masked numbers; expected an array without a mask; fill it with np.ma.filled"
        )


def in_order(kernel: str, names: list[str], arrays: tuple[Any, ...], named: dict[str, Any]) -> tuple[Any, ...]:
    """Return the arguments of a call in order, given that some were passed by name."""
    expected = ", ".join(names)
    for name in named:
        if name not in names:
            raise TypeError(f"{kernel}: unknown argument {name}; expected {expected}, out or num_threads")
        if name in names[: len(arrays)]:
            raise TypeError(f"{kernel}: argument {name} is passed by position and by name; expected it once")
    missing = [name for name in names[len(arrays) :] if name not in named]
    if missing:
        raise TypeError(f"{kernel}: missing argument {' and '.join(missing)}; expected {expected}")
    return (*arrays, *(named[name] for name in names[len(arrays) :]))


def leading_shape(definition: Definition, operands: list[Any]) -> tuple[int, ...]:
    """Return the shape of the batch to which the arguments broadcast."""
    shapes = [
        operand.shape[: operand.ndim - len(shape)] for operand, shape in zip(operands, definition.shapes, strict=True)
    ]
    longest = max(shapes, key=len, default=())
    if all(shape == longest or not shape for shape in shapes):
        return tuple(longest)
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        text = ", ".join(
            f"{name} {tuple(operand.shape)}" for (name, _), operand in zip(definition.inputs, operands, strict=True)
        )
        raise ValueError(
            f"{definition.name}: leading axes do not broadcast: {text}; expected {definition.signature}"
        ) from None


def checked_outs(definition: Definition, out: Any, leading: tuple[int, ...], dtype: np.dtype[Any]) -> list[Any] | None:
    """Check the argument `out` and return one array for each result; None if `out` is None."""
    if out is None:
        return None
    outs = [out] if len(definition.outputs) == 1 and not isinstance(out, tuple) else out
    if not isinstance(outs, (list, tuple)) or len(outs) != len(definition.outputs):
        names = ", ".join(name for name, _ in definition.outputs)
        found = f"{len(outs)} arrays" if isinstance(outs, (list, tuple)) else type(out).__name__
        raise TypeError(
            f"{definition.name}: out is {found}; expected a tuple of {len(definition.outputs)} arrays ({names})"
        )
    for (name, shape), target in zip(definition.outputs, outs, strict=True):
        place = f"{definition.name}: out" if len(outs) == 1 else f"{definition.name}: out {name}"
        if not isinstance(target, np.ndarray):
            raise TypeError(f"{place} is {type(target).__name__}; expected an array")
        if target.shape != leading + shape:
            raise ValueError(f"{place} has shape {target.shape}; expected {leading + shape}{definition.blades(name)}")
        if target.dtype != dtype:
            raise TypeError(f"{place} has dtype {target.dtype}; expected {dtype}, the type of the arguments")
        if not target.flags.writeable:
            raise ValueError(f"{place} is read-only; expected an array that can be written")
    return list(outs)


def usable(array: Any, dtype: np.dtype[Any]) -> Any:
    """Return the array itself, or a copy of dtype `dtype` with aligned memory if required."""
    if array.dtype is dtype and array.flags.aligned:
        return array
    return np.require(array, dtype, "A")


def overlaps(array: Any, out: Any, n_axes: int) -> bool:
    """Whether writing an output could change an element of an argument before it is read.

    An output in the same memory as the argument is safe if the argument has all `n_axes` axes: those of the batch and
    those of its elements.
    """
    return np.may_share_memory(array, out) and not (
        array.ndim == n_axes
        and array.shape == out.shape
        and array.strides == out.strides
        and address_of(array) == address_of(out)
    )


def steps_of(array: Any, leading: tuple[int, ...], shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the strides in bytes along each leading axis of the batch, then along the axes of one element."""
    strides: tuple[int, ...] = array.strides
    missing = len(leading) + len(shape) - len(strides)
    if not missing and array.shape[: len(leading)] == leading:
        return strides
    outer = [
        step if size > 1 else 0 for step, size in zip(strides, array.shape[: len(leading) - missing], strict=False)
    ]
    return (*(0 for _ in range(missing)), *outer, *strides[len(outer) :])


def coalesced(leading: tuple[int, ...], steps: list[tuple[int, ...]]) -> tuple[list[int], list[tuple[int, ...]]]:
    """Merge neighbouring axes where the strides of every array allow it, and return the fewest loops over a batch."""
    depth = len(leading)
    if depth == 1:
        return list(leading), steps
    axes = [axis for axis in range(depth) if leading[axis] > 1]
    axes.sort(key=lambda axis: [-abs(step[axis]) for step in reversed(steps)])
    sizes: list[int] = []
    kept: list[list[int]] = []
    for axis in axes:
        strides = [step[axis] for step in steps]
        if kept and all(outer == stride * leading[axis] for outer, stride in zip(kept[-1], strides, strict=True)):
            kept[-1], sizes[-1] = strides, sizes[-1] * leading[axis]
        else:
            kept.append(strides)
            sizes.append(leading[axis])
    if not sizes:
        sizes, kept = [1], [[0] * len(steps)]
    return sizes, [(*(strides[k] for strides in kept), *step[depth:]) for k, step in enumerate(steps)]


def outer_offsets(sizes: list[int], steps: list[tuple[int, ...]], inner: int) -> list[list[int]]:
    """Return the offsets at which the inner loop starts in each array, for each iteration of the outer loops."""
    outer = [axis for axis in range(len(sizes)) if axis != inner]
    return [
        [sum(step[axis] * turn for axis, turn in zip(outer, turns, strict=True)) for step in steps]
        for turns in itertools.product(*(range(sizes[axis]) for axis in outer))
    ]


def address_of(array: Any) -> int:
    """Return the address of the first element."""
    return int(array.__array_interface__["data"][0])


def as_returned(results: list[Any]) -> Any:
    """Return results in the form of a call: one array or a tuple; arrays without axes become numbers."""
    results = [result if result.ndim else result[()] for result in results]
    return results[0] if len(results) == 1 else tuple(results)


def parsed_signature(signature: str) -> list[list[tuple[int, ...]]] | None:
    """Return the shapes of arguments (possibly none) and of results in ``(8),(3,3),()->(3)``; None if malformed."""
    shape = r"\((?:[1-9]\d*(?:,[1-9]\d*)*)?\)"
    text = signature.replace(" ", "")
    if not re.fullmatch(f"(?:{shape}(?:,{shape})*)?->{shape}(?:,{shape})*", text):
        return None
    return [[tuple(map(int, re.findall(r"\d+", one))) for one in re.findall(shape, part)] for part in text.split("->")]
