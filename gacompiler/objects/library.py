"""The functions that an operation calls in Python: numpy's, and those of the C library applied to numpy arrays."""

from __future__ import annotations

import math
from collections.abc import Callable
from math import inf, nan
from typing import Any

import numpy as np

NUMPY: dict[str, Callable[..., Any]] = {
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "atan2": np.arctan2,
    "acos": np.arccos,
    "exp": np.exp,
    "log": np.log,
    "abs": np.abs,
    "floor": np.floor,
    "minimum": np.minimum,
    "maximum": np.maximum,
    "less": lambda a, b: (a < b) * 1.0,
    "less_equal": lambda a, b: (a <= b) * 1.0,
    "equal": lambda a, b: (a == b) * 1.0,
    "select": lambda condition, a, b: np.where(condition != 0, a, b),
}
"""The free names in the text of a program."""


def _of_library(function: Callable[..., float], at_zero: float = nan) -> Callable[..., Any]:
    """Return a function on arrays of doubles that calls the C library for each number, as compiled functions do."""

    def one(*numbers: float) -> float:
        try:
            return function(*numbers)
        except OverflowError:
            return inf
        except ValueError:
            return at_zero if numbers[0] == 0 else nan

    each = np.frompyfunc(one, 2 if function is math.atan2 else 1, 1)
    return lambda *arrays: np.asarray(each(*arrays), np.float64)[()]


LIBRARY = NUMPY | {
    "sin": _of_library(math.sin),
    "cos": _of_library(math.cos),
    "atan2": _of_library(math.atan2),
    "acos": _of_library(math.acos),
    "exp": _of_library(math.exp),
    "log": _of_library(math.log, -inf),
}
"""The same functions with results that are bitwise equal to those of C; slow on arrays."""
