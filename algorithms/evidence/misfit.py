"""What a model leaves in residuals: what further terms explain of them, and what neighbours have in common.

The tests are for data whose noise may not be known: that of a model that does not hold, such as a lens without its
distortion or a second moving object, is not independent. What they find is a bound on the error that it makes, unless
it is more than the rest: then the data contradict the model.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
import scipy

from ..arguments import Reals
from ..precision import NEGLIGIBLE
from .noise import ENOUGH, Noise, largest_ratio
from .status import WRONG

SUSPECTED = 0.05
"""From a probability: a term that noise shows in a twentieth of the data makes bounds larger; it is no contradiction.
"""
UNKNOWN = Noise(0.0, 0.0)
"""Noise of which nothing is known but what residuals say."""


class Explained(NamedTuple):
    """What additional terms explain of residuals."""

    explained: float
    """The sum of squares that they explain."""
    coefficients: Reals
    n_terms: int
    """The number of independent terms."""


def explained_by(normal: Reals) -> Explained:
    """Return what terms explain of residuals, from the sums of products (q, q) of the terms and the residual."""
    coefficients, _, rank, _ = np.linalg.lstsq(normal[:-1, :-1], normal[:-1, -1], rcond=None)
    return Explained(float(normal[:-1, -1] @ coefficients), coefficients, int(rank))


def exceeds_noise(
    explained: float, cost: float, n_terms: int, freedom: int, rounding: float, probability: float = WRONG,
    noise: Noise = UNKNOWN,
) -> bool:  # fmt: skip
    """Return whether terms explain more of a sum of squares than noise would with a probability.

    The ratio has Fisher's distribution, with as many degrees of freedom as there are terms, or that of chi-square if
    the noise is known.
    """
    known = noise.weight + max(freedom, 0)
    if not (n_terms and known):
        return False
    ratio = n_terms * largest_ratio(n_terms, known, probability)
    return bool(explained > ratio * float(noise.raised(cost - explained, freedom)) + rounding)


def contradicts(
    explained: float, cost: float, n_terms: int, freedom: int, rounding: float, noise: Noise = UNKNOWN
) -> bool:
    """Return whether terms explain more of a sum of squares than they leave, and than noise would."""
    is_more = explained > cost - explained + rounding
    return is_more and exceeds_noise(explained, cost, n_terms, freedom, rounding, noise=noise)


class Misfit(NamedTuple):
    """What terms that a model lacks say of its parameters."""

    contradicts: bool
    """Whether they explain more of the residuals than they leave, and than noise would."""
    is_certain: bool
    """Whether they explain more than noise would with the probability `WRONG`."""
    more: Reals | None
    """(p, p) What they add to the covariance of the parameters, or None if noise explains the residuals as well."""


NO_MISFIT = Misfit(False, False, None)


class Tested(NamedTuple):
    """What terms explain of the sum of squares of residuals, across the derivatives by the parameters of a model."""

    cost: float
    explained: float
    alone: float
    """The most that one of the terms explains: it is found more easily, and moves parameters as much."""
    n_terms: int
    freedom: int
    """Number of residuals minus numbers of parameters and of terms."""
    rounding: float = 0.0

    def exceed(self, noise: Noise, probability: float = SUSPECTED) -> tuple[bool, bool]:
        """Return whether all terms explain more than noise would, and whether one does that is rarer than said."""
        n, freedom = self.n_terms, self.freedom
        one = probability / max(n, 1)
        return (
            exceeds_noise(self.explained, self.cost, n, freedom, self.rounding, noise=noise),
            exceeds_noise(self.alone, self.cost, min(n, 1), freedom + n - 1, self.rounding, one, noise),
        )


def misfit(
    normal: Reals, size: int, freedom: int, noise: Noise = UNKNOWN, rounding: float = 0.0, norms: Reals | None = None
) -> Misfit:
    """Return what terms explain of residuals across the derivatives by the parameters of a model.

    While all terms together explain more than noise would, or one of them alone more than usual, the best one is used.
    The coefficients of these say how far they would move the parameters. The square of that, and its
    uncertainty, are added to the covariance.

    Parameters
    ----------
    normal : array, (q, q)
        Sums of products of the derivatives by parameters, the terms and the residual.
    size : int
        The number of parameters.
    freedom : int
        Number of residuals minus number of parameters.
    noise : Noise
    rounding : float
        A sum of squares below this is rounding.
    norms : array, (q,), optional
        The norms of the columns, if other parameters were eliminated from the sums before: what these leave of a term
        may be rounding.

    Returns
    -------
    Misfit
    """
    scale = np.sqrt(np.maximum(np.diag(normal), 0)) if norms is None else norms
    scale = np.where(scale > 0, scale, 1)
    normal = normal / np.outer(scale, scale)
    moves = np.linalg.lstsq(normal[:size, :size], normal[:size, size:], rcond=NEGLIGIBLE)[0]
    rest = normal[size:, size:] - normal[:size, size:].T @ moves
    found = misfit_across(rest, freedom, noise, rounding, float(scale[-1]))
    by = moves[:, :-1] / scale[:size, None]
    return found if found.more is None else found._replace(more=by @ found.more @ by.T)


def misfit_across(rest: Reals, freedom: int, noise: Noise, rounding: float, unit: float = 1.0) -> Misfit:
    """Return what terms explain of residuals, as `misfit` does, with the spread (t, t) of their coefficients.

    Parameters
    ----------
    rest : array, (t + 1, t + 1)
        Sums of products of terms, of norm 1, and the residual across the derivatives by all parameters.
    freedom, noise, rounding
        As in `misfit`.
    unit : float
        The unit of the residual.
    """
    left, used = rest, list[int]()
    first, best = _tested(rest, unit**2, freedom, rounding)
    tested = first
    while any(tested.exceed(noise)):
        used.append(best)
        left = left - np.outer(left[best], left[best]) / left[best, best]
        left[used] = left[:, used] = 0
        tested, best = _tested(left, unit**2, freedom - len(used), rounding)
    if not used:
        return NO_MISFIT
    spread = np.linalg.inv(rest[np.ix_(used, used)])
    coefficients = spread @ rest[used, -1] * unit
    variance, more = float(noise.raised(tested.cost, freedom - len(used))), np.zeros((len(rest) - 1,) * 2)
    more[np.ix_(used, used)] = np.outer(coefficients, coefficients) + variance * spread
    is_refused = contradicts(first.explained, first.cost, first.n_terms, first.freedom, rounding, noise)
    return Misfit(is_refused, any(first.exceed(noise, WRONG)), more)


def _tested(rest: Reals, unit: float, freedom: int, rounding: float) -> tuple[Tested, int]:
    """Return what terms explain, from their sums of products (q, q) with the residual, and the best of them."""
    diagonal = np.diag(rest)[:-1]
    # What is left of a term that the parameters replace is rounding.
    some = np.flatnonzero(diagonal > NEGLIGIBLE)
    part = rest[np.ix_([*some, -1], [*some, -1])]
    found, gains = explained_by(part), part[:-1, -1] ** 2 / diagonal[some] * unit
    best = int(some[gains.argmax()]) if len(some) else 0
    cost, explained, alone = float(part[-1, -1]) * unit, found.explained * unit, float(gains.max(initial=0.0))
    return Tested(cost, explained, alone, found.n_terms, freedom - found.n_terms, rounding), best


def coherence(squares: float, products: float, n: int, both: int) -> float:
    """Return which share of their squares neighbours have in common, or 0 if independent noise explains it.

    The sum of products of independent numbers of one variance has the variance of the number of pairs. Pairs that are
    neighbours on both sides count twice.

    Parameters
    ----------
    squares, products : float
        The sums of squares of residuals, and of their products with those of their neighbours.
    n : int
        Number of numbers that have neighbours.
    both : int
        How many of them are the neighbours of their neighbours; n is a bound.

    Returns
    -------
    share : float
        At most 1.
    """
    limit = -float(scipy.special.ndtri(WRONG)) * sqrt(n + both)
    return min(products / squares, 1.0) if n >= ENOUGH and n * products > limit * squares > 0 else 0.0
