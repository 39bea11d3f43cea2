"""Describe a kernel as text: kernels with the same text have the same program and the same printed form.

The text is made from the traced kernel, so that it covers everything that the function uses: other functions, closures
and global variables. Layouts and algebras are described in full, since users may define their own under any name.
Functions in a layout are described by the polynomials that they return for variables.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.layout import Layout
from ..algebra.multivector import Multivector
from ..frontend.calls import Call
from ..frontend.expression import Expression, Input, topological
from ..frontend.kernel import Kernel, Trace
from ..frontend.kernel import trace as trace_kernel
from ..frontend.loop_trace import LoopTrace
from ..frontend.recorded import Compute, Recorded, computes
from ..frontend.rows import IndexOf
from ..ir.procedure import Loop, Repeat
from ..passes.inference import traced_loops
from ..rings.polynomial import Polynomial, PolynomialRing


class NotDescribed(Exception):
    """Part of a kernel has no exact text, so the kernel cannot be cached."""


def description_of(kernel: Kernel) -> str:
    """Return the description of a kernel, with or without loops.

    Raises
    ------
    GacError
        If the kernel cannot be traced.
    NotDescribed
        See `description`.
    """
    if kernel.has_loops:
        return loops_description(traced_loops(kernel))
    return description(trace_kernel(kernel))


def description(trace: Trace) -> str:
    """Return a text that is the same for two kernels if and only if they are compiled identically.

    Raises
    ------
    NotDescribed
        If a constant is not a rational number, or a function of a layout does not return a polynomial.
    """
    return _Writer().kernel(trace)


def loops_description(trace: LoopTrace) -> str:
    """Return a text that is the same for two kernels with loops if and only if they are compiled identically.

    Raises
    ------
    NotDescribed
        See `description`.
    """
    writer = _Writer()
    texts = [writer.loops(trace)]
    texts += [description(trace_kernel(part.kernel)) for part in computes(trace.statements)]
    return "\n\n".join(texts)


class _Writer:
    """Writes each algebra and each layout once, and refers to it by number afterwards."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}
        self._known: dict[int, int] = {}
        """Numbers by the identity of objects, which the kernel keeps alive while it is described."""
        self._algebras: dict[Algebra, int] = {}
        """The number of the first of all equal algebras: equal constants are one node, whose algebra is that of the
        kernel that was traced first, and may have another name."""

    def kernel(self, trace: Trace) -> str:
        """Return the whole text of a kernel without loops."""
        definition = trace.kernel
        order = topological(trace.expressions)
        places = {expression: k for k, expression in enumerate(order)}
        parameters = [(p.name, p.outer_shape, self._layout(p.layout)) for p in definition.parameters]
        nodes = [self._node(expression, [places[a] for a in expression.arguments]) for expression in order]
        outputs = [
            (
                output.name,
                output.outer_shape,
                [places[expression] for expression in output.expressions],
                None if output.layout is None else self._layout(output.layout),
            )
            for output in trace.outputs
        ]
        about = (definition.name, definition.summary, definition.result_names)
        calls = [self._call(call) for call in trace.calls]
        return "\n".join([*map(repr, [about, parameters, outputs, *nodes, *calls]), *self._numbers])

    def _call(self, call: Call[Kernel]) -> tuple[Any, ...]:
        """Return the text of a called kernel, which is compiled as well, and of what it is called with."""
        order = topological((*call.arguments, *call.results))
        places = {expression: k for k, expression in enumerate(order)}
        nodes = [self._node(expression, [places[a] for a in expression.arguments]) for expression in order]
        given, found = ([places[each] for each in some] for some in (call.arguments, call.results))
        return description(trace_kernel(call.kernel)), nodes, given, found

    def loops(self, trace: LoopTrace) -> str:
        """Return the text of a kernel with loops, except for its straight-line parts."""
        definition = trace.kernel
        parameters = [
            (p.name, p.type) if isinstance(p.type, IndexOf) else (p.name, p.outer_shape, self._layout(p.layout))
            for p in definition.parameters
        ]
        records = [(r.table, [(leaf.start, self._layout(leaf.layout)) for leaf in r.leaves]) for r in trace.records]
        results = [name for name, _ in trace.results]
        about = (definition.name, definition.summary, parameters, records, trace.indices, results)
        return "\n".join([repr(about), *map(self._statement, trace.statements), *self._numbers])

    def _statement(self, statement: Recorded) -> str:
        if isinstance(statement, (Loop, Repeat)):
            return repr((replace(statement, body=()), [self._statement(each) for each in statement.body]))  # type: ignore[arg-type]
        if not isinstance(statement, Compute):
            return repr(statement)
        sources = [(source.place, source.leaf.start) for source in statement.sources]
        return repr((sources, statement.names, [(place, leaf.start) for place, leaf in statement.targets]))

    def _node(self, expression: Expression, arguments: list[int]) -> tuple[Any, ...]:
        data = expression.data
        if isinstance(data, Input):
            data = (data.name, data.components, self._layout(data.layout))
        elif isinstance(data, Multivector):
            data = _numbers(data.terms)
        return expression.operation, arguments, data, self._algebra(expression.algebra)

    def _algebra(self, algebra: Algebra) -> int:
        if id(algebra) not in self._known:
            if algebra in self._algebras:
                self._known[id(algebra)] = self._algebras[algebra]
            else:
                metric = [[str(value) for value in row] for row in algebra.gram]
                # The layout of a result is chosen among all named layouts.
                named = [_layout_text(layout) for layout in algebra.layouts.values()]
                self._add(algebra, repr(("algebra", algebra.name, algebra.vectors, metric, algebra.spellings, named)))
                self._algebras[algebra] = self._known[id(algebra)]
        return self._known[id(algebra)]

    def _layout(self, layout: Layout) -> int:
        if id(layout) not in self._known:
            self._add(layout, repr(("layout", self._algebra(layout.algebra), _layout_text(layout))))
        return self._known[id(layout)]

    def _add(self, described: Algebra | Layout, text: str) -> None:
        self._known[id(described)] = self._numbers.setdefault(text, len(self._numbers))


