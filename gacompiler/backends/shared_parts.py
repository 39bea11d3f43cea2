"""Share straight-line parts of kernels with loops: parts that are equal up to names are one function of a module.

A part is named after the first kernel that calls it and the first table that this call writes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from ..ir.procedure import Apply, Loop, Procedure, Repeat, Statement, Storage
from ..ir.program import Operand, Program
from .c_batch import C_ENDINGS
from .c_loop_text import is_shared
from .c_loops import LOOP_ENDINGS, has_lanes
from .module import ModuleSource
from .printers import C_MACRO_NAMES

RESULT = "result"
"""The end of the name of a part that writes a result without a name."""
START = "_start"
"""The end of the name of a part without arguments, which computes initial values."""


def with_shared_parts(module: ModuleSource) -> ModuleSource:
    """Return a module in which equal parts have the same name, and the variables of the first of them."""
    kernels = [kernel.program.name for kernel in module.kernels]
    shared = _SharedParts([*kernels, *(loop.procedure.name for loop in module.loops)])
    loops = tuple(replace(loop, procedure=shared.procedure(loop.procedure)) for loop in module.loops)
    return replace(module, loops=loops)


class _SharedParts:
    """The parts of a module, by what they compute.

    Vectorised loops over parts differ in the arguments that all elements share, so that parts do, too.
    """

    def __init__(self, kernels: Sequence[str]) -> None:
        endings = dict.fromkeys(("", *C_ENDINGS, *LOOP_ENDINGS))
        self._taken = {f"{name}{ending}" for name in kernels for ending in endings} | C_MACRO_NAMES
        self._known: dict[object, Program] = {}

    def procedure(self, procedure: Procedure) -> Procedure:
        """Return a procedure with shared parts."""
        in_lanes = has_lanes(procedure)

        def changed(apply: Apply) -> Apply:
            same = tuple(is_shared(procedure, place) for place in apply.inputs) if in_lanes else None
            key = same, _without_names(apply.program)
            if key not in self._known:
                self._known[key] = replace(apply.program, name=self._name(procedure, apply))
            return replace(apply, program=self._known[key])

        return replace(procedure, body=with_applies(procedure.body, changed))

    def _name(self, procedure: Procedure, apply: Apply) -> str:
        table = procedure.table(apply.outputs[0].table)
        stem = re.sub(r"(_\d+)+$", "", table.name)
        if table.storage is Storage.RESULT and stem == "out":
            stem = RESULT
        if not apply.program.arguments and not stem.endswith(START):
            stem += START
        name, n = f"{procedure.name}_{stem}", 1
        while {name, f"{name}_lanes"} & self._taken:
            n += 1
            name = f"{procedure.name}_{stem}_{n}"
        self._taken |= {name, f"{name}_lanes"}
        return name


def with_applies(body: Sequence[Statement], change: Callable[[Apply], Apply]) -> tuple[Statement, ...]:
    """Return statements in which `change` is applied to every call of a program, in the order of the text."""
    found: list[Statement] = []
    for statement in body:
        if isinstance(statement, Apply):
            statement = change(statement)
        elif isinstance(statement, (Loop, Repeat)):
            statement = replace(statement, body=with_applies(statement.body, change))
        found.append(statement)
    return tuple(found)


def _without_names(program: Program) -> object:
    """Return a key that is equal for programs which differ only in names."""
    numbers: dict[Operand, int] = {}
    for argument in program.arguments:
        numbers |= {name: k for k, name in enumerate(argument.components, start=len(numbers))}

    def operand(each: Operand) -> object:
        return numbers[each] if isinstance(each, str) else ("number", each)

    lines = []
    for line in program.lines:
        lines.append((line.op, tuple(map(operand, line.operands))))
        numbers[line.target] = len(numbers)
    results = tuple((result.shape, tuple(map(operand, result.operands))) for result in program.results)
    return tuple(argument.shape for argument in program.arguments), tuple(lines), results
