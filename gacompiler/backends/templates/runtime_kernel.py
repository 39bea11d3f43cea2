"""The kernel object of a generated module: it checks its arguments and finds the way to run them.

All ways to call a kernel share those checks, so they are one file.
Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from .runtime_extension import _Call, _extension, _Signature
from .runtime_functions import _evaluate, _namespace, _namespace_operands
from .runtime_layout import Layout
from .runtime_libraries import (
    _LOCK,
    _c_address,
    _c_element,
    _c_loop,
    _c_ways,
    _from_buffer,
    _plan,
    _run_batch,
    backend,
)
from .runtime_numba import _kernel_of, _Loops, _scalar_kernel
from .runtime_strides import (
    _FLOAT32,
    _FLOAT64,
    _as_array,
    _checked_outs,
    _coalesced,
    _converted,
    _float64,
    _leading,
    _ndarray,
    _overlap,
    _returned,
    _shape_text,
    _steps,
    _usable,
)
from .runtime_threads import _LEAST_WORK, _checked_threads

_empty = np.empty
_DENSE = 0x101
"""numpy's flags of an aligned array in C order."""
_ALIGNED = 0x100
_PATIENCE = 1 << 15
"""Bytes and operations, in bytes, of a batch that other threads of Python need not wait for: a few microseconds."""
_N_PLANS = 256
"""How many shapes and strides a kernel remembers how to call."""


