"""Search for candidate programs that compute the same numbers, of which the cheapest is selected.

There are the following families of candidates:

- the structure of every form of the expression, starting with the author's own, directly and with large products
  computed by matrices;
- for every form, factorised polynomials for several choices of named intermediate results, with and without reduction
  modulo the relations, and in terms of differences of inputs if possible;
- the cheapest of these with a single division for each divisor.

The order of candidates is deterministic. The first of the cheapest candidates is selected. All methods share the limits
of one search, so they are in one file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import chain, combinations, islice

from ..algebra.multivector import Multivector
from ..algebra.operations import Operation
from ..errors import TooLargeError
from ..frontend.expression import Expression, topological
from ..frontend.kernel import Kernel
from ..ir.cost import cost
from ..ir.program import Argument
from ..ir.scalar import Graph, Scalar
from ..rings.polynomial import total_terms
from .accuracy import Gate
from .candidate import Candidate
from .divide import cancel_numbers, divide_once
from .effort import DEFAULT, LEVELS, Effort
from .factor import Policy
from .forms import Form, Steps, forms_as_products, forms_of, further_forms
from .interruption import is_interrupted, progress
from .lower import Lowering, Reduction, Slot, pick, scalars_of, stages
from .matrices import evaluate_by_matrices, has_huge_product, plan_choices
from .schedule import schedule
from .share import Builder
from .squares import square_of
from .system import System

SMALL = 60
"""Polynomials with up to this number of terms are always expanded, regardless of the best cost."""
POLICIES = (
    Policy(split_numbers=True, long_sums_first=True),
    Policy(prefer_products=True, split_numbers=True, long_sums_first=True),
    Policy(),
    Policy(prefer_products=True),
    Policy(prefer_products=True, split_numbers=True),
)
LONG = 150
"""Definitions with more operations than this are long: the number of their forms is limited by their total length."""
DIVIDED = 3
"""Number of cheapest candidates for which fewer divisions are tried."""
_ROOTS = (Operation.SQRT, Operation.NORM, Operation.NORMALIZE, Operation.ACOS, Operation.LOG)
Method = tuple[Reduction, bool, bool]
"""A lowering method: the reduction, whether implied coefficients are named, and whether squares are used."""


Tried = tuple[Form, Candidate]
"""A system and its program by one policy."""
ResultShape = tuple[str, tuple[int, ...], tuple[Slot, ...]]


class Search:
    """The search for candidates for one kernel.

    Parameters
    ----------
    kernel : Kernel
    variants : mapping
        Result expressions by the name of the rewriting.
    results : sequence of (name, shape, slots)
    effort : Effort
        The limits of the search.
    author : tuple of Graph and list of Multivector, optional
        The first form over shared scalar expressions, if it is known.
    """

    def __init__(
        self,
        kernel: Kernel,
        variants: Mapping[str, tuple[Expression, ...]],
        results: Sequence[ResultShape],
        effort: Effort = LEVELS[DEFAULT],
        author: tuple[Graph, list[Multivector]] | None = None,
    ) -> None:
        self._effort = effort
        self._author = author
        self._kernel = kernel
        self._variants = variants
        self.results = tuple(results)
        self._slots = tuple(slot for _, _, slots in results for slot in slots)
        self._budget = SMALL
        self._too_large = self._left = 0
        self._lines = self._skipped = 0
        self._factorised: dict[object, Candidate] = {}
        self._final: dict[object, Candidate] = {}
        self._compared: list[tuple[Steps, System]] = []
        self._seen: set[tuple[object, ...]] = set()
        self._least: int | None = None
        self._is_long = len(topological(next(iter(variants.values())))) > LONG
        self._has_implied = any(parameter.layout.implied for parameter in kernel.parameters)
        self._first: Candidate | None = None
        self._arguments = tuple(Argument(p.name, p.shape, p.components) for p in kernel.parameters)

    @cached_property
    def gate(self) -> Gate:
        """The accuracy criterion, by the author's structure."""
        assert self._first is not None
        return Gate(self._kernel, self._first.program)

    def is_accurate(self, candidate: Candidate) -> bool:
        """Return whether the error of a candidate is accepted."""
        return candidate.is_accurate(self.gate)

    def author(self) -> Candidate:
        """Return the author's structure with shared subexpressions; huge products are computed by matrices."""
        name, expressions = next(iter(self._variants.items()))
        if has_huge_product(expressions):
            return next(self._by_matrices())
        return self.candidate((name,), self._direct(expressions))

    def candidates(self) -> list[Candidate]:
        """Return the candidates of the first two families, in order."""
        direct: dict[str, Candidate] = {}
        by_matrices: list[Candidate] = []
        for name, variant in self._variants.items():
            if self._is_long and direct and not by_matrices:
                by_matrices += self._by_matrices()  # They save most in long scripts, so they are built early.
            if not has_huge_product(variant) and (not direct or self._has_lines_left()):
                direct[name] = self.candidate((name,), self._direct(variant))
        found = [*direct.values(), *(by_matrices or self._by_matrices())]
        self._first = found[0]
        least = min(candidate.cost.total for candidate in found)
        self._budget = min(max(self._effort.hopeless * least, SMALL), self._effort.largest)
        names = sorted(direct, key=lambda name: direct[name].cost.total)
        tried = self._compare(self._systems(names), least)
        others = self._compare(self._systems_of_scalars(names), least)
        others += self._compare(self._further_forms(tried + others), least)
        found += [candidate for _, candidate in tried + others]
        found += self._refine(tried)
        least = min(candidate.cost.total for candidate in found)
        return found + self._refine([each for each in others if each[1].cost.total <= least])

    def _compare(self, forms: Iterable[Form], least: int) -> list[Tried]:
        """Factorise systems by one policy, as long as there is effort left and they can compete with the best."""
        tried: list[Tried] = []
        systems = sorted(forms, key=lambda form: _effort(form.system))
        effort = 0
        for k, form in enumerate(systems):
            effort += _effort(form.system)
            limit = self._effort.first if self._compared else 2 * self._effort.first
            hopeless = self._compared and _size(form.system) > self._effort.hopeless * least
            if effort > limit or hopeless or is_interrupted():
                self._left += len(systems) - k
                break
            candidate = self._factorise(form.steps, form.system, Policy(split_numbers=True))
            tried.append((form, candidate))
            self._compared.append((form.steps, form.system))
            least = min(least, candidate.cost.total)
        return tried

    def _further_forms(self, tried: Sequence[Tried]) -> list[Form]:
        """Return forms of the best systems with other differences, without common numbers and as products.

        The best systems include inaccurate ones, which differences may make accurate. A polynomial that is a product
        can become cheaper by any amount, so all systems are searched for products.
        """
        n, ordered = self._effort.refined, _by_cost(tried)
        ranked = [*ordered[:n], *self._accurate_ones(ordered, n, ordered[:n])]
        best = list(dict.fromkeys(form for form, _ in ranked))
        further = chain.from_iterable(map(further_forms, best))
        products = chain.from_iterable(forms_as_products(form) for form, _ in tried if form not in best)
        return list(filter(self._is_new, chain(further, products)))

    def _accurate_ones(self, ordered: Sequence[Tried], n: int, known: Sequence[Tried]) -> list[Tried]:
        """Return those of the first `n` accurate candidates that are not known; errors are measured only for these."""
        if all(each in known for each in ordered):
            return []
        return [each for each in islice((x for x in ordered if self.is_accurate(x[1])), n) if each not in known]

    def _is_new(self, form: Form) -> bool:
        """Return whether a system is small enough to compete with the best so far, and differs from those before."""
        key = form.system.key
        if key in self._seen or _size(form.system) > self._budget:
            return False
        self._seen.add(key)
        return True

    def _refine(self, tried: Sequence[Tried]) -> list[Candidate]:
        """Factorise the best systems by all policies."""
        n, ordered = self._effort.refined - 1, _by_cost(tried)
        best = ordered[:n]
        names = {form.steps[0] for form, _ in best}
        best += [each for each in ordered if each[0].steps[0] not in names][:1]
        # Of systems that cost the same, some forms can be refined further than others.
        kinds = {_form_of(form.steps) for form, _ in best}
        others = [each for each in ordered if _form_of(each[0].steps) not in kinds]
        best += [each for each in others if each[1].cost.total == ordered[0][1].cost.total][:1]
        best += self._accurate_ones(ordered, n, best)
        found: list[Candidate] = []
        effort = 0
        for form, _ in best:
            for policy in POLICIES:
                effort += _effort(form.system)
                if effort <= self._effort.more and not is_interrupted():
                    found.append(self._factorise(form.steps, form.system, policy))
        return found

    def divided_once(self, found: Sequence[Candidate]) -> list[Candidate]:
        """Return the cheapest candidates with a single division for each divisor, and without common numbers."""
        cheapest = sorted(found, key=lambda candidate: candidate.cost.total)[: DIVIDED if self._has_lines_left() else 1]
        return [
            self.candidate((*candidate.steps, step), scalars)
            for candidate in cheapest
            for step, change in (("dividing once", divide_once), ("numbers cancelled", cancel_numbers))
            if (scalars := change(candidate.program))
        ]

    def factorised_by(self, policies: Sequence[Policy]) -> list[Candidate]:
        """Return the systems that `candidates` compared, factorised by other policies."""
        return [
            self._factorise(steps, system, policy)
            for steps, system in self._compared
            for policy in policies
            if not is_interrupted()
        ]

    @property
    def limits(self) -> tuple[str, ...]:
        """Human-readable descriptions of the limits that the search reached."""
        texts = (
            (self._too_large, "choices of named results were too large to be expanded"),
            (self._skipped, "forms were not built, because their programs are long"),
            (self._left, "systems of polynomials were too large to be factorised"),
        )
        return tuple(f"{count} {text}; cheaper forms may exist" for count, text in texts if count)

    def candidate(self, steps: Steps, scalars: Sequence[Scalar]) -> Candidate:
        """Return the program that computes the results by `scalars`, in the order of the slots."""
        todo = iter(scalars)
        results = tuple((name, shape, tuple(next(todo) for _ in slots)) for name, shape, slots in self.results)
        program = schedule(self._kernel.name, self._arguments, results)
        self._lines += len(program.lines)
        candidate = Candidate(steps, program, cost(program))
        if self._least is None or candidate.cost.total < self._least:
            self._least = candidate.cost.total
            progress(f"{self._kernel.name}: {candidate.cost}")
        return candidate

    def _has_lines_left(self) -> bool:
        """Return whether one more form of a long script may be built, and count it otherwise."""
        left = not self._is_long or (self._lines < self._effort.lines and not is_interrupted())
        self._skipped += not left
        return left

    def _direct(self, expressions: Sequence[Expression]) -> tuple[Scalar, ...]:
        known = self._author if expressions == next(iter(self._variants.values())) else None
        graph, values = known or scalars_of(self._kernel, expressions)
        return pick(values, self._slots, graph)

    def _by_matrices(self) -> Iterator[Candidate]:
        """Yield the author's structure with its large products computed by matrices, for all plans and depths."""
        name = "sandwiches recognised" if "sandwiches recognised" in self._variants else next(iter(self._variants))
        expressions = self._variants[name]
        for choice in plan_choices(expressions):
            if not self._has_lines_left():
                return
            graph = Graph()
            values, how = evaluate_by_matrices(expressions, self.inputs(graph), graph.lift, choice)
            yield self.candidate((name, how), pick(values, self._slots, graph))

    def inputs(self, graph: Graph) -> dict[str, Scalar]:
        """Return the entries of the arguments as variables of a graph."""
        return {name: graph.variable(name) for parameter in self._kernel.parameters for name in parameter.components}

    def _factorise(self, steps: Steps, system: System, policy: Policy) -> Candidate:
        choices = tuple(name for name in Policy.__slots__ if getattr(policy, name))
        choices = choices if policy.expanded else ("factorised", *choices)
        key = system.key, policy if _has_common_numbers(system) else replace(policy, split_numbers=False)
        known = self._factorised.get(key) or (None if policy.fused else self._final.get(system.key))
        if known:
            return Candidate((*steps, *choices), known.program, known.cost)
        builder = Builder(system, policy)
        found = self._factorised[key] = self.candidate((*steps, *choices), builder.outputs())
        if builder.factored.is_final:
            self._final[system.key] = found
        return found

    def _systems(self, names: Sequence[str]) -> Iterator[Form]:
        """Yield the systems of all choices of named results and all lowering methods, simplest rewriting first."""
        left, most = self._effort.all_lowering, self._effort.lowering
        for name in names:
            expressions = self._variants[name]
            methods = self._methods(expressions)
            too_large: list[tuple[Method, frozenset[Expression]]] = []
            irreducible: set[tuple[frozenset[Expression], bool]] = set()
            for cuts in _choices_of_stages(stages(expressions), self._effort.stages):
                for method in methods:
                    reduction, name_implied, _ = method
                    if reduction is not Reduction.NORMAL and (cuts, name_implied) in irreducible:
                        continue
                    if any(method == other and cuts < more for other, more in too_large):
                        continue
                    if left < 0 or is_interrupted():
                        self._too_large += 1
                        continue
                    try:
                        lowering = Lowering(self._kernel, expressions, cuts, reduction, self._budget, most, *method[1:])
                        system = lowering.system(self._slots)
                    except TooLargeError:
                        self._too_large += 1
                        too_large.append((method, cuts))
                        left -= most
                        continue
                    left -= lowering.pairs
                    if not lowering.relations.known:
                        irreducible.add((cuts, name_implied))
                    if not _has_effect(method, lowering) or _size(system) > self._budget:
                        continue
                    steps = (name, f"{len(cuts)} stages", *_steps_of(method, lowering))
                    yield from filter(self._is_new, forms_of(steps, system))

    def _systems_of_scalars(self, names: Sequence[str]) -> Iterator[Form]:
        """Yield the systems in which polynomials of scalars are expanded, to be factorised as a whole.

        Named are the multivectors and the scalars computed from them. Polynomials are not reduced, since a Groebner
        basis for expanded ones may take any time. An expanded sum of squares can be negative by rounding, so that there
        are no such systems for kernels with roots.
        """
        left, most = self._effort.all_lowering, self._effort.lowering
        for name in names:
            expressions = self._variants[name]
            found = stages(expressions)
            ends = frozenset(e for e in found if not e.is_scalar or not all(a.is_scalar for a in e.arguments))
            has_root = any(each.operation in _ROOTS for each in topological(expressions))
            if has_root or ends in _choices_of_stages(found, self._effort.stages):
                continue
            for name_implied in (False, True) if self._has_implied else (False,):
                if left < 0 or is_interrupted():
                    self._too_large += 1
                    continue
                limits = self._budget, most
                try:
                    lowering = Lowering(self._kernel, expressions, ends, Reduction.NONE, *limits, name_implied)
                    system = lowering.system(self._slots)
                except TooLargeError:
                    self._too_large += 1
                    left -= most
                    continue
                left -= lowering.pairs
                if _size(system) <= self._budget:
                    steps = (name, f"{len(ends)} stages", *(("implied named",) if name_implied else ()))
                    yield from filter(self._is_new, forms_of(steps, system))

    def _methods(self, expressions: Sequence[Expression]) -> list[Method]:
        """Return the lowering methods: all reductions, with and without named implied coefficients and squares."""
        named = (False, True) if self._has_implied else (False,)
        found = [(reduction, name_implied, False) for reduction in Reduction for name_implied in named]
        if any(
            e.operation is not Operation.INPUT and not e.is_scalar and square_of(e) is not None
            for e in topological(expressions)
        ):
            found[len(named) : len(named)] = [(Reduction.NORMAL, name_implied, True) for name_implied in named]
        return found


