"""The results of a kernel with loops, and the tables that hold them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..algebra.layout import Layout
from ..errors import KernelError
from ..ir.procedure import Place, Storage
from .expression import Expression, lift
from .kernel import ArrayOf, Kernel
from .recorded import Record
from .recorder import Recorder
from .rows import Index, Leaf, Rows, RowsOf, Unrolled


@dataclass(frozen=True, slots=True, eq=False)
class _Result:
    """A result as returned by the function: its leaves in C order, and the type declared by `returns`.

    Its table has a temporary name until the whole function is traced.
    """

    name: str
    table: str
    leaves: list[Any]
    pinned: Any

    @property
    def is_array(self) -> bool:
        """Whether the result is an array of rows."""
        return isinstance(self.leaves[0], Rows)

    @property
    def layout(self) -> Layout | None:
        """The requested layout, or None."""
        return self.pinned if isinstance(self.pinned, Layout) else getattr(self.pinned, "layout", None)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of a row, without the blade axis."""
        return self.pinned.shape if isinstance(self.pinned, (ArrayOf, RowsOf)) else ()


def loop_results(recorder: Recorder, value: Any) -> tuple[tuple[str, Record], ...]:
    """Return the results of a kernel with loops by name, in the order of the values that its function returns.

    Raises
    ------
    KernelError
        If the value does not match `returns`, or is not a valid result.
    """
    kernel, pinned = recorder.kernel, recorder.kernel.returns
    is_one = not isinstance(value, tuple) or isinstance(pinned, (ArrayOf, RowsOf))
    values = [value] if is_one else list(value)
    if not values:
        raise KernelError(kernel.where, "the function returns an empty tuple", "at least one result")
    types = list(pinned) if isinstance(pinned, tuple) else [pinned] * len(values)
    if len(types) != len(values):
        raise KernelError(kernel.where, f"{len(values)} results", f"{len(types)} as specified by returns=")
    names = ["out"] if is_one else list(getattr(value, "_fields", ())) or [f"out_{k}" for k in range(len(values))]
    given = []
    for name, each, pinned_type in zip(names, values, types, strict=True):
        leaves = _leaves(kernel, name, each, pinned_type)
        free = recorder.unique(name) if name in recorder.taken else name
        given.append(_Result(free, recorder.unique(name), leaves, pinned_type))
        _check_lengths(recorder, given[-1])
    found = {result.name: _array_result(recorder, result) for result in given if result.is_array}
    targets, expressions = list[tuple[Place, Leaf]](), list[Expression]()
    for result in given:
        if not result.is_array:
            leaves = [lift(leaf) for leaf in result.leaves]
            layouts = [result.layout] * len(leaves) if result.layout else list(recorder.layouts_of(leaves))
            record = recorder.add(_record(result, (), layouts))
            expressions += leaves
            targets += [(Place(record.name), leaf) for leaf in record.leaves]
            found[result.name] = record
    if expressions:
        recorder.compute(expressions, targets)
    return tuple((result.name, found[result.name]) for result in given)


def _leaves(kernel: Kernel, name: str, value: Any, pinned: Any) -> list[Any]:
    shape = pinned.shape if isinstance(pinned, (ArrayOf, RowsOf)) else ()

    def flat(part: Any, sizes: tuple[int, ...]) -> list[Any]:
        if not sizes:
            if isinstance(part, (tuple, list)):
                raise KernelError(
                    kernel.where,
                    f"{name} is a nested tuple",
                    "an expression, or an array of rows",
                    'declare returns=array(layout, "n", 3), or return its parts one by one',
                )
            return [part]
        if not isinstance(part, (tuple, list)) or len(part) != sizes[0]:
            found = f"a sequence of {len(part)}" if isinstance(part, (tuple, list)) else type(part).__name__
            raise KernelError(kernel.where, f"{name} is {found}", f"{sizes[0]} entries as specified by returns=")
        return [leaf for each in part for leaf in flat(each, sizes[1:])]

    found = flat(value, shape)
    for leaf in found:
        if leaf is None or isinstance(leaf, (Index, Unrolled)):
            what = "nothing" if leaf is None else f"the index table {leaf.name}" if isinstance(leaf, Index) else "rows"
            raise KernelError(kernel.where, f"{name} is {what}", "an expression, or an array of rows")
    kinds = {isinstance(leaf, Rows) for leaf in found}
    if len(kinds) > 1:
        raise KernelError(kernel.where, f"{name} mixes arrays and multivectors", "arrays of rows, or multivectors")
    return found


def _check_lengths(recorder: Recorder, result: _Result) -> None:
    """Raise an error for arrays whose lengths do not match `returns`, or differ from each other."""
    kernel, pinned = recorder.kernel, result.pinned
    if not result.is_array:
        if isinstance(pinned, RowsOf):
            raise KernelError(kernel.where, f"{result.name} is not an array", f"one over {', '.join(pinned.lengths)}")
        return
    lengths = {rows.lengths for rows in map(recorder.check_rows, result.leaves)}
    if len(lengths) > 1:
        found = " and ".join(sorted(", ".join(each) for each in lengths))
        raise KernelError(kernel.where, f"{result.name} has arrays over {found}", "arrays of one length")
    (own,) = lengths
    if isinstance(pinned, RowsOf) and pinned.lengths != own:
        expected = f"one over {', '.join(pinned.lengths)} as specified by returns="
        raise KernelError(kernel.where, f"{result.name} is an array over {', '.join(own)}", expected)


def _record(result: _Result, lengths: tuple[str, ...], layouts: Sequence[Layout]) -> Record:
    """Return a table for a result."""
    leaves, start = [], 0
    for layout in layouts:
        leaves.append(Leaf(layout, start))
        start += layout.size
    shape = result.shape + (() if layouts[0].is_scalar else (layouts[0].size,))
    return Record(result.table, lengths, tuple(leaves), Storage.RESULT, shape)


def _array_result(recorder: Recorder, result: _Result) -> Record:
    """Return the table of a result that is an array: its own table if that holds nothing else, or a copy."""
    first: Rows = result.leaves[0]
    record = recorder.records[first.table]
    is_whole = len(record.leaves) == len(result.leaves)
    for rows, leaf in zip(result.leaves, record.leaves, strict=False):
        is_whole &= rows == Rows.whole(record.name, record.lengths, leaf) and result.layout in (None, leaf.layout)
    if is_whole and record.storage is Storage.WORK:
        shape = result.shape + (() if first.leaf.layout.is_scalar else (first.leaf.layout.size,))
        recorder.records[record.name] = found = replace(record, storage=Storage.RESULT, shape=shape)
        return found
    layouts = [result.layout or rows.leaf.layout for rows in result.leaves]
    made = recorder.add(_record(result, first.lengths, layouts))
    recorder.store(result.leaves, made.arrays)
    return made
