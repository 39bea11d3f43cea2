"""Conditions and rules of fuzzy inference."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..arguments import finite_number
from .functions import FunctionOutput
from .sets import FuzzyVariable, instances

DEEPEST = 200
"""How often conditions may be nested."""


@dataclass(frozen=True)
class Is:
    """The condition that an input is in a set.

    Parameters
    ----------
    variable, set : str
    """

    variable: str
    set: str


@dataclass(frozen=True)
class Not:
    """The complement of a condition, whose strength is one minus that of the condition.

    Parameters
    ----------
    condition : Is, Not, And or Or
    """

    condition: Condition


@dataclass(frozen=True)
class And:
    """The conjunction of two conditions: the least of their strengths or their product, as the rule base specifies.

    Parameters
    ----------
    left, right : Is, Not, And or Or
    """

    left: Condition
    right: Condition


@dataclass(frozen=True)
class Or:
    """The disjunction of two conditions: the largest of their strengths or their probabilistic sum.

    Parameters
    ----------
    left, right : Is, Not, And or Or
    """

    left: Condition
    right: Condition


Condition = Is | Not | And | Or


@dataclass(frozen=True)
class Conclusion:
    """The conclusion that an output is in a set, or has the value of a function.

    Parameters
    ----------
    variable, set : str
        The output, and its set or its function.
    weight : float, optional
        What the strength of the rule is multiplied by, from 0 to 1.

    Raises
    ------
    TypeError, ValueError
        If the weight is not a number from 0 to 1.
    """

    variable: str
    set: str
    weight: float = 1.0

    def __post_init__(self) -> None:
        weight = finite_number(self.weight, f"weight of {self.variable} is {self.set}")
        if not 0 <= weight <= 1:
            raise ValueError(f"weight of {self.variable} is {self.set}: {weight}; expected a number from 0 to 1")


@dataclass(frozen=True)
class Rule:
    """A rule: if the condition, then the conclusions.

    Parameters
    ----------
    condition : Is, Not, And or Or
        Nested at most 200 times.
    conclusions : tuple of Conclusion
    name : str, optional

    Raises
    ------
    TypeError
        If the condition or a conclusion has another type.
    ValueError
        If the condition is nested too deeply.
    """

    condition: Condition
    conclusions: tuple[Conclusion, ...]
    name: str = ""

    def __post_init__(self) -> None:
        where = self.name or "rule"
        check_condition(self.condition, where)
        object.__setattr__(self, "conclusions", instances(self.conclusions, Conclusion, f"{where}: conclusions"))


def parts(condition: Condition) -> Iterator[Is]:
    """Iterate over the sets that a condition names."""
    if isinstance(condition, Is):
        yield condition
    elif isinstance(condition, Not):
        yield from parts(condition.condition)
    else:
        yield from parts(condition.left)
        yield from parts(condition.right)


def check_condition(condition: object, where: str) -> None:
    """Check the types and the depth of a condition.

    Raises
    ------
    TypeError
        If it is not built from `Is`, `Not`, `And` and `Or`.
    ValueError
        If it is nested more than `DEEPEST` times.
    """
    rest = [(condition, 1)]
    while rest:
        part, depth = rest.pop()
        if depth > DEEPEST:
            raise ValueError(f"{where}: a condition that is nested more than {DEEPEST} times; divide the rule")
        if isinstance(part, Not):
            rest.append((part.condition, depth + 1))
        elif isinstance(part, (And, Or)):
            rest += [(part.left, depth + 1), (part.right, depth + 1)]
        elif not isinstance(part, Is):
            raise TypeError(f"{where}: {part!r} in the condition; expected Is, Not, And or Or")


Region = tuple[int, ...]
"""For each input a set of intervals of its grid, as the bits of an integer."""


def can_fire(
    rule: Rule,
    inputs: Sequence[FuzzyVariable],
    outputs: Sequence[FuzzyVariable] | Sequence[FunctionOutput],
) -> bool:
    """Return whether a rule changes an output for an input in the ranges.

    Parameters
    ----------
    rule : Rule
    inputs : sequence of FuzzyVariable
    outputs : sequence of FuzzyVariable or FunctionOutput
    """
    known = {one.name: one for one in outputs}
    if not any(end.weight > 0 and not known[end.variable].is_empty(end.set) for end in rule.conclusions):
        return False
    # The disjunctive normal form, in which conjunctions that are positive in the same intervals count once.
    return bool(_regions(rule.condition, False, inputs))


def _regions(condition: Condition, complemented: bool, inputs: Sequence[FuzzyVariable]) -> set[Region]:
    """Return products of sets of intervals on which a condition, or its complement, is positive."""
    if isinstance(condition, Not):
        return _regions(condition.condition, not complemented, inputs)
    if isinstance(condition, Is):
        return _region(condition, complemented, inputs)
    left, right = (_regions(side, complemented, inputs) for side in (condition.left, condition.right))
    if isinstance(condition, Or) != complemented:
        return left | right
    both = {tuple(a & b for a, b in zip(one, other, strict=True)) for one in left for other in right}
    return {region for region in both if all(region)}


def _region(part: Is, complemented: bool, inputs: Sequence[FuzzyVariable]) -> set[Region]:
    bits = []
    for variable in inputs:
        every = (1 << (variable.samples - 1)) - 1
        if variable.name == part.variable:
            heights = variable.heights(part.set)
            heights = 1 - heights if complemented else heights
            # A linear function with values of at least 0 at both ends is positive between them if one is positive.
            positive = (heights[:-1] > 0) | (heights[1:] > 0)
            every = int.from_bytes(np.packbits(positive, bitorder="little").tobytes(), "little")
        bits.append(every)
    return {tuple(bits)} if all(bits) else set()
