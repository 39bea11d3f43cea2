"""Conditions and rules of fuzzy inference."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..arguments import finite_number
from .fuzzy_sets import FuzzyVariable


@dataclass(frozen=True)
class Is:
    """The condition that an input is in a set."""

    variable: str
    set: str


@dataclass(frozen=True)
class Not:
    """The complement of a condition."""

    condition: Condition


@dataclass(frozen=True)
class And:
    """The conjunction of two conditions."""

    left: Condition
    right: Condition


@dataclass(frozen=True)
class Or:
    """The disjunction of two conditions."""

    left: Condition
    right: Condition


Condition = Is | Not | And | Or


@dataclass(frozen=True)
class Conclusion:
    """An output is in a set, with a weight from 0 to 1."""

    variable: str
    set: str
    weight: float = 1.0

    def __post_init__(self) -> None:
        weight = finite_number(self.weight, f"weight of {self.variable} is {self.set}")
        if not 0 <= weight <= 1:
            raise ValueError(f"weight of {self.variable} is {self.set}: {weight}; expected a number from 0 to 1")


@dataclass(frozen=True)
class Rule:
    """A rule: if the condition, then the conclusions."""

    condition: Condition
    conclusions: tuple[Conclusion, ...]
    name: str = ""


def parts(condition: Condition) -> Iterator[Is]:
    """Iterate over the sets that a condition names."""
    if isinstance(condition, Is):
        yield condition
    elif isinstance(condition, Not):
        yield from parts(condition.condition)
    else:
        yield from parts(condition.left)
        yield from parts(condition.right)


Literal = tuple[Is, bool]
"""A set, and whether it is complemented."""


def _cases(condition: Condition, complemented: bool = False) -> Iterator[tuple[Literal, ...]]:
    """Iterate over the conjunctions of the disjunctive normal form."""
    if isinstance(condition, Is):
        yield ((condition, complemented),)
    elif isinstance(condition, Not):
        yield from _cases(condition.condition, not complemented)
    elif isinstance(condition, Or) != complemented:
        yield from _cases(condition.left, complemented)
        yield from _cases(condition.right, complemented)
    else:
        pairs = product(_cases(condition.left, complemented), _cases(condition.right, complemented))
        yield from (left + right for left, right in pairs)


def can_fire(rule: Rule, inputs: dict[str, FuzzyVariable]) -> bool:
    """Return whether a rule has a positive strength for an input in the ranges."""
    if all(conclusion.weight == 0 for conclusion in rule.conclusions):
        return False
    return any(_is_possible(case, inputs) for case in _cases(rule.condition))


def _is_possible(case: tuple[Literal, ...], inputs: dict[str, FuzzyVariable]) -> bool:
    possible: dict[str, NDArray[np.bool_]] = {}
    for literal, complemented in case:
        variable = inputs[literal.variable]
        heights = variable.memberships[:, variable.index(literal.set)]
        heights = 1 - heights if complemented else heights
        # A linear function with values of at least 0 at both ends is positive between them if one of them is positive.
        positive = (heights[:-1] > 0) | (heights[1:] > 0)
        possible[variable.name] = possible.get(variable.name, np.ones_like(positive)) & positive
    return all(found.any() for found in possible.values())
