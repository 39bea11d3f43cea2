"""The kernel object with loops of a generated module, which checks its arguments, infers lengths, and runs the loop.

If the extension is built, it handles calls on doubles in C order, on one element or a batch. All other calls, and all
calls without the extension, are handled by `LoopKernel.call`. `LoopKernel` and the `BoundLoops` returned by its method
`bind` depend on each other, so they are in one file.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from pickle import PicklingError
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from . import checked as checking
from .arrays import FLOAT32, FLOAT64, address_of, as_returned, coalesced, in_order, outer_offsets, steps_of
from .documentation import Facts
from .elements import as_elements, element_among, without_elements
from .extension import LoopCall, extension
from .foreign import LOCK, foreign
from .kernel import Settings
from .layout import Layout
from .loop_arguments import (
    Fixed,
    as_fixed,
    check_rows,
    checked,
    checked_outs,
    in_doubles,
    is_unusable,
    resolved,
    usable,
)
from .loop_arrays import evaluate_loops
from .loop_definition import ROWS_TYPE, LoopDefinition, Table
from .loop_documentation import Described, LoopSignature, docstring
from .threads import LEAST_WORK, checked_threads, in_threads

_SUFFIX = {FLOAT32: "f32", FLOAT64: "f64"}
NO_LENGTHS: Mapping[str, int] = MappingProxyType({})


class Chosen(NamedTuple):
    """The selection of results that calls return."""

    place: int
    """Position of the only result that is returned; -1 for all."""
    is_transposed: bool
    """Whether its last two axes are swapped."""


EVERY = Chosen(-1, False)


class Rows(NamedTuple):
    """A compiled loop over elements of one dtype."""

    call: Callable[..., int]
    """Takes pointers to lengths, addresses and steps, and the number of elements. A nonzero status means that memory
    could not be allocated."""
    address: int
    work: tuple[Table, ...]
    """The intermediate tables, which follow the results in the arguments of the loop."""
    keep: Any
    """A reference that keeps the machine code loaded."""


class LoopKernel(LoopCall):
    """A generated function of arrays whose lengths are inferred from the arguments of a call.

    Leading axes broadcast; the last axes are those of `signature`, in which axes of the same name have the same length.
    Index tables have no leading axes: all elements of a batch share them.

    Arguments are passed by position or by name. ``kernel(..., out=array)`` writes to an array, or to a tuple of arrays
    if there are several results. ``kernel(..., num_threads=2)`` distributes the elements of a large batch over threads.

    Attributes
    ----------
    name, signature : str
        The signature has the form of a generalised ufunc, ``(n),(n,6),(8)->(8)``.
    lengths : tuple of str
        The names of the lengths.
    layouts : mapping of str to Layout
        Layouts by name of argument and result.
    cost : mapping of str to mapping of str to int
        Operations of one element by how often they run: ``""`` once, ``"n"`` for each row, ``"n*m"``.
    """

    __signature__ = LoopSignature()

    def __init__(self, definition: LoopDefinition, facts: Facts, settings: Settings) -> None:
        self.name = self.__name__ = self.__qualname__ = definition.name
        self.__module__ = definition.function.__module__
        self.definition = definition
        self.layouts: Mapping[str, Layout] = MappingProxyType(dict(definition.layouts))
        self.cost: Mapping[str, Mapping[str, int]] = MappingProxyType(dict(definition.cost))
        self.signature = definition.signature
        self.lengths = definition.lengths
        self.argument_names = [
            table.name if table.name not in ("out", "num_threads") else f"{table.name}_"
            for table in definition.parameters
        ]
        self._given = [self.layouts.get(table.name) for table in definition.parameters]
        self._returned = [self.layouts.get(table.name) for table in definition.results]
        self._facts = facts
        self._settings = settings
        self._rows: dict[tuple[str, np.dtype[Any]], Rows | None] = {}
        self._quick_backend: Any = None

    def __repr__(self) -> str:
        return f"<kernel {self.__module__}.{self.name}{self.signature}>"

    def __reduce__(self) -> str:
        name: str = self.name
        if getattr(sys.modules.get(self.__module__), name, None) is not self:
            raise PicklingError(
                f"{name}: module {self.__module__} is not imported under that name, or does not define this kernel; "
                "expected a kernel of a module that can be imported"
            )
        return name

    def describe(self) -> str:
        """Return the text that `help` shows."""
        return docstring(self.definition, self._facts)

    @property
    def jit(self) -> Any:
        """Not available for kernels with loops; access raises `AttributeError`."""
        raise AttributeError(
            f"{self.name}.jit: a kernel with loops cannot be called inside numba; call {self.name} on a batch, or call "
            "the kernels of its rows"
        )

    def bind(self, lengths: Mapping[str, int] = NO_LENGTHS, /, **fixed: Any) -> BoundLoops:
        """Return a function of the remaining arguments; the given arguments are checked and copied once.

        Parameters
        ----------
        lengths : mapping of str to int, optional
            Lengths that the remaining arguments must have.
        **fixed
            Arguments by name. Later changes to the arrays have no effect.

        Returns
        -------
        callable
            A function of the other arguments in order, and of ``out`` and ``num_threads``.

        Raises
        ------
        TypeError, ValueError
            As for a call.
        """
        names = self.argument_names
        for name in fixed:
            if name not in names:
                raise TypeError(f"{self.name}.bind: unknown argument {name}; expected some of {', '.join(names)}")
        for name in lengths:
            if name not in self.lengths:
                known = ", ".join(self.lengths)
                raise TypeError(f"{self.name}.bind: unknown length {name}; expected some of {known}")
        kept: list[Fixed | None] = []
        for name, table in zip(names, self.definition.parameters, strict=True):
            kept.append(as_fixed(self.definition, table, fixed[name]) if name in fixed else None)
        return BoundLoops(self, kept, lengths)

    def call(self, /, *arrays: Any, out: Any = None, num_threads: int | None = None, **named: Any) -> Any:
        """Call the kernel with any arguments.

        Once the arguments of one element are converted, the call is passed back to the extension if it can handle it.
        """
        if named:
            arrays = in_order(self.name, self.argument_names, arrays, named)
        if len(arrays) != len(self.argument_names):
            names = ", ".join(self.argument_names)
            raise TypeError(f"{self.name}: {len(arrays)} arguments; expected {len(self.argument_names)} ({names})")
        if out is None and (element := element_among(arrays, self._given)) is not None:
            parameters = zip((table.name for table in self.definition.parameters), self._given, strict=True)
            plain_arrays = without_elements(self.name, arrays, parameters)
            return as_elements(element.like, self.call(*plain_arrays, num_threads=num_threads), self._returned)
        if out is None and num_threads is None and self._quick_backend is not None and not checking.active:
            operands = in_doubles(self.definition, self.definition.parameters, arrays)
            quick = None if operands is None else self.attempt(*operands)
            if quick is not None:
                return quick
        fixed = (None,) * len(arrays)
        found = self.run(arrays, fixed, out, num_threads)
        self._quick_backend = self.quicken(self, fixed, self._quick_backend)
        return found

    _in_python = call
    """The name under which the extension looks up `call`."""
    if extension is None:
        __call__ = call

    def quicken(
        self,
        called: Any,
        fixed: Sequence[Fixed | None],
        known: Any,
        lengths: Mapping[str, int] = NO_LENGTHS,
        chosen: Chosen = EVERY,
    ) -> Any:
        """Let the extension run calls of `called`, this kernel with some arguments and lengths fixed, if it can.

        Returns
        -------
        object
            The backend for which this was decided, with its loops; `known` if nothing changed.
        """
        backend = self._settings.namespace.get("backend")
        loops = [self._rows.get((str(backend), dtype)) for dtype in (FLOAT64, FLOAT32)]
        rows = loops[0] or loops[1]
        # Fixed numbers are doubles.
        if any(one is not None and one.facts is None for one in fixed):
            loops[1] = None
        addresses = tuple(0 if one is None else one.address for one in loops)
        quick = backend, addresses
        if extension is None or rows is None or known == quick or checking.active:
            return known
        definition = self.definition
        tables = (*definition.parameters, *definition.results, *rows.work)
        arrays = [None if one is None else one.array for one in fixed]
        # Bound arguments of another dtype, or with leading axes, are handled in Python.
        fits = all(
            array is None or (_is_quick(table, array) and array.ndim == len(table.lengths) + len(table.shape))
            for table, array in zip(definition.parameters, arrays, strict=True)
        )
        if fits and all(table.into in self.lengths for table in definition.parameters if table.is_index):
            numbers = {name: -1 - k for k, name in enumerate(self.lengths)}
            described = tuple(
                (
                    (*(numbers[name] for name in table.lengths), *table.shape),
                    table.is_index,
                    self.lengths.index(table.into) if table.is_index else 0,
                    -1 if table.rule.endswith("-1") else 0,
                    table.rule.startswith("an earlier"),
                )
                for table in tables
            )
            own = tuple(lengths.get(name, -1) for name in self.lengths)
            sizes = own, described, len(definition.parameters), len(definition.results)
            operations = tuple(
                (
                    sum(counts.values()),
                    tuple(self.lengths.index(name) for name in often.split("*") if name in self.lengths),
                )
                for often, counts in definition.cost.items()
            )
            called._bind(addresses, *sizes, tuple(arrays), operations, *chosen, self._settings.namespace)
        return quick

    def unbind(self) -> None:
        """Let Python handle all calls, also those that the extension could run."""
        if extension is not None:
            self._bind((0, 0), (), (), 0, 0, (), (), -1, False, self._settings.namespace)

    def rebind(self) -> None:
        """Let the extension run calls again, from the one after the next."""
        self._quick_backend = None

    def run(
        self,
        arrays: Sequence[Any],
        fixed: Sequence[Fixed | None],
        out: Any,
        num_threads: int | None,
        known_lengths: Mapping[str, int] = NO_LENGTHS,
    ) -> Any:
        """Run a call with all arguments in order, some of which may be fixed."""
        definition = self.definition
        threads = self._settings.num_threads if num_threads is None else num_threads
        n_threads = checked_threads(self.name, threads)
        operands, dtype = checked(self.definition, arrays, fixed)
        if checking.active:
            tables = definition.parameters
            pairs = ((table.name, operand) for table, operand in zip(tables, operands, strict=True))
            checking.check(self.name, pairs, definition.layouts, [table.name for table in tables if table.is_index])
        lengths, leading = resolved(self.definition, operands, known_lengths)
        for table, operand, known in zip(definition.parameters, operands, fixed, strict=True):
            if table.is_index:
                check_rows(self.definition, table, operand, known.facts if known else None, lengths)
        cores = [table.core(lengths) for table in (*definition.parameters, *definition.results)]
        operands = [
            operand if table.is_index else usable(operand, dtype, len(core))
            for table, operand, core in zip(definition.parameters, operands, cores, strict=False)
        ]
        out_cores = cores[len(operands) :]
        if out is None:
            results = [np.empty(leading + core, dtype) for core in out_cores]
            self._fill(operands, results, leading, lengths, dtype, n_threads)
            return as_returned(results)
        outs = checked_outs(self.definition, out, leading, out_cores, dtype)
        targets = [
            np.empty(target.shape, dtype) if is_unusable(target, core, [*operands, *outs[:k]]) else target
            for k, (target, core) in enumerate(zip(outs, out_cores, strict=True))
        ]
        self._fill(operands, targets, leading, lengths, dtype, n_threads)
        for target, final in zip(targets, outs, strict=True):
            if target is not final:
                final[...] = target
        return out

    def _fill(
        self,
        operands: list[Any],
        results: list[Any],
        leading: tuple[int, ...],
        lengths: Mapping[str, int],
        dtype: np.dtype[Any],
        n_threads: int,
    ) -> None:
        """Fill the results, which do not overlap with arguments and have contiguous elements."""
        if 0 in leading:
            return
        rows = self._rows_of(dtype)
        if rows is None:
            found = evaluate_loops(self.definition, lengths, operands, leading, dtype)
            for result, values in zip(results, found, strict=True):
                result[...] = values
            return
        new, integers = foreign().new, "intptr_t[]"
        numbers = new(integers, [lengths[name] for name in self.lengths])
        arrays = [*operands, *results]

        def run(starts: list[int], steps: list[int], count: int) -> None:
            work = [np.empty(table.core(lengths), dtype) for table in rows.work]
            starts = [*starts, *map(address_of, work)]
            steps = [*steps, *[0] * len(work)]
            if rows.call(numbers, new(integers, starts), new(integers, steps), count):
                raise MemoryError(f"{self.name}: cannot allocate memory for intermediate results")

        if not leading:
            run([address_of(array) for array in arrays], [0] * len(arrays), 1)
            return
        tables = (*self.definition.parameters, *self.definition.results)
        shaped = [steps_of(array, leading, table.core(lengths)) for array, table in zip(arrays, tables, strict=True)]
        sizes, outer = coalesced(leading, shaped)
        inner = max(range(len(sizes)), key=lambda axis: (sizes[axis], axis))
        flat = [step[inner] for step in outer]
        addresses = [address_of(array) for array in arrays]

        def piece(first: int, count: int) -> None:
            starts = [address + first * step for address, step in zip(addresses, flat, strict=True)]
            for offsets in outer_offsets(sizes, outer, inner):
                run([start + offset for start, offset in zip(starts, offsets, strict=True)], flat, count)

        work = math.prod(leading) * self.definition.work_of(lengths)
        in_threads(piece, sizes[inner], n_threads if work >= LEAST_WORK else 1, work)

    def _rows_of(self, dtype: np.dtype[Any]) -> Rows | None:
        """Return the compiled loop over elements of one dtype; None if array expressions are used instead."""
        if self._settings.backend == "arrays":
            return None
        key = self._settings.backend, dtype
        if key not in self._rows:
            with LOCK:
                backend = self._settings.ready_backend()
                key = backend, dtype
                if key not in self._rows:
                    self._rows[key] = self._compiled(backend, dtype)
        return self._rows[key]

    def _compiled(self, backend: str, dtype: np.dtype[Any]) -> Rows | None:
        if backend == "c":
            library = self._settings.library
            address = library.address(f"{self.name}_rows_{_SUFFIX[dtype]}")
            return Rows(foreign().cast(ROWS_TYPE, address), address, (), library)
        if backend == "arrays":
            return None
        from .jit import LoopRows

        if LoopRows is None:
            return None
        compiled = LoopRows(self.definition, dtype)
        return Rows(compiled.call, compiled.address, self.definition.work, compiled)


class BoundLoops(LoopCall):
    """A kernel with loops some of whose arguments are fixed, see `LoopKernel.bind`.

    Attributes
    ----------
    kernel : LoopKernel
    argument_names : list of str
        The arguments that are passed in calls, in order.
    """

    def __init__(
        self,
        kernel: LoopKernel,
        fixed: list[Fixed | None],
        lengths: Mapping[str, int] = NO_LENGTHS,
        chosen: Chosen = EVERY,
    ) -> None:
        self.kernel = kernel
        self._fixed, self._lengths, self._chosen = fixed, dict(lengths), chosen
        self._places = [k for k, known in enumerate(fixed) if known is None]
        self.argument_names = [kernel.argument_names[k] for k in self._places]
        self._arrays = [None if known is None else known.array for known in fixed]
        self._quick_backend: Any = kernel.quicken(self, fixed, None, self._lengths, chosen)

    __signature__ = LoopSignature()

    def __repr__(self) -> str:
        names = [name for name in self.kernel.argument_names if name not in self.argument_names]
        return f"<{self.kernel!r} with fixed {', '.join(names) or 'lengths'}>"

    def __reduce__(self) -> tuple[Any, ...]:
        fixed = {
            name: known.array
            for name, known in zip(self.kernel.argument_names, self._fixed, strict=True)
            if known is not None
        }
        return _bound, (self.kernel, self._lengths, fixed, self._chosen)

    def returning(self, name: str, *, transposed: bool = False) -> BoundLoops:
        """Return the same function restricted to one result; its calls return that result and do not accept ``out``.

        Parameters
        ----------
        name : str
            The name of the result, as in `layouts` of the kernel.
        transposed : bool, optional
            Swap the last two axes of the result.

        Raises
        ------
        TypeError
            If there is no result of that name, or if `transposed` is set and it has fewer than two axes.
        """
        results = self.kernel.definition.results
        names = [table.name for table in results]
        if name not in names:
            expected = ", ".join(names)
            raise TypeError(f"{self.kernel.name}.returning: unknown result {name}; expected one of {expected}")
        place = names.index(name)
        table = results[place]
        if transposed and len(table.lengths) + len(table.shape) < 2:
            raise TypeError(
                f"{self.kernel.name}.returning: {name} has shape {table.shape_text}; expected two axes to swap"
            )
        return BoundLoops(self.kernel, self._fixed, self._lengths, Chosen(place, transposed))

    if extension is None:

        def attempt(self, *_arrays: Any) -> Any:
            """Return None: without the extension there is no fast path."""

    def call(self, /, *arrays: Any, out: Any = None, num_threads: int | None = None) -> Any:
        """Call the kernel with the remaining arguments."""
        place, is_transposed = self._chosen
        if out is not None and place >= 0:
            raise TypeError(f"{self.kernel.name} returning one result does not accept out; expected arguments only")
        if len(arrays) != len(self._places):
            names = ", ".join(self.argument_names)
            raise TypeError(
                f"{self.kernel.name} with fixed arguments: {len(arrays)} arguments; expected {len(self._places)} "
                f"({names})"
            )
        if out is None and num_threads is None and self._quick_backend is not None and not checking.active:
            tables = [self.kernel.definition.parameters[k] for k in self._places]
            operands = in_doubles(self.kernel.definition, tables, arrays)
            quick = None if operands is None else self.attempt(*operands)
            if quick is not None:
                return quick
        every = list(self._arrays)
        for k, array in zip(self._places, arrays, strict=True):
            every[k] = array
        found = self.kernel.run(every, self._fixed, out, num_threads, self._lengths)
        self._quick_backend = self.kernel.quicken(self, self._fixed, self._quick_backend, self._lengths, self._chosen)
        if place >= 0 and isinstance(found, tuple):
            found = found[place]
        return np.swapaxes(found, -1, -2) if is_transposed else found

    _in_python = call
    if extension is None:
        __call__ = call


def _bound(
    kernel: LoopKernel, lengths: dict[str, int], fixed: dict[str, Any], chosen: tuple[int, bool] = EVERY
) -> BoundLoops:
    found = kernel.bind(lengths, **fixed)
    return found if chosen == EVERY else BoundLoops(kernel, found._fixed, lengths, Chosen(*chosen))


def _is_quick(table: Table, array: Any) -> bool:
    """Whether the extension reads an array of this dtype."""
    return table.is_index or array.dtype is FLOAT64


if extension is not None:
    LoopKernel._adopt()
    BoundLoops._adopt()
LoopKernel.__doc__ = Described(LoopKernel.__doc__ or "")  # type: ignore[assignment]
