"""Parts of a kernel: subexpressions between named results, optimised as kernels of their own.

A part is a kernel whose parameters are the named results that it uses, with everything that is proved about them. Parts
that differ only in the names of their parameters are the same kernel, which is optimised once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ..algebra.layout import SCALAR, SCALARS, Layout
from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..errors import LayoutError, TooLargeError
from ..frontend.expression import Expression, lift, topological
from ..frontend.facts import is_unit
from ..frontend.kernel import Kernel, Parameter
from ..frontend.traced import Traced, substituted
from ..ir.interpret import Tape
from ..ir.scalar import Graph, Scalar
from .decide import is_proved_in, layout_of
from .record import Compilation

Optimise = Callable[[Kernel], Compilation]
"""The pipeline up to the selection of a program."""


@dataclass(frozen=True, slots=True)
class Part:
    """An optimised part.

    Attributes
    ----------
    tape : Tape
        Its program.
    layouts : tuple of Layout
        The layout of each element of its results, with the relations that are proved.
    """

    tape: Tape
    layouts: tuple[Layout, ...]

    def values(self, arguments: Sequence[Scalar], graph: Graph) -> list[Multivector]:
        """Return the elements of the results for the stored coefficients of the arguments."""
        numbers = iter(map(graph.lift, self.tape.run(arguments, graph.lift)))
        return [layout.element([next(numbers) for _ in layout.stored]) for layout in self.layouts]


_KNOWN: dict[tuple[Optimise, object], Part] = {}
"""Optimised parts of this process, by the function that optimises them, which has an effort level, and by their
expression over canonical names, or the called kernel."""

_LAYOUTS: dict[Layout, Layout] = {}
"""One object for equal layouts, because equal inputs must have the identical layout."""


def part_of_expression(root: Expression, leaves: Mapping[Expression, Layout], optimise: Optimise) -> Part:
    """Return the part that computes `root` from the leaves of the given layouts."""
    expression, parameters = canonical(root, leaves)
    if (optimise, expression) not in _KNOWN:
        given = tuple(parameter.symbols() for parameter in parameters)
        kernel = Kernel("part", Traced(given, expression), parameters, None, "")
        _KNOWN[optimise, expression] = _optimised(kernel, optimise)
    return _KNOWN[optimise, expression]


def canonical(root: Expression, leaves: Mapping[Expression, Layout]) -> tuple[Expression, tuple[Parameter, ...]]:
    """Return an expression over parameters with canonical names, and these parameters. Constants are inserted."""
    parameters: list[Parameter] = []
    symbols = {}
    for leaf, layout in leaves.items():
        if layout.stored:
            parameters.append(Parameter(f"x{len(parameters)}", _LAYOUTS.setdefault(layout, layout)))
            symbols[leaf] = parameters[-1].symbols()
        else:
            symbols[leaf] = lift(layout.element(()))
    return substituted([root], symbols)[0], tuple(parameters)


def part_of_call(kernel: Kernel, optimise: Optimise) -> Part:
    """Return a called kernel as a part."""
    if (optimise, kernel) not in _KNOWN:
        _KNOWN[optimise, kernel] = _optimised(kernel, optimise)
    return _KNOWN[optimise, kernel]


def _optimised(kernel: Kernel, optimise: Optimise) -> Part:
    record = optimise(kernel)
    assert record.trace is not None and record.decision is not None
    layouts: list[Layout] = []
    for output, layout, is_related in zip(
        record.trace.outputs, record.decision.layouts, record.decision.related, strict=True
    ):
        if output.layout is not None and is_related:  # It is declared, and holds at exact points.
            layouts += [layout] * len(output.expressions)
        else:
            layouts += [proved_layout(kernel, expression, layout) for expression in output.expressions]
    return Part(Tape(record.program), tuple(layouts))


def proved_layout(kernel: Kernel, expression: Expression, layout: Layout) -> Layout:
    """Return the layout of a result with a relation if it is proved, else without relations."""
    algebra = expression.algebra
    if algebra == SCALARS or layout.algebra == SCALARS:
        return layout
    plain = layout
    if layout.has_relations:
        fixed = {slot.name: value for slot, value in layout.fixed}
        plain = algebra.layout(layout.name, " ".join(layout.blades), fixed=fixed) if not layout.implied else layout
    for each in [layout, *algebra.layouts.values()]:
        alike = each.support == layout.support and _fixed(each) == _fixed(layout)
        if (each is layout or alike) and (each.has_relations or each.implied):
            try:
                if is_proved_in(kernel, expression, each):
                    return each
            except TooLargeError:
                continue
    return unit(plain) if is_unit(expression) and not layout.implied else plain


def _fixed(layout: Layout) -> dict[int, object]:
    return {slot.blade: slot.sign * value for slot, value in layout.fixed if value}


def layout_of_value(expression: Expression, value: Multivector, leaves: Mapping[Expression, Layout]) -> Layout:
    """Return the layout of a value that is computed directly from leaves of the given layouts."""
    algebra = expression.algebra
    constant = {blade: number for blade, each in value.terms.items() if (number := _number(each)) is not None}
    variable = set(value.terms) - set(constant)
    if algebra == SCALARS and variable:
        return SCALAR
    if algebra == SCALARS:
        return algebra.layout("constant", "", fixed={"1": constant[0]} if constant else {})
    layout = layout_of(algebra, variable, {blade: number for blade, number in constant.items() if number})
    return unit(layout) if is_unit(canonical(expression, leaves)[0]) else layout


def _number(value: Any) -> Fraction | None:
    if isinstance(value, Scalar):
        return value.value if isinstance(value.value, Fraction) else None
    return Fraction(value)


def unit(layout: Layout) -> Layout:
    """Return the layout of the elements with ``x ~x = 1``."""
    for each in layout.algebra.layouts.values():
        if each.unit and each.support == layout.support and _fixed(each) == _fixed(layout) and not each.implied:
            return each
    fixed = {slot.name: value for slot, value in layout.fixed}
    return layout.algebra.layout(f"unit {layout.name}", " ".join(layout.blades), fixed=fixed, unit=True)


def fits(argument: Layout, parameter: Layout) -> bool:
    """Return whether every element of a layout is proved to be one of the layout of a parameter."""
    if argument == parameter:
        return True
    if not argument.stored:
        return _holds(parameter, argument.element(()))
    if parameter.implied or parameter.user_relations or (parameter.unit and not argument.unit):
        return False
    fixed = _fixed(argument)
    return argument.support <= parameter.support and all(
        fixed.get(blade) == value for blade, value in _fixed(parameter).items()
    )


def _holds(layout: Layout, constant: Multivector) -> bool:
    try:
        layout.coefficients(constant)
    except LayoutError:
        return False
    return all(relation == 0 for relation in layout.relations(constant))


def stored(layout: Layout, value: Multivector) -> list[object]:
    """Return the stored coefficients of a value that is known to fit a layout."""
    return [slot.sign * value.terms[slot.blade] if slot.blade in value.terms else 0 for slot in layout.stored]


def leaves_of(root: Expression, roots: frozenset[Expression]) -> list[Expression]:
    """Return the roots and inputs that a part uses, in a canonical order."""
    below = frozenset(roots - {root})
    found: dict[Expression, None] = {}
    for each in topological([root], below):
        if each.operation is Operation.INPUT:
            found[each] = None
        found.update((argument, None) for argument in each.arguments if argument in below)
    return list(found)
