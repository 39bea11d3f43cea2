"""Statuses of fuzzy inference."""

from __future__ import annotations

from ..evidence import Status


class FuzzyStatus(Status):
    """Whether a rule base determines an output, or whether a rule can contribute to it."""

    OK = 0
    CLIPPED = 1
    """An input is outside its range; the value is that of the nearest input in the range."""
    NO_RULE_FIRES = 2
    """All rules that conclude the output have the strength 0, or sets are empty: the value is NaN or the default."""
    NOT_FINITE = 3
    """An input is infinite or NaN, or a function of Sugeno inference overflows: the value is NaN."""
    RULE_NEVER_FIRES = 4
    """Of rules: no input in the ranges fulfils the condition, or all weights are 0, or all concluded sets are empty."""
