"""Tolerances of which every package uses the same ones.

Each is a part of the numbers from which a result follows, such as the largest singular value, the extent of points or
the cost before a step. What is less than that part may be rounding errors.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

TINY = 1e-300
"""From floating point: about the least number with all its digits. Added to a divisor, it prevents a division by 0."""
HUGE = 1e300
"""From floating point: about the largest number; as a limit, it leaves out nothing."""
SQUARED = 1e-26
"""From floating point: the square of `EIGENVALUE`, for sums of squares of rounding errors."""
EIGENVALUE = 1e-13
"""From floating point: eigenvalues of matrices with ones on their diagonal are as precise as this."""
ROUNDING = 1e-12
"""From floating point: rounding errors of some thousand operations on numbers of equal size."""
CONVERGED = 1e-10
"""From floating point: a decrease of a cost by this part moves parameters by 1e-5 of their standard deviations."""
NEGLIGIBLE = 1e-9
"""From floating point: rounding errors of solutions of equations whose condition is at most about a million."""
LIKELY = 1e-6
"""From a probability: a sum of squares that is lower by this part is a thirtieth of its deviation away, for a thousand
items."""
ROOT = 1e-7
"""From floating point: the root of a rounding error, by which double roots and solutions that coincide differ."""
SINGLE = 1e-6
"""From floating point: rounding errors of single precision, of a few operations on numbers of equal size."""


def rounding_of(*arrays: NDArray[Any], part: float = ROUNDING) -> float:
    """Return the part of numbers that may be rounding: at least `SINGLE` if an array is in single precision."""
    return max(part, SINGLE) if any(array.dtype == np.float32 for array in arrays) else part
