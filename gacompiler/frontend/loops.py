"""Loops in kernels: `fold`, `scan`, `each`, `total`, `accumulate`, `gather`, `scatter`, `iterate` and `least`.

Every function takes a body, a Python function of one row, and arrays of rows (`frontend.rows`). Bodies are traced like
kernels. They may use values from outside the loop; computations of those values are moved out of the loop. Values may
be tuples and named tuples of multivectors, and arrays may be tuples of arrays. The result has the structure of the
value that the body returns.

For arrays of known length, the same functions unroll the loop over every row. The unrolled form is the definition of
what the loops compute. The functions share one file because most of it is their documentation.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

from ..algebra.layout import SCALAR, Layout
from ..errors import KernelError
from ..ir.procedure import Add, Clear, Copy, Loop, Place, Repeat, Storage
from ..ir.rows import Counter, Following, Parent, Previous, Row, Through, row_at
from .expression import Expression, evaluate, lift
from .loop_bodies import (
    bounds_of,
    carry_layouts,
    checked_start,
    common_length,
    condition_of,
    is_unrolled,
    lifted,
    row_symbols,
    with_structure,
)
from .names import leaf_names, named_like, result_stems, stems_of
from .operations import select
from .recorded import Record, is_constant, targets_in
from .recorder import Recorder
from .recording import current, is_recording
from .rows import Index, Rows, Unrolled, leaves_of, like
from .unrolled import (
    unrolled_accumulate,
    unrolled_each,
    unrolled_fold,
    unrolled_iterate,
    unrolled_scan,
    unrolled_scatter,
    unrolled_total,
)


def fold(
    body: Callable[..., Any],
    start: Any,
    *rows: Any,
    reverse: bool = False,
    until: Callable[..., Any] | None = None,
    within: tuple[Any, Any] | None = None,
) -> Any:
    """Reduce the rows of arrays to one value, carried from row to row.

    Parameters
    ----------
    body : callable
        ``body(carry, *row)`` returns the next carry.
    start : expression, number or nested tuple of them
        The initial carry.
    *rows : arrays of equal length
    reverse : bool
        Whether to iterate from the last row to the first.
    until : callable, optional
        ``until(carry)`` returns 1 if the remaining rows are to be left out, else 0. It is computed after each row.
    within : tuple of two scalars, optional
        The number of the first row, and the number of the row before which the loop ends. Other rows are not read.
        Fractional parts are ignored.

    Returns
    -------
    expression or nested tuple
        The final carry; `start` for arrays without rows.

    Raises
    ------
    KernelError
        If the arrays have different lengths, the structure of the carry changes, or a bound is not a scalar.

    Examples
    --------
    >>> from gacompiler import SCALAR, array, kernel
    >>> @kernel(x=array(SCALAR, "n"))
    ... def squares(x):
    ...     return fold(lambda sum, each: sum + each * each, 0, x)
    """
    checked_start("fold()", start)
    if is_unrolled("fold()", rows):
        return unrolled_fold(body, start, rows, reverse, until, within)
    recorder, length = current(), common_length("fold()", rows)
    layouts = carry_layouts(recorder, "fold()", body, start, rows)
    stems = stems_of(body, [start, *rows])
    tables = recorder.stored(lifted("fold()", start, arrays=True), stems[0], layouts, start)
    ended = recorder.tables(["ended"], (), [SCALAR]) if until else []
    bounds = bounds_of("fold()", within) if within is not None else []
    named = zip(bounds, ("first", "end")[: len(bounds)], strict=True)
    stored = [recorder.stored([x], [name], recorder.layouts_of([x]))[0] for x, name in named]
    counter = recorder.counter()
    with recorder.scope() as scope:
        carry = like(start, recorder.symbols(stems[0], tables))
        result = body(carry, *row_symbols(recorder, rows, counter, stems[1:]))
        recorder.store(with_structure("fold()", start, result, arrays=True), tables)
        if until:
            last = like(start, recorder.symbols(stems[0], tables))
            recorder.store(lifted("fold()", condition_of("fold()", until(last))), ended)
    controls = (ended[0].table if ended else "", *(rows.table for rows in stored))
    recorder.append(Loop(counter, length, reverse, tuple(scope.statements), *controls))
    return like(start, recorder.symbols(stems[0], tables))


def scan(body: Callable[..., Any], start: Any, *rows: Any, parents: Any = None, reverse: bool = False) -> Any:
    """Carry a value over the rows of arrays, and return the carry of every row.

    Parameters
    ----------
    body : callable
        ``body(carry, *row)`` returns the carry of the row.
    start : expression, number or nested tuple of them
        The carry before the first row, and for rows without a parent.
    *rows : arrays of equal length
    parents : index table, optional
        For each row, the earlier row whose carry is passed to the body, or -1 for `start`. By default this is the
        previous row.
    reverse : bool
        Whether to iterate from the last row to the first. Cannot be combined with `parents`.

    Returns
    -------
    array of rows or nested tuple of arrays
        The carry of each row.

    Raises
    ------
    KernelError
        Under the conditions of `fold`, or if both `parents` and `reverse` are given.
    """
    checked_start("scan()", start)
    if parents is not None and reverse:
        raise KernelError("scan()", "parents and reverse", "one of them", "use accumulate() for sums towards the root")
    if is_unrolled("scan()", rows):
        return unrolled_scan(body, start, rows, parents, reverse)
    recorder, length = current(), common_length("scan()", rows)
    if parents is not None:
        _check_index("scan()", parents, length, length)
    layouts = carry_layouts(recorder, "scan()", body, start, rows)
    stems = stems_of(body, [start, *rows])
    if any(isinstance(leaf, Rows) for leaf in leaves_of(start)):
        return _scan_of_arrays(recorder, body, start, rows, parents, reverse, layouts)
    first = recorder.stored(lifted("scan()", start), [f"{stem}_start" for stem in stems[0]], layouts, start)
    tables = recorder.tables(stems[0], (length,), layouts, start)
    counter = recorder.counter()
    with recorder.scope() as scope:
        symbols = []
        for stem, table, before in zip(stems[0], tables, first, strict=True):
            row: Row = Previous(counter, before.table)
            if parents is not None:
                row = Parent(parents.name, counter, before.table)
            symbols += recorder.symbols([stem], [table], row)
        result = body(like(start, symbols), *row_symbols(recorder, rows, counter, stems[1:]))
        recorder.compute(with_structure("scan()", start, result), targets_in(tables, Counter(counter)))
    recorder.append(Loop(counter, length, reverse, tuple(scope.statements)))
    return like(start, tables)


def each(body: Callable[..., Any], *rows: Any) -> Any:
    """Apply a function to each row of arrays.

    Parameters
    ----------
    body : callable
        ``body(*row)`` returns a multivector or a nested tuple of multivectors.
    *rows : arrays of equal length

    Returns
    -------
    array of rows or nested tuple of arrays

    Raises
    ------
    KernelError
        If the arrays have different lengths.
    """
    if is_unrolled("each()", rows):
        return unrolled_each(body, rows)
    recorder, length = current(), common_length("each()", rows)
    counter = recorder.counter()
    with recorder.scope() as scope:
        result = body(*row_symbols(recorder, rows, counter, stems_of(body, rows)))
        found = _new_rows(recorder, "each()", body, result, length)
        recorder.store(lifted("each()", result, arrays=True), [rows.at(Counter(counter)) for rows in found])
    recorder.append(Loop(counter, length, False, tuple(scope.statements)))
    return like(result, found)


def total(body: Callable[..., Any], *rows: Any, within: tuple[Any, Any] | None = None) -> Any:
    """Sum a function over the rows of arrays.

    Parameters
    ----------
    body : callable
        ``body(*row)`` returns a multivector or a nested tuple of multivectors, which is summed component by component.
    *rows : arrays of equal length
    within : tuple of two scalars, optional
        Bounds of the numbers of the rows, as for `fold`.

    Returns
    -------
    expression or nested tuple
        The sum; 0 for arrays without rows.
    """
    if is_unrolled("total()", rows):
        return unrolled_total(body, rows, within)
    recorder = current()
    counter = recorder.counter()
    with recorder.attempt(), recorder.scope():
        terms = body(*row_symbols(recorder, rows, counter, stems_of(body, rows)))
        layouts = recorder.layouts_of(lifted("total()", terms, arrays=True))

    def added(sum: Any, *row: Any) -> Any:
        found = with_structure("total()", terms, body(*row), arrays=True)
        return like(terms, [_by_element(operator.add, a, b) for a, b in zip(leaves_of(sum), found, strict=True)])

    zero = like(terms, [_zero(recorder, leaf, x) for leaf, x in zip(leaves_of(terms), layouts, strict=True)])
    return fold(named_like(body, added, ["sum"]), zero, *rows, within=within)


def accumulate(body: Callable[..., Any], zero: Any, *rows: Any, parents: Any = None, keep: bool = False) -> Any:
    """Accumulate values from the last row to the first, or from the leaves of a tree to its root.

    Parameters
    ----------
    body : callable
        ``body(children, *row)`` returns the value of the row. `children` is the sum of the values of the child rows;
        without `parents`, the only child of a row is the next row.
    zero : 0 or nested tuple of zeros
        The empty sum.
    *rows : arrays of equal length
    parents : index table, optional
        The parent of each row, which is an earlier row, or -1 for no parent.
    keep : bool
        Whether the body returns a pair ``(value, kept)``: `value` is passed on to the parent, and `kept` is only
        stored for the row.

    Returns
    -------
    array of rows, or nested tuple of arrays
        The values; with `keep`, a pair of the values and the kept values.

    Raises
    ------
    KernelError
        Under the conditions of `fold`, or if `zero` is not zero.
    """
    checked_start("accumulate()", zero)
    if any(_is_something(leaf) for leaf in lifted("accumulate()", zero)):
        raise KernelError("accumulate()", f"zero is {zero}", "0, or a nested tuple of zeros", "add values in the body")
    if is_unrolled("accumulate()", rows):
        return unrolled_accumulate(body, zero, rows, parents, keep)
    recorder, length = current(), common_length("accumulate()", rows)
    if parents is not None:
        _check_index("accumulate()", parents, length, length)

    def summed(children: Any, *row: Any) -> Any:
        passed = with_structure("accumulate()", zero, _pair(body(children, *row), keep)[0])
        return like(zero, [a + b for a, b in zip(leaves_of(children), passed, strict=True)])

    layouts = carry_layouts(recorder, "accumulate()", named_like(body, summed), zero, rows)
    stems = stems_of(body, [zero, *rows])
    sums = recorder.tables(stems[0], (length,), layouts, zero)
    values = recorder.tables(leaf_names("value", zero), (length,), layouts, zero)
    for name in dict.fromkeys(table.table for table in sums):
        recorder.append(Clear(name))
    counter = recorder.counter()
    onto: Row = Through(parents.name, counter) if parents is not None else Following(counter)
    kept: Any = None
    with recorder.scope() as scope:
        children = like(zero, recorder.symbols(stems[0], sums, Counter(counter)))
        value, other = _pair(body(children, *row_symbols(recorder, rows, counter, stems[1:])), keep)
        expressions = with_structure("accumulate()", zero, value)
        targets = targets_in(values, Counter(counter))
        if keep:
            found = _new_rows(recorder, "accumulate()", body, other, length)
            expressions += lifted("accumulate()", other)
            targets += targets_in(found, Counter(counter))
            kept = like(other, found)
        recorder.compute(expressions, targets)
        for name, sum_name in {value.table: sum.table for value, sum in zip(values, sums, strict=True)}.items():
            recorder.append(Add(Place(name, Counter(counter)), Place(sum_name, onto)))
    recorder.append(Loop(counter, length, True, tuple(scope.statements)))
    passed = like(zero, values)
    return (passed, kept) if keep else passed


def transpose(rows: Any) -> Any:
    """Exchange the first two axes of arrays, without a copy.

    Parameters
    ----------
    rows : array of rows over at least two lengths, or nested tuple of such arrays

    Returns
    -------
    array of rows or nested tuple of arrays
        Loops over these arrays run over the columns of `rows`.

    Raises
    ------
    KernelError
        If an array has a single axis.

    Examples
    --------
    >>> from gacompiler import SCALAR, array, each, kernel, total, transpose
    >>> @kernel(matrix=array(SCALAR, "n", "m"))
    ... def sums_of_columns(matrix):
    ...     return each(lambda column: total(lambda entry: entry, column), transpose(matrix))
    """

    def transposed(array: Any) -> Any:
        if isinstance(array, Unrolled):
            columns = zip(*(row.elements for row in array.elements), strict=True)
            return Unrolled(tuple(map(Unrolled, columns)))
        current().check_rows(array)
        if len(array.order) < 2:
            raise KernelError("transpose()", f"an array over {array.length}", "an array over two lengths")
        return array.transposed()

    is_unrolled("transpose()", rows if isinstance(rows, tuple) else (rows,))
    return like(rows, list(map(transposed, leaves_of(rows))))


def gather(rows: Any, index: Any) -> Any:
    """Select the rows of an array that are given by an index table.

    Parameters
    ----------
    rows : array of rows or nested tuple of arrays
    index : index table
        The row to select for each row of the result. No entry may be -1. A table with several columns is a tuple of
        index tables.

    Returns
    -------
    array of rows or nested tuple of arrays
        An array of the length of `index`; for a table with several columns, a tuple of such arrays.

    Raises
    ------
    KernelError
        If `index` is not an index table into the array.
    """
    arrays = leaves_of(rows)
    if isinstance(index, tuple) and all(isinstance(each, (Index, Unrolled)) for each in index):
        return tuple(gather(rows, each) for each in index)
    if isinstance(index, Unrolled):
        chosen = [tuple(array.elements[k] for k in index.elements) for array in arrays]
        others = [None if index.elements else next(iter(array.elements), None) for array in arrays]
        return like(rows, [Unrolled(rows, other) for rows, other in zip(chosen, others, strict=True)])
    is_unrolled("gather()", rows if isinstance(rows, tuple) else (rows,))
    if not isinstance(index, Index):
        raise KernelError("gather()", f"{type(index).__name__} as index", 'an index table, index("n", into="m")')
    for array in arrays:
        if array.length != index.into:
            expected = f"one over {index.into}, to which {index.name} refers"
            raise KernelError("gather()", f"an array over {', '.join(array.lengths)}", expected)
    return like(rows, [current().selectable(array).gathered(index) for array in arrays])


def scatter(rows: Any, index: Any, onto: Any, start: Any = None) -> Any:
    """Add each row of an array to the row of the result that is given by an index table.

    Parameters
    ----------
    rows : array of rows or nested tuple of arrays
    index : index table, or a tuple of two
        The row of the result to add each row to; rows with the index -1 are left out. Two tables give the row and the
        column of a matrix of rows.
    onto : array of rows, or a tuple of two
        An array with the length of the result; for a matrix of rows, one array for each axis.
    start : array of rows or nested tuple of arrays, optional
        The result of an earlier `scatter` onto the same axes. The rows are added to it in place.

    Returns
    -------
    array of rows or nested tuple of arrays
        The sums.

    Raises
    ------
    KernelError
        If the lengths of arrays, index tables and axes do not match, or `start` is not a result of `scatter` for the
        same axes.
    """
    tables = index if isinstance(index, tuple) else (index,)
    axes = onto if isinstance(onto, tuple) else (onto,)
    if len(tables) != len(axes):
        raise KernelError("scatter()", f"{len(tables)} index tables for {len(axes)} axes", "one for each")
    arrays = leaves_of(rows)
    for array in arrays:
        if isinstance(array, Rows) and len(array.order) > 1:
            raise KernelError("scatter()", f"an array over {', '.join(array.lengths)}", "an array over one length")
    if is_unrolled("scatter()", (*arrays, *(axis for axis in axes if not isinstance(axis, Index)))):
        starts = [None] * len(arrays) if start is None else leaves_of(start)
        pairs = zip(arrays, starts, strict=True)
        return like(rows, [unrolled_scatter(array, tables, axes, first) for array, first in pairs])
    recorder, length = current(), common_length("scatter()", [rows])
    for table, axis in zip(tables, axes, strict=True):
        _check_index("scatter()", table, length, axis.length)
    lengths = tuple(axis.length for axis in axes)
    layouts = [recorder.inference.sum_of(array.leaf.layout) for array in arrays]
    if start is None:
        shape = recorder.shape_returned(lengths, len(arrays))
        if shape and len({layout.size for layout in layouts}) == 1:
            sums = recorder.packed("scattered", lengths, layouts, shape)
        else:
            sums = recorder.tables(leaf_names("scattered", rows), lengths, layouts, like(rows, [0] * len(arrays)))
        for name in dict.fromkeys(table.table for table in sums):
            recorder.append(Clear(name))
    else:
        sums = _continued(recorder, start, lengths, layouts)
    counter = recorder.counter()
    onto = row_at(tuple(Through(table.name, counter, table.column) for table in tables))
    with recorder.scope() as scope:
        for first, table in _tables_of(recorder, sums):
            source = _source_of_sums(recorder, arrays[first : first + len(table.leaves)], table, counter)
            recorder.append(Add(source, Place(table.name, onto)))
    recorder.append(Loop(counter, length, False, tuple(scope.statements)))
    return like(rows, sums)


def iterate(body: Callable[..., Any], start: Any, until: Callable[..., Any], at_most: Any) -> Any:
    """Repeat a step until a condition holds, or a maximum number of times.

    Parameters
    ----------
    body : callable
        ``body(carry)`` returns the next carry; it may contain loops.
    start : expression, number or nested tuple of them
        The initial carry.
    until : callable
        ``until(old, new)`` compares two consecutive carries and returns 1 if the iteration has converged, else 0.
    at_most : int or expression
        The maximum number of steps. If it is known only when the kernel runs, there are no steps for a number below 1.

    Returns
    -------
    carry : expression or nested tuple
        The final carry.
    converged : expression
        1 if the condition held after the last step, else 0.
    steps : expression
        The number of steps taken.

    Raises
    ------
    KernelError
        If `at_most` is neither a positive integer nor an expression, or the structure of the carry changes.
    """
    if not (callable(body) and callable(until)):
        raise KernelError("iterate()", f"{body!r} and {until!r}", "functions of the carry, as the body and the end")
    checked_start("iterate()", start)
    if isinstance(at_most, Expression) and at_most.is_scalar:
        return _iterate_below(body, start, until, at_most)
    if not isinstance(at_most, int) or isinstance(at_most, bool) or at_most < 1:
        raise KernelError("iterate()", f"at_most={at_most!r}", "a positive integer")
    if not is_recording():
        return unrolled_iterate(body, start, until, at_most)
    return _recorded(body, start, until, at_most, carry_layouts(current(), "iterate()", body, start, ()))


def iterate_scalars(body: Callable[..., Any], start: Any, until: Callable[..., Any], at_most: int) -> Any:
    """Repeat a step as `iterate` does, on a carry of scalars only.

    Their layouts need no inference, so that bodies of loops within each other are traced once and not once per round.
    """
    if not is_recording():
        return unrolled_iterate(body, start, until, at_most)
    return _recorded(body, start, until, at_most, (SCALAR,) * len(leaves_of(start)))


def _recorded(
    body: Callable[..., Any], start: Any, until: Callable[..., Any], at_most: int, layouts: Sequence[Layout]
) -> Any:
    recorder = current()
    stems = stems_of(body, [start])[0]
    values = [*lifted("iterate()", start, arrays=True), lift(0), lift(0)]
    old = recorder.tables(stems, (), layouts, start)
    done, steps = recorder.tables(["converged", "steps"], (), [SCALAR, SCALAR])
    recorder.store(values, [*old, done, steps])
    with recorder.scope() as scope:
        new = recorder.tables([f"next_{stem}" for stem in stems], (), layouts, start)
        carry = like(start, recorder.symbols(stems, old))
        results = with_structure("iterate()", start, body(carry), arrays=True)
        held = {rows.table for rows in old}
        # An array that the body has made needs no copy for the comparison.
        made = [isinstance(x, Rows) and x.is_whole and x.table not in held for x in results]
        others = [pair for pair, is_made in zip(zip(results, new, strict=True), made, strict=True) if not is_made]
        recorder.store([x for x, _ in others], [rows for _, rows in others])
        new = [x if is_made else rows for x, rows, is_made in zip(results, new, made, strict=True)]
        following = like(start, recorder.symbols([f"next_{stem}" for stem in stems], new))
        (condition,) = lifted("iterate()", condition_of("iterate()", until(carry, following)))
        recorder.compute([condition], targets_in([done]))
        arrays = [pair for pair, is_made in zip(zip(new, old, strict=True), made, strict=True) if is_made]
        recorder.store([x for x, _ in arrays], [before for _, before in arrays])
        pairs = [pair for pair, is_made in zip(zip(new, old, strict=True), made, strict=True) if not is_made]
        for found, before in {a.table: (a, b) for a, b in pairs}.values():
            if before.order:
                recorder.store([found], [before])
            else:
                recorder.append(Copy(found.place, before.place))
    recorder.append(Repeat(at_most, done.table, steps.table, tuple(scope.statements)))
    last = like(start, recorder.symbols(stems, old))
    converged, n_steps = recorder.symbols(["converged", "steps"], [done, steps])
    return last, converged, n_steps


class _Steps(NamedTuple):
    """The carry of an iteration that counts its own steps."""

    carry: Any
    steps: Any
    converged: Any


_MOST_STEPS = 2**31 - 1
"""The bound of iterations whose bound is computed: the largest value of the counter in all languages."""


def _iterate_below(body: Callable[..., Any], start: Any, until: Callable[..., Any], bound: Expression) -> Any:
    """Return the results of `iterate` for a bound that is known only when the kernel runs."""

    def step(state: Any) -> Any:
        following = body(state.carry)
        return _Steps(following, state.steps + 1, condition_of("iterate()", until(state.carry, following)))

    def is_over(old: Any, new: Any) -> Any:
        return select(new.converged, 1, select(new.steps < bound, 0, 1))

    names = named_like(body, step)
    state, _, _ = iterate(names, _Steps(start, 0, 0), is_over, _MOST_STEPS)
    is_run = bound >= 1
    pairs = zip(leaves_of(state.carry), leaves_of(start), strict=True)
    carry = like(start, [_by_element(partial(select, is_run), new, old) for new, old in pairs])
    return carry, select(is_run, state.converged, 0), select(is_run, state.steps, 0)


def _check_index(where: str, index: Any, length: str, into: str) -> None:
    if not isinstance(index, Index) or (index.length, index.into) != (length, into):
        found = f"{index.name} over {index.length} into {index.into}" if isinstance(index, Index) else repr(index)
        raise KernelError(where, found, f'an index table over {length} into {into}, index("{length}", "{into}")')


def _new_rows(recorder: Recorder, where: str, body: Callable[..., Any], result: Any, length: str) -> list[Rows]:
    """Return new tables for the values that a body returns for each row, visible in the scope around the loop."""
    layouts = recorder.layouts_of(lifted(where, result, arrays=True))
    return recorder.tables(result_stems(body, result), (length,), layouts, result, outside=True)


def _zero(recorder: Recorder, value: Any, layout: Layout) -> Any:
    """Return 0, or an array of zeros over the lengths of an array."""
    if not isinstance(value, Rows):
        return 0
    (zeros,) = recorder.packed("zeros", value.lengths, [recorder.inference.sum_of(layout)], ())
    recorder.append(Clear(zeros.table))
    return zeros


def _by_element(function: Callable[..., Any], a: Any, b: Any) -> Any:
    """Apply a function to two multivectors, or to the elements of two arrays."""
    return each(partial(_by_element, function), a, b) if isinstance(a, (Rows, Unrolled)) else function(a, b)


def _scan_of_arrays(
    recorder: Recorder,
    body: Callable[..., Any],
    start: Any,
    rows: Sequence[Any],
    parents: Any,
    reverse: bool,
    layouts: Sequence[Layout],
) -> Any:
    """Return the carries of `scan`, some of which are arrays, by a loop that also keeps the carry of the last row."""
    if parents is not None:
        raise KernelError("scan()", "an array that is passed from parents to children", "multivectors or numbers")
    stems, length = stems_of(body, [start, *rows]), common_length("scan()", rows)
    last = recorder.stored(lifted("scan()", start, arrays=True), stems[0], layouts, start)
    tables = recorder.tables(stems[0], (length,), layouts, start)
    counter = recorder.counter()
    with recorder.scope() as scope:
        result = body(like(start, recorder.symbols(stems[0], last)), *row_symbols(recorder, rows, counter, stems[1:]))
        recorder.store(with_structure("scan()", start, result, arrays=True), last)
        recorder.store(recorder.symbols(stems[0], last), [table.at(Counter(counter)) for table in tables])
    recorder.append(Loop(counter, length, reverse, tuple(scope.statements)))
    return like(start, tables)


def _is_something(value: Any) -> bool:
    """Return whether a value is anything but a constant zero."""
    expression = lift(value)
    return not is_constant(expression) or bool(evaluate([expression], {})[0].terms)


def _continued(recorder: Recorder, start: Any, lengths: tuple[str, ...], layouts: Sequence[Layout]) -> list[Rows]:
    """Return the tables of an earlier `scatter`, to which more rows are added."""
    sums = [rows for rows in leaves_of(start) if isinstance(rows, Rows)]
    found = [(rows.lengths, rows.leaf.layout, rows.is_whole) for rows in sums]
    if found != [(lengths, layout, True) for layout in layouts] or not all(
        recorder.records[rows.table].storage is Storage.WORK for rows in sums
    ):
        raise KernelError("scatter()", "start is another array", "a result of scatter() for the same axes")
    return sums


def _tables_of(recorder: Recorder, sums: Sequence[Rows]) -> list[tuple[int, Record]]:
    """Return the tables of the arrays, each with the index of its first array."""
    found: dict[str, int] = {}
    for k, rows in enumerate(sums):
        found.setdefault(rows.table, k)
    return [(k, recorder.records[name]) for name, k in found.items()]


def _source_of_sums(recorder: Recorder, arrays: Sequence[Rows], table: Record, counter: str) -> Place:
    """Return the row that is added to a row of a table: the arrays' own row if it has the same structure, or a copy.

    Rows of `gather` are always copied, because an addition would skip rows with the index -1.
    """
    own = recorder.records[recorder.check_rows(arrays[0]).table]
    same_table = all(array.table == own.name and array.is_whole for array in arrays)
    alike = [leaf.start for leaf in own.leaves] == [leaf.start for leaf in table.leaves] and all(
        array.leaf == leaf and leaf.layout.stored == onto.layout.stored
        for array, leaf, onto in zip(arrays, own.leaves, table.leaves, strict=False)
    )
    if same_table and alike:
        return arrays[0].at(Counter(counter)).place
    (symbols,) = row_symbols(recorder, [tuple(arrays)], counter, [["value"] * len(arrays)])
    outer = table.shape if table.leaf.layout.is_scalar else table.shape[:-1]
    row = recorder.packed("row", (), [leaf.layout for leaf in table.leaves], outer)
    recorder.compute(symbols, targets_in(row))
    return Place(row[0].table)


def _pair(result: Any, keep: bool) -> tuple[Any, Any]:
    """Return the value that the body of `accumulate` passes to the parent, and the value that it keeps."""
    if not keep:
        return result, None
    if not isinstance(result, tuple) or len(result) != 2:
        raise KernelError("accumulate()", "the body does not return a pair", "(value, kept), because of keep=True")
    return result
