"""Forms of a kernel for batches in which some arguments are the same for every element: one motor and many points.

Values that depend only on these uniform arguments are prepared once. A result is a polynomial in the other arguments,
and its coefficients are polynomials in the uniform ones. For example, a motor becomes a matrix, and each point requires
nine products instead of twenty-one. If this is not cheaper, the invariant lines of the program are prepared instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations

from ..errors import TooLargeError
from ..frontend.expression import Expression
from ..frontend.kernel import Kernel
from ..ir.cost import cost
from ..ir.program import Argument, Program, Result
from ..ir.uniform import Uniform, joined, split
from ..rings.polynomial import Monomial, Polynomial, PolynomialRing
from .accuracy import Gate
from .factor import Policy
from .lower import Lowering, Reduction, Slot
from .schedule import schedule
from .share import share
from .system import Definition, System

LARGEST = 400
"""Maximum total number of terms of results that are collected by coefficients."""
PREPARED = 64
"""Maximum number of prepared values."""
WORTH = Fraction(4, 5)
"""Maximum cost of a form per element, as a fraction of the cost of the program."""
SMALLEST = 16
"""Minimum cost of a kernel to search for a second form; the maximum is `LARGEST`."""


def uniform_forms(
    kernel: Kernel, expressions: Sequence[Expression], slots: Sequence[Slot], program: Program, gate: Gate
) -> tuple[Uniform, ...]:
    """Return the accurate forms that reduce the cost sufficiently, cheapest first, at most as many as arguments.

    Parameters
    ----------
    kernel : Kernel
    expressions : sequence of Expression
        The results in the author's form.
    slots : sequence of Slot
        The numbers to compute, in the order of the results.
    program : Program
        The program for one element.
    gate : Gate
        The accuracy criterion.
    """
    total = cost(program).total
    if not SMALLEST <= total <= LARGEST:
        return ()
    found: list[tuple[int, int, Uniform]] = []
    systems = _systems(kernel, expressions, slots)
    for same in _choices(program):
        programs = [program, *_collected(kernel, systems, program.results, same)]
        forms = [form for each in programs if (form := split(each, same)) is not None and _pays(form, total)]
        forms.sort(key=lambda form: (form.costs[1].total, form.costs[0].total))
        best = next((form for form in forms if gate.accepts(joined(form, program))), None)
        if best is not None:
            found.append((best.costs[1].total, len(found), best))
    return tuple(form for _, _, form in sorted(found)[: len(program.arguments)])


def _pays(form: Uniform, total: int) -> bool:
    return form.apply.arguments[0].shape[0] <= PREPARED and form.costs[1].total <= WORTH * total


def _choices(program: Program) -> Iterator[tuple[str, ...]]:
    """Yield the sets of uniform arguments: all proper subsets of two or three, else all but one argument."""
    names = [argument.name for argument in program.arguments]
    sizes = range(1, len(names)) if len(names) <= 3 else (len(names) - 1,)
    for size in sizes:
        yield from combinations(names, size)


def _systems(kernel: Kernel, expressions: Sequence[Expression], slots: Sequence[Slot]) -> list[System]:
    """Return the distinct systems of the results, by all reductions that have an effect."""
    found: dict[object, System] = {}
    for reduction in Reduction:
        try:
            lowering = Lowering(kernel, expressions, frozenset(), reduction, LARGEST, 10 * LARGEST)
            system = lowering.system(slots)
        except TooLargeError:
            continue
        if sum(len(output.terms) for output in system.outputs) <= LARGEST:
            found.setdefault(system.key, system)
        if not lowering.relations.known:
            break  # There is nothing to reduce by, so that other reductions lead to the same system.
    return list(found.values())


def _collected(
    kernel: Kernel, systems: Sequence[System], results: Sequence[Result], same: Sequence[str]
) -> Iterator[Program]:
    """Yield programs of the results as polynomials in the varying arguments with named coefficients."""
    arguments = tuple(Argument(p.name, p.shape, p.components) for p in kernel.parameters)
    fixed = {component for argument in arguments if argument.name in same for component in argument.components}
    for system in systems:
        # The limit of the lowering also holds for the products that follow, in which little of it may be left.
        system.ring.effort = 10 * LARGEST
        try:
            collected = _by_coefficients(system, fixed)
            if collected is None:
                continue
            todo = iter(share(collected, Policy(split_numbers=True)))
        except TooLargeError:
            continue
        shaped = tuple((r.name, r.shape, tuple(next(todo) for _ in r.operands)) for r in results)
        yield schedule(kernel.name, arguments, shaped)


def _by_coefficients(system: System, fixed: set[str]) -> System | None:
    """Name every coefficient of `system`. Return None if it contains functions of varying arguments."""
    ring = system.ring
    is_fixed = _Fixed(ring, system.n_inputs, fixed)
    _, atoms = system.live
    if system.definitions or not all(map(is_fixed, atoms)):
        return None
    definitions: list[Definition] = []
    names: dict[object, int] = {}
    outputs = []
    for output in system.outputs:
        by_monomial: dict[Monomial, dict[Monomial, Fraction | int]] = {}
        for monomial, value in output.terms.items():
            varying = tuple(v for v in monomial if not is_fixed(v))
            uniform = tuple(v for v in monomial if is_fixed(v))
            by_monomial.setdefault(varying, {})[uniform] = value
        total = ring.constant(0)
        for varying, terms in by_monomial.items():
            total = total + _named(Polynomial(ring, terms), names, definitions) * Polynomial(ring, {varying: 1})
        outputs.append(total)
    return System(ring, system.n_inputs, tuple(definitions), tuple(outputs))


def _named(coefficient: Polynomial, names: dict[object, int], definitions: list[Definition]) -> Polynomial:
    """Return the variable of a coefficient, or the negated variable of its negative.

    Numbers and single variables are returned unchanged.
    """
    if len(coefficient.terms) == 1 and coefficient.degree <= 1:
        return coefficient
    ring = coefficient.ring
    for factor in (1, -1):
        number = names.get((coefficient * factor).key)
        if number is not None:
            return Polynomial(ring, {(number,): factor})
    ring.variable(f"c{len(definitions)}")
    number = names[coefficient.key] = len(ring.names) - 1
    definitions.append(Definition(number, coefficient))
    return Polynomial(ring, {(number,): 1})


class _Fixed:
    """A predicate for variables that are uniform inputs or functions of uniform inputs only."""

    def __init__(self, ring: PolynomialRing, n_inputs: int, fixed: set[str]) -> None:
        self._ring = ring
        self._known = {k: ring.names[k] in fixed for k in range(n_inputs)}

    def __call__(self, variable: int) -> bool:
        if variable not in self._known:
            arguments = self._ring.atom_of(variable).arguments
            self._known[variable] = all(self(v) for argument in arguments for v in argument.variables)
        return self._known[variable]
