"""The kernel object of a generated module, which checks its arguments and runs the compiled function.

If the extension is built, it handles calls on elements and batches of doubles and floats. All other calls, and all
calls without the extension, are handled by `Kernel.call`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from . import checked
from .arrays import (
    FLOAT64,
    PATIENCE,
    as_array,
    as_returned,
    checked_outs,
    in_order,
    leading_shape,
    overlaps,
    parsed_signature,
    usable,
)
from .definition import Definition, Shape, result_names
from .documentation import Facts, docstring, shape_text
from .elements import as_elements, element_among, without_elements
from .extension import Call, Signature, extension
from .foreign import LOCK, StridedLoop
from .functions import evaluate, namespace_of, namespace_operands
from .layout import Layout
from .library import Library
from .threads import LEAST_WORK, checked_threads, default_threads


class Settings(Protocol):
    """The settings that a kernel reads from its module."""

    @property
    def backend(self) -> str:
        """The backend that runs its kernels: ``c``, ``numba`` or ``arrays``."""

    @property
    def num_threads(self) -> int:
        """The number of threads used for a large batch."""

    @property
    def library(self) -> Library:
        """The compiled kernels."""

    @property
    def namespace(self) -> dict[str, Any]:
        """The namespace in which the extension looks up `num_threads`."""

    def ready_backend(self) -> str:
        """Return `backend` after making it ready to run a kernel."""


_DEFAULTS: dict[str, Any] = {"num_threads": default_threads()}


class _Loop(Protocol):
    """A loop that fills the results of a batch: `StridedLoop`, or the loop of `jit.plain`."""

    def run_arrays(self, operands: Sequence[Any], targets: Sequence[Any], leading: Shape, n_threads: int) -> None:
        """Fill the results of a batch of shape `leading`, using at most `n_threads` threads."""


class _ArraysLoop:
    """Array expressions as a loop, used in the call that finds the library unusable when numba is not installed."""

    def __init__(self, definition: Definition) -> None:
        self._definition = definition

    def run_arrays(self, operands: Sequence[Any], targets: Sequence[Any], leading: Shape, n_threads: int) -> None:
        for target, result in zip(targets, evaluate(self._definition, np, [*operands], leading), strict=True):
            target[...] = result


class _UserSettings:
    """Settings of kernels that do not belong to a module, see `Kernel.of`."""

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
    """Descriptor for ``__doc__`` of the class and of each kernel; the text of a kernel is generated on access."""

    def __init__(self, text: str) -> None:
        self._text = text

    def __get__(self, kernel: Any, owner: type) -> str:
        return self._text if kernel is None else kernel.describe()


class Kernel(checked.Switched, Call):
    """A generated function of arrays. Leading axes broadcast; the last axes are those of `signature`.

    Arguments are passed by position or by name, ``kernel(m=motors, p=points)``; passing by position is faster for one
    element. If all arguments with coefficients are elements, and not arrays, so are the results with coefficients.
    ``kernel(..., out=array)`` writes the result to an array. ``kernel(..., num_threads=2)`` distributes the elements of
    a large batch over threads; the default is the `num_threads` of the module.

    Attributes
    ----------
    name, signature : str
        The signature has the form of a generalised ufunc, ``(8),(3)->(3)``.
    layouts : mapping of str to Layout
        Layouts by name of argument and result.
    output_sizes : dict of str to int
        Sizes of the axes of the results by their names in the signature, as `dask.array.apply_gufunc` requires.
    cost : mapping of str to int
        Operations for one element: mul, add, div, sqrt, call, choice, fma.
    jit
        The kernel on one element, to be called in functions compiled by ``numba.njit``, which inline it. Arguments are
        numbers, tuples, and arrays of any memory layout. ``jit(m, p)`` returns a number, a tuple of numbers, a tuple
        of rows, or a tuple of these for several results, and allocates no memory. ``jit(m, p, out)`` writes to arrays;
        a number is written to entry 0. A loop over whole arrays runs faster as a kernel, see `of`.
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
        self._in_doubles = definition.in_doubles
        self._loops: dict[Any, _Loop] = {}
        self._addresses = [(0, 0, 0), (0, 0, 0)]
        self._jit: Any = None
        self._given = [definition.layouts.get(name) for name, _ in definition.inputs]
        self._returned = [definition.layouts.get(name) for name, _ in definition.outputs]
        self._identities = tuple(layout.identity if layout and layout.blades else None for layout in self._given)
        self._units = sum(1 << k for k, layout in enumerate(self._given) if layout and layout.unit)

    @classmethod
    def of(cls, function: Callable[..., Any], signature: str) -> Kernel:
        """Create a user-defined kernel from a function that numba can compile, for example a chain of kernels.

        Parameters
        ----------
        function : callable
            A Python function or one decorated with ``numba.njit``. It receives the arguments of one element: numbers,
            tuples of numbers, and tuples of rows. It returns values of the same kinds, as a tuple if there are several
            results, and has no side effects.
        signature : str
            Shapes of its arguments and results, ``(8),(3),()->(3)``.

        Returns
        -------
        Kernel
            A kernel that is run by numba and compiled in each process. Leading axes broadcast, and ``out`` may be one
            of the arguments.

        Raises
        ------
        ValueError
            If the signature is malformed, or its number of arguments is not that of the function.
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
        """Return the text that `help` shows."""
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
        """Call the kernel with any arguments.

        Once its arguments are converted, a call that the extension can handle is passed back to it.
        """
        if named:
            threads = {} if num_threads is None else {"num_threads": num_threads}
            return self(*in_order(self.name, self.argument_names, arrays, named), out=out, **threads)
        definition = self.definition
        if len(arrays) != len(definition.inputs):
            names = ", ".join(name for name, _ in definition.inputs)
            raise TypeError(f"{self.name}: {len(arrays)} arguments; expected {len(definition.inputs)} ({names})")
        if out is None and (element := element_among(arrays, self._given)) is not None:
            return self._on_elements(element, arrays, num_threads)
        settings = self._settings
        n_threads = checked_threads(self.name, settings.num_threads if num_threads is None else num_threads)
        namespace = namespace_of(arrays)
        if namespace is not np:
            if not definition.is_generated:
                raise TypeError(f"{self.name}: arrays of {namespace.__name__}; expected numpy arrays")
            return self._call_namespace(namespace, arrays, out)
        operands, dtype = self._checked(arrays)
        if checked.active:
            checked.check(self.name, zip((name for name, _ in definition.inputs), operands, strict=True), self.layouts)
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
    """The name under which the extension looks up `call`."""
    if extension is None:
        __call__ = call

        def attempt(self, *_arrays: Any) -> None:
            """Return None: without the extension there is no fast path."""

    def _on_elements(self, element: Any, arguments: tuple[Any, ...], num_threads: int | None) -> Any:
        """Return results of the kind of `element`, and let the extension do so from now on if they are single ones."""
        names = [name for name, _ in self.definition.inputs]
        arrays = without_elements(self.name, arguments, zip(names, self._given, strict=True))
        results = as_elements(element.like, self.call(*arrays, num_threads=num_threads), self._returned)
        if extension is not None and isinstance(element, extension.Value):
            listed = results if len(self._returned) > 1 else (results,)
            types = tuple(type(x) if isinstance(x, extension.Value) else None for x in listed)
            if all((a is None) == (b is None or not b.blades) for a, b in zip(types, self._returned, strict=True)):
                self._bind_results(element, types)
        return results

    def _checked(self, arrays: tuple[Any, ...]) -> tuple[list[Any], np.dtype[Any]]:
        """Return the arguments as arrays of a common dtype, and that dtype."""
        definition = self.definition
        operands, strong = [], [FLOAT64] if self._in_doubles else []
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
        """Fill `outs`; if they were passed by the caller (`given`), they may be arguments or overlap with arguments."""
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
        """Return the loop over batches of one dtype, and register it with the extension on first use."""
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
                limits = (LEAST_WORK - 1) // self._work, PATIENCE // self._work
                space = self._settings.namespace
                layouts = self._identities, self._units
                addresses = self._addresses[0], (0, 0, 0) if self._in_doubles else self._addresses[1]
                self._binding = shapes, out_shapes, function, addresses, *limits, space, *layouts
                if not checked.active:
                    self.rebind()
            self._loops[dtype] = loop
        return loop

    @property
    def element_address(self) -> int:
        """Address of the compiled function on one element of doubles; 0 on other backends than C."""
        return self._settings.library.address(f"{self.name}_f64") if self._settings.backend == "c" else 0

    def _call_namespace(self, namespace: Any, arrays: tuple[Any, ...], out: Any) -> Any:
        """Evaluate a call on arrays of torch, jax or cupy by array expressions of that namespace."""
        if out is not None:
            raise TypeError(
                f"{self.name}: out is not supported for arrays of {namespace.__name__}; expected numpy arguments, or a "
                "call without out"
            )
        definition = self.definition
        operands = namespace_operands(namespace, arrays)
        for (name, shape), operand in zip(definition.inputs, operands, strict=True):
            found = tuple(operand.shape)
            definition.refuse_single(name, operand)
            if len(found) < len(shape) or found[len(found) - len(shape) :] != shape:
                expected = f"{shape_text(shape)}{definition.blades(name)}"
                raise ValueError(f"{self.name}: argument {name} has shape {found}; expected {expected}")
        results = evaluate(definition, namespace, operands, leading_shape(definition, operands))
        return results[0] if len(results) == 1 else tuple(results)


Kernel.__doc__ = _Documentation(Kernel.__doc__ or "")  # type: ignore[assignment]
if extension is not None:
    Kernel._adopt()
