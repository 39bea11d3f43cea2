"""Arguments and batches: which elements there are, where they lie, and what overlaps.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

import itertools
import re
from typing import Any

import numpy as np

_ndarray, _float32, _float64 = np.ndarray, np.float32, np.float64
_FLOAT32, _FLOAT64 = np.dtype(np.float32), np.dtype(np.float64)


def _converted(values: tuple[Any, ...]) -> list[Any] | None:
    """Numbers, lists and arrays of both precisions as arrays of one; None if they are anything else.

    They are doubles where one of them is, Python's own numbers apart, and where there are no others.
    """
    arrays, own = [], []
    for value in values:
        if type(value) is _float64 or type(value) is float:
            array = np.array(value, _FLOAT64)
        elif type(value) is _float32:
            array = np.array(value, _FLOAT32)
        elif type(value) in (list, tuple, int):
            try:
                array = np.array(value)
            except ValueError:
                return None
            if array.dtype.kind in "biu":
                array = array.astype(_FLOAT64)
        else:
            array = value
        if type(array) is not _ndarray or (array.dtype is not _FLOAT64 and array.dtype is not _FLOAT32):
            return None
        if type(value) is not float and type(value) is not int:
            own.append(array.dtype)
        arrays.append(array)
    dtype = _FLOAT32 if own and _FLOAT64 not in own else _FLOAT64
    return [array.astype(dtype, copy=False) for array in arrays]


def _as_array(kernel: Any, name: str, value: Any) -> np.ndarray[Any, Any]:
    """An argument of a kernel as an array of numbers that it takes.

    Integers and truth values are cast as numpy's functions cast them: to the smallest type that holds them all.
    """
    given = isinstance(value, (np.ndarray, np.generic))
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{kernel.name}: argument {name} is not an array of numbers ({error})") from None
    if array.dtype.kind in "biu":
        array = array.astype(np.result_type(array.dtype, _FLOAT32) if given else _FLOAT64)
    if array.dtype.kind not in "fc" or array.dtype.itemsize not in ((4, 8) if array.dtype.kind == "f" else (8, 16)):
        raise TypeError(
            f"{kernel.name}: argument {name} has dtype {array.dtype}; expected float32, float64"
            + (", complex64 or complex128" if kernel._polynomial else "")
            + f"; convert it with {name}.astype(float)"
        )
    return array


def _leading(kernel: Any, operands: list[Any]) -> tuple[int, ...]:
    """The shape of the batch that arguments make together."""
    shapes = [
        operand.shape[: operand.ndim - len(shape)] for operand, shape in zip(operands, kernel._shapes, strict=True)
    ]
    longest = max(shapes, key=len)
    if all(shape == longest or not shape for shape in shapes):
        return tuple(longest)
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        text = ", ".join(
            f"{name} {tuple(operand.shape)}" for (name, _), operand in zip(kernel._inputs, operands, strict=True)
        )
        raise ValueError(f"{kernel.name}: leading axes do not broadcast: {text}; expected {kernel.signature}") from None


def _checked_outs(kernel: Any, out: Any, leading: tuple[int, ...], dtype: np.dtype[Any]) -> list[Any] | None:
    """What a caller gave to be written, one array for each result; None where nothing was given."""
    if out is None:
        return None
    outs = [out] if len(kernel._outputs) == 1 and not isinstance(out, tuple) else out
    if not isinstance(outs, (list, tuple)) or len(outs) != len(kernel._outputs):
        names = ", ".join(name for name, _ in kernel._outputs)
        found = f"{len(outs)} arrays" if isinstance(outs, (list, tuple)) else type(out).__name__
        raise TypeError(f"{kernel.name}: out is {found}; expected a tuple of {len(kernel._outputs)} arrays ({names})")
    for (name, shape), target in zip(kernel._outputs, outs, strict=True):
        place = f"{kernel.name}: out" if len(outs) == 1 else f"{kernel.name}: out {name}"
        if not isinstance(target, np.ndarray):
            raise TypeError(f"{place} is {type(target).__name__}; expected an array")
        if target.shape != leading + shape:
            raise ValueError(f"{place} has shape {target.shape}; expected {leading + shape}{kernel._blades(name)}")
        if target.dtype != dtype:
            raise TypeError(f"{place} has dtype {target.dtype}; expected {dtype}, the type of the arguments")
        if not target.flags.writeable:
            raise ValueError(f"{place} is read-only; expected an array that can be written")
    return list(outs)


def _usable(array: Any, dtype: np.dtype[Any]) -> Any:
    if array.dtype is dtype and array.flags.aligned:
        return array
    return np.require(array, dtype, "A")


def _overlap(array: Any, out: Any, n_axes: int) -> bool:
    """Whether writing an output would change an element of an argument that is still to be read.

    It may be where the argument is, if that has all axes of the batch: `n_axes` with those of its elements.
    """
    return np.may_share_memory(array, out) and not (
        array.ndim == n_axes
        and array.shape == out.shape
        and array.strides == out.strides
        and _address(array) == _address(out)
    )


def _steps(array: Any, leading: tuple[int, ...], shape: tuple[int, ...]) -> tuple[int, ...]:
    """Bytes from element to element along each leading axis, then along the axes of one element."""
    strides: tuple[int, ...] = array.strides
    missing = len(leading) + len(shape) - len(strides)
    if not missing and array.shape[: len(leading)] == leading:
        return strides
    outer = [
        step if size > 1 else 0 for step, size in zip(strides, array.shape[: len(leading) - missing], strict=False)
    ]
    return (*(0 for _ in range(missing)), *outer, *strides[len(outer) :])


def _coalesced(leading: tuple[int, ...], steps: list[tuple[int, ...]]) -> tuple[list[int], list[tuple[int, ...]]]:
    """The fewest loops over the same elements: neighbouring axes become one where every array allows it."""
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


def _offsets(sizes: list[int], steps: list[tuple[int, ...]], inner: int) -> list[list[int]]:
    """Where the inner loop starts in every array, once for each turn of the outer loops."""
    outer = [axis for axis in range(len(sizes)) if axis != inner]
    return [
        [sum(step[axis] * turn for axis, turn in zip(outer, turns, strict=True)) for step in steps]
        for turns in itertools.product(*(range(sizes[axis]) for axis in outer))
    ]


def _address(array: Any) -> int:
    return int(array.__array_interface__["data"][0])


def _returned(results: list[Any]) -> Any:
    """Results as a call gives them: one or a tuple, and numbers where there is no axis."""
    results = [result if result.ndim else result[()] for result in results]
    return results[0] if len(results) == 1 else tuple(results)


def _shape_text(shape: tuple[int, ...]) -> str:
    return f"({', '.join(['...', *map(str, shape)])})"


def _parsed(signature: str) -> list[list[tuple[int, ...]]] | None:
    """The shapes of arguments and of results in ``(8),(3,3),()->(3)``; None if it is no such text."""
    shape = r"\((?:[1-9]\d*(?:,[1-9]\d*)*)?\)"
    text = signature.replace(" ", "")
    if not re.fullmatch(f"{shape}(?:,{shape})*->{shape}(?:,{shape})*", text):
        return None
    return [[tuple(map(int, re.findall(r"\d+", one))) for one in re.findall(shape, part)] for part in text.split("->")]
