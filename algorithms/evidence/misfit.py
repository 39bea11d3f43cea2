"""What a model leaves in residuals: what further terms explain of them, and what neighbours have in common.

The tests are for data whose noise may not be known: that of a model that does not hold, such as a lens without its
distortion or a second moving object, is not independent. What they find is a bound on the error that it makes, unless
it is more than the rest: then the data contradict the model.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from math import sqrt
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arguments import Reals
from ..precision import NEGLIGIBLE, ROUNDING
from .noise import ENOUGH, Noise, largest_ratio
from .status import WRONG

SUSPECTED = 0.05
"""From a probability: a term that noise shows in a twentieth of the data makes bounds larger; it is no contradiction.
"""
_DOMINANT = 3.27
"""From the probability `WRONG`: the quantile of Tracy and Widom's distribution for real numbers."""
UNKNOWN = Noise(0.0, 0.0)
"""Noise of which nothing is known but what residuals say."""


class Explained(NamedTuple):
    """What additional terms explain of residuals."""

    squares: Reals
    """(..., t) The sums of squares that the first terms explain, by their number."""
    n_terms: NDArray[np.intp]
    """(..., t) The numbers of independent ones among these."""


def explained_by(root: Reals, n_residuals: int = 1) -> Explained:
    """Return what terms explain of residuals, from a root (..., q, q) of sums of products of terms and residuals.

    The squares of the diagonal are what the terms before leave of one, which is rounding for dependent terms. The last
    columns are those of the residuals.
    """
    independent = np.diagonal(root, axis1=-2, axis2=-1)[..., :-n_residuals] ** 2 > NEGLIGIBLE
    squares = np.where(independent, (root[..., -n_residuals:, :-n_residuals] ** 2).sum(-2), 0)
    return Explained(squares.cumsum(-1), n_residuals * independent.cumsum(-1))


def root_of(normal: Reals) -> Reals:
    """Return triangular roots of sums of products (..., q, q) of columns of norm 1, which rounding may make indefinite.

    The last rows say what the columns before explain of the last one.
    """
    held = ROUNDING * np.eye(normal.shape[-1])
    try:
        return np.asarray(np.linalg.cholesky(normal + held))
    except np.linalg.LinAlgError:
        lack = np.minimum(np.linalg.eigvalsh(normal)[..., :1, None], 0)
        return np.asarray(np.linalg.cholesky(normal + held - 2 * lack * np.eye(normal.shape[-1])))


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
    root = root_of(normal / np.outer(scale, scale))
    found = _misfit_across(root[size:, size:], freedom, noise, rounding, float(scale[-1]))
    if found.more is None:
        return found
    by = np.linalg.solve(root[:size, :size].T, root[size:-1, :size].T) / scale[:size, None]
    return found._replace(more=by @ found.more @ by.T)


def misfit_of_all(normal: Reals, size: int, freedom: int, noise: Noise, probability: float, norms: Reals) -> Misfit:
    """Return what terms explain together that are the parameters of one cause, such as a displacement.

    The parameters are those of `misfit`, without choices among the terms. If they explain more than noise would with
    the `probability`, all their coefficients are used.
    """
    scale = np.where(norms > 0, norms, 1)
    root = root_of(normal / np.outer(scale, scale))
    tail, unit = root[size:, size:], float(scale[-1]) ** 2
    tested, _ = _tested(tail, unit, freedom, 0.0)
    explained, cost, n = tested.explained, tested.cost, tested.n_terms
    if not exceeds_noise(explained, cost, n, tested.freedom, 0.0, probability, noise):
        return NO_MISFIT
    rest = tail @ tail.T
    spread = np.linalg.pinv(rest[:-1, :-1], rcond=NEGLIGIBLE, hermitian=True)
    coefficients = spread @ rest[:-1, -1] * scale[-1]
    variance = float(noise.raised(cost - explained, tested.freedom))
    by = np.linalg.solve(root[:size, :size].T, root[size:-1, :size].T) / scale[:size, None]
    more = by @ (np.outer(coefficients, coefficients) + variance * spread) @ by.T
    is_certain = exceeds_noise(explained, cost, n, tested.freedom, 0.0, noise=noise)
    return Misfit(contradicts(explained, cost, n, tested.freedom, 0.0, noise), is_certain, more)


