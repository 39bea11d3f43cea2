"""Candidates compete: several ways to compute the same numbers, the cheapest wins.

The families are the author's own structure; and, for every rewriting of the expression, every choice of named
intermediate results, with and without reduction modulo the relations, in differences where the numbers allow it, the
factorised polynomials; and the cheapest of all these with one division where they have several by one number. The
order of candidates is fixed, and the first of the cheapest is taken.
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
from .matrices import evaluate_by_matrices, has_huge_product, ways
from .resubstitute import resubstitute
from .schedule import schedule
from .share import share
from .shift import shift
from .squares import square_of
from .system import System

SMALL = 60
"""Polynomials up to this many terms are always multiplied out, whatever the best cost."""
LARGEST = 1_500
"""Polynomials with more terms than this are never multiplied out to be factorised."""
HOPELESS = 3
"""Systems with more terms than this many times the best cost so far are not factorised: they do not catch up, and
the time grows with the square of a sum's terms."""
FIRST_EFFORT, MORE_EFFORT = 14_000, 8_000
"""Pairs of terms that may be looked at while comparing systems, and while refining the best two under `POLICIES`."""
LOWERING = 10_000
"""Pairs of terms that may be multiplied while one choice of named results is multiplied out. The best ones of all
known kernels take 2 200 at most."""
ALL_LOWERING = 300_000
"""Pairs of terms that may be multiplied in all; the best choices of all known kernels come before that."""
POLICIES = (
    Policy(split_numbers=True, long_sums_first=True),
    Policy(prefer_products=True, split_numbers=True, long_sums_first=True),
    Policy(),
    Policy(prefer_products=True),
    Policy(prefer_products=True, split_numbers=True),
)
DIVIDED = 3
"""So many of the cheapest are tried with fewer divisions."""
STAGE_LIMIT = 3
"""With more stages than this, not all sets of them are tried, but all, all but one, single ones and none; with many
more, only all: sets with many named results come first, because their systems are small."""


Steps = tuple[str, ...]
Way = tuple[Reduction, bool, bool]
"""How to lower: the reduction, whether implied coefficients are named, whether squares are used."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One way to compute a kernel.

    Attributes
    ----------
    steps : tuple of str
        What was done, the rewriting first; what is not said was not done.
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
    """Tries the families on one kernel.

    Parameters
    ----------
    kernel : Kernel
    variants : mapping
        Name of a rewriting -> result expressions.
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
        """All candidates that were tried, in order."""
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
        """Where the search stopped short, for readers."""
        texts = (
            (self._too_large, "choices of named results were too large to be multiplied out"),
            (self._left, "systems of polynomials were too large to be factorised"),
        )
        return tuple(f"{count} {text}; cheaper forms may exist there" for count, text in texts if count)

    def _candidate(self, steps: Steps, scalars: Sequence[Scalar]) -> Candidate:
        todo = iter(scalars)
        results = tuple((name, shape, tuple(next(todo) for _ in slots)) for name, shape, slots in self._results)
        program = schedule(self._kernel.name, self._arguments, results)
        return Candidate(steps, program, cost(program))

    def _direct(self, expressions: Sequence[Expression]) -> tuple[Scalar, ...]:
        graph = Graph()
        return pick(evaluate(expressions, self._inputs(graph), lift=graph.lift), self._slots, graph)

    def _by_matrices(self) -> Iterator[Candidate]:
        """The author's structure with its large products through matrices, by one level, two, and so on."""
        name = "sandwiches recognised" if "sandwiches recognised" in self._variants else next(iter(self._variants))
        expressions = self._variants[name]
        for way in ways(expressions):
            graph = Graph()
            values, how = evaluate_by_matrices(expressions, self._inputs(graph), graph.lift, way)
            yield self._candidate((name, how), pick(values, self._slots, graph))

    def _inputs(self, graph: Graph) -> dict[str, Scalar]:
        return {name: graph.variable(name) for parameter in self._kernel.parameters for name in parameter.components}

    def _factorise(self, steps: Steps, system: System, policy: Policy) -> Candidate:
        choices = [name for name in Policy.__slots__ if getattr(policy, name)]
        return self._candidate((*steps, "factorised", *choices), share(system, policy))

    def _systems(self, names: Sequence[str]) -> Iterator[tuple[Steps, System]]:
        """Different systems that are small enough to catch up with the best so far, the simplest rewriting first."""
        seen: set[tuple[object, ...]] = set()
        left = ALL_LOWERING
        for name in names:
            expressions = self._variants[name]
            ways_to_lower = self._ways(expressions)
            too_large: list[tuple[Way, frozenset[Expression]]] = []
            for cuts in _choices_of_stages(stages(expressions)):
                for way in ways_to_lower:
                    if any(way == other and cuts < more for other, more in too_large):
                        continue
                    if left < 0:
                        self._too_large += 1
                        continue
                    try:
                        lowering = Lowering(self._kernel, expressions, cuts, *way[:1], self._budget, LOWERING, *way[1:])
                        system = lowering.system(self._slots)
                    except TooLargeError:
                        self._too_large += 1
                        too_large.append((way, cuts))
                        left -= LOWERING
                        continue
                    left -= LOWERING - lowering.ring.effort
                    if not _changes_anything(way, lowering) or _size(system) > self._budget:
                        continue
                    steps = (name, f"{len(cuts)} stages", *_steps_of(way, lowering))
                    for form, each in _forms(system):
                        if _size(each) <= self._budget and each.key not in seen:
                            seen.add(each.key)
                            yield (*steps, *form), each

    def _ways(self, expressions: Sequence[Expression]) -> list[Way]:
        """Ways to lower: reductions, implied coefficients by name or not, squares used or not."""
        named = (False, True) if self._has_implied else (False,)
        found = [(reduction, name_implied, False) for reduction in Reduction for name_implied in named]
        if any(e.operation is not Operation.INPUT and square_of(e) is not None for e in topological(expressions)):
            found[len(named) : len(named)] = [(Reduction.NORMAL, name_implied, True) for name_implied in named]
        return found


def _changes_anything(way: Way, lowering: Lowering) -> bool:
    """Whether a way to lower differs from those tried before."""
    reduction, _, by_squares = way
    return lowering.has_solved if by_squares else reduction is Reduction.NORMAL or lowering.relations.known


def _steps_of(way: Way, lowering: Lowering) -> Steps:
    reduction, name_implied, by_squares = way
    chosen = ((lowering.relations.known, reduction.value), (name_implied, "implied named"), (by_squares, "by squares"))
    return tuple(step for is_done, step in chosen if is_done)


def _forms(system: System) -> Iterator[tuple[Steps, System]]:
    """A system, and the other forms it has."""
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
    """Everything that has to be computed."""
    definitions, _ = system.live()
    return [*system.outputs, *(definition.polynomial for definition in definitions)]


def _choices_of_stages(found: list[Expression]) -> Iterable[frozenset[Expression]]:
    if len(found) <= STAGE_LIMIT:
        sizes: Iterable[int] = range(len(found), -1, -1)
    else:
        sizes = (len(found), len(found) - 1, 1, 0) if len(found) <= 6 else (len(found),)
    return [frozenset(chosen) for size in sizes for chosen in combinations(found, size)]
