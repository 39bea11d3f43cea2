"""Candidates compete: several ways to compute the same numbers, the cheapest wins.

The families are the author's own structure; and, for every rewriting of the expression, every choice of named
intermediate results, with and without reduction modulo the relations, in differences where the numbers allow it, the
factorised polynomials. The order of candidates is fixed, and the first of the cheapest is taken.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from ..errors import TooLargeError
from ..frontend.expression import Expression, evaluate
from ..frontend.kernel import Kernel
from ..ir.cost import Cost, cost
from ..ir.program import Argument, Program
from ..ir.scalar import Graph, Scalar
from ..rings.polynomial import total_terms
from .factor import Policy
from .lower import Lowering, Reduction, Slot, pick, stages
from .resubstitute import resubstitute
from .schedule import schedule
from .share import share
from .shift import shift
from .system import System

SMALL = 60
"""Polynomials up to this many terms are always multiplied out, whatever the best cost."""
MANY_TERMS = 300
"""Systems with more terms than this are factorised under one policy only."""
HOPELESS = 3
"""Systems with more terms than this many times the best cost so far are not factorised: they do not catch up, and
the time grows with the square of a sum's terms."""
STAGE_LIMIT = 3
"""With more stages than this, not all sets of them are tried, but none, all, all but one and single ones."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One way to compute a kernel."""

    origin: str
    program: Program
    cost: Cost


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
        self._has_implied = any(parameter.layout.implied for parameter in kernel.parameters)
        self._arguments = tuple(Argument(p.name, p.shape, p.components) for p in kernel.parameters)

    def candidates(self) -> list[Candidate]:
        """All candidates that were tried, in order."""
        direct = {name: self._candidate(name, self._direct(variant)) for name, variant in self._variants.items()}
        found = list(direct.values())
        least = min(candidate.cost.total for candidate in found)
        self._budget = max(HOPELESS * least, SMALL)
        first: list[tuple[str, System, Candidate]] = []
        for origin, system in self._systems(sorted(direct, key=lambda name: direct[name].cost.total)):
            candidate = self._factorise(origin, system, Policy(split_numbers=True))
            first.append((origin, system, candidate))
            least = min(least, candidate.cost.total)
            self._budget = max(HOPELESS * least, SMALL)
        found += [candidate for _, _, candidate in first]
        best = sorted(range(len(first)), key=lambda k: (first[k][2].cost.total, k))[:2]
        for k in best:
            origin, system, _ = first[k]
            if total_terms(system.outputs) <= MANY_TERMS:
                for policy in (
                    Policy(split_numbers=True, long_sums_first=True),
                    Policy(prefer_products=True, split_numbers=True, long_sums_first=True),
                    Policy(),
                    Policy(prefer_products=True),
                    Policy(prefer_products=True, split_numbers=True),
                ):
                    found.append(self._factorise(origin, system, policy))
        return found

    def _candidate(self, origin: str, scalars: Sequence[Scalar]) -> Candidate:
        todo = iter(scalars)
        results = tuple((name, shape, tuple(next(todo) for _ in slots)) for name, shape, slots in self._results)
        program = schedule(self._kernel.name, self._arguments, results)
        return Candidate(origin, program, cost(program))

    def _direct(self, expressions: Sequence[Expression]) -> tuple[Scalar, ...]:
        graph = Graph()
        inputs = {name: graph.variable(name) for parameter in self._kernel.parameters for name in parameter.components}
        return pick(evaluate(expressions, inputs), self._slots, graph)

    def _factorise(self, origin: str, system: System, policy: Policy) -> Candidate:
        choices = [name for name in Policy.__slots__ if getattr(policy, name)]
        return self._candidate(", ".join([origin, "factorised", *choices]), share(system, policy))

    def _systems(self, names: Sequence[str]) -> Iterator[tuple[str, System]]:
        """Different systems that are small enough to catch up with the best so far, the simplest rewriting first."""
        seen: set[str] = set()
        for name in names:
            expressions = self._variants[name]
            for cuts in _choices_of_stages(stages(expressions)):
                for reduction in Reduction:
                    for name_implied in (False, True) if self._has_implied else (False,):
                        try:
                            lowering = Lowering(self._kernel, expressions, cuts, reduction, self._budget, name_implied)
                            system = lowering.system(self._slots)
                        except TooLargeError:
                            continue
                        how = [reduction.value] if lowering.relations.known else []
                        how += ["implied named"] if name_implied else []
                        origin = ", ".join([name, f"{len(cuts)} stages", *how])
                        if _size(system) > self._budget:
                            continue
                        for form, each in _forms(system):
                            if _size(each) <= self._budget and str(each) not in seen:
                                seen.add(str(each))
                                yield origin + form, each
                    if not lowering.relations.known:
                        break


def _forms(system: System) -> Iterator[tuple[str, System]]:
    """A system, and the other forms it has."""
    yield "", system
    divided = resubstitute(system)
    for how, each in (("", system), (", results by results", divided)):
        if each is not None:
            if each is divided:
                yield how, each
            shifted = shift(each)
            if shifted is not None:
                yield how + ", in differences", shifted


def _size(system: System) -> int:
    definitions, _ = system.live()
    return total_terms([*system.outputs, *(definition.polynomial for definition in definitions)])


def _choices_of_stages(found: list[Expression]) -> Iterable[frozenset[Expression]]:
    if len(found) <= STAGE_LIMIT:
        sizes: Iterable[int] = range(len(found) + 1)
    else:
        sizes = (0, 1, len(found) - 1, len(found)) if len(found) <= 6 else (len(found),)
    return [frozenset(chosen) for size in sizes for chosen in combinations(found, size)]
