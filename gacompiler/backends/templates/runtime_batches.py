"""What runs the loop of a kernel over a batch under numba, in blocks where arrays do not lie at unit stride.

The same as in the C files; free names are bound before numba compiles it.

Copied into every generated module as it is, with the other ``runtime_`` files.
"""

from __future__ import annotations

from typing import Any

import numpy as np

_ROW, _LEAST_ROW, _SPACE = 64, 16, 24 * 1024
"""Elements of a block if its rows fit into so many bytes, and the fewest in any case."""

# Free names of the functions that follow: the type and the width of a number, and what numba has no words for.
_real: Any = None
_w: Any = None
_call: Any = None
_copy: Any = None
_place: Any = None
_spread: Any = None
_gather: Any = None
_turn_in: Any = None
_turn_out: Any = None
_move_rows: Any = None
_move_part: Any = None


def _numba_move_rows(back: int, x: int, row: int, a: int, s: int, c: int, size: int, n: int) -> None:
    """Rows at `x` of `size` components `c` bytes apart of `n` elements `s` bytes apart at `a`, or back to there."""
    done = 0
    if size == 3 and c == _w and s == 3 * _w:
        if back:
            _gather(a, x, row, n)
        else:
            _spread(x, row, a, n)
        return
    if size >= 4 and c == _w:
        step = 4 if back else 8
        while done + step <= n:
            k = 0
            while k < size:
                first = min(k, size - 4)
                if back:
                    _turn_out(x + (first * row + done) * _w, row * _w, a + done * s + first * _w, s)
                else:
                    _turn_in(a + done * s + first * _w, s, x + (first * row + done) * _w, row * _w)
                k += 4
            done += step
    for k in range(size):
        if back:
            _copy(a + k * c + done * s, s, x + (k * row + done) * _w, _w, n - done)
        else:
            _copy(x + (k * row + done) * _w, _w, a + k * c + done * s, s, n - done)


def _numba_move_part(
    back: int, x: int, row: int, table: Any, at: int, a: int, s: int, strides: Any, first: int, n: int
) -> None:
    """All rows of a part, from the batch or back to it; axes that lie as one are moved as one."""
    count, step, axis = 1, _w, table[at + 1]
    while axis > 0 and (count == 1 or strides[first + axis - 1] == count * step):
        if count == 1:
            step = strides[first + axis - 1]
        count *= table[at + 2 + axis]
        axis -= 1
    for k in range(0, table[at], count):
        offset, rest, outer = 0, k // count, axis - 1
        while outer >= 0:
            offset += rest % table[at + 3 + outer] * strides[first + outer]
            rest //= table[at + 3 + outer]
            outer -= 1
        _move_rows(back, x + k * row * _w, row, a + offset, s, step, count, n)


def _numba_batch(run: int, table: Any, arrays: Any, sizes: Any, strides: Any) -> None:
    """The loop `run` over a batch, in blocks of rows where not all parts lie at unit stride.

    `table` has the numbers of arguments, of parts, of strides in an element and of prepared numbers; then the size of
    each part, its number of axes, whether it is prepared, and its lengths.
    """
    n_inputs, n_parts, n_cores, n_prepared, size = table[0], table[1], table[2], table[3], sizes[0]
    # Where the parts are and what is prepared, the strides in an element, and where the rows are.
    local = np.empty(2 * n_parts + 1 + n_cores, np.intp)
    prepared = np.empty(n_prepared + 1, _real)
    starts, cores, rows = local, local[n_parts + 1 :], local[n_parts + 1 + n_cores :]
    total, n_bytes, at = 0, 0, 4
    for p in range(n_parts):
        starts[p] = arrays[p]
        total += table[at]
        n_bytes += abs(strides[p])
        at += 3 + table[at + 1]
    starts[n_parts] = _place(prepared)
    for core in range(n_cores):
        cores[core] = strides[n_parts + core]
    if n_prepared:
        _call(run, -1, _place(starts), _place(cores))
    row = _ROW if size < (1 << 24) // (n_bytes + 1) else _LEAST_ROW
    while row > _LEAST_ROW and row * total * _w > _SPACE:
        row //= 2
    space = np.empty(row * total, _real)
    x, at, first = _place(space), 4, n_parts
    for p in range(n_parts):
        rank = table[at + 1]
        rows[p] = x
        if strides[p] != _w and table[at + 2] == 0:
            starts[p] = x
            if strides[p] == 0 and p < n_inputs:
                _move_part(0, x, row, table, at, arrays[p], 0, strides, first, min(row, size))
            step = row * _w
            for axis in range(rank - 1, -1, -1):
                cores[first - n_parts + axis] = step
                step *= table[at + 3 + axis]
        x += row * table[at] * _w
        first += rank
        at += 3 + rank
    for i in range(0, size, row):
        n = min(row, size - i)
        at, first = 4, n_parts
        for p in range(n_inputs):
            step = strides[p]
            if step == _w and table[at + 2] == 0:
                starts[p] = arrays[p] + i * _w
            elif step != 0 and table[at + 2] == 0:
                _move_part(0, rows[p], row, table, at, arrays[p] + i * step, step, strides, first, n)
            first += table[at + 1]
            at += 3 + table[at + 1]
        results, first_result = at, first
        for p in range(n_inputs, n_parts):
            if strides[p] == _w:
                starts[p] = arrays[p] + i * _w
        _call(run, n, _place(starts), _place(cores))
        at, first = results, first_result
        for p in range(n_inputs, n_parts):
            step = strides[p]
            if step != _w:
                _move_part(1, rows[p], row, table, at, arrays[p] + i * step, step, strides, first, n)
            first += table[at + 1]
            at += 3 + table[at + 1]
