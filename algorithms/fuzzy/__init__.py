"""Fuzzy inference with linguistic rules (Mamdani, section 14.6, and Sugeno): sets, rules, texts, compiled tables."""

from .functions import AffineFunction, FunctionOutput
from .inference import FuzzyOutput
from .mamdani import Mamdani, grasp_controller
from .rules import And, Conclusion, Is, Not, Or, Rule
from .sets import FuzzySet, FuzzyVariable
from .status import FuzzyStatus
from .sugeno import Sugeno

__all__ = [
    "AffineFunction",
    "And",
    "Conclusion",
    "FunctionOutput",
    "FuzzyOutput",
    "FuzzySet",
    "FuzzyStatus",
    "FuzzyVariable",
    "Is",
    "Mamdani",
    "Not",
    "Or",
    "Rule",
    "Sugeno",
    "grasp_controller",
]
