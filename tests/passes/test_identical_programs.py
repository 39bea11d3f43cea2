"""Proofs of programs as polynomials in values of functions, and systems in which nothing can be factorised."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import Any

import pytest

from gacompiler import SCALAR, kernel, maximum, select, sqrt
from gacompiler.algebra.catalog import VGA2
from gacompiler.errors import ProofError
from gacompiler.frontend.kernel import Kernel
from gacompiler.ir.scalar import Op
from gacompiler.passes.factor import Policy, factor
from gacompiler.passes.pipeline import compile_kernel
from gacompiler.passes.prove import are_identities, prove_program
from gacompiler.passes.record import Compilation
from gacompiler.passes.search import POLICIES
from gacompiler.passes.share import share
from gacompiler.passes.system import System
from gacompiler.rings.polynomial import PolynomialRing


@kernel(a=SCALAR, b=SCALAR, c=SCALAR)
def chosen(a, b, c):  # type: ignore[no-untyped-def]
    return select(a * b - a * c < 0, maximum(a, b) / (b - c), (a + b) * (a + b))


@kernel(r=VGA2.ROTOR, a=SCALAR)
def from_relations(r, a):  # type: ignore[no-untyped-def]
    return select(a < 0, r["1"] * r["1"] + r["e12"] * r["e12"], a)


@kernel(a=SCALAR, b=SCALAR)
def from_functions(a, b):  # type: ignore[no-untyped-def]
    return select(a < b, sqrt(a * a + 1) * sqrt(a * a + 1), b)


def is_identity(record: Compilation) -> bool:
    assert record.trace is not None and record.decision is not None
    definition = record.kernel, record.trace.expressions, record.decision.slots
    return are_identities(*definition, [record.program])


def test_a_program_with_branches_is_proved_for_all_inputs() -> None:
    record = compile_kernel(chosen)
    assert record.cost.mul < 4  # It is factorised, so that not only equal operations are recognised.
    assert is_identity(record)


def test_no_changed_program_is_proved() -> None:
    """One operation is replaced, or its operands are exchanged; the programs are refused by points, too."""
    record = compile_kernel(chosen)
    assert record.best is not None
    other = {Op.MULTIPLY: Op.ADD, Op.ADD: Op.SUBTRACT, Op.MAXIMUM: Op.MINIMUM}
    for k, line in enumerate(record.program.lines):
        operands = line.operands if line.op in other else (*line.operands[:-2], *reversed(line.operands[-2:]))
        changed = replace(line, op=other.get(line.op, line.op), operands=operands)
        program = replace(record.program, lines=(*record.program.lines[:k], changed, *record.program.lines[k + 1 :]))
        wrong = replace(record, best=replace(record.best, program=program), uniform=())
        assert not is_identity(wrong)
        with pytest.raises(ProofError):
            prove_program(wrong)


@pytest.mark.parametrize("definition", [from_relations, from_functions], ids=lambda x: x.name)
def test_programs_that_rely_on_relations_are_proved_at_points(definition: Kernel) -> None:
    record = compile_kernel(definition)
    constant = {from_relations.name: 0, from_functions.name: 1}[definition.name]
    assert sum(line.op is Op.MULTIPLY for line in record.program.lines) == constant
    assert not is_identity(record)


def test_a_domain_that_few_points_miss_is_found() -> None:
    """The root exists for one of the four sizes of random numbers only if two of them are close to zero."""

    @kernel(a=SCALAR, b=SCALAR)
    def narrow(a, b):  # type: ignore[no-untyped-def]
        return select(a < b, sqrt(1 - 10**4 * a * a), sqrt(1 - 10**4 * b * b))

    assert is_identity(compile_kernel(narrow))


def test_systems_without_divisors_are_the_same_by_all_policies() -> None:
    random, final = Random(4), 0
    for _ in range(200):
        ring = PolynomialRing()
        variables = [ring.variable(name) for name in "xyzuvw"]

        def term() -> Any:
            found: Any = random.choice((1, 1, 1, -1, 2))
            for each in random.sample(variables, random.randint(1, 3)):  # noqa: B023
                found = found * each
            return found

        polynomials = tuple(sum((term() for _ in range(random.randint(1, 3))), ring.constant(0)) for _ in range(2))
        system = System(ring, len(variables), (), polynomials)
        first = Policy(split_numbers=True)
        if factor(polynomials, len(ring.names), first).is_final:
            final += 1
            assert len({tuple(map(repr, share(system, policy))) for policy in (first, *POLICIES)}) == 1
    assert 50 < final < 150
