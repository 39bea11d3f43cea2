"""Whether curves explain tokens: those beside the curves are nowhere denser than by chance."""

from __future__ import annotations

import numpy as np
import scipy

from ..arguments import Reals
from ..evidence import WRONG
from .extremal import Extremal
from .vote_status import CurveStatus
from .voting import Votes

_BESIDE = 1.0
"""Distance, in units of sigma, up to which tokens belong to a curve: votes do not separate two closer ones."""
_RADII = (1.0, 2.0)
"""A limit on work: radii, in units of sigma, of balls in which tokens are counted."""


def curve_status(found: Extremal, tokens: Votes, sigma: float) -> CurveStatus:
    """Return whether the tokens beside curves are random ones: numbers of tokens in balls around them are Poisson's.

    Tokens that mainly agree on a surface are explained by it. The density of random tokens is that of all tokens beside
    curves in their box.
    """
    beside = tokens.points
    size = tokens.eigenvalues
    if beside.shape[1] == 3:
        beside = beside[size[:, 0] - size[:, 1] <= size[:, 1] - size[:, 2]]
    if len(found.vertices):
        middles = found.vertices[found.pieces].mean(1)
        places = scipy.spatial.cKDTree(np.concatenate([found.vertices, middles]))
        beside = beside[places.query(beside)[0] > _BESIDE * sigma]
    elif not len(tokens.points):
        return CurveStatus.NOTHING
    if _by_chance(beside, tokens.points, sigma):
        return CurveStatus.OK if len(found.pieces) else CurveStatus.NOTHING
    return CurveStatus.UNEXPLAINED


def _by_chance(beside: Reals, tokens: Reals, sigma: float) -> bool:
    """Return whether balls around places contain no more of the others than random places in the box would."""
    n, d = beside.shape
    if n < 2:
        return True
    box = np.maximum(np.ptp(tokens, axis=0), sigma)
    tree = scipy.spatial.cKDTree(beside)
    for radius in _RADII:
        ball = np.pi ** (d / 2) / scipy.special.gamma(d / 2 + 1) * (radius * sigma) ** d
        expected = (n - 1) * min(ball / float(np.prod(box)), 1.0)
        most = int(tree.query_ball_point(beside, radius * sigma, return_length=True).max()) - 1
        if n * len(_RADII) * scipy.special.pdtrc(most - 1, expected) < WRONG:
            return False
    return True
