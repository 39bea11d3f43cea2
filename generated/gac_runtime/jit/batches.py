"""Compiled driver that runs the loop of a kernel over a batch, in blocks if arrays do not have unit stride.

The algorithm is that of the C files. Free names are bound before numba compiles the functions.
"""

from __future__ import annotations

from typing import Any

import numpy as np

ROW, LEAST_ROW, SPACE = 64, 16, 24 * 1024
"""Number of elements of a block, the least such number, and the bytes into which the rows of a block should fit."""
LINE, LEAST_ALIGNED = 64, 512
"""Bytes of a cache line, and the least number of elements for which stores of results are aligned to lines."""
HEAD, FORM, N_FLAGS = 3, 5, 62
"""Layout of the table of a kernel: length of the header and of each form; number of arguments that forms can fix."""
DONE = -1
"""Result of the driver on success; callbacks of numba return 0 after an exception, such as a failed allocation."""
STILL, AS_IT_LIES, MOVED = 0, 1, 2
"""How a part is passed to its loop: constant for all elements, in place, or copied through rows of a block."""

CONSTANTS = (
    *("ROW", "LEAST_ROW", "SPACE", "LINE", "LEAST_ALIGNED", "HEAD", "FORM", "N_FLAGS", "DONE"),
    *("STILL", "AS_IT_LIES", "MOVED"),
)
"""The names above, which are bound in the functions below."""

# Free names of the following functions: the dtype and its width, and operations that numba cannot express.
_real: Any = None
_w: Any = None
_LANES: Any = None
_HALF: Any = None
_call: Any = None
_copy: Any = None
_place: Any = None
_at: Any = None
_spread: Any = None
_gather: Any = None
_turn_in: Any = None
_turn_out: Any = None
_move_rows: Any = None
_move_part: Any = None
_lay_rows: Any = None
_move_block: Any = None


def move_rows(back: int, x: int, row: int, a: int, s: int, c: int, size: int, n: int) -> None:
    """Copy `size` components, `c` bytes apart, of `n` elements, `s` bytes apart, from `a` to rows at `x`, or back."""
    done = 0
    if size == 3 and c == _w and s == 3 * _w:
        if back:
            _gather(a, x, row, n)
        else:
            _spread(x, row, a, n)
        return
    if size >= _HALF and c == _w:
        while done + _LANES <= n:
            k = 0
            while k < size:
                first = min(k, size - _HALF)
                if back:
                    _turn_out(x + (first * row + done) * _w, row * _w, a + done * s + first * _w, s)
                else:
                    _turn_in(a + done * s + first * _w, s, x + (first * row + done) * _w, row * _w)
                k += _HALF
            done += _LANES
    for k in range(size):
        if back:
            _copy(a + k * c + done * s, s, x + (k * row + done) * _w, _w, n - done)
        else:
            _copy(x + (k * row + done) * _w, _w, a + k * c + done * s, s, n - done)


def move_part(
    back: int, x: int, row: int, table: Any, at: int, a: int, s: int, strides: Any, first: int, n: int
) -> None:
    """Copy all rows of a part from the batch or back to it; contiguous axes are merged."""
    count, step, axis = 1, _w, table[at + 1]
    while axis > 0 and (count == 1 or strides[first + axis - 1] == count * step):
        if count == 1:
            step = strides[first + axis - 1]
        count *= table[at + 1 + axis]
        axis -= 1
    for k in range(0, table[at], count):
        offset, rest, outer = 0, k // count, axis - 1
        while outer >= 0:
            offset += rest % table[at + 2 + outer] * strides[first + outer]
            rest //= table[at + 2 + outer]
            outer -= 1
        _move_rows(back, x + k * row * _w, row, a + offset, s, step, count, n)


def lay_rows(
    table: Any, arrays: Any, steps: Any, hoisted: int, size: int, row: int, x: int, rows: Any, starts: Any, kinds: Any,
    cores: Any
) -> None:  # fmt: skip
    """Determine how each part is passed to its loop, and assign rows, from `x` on, to parts that are copied."""
    n_inputs, n_parts = table[0], table[1]
    at, first = HEAD, n_parts
    for p in range(n_parts):
        rank, step = table[at + 1], steps[p]
        rows[p] = x
        if p < N_FLAGS and hoisted >> p & 1 == 1:
            kinds[p] = STILL
        elif step == _w:
            kinds[p] = AS_IT_LIES
        else:
            kinds[p] = MOVED
            starts[p] = x
            if step == 0 and p < n_inputs:
                kinds[p] = STILL
                _move_part(0, x, row, table, at, arrays[p], 0, steps, first, min(row, size))
            between = row * _w
            for axis in range(rank - 1, -1, -1):
                cores[first - n_parts + axis] = between
                between *= table[at + 2 + axis]
        x += row * table[at] * _w
        first += rank
        at += 2 + rank


