"""How well points determine a fitted object, and whether their distances contradict it.

The noise of the points is not known before: it is that of the distances, independent and normal. Shapes that an object
does not have, such as the bending of a line, are further terms of its distances (`algorithms.evidence.misfit`).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations_with_replacement
from math import e, inf, log, pi, sqrt
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arguments import Reals
from ..evidence import WRONG, Status, certain_deviations, largest_ratio
from ..evidence.misfit import SUSPECTED, UNKNOWN, coherence, misfit
from ..evidence.noise import ENOUGH
from ..precision import NEGLIGIBLE, TINY

_DEGREES = 2, 3, 4
"""A limit on work: degrees of the polynomials that describe other shapes."""
_NEIGHBOURS = 4
"""A limit on work: the number of nearest points with which residuals are compared."""
_FLATTEST = 1.8
"""The kurtosis of numbers that are distributed uniformly: no symmetric distribution with one mode has less."""
_ROUNDED = 16 * float(np.finfo(np.float64).eps)
"""From floating point: distances below this part of the coordinates are rounding."""


class FitStatus(Status):
    """Whether points determine the object that was fitted to them, and agree with it."""

    OK = 0
    TOO_FEW = 1
    """There are no more numbers than the object has parameters, so that nothing is known of their noise."""
    UNDETERMINED = 2
    """The points leave the object undetermined within their noise: a plane of points that have no smallest extent, or a
    circle or sphere whose radius may be infinite."""
    UNEXPLAINED = 3
    """The distances follow a shape, have two groups, or are too large for some points: the points are of another
    object, of several, or some are wrong."""


class Fitted(NamedTuple):
    """An object in the middle of its points, as far as its evidence is concerned."""

    residuals: Reals
    """(c, n) One row for each of c numbers by which a point is off; the last one is that from a radius."""
    jacobian: Reals
    """(c, n, p) Their derivatives by the parameters."""
    places: Reals
    """(n, d) Coordinates on the object, which do not depend on the residuals."""
    parts: tuple[tuple[tuple[int, ...], float | None], ...]
    """The parameters of each number of `deviations`, and their unit, or None for angles."""
    extents: Reals
    """(p,) The mean square of what a parameter of a flat object turns about, which includes noise; else infinite."""
    rounding: float
    """Distances below this are rounding."""
    is_round: bool = False
    """Whether the last coordinates are those of a unit vector."""
    thickness: float = 0.0
    """The thickness at which the object fills as much as the box of its points."""
    radius: float = inf
    """The radius of a round object, of a cone in the middle of its points."""
    radial: int | None = None
    """The parameter that is this radius."""


def judged(fitted: Fitted) -> tuple[FitStatus, list[float]]:
    """Return the status of an object, and the standard deviations of its parts."""
    off, (c, n, p) = fitted.residuals, fitted.jacobian.shape
    flat, none = fitted.jacobian.reshape(-1, p), [np.inf] * len(fitted.parts)
    basis, values, rows = np.linalg.svd(flat, full_matrices=False)
    known = values > NEGLIGIBLE * values[0]
    freedom, least, cost = off.size - int(known.sum()), off.size * fitted.rounding**2, float((off * off).sum())
    if freedom <= 0:
        return FitStatus.TOO_FEW, none
    terms = _of_each(_polynomials(fitted.places, freedom // c, 1 if fitted.is_round else _DEGREES[-1]), c)
    table = np.concatenate([flat, terms.reshape(len(terms), off.size).T, off.reshape(-1, 1)], 1)
    found = misfit(table.T @ table, p, freedom, UNKNOWN, least)
    # Rounding errors are not independent.
    variance, growth, others = max(cost, least) / freedom, n if cost <= least else 1.0, False
    if cost > least:
        share = _common(off, fitted.places)
        alone = any(_is_far(off, basis[:, known], cost, freedom))
        modes = [_modes(row) for row in np.linalg.svd(off, full_matrices=False)[2]] if n >= ENOUGH else []
        others = alone or 2 * share > 1 or any(refused for _, refused in modes)
        growth += 2 * n * c * share + n * any(doubted for doubted, _ in modes)
    # So few numbers may have a larger variance than they show.
    by = rows[known].T / values[known] * sqrt(variance * growth * largest_ratio(3, freedom) / largest_ratio(3))
    covariance = by @ by.T
    if found.more is not None:
        covariance = covariance + found.more
    larger = _larger(fitted, covariance, variance, freedom)
    deviations = none if larger is None else _deviations(fitted, covariance * np.outer(larger, larger))
    if found.contradicts or others:
        return FitStatus.UNEXPLAINED, deviations
    return FitStatus.OK if np.isfinite(deviations).all() else FitStatus.UNDETERMINED, deviations


def _deviations(fitted: Fitted, covariance: Reals) -> list[float]:
    """Return the largest standard deviation of each part; infinite if a direction may be any one."""
    found = []
    for part, unit in fitted.parts:
        each = sqrt(max(float(np.linalg.eigvalsh(covariance[np.ix_(part, part)])[-1]), 0.0))
        is_any = unit is None and certain_deviations() * each > pi / 2
        found.append(inf if is_any else each * (unit or 1.0))
    return found


def _larger(fitted: Fitted, covariance: Reals, variance: float, freedom: int) -> Reals | None:
    """Return by what noise along an object, or an uncertain radius, makes errors larger; None if it is not finite.

    The extent of a flat object includes noise, which moves its axes (Anderson, *Annals of Mathematical Statistics*
    34:122, 1963). Of a round one the curvature has a normal distribution, and its bounds are those of the radius; the
    mean of the radius of points that are off in all directions is larger, by their variance divided by it. Points that
    may be as far off as the centre, or that fill a box as well, determine no round object.
    """
    wide, n = np.isfinite(fitted.extents), fitted.residuals.shape[1]
    larger = np.ones(len(wide))
    if not (fitted.extents > largest_ratio(n, freedom) * variance).all():
        return None
    larger[wide] = fitted.extents[wide] / (fitted.extents[wide] - variance)
    across = sqrt(max(float((fitted.residuals[-1] ** 2).mean()), fitted.rounding**2))
    if np.isfinite(fitted.radius):
        odds = n * log(fitted.thickness / (across * sqrt(2 * pi * e)))
        if not (certain_deviations(WRONG / n) * across < fitted.radius and odds > -log(WRONG)):
            return None
    if fitted.radial is not None:
        covariance[fitted.radial, fitted.radial] += (variance / fitted.radius) ** 2
        most = certain_deviations() * sqrt(covariance[fitted.radial, fitted.radial]) / fitted.radius
        if not most < 1:
            return None
        larger[~wide] /= 1 - most
    return larger


def _common(off: Reals, places: Reals) -> float:
    """Return which share of their squares the residuals (c, n) of neighbours have in common."""
    c, n = off.shape
    near = scipy.spatial.cKDTree(places).query(places, min(_NEIGHBOURS + 1, n))[1][:, 1:]
    k = near.shape[1]
    both = int((near[near] == np.arange(n)[:, None, None]).any(2).sum())
    products = float((off[:, :, None] * off[:, near]).sum())
    return coherence(k * float((off * off).sum()), products, k * c * n, c * both)


def _is_far(off: Reals, basis: Reals, cost: float, freedom: int) -> NDArray[np.bool_]:
    """Return which points are farther off than noise explains; `basis` is an orthonormal one of the derivatives."""
    c, n = off.shape
    if freedom <= c:
        return np.zeros(n, bool)
    left = np.maximum(1 - (basis * basis).sum(1).reshape(c, n), NEGLIGIBLE)
    squares = (off * off / left).sum(0)
    return np.asarray(UNKNOWN.outlying(squares, c, np.maximum(cost - squares, 0), freedom - c))


def _modes(x: Reals) -> tuple[bool, bool]:
    """Return whether numbers have less kurtosis or more skew than those of one normal distribution, and surely so.

    The variances of both moments are those of normal numbers (Fisher, *Proceedings of the London Mathematical Society*
    30:199, 1930). Two groups of numbers move an estimate by up to their common deviation. They are certain if the
    kurtosis is less than that of uniform numbers, since no symmetric distribution with one mode has less.
    """
    n, x = len(x), x - x.mean()
    square = max(float((x * x).mean()), TINY)
    skew, kurtosis = abs(float((x**3).mean())) / square**1.5, float((x**4).mean()) / square**2
    of_skew = sqrt(6 * n * (n - 1) / ((n - 2) * (n + 1) * (n + 3)))
    of_kurtosis = 2 * of_skew * sqrt((n * n - 1) / ((n - 3) * (n + 5)))
    some, sure = certain_deviations(SUSPECTED), certain_deviations()
    doubted = skew > some * of_skew or kurtosis < 3 - some * of_kurtosis
    return doubted, skew > sure * of_skew or kurtosis < _FLATTEST - sure * sqrt(0.4 / n)


def _polynomials(places: Reals, freedom: int, most: int) -> Reals:
    """Return products (t, n) of coordinates (n, d), of as many degrees as half of the freedom suffices for.

    The power of the last one is at most `most`, since its square follows from those of the others in a unit vector.
    """
    found: list[Reals] = []
    last = places.shape[1] - 1
    for degree in _DEGREES:
        powers = combinations_with_replacement(range(last + 1), degree)
        more = [places[:, power].prod(1) for power in powers if power.count(last) <= most]
        if 2 * (len(found) + len(more)) > freedom:
            break
        found += more
    return np.array(found).reshape(-1, len(places))


def _of_each(rows: Reals, c: int) -> Reals:
    """Return terms (c t, c, n) of each of c residuals, from those (t, n) of one."""
    found = np.zeros((c, len(rows), c, rows.shape[1]))
    for k in range(c):
        found[k, :, k] = rows
    return found.reshape(-1, c, rows.shape[1])


def rounding_of(places: Reals, size: float, power: int = 1) -> float:
    """Return the rounding of places in units of a size, or that of coefficients with a power of coordinates."""
    return _ROUNDED * max(float(np.abs(places).max()) / size, 1.0) ** power


def _along(places: Reals, centre: Reals, axes: Reals) -> tuple[Reals, float]:
    """Return coordinates (3, n) along the principal axes, shortest first, in units of the largest deviation."""
    along = ((places - centre) @ axes).T
    size = sqrt(float((along[2] ** 2).mean()))
    return along / size, size


def fitted_plane(places: Reals, centre: Reals, axes: Reals) -> Fitted:
    """Return a plane across the shortest of the principal axes."""
    x, size = _along(places, centre, axes)
    jacobian = np.stack([np.ones_like(x[0]), x[1], x[2]], -1)[None]
    extents = np.array([np.inf, *(x[1:] ** 2).mean(1)])
    parts = ((1, 2), None), ((0,), size)
    return Fitted(x[:1], jacobian, x[1:].T, parts, extents, rounding_of(places, size))


def fitted_line(places: Reals, centre: Reals, axes: Reals) -> Fitted:
    """Return a line along the longest of the principal axes."""
    x, size = _along(places, centre, axes)
    one = np.ones_like(x[2])
    jacobian = np.moveaxis(_of_each(np.stack([one, x[2]]), 2), 0, -1)
    extents = np.array([np.inf, 1.0, np.inf, 1.0])
    parts = ((1, 3), None), ((0, 2), size)
    return Fitted(x[:2], jacobian, x[2:].T, parts, extents, rounding_of(places, size))


def box_of(places: Reals, dimensions: int) -> float:
    """Return the area or volume of the box of points along their principal axes, the longest of some number."""
    x = places - places.mean(0)
    axes = np.linalg.svd(x, full_matrices=False)[2][:dimensions]
    return float(np.ptp(x @ axes.T, axis=0).prod())


def arc_of(c: Reals, s: Reals) -> float:
    """Return the angle of the arc that contains all directions."""
    angles = np.sort(np.arctan2(s, c))
    return float(2 * pi - np.diff(angles, append=angles[0] + 2 * pi).max())


Judged = tuple[NDArray[np.int64], Reals]


def judged_sets(fitted: Callable[..., Fitted], determined: Reals, n_parts: int, *sets: Reals) -> Judged:
    """Return statuses (...) and deviations (..., k) of objects, from the arrays of each of them."""
    status = np.full(determined.shape, int(FitStatus.UNDETERMINED))
    parts = np.full((*determined.shape, n_parts), np.inf)
    for k in np.ndindex(determined.shape):
        if determined[k]:
            found, parts[k] = judged(fitted(*(each[k] for each in sets)))
            status[k] = int(found)
    return status, parts
