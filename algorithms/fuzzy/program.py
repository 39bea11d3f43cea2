"""Conditions of rules as programs of `generated.fuzzy`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals
from .rules import And, Condition, Is, Not

Integers = NDArray[np.int64]
DEPTH = 5
"""How many elements of the stack a condition may need; the first of the 6 is the strength of other rules."""
_FIELDS = ("plus", "sign", "weight", "push", "pop", "load", "least", "greatest", "product", "either", "complement")
OPERATIONS = {
    ("and", "min"): "least",
    ("and", "product"): "product",
    ("or", "max"): "greatest",
    ("or", "sum"): "either",
}
"""Fields by conjunctions and disjunctions."""


@dataclass(frozen=True, eq=False)
class Program:
    """Steps of conditions.

    Attributes
    ----------
    literals : int array, (n,)
        The set of the literal of each step.
    rows : array, (n, 11)
    ends : int array, (m,)
        The steps after which the results are on the stack.
    """

    literals: Integers
    rows: Reals
    ends: Integers


@dataclass(frozen=True)
class _Step:
    literal: int
    row: dict[str, float]


def _step(*flags: str, literal: int = 0, complemented: bool = False) -> _Step:
    row = dict.fromkeys(_FIELDS, 0.0) | dict.fromkeys(flags, 1.0) | {"weight": 1.0}
    if "pop" not in flags:
        row |= {"plus": float(complemented), "sign": -1.0 if complemented else 1.0}
    return _Step(literal, row)


def _literal(condition: Condition) -> tuple[Is, bool] | None:
    """Return the set of a literal, and whether it is complemented."""
    complemented = False
    while isinstance(condition, Not):
        condition, complemented = condition.condition, not complemented
    return (condition, complemented) if isinstance(condition, Is) else None


class _Writer:
    """Writes the steps of conditions, with the numbers of sets and the fields of operations."""

    def __init__(self, numbers: dict[tuple[str, str], int], conjunction: str, disjunction: str) -> None:
        self._numbers = numbers
        self._operations = {"and": OPERATIONS["and", conjunction], "or": OPERATIONS["or", disjunction]}

    def _operand(self, found: tuple[Is, bool], *flags: str) -> _Step:
        part, complemented = found
        number = self._numbers[part.variable, part.set]
        return _step(*flags, literal=number, complemented=complemented)

    def steps(self, condition: Condition) -> list[_Step]:
        """Return the steps of a condition."""
        literal = _literal(condition)
        if literal is not None:
            return [self._operand(literal, "load", "push")]
        if isinstance(condition, Not):
            return [*self.steps(condition.condition), _step("complement")]
        assert not isinstance(condition, Is)
        operation = self._operations["and" if isinstance(condition, And) else "or"]
        for one, other in ((condition.left, condition.right), (condition.right, condition.left)):
            literal = _literal(other)
            if literal is not None:
                return [*self.steps(one), self._operand(literal, operation)]
        # The side that needs more elements of the stack comes first.
        first, second = sorted((condition.left, condition.right), key=needed_depth, reverse=True)
        return [*self.steps(first), *self.steps(second), _step("pop", operation)]

    def weighted(self, condition: Condition, weight: float) -> list[_Step]:
        """Return the steps of a condition, whose result is multiplied by a weight."""
        steps = self.steps(condition)
        last = steps[-1]
        return [*steps[:-1], _Step(last.literal, last.row | {"weight": weight})]


def needed_depth(condition: Condition) -> int:
    """Return how many elements of the stack the steps of a condition need."""
    if _literal(condition) is not None:
        return 1
    if isinstance(condition, Not):
        return needed_depth(condition.condition)
    assert not isinstance(condition, Is)
    for one, other in ((condition.left, condition.right), (condition.right, condition.left)):
        if _literal(other) is not None:
            return needed_depth(one)
    most, least = sorted((needed_depth(condition.left), needed_depth(condition.right)), reverse=True)
    return max(most, least + 1)


def program_of(
    results: Sequence[Sequence[tuple[Condition, float]]],
    numbers: dict[tuple[str, str], int],
    conjunction: str,
    disjunction: str,
) -> Program:
    """Write a program.

    Parameters
    ----------
    results : sequence
        For each result, the conditions and weights of which it is the largest product; empty for 0.
    numbers : dict
        The numbers of sets, by the names of variable and set.
    conjunction, disjunction : str
        ``"min"`` or ``"product"``, ``"max"`` or ``"sum"``.
    """
    writer = _Writer(numbers, conjunction, disjunction)
    written: list[_Step] = []
    ends = []
    for conditions in results:
        # A strength of 0 for results without conditions: the load of a literal with the weight 0.
        steps = [] if conditions else [_Step(0, _step("load", "push").row | {"weight": 0.0})]
        for k, (condition, weight) in enumerate(conditions):
            found = writer.weighted(condition, weight)
            steps += found
            if k:
                steps.append(_step("pop", "greatest"))
        written += steps
        ends.append(len(written) - 1)
    rows = np.array([[step.row[field] for field in _FIELDS] for step in written]).reshape(-1, len(_FIELDS))
    return Program(np.array([step.literal for step in written], np.int64), rows, np.array(ends, np.int64))
