"""The cost of a procedure: the operation counts of its statements, and how often they run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from .cost import Cost, cost
from .procedure import Add, Apply, Loop, Procedure, Repeat, Statement

NO_COST = Cost(0, 0, 0, 0, 0, 0, 0)

Costs = tuple[tuple[str, Cost], ...]
"""Operation counts of a kernel with loops by how often they run: ``""`` once, ``"n"`` for each row, ``"n*m"``."""


def procedure_costs(procedure: Procedure) -> Costs:
    """Return the operation counts of a procedure by how often they run, in the order of the text.

    The keys are ``""`` for once, ``"n"`` for each row of a length, products such as ``"n*m"``, and ``"steps"`` for each
    step of an iteration. Entries without operations are omitted.
    """
    found: dict[str, Cost] = {}
    for often, each in _costs(procedure, procedure.body, ()):
        if each != NO_COST:
            found[often] = found.get(often, NO_COST) + each
    return tuple(found.items()) or (("", NO_COST),)


def _costs(procedure: Procedure, body: Sequence[Statement], loops: tuple[str, ...]) -> Iterator[tuple[str, Cost]]:
    for statement in body:
        match statement:
            case Apply():
                yield "*".join(loops), cost(statement.program)
            case Add():
                size = procedure.table(statement.target.table).size
                yield "*".join(loops), replace(NO_COST, add=size, fma=size)
            case Loop():
                yield from _costs(procedure, statement.body, (*loops, statement.length))
            case Repeat():
                yield from _costs(procedure, statement.body, (*loops, "steps"))
            case _:
                pass


def costs_text(costs: Costs) -> str:
    """Return costs in one line: ``n * (51 mul, 36 add) + 48 mul, 40 add``."""
    in_order = sorted(costs, key=lambda each: not each[0])
    return " + ".join(f"{often.replace('*', ' * ')} * ({each})" if often else str(each) for often, each in in_order)


def costs_as_dict(costs: Costs) -> dict[str, dict[str, int]]:
    """Return the counts by how often they run, for JSON: ``{"once": {"mul": 48, ...}, "n": {...}}``."""
    return {often or "once": each.as_dict() for often, each in sorted(costs, key=lambda each: bool(each[0]))}
