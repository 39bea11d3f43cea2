"""Search for candidate programs that compute the same numbers, of which the cheapest is selected.

There are the following families of candidates:

- the structure of every form of the expression, starting with the author's own, directly and with large products
  computed by matrices;
- for every form, factorised polynomials for several choices of named intermediate results, with and without reduction
  modulo the relations, and in terms of differences of inputs if possible;
- the cheapest of these with a single division for each divisor.

The order of candidates is deterministic. The first of the cheapest candidates is selected.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from ..algebra.operations import Operation
from ..errors import TooLargeError
from ..frontend.expression import Expression, evaluate, topological
from ..frontend.kernel import Kernel
from ..ir.cost import Cost, cost
from ..ir.program import Argument, Program
from ..ir.scalar import Graph, Scalar
from ..rings.polynomial import Polynomial, total_terms
from .divide import divide_once
from .factor import Policy
from .lower import Lowering, Reduction, Slot, pick, stages
from .matrices import evaluate_by_matrices, has_huge_product, plan_choices
from .resubstitute import resubstitute
from .schedule import schedule
from .share import share
from .shift import shift
from .squares import square_of
from .system import System

SMALL = 60
"""Polynomials with up to this number of terms are always expanded, regardless of the best cost."""
LARGEST = 1_500
"""Polynomials with more terms than this are never expanded for factorisation."""
HOPELESS = 3
"""Systems with more terms than this multiple of the best cost so far are not factorised. They are unlikely to become
cheapest, and the time grows with the square of the number of terms of a sum."""
FIRST_EFFORT, MORE_EFFORT = 14_000, 8_000
"""Maximum number of pairs of terms for comparing systems, and for refining the best systems under `POLICIES`."""
LOWERING = 10_000
"""Maximum number of pairs of terms that are multiplied to expand one choice of named results. The best choices of all
known kernels require at most 2 200."""
ALL_LOWERING = 300_000
"""Maximum total number of pairs of terms that are multiplied. The best choices of all known kernels are found within
this limit."""
POLICIES = (
    Policy(split_numbers=True, long_sums_first=True),
    Policy(prefer_products=True, split_numbers=True, long_sums_first=True),
    Policy(),
    Policy(prefer_products=True),
    Policy(prefer_products=True, split_numbers=True),
)
DIVIDED = 3
"""Number of cheapest candidates for which fewer divisions are tried."""
STAGE_LIMIT = 3
"""Up to this number of stages, all subsets are tried. For up to six stages, the sets of all, all but one, single and no
stages are tried, and for more, only the set of all stages. Large sets come first, because their systems are small."""


Steps = tuple[str, ...]
Method = tuple[Reduction, bool, bool]
"""A lowering method: the reduction, whether implied coefficients are named, and whether squares are used."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A candidate program for a kernel.

    Attributes
    ----------
    steps : tuple of str
        The transformations that were applied, starting with the rewriting.
    program : Program
    cost : Cost
    """

    steps: tuple[str, ...]
    program: Program
    cost: Cost

    @property
    def origin(self) -> str:
        """The steps in one line."""
        return ", ".join(self.steps)


ResultShape = tuple[str, tuple[int, ...], tuple[Slot, ...]]


class Search:
    """The search for candidates for one kernel.

    Parameters
    ----------
    kernel : Kernel
    variants : mapping
        Result expressions by the name of the rewriting.
    results : sequence of (name, shape, slots)
    """

    def __init__(
        self, kernel: Kernel, variants: Mapping[str, tuple[Expression, ...]], results: Sequence[ResultShape]
    ) -> None:
        self._kernel = kernel
        self._variants = variants
        self._results = tuple(results)
        self._slots = tuple(slot for _, _, slots in results for slot in slots)
        self._budget = SMALL
        self._too_large = self._left = 0
        self._has_implied = any(parameter.layout.implied for parameter in kernel.parameters)
        self._arguments = tuple(Argument(p.name, p.shape, p.components) for p in kernel.parameters)

    def candidates(self) -> list[Candidate]:
        """Return all candidates in order."""
        direct = {
            name: self._candidate((name,), self._direct(variant))
            for name, variant in self._variants.items()
            if not has_huge_product(variant)
        }
        found = [*direct.values(), *self._by_matrices()]
        least = min(candidate.cost.total for candidate in found)
        self._budget = min(max(HOPELESS * least, SMALL), LARGEST)
        first: list[tuple[Steps, System, Candidate]] = []
        names = sorted(direct, key=lambda name: direct[name].cost.total)
        effort = 0
        systems = sorted(self._systems(names), key=lambda pair: _effort(pair[1]))
        for k, (steps, system) in enumerate(systems):
            effort += _effort(system)
            if effort > (FIRST_EFFORT if first else 2 * FIRST_EFFORT) or (first and _size(system) > HOPELESS * least):
                self._left = len(systems) - k
                break
            candidate = self._factorise(steps, system, Policy(split_numbers=True))
            first.append((steps, system, candidate))
            least = min(least, candidate.cost.total)
        found += [candidate for _, _, candidate in first]
        ranked = sorted(range(len(first)), key=lambda k: (first[k][2].cost.total, k))
        best = ranked[:2]
        tried = {first[k][0][0] for k in best}
        best += [k for k in ranked if first[k][0][0] not in tried][:1]
        effort = 0
        for k in best:
            steps, system, _ = first[k]
            for policy in POLICIES:
                effort += _effort(system)
                if effort <= MORE_EFFORT:
                    found.append(self._factorise(steps, system, policy))
        cheapest = sorted(found, key=lambda candidate: candidate.cost.total)[:DIVIDED]
        divided = ((candidate.steps, divide_once(candidate.program)) for candidate in cheapest)
        return [*found, *(self._candidate((*steps, "dividing once"), each) for steps, each in divided if each)]

    @property
    def limits(self) -> tuple[str, ...]:
        """Human-readable descriptions of the limits that the search reached."""
        texts = (
            (self._too_large, "choices of named results were too large to be expanded"),
            (self._left, "systems of polynomials were too large to be factorised"),
        )
        return tuple(f"{count} {text}; cheaper forms may exist" for count, text in texts if count)

    def _candidate(self, steps: Steps, scalars: Sequence[Scalar]) -> Candidate:
        todo = iter(scalars)
        results = tuple((name, shape, tuple(next(todo) for _ in slots)) for name, shape, slots in self._results)
        program = schedule(self._kernel.name, self._arguments, results)
        return Candidate(steps, program, cost(program))

    def _direct(self, expressions: Sequence[Expression]) -> tuple[Scalar, ...]:
        graph = Graph()
        return pick(evaluate(expressions, self._inputs(graph), lift=graph.lift), self._slots, graph)

    def _by_matrices(self) -> Iterator[Candidate]:
        """Yield the author's structure with its large products computed by matrices, for all plans and depths."""
        name = "sandwiches recognised" if "sandwiches recognised" in self._variants else next(iter(self._variants))
        expressions = self._variants[name]
        for choice in plan_choices(expressions):
            graph = Graph()
            values, how = evaluate_by_matrices(expressions, self._inputs(graph), graph.lift, choice)
            yield self._candidate((name, how), pick(values, self._slots, graph))

    def _inputs(self, graph: Graph) -> dict[str, Scalar]:
        return {name: graph.variable(name) for parameter in self._kernel.parameters for name in parameter.components}

    def _factorise(self, steps: Steps, system: System, policy: Policy) -> Candidate:
        choices = [name for name in Policy.__slots__ if getattr(policy, name)]
        return self._candidate((*steps, "factorised", *choices), share(system, policy))

    def _systems(self, names: Sequence[str]) -> Iterator[tuple[Steps, System]]:
        """Yield distinct systems that are small enough to compete with the best so far, simplest rewriting first."""
        seen: set[tuple[object, ...]] = set()
        left = ALL_LOWERING
        for name in names:
            expressions = self._variants[name]
            methods = self._methods(expressions)
            too_large: list[tuple[Method, frozenset[Expression]]] = []
            for cuts in _choices_of_stages(stages(expressions)):
                for method in methods:
                    if any(method == other and cuts < more for other, more in too_large):
                        continue
                    if left < 0:
                        self._too_large += 1
                        continue
                    try:
                        reduction, *options = method
                        lowering = Lowering(
                            self._kernel, expressions, cuts, reduction, self._budget, LOWERING, *options
                        )
                        system = lowering.system(self._slots)
                    except TooLargeError:
                        self._too_large += 1
                        too_large.append((method, cuts))
                        left -= LOWERING
                        continue
                    left -= LOWERING - lowering.ring.effort
                    if not _has_effect(method, lowering) or _size(system) > self._budget:
                        continue
                    steps = (name, f"{len(cuts)} stages", *_steps_of(method, lowering))
                    for form, each in _forms(system):
                        if _size(each) <= self._budget and each.key not in seen:
                            seen.add(each.key)
                            yield (*steps, *form), each

    def _methods(self, expressions: Sequence[Expression]) -> list[Method]:
        """Return the lowering methods: all reductions, with and without named implied coefficients and squares."""
        named = (False, True) if self._has_implied else (False,)
        found = [(reduction, name_implied, False) for reduction in Reduction for name_implied in named]
        if any(e.operation is not Operation.INPUT and square_of(e) is not None for e in topological(expressions)):
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


def _forms(system: System) -> Iterator[tuple[Steps, System]]:
    """Yield a system and its equivalent forms."""
    yield (), system
    divided = resubstitute(system)
    for how, each in (((), system), (("results by results",), divided)):
        if each is not None:
            if each is divided:
                yield how, each
            shifted = shift(each)
            if shifted is not None:
                yield (*how, "in differences"), shifted


def _size(system: System) -> int:
    return total_terms(_polynomials(system))


def _effort(system: System) -> int:
    return sum(len(polynomial.terms) ** 2 for polynomial in _polynomials(system))


def _polynomials(system: System) -> list[Polynomial]:
    """Return all polynomials that have to be computed."""
    definitions, _ = system.live()
    return [*system.outputs, *(definition.polynomial for definition in definitions)]


def _choices_of_stages(found: list[Expression]) -> Iterable[frozenset[Expression]]:
    if len(found) <= STAGE_LIMIT:
        sizes: Iterable[int] = range(len(found), -1, -1)
    else:
        sizes = (len(found), len(found) - 1, 1, 0) if len(found) <= 6 else (len(found),)
    return [frozenset(chosen) for size in sizes for chosen in combinations(found, size)]
