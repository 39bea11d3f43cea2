"""Compilation of kernels with loops. The pipeline compiles every straight-line part as a separate kernel.

Each part is proved like other kernels. The loops are proved by induction over their bodies. This requires that the
procedure is equivalent to the function, which is checked for several lengths with unrolled loops (`prove_procedure`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Any

from ..algebra.operations import Operation
from ..errors import GacError, KernelError
from ..frontend.expression import topological
from ..frontend.kernel import ArrayOf, Kernel, Parameter
from ..frontend.loop_trace import LoopTrace, trace_loops
from ..frontend.recorded import Compute, Recorded, computes
from ..frontend.traced import Traced
from ..ir.cost_models import COUNTS
from ..ir.procedure import Add, Apply, Clear, Copy, Loop, Place, Procedure, Repeat, Statement, Table, statements
from ..ir.procedure_cost import Costs, procedure_costs
from ..ir.program import Argument, Operand, Program, Result
from ..ir.rows import further_tables
from ..ir.verify import verify
from .collection import rare_collection
from .effort import DEFAULT
from .fuse import fuse
from .inference import LayoutInference
from .pipeline import compile_kernel
from .prove_loops import prove_procedure
from .record import Compilation


@dataclass(frozen=True, slots=True)
class LoopCompilation:
    """The result of compiling a kernel with loops.

    Attributes
    ----------
    kernel : Kernel
    trace : LoopTrace
    parts : tuple of Compilation
        The straight-line parts, in the order of the text.
    procedure : Procedure
    """

    kernel: Kernel
    trace: LoopTrace
    parts: tuple[Compilation, ...]
    procedure: Procedure

    @property
    def costs(self) -> Costs:
        """The operation counts by how often they run: ``""`` once, ``"n"`` for each row, ``"n*m"``."""
        return procedure_costs(self.procedure)


@rare_collection()
def compile_loops(
    kernel: Kernel, traced: LoopTrace | None = None, effort: int = DEFAULT, cost: str = COUNTS.name
) -> LoopCompilation:
    """Compile a kernel with loops.

    Parameters
    ----------
    kernel : Kernel
    traced : LoopTrace, optional
        The result of `trace_loops`, if available.
    effort, cost : int, str
        As for `compile_kernel`.

    Raises
    ------
    GacError
        As for `compile_kernel`; the message names the kernel.
    """
    traced = traced or trace_loops(kernel, LayoutInference())
    try:
        parts: dict[str, Compilation] = {}
        alike: dict[Any, Compilation] = {}
        renamed = _numbered(kernel, traced)
        for statement in computes(traced.statements):
            part = replace(statement.kernel, name=renamed[statement.kernel.name])
            form = _form(part)
            if form not in alike:
                alike[form] = compile_kernel(part, forms=False, effort=effort, cost=cost)
            parts[statement.kernel.name] = _named(alike[form], part)
    except ZeroDivisionError as error:
        raise KernelError(
            kernel.where, "it divides by an expression that is zero", "a divisor that can differ from zero"
        ) from error
    except GacError as error:
        if kernel.where in error.where:
            raise
        raise KernelError(kernel.where, f"{error.where}: {error.found}", error.expected, error.remedy) from error
    tables = {record.name: record.table for record in traced.records} | {table.name: table for table in traced.indices}
    body = tuple(_statement(each, parts, tables) for each in traced.statements)
    procedure = fuse(_procedure(kernel, traced, tables, body))
    for name in sorted(procedure.read_through & procedure.parent_tables):
        raise KernelError(
            kernel.where, f"gather() reads the rows of parents in {name}, but the first row has no parent (-1)",
            "another index table for gather(), or the rows as parameters of the body of scan()",
        )  # fmt: skip
    prove_procedure(kernel, traced.results, procedure)
    return LoopCompilation(kernel, traced, tuple(parts.values()), procedure)


def _named(known: Compilation, part: Kernel) -> Compilation:
    """Return the compilation of a part as that of another one of the same form, whose program has its own name."""
    assert known.best is not None
    best = replace(known.best, program=replace(known.program, name=part.name))
    return known if known.kernel is part else replace(known, kernel=part, best=best)


def _form(part: Kernel) -> Any:
    """Return a description of a part that only depends on the order of the names of its parameters.

    Functions for kernels, such as products of matrices, leave the same parts at every place where they are called.
    """
    function = part.function
    assert isinstance(function, Traced)
    names = [parameter.name for parameter in part.parameters]
    ranks = tuple(sorted(range(len(names)), key=names.__getitem__))
    places = {symbol: k for k, symbol in enumerate(function.symbols)}
    numbers: dict[Any, int] = {}
    nodes = []
    for node in topological(function.value):
        own = places[node] if node.operation is Operation.INPUT else node.data
        nodes.append((node.operation, own, node.algebra, *(numbers[each] for each in node.arguments)))
        numbers[node] = len(numbers)
    results = tuple(numbers[each] for each in function.value)
    types = tuple(parameter.type for parameter in part.parameters)
    return ranks, types, part.returns, tuple(nodes), results


def _numbered(kernel: Kernel, traced: LoopTrace) -> dict[str, str]:
    """Return names for the parts, composed of the kernel's name and their number in the order of the text."""
    names = [statement.kernel.name for statement in computes(traced.statements)]
    return {name: f"{kernel.name}_{k}" for k, name in enumerate(names, start=1)}