@cache
def _layout_text(layout: Layout) -> str:
    """Return the text of a layout, except for its algebra."""
    stored = [(slot.name, slot.blade, slot.sign) for slot in layout.stored]
    fixed = [(slot.name, slot.blade, slot.sign, str(value)) for slot, value in layout.fixed]
    return repr((layout.name, stored, fixed, layout.unit, *_functions(layout)))


def _functions(layout: Layout) -> tuple[Any, ...]:
    """Evaluate the functions of a layout on variables: the implied coefficients and the relations."""
    if not layout.implied and layout.user_relations is None:
        return ()
    ring = PolynomialRing()
    variables = {name: ring.variable(name) for name in layout.blades}
    try:
        implied = [
            (slot.name, slot.blade, slot.sign, _terms(ring.lift(function(variables))))
            for slot, function in layout.implied
        ]
        relations: list[Any] = []
        if layout.user_relations is not None:
            found = layout.user_relations(layout.element(list(variables.values())))
            for each in [found] if isinstance(found, Multivector) else found:
                relations.append([(blade, _terms(ring.lift(value))) for blade, value in each.terms.items()])
    except Exception as error:  # the user's function may raise anything
        raise NotDescribed(f"the functions of {layout}") from error
    if ring.atoms:
        raise NotDescribed(f"the functions of {layout}")
    return implied, relations


def _terms(polynomial: Polynomial) -> list[tuple[Any, ...]]:
    """Return the terms in their order, which affects the printed text."""
    return _numbers(polynomial.terms)


def _numbers(terms: Mapping[Any, Any]) -> list[tuple[Any, ...]]:
    found = []
    for place, value in terms.items():
        if not isinstance(value, (int, Fraction)):
            raise NotDescribed(f"a constant of type {type(value).__name__}")
        found.append((place, value.numerator, value.denominator))
    return found
