"""Batches in which some arguments are the same for every element: one motor and many points.

What depends on those arguments alone is prepared once. A result is a polynomial in the other arguments, and its
coefficients are polynomials in the ones that stay the same: a motor becomes a matrix, of which each point takes nine
products instead of twenty-one. Where that is no gain, the lines of the program that do not change are prepared.
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
"""Results with more terms than this together are not collected by their coefficients."""
PREPARED = 64
"""Numbers that may be prepared."""
WORTH = Fraction(4, 5)
"""A form is kept where one element costs at most this part of what it costs alone."""
SMALLEST = 16
"""Kernels that cost less than this are not worth a second form; those that cost more than `LARGEST` are left alone."""


def uniform_forms(
    kernel: Kernel, expressions: Sequence[Expression], slots: Sequence[Slot], program: Program, gate: Gate
) -> tuple[Uniform, ...]:
    """The forms that pay and are accurate, cheapest first; at most one for each argument.

    Parameters
    ----------
    kernel : Kernel
    expressions : sequence of Expression
        Its results as the author wrote them.
    slots : sequence of Slot
        The numbers to compute, in the order of the results.
    program : Program
        The program for one element.
    gate : Gate
        What accepts a program as accurate.
    """
    total = cost(program).total
    if not SMALLEST <= total <= LARGEST:
        return ()
    found: list[tuple[int, int, Uniform]] = []
    for same in _choices(program):
        programs = [program, *_collected(kernel, expressions, program.results, slots, same)]
        forms = [form for each in programs if (form := split(each, same)) is not None and _pays(form, total)]
        forms.sort(key=lambda form: (form.costs[1].total, form.costs[0].total))
        best = next((form for form in forms if gate.accepts(joined(form, program))), None)
        if best is not None:
            found.append((best.costs[1].total, len(found), best))
    return tuple(form for _, _, form in sorted(found)[: len(program.arguments)])


def _pays(form: Uniform, total: int) -> bool:
    return form.apply.arguments[0].shape[0] <= PREPARED and form.costs[1].total <= WORTH * total


def _choices(program: Program) -> Iterator[tuple[str, ...]]:
    """Which arguments may stay the same: every part of two or three, and each but one of more."""
    names = [argument.name for argument in program.arguments]
    sizes = range(1, len(names)) if len(names) <= 3 else (len(names) - 1,)
    for size in sizes:
        yield from combinations(names, size)


def _collected(
    kernel: Kernel,
    expressions: Sequence[Expression],
    results: Sequence[Result],
    slots: Sequence[Slot],
    same: Sequence[str],
) -> Iterator[Program]:
    """Programs of the results as polynomials in the arguments that change, their coefficients named."""
    arguments = tuple(Argument(p.name, p.shape, p.components) for p in kernel.parameters)
    fixed = {component for argument in arguments if argument.name in same for component in argument.components}
    seen = set()
    for reduction in Reduction:
        try:
            system = Lowering(kernel, expressions, frozenset(), reduction, LARGEST, 10 * LARGEST).system(slots)
        except TooLargeError:
            continue
        if sum(len(output.terms) for output in system.outputs) > LARGEST or system.key in seen:
            continue
        seen.add(system.key)
        collected = _by_coefficients(system, fixed)
        if collected is None:
            continue
        todo = iter(share(collected, Policy(split_numbers=True)))
        shaped = tuple((r.name, r.shape, tuple(next(todo) for _ in r.operands)) for r in results)
        yield schedule(kernel.name, arguments, shaped)


def _by_coefficients(system: System, fixed: set[str]) -> System | None:
    """`system` with a name for every coefficient; None where functions of changing arguments occur."""
    ring = system.ring
    is_fixed = _Fixed(ring, system.n_inputs, fixed)
    _, atoms = system.live()
    if system.definitions or not all(map(is_fixed, atoms)):
        return None
    definitions: list[Definition] = []
    names: dict[object, int] = {}
    outputs = []
    for output in system.outputs:
        by_monomial: dict[Monomial, dict[Monomial, Fraction | int]] = {}
        for monomial, value in output.terms.items():
            changing = tuple(v for v in monomial if not is_fixed(v))
            staying = tuple(v for v in monomial if is_fixed(v))
            by_monomial.setdefault(changing, {})[staying] = value
        total = ring.constant(0)
        for changing, terms in by_monomial.items():
            total = total + _named(Polynomial(ring, terms), names, definitions) * Polynomial(ring, {changing: 1})
        outputs.append(total)
    return System(ring, system.n_inputs, tuple(definitions), tuple(outputs))


def _named(coefficient: Polynomial, names: dict[object, int], definitions: list[Definition]) -> Polynomial:
    """A variable for a coefficient, or minus the variable of its opposite; numbers and variables are their own."""
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
    """Whether a variable is an input that stays the same, or a function of such."""

    def __init__(self, ring: PolynomialRing, n_inputs: int, fixed: set[str]) -> None:
        self._ring = ring
        self._known = {k: ring.names[k] in fixed for k in range(n_inputs)}

    def __call__(self, variable: int) -> bool:
        if variable not in self._known:
            arguments = self._ring.atom_of(variable).arguments
            self._known[variable] = all(self(v) for argument in arguments for v in argument.variables)
        return self._known[variable]
