"""Arguments of kernels with loops: conversion to arrays, lengths inferred from shapes, and checks of index tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from .arrays import FLOAT32, FLOAT64, plain
from .functions import namespace_of
from .loop_definition import LoopDefinition, Table

_FEW = 64
"""Number of rows of an index table up to which checking a list is faster than checking an array."""


class IndexFacts(NamedTuple):
    """Properties of an index table that determine whether it is valid."""

    least: int
    greatest: int
    is_earlier: bool
    """Whether each entry is the index of an earlier row, or negative."""


class Fixed(NamedTuple):
    """A fixed argument, which calls do not pass: a read-only copy, and the facts about it if it is an index table."""

    array: Any
    facts: IndexFacts | None


def checked(
    definition: LoopDefinition, arrays: Sequence[Any], fixed: Sequence[Fixed | None]
) -> tuple[list[Any], np.dtype[Any]]:
    """Return the arguments as arrays of numbers, and the dtype of the computation."""
    operands, strong = [], []
    for table, value, known in zip(definition.parameters, arrays, fixed, strict=True):
        if known is not None:
            array = known.array
        else:
            array = as_index(definition, table, value) if table.is_index else as_numbers(definition, table, value)
        operands.append(array)
        if not table.is_index and type(value) not in (int, float):
            strong.append(array.dtype)
    if all(dtype is FLOAT64 for dtype in strong):
        return operands, FLOAT64
    if definition.in_doubles:
        return operands, FLOAT64
    if all(dtype is FLOAT32 for dtype in strong):
        return operands, FLOAT32
    dtype = np.result_type(*strong)
    return operands, dtype if dtype.isnative else dtype.newbyteorder("=")


def as_numbers(definition: LoopDefinition, table: Table, value: Any) -> Any:
    """Convert an argument to an array of floats."""
    if type(value) is np.ndarray and (value.dtype is FLOAT64 or value.dtype is FLOAT32):
        return value
    namespace = namespace_of((value,))
    if namespace is not np:
        raise TypeError(
            f"{definition.name}: argument {table.name} is an array of {namespace.__name__}; expected a numpy array"
        )
    given = isinstance(value, (np.ndarray, np.generic))
    value = plain(f"{definition.name}: argument {table.name}", value, definition.layouts.get(table.name))
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{definition.name}: argument {table.name} is not an array of numbers ({error})") from None
    if array.dtype.kind in "biu":
        array = array.astype(np.result_type(array.dtype, FLOAT32) if given else FLOAT64)
    if array.dtype.kind != "f" or array.dtype.itemsize not in (4, 8):
        raise TypeError(
            f"{definition.name}: argument {table.name} has dtype {array.dtype}; expected float32 or float64"
            + ("" if array.dtype.kind == "c" else f"; convert it with {table.name}.astype(float)")
        )
    return array


def as_index(definition: LoopDefinition, table: Table, value: Any) -> Any:
    """Convert an index table to a contiguous array of 64-bit integers."""
    array = np.asarray(value)
    if array.ndim != 1 + len(table.shape):
        raise ValueError(
            f"{definition.name}: argument {table.name} has shape {array.shape}; expected {table.shape_text}: "
            "all elements of a batch share an index table"
        )
    if not array.size:
        return np.empty(array.shape, np.int64)
    if array.dtype.kind not in "iu":
        raise TypeError(
            f"{definition.name}: argument {table.name} has dtype {array.dtype}; expected integers, each {table.rule} "
            f"of {table.into}"
        )
    if array.dtype.itemsize == 8 and array.dtype.kind == "u" and array.max() >= 1 << 63:
        raise ValueError(f"{definition.name}: argument {table.name} contains {array.max()}; expected {table.rule}")
    return np.require(array, np.int64, ["C", "A"])


def in_doubles(definition: LoopDefinition, tables: Sequence[Table], arrays: Sequence[Any]) -> list[Any] | None:
    """Return arguments for one element as the extension reads them: doubles in C order, and index tables.

    None if they are that already, if there is a batch, whose elements are not copied, or an array of another dtype.
    """
    found, is_other = list[Any](), False
    for table, value in zip(tables, arrays, strict=True):
        array = as_index(definition, table, value) if table.is_index else as_numbers(definition, table, value)
        n_axes = len(table.lengths) + len(table.shape)
        if not table.is_index:
            if array.dtype is not FLOAT64 or array.ndim != n_axes:
                return None
            array = usable(array, FLOAT64, n_axes)
        found.append(array)
        is_other |= array is not value
    return found if is_other else None


def as_fixed(definition: LoopDefinition, table: Table, value: Any) -> Fixed:
    """Return a copy of an argument, with the checks that do not depend on other arguments."""
    if table.is_index:
        array = as_index(definition, table, value)
        array = array.copy() if array is value or np.may_share_memory(array, value) else array
        found = Fixed(array, facts_of(array))
    else:
        array = np.array(as_numbers(definition, table, value), order="C")
        found = Fixed(array, None)
    array.flags.writeable = False
    return found


def resolved(
    definition: LoopDefinition, operands: Sequence[Any], known: Mapping[str, int] = MappingProxyType({})
) -> tuple[dict[str, int], tuple[int, ...]]:
    """Infer the lengths, some of which may be known, and the shape of the batch."""
    lengths = dict(known)
    owners: dict[str, str] = {}
    leading: tuple[int, ...] = ()
    several = False
    for table, operand in zip(definition.parameters, operands, strict=True):
        shape = operand.shape
        depth = len(shape) - len(table.lengths) - len(table.shape)
        if depth < 0:
            raise _misfit(definition, table, shape, lengths, owners)
        for k, name in enumerate(table.lengths, start=depth):
            if lengths.setdefault(name, shape[k]) != shape[k]:
                raise _misfit(definition, table, shape, lengths, owners)
            owners.setdefault(name, table.name)
        if table.shape and shape[depth + len(table.lengths) :] != table.shape:
            raise _misfit(definition, table, shape, lengths, owners)
        if depth and shape[:depth] != leading:
            several |= bool(leading)
            leading = leading or shape[:depth]
    if several:
        leading = _broadcast(definition, operands)
    return lengths, leading


def _misfit(
    definition: LoopDefinition,
    table: Table,
    shape: tuple[int, ...],
    lengths: Mapping[str, int],
    owners: Mapping[str, str],
) -> ValueError:
    known = [
        f"{name} = {lengths[name]} as {owners[name]} has"
        for name in table.lengths
        if name in owners and owners[name] != table.name
    ]
    known += [f"{name} = {lengths[name]}" for name in table.lengths if name in lengths and name not in owners]
    return ValueError(
        f"{definition.name}: argument {table.name} has shape {shape}; expected {table.shape_text}"
        f"{' with ' if known else ''}{' and '.join(known)}{definition.blades(table.name)}"
    )


def _broadcast(definition: LoopDefinition, operands: Sequence[Any]) -> tuple[int, ...]:
    tables = definition.parameters
    shapes = [
        operand.shape[: operand.ndim - len(table.lengths) - len(table.shape)]
        for table, operand in zip(tables, operands, strict=True)
    ]
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        text = ", ".join(f"{table.name} {a.shape}" for table, a in zip(tables, operands, strict=True))
        raise ValueError(
            f"{definition.name}: leading axes do not broadcast: {text}; expected {definition.signature}"
        ) from None


def check_rows(
    definition: LoopDefinition, table: Table, index: Any, facts: IndexFacts | None, lengths: Mapping[str, int]
) -> None:
    """Raise `ValueError` if an index table refers to a row that does not exist, or that is not an earlier row."""
    facts = facts or facts_of(index)
    count = lengths.get(table.into, 0)
    earlier = table.rule.startswith("an earlier")
    least = -1 if table.rule.endswith("-1") else 0
    if facts.least >= least and facts.greatest < count and (facts.is_earlier or not earlier):
        return
    wrong = (index < least) | (index >= count)
    if earlier:
        wrong |= index >= np.arange(len(index))
    place = tuple(np.argwhere(wrong)[0].tolist())
    row = f"row {place[0]}" + "".join(f", column {column}" for column in place[1:])
    raise ValueError(
        f"{definition.name}: argument {table.name} is {index[place]} in {row}; expected {table.rule} of {table.into}, "
        f"which has {count} rows"
    )


def checked_outs(
    definition: LoopDefinition,
    out: Any,
    leading: tuple[int, ...],
    cores: Sequence[tuple[int, ...]],
    dtype: np.dtype[Any],
) -> list[Any]:
    """Check the argument `out` and return one array for each result."""
    tables = definition.results
    outs = [out] if len(tables) == 1 and not isinstance(out, tuple) else out
    if not isinstance(outs, (list, tuple)) or len(outs) != len(tables):
        found = f"{len(outs)} arrays" if isinstance(outs, (list, tuple)) else type(out).__name__
        names = ", ".join(table.name for table in tables)
        raise TypeError(f"{definition.name}: out is {found}; expected a tuple of {len(tables)} arrays ({names})")
    for table, core, target in zip(tables, cores, outs, strict=True):
        place = f"{definition.name}: out" if len(outs) == 1 else f"{definition.name}: out {table.name}"
        if not isinstance(target, np.ndarray):
            raise TypeError(f"{place} is {type(target).__name__}; expected an array")
        if target.shape != leading + core:
            expected = f"{leading + core}{definition.blades(table.name)}"
            raise ValueError(f"{place} has shape {target.shape}; expected {expected}")
        if target.dtype != dtype:
            raise TypeError(f"{place} has dtype {target.dtype}; expected {dtype}, the type of the arguments")
        if not target.flags.writeable:
            raise ValueError(f"{place} is read-only; expected an array that can be written")
    return list(outs)


def facts_of(index: Any) -> IndexFacts:
    """Return the facts about an index table."""
    count = len(index)
    if not index.size:
        return IndexFacts(0, -1, True)
    if index.ndim > 1:
        return IndexFacts(int(index.min()), int(index.max()), False)
    if count <= _FEW:
        values = index.tolist()
        return IndexFacts(min(values), max(values), all(value < k for k, value in enumerate(values)))
    return IndexFacts(int(index.min()), int(index.max()), bool((index < np.arange(count)).all()))


def usable(array: Any, dtype: np.dtype[Any], n_axes: int) -> Any:
    """Return the array itself, or a copy of dtype `dtype` that is aligned and contiguous within each element."""
    if array.dtype is not dtype or not array.flags.aligned:
        array = np.require(array, dtype, "A")
    return array if _is_contiguous(array, n_axes) else np.ascontiguousarray(array)


def _is_contiguous(array: Any, n_axes: int) -> bool:
    """Whether each element is contiguous."""
    if array.flags.c_contiguous:
        return True
    step = array.itemsize
    for k in range(array.ndim - 1, array.ndim - n_axes - 1, -1):
        if array.shape[k] > 1 and array.strides[k] != step:
            return False
        step *= array.shape[k]
    return True


def is_unusable(target: Any, core: tuple[int, ...], others: Sequence[Any]) -> bool:
    """Whether a result needs a temporary array: it is misaligned, not contiguous, or overlaps with other arrays."""
    return (
        not target.flags.aligned
        or not _is_contiguous(target, len(core))
        or any(np.may_share_memory(target, other) for other in others)
    )
