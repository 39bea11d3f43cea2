"""Convert compiled kernels with loops to and from plain data: lists, strings and integers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from ..backends.module import LoopSource
from ..frontend.kernel import Kernel
from ..frontend.loop_trace import LoopTrace
from ..ir.cost import Cost
from ..ir.procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Repeat, Storage, Table
from ..ir.program import Program
from ..ir.rows import At, Counter, Following, Numbered, Parent, Previous, Shifted, Through
from .compiled import CompiledLoops, CompiledPart
from .plain import layout_of, packed_program, packed_slots, program_of, slots_of

_ROWS = (Counter, Through, Previous, Parent, Following, Numbered, Shifted, At)
_KINDS: Mapping[str, type] = {kind.__name__: kind for kind in (*_ROWS, Place, Apply, Add, Copy, Clear, Loop, Repeat)}


def packed_loops(compiled: CompiledLoops) -> dict[str, Any]:
    """Convert a compiled kernel with loops, except for its definition, to plain data."""
    source = compiled.source
    return {
        "procedure": packed_procedure(source.procedure),
        "layouts": source.layouts,
        "costs": [[often, *cost.as_dict().values()] for often, cost in source.costs],
        "relations": source.relations,
        "error": source.error,
        "parts": [[packed_program(part.program), packed_slots(part.slots)] for part in compiled.parts],
    }


def unpacked_loops(kernel: Kernel, trace: LoopTrace, data: Any) -> CompiledLoops:
    """Restore the compiled kernel of a definition from the data returned by `packed_loops`.

    Raises
    ------
    GacError, LookupError, TypeError, ValueError
        If the data does not have the expected form.
    """
    source = LoopSource(
        procedure_of(data["procedure"]),
        kernel.summary,
        tuple((name, layout_of(layout)) for name, layout in data["layouts"]),
        tuple((often, Cost(*counts)) for often, *counts in data["costs"]),
        tuple(data["relations"]),
        data["error"],
    )
    parts = tuple(CompiledPart(program_of(program), slots_of(slots)) for program, slots in data["parts"])
    return CompiledLoops(kernel, source, trace, parts)


def packed_procedure(procedure: Procedure) -> list[Any]:
    """Convert a procedure to plain data."""
    tables = [[t.name, t.lengths, t.shape, t.storage.value, t.shared, t.into] for t in procedure.tables]
    programs = [packed_program(program) for program in procedure.programs]
    return [procedure.name, tables, programs, [_packed(statement) for statement in procedure.body]]


def procedure_of(data: Any) -> Procedure:
    """Restore a procedure from the data returned by `packed_procedure`."""
    name, tables, programs, body = data
    known = {program.name: program for program in map(program_of, programs)}
    return Procedure(
        name,
        tuple(Table(t, tuple(n), tuple(shape), Storage(s), shared, into) for t, n, shape, s, shared, into in tables),
        tuple(_unpacked(statement, known) for statement in body),
    )


def _packed(value: Any) -> Any:
    """Convert a statement or one of its fields: statements by kind and fields, programs by name."""
    if isinstance(value, Program):
        return value.name
    if isinstance(value, tuple):
        return [_packed(each) for each in value]
    name = type(value).__name__
    return {name: [_packed(getattr(value, f.name)) for f in fields(value)]} if name in _KINDS else value


def _unpacked(data: Any, programs: Mapping[str, Program]) -> Any:
    if isinstance(data, list):
        return tuple(_unpacked(each, programs) for each in data)
    if not isinstance(data, dict):
        return data
    ((name, values),) = data.items()
    found = [_unpacked(value, programs) for value in values]
    if name == "Apply":
        found[0] = programs[found[0]]
    return _KINDS[name](*found)
