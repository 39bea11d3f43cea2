"""Loops in kernels: `fold`, `scan`, `each`, `total`, `accumulate`, `gather`, `scatter`, `iterate` and `least`.

Every function takes a body, a Python function of one row, and arrays of rows (`frontend.rows`). Bodies are traced like
kernels; they may use values from outside, whose computation is moved out of the loop. Values may be tuples and named
tuples of multivectors, and arrays tuples of arrays; the result has the structure of what the body returns.

Where the arrays have a known length, the same functions write out every row: that defines what the loops compute. They
are in one file because most of it is their documentation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ..algebra.layout import SCALAR, Layout
from ..errors import KernelError
from ..ir.procedure import (
    Add,
    Clear,
    Copy,
    Counter,
    Following,
    Loop,
    Parent,
    Place,
    Previous,
    Repeat,
    Row,
    Storage,
    Through,
)
from .expression import Expression, evaluate, lift
from .loop_bodies import (
    carry_layouts,
    checked_start,
    common_length,
    is_unrolled,
    lifted,
    row_of,
    row_symbols,
    with_structure,
)
from .names import leaf_names, named_like, result_stems, stems_of
from .operations import select
from .recorded import Record, is_constant, targets_in
from .recorder import Recorder, current, is_recording
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


def fold(body: Callable[..., Any], start: Any, *rows: Any, reverse: bool = False) -> Any:
    """Carry a value over the rows of arrays.

    Parameters
    ----------
    body : callable
        ``body(carry, *row)`` returns the next carry.
    start : expression, number or nested tuple of them
        The first carry.
    *rows : arrays of one length
    reverse : bool
        Whether the last row comes first.

    Returns
    -------
    expression or nested tuple
        The last carry; `start` for arrays without rows.

    Raises
    ------
    KernelError
        When the arrays have different lengths, or the carry changes its structure.

    Examples
    --------
    >>> from gacompiler import SCALAR, array, kernel
    >>> @kernel(x=array(SCALAR, "n"))
    ... def squares(x):
    ...     return fold(lambda sum, each: sum + each * each, 0, x)
    """
    checked_start("fold()", start)
    if is_unrolled("fold()", rows):
        return unrolled_fold(body, start, rows, reverse)
    recorder, length = current(), common_length("fold()", rows)
    layouts = carry_layouts(recorder, "fold()", body, start, rows)
    stems = stems_of(body, [start, *rows])
    tables = recorder.stored(lifted("fold()", start), stems[0], layouts, start)
    counter = recorder.counter()
    with recorder.scope() as scope:
        carry = like(start, recorder.symbols(stems[0], tables))
        result = body(carry, *row_symbols(recorder, rows, counter, stems[1:]))
        recorder.compute(with_structure("fold()", start, result), targets_in(tables))
    recorder.append(Loop(counter, length, reverse, tuple(scope.statements)))
    return like(start, recorder.symbols(stems[0], tables))


def scan(body: Callable[..., Any], start: Any, *rows: Any, parents: Any = None, reverse: bool = False) -> Any:
    """Carry a value over the rows of arrays, and keep it for every row.

    Parameters
    ----------
    body : callable
        ``body(carry, *row)`` returns the carry of the row.
    start : expression, number or nested tuple of them
        The carry before the first row, and of rows without a parent.
    *rows : arrays of one length
    parents : index table, optional
        The row whose carry the body is given, an earlier one, or -1 for `start`; by default the row before.
    reverse : bool
        Whether the last row comes first; not together with `parents`.

    Returns
    -------
    array of rows or nested tuple of arrays
        The carry of each row.

    Raises
    ------
    KernelError
        As `fold` does, and when both `parents` and `reverse` are given.
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
    first = recorder.stored(lifted("scan()", start), [f"{stem}_start" for stem in stems[0]], layouts, start)
    tables = recorder.tables(stems[0], (length,), layouts, start)
    counter = recorder.counter()
    with recorder.scope() as scope:
        symbols = []
        for stem, table, before in zip(stems[0], tables, first, strict=True):
            row: Row = Previous(counter, before.table)
            if parents is not None:
                row = Parent(parents.name, counter, before.table)
            symbols.append(recorder.symbol(stem, Place(table.table, row), table.leaf))
        result = body(like(start, symbols), *row_symbols(recorder, rows, counter, stems[1:]))
        recorder.compute(with_structure("scan()", start, result), targets_in(tables, Counter(counter)))
    recorder.append(Loop(counter, length, reverse, tuple(scope.statements)))
    return like(start, tables)


