"""Systems of polynomials in inputs and named intermediate results, the stage between multivectors and programs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property

from ..rings.polynomial import Polynomial, PolynomialRing


@dataclass(frozen=True, slots=True)
class Definition:
    """A variable of the ring that represents a polynomial."""

    variable: int
    polynomial: Polynomial


@dataclass(frozen=True, eq=False)
class System:
    """The polynomials that a kernel computes.

    Attributes
    ----------
    ring : PolynomialRing
        The ring. Its first `n_inputs` variables are the kernel's inputs, and its atoms are values of functions.
    n_inputs : int
    definitions : tuple of Definition
        Intermediate results in terms of inputs, atoms and earlier definitions.
    outputs : tuple of Polynomial
    """

    ring: PolynomialRing
    n_inputs: int
    definitions: tuple[Definition, ...]
    outputs: tuple[Polynomial, ...]

    @cached_property
    def live(self) -> tuple[tuple[Definition, ...], tuple[int, ...]]:
        """The definitions and the atoms (as variables, in descending order) that the outputs depend on."""
        by_variable = {definition.variable: definition for definition in self.definitions}
        needed: set[int] = set()
        todo = [variable for polynomial in self.outputs for variable in polynomial.variables]
        while todo:
            variable = todo.pop()
            if variable in needed or 0 <= variable < self.n_inputs:
                continue
            needed.add(variable)
            for polynomial in self._parts(variable, by_variable):
                todo.extend(polynomial.variables)
        kept = tuple(definition for definition in self.definitions if definition.variable in needed)
        return kept, tuple(sorted((v for v in needed if v < 0), reverse=True))

    @cached_property
    def polynomials(self) -> tuple[Polynomial, ...]:
        """All polynomials that have to be computed: of definitions, outputs and arguments of functions."""
        definitions, atoms = self.live
        arguments = [argument for atom in atoms for argument in self.ring.atom_of(atom).arguments]
        return (*(definition.polynomial for definition in definitions), *self.outputs, *arguments)

    def changed(
        self, change: Callable[[Polynomial, int | None], Polynomial], added: Iterable[Definition] = ()
    ) -> System:
        """Return the system with every polynomial changed, and definitions added before the others.

        `change` takes a polynomial and the variable that it defines, if any.
        """
        definitions, atoms = self.live
        renewed: dict[int, Polynomial] = {}
        for variable in atoms:  # An atom comes after the atoms in its arguments.
            atom = self.ring.atom_of(variable)
            new = tuple(change(argument, None).substitute(renewed) for argument in atom.arguments)
            if new != atom.arguments:
                renewed[variable] = self.ring.atom(atom.op, *new)
        rest = (Definition(d.variable, change(d.polynomial, d.variable).substitute(renewed)) for d in definitions)
        outputs = tuple(change(output, None).substitute(renewed) for output in self.outputs)
        return System(self.ring, self.n_inputs, (*added, *rest), outputs)

    @cached_property
    def key(self) -> tuple[object, ...]:
        """A key that is equal for systems with the same computation."""
        kept, atoms = self.live
        functions = ((v, self.ring.atom_of(v)) for v in atoms)
        return (
            tuple((definition.variable, definition.polynomial.key) for definition in kept),
            tuple((v, atom.op, *(argument.key for argument in atom.arguments)) for v, atom in functions),
            tuple(polynomial.key for polynomial in self.outputs),
        )

    def _parts(self, variable: int, by_variable: dict[int, Definition]) -> Iterable[Polynomial]:
        if variable < 0:
            return self.ring.atom_of(variable).arguments
        return (by_variable[variable].polynomial,)

    def __str__(self) -> str:
        kept, _ = self.live
        lines = [f"{self.ring.name(d.variable)} = {d.polynomial}" for d in kept]
        return "\n".join([*lines, *(f"out[{k}] = {p}" for k, p in enumerate(self.outputs))])
