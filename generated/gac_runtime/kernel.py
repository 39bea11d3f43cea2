"""The kernel object of a generated module: it checks its arguments and runs them.

Where the extension is built, it serves calls on elements and batches of doubles and floats; all other calls, and all
calls without it, come to `Kernel.call`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from .arrays import (
    FLOAT64,
    as_array,
    as_returned,
    checked_outs,
    leading_shape,
    overlaps,
    parsed_signature,
    usable,
)
from .definition import Definition, Shape, result_names
from .documentation import Facts, docstring, shape_text
from .extension import Call, Signature, extension
from .foreign import LOCK, StridedLoop
from .functions import evaluate, namespace_of, namespace_operands
from .layout import Layout
from .library import Library
from .threads import LEAST_WORK, checked_threads, default_threads

_PATIENCE = 1 << 15
"""Work (bytes, and operations as so many bytes) for which other threads of Python wait: a few microseconds."""


class Settings(Protocol):
    """What a kernel asks its module."""

    @property
    def backend(self) -> str:
        """What runs its kernels: ``c``, ``numba`` or ``arrays``."""

    @property
    def num_threads(self) -> int:
        """How many threads share a large batch."""

    @property
    def library(self) -> Library:
        """The compiled kernels."""

    @property
    def namespace(self) -> dict[str, Any]:
        """Where the extension finds `num_threads`."""

    def ready_backend(self) -> str:
        """As `backend`, when a kernel is about to be run."""


_DEFAULTS: dict[str, Any] = {"num_threads": default_threads()}


class _Loop(Protocol):
    """What fills the results of a batch: `StridedLoop`, or the loop of `jit.plain`."""

    def run_arrays(self, operands: Sequence[Any], targets: Sequence[Any], leading: Shape, n_threads: int) -> None:
        """Fill the results of a batch of this shape, in at most so many threads."""


class _ArraysLoop:
    """Array expressions as a loop, for the call in which the library turned out not to work and numba is not there."""

    def __init__(self, definition: Definition) -> None:
        self._definition = definition

    def run_arrays(self, operands: Sequence[Any], targets: Sequence[Any], leading: Shape, n_threads: int) -> None:
        for target, result in zip(targets, evaluate(self._definition, np, [*operands], leading), strict=True):
            target[...] = result


class _UserSettings:
    """For kernels that do not belong to a module: `Kernel.of`."""

    backend = "numba"
    library = Library("", Path())

    def ready_backend(self) -> str:
        return self.backend

    @property
    def num_threads(self) -> int:
        return default_threads()

    @property
    def namespace(self) -> dict[str, Any]:
        return _DEFAULTS


class _Documentation:
    """The documentation of the class, and of each of its kernels, which is made when somebody asks for it."""

    def __init__(self, text: str) -> None:
        self._text = text

    def __get__(self, kernel: Any, owner: type) -> str:
        return self._text if kernel is None else kernel.describe()


class Kernel(Call):  # type: ignore[misc]
    """A generated function of arrays. Leading axes broadcast; the last axes are those of `signature`.

    Arguments are given in order or by name, ``kernel(m=motors, p=points)``; in order is quicker for one element.
    ``kernel(..., out=array)`` writes to an array, ``kernel(..., num_threads=2)`` shares the elements of a large batch
    among threads; the default is the `num_threads` of the module.

    Attributes
    ----------
    name, signature : str
        The signature is that of a generalised ufunc, ``(8),(3)->(3)``.
    layouts : mapping of str to Layout
        By name of argument and result.
    output_sizes : dict of str to int
        The axes of the results by their names in the signature, which `dask.array.apply_gufunc` asks for.
    cost : mapping of str to int
        Operations for one element: mul, add, div, sqrt, call, choice, fma.
    jit
        The kernel on one element for functions under ``numba.njit``, which inline it. Arguments are numbers, and
        arrays in any layout or tuples. ``jit(m, p)`` returns a number, a tuple of numbers, a tuple of rows, or a tuple
        of such results, and needs no memory; ``jit(m, p, out)`` writes to arrays, a number to entry 0. Loops over
        whole arrays are quicker as a kernel, see `of`.
    """

    __signature__ = Signature()

    def __init__(self, definition: Definition, facts: Facts | None = None, settings: Settings | None = None) -> None:
        self.name = self.__name__ = self.__qualname__ = definition.name
        self.__module__ = definition.function.__module__
        self.definition = definition
        self.layouts: Mapping[str, Layout] = MappingProxyType(dict(definition.layouts))
        self.cost: Mapping[str, int] = MappingProxyType(dict(definition.cost))
        self.signature = definition.signature
        self.output_sizes = {str(size): size for shape in definition.out_shapes for size in shape}
        self.argument_names = [
            name if name not in ("out", "num_threads") else f"{name}_" for name, _ in definition.inputs
        ]
        self._facts = facts
        self._settings: Settings = settings or _UserSettings()
        self._work = definition.work
        self._loops: dict[Any, _Loop] = {}
        self._addresses = [(0, 0, 0), (0, 0, 0)]
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
        parsed = parsed_signature(signature)
        code = getattr(function, "py_func", function).__code__
        names = code.co_varnames[: code.co_argcount]
        if parsed is None or len(parsed[0]) != len(names):
            raise ValueError(
                f"{function.__name__}: signature {signature!r}; expected the shapes of its {len(names)} arguments "
                f"({', '.join(names)}) and of its results, as in (8),(3)->(3)"
            )
        shapes, out_shapes = parsed
        outputs = list(zip(result_names(len(out_shapes)), out_shapes, strict=True))
        inputs = list(zip(names, shapes, strict=True))
        return cls(Definition(function.__name__, function, inputs, outputs, {}, {}, is_generated=False))

    def __repr__(self) -> str:
        return f"<kernel {self.__module__}.{self.name}{self.signature}>"

    def __reduce__(self) -> str:
        return self.name

    def describe(self) -> str:
        """The text of `help`."""
        if self._facts is None:
            return self.definition.function.__doc__ or ""
        return docstring(self.definition, self.layouts, self._facts)

    @property
    def jit(self) -> Any:
        """The kernel on one element under numba, compiled on its first call."""
        if self._jit is None:
            with LOCK:
                if self._jit is None:
                    from .jit import scalar_kernel

                    self._jit = scalar_kernel(self.definition)
        return self._jit

    def call(self, /, *arrays: Any, out: Any = None, num_threads: int | None = None, **named: Any) -> Any:
        """A call with any arguments. The extension gets those again that it can serve once they are converted."""
        if named:
            threads = {} if num_threads is None else {"num_threads": num_threads}
            return self(*self._in_order(arrays, named), out=out, **threads)
        definition = self.definition
        if len(arrays) != len(definition.inputs):
            names = ", ".join(name for name, _ in definition.inputs)
            raise TypeError(f"{self.name}: {len(arrays)} arguments; expected {len(definition.inputs)} ({names})")
        settings = self._settings
        n_threads = checked_threads(self.name, settings.num_threads if num_threads is None else num_threads)
        namespace = namespace_of(arrays)
        if namespace is not np:
            if not definition.is_generated:
                raise TypeError(f"{self.name}: arrays of {namespace.__name__}; expected numpy arrays")
            return self._call_namespace(namespace, arrays, out)
        operands, dtype = self._checked(arrays)
        is_run = dtype.kind != "c" and settings.backend != "arrays"
        if (
            is_run
            and num_threads is None
            and self._loops
            and extension is not None
            and any(type(a) is not np.ndarray or a.dtype != dtype or not a.flags.aligned for a in arrays)
        ):
            return self(*operands, out=out)
        leading = leading_shape(definition, operands)
        outs = checked_outs(definition, out, leading, dtype)
        if is_run:
            targets = outs or [np.empty(leading + shape, dtype) for shape in definition.out_shapes]
            self._run(operands, targets, leading, dtype, outs is not None, n_threads)
            return as_returned(targets) if out is None else out
        results = evaluate(definition, np, operands, leading)
        if outs is None:
            return as_returned([np.asarray(result, dtype, order="C") for result in results])
        for target, result in zip(outs, results, strict=True):
            target[...] = result
        return out

    _in_python = call
    """The name under which the extension knows it."""
    if extension is None:
        __call__ = call

    def _in_order(self, arrays: tuple[Any, ...], named: dict[str, Any]) -> list[Any]:
        """The arguments of a call of which some are given by name."""
        names = self.argument_names
        expected = ", ".join(names)
        for name in named:
            if name not in names:
                raise TypeError(f"{self.name}: an unknown argument {name}; expected {expected}, and out or num_threads")
            if name in names[: len(arrays)]:
                raise TypeError(f"{self.name}: argument {name} is given in order and by name; expected it once")
        missing = [name for name in names[len(arrays) :] if name not in named]
        if missing:
            raise TypeError(f"{self.name}: no argument {' and '.join(missing)}; expected {expected}")
        return [*arrays, *(named[name] for name in names[len(arrays) :])]

    def _checked(self, arrays: tuple[Any, ...]) -> tuple[list[Any], np.dtype[Any]]:
        """The arguments as arrays of one type, and that type."""
        definition = self.definition
        operands, strong = [], []
        for (name, shape), value in zip(definition.inputs, arrays, strict=True):
            array = as_array(definition, name, value)
            if array.shape[array.ndim - len(shape) :] != shape or array.ndim < len(shape):
                raise ValueError(
                    f"{self.name}: argument {name} has shape {array.shape}; expected {shape_text(shape)}"
                    + definition.blades(name)
                )
            operands.append(array)
            if type(value) not in (int, float):
                strong.append(array.dtype)
        dtype = np.result_type(*strong) if strong else FLOAT64
        if not dtype.isnative:
            dtype = dtype.newbyteorder("=")
        if dtype.kind == "c" and not definition.is_polynomial:
            raise TypeError(
                f"{self.name}: complex arguments, but the kernel is not polynomial; expected float32 or float64"
            )
        return [usable(operand, dtype) for operand in operands], dtype

    def _run(
        self,
        operands: list[Any],
        outs: list[Any],
        leading: Shape,
        dtype: np.dtype[Any],
        given: bool,
        n_threads: int,
    ) -> None:
        """Fill `outs`; those that the caller has `given` may be arguments, or overlap with some."""
        if 0 in leading:
            return
        targets = outs
        if given:
            targets = list(outs)
            for k, target in enumerate(outs):
                if not target.flags.aligned or any(np.may_share_memory(target, other) for other in outs[:k]):
                    targets[k] = np.empty(target.shape, dtype)
            n_axes = [len(leading) + len(shape) for shape in self.definition.shapes]
            operands = [
                operand.copy() if any(overlaps(operand, target, n) for target in targets) else operand
                for operand, n in zip(operands, n_axes, strict=True)
            ]
        self._loop(dtype).run_arrays(operands, targets, leading, n_threads)
        for target, final in zip(targets, outs, strict=True):
            if target is not final:
                final[...] = target

    def _loop(self, dtype: np.dtype[Any]) -> _Loop:
        """The loop over batches of one type; from then on the extension runs it too."""
        loop = self._loops.get(dtype)
        if loop is not None:
            return loop
        with LOCK:
            if dtype in self._loops:
                return self._loops[dtype]
            function = 0
            backend = self._settings.ready_backend()
            if backend == "arrays":
                return _ArraysLoop(self.definition)
            if backend == "c":
                library = self._settings.library
                loop = StridedLoop(self.definition, library.loop(self.name, dtype))
                self._addresses[:] = library.loop_addresses(self.name)
                function = library.address(f"{self.name}_f64")
            else:
                from .jit import Loops

                loop = Loops(self.definition, dtype)
                self._addresses[dtype.itemsize == 4] = loop.addresses
            shapes, out_shapes = tuple(self.definition.shapes), tuple(self.definition.out_shapes)
            if extension is not None and shapes:
                limits = (LEAST_WORK - 1) // self._work, _PATIENCE // self._work
                self._bind(shapes, out_shapes, function, tuple(self._addresses), *limits, self._settings.namespace)
            self._loops[dtype] = loop
        return loop

    @property
    def element_address(self) -> int:
        """The address of the compiled function on one element of doubles; 0 where there is none, or not yet."""
        is_there = self._settings.backend == "c" and FLOAT64 in self._loops and self.definition.inputs
        return self._settings.library.address(f"{self.name}_f64") if is_there else 0

    def _call_namespace(self, namespace: Any, arrays: tuple[Any, ...], out: Any) -> Any:
        """A call on arrays of torch, jax or cupy, by array expressions of that namespace."""
        if out is not None:
            raise TypeError(f"{self.name}: out is for numpy arrays; found arguments of {namespace.__name__}")
        definition = self.definition
        operands = namespace_operands(namespace, arrays)
        for (name, shape), operand in zip(definition.inputs, operands, strict=True):
            found = tuple(operand.shape)
            if len(found) < len(shape) or found[len(found) - len(shape) :] != shape:
                expected = f"{shape_text(shape)}{definition.blades(name)}"
                raise ValueError(f"{self.name}: argument {name} has shape {found}; expected {expected}")
        results = evaluate(definition, namespace, operands, leading_shape(definition, operands))
        return results[0] if len(results) == 1 else tuple(results)


Kernel.__doc__ = _Documentation(Kernel.__doc__ or "")  # type: ignore[assignment]
if extension is not None:
    Kernel._adopt()