def each(body: Callable[..., Any], *rows: Any) -> Any:
    """Apply a function to each row of arrays.

    Parameters
    ----------
    body : callable
        ``body(*row)`` returns a multivector or a nested tuple of them.
    *rows : arrays of one length

    Returns
    -------
    array of rows or nested tuple of arrays

    Raises
    ------
    KernelError
        When the arrays have different lengths.
    """
    if is_unrolled("each()", rows):
        return unrolled_each(body, rows)
    recorder, length = current(), common_length("each()", rows)
    counter = recorder.counter()
    with recorder.scope() as scope:
        result = body(*row_symbols(recorder, rows, counter, stems_of(body, rows)))
        found = _new_rows(recorder, "each()", body, result, length)
        recorder.compute(lifted("each()", result), targets_in(found, Counter(counter)))
    recorder.append(Loop(counter, length, False, tuple(scope.statements)))
    return like(result, found)


def total(body: Callable[..., Any], *rows: Any) -> Any:
    """Sum a function of each row: ``sum(body(*row))``, by components where it returns a nested tuple.

    Parameters
    ----------
    body : callable
    *rows : arrays of one length

    Returns
    -------
    expression or nested tuple
        0 for arrays without rows.
    """
    if is_unrolled("total()", rows):
        return unrolled_total(body, rows)
    recorder = current()
    counter = recorder.counter()
    with recorder.attempt(), recorder.scope():
        terms = body(*row_symbols(recorder, rows, counter, stems_of(body, rows)))
        lifted("total()", terms)

    def added(sum: Any, *row: Any) -> Any:
        found = with_structure("total()", terms, body(*row))
        return like(terms, [a + b for a, b in zip(leaves_of(sum), found, strict=True)])

    zero = like(terms, [0] * len(leaves_of(terms)))
    return fold(named_like(body, added, ["sum"]), zero, *rows)


def accumulate(body: Callable[..., Any], zero: Any, *rows: Any, parents: Any = None, keep: bool = False) -> Any:
    """Sum from the last row to the first, or from the leaves of a tree to its root.

    Parameters
    ----------
    body : callable
        ``body(children, *row)`` returns the value of the row, where `children` is the sum of the values of the rows
        whose parent it is; without `parents` that is the next row.
    zero : 0 or nested tuple of zeros
        The sum of no values.
    *rows : arrays of one length
    parents : index table, optional
        The parent of each row, an earlier one, or -1.
    keep : bool
        Whether the body returns ``(value, kept)``: what is summed, and what is only kept for the row.

    Returns
    -------
    array of rows, or nested tuple of arrays
        The values; with `keep` a pair of the values and of what is kept.

    Raises
    ------
    KernelError
        As `fold` does, and when `zero` is something else.
    """
    checked_start("accumulate()", zero)
    if any(_is_something(leaf) for leaf in leaves_of(zero)):
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
    onto: Row = Through((parents.name,), counter) if parents is not None else Following(counter)
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


def gather(rows: Any, index: Any) -> Any:
    """The rows of an array that an index table names, as an array of the table's length.

    Parameters
    ----------
    rows : array of rows or nested tuple of arrays
    index : index table
        No row of it may be -1.
    """
    arrays = leaves_of(rows)
    if isinstance(index, Unrolled):
        return like(rows, [Unrolled(tuple(array.elements[k] for k in index.elements)) for array in arrays])
    is_unrolled("gather()", rows if isinstance(rows, tuple) else (rows,))
    if not isinstance(index, Index):
        raise KernelError("gather()", f"{type(index).__name__} as index", 'an index table, index("n", into="m")')
    for array in arrays:
        if array.through or array.lengths != (index.into,):
            own = f"{', '.join(array.lengths)}, gathered already" if array.through else ", ".join(array.lengths)
            raise KernelError("gather()", f"an array over {own}", f"one over {index.into}, as {index.name} says")
    return like(rows, [current().check_rows(array).at((index,)) for array in arrays])