def misfit_across(rest: Reals, freedom: int, noise: Noise, rounding: float) -> Misfit:
    """Return what terms explain of residuals, as `misfit` does, with the spread (t, t) of their coefficients.

    Parameters
    ----------
    rest : array, (t + 1, t + 1)
        Sums of products of terms, of norm 1, and the residual across the derivatives by all parameters.
    freedom, noise, rounding
        As in `misfit`.
    """
    return _misfit_across(root_of(rest), freedom, noise, rounding, 1.0)


def _misfit_across(root: Reals, freedom: int, noise: Noise, rounding: float, unit: float) -> Misfit:
    """Return the result of `misfit_across` from a root of `rest`, for a residual in some unit."""
    first, best = _tested(root, unit**2, freedom, rounding)
    if not any(first.exceed(noise)):
        return NO_MISFIT
    rest = root @ root.T
    left, used, tested = rest, list[int](), first
    while any(tested.exceed(noise)):
        used.append(best)
        left = left - np.outer(left[best], left[best]) / left[best, best]
        left[used] = left[:, used] = 0
        tested, best = _tested(root_of(left), unit**2, freedom - len(used), rounding)
    spread = np.linalg.inv(rest[np.ix_(used, used)])
    coefficients = spread @ rest[used, -1] * unit
    variance, more = float(noise.raised(tested.cost, freedom - len(used))), np.zeros((len(rest) - 1,) * 2)
    more[np.ix_(used, used)] = np.outer(coefficients, coefficients) + variance * spread
    is_refused = contradicts(first.explained, first.cost, first.n_terms, first.freedom, rounding, noise)
    return Misfit(is_refused, any(first.exceed(noise, WRONG)), more)


def _tested(root: Reals, unit: float, freedom: int, rounding: float) -> tuple[Tested, int]:
    """Return what terms explain, from a root (q, q) of their sums of products with the residual, and the best one."""
    found = explained_by(root)
    diagonal, slopes = (root[:-1] ** 2).sum(1), root[:-1] @ root[-1]
    # What is left of a term that the parameters replace is rounding.
    gains = np.where(diagonal > NEGLIGIBLE, slopes**2 / np.maximum(diagonal, NEGLIGIBLE), 0) * unit
    best, n = int(gains.argmax()), int(found.n_terms[-1])
    cost, explained = float(root[-1] @ root[-1]) * unit, float(found.squares[-1]) * unit
    return Tested(cost, explained, float(gains[best]), n, freedom - n, rounding), best


def has_shape(residuals: Reals, places: Reals, degrees: tuple[int, ...]) -> bool:
    """Return whether residuals follow a smooth function of their places, which a model does not have.

    It is the smooth test of Neyman (*Skandinavisk Aktuarietidskrift* 20:149, 1937): what polynomials explain of normal
    numbers has a chi-square distribution, and least squares can only make it smaller.

    Parameters
    ----------
    residuals : array, (n,)
        In standard deviations.
    places : array, (n, d)
    degrees : tuple of int, ascending
        Polynomials of each of these total degrees are tried.
    """
    found, counts = _by_polynomials(residuals[None], places, degrees)
    probability = WRONG / len(counts)
    return any(
        exceeds_noise(square, square, rank, 0, 0.0, probability, Noise(1.0))
        for square, rank in ((float(found.squares[k - 1]), int(found.n_terms[k - 1])) for k in counts)
    )


def is_bent(residuals: Reals, places: Reals, n_parameters: int, rounding: float) -> bool:
    """Return whether linear or quadratic functions of places explain more of residuals than they leave, and than noise.

    Parameters
    ----------
    residuals : array, (k, n)
        Of least squares.
    places : array, (n, d)
    n_parameters : int
        The number of linear functions that least squares have fitted.
    rounding : float
        A sum of squares below this is rounding.
    """
    found, counts = _by_polynomials(residuals, places, (1, 2))
    cost, terms = float((residuals**2).sum()), [int(found.n_terms[k - 1]) for k in counts]
    return any(
        contradicts(float(found.squares[k - 1]), cost, n - n_parameters, residuals.size - n, rounding)
        for k, n in zip(counts, terms, strict=True)
        if residuals.size > n > n_parameters
    )


