"""Common parts of the loop functions: structures of values, symbols for rows, and layouts of carries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..algebra.layout import SCALAR, SCALARS, Layout
from ..errors import KernelError
from ..ir.rows import Counter
from .expression import Expression, lift
from .names import stems_of
from .recorded import is_constant
from .recorder import Recorder
from .rows import Index, Rows, Unrolled, leaves_of, like, same_structure

MOST_ROUNDS = 8
"""Maximum number of times that a body is traced until the layout of its carry no longer changes."""


def is_unrolled(where: str, rows: Sequence[Any]) -> bool:
    """Return whether arrays have known lengths, for which loops are unrolled.

    Raises
    ------
    KernelError
        If one of the arguments is not an array of rows, or there are no arguments.
    """
    kinds = {type(leaf) for leaf in leaves_of(tuple(rows))}
    if len(kinds) != 1 or not kinds <= {Rows, Unrolled}:
        found = ", ".join(sorted(kind.__name__ for kind in kinds)) or "no array"
        remedy = "select rows by the index table with gather()" if Index in kinds else "pass arrays after the body"
        raise KernelError(where, found, 'arrays of rows, as array(layout, "n") declares', remedy)
    return Unrolled in kinds


def common_length(where: str, rows: Sequence[Any]) -> Any:
    """Return the common length of all arrays.

    Raises
    ------
    KernelError
        If the lengths differ.
    """
    lengths = {leaf.length: None for leaf in leaves_of(tuple(rows))}
    if len(lengths) != 1:
        raise KernelError(where, f"arrays of lengths {', '.join(map(str, lengths))}", "arrays of one length")
    return next(iter(lengths))


def checked_start(where: str, start: Any) -> None:
    """Raise an error for an initial carry that is None or an empty tuple."""
    leaves = leaves_of(start)
    if not leaves or any(leaf is None for leaf in leaves):
        found = "nothing" if leaves else "an empty tuple"
        raise KernelError(where, f"{found} to begin with", "a number, a multivector, or a tuple of them")


def lifted(where: str, value: Any, arrays: bool = False) -> list[Any]:
    """Return the leaves of a value as expressions; with `arrays`, some of them may be arrays.

    Raises
    ------
    KernelError
        If there are no leaves, or one is None, an index table, or an array that is not expected.
    """
    leaves = leaves_of(value)
    if not leaves:
        raise KernelError(where, "the body returns an empty tuple", "a multivector, or a tuple of them")
    for leaf in leaves:
        if leaf is None:
            raise KernelError(where, "the body returns nothing", "a multivector, or a tuple of them", "add a return")
        if isinstance(leaf, Index) or (isinstance(leaf, (Rows, Unrolled)) and not arrays):
            raise KernelError(
                where, "an array where one multivector is expected", "a multivector, or a tuple of them",
                "reduce the array with fold() or total(), or return it from the kernel",
            )  # fmt: skip
    return [leaf if isinstance(leaf, (Rows, Unrolled)) else lift(leaf) for leaf in leaves]


def with_structure(where: str, structure: Any, value: Any, arrays: bool = False) -> list[Any]:
    """Return the leaves of a value that must have a given structure, as expressions, and with `arrays` also arrays.

    An array must be over the same lengths as the array in its place of the structure.
    """
    if not same_structure(structure, value):
        raise KernelError(
            where,
            f"the body returns {_described(value)}",
            f"{_described(structure)}, the structure of the carry",
        )
    found = lifted(where, value, arrays)
    for wanted, given in zip(leaves_of(structure), found, strict=True):
        if _axes(wanted) != _axes(given):
            raise KernelError(where, f"the body returns {_axes_text(given)}", f"{_axes_text(wanted)}, as at the start")
    return found


def _axes(value: Any) -> tuple[Any, ...]:
    """Return the lengths of an array, or nothing for a multivector."""
    if isinstance(value, Unrolled):
        return (value.length, *(_axes(value.elements[0]) if value.elements else ()))
    return value.lengths if isinstance(value, Rows) else ()


def _axes_text(value: Any) -> str:
    axes = ", ".join(map(str, _axes(value)))
    return f"an array over {axes}" if axes else "a multivector"


def _described(structure: Any) -> str:
    if not isinstance(structure, (tuple, list)):
        return "nothing" if structure is None else "one multivector"
    inner = any(isinstance(part, (tuple, list)) for part in structure)
    return f"a tuple of {len(structure)}" + (f" ({', '.join(map(_described, structure))})" if inner else "")


def condition_of(where: str, value: Any) -> Any:
    """Return the value of a condition.

    Raises
    ------
    KernelError
        If it is not a scalar.
    """
    if isinstance(value, (tuple, list)) or (isinstance(value, Expression) and not value.is_scalar):
        raise KernelError(where, f"until returns {value}", "a comparison, 1 or 0", "compare a norm")
    return value


def bounds_of(where: str, within: Any) -> list[Expression]:
    """Return the bounds of the numbers of the rows of a loop.

    Raises
    ------
    KernelError
        If they are not two scalars.
    """
    is_pair = isinstance(within, (tuple, list)) and len(within) == 2
    found = lifted(where, within) if is_pair else []
    if len(found) != 2 or not all(each.is_scalar for each in found):
        raise KernelError(where, f"within={within}", "the numbers of the first row and of the row after the last")
    return found


def row_symbols(recorder: Recorder, rows: Sequence[Any], counter: str, stems: Sequence[Sequence[str]]) -> list[Any]:
    """Return symbols for the current rows in a loop, in the structures of the arrays.

    A row of an array with several axes is an array.
    """
    return [
        like(structure, recorder.symbols(names, leaves_of(structure), Counter(counter)))
        for structure, names in zip(rows, stems, strict=True)
    ]


def carry_layouts(
    recorder: Recorder, where: str, body: Callable[..., Any], start: Any, rows: Sequence[Any]
) -> tuple[Layout, ...]:
    """Return layouts that hold the carry before and after every row, a fixed point of the body.

    Relations are preserved: the product of unit motors is a unit motor, so a carry that starts as one remains one.
    """
    expressions = lifted(where, start, arrays=True)
    if all((e.leaf.layout if isinstance(e, Rows) else e.algebra) in (SCALAR, SCALARS) for e in expressions):
        # Bodies of nested loops are traced in every round of each outer loop. Scalars usually need one round.
        scalars = (SCALAR,) * len(expressions)
        if set(_result_layouts(recorder, where, body, start, rows, scalars)) <= {SCALAR, None}:
            return scalars
    constant = [not isinstance(each, Rows) and is_constant(each) for each in expressions]
    layouts: list[Layout | None] = [
        None if fixed else layout for fixed, layout in zip(constant, recorder.layouts_of(expressions), strict=True)
    ]
    inference = recorder.inference
    for _ in range(MOST_ROUNDS):
        found = _result_layouts(recorder, where, body, start, rows, layouts)
        before = list(layouts)
        for k, (layout, new) in enumerate(zip(before, found, strict=True)):
            joined = layout if new is None else new if layout is None else inference.joined(layout, new)
            if constant[k] and joined is not None:
                joined = inference.joined_with_constant(joined, expressions[k])
            layouts[k] = joined
        if layouts == before:
            known = zip(layouts, expressions, strict=True)
            fixed = [inference.layout_of_constant(e) if layout is None else layout for layout, e in known]
            if None in layouts:
                _check_zeros(where, layouts, fixed, _result_layouts(recorder, where, body, start, rows, fixed))
            return tuple(fixed)
    raise KernelError(
        where, f"the layout of the carry still changes after {MOST_ROUNDS} rounds", "a carry of one layout"
    )


def _check_zeros(
    where: str, known: Sequence[Layout | None], fixed: Sequence[Layout], found: Sequence[Layout | None]
) -> None:
    """Raise an error for a carry that remains zero although the body can return other blades."""
    for layout, own, result in zip(known, fixed, found, strict=True):
        if layout is None and result is not None:
            further = {slot.blade for slot in result.stored} - {slot.blade for slot in own.stored}
            if further or result.algebra != own.algebra:
                raise KernelError(
                    where, "a carry that is always zero, because the body returns zero for it",
                    "a start that the body changes", "begin with 1 for products, or with a value of the first row",
                )  # fmt: skip


def _result_layouts(
    recorder: Recorder,
    where: str,
    body: Callable[..., Any],
    start: Any,
    rows: Sequence[Any],
    layouts: Sequence[Layout | None],
) -> tuple[Layout | None, ...]:
    """Return the layouts of the result of a body for a carry of given layouts, or of `start` where a layout is None.

    A resulting layout is None where the result is zero in this round, which does not constrain other rounds.
    """
    stems = stems_of(body, [start, *rows])
    with recorder.attempt():
        counter = recorder.counter()
        with recorder.scope():
            carry = []
            for stem, expression, layout in zip(stems[0], lifted(where, start, arrays=True), layouts, strict=True):
                if layout is None:
                    carry.append(expression)
                else:
                    carry += recorder.symbols([stem], recorder.tables([stem], (), [layout], (expression,)))
            result = body(like(start, carry), *row_symbols(recorder, rows, counter, stems[1:]))
            expressions = with_structure(where, start, result, arrays=True)
            known = zip(expressions, recorder.layouts_of(expressions), strict=True)
            return tuple(layout if isinstance(e, Rows) or e.blades else None for e, layout in known)