def scatter(rows: Any, index: Any, onto: Any, start: Any = None) -> Any:
    """Sums of the rows of an array, each added to the row that an index table names.

    Parameters
    ----------
    rows : array of rows or nested tuple of arrays
    index : index table, or a tuple of two
        Rows where it is -1 are left out. Two tables name the row and the column of a matrix of rows.
    onto : array of rows, or a tuple of two
        Arrays that have the length of the result: of each axis, where there are two.
    start : array of rows or nested tuple of arrays, optional
        What an earlier `scatter` onto the same axes returned: the sums are added to it, and it is the result.

    Returns
    -------
    array of rows or nested tuple of arrays

    Raises
    ------
    KernelError
        When the lengths of arrays, index tables and axes do not fit, or `start` is another array.
    """
    tables = index if isinstance(index, tuple) else (index,)
    axes = onto if isinstance(onto, tuple) else (onto,)
    if len(tables) != len(axes):
        raise KernelError("scatter()", f"{len(tables)} index tables for {len(axes)} axes", "one for each")
    arrays = leaves_of(rows)
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
            sums = recorder.tables(leaf_names("scattered", rows), lengths, layouts, rows)
        for name in dict.fromkeys(table.table for table in sums):
            recorder.append(Clear(name))
    else:
        sums = _continued(recorder, start, lengths, layouts)
    counter = recorder.counter()
    onto = Through(tuple(table.name for table in tables), counter)
    with recorder.scope() as scope:
        for first, table in _tables_of(recorder, sums):
            source = _source_of_sums(recorder, arrays[first : first + len(table.leaves)], table, counter)
            recorder.append(Add(source, Place(table.name, onto)))
    recorder.append(Loop(counter, length, False, tuple(scope.statements)))
    return like(rows, sums)


def iterate(body: Callable[..., Any], start: Any, until: Callable[..., Any], at_most: int) -> Any:
    """Repeat a step until a condition holds, or until it was done a number of times.

    Parameters
    ----------
    body : callable
        ``body(carry)`` returns the next carry; it may contain loops.
    start : expression, number or nested tuple of them
    until : callable
        ``until(old, new)`` is a comparison of two carries that follow each other, 1 where the iteration has converged.
    at_most : int
        The largest number of steps.

    Returns
    -------
    carry : expression or nested tuple
    converged : expression
        1 if the condition held after the last step, else 0.
    steps : expression
        How many steps there were.

    Raises
    ------
    KernelError
        When `at_most` is not a positive whole number, or the carry changes its structure.
    """
    checked_start("iterate()", start)
    if not isinstance(at_most, int) or isinstance(at_most, bool) or at_most < 1:
        raise KernelError("iterate()", f"at_most={at_most!r}", "a positive whole number")
    if not is_recording():
        return unrolled_iterate(body, start, until, at_most)
    recorder = current()
    layouts = carry_layouts(recorder, "iterate()", body, start, ())
    stems = stems_of(body, [start])[0]
    values = [*lifted("iterate()", start), lift(0), lift(0)]
    old = recorder.tables(stems, (), layouts, start)
    done, steps = recorder.tables(["converged", "steps"], (), [SCALAR, SCALAR])
    recorder.compute(values, targets_in([*old, done, steps]))
    with recorder.scope() as scope:
        new = recorder.tables([f"next_{stem}" for stem in stems], (), layouts, start)
        carry = like(start, recorder.symbols(stems, old))
        expressions = with_structure("iterate()", start, body(carry))
        recorder.compute(expressions, targets_in(new))
        following = like(start, recorder.symbols([f"next_{stem}" for stem in stems], new))
        (condition,) = lifted("iterate()", _condition(until(carry, following)))
        recorder.compute([condition], targets_in([done]))
        for name, old_name in {a.table: b.table for a, b in zip(new, old, strict=True)}.items():
            recorder.append(Copy(Place(name), Place(old_name)))
    recorder.append(Repeat(at_most, done.table, steps.table, tuple(scope.statements)))
    found = like(start, recorder.symbols(stems, old))
    converged, n_steps = recorder.symbols(["converged", "steps"], [done, steps])
    return found, converged, n_steps


