"""Kernels compiled with the public interface of numba, for releases that lack the internals used by `llvm`.

Loops run over copies in C order, one element after the other, and are slower than those of `kernels`. Transcendental
functions are those of the C library. `scalar_kernel` accepts tuples and numbers only.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any

import numba
import numpy as np

from ..definition import Definition, Shape
from ..foreign import LOCK
from ..functions import SCALAR_FUNCTIONS, bound

_names: dict[str, Any] = {}


def scalar_kernel(definition: Definition) -> Any:
    """Return the kernel on one element for functions compiled by numba."""
    if not definition.is_generated:
        return numba.njit(getattr(definition.function, "py_func", definition.function), error_model="numpy")
    with LOCK:
        if not _names:
            for name, scalar in SCALAR_FUNCTIONS.items():
                is_ours = isinstance(scalar, FunctionType)
                _names[name] = numba.njit(bound(scalar, {}), error_model="numpy") if is_ours else scalar
    return numba.njit(bound(definition.function, {"__name__": __name__, **_names}), error_model="numpy")


class Loops:
    """The loop of a kernel over a batch of any dtype, which is compiled on first use.

    Attributes
    ----------
    addresses : tuple of int
        Zeros: the extension cannot call it.
    """

    addresses = 0, 0, 0

    def __init__(self, definition: Definition, dtype: np.dtype[Any]) -> None:
        self._shapes, self._out_shapes = definition.shapes, definition.out_shapes
        self._run = _loop_over(scalar_kernel(definition), self._shapes, self._out_shapes)

    def run_arrays(self, operands: Sequence[Any], targets: Sequence[Any], leading: Shape, n_threads: int) -> None:
        """Fill the results of a batch of shape `leading`, in one thread."""
        count = int(np.prod(leading))
        inputs = [
            np.ascontiguousarray(np.broadcast_to(operand, leading + shape)).reshape(count, -1)
            for operand, shape in zip(operands, self._shapes, strict=True)
        ]
        outputs = [np.empty((count, int(np.prod(shape))), target.dtype) for target, shape in self._results(targets)]
        self._run(count, *inputs, *outputs)
        for found, target in zip(outputs, targets, strict=True):
            target[...] = found.reshape(target.shape)

    def _results(self, targets: Sequence[Any]) -> list[tuple[Any, Shape]]:
        return list(zip(targets, self._out_shapes, strict=True))


def _loop_over(function: Any, shapes: Sequence[Shape], out_shapes: Sequence[Shape]) -> Callable[..., None]:
    """Return the loop of a function over rows of arrays, generated as text because tuples have fixed lengths."""
    arrays = [f"a{k}" for k in range(len(shapes))]
    outs = [f"b{k}" for k in range(len(out_shapes))]
    arguments = ", ".join(_tuple_text(array, shape) for array, shape in zip(arrays, shapes, strict=True))
    lines = [f"def run(count, {', '.join([*arrays, *outs])}):", "    for i in range(count):"]
    lines += [f"        found = function({arguments})"]
    for k, (out, shape) in enumerate(zip(outs, out_shapes, strict=True)):
        result = "found" if len(outs) == 1 else f"found[{k}]"
        for place, index in enumerate(itertools.product(*map(range, shape))):
            lines.append(f"        {out}[i, {place}] = {result}{''.join(f'[{n}]' for n in index)}")
    names: dict[str, Any] = {"function": function}
    exec("\n".join(lines), names)
    return numba.njit(names["run"], error_model="numpy")  # type: ignore[no-any-return]


def _tuple_text(array: str, shape: Shape, first: int = 0) -> str:
    """Return the text of a row's numbers as tuples: ``(a0[i, 0], a0[i, 1],)``."""
    if not shape:
        return f"{array}[i, {first}]"
    step = int(np.prod(shape[1:]))
    return f"({''.join(f'{_tuple_text(array, shape[1:], first + k * step)}, ' for k in range(shape[0]))})"
