"""Junctions: places where curves or surfaces of several directions meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite_number
from ..precision import ROUNDING
from .ascent import climb, finite_tokens, well_apart
from .voting import VoteField, Votes

_BROAD, _NARROW = 0.5, 5.0
"""Weights of squared curvatures of the votes by which junctions are found, and of those that locate them. In a narrow
field, tokens beside a curve do not vote across it."""
_SHARE = 0.05
"""The least saliency of a junction, and of a token from which the ascent begins, in units of the first eigenvalue."""
_AROUND = (1.0, 2.0)
"""Distances, in units of sigma, at which the saliency around a junction is taken."""
_DIRECTIONS = 64
"""A limit on work: places at each distance around a junction."""


@dataclass(frozen=True, eq=False)
class Junctions:
    """Places where curves or surfaces of several directions meet, the clearest first.

    Attributes
    ----------
    points : array, (k, d)
    saliency : array, (k,)
        The last eigenvalue of the votes. A token votes with at most 1.
    contrast : array, (k,)
        The ratio of the saliency to the largest one at the distances sigma and 2 sigma.
    """

    points: Reals
    saliency: Reals
    contrast: Reals


def extract_junctions(
    points: ArrayLike, *, sigma: float, least: float = 0.05, support: float = 2.0, contrast: float = 3.0
) -> Junctions:
    """Extract the places where curves or surfaces of several directions meet.

    These are crossings, corners and branches of curves in the plane, and of curves or of three surfaces in space. The
    ends of curves are not junctions, and two surfaces meet in a curve, see `extract_curves`.

    Parameters
    ----------
    points : array_like, (n, 2) or (n, 3)
        Tokens. Those with numbers that are not finite are ignored.
    sigma : float
        The scale of votes, in the units of the points.
    least : float, optional
        The least saliency of a junction, in units of the largest eigenvalue at a token.
    support : float, optional
        The least saliency of a junction, in units of the vote of one token.
    contrast : float, optional
        The least ratio of the saliency to that around the junction: surfaces and outliers have no such maxima.

    Returns
    -------
    Junctions
        Maxima of the junction saliency. Junctions closer to each other than sigma merge. Those of directions that
        differ by less than about 50 degrees in the plane, or 75 degrees in space, may be missing.

    Raises
    ------
    ValueError
        If an argument has a wrong shape or is out of its range.
    """
    tokens = finite_tokens(points, (2, 3))
    bounds = {"sigma": sigma, "least": least, "support": support, "contrast": contrast}
    for name, value in bounds.items():
        if finite_number(value, name) <= 0:
            raise ValueError(f"{name}: {value}; expected a positive number")
    found = _summits(tokens, sigma, least, support)
    size = found.junction
    around = [found.points[:, None] + distance * sigma * _directions(tokens.shape[1]) for distance in _AROUND]
    rings = VoteField(tokens, sigma, _NARROW).votes(np.concatenate(around, 1).reshape(-1, tokens.shape[1]))
    ratio = size / np.maximum(rings.junction.reshape(-1, len(_AROUND) * _DIRECTIONS).max(1), ROUNDING * size)
    clear = ratio >= contrast
    return Junctions(found.points[clear], size[clear], ratio[clear])


def _summits(tokens: Reals, sigma: float, least: float, support: float) -> Votes:
    """Return the votes at maxima of the junction saliency, the largest first."""
    broad, narrow = VoteField(tokens, sigma, _BROAD), VoteField(tokens, sigma, _NARROW)
    votes = broad.votes(tokens)
    limit = max(support, least * votes.eigenvalues[:, 0].max(initial=0))
    possible = (votes.junction >= limit / 2) & (votes.junction >= _SHARE * votes.eigenvalues[:, 0])
    seeds = tokens[possible][well_apart(tokens[possible], votes.junction[possible], sigma / 2)]
    axes = np.eye(tokens.shape[1])

    def everywhere(at: Votes) -> Reals:
        return np.broadcast_to(axes, (len(at.points), *axes.shape))

    first = climb(broad, seeds, lambda at: at.junction, everywhere, sigma / 6).votes
    kept = first.junction >= limit
    apart = well_apart(first.points[kept], first.junction[kept], sigma / 4)
    found = climb(narrow, first.points[kept][apart], lambda at: at.junction, everywhere, sigma / 10)
    size = found.votes.junction
    # The last eigenvalue has edges, where a quadratic fit may find no maximum; the contrast decides.
    clear = (size >= limit) & (size >= _SHARE * found.votes.eigenvalues[:, 0])
    rows = np.flatnonzero(clear)
    return found.votes.rows(rows[well_apart(found.votes.points[rows], size[rows], sigma)])


def _directions(d: int) -> Reals:
    """Return unit vectors in all directions, about equally far from each other."""
    k = np.arange(_DIRECTIONS) + 0.5
    if d == 2:
        turn = 2 * np.pi * k / _DIRECTIONS
        return np.stack([np.cos(turn), np.sin(turn)], 1)
    height, turn = 1 - 2 * k / _DIRECTIONS, np.pi * (1 + np.sqrt(5)) * k
    flat = np.sqrt(1 - height**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), height], 1)
