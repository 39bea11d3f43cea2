"""Fuzzy inference with linguistic rules (Mamdani, section 14.6): sets, rules, a text format, and compiled tables."""

from .mamdani import FuzzyOutput, Mamdani, grasp_controller
from .rules import And, Conclusion, Is, Not, Or, Rule
from .sets import FuzzySet, FuzzyVariable
from .status import FuzzyStatus

__all__ = [
    "And",
    "Conclusion",
    "FuzzyOutput",
    "FuzzySet",
    "FuzzyStatus",
    "FuzzyVariable",
    "Is",
    "Mamdani",
    "Not",
    "Or",
    "Rule",
    "grasp_controller",
]
