"""Conditions of rules as programs of `generated.fuzzy`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals
from .fuzzy_rules import And, Condition, Is, Not

Integers = NDArray[np.int64]
DEPTH = 6
"""The size of the stack."""
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

    def steps(self, condition: Condition) -> tuple[list[_Step], int]:
        """Return the steps of a condition, and the number of elements of the stack that they need."""
        literal = _literal(condition)
        if literal is not None:
            return [self._operand(literal, "load", "push")], 1
        if isinstance(condition, Not):
            steps, depth = self.steps(condition.condition)
            return [*steps, _step("complement")], depth
        assert not isinstance(condition, Is)
        operation = self._operations["and" if isinstance(condition, And) else "or"]
        for one, other in ((condition.left, condition.right), (condition.right, condition.left)):
            literal = _literal(other)
            if literal is not None:
                steps, depth = self.steps(one)
                return [*steps, self._operand(literal, operation)], depth
        sides = sorted((self.steps(side) for side in (condition.left, condition.right)), key=lambda found: -found[1])
        (first, depth), (second, other_depth) = sides
        return [*first, *second, _step("pop", operation)], max(depth, other_depth + 1)

    def weighted(self, condition: Condition, weight: float) -> tuple[list[_Step], int]:
        """Return the steps of a condition, whose result is multiplied by a weight."""
        steps, depth = self.steps(condition)
        last = steps[-1]
        return [*steps[:-1], _Step(last.literal, last.row | {"weight": weight})], depth


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

    Raises
    ------
    ValueError
        If a condition is nested too deeply.
    """
    writer = _Writer(numbers, conjunction, disjunction)
    written: list[_Step] = []
    ends = []
    for conditions in results:
        # A strength of 0 for results without conditions: the load of a literal with the weight 0.
        steps = [] if conditions else [_Step(0, _step("load", "push").row | {"weight": 0.0})]
        for k, (condition, weight) in enumerate(conditions):
            found, depth = writer.weighted(condition, weight)
            if depth + (k > 0) > DEPTH:
                raise ValueError(
                    f"condition: nested so deeply that {depth + 1} results are needed at once; expected at most "
                    f"{DEPTH}; divide the rule"
                )
            steps += found
            if k:
                steps.append(_step("pop", "greatest"))
        written += steps
        ends.append(len(written) - 1)
    rows = np.array([[step.row[field] for field in _FIELDS] for step in written]).reshape(-1, len(_FIELDS))
    return Program(np.array([step.literal for step in written], np.int64), rows, np.array(ends, np.int64))