class Kernel(_Call):  # type: ignore[misc]
    """A generated function: call it on arrays. Leading axes broadcast; the last axes are those of `signature`.

    Arguments are given in order or by name, ``kernel(m=motors, p=points)``; in order is quicker for one element.
    ``kernel(..., out=array)`` writes to an array, ``kernel(..., num_threads=2)`` shares the elements of a large batch
    among threads; where a call does not say, the module's `num_threads` holds.

    Attributes
    ----------
    name, signature : str
        The signature is that of a generalised ufunc, ``(8),(3)->(3)``.
    layouts : mapping of str to Layout
        By name of argument and result.
    output_sizes : dict of str to int
        The axes of the results by their names in the signature, which `dask.array.apply_gufunc` asks for.
    cost : mapping of str to int
        Operations for one element: mul, add, div, sqrt, call, fma.
    jit
        The kernel on one element for functions under ``numba.njit``, which inline it. Arguments are numbers, and
        arrays in any layout or tuples. ``jit(m, p)`` returns a number, a tuple of numbers, a tuple of rows, or a tuple
        of such results, and needs no memory; ``jit(m, p, out)`` writes to arrays, a number to entry 0. Loops over
        whole arrays are quicker as a kernel, see `of`.
    """

    __signature__ = _Signature()

    def __init__(
        self,
        name: str,
        doc: str,
        inputs: tuple[tuple[str, tuple[int, ...]], ...],
        outputs: tuple[tuple[str, tuple[int, ...]], ...],
        layouts: dict[str, Layout],
        cost: dict[str, int],
        polynomial: bool,
        functions: tuple[Callable[..., None], ...],
        forms: tuple[tuple[tuple[str, ...], int, int, tuple[Callable[..., None], ...]], ...] = (),
    ) -> None:
        self.name = self.__name__ = self.__qualname__ = name
        self.__doc__ = doc
        self.layouts: Mapping[str, Layout] = MappingProxyType(layouts)
        self.cost: Mapping[str, int] = MappingProxyType(cost)
        self.signature = "->".join(
            ",".join(f"({','.join(map(str, shape))})" for _, shape in parts) for parts in (inputs, outputs)
        )
        self._inputs, self._outputs = inputs, outputs
        self._names = [name if name not in ("out", "num_threads") else f"{name}_" for name, _ in inputs]
        self._shapes = [shape for _, shape in inputs]
        self._out_shapes = [shape for _, shape in outputs]
        self.output_sizes = {str(size): size for shape in self._out_shapes for size in shape}
        self._all_shapes = [*self._shapes, *self._out_shapes]
        self._n_inputs = len(inputs)
        self._single_out = self._out_shapes[0] if len(outputs) == 1 and self._out_shapes[0] else None
        self._pair = tuple(self._shapes) if len(inputs) == 2 and all(self._shapes) and self._single_out else None
        self._polynomial = polynomial
        # Bytes, and operations as so many bytes, of one element in doubles.
        self._work = 8 * sum(int(np.prod(shape)) for shape in self._all_shapes) + 4 * sum(cost.values())
        self._functions, self._forms = functions, forms
        self._user: Any = None
        self._loops: dict[Any, Callable[..., Any]] = {}
        self._ways = [(0, 0, 0), (0, 0, 0)]
        self._plans: tuple[dict[Any, Any], dict[Any, Any]] = ({}, {})
        self._element: Callable[..., Any] | None = None
        self._jit: Any = None

    @classmethod
    def of(cls, function: Callable[..., Any], signature: str) -> Kernel:
        """A kernel of one's own: a chain of kernels, or anything else that numba compiles, at the speed of one kernel.

        Parameters
        ----------
        function : callable
            Under ``numba.njit`` or not yet. It is given one element: numbers, tuples of numbers, and tuples of rows.
            It returns the same, as a tuple where there are several results, and changes nothing else.
        signature : str
            Shapes of its arguments and results, ``(8),(3),()->(3)``.

        Returns
        -------
        Kernel
            It is run by numba; leading axes broadcast, and ``out`` may be an argument. It is compiled in each process.

        Raises
        ------
        ValueError
            When the signature is none, or has not as many arguments as the function.
        """
        return _kernel_of(cls, function, signature)  # type: ignore[no-any-return]

    def __repr__(self) -> str:
        return f"<kernel {self.__module__}.{self.name}{self.signature}>"

    def __reduce__(self) -> str:
        return self.name

    @property
    def _backend(self) -> str:
        """What runs it."""
        return backend if self._user is None else "numba"

    def _in_python(self, *arrays: Any, out: Any = None, num_threads: int | None = None, **named: Any) -> Any:
        """A call that the extension does not do, or any where it is not there."""
        if named:
            threads = {} if num_threads is None else {"num_threads": num_threads}
            return self(*self._in_order(arrays, named), out=out, **threads)
        element = self._element
        if element is None or num_threads is not None or len(arrays) != self._n_inputs:
            known = self._loops and self._backend == "numba" and len(arrays) == self._n_inputs
            return self._planned(arrays, out) if known and num_threads is None else self._call(arrays, out, num_threads)
        # One element of C-ordered doubles, the call that per-call overhead matters for; two arrays without a loop.
        if self._pair is not None:
            a, b = arrays
            if (
                type(a) is _ndarray
                and type(b) is _ndarray
                and a.dtype is _FLOAT64
                and b.dtype is _FLOAT64
                and (a.shape, b.shape) == self._pair
                and a.flags.carray
                and b.flags.carray
            ):
                if out is None:
                    out = _empty(self._single_out)
                elif not self._takes(out):
                    return self._call(arrays, out)
                element(_from_buffer(a), _from_buffer(b), _from_buffer(out))
                return out
        pointers = []
        for array, shape in zip(arrays, self._shapes):  # noqa: B905
            if type(array) is _ndarray:
                if array.dtype is not _FLOAT64 or array.shape != shape or not array.flags.carray:
                    return self._planned(arrays, out)
                pointers.append(_from_buffer(array) if shape else float(array))
            elif not shape and (type(array) is float or type(array) is _float64):
                pointers.append(array)
            else:
                return self._planned(arrays, out)
        if out is None:
            if self._single_out is not None:
                out = _empty(self._single_out)
                element(*pointers, _from_buffer(out))
                return out
            results = [_empty(shape) for shape in self._out_shapes]
            element(*pointers, *map(_from_buffer, results))
            return _returned(results)
        if self._takes(out):
            element(*pointers, _from_buffer(out))
            return out
        return self._call(arrays, out)

    if _extension is None:
        __call__ = _in_python

    def _in_order(self, arrays: tuple[Any, ...], named: dict[str, Any]) -> list[Any]:
        """The arguments of a call of which some are given by name."""
        expected = ", ".join(self._names)
        for name in named:
            if name not in self._names:
                raise TypeError(f"{self.name}: an unknown argument {name}; expected {expected}, and out or num_threads")
            if name in self._names[: len(arrays)]:
                raise TypeError(f"{self.name}: argument {name} is given in order and by name; expected it once")
        missing = [name for name in self._names[len(arrays) :] if name not in named]
        if missing:
            raise TypeError(f"{self.name}: no argument {' and '.join(missing)}; expected {expected}")
        return [*arrays, *(named[name] for name in self._names[len(arrays) :])]

    def _takes(self, out: Any) -> bool:
        """Whether one element can be written to `out` as it is."""
        return type(out) is _ndarray and out.dtype is _FLOAT64 and out.shape == self._single_out and out.flags.carray

    def _planned(self, arrays: tuple[Any, ...], out: Any) -> Any:
        """A batch like one before: nothing but pointers is new. All else goes the long way."""
        dtype = getattr(arrays[0], "dtype", None)
        key: list[tuple[Any, ...]] = []
        pointers = []
        for array in arrays:
            if type(array) is not _ndarray or array.dtype is not dtype:
                converted = _converted(arrays)
                return self._call(arrays, out) if converted is None else self(*converted, out=out)
            flags = array.flags.num
            if flags & _DENSE == _DENSE:
                key.append(array.shape)
                pointers.append(_from_buffer(array))
            elif flags & _ALIGNED:
                # Only dense arrays have a buffer, and one without elements is dense.
                key.append((array.shape, array.strides))
                pointers.append(_from_buffer(array[:0]))
            else:
                return self._call(arrays, out)
        if dtype is _FLOAT64 or dtype is _FLOAT32:
            plans = self._plans[dtype is _FLOAT32]
            if type(out) is _ndarray and not out.flags.c_contiguous:
                if out.dtype is not dtype:
                    return self._call(arrays, out)
                key.append((out.shape, out.strides))
            plan = plans.get(tuple(key))
            if plan is None:
                plan = self._plan(arrays, out)
                if plan is not None:
                    if len(plans) >= _N_PLANS:
                        plans.clear()
                    plans[tuple(key)] = plan
            if plan is not None:
                run, shapes, size = plan
                if out is None:
                    results = [_empty(shape, dtype) for shape in shapes]
                    pointers += map(_from_buffer, results)
                elif (
                    type(out) is _ndarray
                    and [out.shape] == shapes
                    and out.dtype is dtype
                    and out.flags.behaved
                    and not any(
                        _overlap(array, out, out.ndim - len(self._out_shapes[0]) + len(shape))
                        for array, shape in zip(arrays, self._shapes)  # noqa: B905
                    )
                ):
                    results = [out]
                    pointers.append(_from_buffer(out if out.flags.c_contiguous else out[:0]))
                else:
                    return self._call(arrays, out)
                run(pointers, 1 if size * self._work < _LEAST_WORK else _checked_threads(self.name, None))
                return out if out is not None else results[0] if self._single_out is not None else _returned(results)
        return self._call(arrays, out)

    def _plan(
        self, arrays: tuple[Any, ...], out: Any
    ) -> tuple[Callable[[list[Any], int], None], list[tuple[int, ...]], int] | None:
        """What to call with the pointers of such arrays, the shapes of its results, and how many elements there are.

        None if one call is not all.
        """
        plain = self._plain(arrays)
        if plain is None or 0 in plain[0]:
            return None
        leading, dtype = plain
        shapes = [leading + shape for shape in self._out_shapes]
        given = type(out) is _ndarray and [out.shape] == shapes and out.dtype is dtype
        operands = [*arrays, *([out] if given else (np.empty(shape, dtype) for shape in shapes))]
        steps = [_steps(array, leading, shape) for array, shape in zip(operands, self._all_shapes, strict=True)]
        sizes, steps = _coalesced(leading, steps)
        return (_plan(self, self._loop(dtype), sizes[0], steps), shapes, sizes[0]) if len(sizes) == 1 else None

    @property
    def jit(self) -> Any:
        """The scalar kernel, compiled by numba on its first call."""
        if self._jit is None:
            with _LOCK:
                if self._jit is None:
                    self._jit = _scalar_kernel(self)
        return self._jit

    def _call(self, arrays: tuple[Any, ...], out: Any, num_threads: int | None = None) -> Any:
        if len(arrays) != len(self._inputs):
            names = ", ".join(name for name, _ in self._inputs)
            raise TypeError(f"{self.name}: {len(arrays)} arguments; expected {len(self._inputs)} ({names})")
        n_threads = _checked_threads(self.name, num_threads)
        plain = self._plain(arrays)
        if plain is not None:
            operands, (leading, dtype) = list(arrays), plain
        else:
            namespace = _namespace(arrays)
            if namespace is not np:
                if self._user is not None:
                    raise TypeError(f"{self.name}: arrays of {namespace.__name__}; expected numpy arrays")
                return self._call_arrays(namespace, arrays, out)
            operands, dtype = self._checked(arrays)
            leading = _leading(self, operands)
        outs = _checked_outs(self, out, leading, dtype)
        if dtype.kind == "c" or self._backend == "arrays":
            results = _evaluate(self, np, operands, leading)
            if outs is None:
                outs = [np.asarray(result, dtype, order="C") for result in results]
            else:
                for target, result in zip(outs, results, strict=True):
                    target[...] = result
        else:
            if outs is None:
                outs = [np.empty(leading + shape, dtype) for shape in self._out_shapes]
                self._run(operands, outs, leading, dtype, False, n_threads)
            else:
                self._run(operands, outs, leading, dtype, True, n_threads)
        if out is not None:
            return out
        return _returned(outs)

    def _plain(self, arrays: tuple[Any, ...]) -> tuple[tuple[int, ...], np.dtype[Any]] | None:
        """Leading shape and type, if these are aligned float arrays of one type and of one leading shape or none."""
        leading: tuple[int, ...] = ()
        dtype = None
        for array, shape in zip(arrays, self._shapes):  # noqa: B905
            if type(array) is not _ndarray:
                return None
            if dtype is None:
                dtype = array.dtype
                if dtype is not _FLOAT64 and dtype is not _FLOAT32:
                    return None
            elif array.dtype is not dtype:
                return None
            found = array.shape
            n_leading = len(found) - len(shape)
            if n_leading < 0 or found[n_leading:] != shape or not array.flags.aligned:
                return None
            if n_leading:
                if leading and leading != found[:n_leading]:
                    return None
                leading = found[:n_leading]
        return None if dtype is None else (leading, dtype)

    def _checked(self, arrays: tuple[Any, ...]) -> tuple[list[Any], np.dtype[Any]]:
        """The arguments as arrays of one type, and that type."""
        operands, strong = [], []
        for (name, shape), value in zip(self._inputs, arrays, strict=True):
            array = _as_array(self, name, value)
            if array.shape[array.ndim - len(shape) :] != shape or array.ndim < len(shape):
                raise ValueError(
                    f"{self.name}: argument {name} has shape {array.shape}; expected {_shape_text(shape)}"
                    + self._blades(name)
                )
            operands.append(array)
            if type(value) not in (int, float):
                strong.append(array.dtype)
        if not strong:
            dtype = _FLOAT64
        elif all(other is strong[0] for other in strong):
            dtype = strong[0]
        else:
            dtype = np.result_type(*strong)
        if not dtype.isnative:
            dtype = dtype.newbyteorder("=")
        if dtype.kind == "c" and not self._polynomial:
            raise TypeError(
                f"{self.name}: complex arguments, but the kernel is not polynomial; expected float32 or float64"
            )
        return [_usable(operand, dtype) for operand in operands], dtype

    def _blades(self, name: str) -> str:
        layout = self.layouts.get(name)
        return f" with last axis {' '.join(layout.blades)}" if layout is not None and layout.blades else ""

    def _run(
        self,
        operands: list[Any],
        outs: list[Any],
        leading: tuple[int, ...],
        dtype: np.dtype[Any],
        given: bool,
        n_threads: int,
    ) -> None:
        """Fill `outs`, with the inner loop over the longest axis that all arrays have at constant strides."""
        if 0 in leading:
            return
        n_threads = n_threads if math.prod(leading) * self._work >= _LEAST_WORK else 1
        targets = outs
        if given:
            targets = list(outs)
            for k, target in enumerate(outs):
                if not target.flags.aligned or any(np.may_share_memory(target, other) for other in outs[:k]):
                    targets[k] = np.empty(target.shape, dtype)
            n_axes = [len(leading) + len(shape) for shape in self._shapes]
            operands = [
                operand.copy() if any(_overlap(operand, target, n) for target in targets) else operand
                for operand, n in zip(operands, n_axes, strict=True)
            ]
        arrays = [*operands, *targets]
        steps = [_steps(array, leading, shape) for array, shape in zip(arrays, self._all_shapes)]  # noqa: B905
        sizes, steps = _coalesced(leading, steps)
        inner = max(range(len(sizes)), key=lambda axis: (sizes[axis], axis)) if len(sizes) > 1 else 0
        _run_batch(self, self._loop(dtype), arrays, sizes, steps, inner, n_threads)
        for target, final in zip(targets, outs, strict=True):
            if target is not final:
                final[...] = target

    def _loop(self, dtype: np.dtype[Any]) -> Callable[..., Any]:
        """The loop over batches of one type; once it is there, the extension runs it too."""
        loop = self._loops.get(dtype)
        if loop is not None:
            return loop
        with _LOCK:
            if dtype in self._loops:
                return self._loops[dtype]
            function = 0
            if self._backend == "c":
                loop, self._ways[:] = _c_loop(self, dtype), _c_ways(self)
                if self._inputs:
                    function, self._element = _c_address(f"{self.name}_f64"), _c_element(self)
            else:
                loop = _Loops(self, dtype)
                self._ways[dtype.itemsize == 4] = loop.way
            if _extension is not None and self._inputs:
                shapes = tuple(self._shapes), tuple(self._out_shapes)
                limits = (_LEAST_WORK - 1) // self._work, _PATIENCE // self._work
                self._bind(*shapes, function, tuple(self._ways), *limits)
            self._loops[dtype] = loop
        return loop

    def _call_arrays(self, namespace: Any, arrays: tuple[Any, ...], out: Any) -> Any:
        if out is not None:
            raise TypeError(f"{self.name}: out is for numpy arrays; found arguments of {namespace.__name__}")
        operands = _namespace_operands(namespace, arrays)
        for (name, shape), operand in zip(self._inputs, operands, strict=True):
            found = tuple(operand.shape)
            if len(found) < len(shape) or found[len(found) - len(shape) :] != shape:
                raise ValueError(
                    f"{self.name}: argument {name} has shape {found}; expected {_shape_text(shape)}{self._blades(name)}"
                )
        results = _evaluate(self, namespace, operands, _leading(self, operands))
        return results[0] if len(results) == 1 else tuple(results)


if _extension is not None:
    Kernel._adopt()
