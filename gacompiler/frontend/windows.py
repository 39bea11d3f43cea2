"""Windows: the neighbours of every element of an array, for filters, pyramids and matching.

A window is a tuple of arrays, one for each neighbour, and no numbers are copied: the loops over these arrays read rows
at a distance (`ir.procedure.Shifted`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import Any

from ..errors import KernelError
from ..ir.boundaries import BOUNDARIES, row_near
from .expression import Expression
from .loop_bodies import is_unrolled, lifted
from .recorded import is_constant
from .recorder import Recorder
from .recording import current
from .rows import Axis, Rows, Shift, Unrolled, elements_of, leaves_of, like, same_structure, with_elements
from .searches import only_row


def window(
    image: Any,
    rows: Any,
    columns: Any = None,
    boundary: str = "reflect",
    value: Any = 0,
    stride: Any = 1,
    onto: Any = None,
) -> Any:
    """Return the neighbours of all elements of an array.

    Parameters
    ----------
    image : array of rows or nested tuple of arrays
    rows : int or sequence of int
        The distances of neighbours along the first axis, or how many consecutive ones there are. An odd number of them
        is centred; an even number has one more before the element than after it, as in ``scipy.ndimage``.
    columns : int or sequence of int, optional
        The same for the second axis. By default the window has one axis.
    boundary : str
        What neighbours beyond the ends of an axis are: ``"reflect"`` (``b a | a b c | c b``), ``"mirror"``
        (``c b | a b c | b a``), ``"nearest"`` (``a a | a b c | c c``), ``"wrap"`` (``b c | a b c | a b``), or
        ``"constant"`` (`value`), as in ``scipy.ndimage``.
    value : number, constant or nested tuple of them
        The neighbours beyond the ends with the boundary ``"constant"``. With `onto`, these are also all neighbours in
        an array without elements.
    stride : int or tuple of int
        Element i of the result has the neighbours of element ``stride * i``; along each axis, if it is a tuple.
    onto : array of rows or tuple of arrays, optional
        An array with the lengths of the result, or one array for each axis. It is required with a stride other than 1.
        By default the lengths are those of `image`.

    Returns
    -------
    tuple
        An array for each distance along the first axis, in the order of `rows`. With `columns`, a tuple of arrays for
        each of them. If `image` is a tuple of arrays, each array is a tuple of the same structure.

    Raises
    ------
    KernelError
        If `image` has fewer axes than the window, or an argument is not as described.

    Examples
    --------
    >>> from gacompiler import SCALAR, array, each, kernel, window
    >>> @kernel(x=array(SCALAR, "n"))
    ... def differences(x):
    ...     return each(lambda before, after: (after - before) / 2, *window(x, (-1, 1), boundary="nearest"))
    """
    distances = [_distances("rows", rows)] + ([] if columns is None else [_distances("columns", columns)])
    if boundary not in BOUNDARIES:
        raise KernelError("window()", f"boundary={boundary!r}", f"one of {', '.join(BOUNDARIES)}")
    strides = stride if isinstance(stride, tuple) else (stride,) * len(distances)
    if len(strides) != len(distances) or not all(_is_integer(k) and k > 0 for k in strides):
        raise KernelError("window()", f"stride={stride!r}", "a positive integer, or one for each axis of the window")
    if onto is None and any(k != 1 for k in strides):
        raise KernelError(
            "window()", f"stride={stride!r} without lengths of the result", "an array with these lengths",
            "pass a parameter with other named lengths as onto=",
        )  # fmt: skip
    is_known = is_unrolled("window()", [image])
    arrays: list[Any] = leaves_of(image)
    values: list[Any] = _values(image, value)
    for array in arrays:
        if _n_axes(array) < len(distances):
            raise KernelError("window()", f"an array over {_n_axes(array)} lengths", f"at least {len(distances)}")
    lengths = _lengths(arrays[0], onto, len(distances))
    shifts = [[Shift(by, boundary, step, "") for by in own] for own, step in zip(distances, strides, strict=True)]
    along = _along_known if is_known else _along
    if not is_known:
        recorder = current()
        for axis in range(len(distances)):
            arrays = [recorder.selectable(array, axis) for array in arrays]
        values = _single_rows(recorder, arrays, values)

    def made(found: Sequence[Any], axis: int) -> Any:
        if axis == len(distances):
            return like(image, found)
        chosen = (along(found, values, Axis(lengths[axis], None, shift), axis) for shift in shifts[axis])
        return tuple(made(each, axis + 1) for each in chosen)

    return made(arrays, 0)


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _distances(name: str, given: Any) -> tuple[int, ...]:
    """Return the distances of neighbours along an axis."""
    if _is_integer(given) and given > 0:
        return tuple(range(-(given // 2), given - given // 2))
    found = tuple(given) if isinstance(given, (tuple, list, range)) else ()
    if not found or not all(map(_is_integer, found)):
        raise KernelError("window()", f"{name}={given!r}", "a positive number of neighbours, or their distances")
    return found


def _values(image: Any, value: Any) -> list[Expression]:
    """Return the constants that stand for rows beyond the ends, one for each array."""
    if not isinstance(value, (tuple, list)):
        value = like(image, [value] * len(leaves_of(image)))
    found = lifted("window()", value) if same_structure(image, value) else []
    if not found or not all(map(is_constant, found)):
        raise KernelError("window()", f"value={value}", "a constant with the structure of an element")
    return found


def _n_axes(array: Any) -> int:
    if isinstance(array, Unrolled):
        return 1 + (_n_axes(array.elements[0]) if array.elements else 0)
    return len(array.order) if isinstance(array, Rows) else 0


def _length(array: Any, axis: int) -> Any:
    """Return the length of an array along an axis: its name, or the number of elements if it is known."""
    if isinstance(array, Unrolled):
        return len(array.elements) if axis == 0 else _length(array.elements[0], axis - 1)
    return array.lengths[axis]


def _lengths(array: Any, onto: Any, n_axes: int) -> list[Any]:
    """Return the lengths of the result along the axes of the window."""
    if onto is None:
        return [_length(array, axis) for axis in range(n_axes)]
    given = onto if isinstance(onto, tuple) else (onto,)
    if not all(isinstance(each, (Rows, Unrolled)) for each in given):
        raise KernelError("window()", f"onto={onto}", "an array of rows, or one for each axis")
    if len(given) == 1 and _n_axes(given[0]) >= n_axes:
        return [_length(given[0], axis) for axis in range(n_axes)]
    if len(given) != n_axes:
        raise KernelError("window()", f"{len(given)} arrays as onto", f"one over {n_axes} lengths, or {n_axes} arrays")
    return [_length(each, 0) for each in given]


def _along_known(arrays: Sequence[Unrolled], values: Sequence[Expression], chosen: Axis, axis: int) -> list[Any]:
    """Return arrays of known length of the neighbours at a distance along an axis."""
    shift = chosen.shift
    assert shift is not None

    def along(array: Any, value: Expression, depth: int) -> Any:
        rows = array.elements
        if depth:
            return Unrolled(tuple(along(row, value, depth - 1) for row in rows))
        places = (shift.stride * k + shift.by for k in range(int(chosen.length)))
        numbers = [row_near(shift.boundary, place, len(rows)) for place in places]
        return Unrolled(tuple(_filled(rows[0], value) if k is None else rows[k] for k in numbers))

    return [along(array, value, axis) for array, value in zip(arrays, values, strict=True)]


def _filled(row: Any, value: Expression) -> Any:
    """Return a row like another one, in which all elements have a value."""
    return with_elements(row, (value for _ in elements_of(row)))


def _along(arrays: Sequence[Rows], starts: Sequence[Callable[[], str]], chosen: Axis, axis: int) -> list[Rows]:
    """Return arrays of the neighbours at a distance along an axis; `starts` return the rows beyond the ends."""
    shift = chosen.shift
    assert shift is not None
    found = []
    for array, start in zip(arrays, starts, strict=True):
        is_same = chosen.length == array.lengths[axis] and shift.stride == 1
        if is_same and shift.by == 0:
            found.append(array)
        else:
            is_there = is_same and shift.boundary != "constant"
            found.append(array.along(axis, replace(chosen, shift=replace(shift, start="" if is_there else start()))))
    return found


def _single_rows(recorder: Recorder, arrays: Sequence[Rows], values: Sequence[Expression]) -> list[Callable[[], str]]:
    """Return functions that return the name of a table with a single row of given values, one for each array."""
    made = cache(lambda table: only_row(recorder, recorder.records[table], arrays, values).name)
    return [partial(made, array.table) for array in arrays]
