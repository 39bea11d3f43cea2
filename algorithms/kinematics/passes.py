"""How one configuration gets to a compiled pass over the joints, and how its result comes back.

What a pass does takes less than a microsecond, and a call of a function under numba half of one. The extension of the
generated modules calls functions at an address in a tenth of that, and makes the arrays for their results; where it is
not built, numba's way is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from threading import Lock
from typing import Any
from zlib import crc32

import numpy as np
from numba import carray, cfunc, njit, types
from numba.extending import overload

from generated import pga3
from generated.gac_runtime.extension import Call, extension

PATIENCE = 32
"""Calls that a pass waits for before it is compiled, which takes seconds, or half of one where numba has kept it."""

COLUMNS = 45
"""Numbers in a row of a robot's table, see `single`; in its first row, this is the place of the number of joints."""
COUNT = COLUMNS - 1

_ARRAYS = {1: "f8[::1]", 2: "f8[:, ::1]", 3: "f8[:, :, ::1]"}
_LOCK = Lock()

Shapes = Callable[[int], tuple[tuple[int, ...], ...]]


def as_array(values: Any, shape: tuple[int, ...]) -> Any:
    """In compiled passes: numbers at an address, or an array, as an array of a shape; `ValueError` for another size."""
    raise NotImplementedError("for compiled code")


def n_joints(table: Any) -> Any:
    """In compiled passes: for how many joints a table is."""
    raise NotImplementedError("for compiled code")


@overload(as_array, strict=False)
def _as_array(values: Any, shape: Any) -> Any:
    if isinstance(values, types.CPointer):
        return lambda values, shape: carray(values, shape)
    return lambda values, shape: values.reshape(shape)


@overload(n_joints, strict=False)
def _n_joints(table: Any) -> Any:
    if isinstance(table, types.CPointer):
        return lambda table: int(table[COUNT])
    return lambda table: int(table[0, COUNT])


class Source:
    """A pass as it is written: a function of a table, of other arrays, and of one for the result.

    Parameters
    ----------
    function : callable
        Of arrays in C order or their addresses, the result last; numba compiles it.
    shapes : callable
        Shapes of the arrays after the table, from the number of joints.
    """

    def __init__(self, function: Callable[..., None], shapes: Shapes) -> None:
        self._function, self.shapes = function, shapes
        self._axes = [len(shape) or 1 for shape in shapes(1)]
        self._calls, self._compiled = 0, None

    def compiled(self, arrays: tuple[Any, ...]) -> Any:
        """What numba made of it; None until it was called with one configuration in doubles often enough."""
        if self._compiled is None and all(
            type(a) is np.ndarray and a.ndim == k and a.dtype == float
            for a, k in zip(arrays, self._axes[:-1], strict=True)
        ):
            self._calls += 1
            if self._calls > PATIENCE:
                with _LOCK:
                    self._compiled = self._compiled or self._compile()
        return self._compiled

    def _compile(self) -> Any:
        function = self._function
        # numba keeps what it compiled by this name, and knows nothing of what is in other files
        texts = (pga3.__file__, __file__)
        mark = crc32(b"".join(Path(text).read_bytes() for text in texts))
        function.__qualname__ = f"{function.__name__}_{mark:08x}"
        try:
            njit(function, cache=True)  # compiles nothing yet
        except RuntimeError:  # no folder to keep it in
            return self._under_numba(cache=False)
        return self._under_numba(cache=True)

    def _under_numba(self, cache: bool) -> Any:
        options = {"cache": cache, "error_model": "numpy"}
        if extension is not None:
            pointers = (types.CPointer(types.float64),) * (len(self._axes) + 1)
            return cfunc(types.void(*pointers), **options)(self._function)
        run = njit(self._function, **options)
        run.compile(f"void({', '.join(_ARRAYS[k] for k in (2, *self._axes))})")
        run.disable_compile()
        return run


class Pass(Call):  # type: ignore[misc]
    """A pass for robots of so many joints: called with a table and arrays of doubles, it gives a new one, or a number.

    For anything else, or as long as it is not compiled, it gives None. A table that is None belongs to a robot that
    the pass is not for.
    """

    def __init__(self, source: Source, count: int) -> None:
        *given, self._result = source.shapes(count)
        self._source, self._given = source, ((count + 1, COLUMNS), *given)
        self._bound = False

    def _in_python(self, table: Any, *arrays: Any) -> Any:
        """A call that the extension does not do."""
        if self._bound or table is None:
            return None
        run = self._source.compiled(arrays)
        if run is None:
            return None
        if extension is not None:
            # batches are not for it: of no more than 0 elements
            bound = self._bind(self._given, (self._result,), run.address, ((0, 0, 0),) * 2, 0, 0)
            if not bound:
                shapes = ", ".join(map(str, (*self._given, self._result)))
                raise RuntimeError(f"pass over arrays {shapes}: too many, or too many axes; expected what _bind takes")
            self._bound = True
            return self(table, *arrays)
        out = np.empty(self._result or 1)
        try:
            run(table, *arrays, out)
        except (TypeError, ValueError):
            return None
        return out if self._result else out[0]

    if extension is None:
        __call__ = _in_python


if extension is not None:
    Pass._adopt()


def a_pass(shapes: Shapes) -> Callable[[Callable[..., None]], Source]:
    """A decorator: the function as a `Source`."""
    return lambda function: Source(function, shapes)
