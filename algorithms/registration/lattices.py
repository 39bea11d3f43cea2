"""The step of the lattice on which points are, such as centres of voxels."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals
from ..precision import SINGLE

_EQUAL = 4
"""From a probability: the number of equal distances that points elsewhere hardly have."""
_REDUCTIONS = 300
"""A limit on work: reductions of differences of points."""


def step_of_lattice(points: Reals, rounding: float) -> float:
    """Return the step of the lattice of points, such as centres of voxels, or 0 if they are on none.

    On a lattice, some distances are equal; elsewhere, hardly any two are so up to rounding. Points may be many steps
    apart: as in Euclid's algorithm for numbers, differences are reduced by shorter ones.
    """
    few = np.unique(points, axis=0)
    first, second = np.triu_indices(len(few), 1)
    lengths = np.sort(np.linalg.norm(few[first] - few[second], axis=1))
    if np.count_nonzero(np.diff(lengths[lengths > rounding]) <= rounding) < _EQUAL:
        return 0.0
    vectors, least, k = few[1:] - few[0], SINGLE * lengths[-1], 0
    for _ in range(_REDUCTIONS):
        squares = np.einsum("ij,ij->i", vectors, vectors)
        order = np.argsort(squares, kind="stable")
        vectors = vectors[order[squares[order] > least**2]]
        if k >= len(vectors):
            break
        times = np.rint(vectors @ vectors[k] / (vectors[k] @ vectors[k]))
        times[k] = 0
        vectors, k = vectors - times[:, None] * vectors[k], 0 if times.any() else k + 1
    return float(np.linalg.norm(vectors[0]))
