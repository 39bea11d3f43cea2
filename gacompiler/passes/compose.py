"""Programs composed of the best programs of parts.

Each named intermediate result is optimised as a kernel of its own (`gacompiler.passes.parts`). Named are the results of
kernels that the author calls, and the results of operations. From the latter composition, parts are merged with the
part that uses them as long as this does not raise the cost: two joins that give a plane are cheaper as one part, and
the motor that moves the plane is a part of its own.

A composition contains the operations of its parts except for those that several parts share, so its cost is never
above the sum of the costs of the parts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

from ..algebra.layout import Layout
from ..algebra.multivector import Multivector
from ..algebra.operations import PRODUCTS, Kind, Operation
from ..errors import GacError, LayoutError
from ..frontend.calls import Call
from ..frontend.expression import Expression, apply_operation, topological
from ..frontend.kernel import Kernel, Trace
from ..ir.program import Program
from ..ir.scalar import Graph, Scalar
from .candidate import PARTS, Candidate
from .lower import PLAIN, pick, stages
from .matrices import SMALLEST, has_huge_product
from .parts import Optimise, Part, canonical, fits, layout_of_value, leaves_of, part_of_call, part_of_expression, stored
from .prove import disagreement, program_reader, truths
from .rewrite import EXPANDED
from .search import Search
from .truth import Truth

MOST_PARTS = 32
"""Expressions with more parts than this are composed of the results of calls only."""
MOST_MERGES = 8
"""Maximum number of different parts that are tried when parts of one form are merged."""
LARGEST_MERGED = 1_500
"""Compositions that cost more than this are not refined by merging: each merged part is a search of its own."""
FORMS = 2
"""Number of rewritten forms whose parts are merged."""
CHECKED = 2
"""Number of exact points at which a composition is compared with the definition before it can be selected."""
HOPELESS = 1.2
"""Compositions that cost more than this multiple of the best candidate are neither refined nor tried."""

Values = dict[Expression, Multivector]


@dataclass(frozen=True, slots=True)
class _Composition:
    roots: frozenset[Expression]
    layouts: Mapping[Expression, Layout]
    candidate: Candidate


class Composer:
    """The compositions of one kernel.

    Parameters
    ----------
    trace : Trace
    search : Search
    author : Program
        The author's structure.
    optimise : callable
        The pipeline up to the selection of a program, for parts.
    """

    def __init__(self, trace: Trace, search: Search, author: Program, optimise: Optimise) -> None:
        self._trace, self._search, self._author, self._optimise = trace, search, author, optimise
        self._truths: list[Truth] | None = None

    def candidates(self, forms: Mapping[str, tuple[Expression, ...]], best: int) -> Iterator[Candidate]:
        """Yield compositions that cost at most `HOPELESS` times the best candidate so far, of total cost `best`.

        The best candidate may turn out to be inaccurate, and then a composition can be the cheapest of the others.
        Compositions agree with the definition at exact points. A relation that a called kernel declares for its result
        holds there, too, but is not proved, so the composition could be wrong elsewhere.
        """
        for candidate in (*self._of_calls(), *self._of_forms(forms, best)):
            is_cheap = candidate.cost.total <= HOPELESS * best
            if is_cheap and not disagreement(program_reader(candidate.program), self._known()):
                yield candidate

    def _known(self) -> list[Truth]:
        if self._truths is None:
            slots = tuple(slots for _, _, slots in self._search.results)
            self._truths = truths(self._trace.kernel, self._trace.expressions, slots, self._author, n=CHECKED)
        return self._truths

    def _of_forms(self, forms: Mapping[str, tuple[Expression, ...]], best: int) -> Iterator[Candidate]:
        """Yield the compositions of the cheapest forms, with their parts merged."""
        plans: list[tuple[int, int, str, _Composition]] = []
        for name, expressions in forms.items():
            roots = named_results(expressions)
            if 1 < len(roots) <= MOST_PARTS and not has_huge_product(expressions):
                found = self._composed((name,), expressions, roots, {})
                if found is not None:
                    plans.append((found.candidate.cost.total, len(plans), name, found))
        ordered = sorted(plans, key=lambda plan: plan[:2])
        accurate = (plan for plan in ordered if self._search.is_accurate(plan[3].candidate))
        for total, _, name, found in islice(accurate, FORMS):
            if total <= HOPELESS * best:
                is_small = total <= LARGEST_MERGED
                yield (self._merged(name, forms[name], found) if is_small else found).candidate

    def _of_calls(self) -> Iterator[Candidate]:
        """Yield the composition of the called kernels, and that of parts with everything proved about the arguments."""
        expressions = self._trace.expressions
        calls = {result: call for call in self._trace.calls for result in call.results}
        used = frozenset(each for each in topological(expressions) if each in calls)
        given = {argument for each in used for argument in calls[each].arguments}
        roots = used | {each for each in given if each.operation not in _LEAVES} | set(expressions)
        if used:
            for by, name in ((calls, "kernels called"), ({}, "results of calls named")):
                found = self._composed((_AS_WRITTEN, name), expressions, roots, by)
                if found is not None:
                    yield found.candidate

    def _merged(self, name: str, expressions: Sequence[Expression], start: _Composition) -> _Composition:
        """Merge parts with the only part that uses them, from the inputs to the results, while this saves
        operations. The whole expression is never one part."""
        best = start
        tried: dict[Expression, bool] = {}
        for each in topological(expressions):
            if each not in best.roots or each in expressions or each.is_scalar or len(best.roots) <= 2:
                continue
            users = [root for root in best.roots if root is not each and each in leaves_of(root, best.roots)]
            if len(users) != 1 or _is_function(users[0]):
                continue
            roots = best.roots - {each}
            (user,) = users
            key, _ = canonical(user, {leaf: best.layouts[leaf] for leaf in leaves_of(user, roots)})
            if not tried.get(key, len(tried) < MOST_MERGES):
                continue
            found = self._composed((name,), expressions, roots, {})
            tried[key] = found is not None and found.candidate.cost.total < best.candidate.cost.total
            if found is not None and tried[key]:
                best = found
        return best

    def _composed(
        self,
        steps: tuple[str, ...],
        expressions: Sequence[Expression],
        roots: frozenset[Expression],
        calls: Mapping[Expression, Call[Kernel]],
    ) -> _Composition | None:
        """Return the composition of the parts between named results, or None if a part cannot be compiled."""
        graph = Graph()
        try:
            values, layouts, n = self._evaluated(expressions, roots, calls, graph)
        except (GacError, ZeroDivisionError):
            return None
        slots = tuple(slot for _, _, slots in self._search.results for slot in slots)
        scalars = pick([values[each] for each in expressions], slots, graph)
        candidate = self._search.candidate((*steps, f"{n}{PARTS}"), scalars)
        return _Composition(roots, layouts, candidate)

    def _evaluated(
        self,
        expressions: Sequence[Expression],
        roots: frozenset[Expression],
        calls: Mapping[Expression, Call[Kernel]],
        graph: Graph,
    ) -> tuple[Values, dict[Expression, Layout], int]:
        """Return the values and layouts of the named results over shared scalars, and the number of parts."""
        inputs = self._search.inputs(graph)
        values: Values = {}
        layouts: dict[Expression, Layout] = {}
        n = 0
        todo = list(reversed(expressions))
        while todo:
            each = todo[-1]
            if each in values:
                todo.pop()
                continue
            call = calls.get(each)
            leaves = list(call.arguments) if call else leaves_of(each, roots)
            waiting = [leaf for leaf in leaves if leaf not in values]
            if each.operation in _LEAVES:
                values[each] = apply_operation(each, [], inputs, graph.lift)
                layouts[each] = each.data.layout if each.operation is Operation.INPUT else _layout_of_constant(each)
            elif waiting:
                todo += reversed(waiting)
                continue
            elif call is None and _is_direct(each, {leaf: layouts[leaf] for leaf in leaves}):
                found = {leaf: values[leaf] for leaf in leaves}
                for node in topological([each], found):
                    found[node] = apply_operation(node, [found[a] for a in node.arguments], inputs, graph.lift)
                values[each] = found[each]
                layouts[each] = layout_of_value(each, found[each], {leaf: layouts[leaf] for leaf in leaves})
            elif call is not None:
                part = part_of_call(call.kernel, self._optimise)
                parameters = [
                    p.layout for p in call.kernel.parameters for _ in range(len(p.components) // p.layout.size)
                ]
                self._apply(part, call.results, list(zip(leaves, parameters, strict=True)), values, layouts, graph)
                n += 1
            else:
                part = part_of_expression(each, {leaf: layouts[leaf] for leaf in leaves}, self._optimise)
                given = [(leaf, layouts[leaf]) for leaf in leaves if layouts[leaf].stored]
                self._apply(part, (each,), given, values, layouts, graph)
                n += 1
        return values, layouts, n

    def _apply(
        self,
        part: Part,
        results: Sequence[Expression],
        arguments: Sequence[tuple[Expression, Layout]],
        values: Values,
        layouts: dict[Expression, Layout],
        graph: Graph,
    ) -> None:
        numbers: list[Scalar] = []
        for leaf, layout in arguments:
            if not fits(layouts[leaf], layout):
                raise LayoutError(str(leaf), f"an element of {layouts[leaf]}", f"one of {layout}")
            numbers += map(graph.lift, stored(layout, values[leaf]))
        for result, value, layout in zip(results, part.values(numbers, graph), part.layouts, strict=True):
            if result not in values:
                values[result], layouts[result] = value, layout


def _is_direct(expression: Expression, leaves: Mapping[Expression, Layout]) -> bool:
    """Return whether a part is evaluated without a search: a function, or one sum or product that is not large.

    Products of elements with implied coefficients are searched: those of points of CGA are cheaper in differences.
    """
    if not leaves or _is_function(expression):
        return True
    if any(layout.implied for layout in leaves.values()):
        return False
    heavy = [each for each in topological([expression], leaves) if each.operation not in PLAIN]
    sums = any(each.operation in _SUMS for each in topological([expression], leaves))
    if len(heavy) + sums > 1 or any(each.operation not in _DIRECT for each in heavy):
        return False
    a, b = heavy[0].arguments if heavy else (expression, expression)
    return not heavy or (a != b and len(a.blades) * len(b.blades) < SMALLEST)


def _layout_of_constant(expression: Expression) -> Layout:
    """Return the layout whose only element is a constant."""
    algebra, terms = expression.algebra, expression.data.terms
    fixed = {name: sign * value for blade, value in terms.items() for sign, name in [algebra.spelling(blade)]}
    return algebra.layout("constant", "", fixed=fixed)


_SUMS = (Operation.ADD, Operation.SUBTRACT)
_DIRECT = (*PRODUCTS, Operation.DIVIDE)
_LEAVES = (Operation.INPUT, Operation.CONSTANT)
_AS_WRITTEN = "as written"


def _is_function(expression: Expression) -> bool:
    """Return whether an expression is a function of scalars, which has a single form."""
    return expression.operation.row.kind is Kind.SCALAR


def named_results(expressions: Sequence[Expression]) -> frozenset[Expression]:
    """Return the results of operations that are named before parts are merged."""
    functions = (each for each in topological(expressions) if _is_function(each))
    return frozenset((*stages(expressions), *expressions, *functions))


def composable(variants: Mapping[str, tuple[Expression, ...]]) -> dict[str, tuple[Expression, ...]]:
    """Return the forms to compose: those in which sandwiches are not expanded, since parts choose their own form."""
    return {name: each for name, each in variants.items() if name not in EXPANDED}
