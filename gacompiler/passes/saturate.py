"""Rewriting to saturation: all rules are applied to all equal forms of all subexpressions until nothing new appears.

Equal expressions form a class, and an expression stands for all expressions that have equal arguments (an e-graph:
Willsey et al., egg, POPL 2021). The forms of an expression are extracted by the cost of their operations, where common
subexpressions count once. Results do not depend on the order of the rules: a round applies every rule to the same
forms, and ties are decided by the structure of the forms.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import islice, product

from ..algebra.layout import SCALAR, SCALARS, Layout
from ..algebra.multivector import Multivector
from ..algebra.operations import PRODUCTS, Operation
from ..errors import GacError
from ..frontend.expression import Expression, evaluate, topological
from ..frontend.facts import is_unit, is_unit_even_versor
from ..ir.scalar import Graph, Op, Scalar
from .decide import layout_of
from .parts import canonical, unit
from .parts_of_products import name_determinant
from .rules import RULES, Rule
from .sandwich_differences import reflection_as_difference, sandwich_as_difference

LARGEST = 40
"""Expressions with more operations than this are not rewritten."""
FORMS = 6
"""Maximum number of forms of a class, the cheapest ones."""
CHOICES = 12
"""Maximum number of combinations of forms of the arguments of one form."""
ROUNDS = 6
"""Maximum number of rounds."""
MOST = 1_000
"""Number of expressions in all classes after which no further round begins."""
GROWTH = 3
"""Forms that cost more than this multiple of the cheapest form of their class are not kept."""


def saturate(expressions: tuple[Expression, ...], rules: Sequence[Rule] = RULES) -> tuple[Expression, ...]:
    """Return the cheapest equivalent forms of expressions, or the expressions themselves if they are too large."""
    order = topological(expressions)
    if sum(bool(each.arguments) for each in order) > LARGEST or not any(map(_is_interesting, order)):
        return expressions
    classes = _Classes()
    for each in order:
        classes.add(each)
    for _ in range(ROUNDS):
        if not classes.apply(rules) or classes.size > MOST:
            break
    best = map(classes.best, expressions)
    return tuple(a if a != b and cost_of(a) < cost_of(b) else b for a, b in zip(best, expressions, strict=True))


def _is_interesting(expression: Expression) -> bool:
    """Return whether rules can apply.

    They concern products of multivectors with common factors, sandwiches, and determinants of inner products.
    """
    if expression.operation is Operation.SUBTRACT:
        return name_determinant(expression) is not None
    return expression.operation in (Operation.SANDWICH, Operation.REGRESSIVE_PRODUCT, Operation.OUTER_PRODUCT) or (
        expression.operation is Operation.GEOMETRIC_PRODUCT and not any(a.is_scalar for a in expression.arguments)
    )


class _Classes:
    """Classes of equal expressions: a forest of merged classes, and the forms of each class."""

    def __init__(self) -> None:
        self._class: dict[Expression, int] = {}
        self._parent: list[int] = []
        self._forms: list[dict[Expression, None]] = []
        self._done: set[Expression] = set()

    @property
    def size(self) -> int:
        """The number of expressions in all classes."""
        return len(self._class)

    def add(self, expression: Expression) -> int:
        """Return the class of an expression, which is added with its subexpressions."""
        for each in topological([expression], self._class):
            self._class[each] = len(self._parent)
            self._parent.append(len(self._parent))
            self._forms.append({each: None})
        return self._find(self._class[expression])

    def best(self, expression: Expression) -> Expression:
        """Return the cheapest form of an expression."""
        return self._sorted(self._find(self._class[expression]))[0]

    def apply(self, rules: Sequence[Rule]) -> bool:
        """Apply all rules once to all forms. Return whether there are new forms."""
        found: list[tuple[Expression, Expression]] = []
        for root in [k for k in range(len(self._parent)) if self._find(k) == k]:
            for form in list(self._forms[root]):
                for each in self._variants(form):
                    if each not in self._done:
                        self._done.add(each)
                        found.append((form, each))
                        found += ((form, new) for rule in rules if (new := _applied(rule, each)) is not None)
        before = {form for forms in self._forms for form in forms}
        for old, new in found:
            self._merge(self.add(old), self.add(new))
        for root in [k for k in range(len(self._parent)) if self._find(k) == k]:
            kept = self._sorted(root)
            if len(kept) > 1:
                least = cost_of(kept[0])
                self._forms[root] = dict.fromkeys(form for form in kept[:FORMS] if cost_of(form) <= GROWTH * least)
        return any(form not in before for forms in self._forms for form in forms)

    def _variants(self, form: Expression) -> list[Expression]:
        """Return an expression with all combinations of forms of its arguments.

        An argument that is a number has only forms that are numbers: operations on numbers know no other algebra.
        """
        if not form.arguments:
            return [form]
        choices = [
            [each for each in self._sorted(self._find(self._class[given])) if each.algebra in (given.algebra, SCALARS)]
            for given in form.arguments
        ]
        found = islice(product(*choices), CHOICES)
        made = [Expression(form.operation, arguments, form.data, form.algebra) for arguments in found]
        return list(dict.fromkeys([form, *made]))

    def _sorted(self, root: int) -> list[Expression]:
        """Return the forms of a class by cost, which is not measured for a single form."""
        forms = list(self._forms[root])
        return sorted(forms, key=lambda form: (cost_of(form), _structure(form))) if len(forms) > 1 else forms

    def _find(self, k: int) -> int:
        while self._parent[k] != k:
            self._parent[k] = self._parent[self._parent[k]]
            k = self._parent[k]
        return k

    def _merge(self, a: int, b: int) -> None:
        a, b = sorted((self._find(a), self._find(b)))
        if a != b:
            self._parent[b] = a
            self._forms[a].update(self._forms[b])
            self._forms[b] = {}


def _applied(rule: Rule, expression: Expression) -> Expression | None:
    try:
        return rule(expression)
    except GacError:
        return None


KEPT = 8_192
"""Number of expressions whose cost or structure is kept in memory: several times as many as one kernel has."""


@lru_cache(maxsize=KEPT)
def cost_of(expression: Expression) -> int:
    """Return the number of scalar operations of an expression, computed one operation after the other."""
    order = [each for each in topological([expression]) if each.arguments]
    selected = {each.arguments[0] for each in order if _selects(each)}
    return sum(_cost_of_operation(each) for each in order if each not in selected)


@lru_cache(maxsize=KEPT)
def _cost_of_operation(expression: Expression) -> int:
    """Return the number of scalar operations of one operation on arguments with these blades and relations."""
    arguments = expression.arguments[0].arguments if _selects(expression) else expression.arguments
    leaves = {each: _layout(each) for each in arguments if each.operation is not Operation.CONSTANT}
    return _cost_over_parameters(canonical(expression, leaves)[0])


@lru_cache(maxsize=KEPT)
def _cost_over_parameters(single: Expression) -> int:
    """Return the number of scalar operations of one operation over parameters with canonical names."""
    forms = [single]
    forms += [f for f in (sandwich_as_difference(single), reflection_as_difference(single)) if f is not None]
    return min(map(_count, forms))


def _selects(expression: Expression) -> bool:
    """Return whether this is the part of some grades of a product, of which only that part is computed."""
    return expression.operation is Operation.GRADE and expression.arguments[0].operation in PRODUCTS


def _layout(expression: Expression) -> Layout:
    if expression.operation is Operation.INPUT:
        layout: Layout = expression.data.layout
        return layout
    if expression.algebra == SCALARS:
        return SCALAR
    blades = set(expression.blades)
    if expression.operation is Operation.SANDWICH and is_unit_even_versor(expression.arguments[0]):
        grades = {blade.bit_count() for blade in expression.arguments[1].blades}
        blades = {blade for blade in blades if blade.bit_count() in grades}
    found = layout_of(expression.algebra, blades, {})
    return unit(found) if is_unit(expression) else found


def _count(expression: Expression) -> int:
    graph = Graph()
    inputs = {
        name: graph.variable(name)
        for each in topological([expression])
        if each.operation is Operation.INPUT
        for name in each.data.components
    }
    (value,) = evaluate([expression], inputs, lift=graph.lift)
    return _operations(value)


def _operations(value: Multivector) -> int:
    seen: set[Scalar] = set()
    todo = [each for each in value.terms.values() if isinstance(each, Scalar)]
    while todo:
        each = todo.pop()
        if each not in seen:
            seen.add(each)
            todo += each.arguments
    return sum(each.op not in (Op.CONSTANT, Op.VARIABLE, Op.NEGATE) for each in seen)


@lru_cache(maxsize=KEPT)
def _structure(expression: Expression) -> tuple[object, ...]:
    """Return a key that is equal for equal expressions only, and does not depend on the process."""
    order = topological([expression])
    places = {each: k for k, each in enumerate(order)}
    rows = ((each.operation.value, tuple(places[a] for a in each.arguments), _data(each)) for each in order)
    return (len(order), *rows)


def _data(expression: Expression) -> str:
    return expression.data.name if expression.operation is Operation.INPUT else str(expression.data)
