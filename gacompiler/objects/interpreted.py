"""Programs that the extension runs line by line, as long as their functions are not compiled."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ..gac_runtime.arrays import PATIENCE
from ..ir.program import Line, Operand, Program
from ..ir.scalar import Op

_BLOCK = 64
"""Number of elements that the extension computes at a time, ``BLOCK`` of `extension.c`."""
_WHOLE = {Op.ADD: np.add, Op.SUBTRACT: np.subtract, Op.MULTIPLY: np.multiply, Op.DIVIDE: np.divide}
_FUSED = {Op.ADD: "add_product", Op.SUBTRACT: "subtract_product"}
"""Sums whose last term is a product; it is rounded before it is added, as in two lines."""


class Interpreted:
    """A program of doubles in the form in which the extension runs it, with the same bits as the compiled function.

    Parameters
    ----------
    program : Program
        Its operations are among those of the extension: see `is_interpreted`.
    calls : module
        The extension.
    """

    def __init__(self, program: Program, calls: Any) -> None:
        self._words = _words(program, calls.operations.split())
        self.attempt = _attempts(program, calls, calls.drivers[0], self._words)


class Signs:
    """Changes of the signs of coefficients, of elements that follow each other in memory.

    Reading and writing them takes longer than the operation, so that one loop over all coefficients is as fast as
    possible. `is_together` says whether the elements of an array are so.
    """

    def __init__(self, signs: Sequence[int], program: Program, calls: Any) -> None:
        rows = np.tile(np.array(signs, float), _BLOCK)
        self._words = np.concatenate([np.array([len(signs)], np.int64), rows.view(np.int64)])
        self._attempt = _attempts(program, calls, calls.drivers[1], self._words)

    def __call__(self, array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any] | None:
        """Return the result; None for single elements and other arrays."""
        found: np.ndarray[Any, Any] | None = self._attempt(array) if array.ndim > 1 else None
        return found


def _attempts(program: Program, calls: Any, driver: int, words: np.ndarray[Any, Any]) -> Callable[..., Any]:
    """Return a function that runs a driver on arrays that the extension reads directly; None for all others."""
    (result,), shapes = program.results, tuple(argument.shape for argument in program.arguments)
    call = calls.Call()
    loops = (0, driver, words.ctypes.data), (0, 0, 0)
    call._bind(shapes, (result.shape,), 0, loops, sys.maxsize, PATIENCE // (4 * max(1, len(program.lines))))
    attempt: Callable[..., Any] = call.attempt
    return attempt


def flat_form(program: Program, calls: Any) -> Callable[..., Any] | None:
    """Return a function for programs that combine numbers at equal places: sums, multiples, and changes of signs.

    Arrays with blades along the last axis need no separation of their coefficients then, which takes longer than the
    operation. The function returns None for arrays of different shapes, which broadcast.
    """
    (result,) = program.results
    lines = {line.target: line for line in program.lines}
    entries = [lines.get(operand) if isinstance(operand, str) else None for operand in result.operands]
    columns = [argument.components for argument in program.arguments]
    if not result.shape:
        return None
    if len(columns) == 1 and len(columns[0]) == len(entries):
        signs = []
        for component, line, operand in zip(columns[0], entries, result.operands, strict=True):
            if line is not None and (line.op is not Op.NEGATE or line.operands != (component,)):
                return None
            if line is None and operand != component:
                return None
            signs.append(1 if line is None else -1)
        if 1 not in signs:
            return np.negative
        return Signs(signs, program, calls) if calls is not None else None
    return _sum_or_multiple(program, entries)


def _sum_or_multiple(program: Program, entries: Sequence[Line | None]) -> Callable[..., Any] | None:
    if len(program.arguments) != 2 or any(line is None for line in entries):
        return None
    ops = {line.op for line in entries if line is not None}
    pairs = [line.operands for line in entries if line is not None]
    one, two = (argument.components * (1 if argument.shape else len(pairs)) for argument in program.arguments)
    shapes = [bool(argument.shape) for argument in program.arguments]
    is_swapped = pairs != list(zip(one, two, strict=False))
    if len(ops) != 1 or (is_swapped and pairs != list(zip(two, one, strict=False))):
        return None
    function = _WHOLE.get(ops.pop())
    if function is None or not any(shapes):
        return None

    def run(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> Any:
        if not (a.shape == b.shape if all(shapes) else a.ndim == 0 or b.ndim == 0):
            return None
        with np.errstate(all="ignore"):
            return function(b, a) if is_swapped else function(a, b)

    return run


def is_interpreted(program: Program, calls: Any) -> bool:
    """Whether the extension has all operations of a program: those that have one result in all C libraries."""
    names = calls.operations.split()
    return all(line.op.value in names for line in program.lines)


def _words(program: Program, names: list[str]) -> np.ndarray[Any, Any]:
    """Return the words of a program, which `extension.c` describes."""
    lines = list(_fused(program))
    results = program.results[0].operands
    constants: list[Operand] = []
    slots: dict[Operand, int] = {}
    for argument in program.arguments:
        for component in argument.components:
            slots[component] = len(slots)
    read = [operand for _, _, operands in lines for operand in operands]
    for operand in (*read, *results):
        if not isinstance(operand, str) and operand not in slots:
            slots[operand] = len(slots)
            constants.append(operand)
    last = {operand: k for k, (_, _, operands) in enumerate(lines) for operand in operands}
    last |= dict.fromkeys(results, len(lines))
    free, words = list[int](), list[int]()
    first = n_slots = len(slots)
    for k, (name, target, operands) in enumerate(lines):
        if not free:
            free, n_slots = [n_slots], n_slots + 1
        slots[target] = free.pop()
        a, b, c = (slots[operands[min(i, len(operands) - 1)]] for i in range(3))
        words += [names.index(name), slots[target], a, b, c]
        # All blocks of elements read the slots of inputs and constants.
        free += {slots[each] for each in operands if last[each] == k and slots[each] >= first}
    sizes = [len(argument.components) if argument.shape else 0 for argument in program.arguments]
    bits = np.array([float(each) for each in constants]).view(np.int64)
    head = [len(sizes), len(results), len(constants), len(lines), n_slots, *sizes, *(slots[each] for each in results)]
    return np.concatenate([np.array(head, np.int64), bits, np.array(words, np.int64)])


def _fused(program: Program) -> Iterator[tuple[str, str, tuple[Operand, ...]]]:
    """Yield lines as names of operations, targets and operands; products that one sum uses are parts of it."""
    uses = Counter(operand for line in program.lines for operand in line.operands)
    uses.update(program.results[0].operands)
    products = {line.target: line for line in program.lines if line.op is Op.MULTIPLY and uses[line.target] == 1}
    parts: dict[Line, Line] = {}
    for line in program.lines:
        if line.op in _FUSED:
            terms = line.operands[::-1] if line.op is Op.ADD else line.operands[1:]
            found = next((products[term] for term in terms if isinstance(term, str) and term in products), None)
            if found is not None:
                parts[line] = found
    absent = set(parts.values())
    for line in program.lines:
        if line in parts:
            a, b = line.operands
            other = a if b == parts[line].target else b
            yield _FUSED[line.op], line.target, (*parts[line].operands, other)
        elif line not in absent:
            yield line.op.value, line.target, line.operands
