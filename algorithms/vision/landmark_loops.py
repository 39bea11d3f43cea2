"""The loop over all pairs of sets of `landmarks`, compiled by numba. Nothing here raises."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def unlikeness(
    values: Any, deviations: Any, learned: Any, learned_deviations: Any, variance: float, floor: float
) -> Any:
    """For each pair of a set (q, 5) and one that was learned (s, 5), (q, s): minus twice the logarithm of how likely.

    Differences by their noise, and the size of that noise; a deviation is of noise whose variance is 1.
    """
    found = np.empty((len(values), len(learned)))
    for q in range(len(values)):
        for s in range(len(learned)):
            total, product = 0.0, 1.0
            for k in range(values.shape[1]):
                noise = variance * (deviations[q, k] ** 2 + learned_deviations[s, k] ** 2) + floor
                total += (values[q, k] - learned[s, k]) ** 2 / noise
                product *= noise
            found[q, s] = total + np.log(product)
    return found
