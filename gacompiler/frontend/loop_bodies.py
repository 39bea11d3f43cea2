"""What loop functions share: the structures of their values, symbols for rows, and the layouts of carries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..algebra.layout import Layout
from ..errors import KernelError
from ..ir.procedure import Counter, Row, Through
from .expression import Expression, lift
from .names import stems_of
from .recorded import is_constant
from .recorder import Recorder
from .rows import Index, Rows, Unrolled, leaves_of, like, same_structure

MOST_ROUNDS = 8
"""How often a body is traced until the layout of its carry no longer changes."""


def is_unrolled(where: str, rows: Sequence[Any]) -> bool:
    """Whether arrays have known lengths, for which loops are written out.

    Raises
    ------
    KernelError
        When there is something else among them, or nothing.
    """
    kinds = {type(leaf) for leaf in leaves_of(tuple(rows))}
    if len(kinds) != 1 or not kinds <= {Rows, Unrolled}:
        found = ", ".join(sorted(kind.__name__ for kind in kinds)) or "no array"
        remedy = "name the rows it stands for with gather()" if Index in kinds else "give arrays behind the body"
        raise KernelError(where, found, 'arrays of rows, as array(layout, "n") declares', remedy)
    return Unrolled in kinds


def common_length(where: str, rows: Sequence[Any]) -> Any:
    """The length that all arrays have.

    Raises
    ------
    KernelError
        When they differ, or an array has more than one axis.
    """
    lengths = {leaf.length: None for leaf in leaves_of(tuple(rows))}
    if len(lengths) != 1:
        raise KernelError(where, f"arrays of lengths {', '.join(map(str, lengths))}", "arrays of one length")
    for leaf in leaves_of(tuple(rows)):
        if isinstance(leaf, Rows) and not leaf.through and len(leaf.lengths) > 1:
            raise KernelError(where, f"an array over {', '.join(leaf.lengths)}", "an array over one length")
    return next(iter(lengths))


def checked_start(where: str, start: Any) -> None:
    """Refuse a carry that holds nothing."""
    leaves = leaves_of(start)
    if not leaves or any(leaf is None for leaf in leaves):
        found = "nothing" if leaves else "an empty tuple"
        raise KernelError(where, f"{found} to begin with", "a number, a multivector, or a tuple of them")


def lifted(where: str, value: Any) -> list[Expression]:
    """The leaves of a value as expressions.

    Raises
    ------
    KernelError
        When there are none, or one is an array or nothing.
    """
    leaves = leaves_of(value)
    if not leaves:
        raise KernelError(where, "the body returns an empty tuple", "a multivector, or a tuple of them")
    for leaf in leaves:
        if leaf is None:
            raise KernelError(where, "the body returns nothing", "a multivector, or a tuple of them", "add a return")
        if isinstance(leaf, (Rows, Unrolled, Index)):
            raise KernelError(
                where, "an array where one multivector is expected", "a multivector, or a tuple of them",
                "reduce the array with fold() or total(), or return it from the kernel",
            )  # fmt: skip
    return [lift(leaf) for leaf in leaves]


def with_structure(where: str, structure: Any, value: Any) -> list[Expression]:
    """The leaves of a value that must have a given structure."""
    if not same_structure(structure, value):
        raise KernelError(
            where,
            f"the body returns {_described(value)}",
            f"{_described(structure)}, the structure of what it carries",
        )
    return lifted(where, value)


def _described(structure: Any) -> str:
    if not isinstance(structure, (tuple, list)):
        return "nothing" if structure is None else "one multivector"
    inner = any(isinstance(part, (tuple, list)) for part in structure)
    return f"a tuple of {len(structure)}" + (f" ({', '.join(map(_described, structure))})" if inner else "")


def row_of(array: Rows, counter: str) -> Row:
    """The row of an array that a loop has come to."""
    return Through(tuple(index.name for index in array.through), counter) if array.through else Counter(counter)


def row_symbols(recorder: Recorder, rows: Sequence[Any], counter: str, stems: Sequence[Sequence[str]]) -> list[Any]:
    """Symbols for the rows that a loop has come to, in the structures of the arrays."""
    found = []
    for structure, names in zip(rows, stems, strict=True):
        symbols = [
            recorder.row_symbol(stem, array, row_of(array, counter))
            for array, stem in zip(leaves_of(structure), names, strict=True)
        ]
        found.append(like(structure, symbols))
    return found


def carry_layouts(
    recorder: Recorder, where: str, body: Callable[..., Any], start: Any, rows: Sequence[Any]
) -> tuple[Layout, ...]:
    """Layouts that hold the carry before and after every row: a fixed point of the body.

    Relations count: the product of unit motors is a unit motor, so a carry that begins with one is one in every row.
    """
    expressions = lifted(where, start)
    constant = [is_constant(expression) for expression in expressions]
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
            return tuple(inference.layout_of_constant(e) if layout is None else layout for layout, e in known)
    raise KernelError(
        where, f"the layout of the carry still changes after {MOST_ROUNDS} rounds", "a carry of one layout"
    )


def _result_layouts(
    recorder: Recorder,
    where: str,
    body: Callable[..., Any],
    start: Any,
    rows: Sequence[Any],
    layouts: Sequence[Layout | None],
) -> tuple[Layout | None, ...]:
    """The layouts of what a body returns for a carry of given layouts; of `start` itself where a layout is None.

    None stands for what is zero in this round, and so says nothing of other rounds.
    """
    stems = stems_of(body, [start, *rows])
    with recorder.attempt():
        counter = recorder.counter()
        with recorder.scope():
            carry = []
            for stem, expression, layout in zip(stems[0], lifted(where, start), layouts, strict=True):
                if layout is None:
                    carry.append(expression)
                else:
                    carry += recorder.symbols([stem], recorder.tables([stem], (), [layout]))
            result = body(like(start, carry), *row_symbols(recorder, rows, counter, stems[1:]))
            expressions = with_structure(where, start, result)
            known = recorder.layouts_of(expressions)
            return tuple(layout if e.blades else None for e, layout in zip(expressions, known, strict=True))