def least(score: Callable[..., Any], *rows: Any) -> tuple[Any, Any]:
    """The smallest score of the rows of arrays, and which row has it: the first of equal ones.

    Parameters
    ----------
    score : callable
        ``score(*row)`` returns a number.
    *rows : arrays of one length

    Returns
    -------
    score, row : expressions
        The row is -1 for arrays without rows, and the score 0.
    """

    def better(best: Any, *row: Any) -> Any:
        found = lift(score(*row))
        if not found.is_scalar:
            raise KernelError("least()", f"a score {found}", "a scalar", "use norm_squared() or a coefficient")
        is_better = select(best.row < 0, 1, found < best.score)
        return select(is_better, found, best.score), select(is_better, best.number, best.row), best.number + 1

    best = fold(named_like(score, better, ["best"]), _Best(0, -1, 0), *rows)
    return best.score, best.row


class _Best(NamedTuple):
    """What `least` carries: the smallest score, its row, and the number of the row that comes."""

    score: Any
    row: Any
    number: Any


def _check_index(where: str, index: Any, length: str, into: str) -> None:
    if not isinstance(index, Index) or (index.length, index.into) != (length, into):
        found = f"{index.name} over {index.length} into {index.into}" if isinstance(index, Index) else repr(index)
        raise KernelError(where, found, f'an index table over {length} into {into}, index("{length}", "{into}")')


def _new_rows(recorder: Recorder, where: str, body: Callable[..., Any], result: Any, length: str) -> list[Rows]:
    """New tables for what a body returns for each row, known in the scope around the loop."""
    expressions = lifted(where, result)
    return recorder.tables(
        result_stems(body, result), (length,), recorder.layouts_of(expressions), result, outside=True
    )


def _is_something(value: Any) -> bool:
    """Whether a value is not zero, or not a constant."""
    expression = lift(value)
    return not is_constant(expression) or bool(evaluate([expression], {})[0].terms)


def _continued(recorder: Recorder, start: Any, lengths: tuple[str, ...], layouts: Sequence[Layout]) -> list[Rows]:
    """The tables of earlier sums, to which more are added."""
    sums = [rows for rows in leaves_of(start) if isinstance(rows, Rows)]
    found = [(rows.lengths, rows.leaf.layout, rows.through) for rows in sums]
    if found != [(lengths, layout, ()) for layout in layouts] or not all(
        recorder.records[rows.table].storage is Storage.WORK for rows in sums
    ):
        raise KernelError("scatter()", "start is another array", "what scatter() returned for the same axes")
    return sums


def _tables_of(recorder: Recorder, sums: Sequence[Rows]) -> list[tuple[int, Record]]:
    """The tables of some arrays, and the number of the first array in each."""
    found: dict[str, int] = {}
    for k, rows in enumerate(sums):
        found.setdefault(rows.table, k)
    return [(k, recorder.records[name]) for name, k in found.items()]


def _source_of_sums(recorder: Recorder, arrays: Sequence[Rows], table: Record, counter: str) -> Place:
    """The row that is added to a row of a table: where the arrays are, if that is alike, or a copy of them.

    Rows that `gather` names are copied: where there is none, adding would leave it out.
    """
    own = recorder.records[recorder.check_rows(arrays[0]).table]
    same_table = all(array.table == own.name and not array.through for array in arrays)
    alike = [leaf.start for leaf in own.leaves] == [leaf.start for leaf in table.leaves] and all(
        array.leaf == leaf and leaf.layout.stored == onto.layout.stored
        for array, leaf, onto in zip(arrays, own.leaves, table.leaves, strict=False)
    )
    if same_table and alike:
        return Place(own.name, row_of(arrays[0], counter))
    (symbols,) = row_symbols(recorder, [tuple(arrays)], counter, [["value"] * len(arrays)])
    outer = table.shape if table.leaf.layout.is_scalar else table.shape[:-1]
    row = recorder.packed("row", (), [leaf.layout for leaf in table.leaves], outer)
    recorder.compute(symbols, targets_in(row))
    return Place(row[0].table)


def _pair(result: Any, keep: bool) -> tuple[Any, Any]:
    """What the body of `accumulate` passes on, and what it keeps."""
    if not keep:
        return result, None
    if not isinstance(result, tuple) or len(result) != 2:
        raise KernelError("accumulate()", "the body returns no pair", "(value, kept), as keep=True says")
    return result


def _condition(value: Any) -> Any:
    if isinstance(value, (tuple, list)) or (isinstance(value, Expression) and not value.is_scalar):
        raise KernelError("iterate()", f"until returns {value}", "a comparison, 1 or 0", "compare a norm")
    return value
