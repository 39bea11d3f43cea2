"""Tracing of kernels with loops, and unrolling of their loops for arrays of known lengths."""

from __future__ import annotations

from collections import Counter as Counts
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product, takewhile
from math import prod
from typing import Any

from ..errors import GacError, KernelError
from ..ir.procedure import Add, Clear, Copy, Loop, Place, Repeat, Storage, Table
from ..ir.rows import with_tables
from .kernel import ArrayOf, Kernel, Parameter
from .loop_results import loop_results
from .recorded import Compute, Record, Recorded
from .recorder import Inference, Recorder
from .recording import recording
from .rows import Index, IndexOf, Leaf, RowsOf, Unrolled, elements_of, leaves_of, like, nested


@dataclass(frozen=True, slots=True)
class LoopTrace:
    """The result of calling a kernel with loops once on symbols.

    Attributes
    ----------
    kernel : Kernel
    records : tuple of Record
        The tables that hold multivectors: arguments, results and intermediate ones.
    indices : tuple of Table
        The index tables.
    results : tuple of (str, Record)
        The results by name, in the order of the values that the function returns.
    statements : tuple of Recorded
    """

    kernel: Kernel
    records: tuple[Record, ...]
    indices: tuple[Table, ...]
    results: tuple[tuple[str, Record], ...]
    statements: tuple[Recorded, ...]


def trace_loops(kernel: Kernel, inference: Inference) -> LoopTrace:
    """Call the function of a kernel with loops on symbols.

    Raises
    ------
    GacError
        The error that the function raises, with its line in the definition; a `KernelError` in place of any other
        exception.
    """
    recorder = Recorder(kernel, inference)
    for name in _lengths_of(kernel):
        recorder.take(name)
    with recording(recorder):
        arguments = [_argument(recorder, parameter) for parameter in kernel.parameters]
        try:
            value = kernel.function(*arguments)
            if value is None:
                raise KernelError(kernel.where, "the function returns nothing", "an expression, an array, or a tuple")
            results = loop_results(recorder, value)
        except GacError as error:
            place = kernel.place_of(error)
            raise (error.at(place) if place and place not in str(error) else error) from error.__cause__
        except Exception as error:  # whatever the author's code may raise
            found = f"{type(error).__name__}: {error}"
            raise KernelError(kernel.place_of(error) or kernel.where, found) from error
    statements, same = _without_copies(recorder.scopes[0].statements, recorder.records)
    own = {record.name: name for name, record in results}
    names = dict(own)
    for name in recorder.records:
        if name not in own and name not in same:
            while names.get(name, name) in own.values():
                names[name] = recorder.unique(name)
    names |= {name: own[result] for name, result in same.items()}
    return LoopTrace(
        kernel,
        tuple(replace(r, name=names.get(name, name)) for name, r in recorder.records.items() if name not in same),
        tuple(recorder.indices.values()),
        tuple((name, replace(record, name=name)) for name, record in results),
        tuple(_renamed(statement, names) for statement in statements),
    )


def _lengths_of(kernel: Kernel) -> tuple[str, ...]:
    """Return the names of lengths, which are reserved."""
    types = [parameter.type for parameter in kernel.parameters]
    lengths = [
        name
        for each in types
        for name in ((each.length, each.into) if isinstance(each, IndexOf) else getattr(each, "lengths", ()))
    ]
    return tuple(dict.fromkeys(lengths))


def _without_copies(
    statements: Sequence[Recorded], records: Mapping[str, Record]
) -> tuple[list[Recorded], dict[str, str]]:
    """Remove final copies of single rows to results; return the other statements and the names of replaced tables.

    Only tables that are used by programs alone are replaced by results, because the other statements need a table that
    is a variable in emitted text, which results are not.
    """
    kept, names = list(statements), dict[str, str]()
    copies = list(takewhile(lambda each: isinstance(each, Copy) and each.source.row is None, reversed(statements)))
    often = Counts(_copied(statements))
    for statement in copies:
        assert isinstance(statement, Copy)
        source, target = records[statement.source.table], records[statement.target.table]
        is_result = target.storage is Storage.RESULT and source.storage is Storage.WORK and often[source.name] == 1
        if is_result and source.shape == target.shape and not source.lengths:
            kept.remove(statement)
            names[source.name] = target.name
    return kept, names


def _copied(statements: Sequence[Recorded]) -> list[str]:
    """Return the tables that statements other than programs use, with one entry for each use.

    These are the sources of copies, the targets of additions, and the conditions and step counts of iterations.
    """
    found = []
    for statement in statements:
        if isinstance(statement, Copy):
            found.append(statement.source.table)
        elif isinstance(statement, Add):
            found.append(statement.target.table)
        elif isinstance(statement, (Loop, Repeat)):
            found += _copied(statement.body)  # type: ignore[arg-type]
            found += [statement.until, statement.steps] if isinstance(statement, Repeat) else [statement.until]
    return found


