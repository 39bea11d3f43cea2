"""Verification of programs, after every pass that creates one."""

from __future__ import annotations

from collections.abc import Iterable

from ..errors import ProofError
from .program import Operand, Program
from .scalar import ARITY, LEAVES


def verify(program: Program) -> Program:
    """Return `program` unchanged if every name is defined once, before its use, and every line is used.

    Raises
    ------
    ProofError
        When a line is invalid. The message names the first one.
    """

    def fail(found: str) -> None:
        raise ProofError(f"program {program.name}", found, remedy="this is a defect of the compiler, please report it")

    defined: set[str] = set()
    for argument in program.arguments:
        for component in argument.components:
            if component in defined:
                fail(f"{component} is defined twice")
            defined.add(component)
    temporaries: set[str] = set()
    used: set[str] = set()

    def check(operands: Iterable[Operand], place: str) -> None:
        for operand in operands:
            if isinstance(operand, str):
                used.add(operand)
                if operand not in defined:
                    fail(f"{place} uses {operand} before it is defined")

    for line in program.lines:
        if line.op in LEAVES or len(line.operands) != ARITY[line.op]:
            fail(f"{line.target} = {line.op.value} of {len(line.operands)} operands")
        check(line.operands, line.target)
        if line.target in defined:
            fail(f"{line.target} is defined twice")
        defined.add(line.target)
        temporaries.add(line.target)
    for result in program.results:
        check(result.operands, result.name)
    if temporaries - used:
        fail(f"{min(temporaries - used)} is never used")
    return program