def _has_effect(method: Method, lowering: Lowering) -> bool:
    """Return whether a lowering method differs from those tried before."""
    reduction, _, by_squares = method
    return lowering.has_solved if by_squares else reduction is Reduction.NORMAL or lowering.relations.known


def _steps_of(method: Method, lowering: Lowering) -> Steps:
    reduction, name_implied, by_squares = method
    chosen = ((lowering.relations.known, reduction.value), (name_implied, "implied named"), (by_squares, "by squares"))
    return tuple(step for is_done, step in chosen if is_done)


def _has_common_numbers(system: System) -> bool:
    """Return whether some terms of a sum have the same numeric factor, so that `Policy.split_numbers` has an effect."""
    for polynomial in system.polynomials:
        sizes = [abs(value) for value in polynomial.terms.values() if abs(value) != 1]
        if len(set(sizes)) < len(sizes):
            return True
    return False


def _by_cost(tried: Sequence[Tried]) -> list[Tried]:
    return sorted(tried, key=lambda each: each[1].cost.total)


def _size(system: System) -> int:
    return total_terms(system.polynomials)


def _form_of(steps: Steps) -> Steps:
    """Return the steps without the number of stages."""
    return steps[:1] + steps[2:]


def _effort(system: System) -> int:
    return sum(len(polynomial.terms) ** 2 for polynomial in system.polynomials)


def _choices_of_stages(found: list[Expression], limit: int) -> list[frozenset[Expression]]:
    """Return sets of named results. Large sets come first, because their systems are small.

    Up to `limit` stages, these are all subsets. For up to six stages, they are the sets of all, all but one, single and
    no stages, and for more, only the set of all stages.
    """
    if len(found) <= limit:
        sizes: Iterable[int] = range(len(found), -1, -1)
    else:
        sizes = (len(found), len(found) - 1, 1, 0) if len(found) <= 6 else (len(found),)
    return [frozenset(chosen) for size in sizes for chosen in combinations(found, size)]
