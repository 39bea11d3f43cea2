"""Motions from given matches of points, most of which may be wrong: rigidity in joint space, and significance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import pga3
from generated import registration as kernels

from ..arguments import Reals, finite_number, moderate, real_array
from ..elements import MOTOR, POINT, elements
from ..evidence import largest_ratio, log_false_alarms
from ..evidence.misfit import is_bent
from ..precision import NEGLIGIBLE, SINGLE, TINY
from .lattices import step_of_lattice
from .match_chances import FREEDOM, Grid, log_chance, widths
from .match_scales import likely_scales
from .rigid import between_places
from .rigid_status import RegistrationStatus
from .weighted_matches import form_about_means

_FEWEST = 4
"""Matches that a motion needs: three determine it, and a fourth one can contradict it."""
_SEEDS, _BEST = 300, 12
"""Matches whose pairs with all others are compared, and those from which motions are computed."""
_TOLERANCES = (0.001, 0.004, 0.015, 0.05)
"""Differences of lengths, relative to the size of the target, up to which a pair may be of one rigid motion."""
_CERTAIN = -30.0
"""A limit on work: the decimal logarithm of the chance of agreement below which no wider tolerance is tried."""
_OWN = 4.0
"""Distance in residuals up to which matches are of a motion already found."""
_PARTS, _NARROWED = (1.0, 0.5, 0.25, 0.1), 4
"""Limits on work: differences of lengths, in residuals of a motion, at which narrower ones are sought among its
inliers, and how often."""
_REPEATS, _ATTEMPTS = 4, 3
"""Limits on work: selections of inliers, and attempts for each motion: those that find the tail of another count."""
_ROUNDING = 32 * np.finfo(float).eps
"""From floating point: the error of a moved point, relative to the largest coordinate, in some thirty operations."""
_MOTIONS = RegistrationStatus.OK, RegistrationStatus.DEFORMED
_SITES = 60
"""A limit on work: points whose distances show whether the target is on a lattice."""


@dataclass(frozen=True, eq=False)
class MatchRegistration:
    """The motion of matches.

    Attributes
    ----------
    motor : array, (8,)
        Motor of `generated.pga3` that takes the source, multiplied by `scale`, to the target.
    scale : float
        1 unless a similarity was requested.
    inliers : array of bool, (n,)
        Matches that agree with the motion.
    status : RegistrationStatus
    residual : float
        Root mean square of the distances of inliers.
    log_chance : float
        Decimal logarithm of the expected number of motions that wrong matches alone would support as well.
    free : array, (k, 6)
        With the status COLLINEAR the bivector of the rotation about the line of the inliers, which the matches do not
        determine: ``exp(B) motor`` fits as well for all its multiples B. Otherwise empty: matches in a plane determine
        the motion.
    """

    motor: Reals
    scale: float
    inliers: Any
    status: RegistrationStatus
    residual: float
    log_chance: float
    free: Reals


@elements({"motor": MOTOR}, source=POINT, target=POINT)
def register_matches(
    source: ArrayLike, target: ArrayLike, *, tolerance: float | None = None, similarity: bool = False
) -> MatchRegistration:
    """Find the rigid motion of matched points, of which a few percent may be right.

    Two right matches have equal distances in both clouds, the rigidity constraint of joint space. Matches that have
    many pairs in common with another one are fitted by the common normal of the three joint planes. The threshold of
    inliers is the one by which the motion is least likely by chance.

    Parameters
    ----------
    source, target : array_like, (n, 3)
        Row i of the source is matched to row i of the target. Rows with NaN or infinite numbers are left out.
    tolerance : float, optional
        The greatest distance of an inlier. By default it follows from the data.
    similarity : bool, optional
        Whether the target also has another scale, between 1/20 and 20.

    Returns
    -------
    MatchRegistration

    Raises
    ------
    TypeError, ValueError
        If arguments have wrong shapes or types, or the tolerance is not positive.
    """
    x, y = (
        real_array(p, name, (-1, 3), "points").astype(float) for p, name in ((source, "source"), (target, "target"))
    )
    if x.ndim != 2 or x.shape != y.shape:
        raise ValueError(f"source, target: shapes {x.shape} and {y.shape}; expected (n, 3) for both, one row per match")
    if tolerance is not None and finite_number(tolerance, "tolerance") <= 0:
        raise ValueError(f"tolerance: {tolerance}; expected a positive distance")
    rows = np.isfinite(x).all(1) & np.isfinite(y).all(1)
    moderate(x[rows], "source")
    moderate(y[rows], "target")
    if rows.sum() < _FEWEST:
        return _none(RegistrationStatus.TOO_FEW_POINTS, len(x))
    scales = likely_scales(x[rows], y[rows], _SEEDS) if similarity else [1.0]
    found = [_one_motion(scale * x[rows], y[rows], tolerance) for scale in scales]
    k = int(np.argmin([f.log_chance for f in found]))
    best, scale = found[k], scales[k]
    if similarity and best.inliers.any():
        right = best.inliers
        spread = [np.linalg.norm(p[rows][right] - p[rows][right].mean(0)) for p in (x, y)]
        scale = float(spread[1] / spread[0]) if spread[0] else scale
        best = _one_motion(scale * x[rows], y[rows], tolerance)
    inliers = np.zeros(len(x), bool)
    inliers[rows] = best.inliers
    motion = replace(best, scale=scale, inliers=inliers)
    return _with_line(motion, y[inliers])


def separate_motions(
    source: ArrayLike, target: ArrayLike, *, most: int = 8, tolerance: float | None = None
) -> tuple[MatchRegistration, ...]:
    """Find several rigid motions of matched points in sequence, each among the matches that are left.

    Parameters
    ----------
    source, target : array_like, (n, 3)
    most : int, optional
        The greatest number of motions.
    tolerance : float, optional
        As of `register_matches`.

    Returns
    -------
    tuple of MatchRegistration
        The significant motions. A match is an inlier of at most one. The last one may be DEFORMED: parts of what is
        bent look like further motions, which are not sought then.

    Notes
    -----
    Matches of one motion with several levels of noise, or with heavy tails, remain one motion. Noise about a motion has
    random directions, whatever its distances are. A further motion must have more inliers than these directions give by
    chance; otherwise they are inliers of the previous motion.
    """
    pairs = ((source, "source"), (target, "target"))
    x, y = (np.array(real_array(p, name, (3,), "points"), float) for p, name in pairs)
    x[~np.isfinite(x).all(-1) | ~np.isfinite(y).all(-1)] = np.nan  # differences of two infinite numbers would warn
    found: list[MatchRegistration] = []
    for _ in range(_ATTEMPTS * most):
        motion = register_matches(x, y, tolerance=tolerance)
        if motion.status not in _MOTIONS or len(found) == most:
            break
        off = np.linalg.norm(pga3.move_point(motion.motor, x) - y, axis=1)
        rows = np.flatnonzero(np.isfinite(off))
        tails = [_tail_log(k.motor, motion.motor, x[rows], y[rows], off[rows], motion.inliers[rows]) for k in found]
        x[motion.inliers | (off < _OWN * motion.residual)] = np.nan
        if max(tails, default=-np.inf) <= np.log(FREEDOM.false_alarms):
            found.append(motion)
        else:
            k = int(np.argmax(tails))
            found[k] = replace(found[k], inliers=found[k].inliers | motion.inliers)
        if motion.status == RegistrationStatus.DEFORMED:
            break
    return tuple(found)


def _tail_log(first: Reals, second: Reals, x: Reals, y: Reals, off: Reals, inliers: Any) -> float:
    """Return the logarithm of the number of motions that the tails of the noise of a motion support as well as another.

    The distances of matches from the first motion are given, and their directions are random. A match is then within a
    radius of the second motion with the probability of a cap of a sphere.
    """
    place = np.asarray(pga3.move_point(first, x))
    distance = np.linalg.norm(y - place, axis=1)
    apart = np.linalg.norm(np.asarray(pga3.move_point(second, x)) - place, axis=1)
    radius = float(off[inliers].max())
    caps = (radius**2 - (distance - apart) ** 2) / np.maximum(4 * distance * apart, TINY)
    share = np.asarray(np.clip(caps, 0, 1).mean())
    return float(log_false_alarms(len(x), np.asarray((off <= radius).sum()), share, FREEDOM))


def _with_line(found: MatchRegistration, points: Reals) -> MatchRegistration:
    """Return a motion with the status COLLINEAR and its free rotation if its inliers are on a line within the noise."""
    if found.status not in (RegistrationStatus.OK, RegistrationStatus.COLLINEAR) or len(points) < 2:
        return found
    offsets = points - points.mean(0)
    extents, axes = np.linalg.svd(offsets, full_matrices=False)[1:]
    # Noise gives a line the width of one coordinate of the residuals; a cloud of equal width and length is no line.
    noise = found.residual * (np.sqrt(len(points) / 3) + _OWN)
    if extents[1] > max(SINGLE * extents[0], noise) or _OWN * extents[1] > extents[0]:
        return found
    turn = kernels.turn_about_line(points.mean(0), axes[0])
    return replace(found, status=RegistrationStatus.COLLINEAR, free=np.asarray(turn)[None])


def _one_motion(x: Reals, y: Reals, tolerance: float | None) -> MatchRegistration:
    """Return the least likely motion by chance over the tolerances of lengths."""
    rounding = _ROUNDING * max(np.abs(x).max(), np.abs(y).max())
    middle_x, middle_y = np.median(x, 0), np.median(y, 0)
    x, y = x - middle_x, y - middle_y
    size = float(np.sqrt(np.mean(y * y) * 3))
    if size == 0:
        return _none(RegistrationStatus.COLLINEAR, len(x))
    seeds = np.random.default_rng(0).permutation(len(x))[:_SEEDS]
    one, two = kernels.lengths_of_pairs(x[seeds], y[seeds], x, y)
    grid = Grid(step_of_lattice(y[seeds[:_SITES]], rounding), widths(y.std(0)), rounding)
    apart = np.abs(one - two)
    best = _none(RegistrationStatus.NO_SUPPORT, len(x))
    for limit in _TOLERANCES if tolerance is None else (2 * tolerance / size,):
        agree = (apart < limit * size).astype(np.float32)
        agree[np.maximum(one, two) < 4 * limit * size] = 0  # short pairs agree in any case
        top = np.argsort(-agree.sum(1))[:_BEST]
        common = (agree[top][:, seeds] @ agree) * agree[top]
        weights = (common > 0.5 * common.max(1, keepdims=True)).astype(float)
        fitted = _fitted(x, y, weights, limit * size, tolerance, grid)
        best = min(best, fitted, key=lambda motion: motion.log_chance)
        if best.log_chance < _CERTAIN and best.residual < 0.1 * limit * size:
            break
    if best.log_chance > np.log10(FREEDOM.false_alarms):
        return _none(RegistrationStatus.NO_SUPPORT, len(x), best.log_chance)
    if tolerance is None:
        best = _narrowed(best, x, y, rounding, grid)
    if _is_mirrored(best, x, y):
        best = replace(best, status=RegistrationStatus.MIRRORED)
    elif tolerance is None and best.status == RegistrationStatus.OK and _is_deformed(best, x, y, rounding):
        best = replace(best, status=RegistrationStatus.DEFORMED)
    elif _are_repeated(best, x, y, tolerance, grid):
        return _none(RegistrationStatus.NO_SUPPORT, len(x), 0.0)
    motor = between_places(best.motor, middle_x, middle_y)
    return replace(best, motor=motor)


def _are_repeated(found: MatchRegistration, x: Reals, y: Reals, tolerance: float | None, grid: Grid) -> bool:
    """Return whether chance explains a motion if matches that agree in both clouds count once.

    Differences of copies have twice the variance of residuals: they are farther apart with the probability `WRONG`.
    """
    rows = np.flatnonzero(found.inliers)
    off = np.linalg.norm(np.asarray(pga3.move_point(found.motor, x)) - y, axis=1)
    apart = float(np.sqrt(2 * largest_ratio(3) * np.mean(off[rows] ** 2)))
    both = np.concatenate([x[rows], y[rows]], 1)
    left, is_first = np.ones(len(rows), bool), np.ones(len(x), bool)
    tree = scipy.spatial.cKDTree(both)
    for k in range(len(rows)):
        if left[k]:
            left[tree.query_ball_point(both[k], apart)] = False
        else:
            is_first[rows[k]] = False
    if is_first.all():
        return False
    return bool(log_chance(off[None, is_first], tolerance, grid)[0][0] > np.log10(FREEDOM.false_alarms))


def _is_mirrored(found: MatchRegistration, x: Reals, y: Reals) -> bool:
    """Return whether a reflection explains matches that the motion does not, and hardly the converse.

    A mirrored cloud agrees with a motion in a plane. Matches that only one of both explains are equally often of either
    if there is no reflection.
    """
    here = np.asarray(pga3.move_point(found.motor, x))
    inliers = np.asarray(found.inliers, bool)
    reach = float(np.linalg.norm(here - y, axis=1)[inliers].max(initial=0.0))
    mean = y[inliers].mean(0)
    normal = np.linalg.svd(y[inliers] - mean, full_matrices=False)[2][2]
    there = here - 2 * ((here - mean) @ normal)[:, None] * normal
    for _ in range(_REPEATS):
        near = np.linalg.norm(there - y, axis=1) <= reach
        if np.count_nonzero(near) < _FEWEST:
            return False
        at, to = here[near].mean(0), y[near].mean(0)
        u, _, v = np.linalg.svd((here[near] - at).T @ (y[near] - to))
        u[:, 2] *= -np.linalg.det(u) * np.linalg.det(v)
        there = (here - at) @ u @ v + to
    near = np.linalg.norm(there - y, axis=1) <= reach
    gained, lost = np.count_nonzero(near & ~inliers), np.count_nonzero(inliers & ~near)
    return bool(scipy.special.bdtrc(gained - 1, gained + lost, 0.5) < FREEDOM.false_alarms) if gained else False


def _is_deformed(found: MatchRegistration, x: Reals, y: Reals, rounding: float) -> bool:
    """Return whether matches that are of a motion, or continue its inliers, follow a smooth deformation."""
    for limit in (0.0, _OWN * found.residual):
        some = found.inliers | (np.linalg.norm(pga3.move_point(found.motor, x) - y, axis=1) < limit)
        motor = _motion_of(x, y, some)[0]
        off = np.asarray(pga3.move_point(motor, x[some])) - y[some]
        if is_bent(off.T, x[some], FREEDOM.parameters, off.size * rounding**2):
            return True
    return False


def _motion_of(x: Reals, y: Reals, inliers: Any) -> tuple[Reals, Reals]:
    """Return the motor of least squares of some of the matches, and the eigenvalues of its form."""
    form, x_mean, y_mean = form_about_means(x, y, inliers.astype(float))
    values, vectors = np.linalg.eigh(form)
    return np.asarray(kernels.motor_of_rotor(vectors[:, 0], x_mean, y_mean)), values


def _narrowed(found: MatchRegistration, x: Reals, y: Reals, rounding: float, grid: Grid) -> MatchRegistration:
    """Return a motion of a part of the inliers, if these are not the matches of one motion with normal noise.

    The residuals of one motion are nowhere denser than a normal distribution. If several similar motions were taken
    for one, the inliers of one of them are denser than that by more than chance explains. Residuals that consist of
    rounding errors are not normal, and many of them are zero.
    """
    for _ in range(_NARROWED):
        rows = np.flatnonzero(found.inliers)
        if len(rows) < 2 * _FEWEST or found.residual <= rounding:
            break
        seeds = np.random.default_rng(0).permutation(len(rows))[:_SEEDS]
        one, two = kernels.lengths_of_pairs(x[rows][seeds], y[rows][seeds], x[rows], y[rows])
        apart = np.abs(one - two)
        near = Grid(grid.step, widths(np.full(3, found.residual / np.sqrt(3))), rounding)
        best = found
        least = np.log10(FREEDOM.false_alarms)
        for part in _PARTS:
            limit = part * found.residual
            agree = (apart < limit).astype(np.float32)
            top = np.argsort(-agree.sum(1))[:_BEST]
            common = (agree[top][:, seeds] @ agree) * agree[top]
            weights = (common > 0.5 * common.max(1, keepdims=True)).astype(float)
            fitted = _fitted(x[rows], y[rows], weights, limit, None, near)
            if fitted.log_chance < least:
                best, least = fitted, fitted.log_chance
        if best is found:
            break
        inliers = np.zeros(len(x), bool)
        inliers[rows] = best.inliers
        found = replace(best, inliers=inliers, log_chance=found.log_chance)
    return found


def _fitted(x: Reals, y: Reals, weights: Reals, reach: float, tolerance: float | None, grid: Grid) -> MatchRegistration:
    """Return the best of the motions of several sets of weights, after repeated selection of inliers."""
    status = RegistrationStatus.OK
    off = np.zeros((len(weights), len(x)))
    for _ in range(_REPEATS):
        form, x_mean, y_mean = form_about_means(x, y, weights)
        vectors = np.linalg.eigh(form)[1]
        motors = kernels.motor_of_rotor(vectors[:, :, 0], x_mean, y_mean)
        off = np.linalg.norm(pga3.move_point(motors[:, None], x) - y, axis=-1)
        weights = (off < (tolerance or reach)).astype(float)
    chances, radii = log_chance(off, tolerance, grid)
    k = int(np.argmin(chances))
    chance, inliers = float(chances[k]), off[k] <= radii[k]
    motor, values = _motion_of(x, y, inliers)
    if values[1] - values[0] < NEGLIGIBLE * values[3]:
        status = RegistrationStatus.COLLINEAR
    off_one = np.linalg.norm(pga3.move_point(motor, x) - y, axis=-1)
    if tolerance is not None:
        # The motion of all inliers moves a few of them beyond the tolerance.
        inliers &= off_one <= tolerance
    residual = float(np.sqrt(np.mean(off_one[inliers] ** 2))) if inliers.any() else np.inf
    return MatchRegistration(motor, 1.0, inliers, status, residual, chance, np.zeros((0, 6)))


def _none(status: RegistrationStatus, count: int, chance: float = np.inf) -> MatchRegistration:
    return MatchRegistration(np.eye(8)[0], 1.0, np.zeros(count, bool), status, np.inf, chance, np.zeros((0, 6)))