def _by_polynomials(residuals: Reals, places: Reals, degrees: tuple[int, ...]) -> tuple[Explained, list[int]]:
    """Return what polynomials of places explain of residuals (k, n), and how many there are up to each degree."""
    middle, half = (places.max(0) + places.min(0)) / 2, np.ptp(places, axis=0) / 2
    x = (places - middle) / np.where(half > 0, half, 1)
    table = [np.ones_like(x), x]
    for _ in range(degrees[-1] - 1):
        table.append(2 * x * table[-1] - table[-2])
    powers, counts = _polynomials(x.shape[1], degrees)
    columns = np.prod([np.array(table)[power, :, k] for k, power in enumerate(powers.T)], axis=0)
    norms = np.linalg.norm(columns, axis=1, keepdims=True)
    columns = np.concatenate([columns / np.where(norms > 0, norms, 1), residuals])
    return explained_by(root_of(columns @ columns.T), len(residuals)), counts


@lru_cache(maxsize=100)
def _polynomials(d: int, degrees: tuple[int, ...]) -> tuple[NDArray[np.intp], list[int]]:
    """Return powers (m, d) of d coordinates by ascending total degree, and how many are up to each of some degrees."""
    found = sorted(product(range(degrees[-1] + 1), repeat=d), key=sum)
    return np.array([each for each in found if sum(each) <= degrees[-1]]), [
        sum(sum(each) <= degree for each in found) for degree in degrees
    ]


def in_sequence(n: int) -> Reals:
    """Return places (n, 1) of numbers in a sequence, at which polynomials of degree k are cosines of k half waves."""
    return np.cos(np.pi * (np.arange(n) + 0.5) / n)[:, None]


def coherence(squares: float, products: float, n: int, both: int, probability: float = WRONG) -> float:
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
    probability : float
        With which noise has a share.

    Returns
    -------
    share : float
        At most 1.
    """
    limit = _quantile(probability) * sqrt(n + both)
    return min(products / squares, 1.0) if n >= ENOUGH and n * products > limit * squares > 0 else 0.0


@lru_cache(maxsize=10)
def _quantile(probability: float) -> float:
    return -float(scipy.special.ndtri(probability))


def anisotropy(squares: float, along: float, across: float, radial: float, n: int, probability: float = WRONG) -> float:
    """Return which share of the squares of vectors in a plane has one direction, or 0 if isotropic noise explains it.

    A part of the points that moves has distances in the direction of its motion, or away from a centre. The
    probability of a larger share is that of Mauchly's test of sphericity (*Annals of Mathematical Statistics* 11:204,
    1940), which is exact in a plane, or that of Fisher's ratio of squares in given directions and across.

    Parameters
    ----------
    squares, along, across, radial : float
        The sums of ``x x + y y``, ``x x - y y`` and ``2 x y``, and of squares in given directions minus those across.
    n : int
        The number of vectors, minus one for each two parameters.
    probability : float
        With which noise has a share in each of both tests.

    Returns
    -------
    share : float
        The difference of the variances of two directions, in relation to their sum.
    """
    if n < ENOUGH or not squares > 0:
        return 0.0
    share, away = sqrt(along * along + across * across) / squares, radial / squares
    found = share if share * share > 1 - probability ** (2 / (n - 1)) else 0.0
    return max(found, away) if 1 + away > (1 - away) * largest_ratio(n, n, probability) else found


def dominance(largest: float, squares: float, shape: tuple[int, int], variance: float) -> float:
    """Return which share of squares of a table is one number for each row times one for each column, or 0 if noise is.

    A part of many points that moves together is such a product. The largest singular value of noise has Tracy and
    Widom's distribution (Johnstone, *Annals of Statistics* 29:295, 2001), also with parameters subtracted, or with
    entries missing, which make it smaller.

    Parameters
    ----------
    largest, squares : float
        The square of the largest singular value of the table, and the sum of all squares.
    shape : tuple of int
        Numbers of its rows and columns.
    variance : float
        Of the entries.

    Returns
    -------
    share : float
        At most 1.
    """
    a, b = (sqrt(max(n - 1, 1)) for n in shape)
    limit = (a + b) ** 2 + _DOMINANT * (a + b) * (1 / a + 1 / b) ** (1 / 3)
    return largest / squares if largest > limit * variance else 0.0