def move_block(back: int, table: Any, arrays: Any, steps: Any, kinds: Any, rows: Any, row: int, i: int, n: int) -> None:
    """Copy the arguments of `n` elements from `i` on into rows, or the results back from rows."""
    at, first = HEAD, table[1]
    for p in range(table[1]):
        if kinds[p] == MOVED and (p >= table[0]) == (back == 1):
            _move_part(back, rows[p], row, table, at, arrays[p] + i * steps[p], steps[p], steps, first, n)
        first += table[at + 1]
        at += 2 + table[at + 1]


def run_batch(table: Any, arrays: Any, sizes: Any, steps: Any) -> int:
    """Run a kernel over a batch: in one call if its loop can use all parts in place, else in blocks of rows.

    `table` has the numbers of arguments, of parts and of strides in an element. Then follow, for each part, its size,
    its number of axes and its lengths. Then follow the forms, the last of which is the kernel itself: the constant
    arguments as a bit mask, the least number of elements, the number of prepared values, and the loops over rows and
    over elements in C order.

    Return `DONE`, or the index in the table of a loop that has to be compiled first; 0 after an error.
    """
    n_inputs, n_parts, n_cores, size = table[0], table[1], table[2], sizes[0]
    at, first, still, ordered = HEAD, n_parts, 0, True
    for p in range(n_parts):
        if size > 1 and p < min(n_inputs, N_FLAGS) and steps[p] == 0:
            still |= 1 << p
        else:
            step = _w
            for axis in range(table[at + 1] - 1, -1, -1):
                ordered = ordered and steps[first + axis] == step
                step *= table[at + 2 + axis]
            ordered = ordered and (steps[p] == step or size == 1)
        first += table[at + 1]
        at += 2 + table[at + 1]
    while still & table[at] != table[at] or size < table[at + 1]:
        at += FORM
    hoisted, n_prepared = table[at], table[at + 2]
    in_order, in_place = ordered and still == hoisted, True
    place = at + 4 if in_order else at + 3
    run = table[place]
    if run == 0:
        return place
    for p in range(n_parts):
        in_place = in_place and (steps[p] == _w or size == 1 or (p < N_FLAGS and hoisted >> p & 1 == 1))
    # Number of elements before the first whose result starts a cache line: stores across two lines take twice the time.
    head = 0
    if size >= LEAST_ALIGNED and not in_order and steps[n_inputs] == _w:
        head = (-arrays[n_inputs] & (LINE - 1)) // _w
    if (in_order or in_place) and hoisted == 0 and head == 0:
        _call(run, size, _at(arrays, 0), _at(steps, n_parts))
        return DONE
    # Addresses of parts and prepared numbers, addresses of rows, how parts are passed, and strides within an element.
    local = np.empty(3 * n_parts + 1 + n_cores, np.intp)
    prepared = np.empty(n_prepared + 1, _real)
    starts, rows, kinds, cores = local, local[n_parts + 1 :], local[2 * n_parts + 1 :], local[3 * n_parts + 1 :]
    for p in range(n_parts):
        starts[p] = arrays[p]
    starts[n_parts] = _place(prepared)
    for core in range(n_cores):
        cores[core] = steps[n_parts + core]
    if hoisted != 0:
        _call(run, -1, _place(starts), _place(cores))
    if in_order or in_place:
        if head != 0:
            _call(run, head, _place(starts), _place(cores))
            for p in range(n_parts):
                starts[p] += head * steps[p]
        _call(run, size - head, _place(starts), _place(cores))
        # numba frees an array after its last use, but these are used through their addresses up to here.
        local[0] = prepared[0]
        return DONE
    total, n_bytes, at = 0, 0, HEAD
    for p in range(n_parts):
        total += table[at]
        n_bytes += abs(steps[p])
        at += 2 + table[at + 1]
    row = ROW if size < (1 << 24) // (n_bytes + 1) else LEAST_ROW
    while row > LEAST_ROW and row * total * _w > SPACE:
        row //= 2
    space = np.empty(row * total, _real)
    _lay_rows(table, arrays, steps, hoisted, size, row, _place(space), rows, starts, kinds, cores)
    for i in range(0, size, row):
        n = min(row, size - i)
        for p in range(n_parts):
            if kinds[p] == AS_IT_LIES:
                starts[p] = arrays[p] + i * _w
        _move_block(0, table, arrays, steps, kinds, rows, row, i, n)
        _call(run, n, _place(starts), _place(cores))
        _move_block(1, table, arrays, steps, kinds, rows, row, i, n)
    space[0] = local[0] = prepared[0]
    return DONE
