"""Convert compiled kernels to and from plain data: lists, strings and integers."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from ..backends.module import KernelSource
from ..frontend.kernel import Kernel
from ..gac_runtime.layout import Layout
from ..ir.cost import cost
from ..ir.program import Argument, Line, Operand, Program, Result
from ..ir.scalar import Op
from ..ir.uniform import Uniform
from ..ir.verify import verify
from ..passes.lower import Slot
from .compiled import Compiled


def packed(compiled: Compiled) -> dict[str, Any]:
    """Convert a compiled kernel, except for its definition, to plain data."""
    source = compiled.source
    return {
        "program": packed_program(source.program),
        "uniform": [[form.same, packed_program(form.prepare), packed_program(form.apply)] for form in source.uniform],
        "layouts": source.layouts,
        "relations": source.relations,
        "operator": source.operator,
        "error": source.error,
        "slots": packed_slots(compiled.slots),
        "refused": compiled.refused,
    }


def unpacked(kernel: Kernel, data: Any) -> Compiled:
    """Restore the compiled kernel of a definition from the data returned by `packed`.

    Raises
    ------
    GacError, LookupError, TypeError, ValueError
        If the data does not have the expected form.
    """
    program = program_of(data["program"])
    operator = data["operator"]
    source = KernelSource(
        program,
        kernel.summary,
        tuple((name, layout_of(layout)) for name, layout in data["layouts"]),
        cost(program),
        tuple(data["relations"]),
        tuple(Uniform(tuple(same), program_of(prepare), program_of(apply)) for same, prepare, apply in data["uniform"]),
        operator and (operator[0], tuple(operator[1])),
        kernel.result_names,
        data["error"],
    )
    return Compiled(kernel, source, slots_of(data["slots"]), data["refused"])


def packed_program(program: Program) -> list[Any]:
    """Convert a program to plain data."""
    return [
        program.name,
        [[argument.name, argument.shape, argument.components] for argument in program.arguments],
        [[line.target, line.op.value, *map(_packed_operand, line.operands)] for line in program.lines],
        [[result.name, result.shape, *map(_packed_operand, result.operands)] for result in program.results],
    ]


def program_of(data: Any) -> Program:
    """Restore a program from the data returned by `packed_program`."""
    name, arguments, lines, results = data
    return verify(
        Program(
            name,
            tuple(Argument(name, tuple(shape), tuple(components)) for name, shape, components in arguments),
            tuple(Line(target, Op(op), tuple(map(_operand, operands))) for target, op, *operands in lines),
            tuple(Result(name, tuple(shape), tuple(map(_operand, operands))) for name, shape, *operands in results),
        )
    )


def _packed_operand(operand: Operand) -> str | list[int]:
    return operand if isinstance(operand, str) else [operand.numerator, operand.denominator]


def _operand(data: Any) -> Operand:
    return data if isinstance(data, str) else Fraction(*data)


def layout_of(data: Any) -> Layout:
    """Restore a layout, a tuple of plain data, from lists."""
    name, blades, fixed, unit, implied, related = data
    return Layout(name, tuple(blades), tuple(map(tuple, fixed)), unit, tuple(map(tuple, implied)), related)


def packed_slots(slots: Sequence[Sequence[Slot]]) -> list[Any]:
    """Convert the slots of result arrays, the coefficient and expression of each entry, to plain data."""
    return [[[slot.expression, slot.blade, slot.sign] for slot in each] for each in slots]


def slots_of(data: Any) -> tuple[tuple[Slot, ...], ...]:
    """Restore slots from the data returned by `packed_slots`."""
    return tuple(tuple(Slot(*slot) for slot in slots) for slots in data)
