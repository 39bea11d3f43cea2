"""Candidates for other cost models than the number of operations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ..ir.cost_models import COUNTS, CostModel
from ..ir.program import Program
from ..ir.scalar import Scalar
from .candidate import Candidate
from .divide import divide_each
from .factor import Policy
from .reassociate import balanced, plain_terms_first
from .search import Search

LONGEST = 40_000
"""Maximum total number of lines of the programs that are changed for a model, the cheapest first."""

Change = Callable[[Program], tuple[Scalar, ...] | None]

_POLICIES: Mapping[str, tuple[Policy, ...]] = {
    "latency": (Policy(expanded=True), Policy(fused=True), Policy(fused=True, split_numbers=True)),
    "fma": (
        Policy(expanded=True),
        Policy(fused=True),
        Policy(fused=True, split_numbers=True),
        Policy(fused=True, prefer_products=True),
    ),
}
"""Further factorisations, for each model."""

_CHANGES: Mapping[str, Mapping[str, Change]] = {
    "latency": {"balanced sums": balanced, "plain terms first": plain_terms_first},
    "fma": {"plain terms first": plain_terms_first},
    "size": {"dividing each": divide_each},
}
"""Changes of whole programs, for each model, by the name of the step."""


def candidates_for(model: CostModel, search: Search, candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return further candidates for a cost model; none for the default.

    Parameters
    ----------
    model : CostModel
    search : Search
        The search that found the candidates.
    candidates : sequence of Candidate
    """
    if model is COUNTS:
        return []
    found = search.factorised_by(_POLICIES.get(model.name, ()))
    distinct = {candidate.program: candidate for candidate in reversed([*candidates, *found])}
    left = LONGEST
    for candidate in sorted(distinct.values(), key=lambda each: (model.of(each.program), each.steps)):
        left -= len(candidate.program.lines)
        if left < 0:
            break
        for name, change in _CHANGES.get(model.name, {}).items():
            scalars = change(candidate.program)
            if scalars is not None:
                found.append(search.candidate((*candidate.steps, name), scalars))
    return found
