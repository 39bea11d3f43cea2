"""Evaluation of kernels with loops by array expressions, on rows of numpy arrays whose last axis is the batch."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .boundaries import NAMES, bound_of
from .functions import array_functions, bound
from .loop_definition import ADD_TO, BOUND, NUMBER, ROW_OR, SUM, LoopDefinition, Part, Table


class _Rows:
    """A table whose rows are tuples of numbers and arrays over the batch, or single ones if rows have no axis."""

    __slots__ = ("array", "has_entries")

    def __init__(self, array: Any, has_entries: bool) -> None:
        self.array, self.has_entries = array, has_entries

    def __getitem__(self, k: Any) -> Any:
        # A copy, because values computed from the row may be used after the row has changed.
        return self.array[k].copy()

    def __setitem__(self, k: Any, row: Any) -> None:
        if not self.has_entries or not isinstance(row, tuple):
            self.array[k] = row
            return
        for entries, value in zip(self.array[k], row, strict=True):
            entries[...] = value


def _place(table: _Rows, k: Any) -> tuple[int, ...] | None:
    """Return the number, or numbers, of a row, or None if the row does not exist. Computed ones are arrays of one."""
    numbers = k if isinstance(k, tuple) else (k,)
    if not all(0 <= number < size for number, size in zip(numbers, table.array.shape, strict=False)):
        return None
    return tuple(int(np.asarray(number).flat[0]) for number in numbers)


def _row_or(table: _Rows, k: Any, start: Any) -> Any:
    place = _place(table, k)
    return start if place is None else table[place]


def _add_to(table: _Rows, k: Any, row: Any) -> None:
    k = _place(table, k)
    if k is None:
        return
    if not table.has_entries:
        table.array[k] += row
        return
    for entries, value in zip(table.array[k], row, strict=True):
        entries += value


def _bound(x: Any, n: int) -> Any:
    return bound_of(np.asarray(x).flat[0], n)


def _number(x: Any) -> Any:
    return x


def _sum(a: Any, b: Any) -> Any:
    return tuple(x + y for x, y in zip(a, b, strict=True)) if isinstance(a, tuple) else a + b


def evaluate_loops(
    definition: LoopDefinition,
    lengths: Mapping[str, int],
    operands: Sequence[Any],
    leading: tuple[int, ...],
    dtype: Any,
) -> list[Any]:
    """Compute the results of a kernel with loops.

    If the number of iterations depends on the element, the elements are computed one after the other.
    """
    count = math.prod(leading)
    flat = [
        operand if table.is_index else _batch(operand, table.core(lengths), leading)
        for table, operand in zip(definition.parameters, operands, strict=True)
    ]

    def empty(table: Table, size: int) -> Any:
        return np.zeros(_flat(table, tuple(lengths[name] for name in table.lengths), size), dtype)

    results = [empty(table, count) for table in definition.results]
    step = 1 if definition.repeats else count
    names = array_functions(np)
    names |= {name: _on_rows(part, bound(part.function, names)) for name, part in definition.parts.items()}
    names |= {**NAMES, ROW_OR: _row_or, ADD_TO: _add_to, SUM: _sum, BOUND: _bound, NUMBER: _number}
    run = bound(definition.function, names)
    for first in range(0, count, max(step, 1)):
        chosen = slice(first, first + step)
        arguments = [
            _argument(table, operand, chosen) if not table.is_index else operand if table.shape else operand.tolist()
            for table, operand in zip(definition.parameters, flat, strict=True)
        ]
        outs = [
            _Rows(result[..., chosen], bool(table.shape))
            for table, result in zip(definition.results, results, strict=True)
        ]
        work = [_Rows(empty(table, step), bool(table.shape)) for table in definition.work]
        with np.errstate(all="ignore"):
            run(*(lengths[name] for name in definition.lengths), *arguments, *outs, *work)
    return [
        np.moveaxis(result, -1, 0).reshape(leading + table.core(lengths))
        for table, result in zip(definition.results, results, strict=True)
    ]


def _batch(operand: Any, core: tuple[int, ...], leading: tuple[int, ...]) -> Any:
    """Return an argument with the batch as its last axis, of length 1 if it is the same for all elements."""
    if math.prod(operand.shape[: operand.ndim - len(core)]) == 1:
        return operand.reshape(core)[..., None]
    return np.moveaxis(np.broadcast_to(operand, leading + core).reshape(math.prod(leading), *core), 0, -1)


def _argument(table: Table, operand: Any, chosen: slice) -> Any:
    array = operand if operand.shape[-1] == 1 else operand[..., chosen]
    array = array.reshape(_flat(table, array.shape[: len(table.lengths)], array.shape[-1]))
    return _Rows(array, bool(table.shape)) if table.lengths else array


def _flat(table: Table, lengths: tuple[int, ...], count: int) -> tuple[int, ...]:
    """Return the shape of a table of flat rows over a batch."""
    return (*lengths, *((math.prod(table.shape),) if table.shape else ()), count)


def _on_rows(part: Part, function: Callable[..., Any]) -> Callable[..., Any]:
    """Convert the function of a part from nested tuples to flat rows."""

    def call(*rows: Any) -> Any:
        found = function(*(_nested(row, shape) for row, shape in zip(rows, part.shapes, strict=True)))
        results = [found] if len(part.out_shapes) == 1 else found
        flat = [
            tuple(_entries(result, shape)) if shape else result
            for result, shape in zip(results, part.out_shapes, strict=True)
        ]
        return flat[0] if len(flat) == 1 else flat

    return call


def _nested(row: Any, shape: tuple[int, ...]) -> Any:
    if not shape:
        return row
    if len(shape) == 1:
        return tuple(row)
    size = math.prod(shape[1:])
    return tuple(_nested(row[k * size : (k + 1) * size], shape[1:]) for k in range(shape[0]))


def _entries(value: Any, shape: tuple[int, ...]) -> Iterator[Any]:
    if not shape:
        yield value
        return
    for part in value:
        yield from _entries(part, shape[1:])
