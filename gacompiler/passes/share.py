"""Conversion of factored sums to shared scalar expressions, with a single division where one suffices."""

from __future__ import annotations

from collections import Counter
from collections.abc import Generator
from typing import Any

from ..ir.scalar import Graph, Op, Scalar
from .factor import Factored, Policy, factor
from .kernel_extraction import Cube, Sum
from .system import System


def share(system: System, policy: Policy) -> tuple[Scalar, ...]:
    """Return the outputs of `system` as scalar expressions over the names of its inputs."""
    return Builder(system, policy).outputs()


Steps = Generator["Steps", Scalar, Scalar]
"""A computation that yields the computations whose values it needs, so that its depth is not limited by the stack."""


def _result(computation: Steps) -> Scalar:
    """Run a computation, and return its value."""
    stack: list[Steps] = [computation]
    value: Any = None
    while stack:
        try:
            stack.append(stack[-1].send(value))
            value = None
        except StopIteration as end:
            stack.pop()
            value = end.value
    found: Scalar = value
    return found


class Builder:
    """The scalar expressions of a system that is factorised by a policy."""

    def __init__(self, system: System, policy: Policy) -> None:
        self._ring = system.ring
        self._system = system
        self._graph = Graph()
        definitions, atoms = system.live
        polynomials = list(system.outputs)
        self._sum_of: dict[int, int] = {}
        for definition in definitions:
            self._sum_of[definition.variable] = len(polynomials)
            polynomials.append(definition.polynomial)
        self._atom_arguments: dict[int, tuple[int, ...]] = {}
        for variable in atoms:
            arguments = system.ring.atom_of(variable).arguments
            self._atom_arguments[variable] = tuple(range(len(polynomials), len(polynomials) + len(arguments)))
            polynomials.extend(arguments)
        self.factored: Factored = factor(tuple(polynomials), len(system.ring.names), policy)
        self._values: dict[int, Scalar] = {}
        self._sums: dict[int, Scalar] = {}
        self._reciprocal_uses = Counter(
            literal
            for terms in self.factored.sums
            for cube in terms
            for literal in cube
            if literal < 0 and system.ring.atom_of(literal).op is Op.DIVIDE
        )

    def outputs(self) -> tuple[Scalar, ...]:
        """Return the outputs over the names of the inputs."""
        for k in range(self._system.n_inputs):
            self._values[k] = self._graph.variable(self._ring.names[k])
        return tuple(_result(self._sum(k)) for k in range(len(self._system.outputs)))

    def _value(self, variable: int) -> Steps:
        if variable not in self._values:
            self._values[variable] = yield self._compute(variable)
        return self._values[variable]

    def _compute(self, variable: int) -> Steps:
        number = self.factored.number(variable)
        if number is not None:
            return self._graph.constant(number)
        if variable < 0:
            arguments = []
            for k in self._atom_arguments[variable]:
                arguments.append((yield self._sum(k)))
            return self._graph.apply(self._ring.atom_of(variable).op, *arguments)
        if variable in self._sum_of:
            return (yield self._sum(self._sum_of[variable]))
        terms = self.factored.new_sum(variable)
        assert terms is not None
        return (yield self._terms(terms))

    def _sum(self, index: int) -> Steps:
        if index not in self._sums:
            self._sums[index] = yield self._terms(self.factored.sums[index])
        return self._sums[index]

    def _terms(self, terms: Sum) -> Steps:
        """Return a sum with positive terms first. A sum without positive terms is computed as a negated sum."""
        ordered = sorted(terms, key=lambda cube: (-terms[cube], -len(cube), cube))
        if not ordered:
            return self._graph.constant(0)
        flip = terms[ordered[0]] < 0
        total: Scalar | None = None
        for cube in ordered:
            value = yield self._cube(cube)
            if total is None:
                total = value
            elif (terms[cube] < 0) == flip:
                total = total + value
            else:
                total = total - value
        assert total is not None
        return -total if flip else total

    def _cube(self, cube: Cube) -> Steps:
        divisors = [literal for literal in cube if self._reciprocal_uses.get(literal) == 1]
        product = self._graph.constant(1)
        for literal in cube:
            if literal not in divisors:
                product = product * (yield self._value(literal))
        for literal in divisors:
            (_, divisor) = self._atom_arguments[literal]
            product = product / (yield self._sum(divisor))
        return product
