"""Searches over the rows of arrays in kernels, and rows that are selected by a computed number.

These functions are written with `fold`, `scan` and `total`, so that they are proved and differentiated like any loop.
Numbers of rows are values like others; -1 stands for no row.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ..algebra.operations import Operation
from ..errors import KernelError
from ..ir.procedure import Place, Storage
from ..ir.rows import Counter
from .expression import Expression, lift
from .loop_bodies import condition_of, is_unrolled, lifted
from .loops import fold, scan, total
from .names import named_like
from .operations import select
from .recorded import Record
from .recorder import Recorder
from .recording import current
from .rows import Rows, Unrolled, elements_of, leaves_of, like, same_structure, with_elements


class _Best(NamedTuple):
    """The carry of `least`: the smallest score or scores so far, their rows, and the number of the next row."""

    score: Any
    row: Any
    number: Any


def least(score: Callable[..., Any], *rows: Any, count: int | None = None) -> tuple[Any, Any]:
    """Find the row of arrays with the smallest score, or several rows with the smallest scores.

    Parameters
    ----------
    score : callable
        ``score(*row)`` returns a scalar.
    *rows : arrays of equal length
    count : int, optional
        How many rows to find.

    Returns
    -------
    score, row : expressions
        The smallest score, and the number of the first row that has it. Where there is no row, the score is 0 and the
        row -1. With `count`, tuples of scores and rows, the smallest first; of equal scores, the first row is first.

    Raises
    ------
    KernelError
        If the arrays have different lengths, a score is not a scalar, or `count` is not a positive integer.
    """
    if count is not None and (not isinstance(count, int) or isinstance(count, bool) or count < 1):
        raise KernelError("least()", f"count={count!r}", "a positive integer")

    def scored(*row: Any) -> Expression:
        found = lift(score(*row))
        if not found.is_scalar:
            raise KernelError("least()", f"a score {found}", "a scalar", "use norm_squared() or a coefficient")
        return found

    def better(best: Any, *row: Any) -> Any:
        found = scored(*row)
        is_better = select(best.row < 0, 1, found < best.score)
        return select(is_better, found, best.score), select(is_better, best.number, best.row), best.number + 1

    def inserted(best: Any, *row: Any) -> Any:
        value, number = scored(*row), best.number
        scores, places = [], []
        for score, place in zip(best.score, best.row, strict=True):  # `value` takes the place of the first larger one.
            is_better = select(place < 0, 1, value < score)
            scores.append(select(is_better, value, score))
            places.append(select(is_better, number, place))
            value, number = select(is_better, score, value), select(is_better, place, number)
        return tuple(scores), tuple(places), best.number + 1

    if count is None:
        best = fold(named_like(score, better, ["best"]), _Best(0, -1, 0), *rows)
    else:
        best = fold(named_like(score, inserted, ["best"]), _Best((0,) * count, (-1,) * count, 0), *rows)
    return best.score, best.row


def first_row(condition: Callable[..., Any], *rows: Any) -> Any:
    """Find the first row of arrays that satisfies a condition; later rows are not read.

    Parameters
    ----------
    condition : callable
        ``condition(*row)`` returns 1 or 0.
    *rows : arrays of equal length

    Returns
    -------
    expression
        The number of the row, or -1 if there is none.
    """

    def step(carry: Any, *row: Any) -> Any:
        found, number = carry
        return select(condition_of("first_row()", condition(*row)), number, found), number + 1

    return fold(named_like(condition, step, ["found"]), (-1, 0), *rows, until=lambda carry: carry[0] >= 0)[0]


def any_row(condition: Callable[..., Any], *rows: Any) -> Any:
    """Return 1 if a row of arrays satisfies a condition, else 0; see `first_row`."""
    return first_row(condition, *rows) >= 0


def all_rows(condition: Callable[..., Any], *rows: Any) -> Any:
    """Return 1 if all rows of arrays satisfy a condition, else 0; rows after the first that does not are not read."""
    return first_row(lambda *row: select(condition(*row), 0, 1), *rows) < 0


def count_rows(condition: Callable[..., Any], *rows: Any) -> Any:
    """Return how many rows of arrays satisfy a condition, a function that returns 1 or 0 for a row."""
    return total(named_like(condition, lambda *row: select(condition(*row), 1, 0)), *rows)


def row_numbers(rows: Any) -> Any:
    """Return the numbers of the rows of an array, from 0, as an array of scalars.

    Parameters
    ----------
    rows : array of rows or nested tuple of arrays

    Returns
    -------
    array of scalars
    """
    first = leaves_of(rows)[0]
    found = scan(lambda number, row: number + 1, -1, first)
    if isinstance(found, Rows):
        current().numbers.add(found.table)
    return found


def pick(rows: Any, number: Any, otherwise: Any) -> Any:
    """Return the row of an array that has a computed number.

    Parameters
    ----------
    rows : array of rows or nested tuple of arrays
    number : expression
        The number of the row; a fractional part is ignored.
    otherwise : expression, number or nested tuple of them
        The value if there is no such row, because the number is negative, not smaller than the length, or NaN. For an
        array with several axes, the value of each element of the row.

    Returns
    -------
    expression, array or nested tuple of them

    Raises
    ------
    KernelError
        If the number is not a scalar, or `otherwise` has not the structure of a row.

    Notes
    -----
    A number that comes from `row_numbers` of an array of the same length costs nothing. With other numbers, the
    elements of a batch are computed one after the other, since they read different rows. Derivatives with respect to
    the number are zero.
    """
    if not same_structure(rows, otherwise):
        raise KernelError("pick()", f"otherwise is {otherwise}", "a value with the structure of a row")
    where = lift(number)
    if not where.is_scalar:
        raise KernelError("pick()", f"a number {where}", "a scalar")
    arrays, values = leaves_of(rows), lifted("pick()", otherwise)
    if is_unrolled("pick()", rows if isinstance(rows, tuple) else (rows,)):
        return like(rows, [_unrolled_row(array, where, value) for array, value in zip(arrays, values, strict=True)])
    recorder = current()
    loop = _loop_of(recorder, where, arrays)
    if loop is not None:
        return like(rows, recorder.symbols(["picked"] * len(arrays), [array.at(loop) for array in arrays]))
    (row,) = recorder.once((where,), lambda: recorder.stored([where], ["number"], recorder.layouts_of([where])))
    found = []
    arrays = [recorder.selectable(array) for array in arrays]
    arrays = [_with_start(recorder, array, value) for array, value in zip(arrays, values, strict=True)]
    for array in arrays:
        record = recorder.records[recorder.check_rows(array).table]
        start = array.start or only_row(recorder, record, arrays, values).name
        found.append(array.numbered(row.table, start))
    return like(rows, recorder.symbols(["picked"] * len(arrays), found))


def _with_start(recorder: Recorder, array: Rows, value: Expression) -> Rows:
    """Return an array, or a copy if it is a row with a computed number in whose place there is another value.

    One table stands for all rows that do not exist, whatever the axis along which there is no such row.
    """
    known = recorder.otherwise.get((array.start, array.leaf))
    constants = [each.data for each in (known, value) if each is not None and each.operation is Operation.CONSTANT]
    is_same = known is value or (len(constants) == 2 and constants[0] == constants[1])
    return array if is_same or not array.start else recorder.copied(array)


def _unrolled_row(array: Unrolled, number: Expression, otherwise: Expression) -> Any:
    """Return the row of an array of known length that has a number."""
    found: Any = None
    for k, element in enumerate(array.elements):
        is_here = select(number >= k, number < k + 1, 0)
        others = [otherwise] * len(elements_of(element)) if found is None else elements_of(found)
        pairs = zip(elements_of(element), others, strict=True)
        found = with_elements(element, (lift(select(is_here, new, old)) for new, old in pairs))
    return otherwise if found is None else found


def _loop_of(recorder: Recorder, number: Expression, arrays: Sequence[Rows]) -> Counter | None:
    """Return the loop whose current row has the number, if all its rows are rows of the arrays."""
    if number.operation is not Operation.INPUT:
        return None
    place = recorder.source(number).place
    if place.table not in recorder.numbers or not isinstance(place.row, Counter):
        return None
    (length,) = recorder.records[place.table].lengths
    return place.row if all(array.length == length for array in arrays) else None


def only_row(recorder: Recorder, record: Record, arrays: Sequence[Rows], values: Sequence[Expression]) -> Record:
    """Return a table with a single row like those of another table, in which the given arrays have given values."""
    by = {array.leaf: value for array, value in zip(arrays, values, strict=True) if array.table == record.name}
    chosen = tuple(by.get(leaf, lift(0)) for leaf in record.leaves)

    def make() -> Record:
        name = recorder.unique("otherwise")
        scope = recorder.scopes[-1].number
        made = recorder.add(Record(name, (), record.leaves, Storage.WORK, record.shape, scope=scope))
        recorder.otherwise.update({(name, leaf): value for leaf, value in by.items()})
        recorder.compute(chosen, [(Place(name), leaf) for leaf in made.leaves])
        return made

    return recorder.once((record.leaves, record.shape, tuple(by), chosen), make)
