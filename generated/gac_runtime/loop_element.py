"""Calls of kernels with loops on an element or a small batch of doubles, where no extension makes them.

What such calls share is kept: a plan belongs to the shapes of the arguments, and holds whatever a call checks and all
that does not depend on their numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .arrays import FLOAT64, as_returned
from .foreign import foreign
from .loop_definition import LoopDefinition, Table

_USABLE = 0x101
"""Flags of arrays that are aligned and in C order."""
_MOST = 64
"""Plans that a kernel keeps: arrays of more shapes than these change too often for it."""


class _Plan(NamedTuple):
    backend: Any
    run: Callable[..., int]
    lengths: Any
    steps: Any
    places: tuple[int, ...]
    """Where the given arguments are among all."""
    pointers: list[Any]
    """Of fixed arguments; None for the others."""
    shapes: list[tuple[int, ...]]
    """Of the results."""
    work: list[tuple[int, ...]]
    elements: int
    """How many the call computes."""


class Plans:
    """The plans of a kernel, or of one with fixed arguments, by the shapes of the given ones."""

    __slots__ = ("_namespace", "_plans")

    def __init__(self, namespace: Mapping[str, Any]) -> None:
        self._namespace = namespace
        self._plans: dict[tuple[tuple[int, ...], ...], _Plan] = {}

    def call(self, given: Sequence[Any]) -> Any:
        """The results where there is a plan for the arguments, else None."""
        if not self._plans:
            return None
        for array in given:
            if type(array) is not np.ndarray or array.dtype is not FLOAT64 or array.flags.num & _USABLE != _USABLE:
                return None
        plan = self._plans.get(tuple([array.shape for array in given]))
        if plan is None or self._namespace.get("backend") is not plan.backend:
            return None
        ffi = foreign()
        results = [np.empty(shape) for shape in plan.shapes]
        work = [np.empty(core) for core in plan.work]
        pointers = plan.pointers.copy()
        for k, array in zip(plan.places, given, strict=True):
            pointers[k] = ffi.from_buffer(array)
        pointers += [ffi.from_buffer(array) for array in (*results, *work)]
        failed = plan.run(plan.lengths, ffi.new("void *[]", pointers), plan.steps, plan.elements)
        return None if failed else as_returned(results)

    def add(
        self,
        definition: LoopDefinition,
        given: Sequence[Any],
        fixed: Sequence[Any],
        lengths: Mapping[str, int],
        leading: tuple[int, ...],
        run: Callable[..., int],
        work: Sequence[Table],
    ) -> None:
        """Keep a plan for arguments that were found to be right, if they are doubles and all given ones are batches.

        `fixed` has an array for each fixed argument, and None for the others; `leading` is the shape of the batch.
        """
        ffi, tables = foreign(), definition.parameters
        pairs = list(zip(tables, fixed, strict=True))
        if (
            not hasattr(ffi, "from_buffer")
            or len(self._plans) >= _MOST
            or any(array is None and table.is_index for table, array in pairs)
            or any(array is not None and not _is_element(table, array) for table, array in pairs)
            or any(type(array) is not np.ndarray or array.dtype is not FLOAT64 for array in given)
            or any(
                array.shape != leading + table.core(lengths)
                for (table, _), array in zip([pair for pair in pairs if pair[1] is None], given, strict=True)
            )
        ):
            return
        cores = [table.core(lengths) for table in definition.results]
        steps = [FLOAT64.itemsize * math.prod(table.core(lengths)) if array is None else 0 for table, array in pairs]
        steps += [FLOAT64.itemsize * math.prod(core) for core in cores] + [0] * len(work)
        self._plans[tuple([array.shape for array in given])] = _Plan(
            self._namespace.get("backend"),
            run,
            ffi.new("intptr_t[]", [lengths[name] for name in definition.lengths]),
            ffi.new("intptr_t[]", steps),
            tuple(k for k, array in enumerate(fixed) if array is None),
            [None if array is None else ffi.from_buffer(array) for array in fixed],
            [leading + core for core in cores],
            [table.core(lengths) for table in work],
            math.prod(leading),
        )


def _is_element(table: Table, array: Any) -> bool:
    """Whether a fixed argument is one of an element, of the type in which it is read."""
    return (table.is_index or array.dtype is FLOAT64) and array.ndim == len(table.lengths) + len(table.shape)
