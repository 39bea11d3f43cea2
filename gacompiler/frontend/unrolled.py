"""Unrolled loops over arrays of known length, which define the meaning of the functions of `frontend.loops`."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from itertools import repeat
from math import prod
from typing import Any

from .expression import Expression, lift
from .loop_bodies import bounds_of, common_length, condition_of, lifted, with_structure
from .operations import select
from .rows import Unrolled, elements_of, leaves_of, like, with_elements

_MOST_STEPS: ContextVar[int | None] = ContextVar("most_steps", default=None)


@contextmanager
def steps_limited(n: int) -> Iterator[None]:
    """Unroll at most `n` steps of iterations, for a comparison with a procedure that has the same limit."""
    token = _MOST_STEPS.set(n)
    try:
        yield
    finally:
        _MOST_STEPS.reset(token)


def is_limited() -> bool:
    """Return whether iterations are unrolled for a few steps only, for a comparison."""
    return _MOST_STEPS.get() is not None


def unrolled_fold(
    body: Callable[..., Any],
    start: Any,
    rows: Sequence[Any],
    reverse: bool,
    until: Callable[..., Any] | None = None,
    within: tuple[Any, Any] | None = None,
) -> Any:
    """Evaluate `fold` over arrays of known length."""
    carry, active = _lifted("fold()", start), lift(1)
    for row, is_inside in _rows_within("fold()", rows, within, reverse):
        following = _same_shape("fold()", carry, body(carry, *row))
        if until is None and within is None:
            carry = following
            continue
        runs = active if within is None else select(active, is_inside, 0)
        carry = _chosen(runs, following, carry)
        if until is not None:
            active = select(runs, 1 - select(condition_of("fold()", until(carry)), 1, 0), active)
    return carry


def _rows_within(
    where: str, rows: Sequence[Any], within: tuple[Any, Any] | None, reverse: bool = False
) -> Iterator[tuple[list[Any], Any]]:
    """Yield the rows of a loop, each with the condition that it lies within bounds."""
    numbers = range(common_length(where, rows))
    first, end = (0, len(numbers)) if within is None else bounds_of(where, within)
    for k in reversed(numbers) if reverse else numbers:
        row = [_row(structure, k) for structure in rows]
        yield row, 1 if within is None else select(first >= k + 1, 0, select(end >= k + 1, 1, 0))


def _chosen(condition: Any, new: Any, old: Any) -> Any:
    """Return one of two carries."""
    pairs = zip(leaves_of(new), leaves_of(old), strict=True)
    return like(old, [_by_element(partial(select, condition), a, b) for a, b in pairs])


def unrolled_each(body: Callable[..., Any], rows: Sequence[Any]) -> Any:
    """Evaluate `each` over arrays of known length."""
    found = [_lifted("each()", body(*row)) for row, _ in _rows_within("each()", rows, None)]
    if found:
        return columns_of(found)
    # Without rows, the structure of the result is that for the row that was not selected.
    result = body(*(like(structure, [array.other for array in leaves_of(structure)]) for structure in rows))
    return like(result, [Unrolled(()) for _ in leaves_of(result)])


def unrolled_total(body: Callable[..., Any], rows: Sequence[Any], within: tuple[Any, Any] | None = None) -> Any:
    """Evaluate `total` over arrays of known length."""
    found: Any = None
    for row, is_inside in _rows_within("total()", rows, within):
        terms = _lifted("total()", body(*row))
        if within is not None:
            zeros = [with_elements(leaf, repeat(lift(0))) for leaf in leaves_of(terms)]
            terms = _chosen(is_inside, terms, like(terms, zeros))
        pairs = zip(leaves_of(found), leaves_of(terms), strict=True) if found is not None else ()
        found = terms if found is None else like(terms, [_by_element(operator.add, a, b) for a, b in pairs])
    return found


def _by_element(function: Callable[..., Any], a: Any, b: Any) -> Any:
    """Apply a function to two multivectors, or to the elements of two arrays."""
    pairs = zip(elements_of(a), elements_of(b), strict=True)
    return with_elements(a, (lift(function(x, y)) for x, y in pairs))


def _lifted(where: str, value: Any) -> Any:
    return like(value, lifted(where, value, arrays=True))


def _same_shape(where: str, structure: Any, value: Any) -> Any:
    return like(structure, with_structure(where, structure, value, arrays=True))


def _row(structure: Any, k: int) -> Any:
    return like(structure, [array.elements[k] for array in leaves_of(structure)])


def columns_of(results: Sequence[Any]) -> Any:
    """Return arrays from their rows, in the structure of a row."""
    flat = [lifted("each()", result, arrays=True) for result in results]
    return like(results[0], [Unrolled(column) for column in zip(*flat, strict=True)])


def unrolled_scan(body: Callable[..., Any], start: Any, rows: Sequence[Any], parents: Any, reverse: bool) -> Any:
    """Evaluate `scan` over arrays of known length."""
    length = common_length("scan()", rows)
    found: dict[int, Any] = {}
    first = _lifted("scan()", start)
    order = range(length - 1, -1, -1) if reverse else range(length)
    for k in order:
        before = parents.elements[k] if parents is not None else k + 1 if reverse else k - 1
        carry = found.get(before, first)
        found[k] = _same_shape("scan()", first, body(carry, *(_row(structure, k) for structure in rows)))
    return columns_of([found[k] for k in range(length)])


def unrolled_accumulate(body: Callable[..., Any], zero: Any, rows: Sequence[Any], parents: Any, keep: bool) -> Any:
    """Evaluate `accumulate` over arrays of known length."""
    length = common_length("accumulate()", rows)
    sums: dict[int, Any] = {}
    values: dict[int, Any] = {}
    kept: dict[int, Any] = {}
    for k in range(length - 1, -1, -1):
        result = body(sums.get(k, _lifted("accumulate()", zero)), *(_row(structure, k) for structure in rows))
        values[k] = _same_shape("accumulate()", zero, result[0] if keep else result)
        if keep:
            kept[k] = _lifted("accumulate()", result[1])
        parent = parents.elements[k] if parents is not None else k - 1
        pairs = zip(leaves_of(sums.get(parent, _lifted("accumulate()", zero))), leaves_of(values[k]), strict=True)
        sums[parent] = like(zero, [a + b for a, b in pairs])
    columns = columns_of([values[k] for k in range(length)])
    return (columns, columns_of([kept[k] for k in range(length)])) if keep else columns


def unrolled_scatter(
    array: Unrolled, tables: Sequence[Any], axes: Sequence[Any], start: Unrolled | None = None
) -> Unrolled:
    """Evaluate `scatter` over arrays of known length."""
    lengths = [axis.length for axis in axes]
    found: list[Expression] = [lift(0)] * prod(lengths) if start is None else elements_of(start)
    for k, value in enumerate(array.elements):
        place = 0
        for table, length in zip(tables, lengths, strict=True):
            place = -1 if place < 0 or table.elements[k] < 0 else place * length + table.elements[k]
        if place >= 0:
            found[place] = found[place] + value
    for length in reversed(lengths[1:]):
        found = [Unrolled(tuple(found[k : k + length])) for k in range(0, len(found), length)]  # type: ignore[misc]
    return Unrolled(tuple(found))


def unrolled_iterate(body: Callable[..., Any], start: Any, until: Callable[..., Any], at_most: int) -> Any:
    """Evaluate `iterate` over arrays of known length."""
    carry, converged, steps, active = _lifted("iterate()", start), lift(0), lift(0), lift(1)
    for _ in range(min(at_most, _MOST_STEPS.get() or at_most)):
        following = _same_shape("iterate()", start, body(carry))
        is_done = lift(until(carry, following))
        converged = select(active, is_done, converged)
        carry = _chosen(active, following, carry)
        steps = steps + active
        active = select(active, 1 - is_done, 0)
    return carry, converged, steps
