"""Lowering of multivector expressions to polynomials in the inputs, with some nodes kept as named results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache

from ..algebra.blades import Rational
from ..algebra.layout import Layout
from ..algebra.multivector import Multivector
from ..algebra.operations import PRODUCTS, Operation
from ..errors import KernelError
from ..frontend.expression import Expression, evaluate, topological
from ..frontend.facts import is_unit
from ..frontend.kernel import Kernel
from ..ir.scalar import Graph, Scalar
from ..rings.ideal import Ideal
from ..rings.polynomial import Monomial, Polynomial, PolynomialRing
from ..rings.sparse import IndexedRelations, simplify
from .squares import solvable, solve, square_of
from .system import Definition, System


@dataclass(frozen=True, slots=True)
class Slot:
    """A number that a kernel computes: the coefficient of a blade in one of its result expressions."""

    expression: int
    blade: int
    sign: int = 1


def scalars_of(kernel: Kernel, expressions: Sequence[Expression]) -> tuple[Graph, list[Multivector]]:
    """Return expressions over shared scalar expressions, and the graph of these."""
    graph = Graph()
    inputs = {name: graph.variable(name) for parameter in kernel.parameters for name in parameter.components}
    return graph, evaluate(expressions, inputs, lift=graph.lift)


def pick(values: Sequence[Multivector], slots: Iterable[Slot], graph: Graph) -> tuple[Scalar, ...]:
    """Return the scalars of `slots` from results over scalar expressions."""
    found = []
    for slot in slots:
        value = graph.lift(values[slot.expression].terms.get(slot.blade, 0))
        found.append(value if slot.sign > 0 else -value)
    return tuple(found)


class Reduction(Enum):
    """The treatment of polynomials modulo the relations."""

    NORMAL = "reduced"
    SPARSE = "made sparse"
    NONE = "not reduced"


class Relations:
    """The polynomials that are known to vanish, and reduction modulo them."""

    def __init__(self, ring: PolynomialRing) -> None:
        self._ring = ring
        self._known: list[Polynomial] = []
        self._ideals: dict[tuple[tuple[int, ...], int], Ideal] = {}
        self._indexed: dict[tuple[tuple[int, ...], int], IndexedRelations] = {}

    @property
    def known(self) -> bool:
        """Whether there are relations, so that reduction can have an effect."""
        return bool(self._known or self._ring.atom_relations())

    def add(self, relations: Iterable[Polynomial]) -> None:
        """Add polynomials that vanish.

        Raises
        ------
        KernelError
            When a relation is a number other than zero.
        """
        for relation in relations:
            if relation.constant_value not in (0, None):
                raise KernelError(
                    "relations of the inputs", f"{relation.constant_value} = 0", "relations that can hold"
                )
            if not relation.is_zero:
                self._known.append(relation)

    def reduce(self, polynomials: Sequence[Polynomial], how: Reduction) -> list[Polynomial]:
        """Reduce polynomials modulo the relations that share variables with them, directly or indirectly."""
        known = [] if how is Reduction.NONE else self._known + self._ring.atom_relations()
        relevant = _connected(polynomials, known) if known else []
        if not relevant:
            return list(polynomials)
        degree = max((polynomial.degree for polynomial in polynomials), default=0)
        if how is Reduction.SPARSE:
            place = (tuple(relevant), len(self._known))
            if place not in self._indexed:
                self._indexed[place] = IndexedRelations(known[k] for k in relevant)
            return [simplify(polynomial, self._indexed[place]) for polynomial in polynomials]
        key = (tuple(relevant), degree)
        if key not in self._ideals:
            self._ideals[key] = Ideal((known[k] for k in relevant if known[k].degree <= degree), degree)
        return [self._ideals[key].reduce(polynomial) for polynomial in polynomials]


def _connected(polynomials: Sequence[Polynomial], relations: Sequence[Polynomial]) -> list[int]:
    variables = {variable for polynomial in polynomials for variable in polynomial.variables}
    chosen: set[int] = set()
    while True:
        more = {k for k, r in enumerate(relations) if k not in chosen and not variables.isdisjoint(r.variables)}
        if not more:
            return sorted(chosen)
        chosen |= more
        variables |= {variable for k in more for variable in relations[k].variables}


@cache
def _relation_terms(layout: Layout, places: tuple[int, ...]) -> tuple[Mapping[Monomial, Rational], ...]:
    """Return the relations of a layout with the given variables as coefficients, cached over all lowerings."""
    ring = PolynomialRing()
    variables = [Polynomial(ring, {(place,): 1}) for place in places]
    return tuple(ring.lift(relation).terms for relation in layout.relations(layout.element(variables)))


class Lowering:
    """The polynomials of the nodes of a kernel's expressions.

    Parameters
    ----------
    kernel : Kernel
    expressions : sequence of Expression
    cuts : set of Expression
        Nodes whose coefficients are named instead of being expanded.
    reduction : Reduction
        The treatment of polynomials modulo the relations of the inputs.
    name_implied : bool
        Whether coefficients that a layout implies are named instead of being expanded.
    by_squares : bool
        Whether one coefficient of a named vector with a known square is computed from the others.
    budget : int
        Maximum number of terms of one polynomial.
    effort : int
        Maximum number of pairs of terms that are multiplied.
    """

    def __init__(
        self,
        kernel: Kernel,
        expressions: Sequence[Expression],
        cuts: frozenset[Expression] = frozenset(),
        reduction: Reduction = Reduction.NORMAL,
        budget: int = 20_000,
        effort: int = 2_000_000,
        name_implied: bool = False,
        by_squares: bool = False,
    ) -> None:
        self.ring = PolynomialRing(budget, effort)
        self._effort = effort
        self.pairs = 0
        """The number of pairs of terms that were multiplied for the system."""
        inputs: dict[str, Polynomial] = {}
        for parameter in kernel.parameters:
            inputs.update({name: self.ring.variable(name) for name in parameter.components})
        self._n_inputs = len(self.ring.names)
        self.relations = Relations(self.ring)
        place = {name: k for k, name in enumerate(self.ring.names)}
        for expression in topological(expressions):
            if expression.operation is Operation.INPUT and expression.data.layout.has_relations:
                places = tuple(place[name] for name in expression.data.components)
                self.relations.add(
                    Polynomial(self.ring, terms) for terms in _relation_terms(expression.data.layout, places)
                )
        self._reduction = reduction
        self._definitions: list[Definition] = []
        self.has_solved = False
        memory: dict[Expression, Multivector] = {}
        for expression in topological(expressions) if name_implied else ():
            if expression.operation is Operation.INPUT and expression.data.layout.implied:
                (element,) = evaluate([expression], inputs, lift=self.ring.lift)
                memory[expression] = self._named(expression.data.components[0].rpartition("_")[0], element)
        named = cuts | {e for e in expressions if by_squares and square_of(e) is not None}
        for number, expression in enumerate(e for e in topological(expressions) if e in named):
            (value,) = evaluate([expression], inputs, memory, self.ring.lift)
            memory[expression] = self._named(f"s{number}", value, square_of(expression) if by_squares else None)
            if is_unit(expression):
                self.relations.add((memory[expression] * ~memory[expression] - 1).terms.values())
        self.values = evaluate(expressions, inputs, memory, self.ring.lift)

    def _named(self, stem: str, value: Multivector, square: Rational | None = None) -> Multivector:
        """Replace the coefficients of `value`, except those that are numbers or inputs, by new variables.

        One coefficient of a vector with a known square may be computed from the others.
        """
        reduced = self.relations.reduce(list(map(self.ring.lift, value.terms.values())), self._reduction)
        polynomials = dict(zip(value.terms, reduced, strict=True))
        solved = None if square is None else solvable(value.algebra, polynomials)
        terms: dict[int, Polynomial] = {}
        for blade in sorted(polynomials, key=lambda blade: blade == solved):
            polynomial = polynomials[blade]
            if blade == solved and square is not None:
                self.has_solved = True
                polynomial = solve(value.algebra, blade, terms, square)
            if polynomial.degree <= 1 and len(polynomial.terms) <= 1:
                terms[blade] = polynomial
                continue
            name = value.algebra.spelling(blade)[1].replace("^", "_")
            terms[blade] = self.ring.variable(f"{stem}_{name}")
            self._definitions.append(Definition(len(self.ring.names) - 1, polynomial))
        return Multivector(value.algebra, {blade: terms[blade] for blade in polynomials})

    def system(self, slots: Sequence[Slot]) -> System:
        """Return the system of polynomials that computes `slots`. Work on the system has the same limit again."""
        outputs = []
        for slot in slots:
            value = self.ring.lift(self.values[slot.expression].terms.get(slot.blade, 0))
            outputs.append(value if slot.sign > 0 else -value)
        outputs = self.relations.reduce(outputs, self._reduction)
        self.pairs = self._effort - self.ring.effort
        self.ring.effort = self._effort
        return System(self.ring, self._n_inputs, tuple(self._definitions), tuple(outputs))


_HEAVY = (
    *PRODUCTS, Operation.SANDWICH, Operation.INVERSE, Operation.NORM_SQUARED, Operation.NORM, Operation.NORMALIZE,
    Operation.DIVIDE, Operation.ADD, Operation.SUBTRACT,
)  # fmt: skip
"""Operations whose results can be named."""

PLAIN = (
    Operation.ADD, Operation.SUBTRACT, Operation.NEGATE, Operation.REVERSE, Operation.GRADE, Operation.DUAL,
    Operation.UNDUAL, Operation.COEFFICIENT, Operation.ASSEMBLE,
)  # fmt: skip
"""Operations that only move, negate or add coefficients."""


def stages(expressions: Sequence[Expression]) -> list[Expression]:
    """Return the nodes that are candidates for naming.

    These are intermediate products and sums. Results, and linear combinations of inputs, are not included.
    """
    order = topological(expressions)
    used = {argument for expression in order for argument in expression.arguments}
    linear: set[Expression] = set()  # Sums of inputs can be expanded at no cost.
    for expression in order:
        leaf = expression.operation in (Operation.INPUT, Operation.CONSTANT)
        if leaf or (expression.operation in PLAIN and all(argument in linear for argument in expression.arguments)):
            linear.add(expression)
    return [e for e in order if e.operation in _HEAVY and e in used and e not in linear]