def _procedure(
    kernel: Kernel, traced: LoopTrace, tables: Mapping[str, Table], body: tuple[Statement, ...]
) -> Procedure:
    used = {place.table for each in statements(body) for place in _places(each)}
    results = {name for name, _ in traced.results}
    order = [parameter.name for parameter in kernel.parameters]
    arguments = [tables[name] for name in order]
    found = [record.table for _, record in traced.results]
    work = [table for name, table in tables.items() if name in used and name not in results and name not in order]
    return Procedure(kernel.name, (*arguments, *found, *work), body)


def _places(statement: Statement) -> list[Place]:
    """Return the places that a statement uses, not including those in the body of a loop."""
    match statement:
        case Apply():
            own = [*statement.inputs, *statement.outputs]
        case Loop():
            return list(map(Place, statement.controls))
        case Repeat():
            return [Place(statement.until), Place(statement.steps)]
        case Add() | Copy():
            own = [statement.source, statement.target]
        case Clear():
            return [Place(statement.table)]
    return own + [Place(name) for place in own for name in further_tables(place.row)]


def _statement(recorded: Recorded, parts: Mapping[str, Compilation], tables: Mapping[str, Table]) -> Statement:
    if isinstance(recorded, Compute):
        return _apply(recorded, parts[recorded.kernel.name], tables)
    if isinstance(recorded, (Loop, Repeat)):
        return replace(recorded, body=tuple(_statement(each, parts, tables) for each in recorded.body))  # type: ignore[arg-type]
    return recorded


def _apply(compute: Compute, part: Compilation, tables: Mapping[str, Table]) -> Apply:
    """Convert a part to a program of rows: all multivectors of a row form one argument or one result."""
    program = part.program
    targets = {line.target for line in program.lines}
    names = dict[str, str]()
    arguments, taken = list[Argument](), set(targets)
    for place, sources in _by_place(compute).items():
        shape = tables[place.table].shape
        argument = _argument(_stem(place, [compute.names[k] for k in sources]), shape, compute, sources, taken)
        taken |= {argument.name, *argument.components}
        arguments.append(argument)
        for k in sources:
            start = compute.sources[k].leaf.start
            own = program.arguments[k].components
            names.update(zip(own, argument.components[start : start + len(own)], strict=True))
    lines = tuple(replace(line, operands=tuple(_renamed(o, names) for o in line.operands)) for line in program.lines)
    written: dict[Place, dict[int, Operand]] = {}
    for (place, leaf), result in zip(compute.targets, program.results, strict=True):
        entries = {k: _renamed(operand, names) for k, operand in enumerate(result.operands, start=leaf.start)}
        written.setdefault(place, {}).update(entries)
    results = []
    for place, operands in written.items():
        name = _free(place.table, taken, "out")
        taken.add(name)
        results.append(Result(name, tables[place.table].shape, tuple(operands[k] for k in sorted(operands))))
    packed = verify(Program(program.name, tuple(arguments), lines, tuple(results)))
    return Apply(packed, tuple(_by_place(compute)), tuple(written))


def _by_place(compute: Compute) -> dict[Place, list[int]]:
    """Return the rows that a part reads, and the indices of the arguments in each."""
    found: dict[Place, list[int]] = {}
    for k, source in enumerate(compute.sources):
        found.setdefault(source.place, []).append(k)
    return found


def _stem(place: Place, names: Sequence[str]) -> str:
    """Return the name of a row in the text: for a single multivector, the name used in the author's function."""
    (first, *others) = names
    return place.table if others else first


def _argument(stem: str, shape: tuple[int, ...], compute: Compute, sources: Sequence[int], taken: set[str]) -> Argument:
    """Return the argument for a row; its components are named by their position in the row and their blades."""
    layout = compute.sources[sources[0]].leaf.layout
    outer = shape if layout.is_scalar else shape[:-1]
    if prod(outer) * layout.size < prod(shape):  # several multivectors, such as derivatives, are one axis of numbers
        outer = (prod(shape) // layout.size,)
    n = 1
    while True:
        name = stem if n == 1 else f"{stem}_{n}"
        components = Parameter(name, ArrayOf(layout, outer) if outer else layout).components
        if not {name, *components} & taken:
            return Argument(name, shape, components)
        n += 1


def _free(name: str, taken: set[str], ending: str) -> str:
    """Return an unused name: the given one, if necessary with a suffix."""
    if name not in taken:
        return name
    n = 1
    while (found := f"{name}_{ending}{n if n > 1 else ''}") in taken:
        n += 1
    return found


def _renamed(operand: Operand, names: Mapping[str, str]) -> Operand:
    return names.get(operand, operand) if isinstance(operand, str) else operand
