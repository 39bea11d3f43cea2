"""Proof of vanishing and constant coefficients in long scripts, one result at a time, with bounded effort.

Scripts pass values from statement to statement. Values that are used more than once are named, so that polynomials are
limited to one statement. This loses little: ``m p ~m``, for example, has no vector part for any coefficients of ``m``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import TooLargeError
from ..frontend.expression import Expression, topological
from ..frontend.kernel import Trace
from .lower import Lowering, Slot, stages

BUDGET = 2_000
"""Maximum number of terms of one polynomial."""
EFFORT, WHOLE_EFFORT = 30_000, 120_000
"""Maximum number of pairs of terms that are multiplied for one form of one result, and in total."""


def prove_by_result(
    trace: Trace, suspected: Mapping[tuple[int, int], Any], variants: Sequence[Sequence[Expression]]
) -> dict[tuple[int, int], Any]:
    """Return the suspected constants, by expression and blade, that polynomials prove."""
    proved: dict[tuple[int, int], Any] = {}
    left = WHOLE_EFFORT
    for k in range(len(trace.expressions)):
        written = list(dict.fromkeys(variant[k] for variant in variants))
        forms = [(each, cuts) for each in written for cuts in (_shared(each), _vectors(each), frozenset[Expression]())]
        for expression, cuts in forms:
            open_blades = [blade for j, blade in suspected if j == k and (j, blade) not in proved]
            if not open_blades or left <= 0:
                break
            effort = min(EFFORT, left)
            try:
                lowered = Lowering(trace.kernel, (expression,), cuts, budget=BUDGET, effort=effort)
                outputs = lowered.system([Slot(0, blade) for blade in open_blades]).outputs
                left -= lowered.pairs
            except TooLargeError:
                left -= effort
                continue
            for blade, polynomial in zip(open_blades, outputs, strict=True):
                value = polynomial.constant_value
                if value is not None and value == suspected[k, blade]:
                    proved[k, blade] = value
    return proved


def _vectors(expression: Expression) -> frozenset[Expression]:
    """Return the scalars and vectors to name. Unlike naming blades of higher grade, this loses no relation."""
    return frozenset(node for node in stages([expression]) if all(blade.bit_count() < 2 for blade in node.blades))


def _shared(expression: Expression) -> frozenset[Expression]:
    """Return the nodes to name that are used more than once."""
    uses = Counter(argument for node in topological([expression]) for argument in node.arguments)
    return frozenset(node for node in stages([expression]) if uses[node] > 1)