def _renamed(recorded: Recorded, names: Mapping[str, str]) -> Recorded:
    """Return a statement with some tables renamed."""

    def place(given: Place) -> Place:
        return Place(names.get(given.table, given.table), with_tables(given.row, lambda name: names.get(name, name)))

    match recorded:
        case Compute():
            sources = tuple(replace(source, place=place(source.place)) for source in recorded.sources)
            return replace(recorded, sources=sources, targets=tuple((place(p), leaf) for p, leaf in recorded.targets))
        case Add() | Copy():
            return replace(recorded, source=place(recorded.source), target=place(recorded.target))
        case Clear():
            return Clear(names.get(recorded.table, recorded.table))
        case Repeat():
            until, steps = names.get(recorded.until, recorded.until), names.get(recorded.steps, recorded.steps)
            return Repeat(recorded.limit, until, steps, tuple(_renamed(each, names) for each in recorded.body))  # type: ignore[arg-type, misc]
        case Loop():
            body = tuple(_renamed(each, names) for each in recorded.body)  # type: ignore[arg-type]
            return replace(recorded, body=body, until=names.get(recorded.until, recorded.until))  # type: ignore[arg-type]


def _argument(recorder: Recorder, parameter: Parameter) -> Any:
    """Return the argument that the function is called with for a parameter."""
    name, given = parameter.name, parameter.type
    recorder.take(name)
    if isinstance(given, IndexOf):
        shape: tuple[int, ...] = (given.columns,) if given.columns else ()
        recorder.indices[name] = Table(name, (given.length,), shape, Storage.INDEX, True, given.into)
        columns = tuple(Index(name, given.length, given.into, k) for k in range(max(given.columns, 1)))
        return columns if given.columns else columns[0]
    layout, outer = parameter.layout, parameter.outer_shape
    lengths = given.lengths if isinstance(given, RowsOf) else ()
    shared = isinstance(given, RowsOf) and given.shared
    leaves = tuple(Leaf(layout, k * layout.size) for k in range(prod(outer)))
    shape = outer + (() if layout.is_scalar else (layout.size,))
    record = recorder.add(Record(name, lengths, leaves, Storage.ARGUMENT, shape, shared))
    places = list(product(*map(range, outer)))
    if lengths:
        flat: list[Any] = record.arrays
    else:
        stems = ["_".join([name, *map(str, place)]) for place in places]
        flat = [recorder.symbol(stem, Place(name), leaf) for stem, leaf in zip(stems, record.leaves, strict=True)]
    return nested(flat, outer)


def unrolled(kernel: Kernel, lengths: Mapping[str, int], indices: Mapping[str, Sequence[int]]) -> Kernel:
    """Return a kernel without loops that is equivalent to a kernel with loops, for arrays of known lengths.

    Parameters
    ----------
    kernel : Kernel
    lengths : mapping of str to int
        The values of all named lengths, each at least 1.
    indices : mapping of str to sequence of int
        The contents of the index tables, by the names of the parameters.

    Returns
    -------
    Kernel
        A kernel whose parameters are arrays of the given lengths, without the index tables.
    """
    parameters = tuple(
        Parameter(p.name, _sized(p.type, lengths)) for p in kernel.parameters if not isinstance(p.type, IndexOf)
    )

    def function(*given: Any) -> Any:
        known = dict(zip((parameter.name for parameter in parameters), given, strict=True))
        return _results_of_unrolled(written_out(kernel, {**known, **indices}))

    name = "_".join([kernel.name, *map(str, lengths.values())])
    return Kernel(name, function, parameters, None, kernel.summary)


def written_out(kernel: Kernel, given: Mapping[str, Any]) -> Any:
    """Return the unrolled result of a kernel with loops for arrays of known lengths.

    Parameters
    ----------
    kernel : Kernel
    given : mapping of str to sequences
        The rows of each parameter, by name: nested tuples of expressions, multivectors or numbers, which are folded as
        constants. For index tables, the row indices.

    Returns
    -------
    nested tuple
        The expressions and `Unrolled` arrays that the function returns.
    """
    arguments: list[Any] = []
    for parameter in kernel.parameters:
        rows = given[parameter.name]
        if isinstance(parameter.type, IndexOf):
            columns = zip(*rows, strict=True) if parameter.type.columns else [rows]
            if not rows:
                columns = [()] * max(parameter.type.columns, 1)
            tables = tuple(Unrolled(tuple(column)) for column in columns)
            arguments.append(tables if parameter.type.columns else tables[0])
        else:
            arguments.append(_columns(rows, parameter.type) if isinstance(parameter.type, RowsOf) else rows)
    return kernel.function(*arguments)


def _sized(given: Any, lengths: Mapping[str, int]) -> Any:
    if isinstance(given, RowsOf):
        return ArrayOf(given.layout, (*(lengths[name] for name in given.lengths), *given.shape))
    return given


def _columns(rows: Sequence[Any], given: RowsOf) -> Any:
    """Return arrays of known length in the structure of a row, from a sequence of rows."""
    if not rows and len(given.lengths) == 1 and not given.shape:
        return Unrolled((), given.layout.algebra.multivector({}))

    def columns(rows: Any, axes: int) -> Any:
        if not axes:
            return rows
        inner = [columns(row, axes - 1) for row in rows]
        return like(inner[0], [Unrolled(column) for column in zip(*map(leaves_of, inner), strict=True)])

    return columns(rows, len(given.lengths))


def _results_of_unrolled(value: Any) -> Any:
    """Return the multivectors of all results of an unrolled kernel as a flat tuple."""
    flat: list[Any] = []
    for leaf in leaves_of(value):
        flat += elements_of(leaf)
    return tuple(flat)
