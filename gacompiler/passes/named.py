"""Which coefficients of long scripts vanish: result by result, step by step, within bounds.

Scripts hand values on from statement to statement. What is used more than once keeps a name, so that polynomials stay
those of one statement; ``m p ~m`` has no vector part whatever the coefficients of ``m`` are.
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
"""Terms that one polynomial may have."""
EFFORT, WHOLE_EFFORT = 30_000, 120_000
"""Pairs of terms that may be multiplied for one way to look at one result, and for all."""


def prove_each(
    trace: Trace, suspected: Mapping[tuple[int, int], Any], variants: Sequence[Sequence[Expression]]
) -> dict[tuple[int, int], Any]:
    """Those suspects, by expression and blade, that polynomials prove to be constant."""
    proved: dict[tuple[int, int], Any] = {}
    left = WHOLE_EFFORT
    for k in range(len(trace.expressions)):
        written = list(dict.fromkeys(variant[k] for variant in variants))
        ways = [(each, cuts) for each in written for cuts in (_shared(each), _vectors(each), frozenset[Expression]())]
        for expression, cuts in ways:
            open_blades = [blade for j, blade in suspected if j == k and (j, blade) not in proved]
            if not open_blades or left <= 0:
                break
            effort = min(EFFORT, left)
            try:
                lowered = Lowering(trace.kernel, (expression,), cuts, budget=BUDGET, effort=effort)
                outputs = lowered.system([Slot(0, blade) for blade in open_blades]).outputs
                left -= effort - lowered.ring.effort
            except TooLargeError:
                left -= effort
                continue
            for blade, polynomial in zip(open_blades, outputs, strict=True):
                value = polynomial.constant_value
                if value is not None and value == suspected[k, blade]:
                    proved[k, blade] = value
    return proved


def _vectors(expression: Expression) -> frozenset[Expression]:
    """Scalars and vectors that are worth a name: no relation is lost with them, as it would be with blades."""
    return frozenset(node for node in stages([expression]) if all(blade.bit_count() < 2 for blade in node.blades))


def _shared(expression: Expression) -> frozenset[Expression]:
    """What is worth a name and is used more than once."""
    uses = Counter(argument for node in topological([expression]) for argument in node.arguments)
    return frozenset(node for node in stages([expression]) if uses[node] > 1)
