"""Surfaces and curves on which a saliency is largest, as vertices and pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arguments import Reals
from .vote_status import CurveStatus


@dataclass(frozen=True, eq=False)
class Extremal:
    """Places at which the saliency is largest across a surface or a curve.

    Attributes
    ----------
    vertices : array, (v, d)
        Of surfaces, at most one in each cell of the grid; of curves, in order along each curve.
    pieces : int array, (f, k)
        Rows of vertices: the two ends of segments of curves, or the four corners of quadrilaterals of surfaces, in
        order around each one. Neighbouring quadrilaterals may have opposite orders.
    saliency : array, (v,)
        Of the surface or curve at each vertex.
    status : CurveStatus
        Of curves, whether they explain the tokens; OK for surfaces, which have no such test.
    sigma : float
        Of curves, the scale of their votes.
    """

    vertices: Reals
    pieces: NDArray[np.int64]
    saliency: Reals
    status: CurveStatus = CurveStatus.OK
    sigma: float = np.nan


def no_extremal(d: int, corners: int) -> Extremal:
    """Return a result without vertices, with pieces of a number of corners."""
    return Extremal(np.zeros((0, d)), np.zeros((0, corners), np.int64), np.zeros(0))
