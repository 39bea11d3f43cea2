"""The fundamental matrix from correspondences: seven points, eight and more, and with wrong ones among them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri, fdtri

from generated import pga3, projective2, projective3

from ..arguments import Reals, real_array
from .normalization import extents, normalized, null_vectors
from .planes import linear_homography
from .robust import Problem, RobustEstimate, consensus
from .status import VisionStatus, check_points

_FLAT = 1e-7
"""Points are on a line where their extent across is below this part of that along it."""
_PLANAR = 2.0
"""A homography, or a line, that fits points within this many times their noise by F leaves F open."""
_OPEN = 1e-7
"""Equations have more than one solution where the eighth of their singular values is below this part of the first,"""
_NOISE = 1.1
"""or, where noise is unknown, below this many times the ninth: scenes seen from close places have ratios of 1.5."""
_CONFIDENCE = 0.99
"""Of planes being seen as such, if all F were as free as that of points in space."""
_SURELY = 0.999
"""Of planes being seen as such where the noise of pixels is known."""
_LIKELY = 0.99
"""Of other points that leave F open: more would refuse more scenes seen from places close to each other."""
_ROUNDING = 1e-10
"""Distances below this part of the image are rounding."""
_STEPS = 30


def eight_points(first: Reals, second: Reals) -> Reals:
    """F of point sets (..., n, 2) by the normalised eight-point algorithm, of rank 2, norm 1 (Hartley 1997)."""
    one, left = normalized(first)
    two, right = normalized(second)
    rows = projective3.epipolar_equation(one, two)
    null = null_vectors(rows, 1)[..., 0, :]
    u, s, v = np.linalg.svd(null.reshape(*null.shape[:-1], 3, 3))
    s[..., 2] = 0
    return _unit(np.swapaxes(right, -1, -2) @ (u * s[..., None, :]) @ v @ left)


def seven_points(first: Reals, second: Reals) -> Reals:
    """The one or three F (..., 3, 3, 3) of seven points (..., 7, 2), NaN where there are fewer than three.

    They are the real roots of the cubic ``det(x A + y B) = 0`` in the plane of A and B that seven equations leave.
    """
    one, left = normalized(first)
    two, right = normalized(second)
    rows = projective3.epipolar_equation(one, two)
    null = null_vectors(rows, 2)
    a, b = (null[..., k, :].reshape(*null.shape[:-2], 3, 3) for k in (0, 1))
    # det(x A + y B) is a cubic form: its coefficients from its values at (1, 0), (0, 1), (1, 1) and (1, -1).
    c3, c0, plus, minus = (np.linalg.det(m) for m in (a, b, a + b, a - b))
    c1, c2 = (plus + minus) / 2 - c3, (plus - minus) / 2 - c0
    swap = np.asarray(np.abs(c3) < np.abs(c0))
    lead = np.where(swap, c0, c3)
    lead = np.where(lead == 0, np.nan, lead)
    rest = np.where(np.expand_dims(swap, -1), np.stack([c1, c2, c3], -1), np.stack([c2, c1, c0], -1)) / lead[..., None]
    companion = np.zeros((*lead.shape, 3, 3))
    companion[..., 0, :] = -rest
    companion[..., 1, 0] = companion[..., 2, 1] = 1
    usable = np.isfinite(companion).all((-1, -2))
    roots = np.linalg.eigvals(np.where(np.expand_dims(usable, (-1, -2)), companion, np.eye(3)))
    real = (np.abs(roots.imag) <= 1e-7 * (1 + np.abs(roots.real))) & np.expand_dims(usable, -1)
    root = np.where(real, roots.real, np.nan)[..., None, None]
    mixed = np.where(
        swap[..., None, None, None],
        a[..., None, :, :] + root * b[..., None, :, :],
        root * a[..., None, :, :] + b[..., None, :, :],
    )
    return _unit(np.swapaxes(right, -1, -2)[..., None, :, :] @ mixed @ left[..., None, :, :])


def refined(matrix: Reals, first: Reals, second: Reals) -> Reals:
    """F of rank 2 with the least squares of Sampson distances near a given one (Levenberg and Marquardt).

    ``F = U diag(1, s, 0) V'`` with rotations U and V, and steps in their six angles and s (Bartoli and Sturm 2004).
    Both images are scaled alike, so that distances keep their meaning.
    """
    size = np.sqrt(np.mean([np.var(first), np.var(second)])) or 1.0
    one, left = normalized(first, np.asarray(1 / size))
    two, right = normalized(second, np.asarray(1 / size))
    u, s, v = np.linalg.svd(np.linalg.inv(right).T @ matrix @ np.linalg.inv(left))
    u, v, ratio = u * np.sign(np.linalg.det(u)), v.T * np.sign(np.linalg.det(v)), s[1] / s[0]

    def product(u: Reals, ratio: float, v: Reals) -> Reals:
        return np.asarray((u * np.array([1.0, ratio, 0.0])) @ v.T)

    damping, current = 1e-4, product(u, ratio, v)
    residual = projective3.sampson_distance(current, one, two)
    cost = residual @ residual
    for _ in range(_STEPS):
        gradient = projective3.sampson_distance_gradient(current, one, two).reshape(-1, 9)
        if not np.isfinite(gradient).all():
            break  # A pixel on both epipoles, as where all are the same.
        middle = np.diag([1.0, ratio, 0.0])
        columns = [u @ g @ middle @ v.T for g in _TURNS] + [-u @ middle @ g @ v.T for g in _TURNS]
        columns.append(np.outer(u[:, 1], v[:, 1]))
        jacobian = gradient @ np.array([c.ravel() for c in columns]).T
        normal, right_side = jacobian.T @ jacobian, jacobian.T @ residual
        step = -np.linalg.lstsq(normal + damping * np.diag(np.diag(normal) + 1e-300), right_side, rcond=1e-14)[0]
        trial_u, trial_v = u @ _rotation(step[:3]), v @ _rotation(step[3:6])
        trial = product(trial_u, ratio + step[6], trial_v)
        new = projective3.sampson_distance(trial, one, two)
        if new @ new < cost:
            better = cost - new @ new
            u, v, ratio, current, residual, cost = trial_u, trial_v, ratio + step[6], trial, new, new @ new
            damping = max(damping / 10, 1e-12)
            if better <= 1e-12 * cost:
                break
        else:
            damping *= 10
            if damping > 1e6:
                break
    return _unit(right.T @ current @ left)


def degenerate(matrix: Reals, first: Reals, second: Reals, known: float | None = None) -> Reals:
    """Whether point sets (..., n, 2) fit a homography, or a line, as well as F: then they do not determine it.

    `known` is the noise of pixels where that is known, else it is told from what F leaves. On planes that is less than
    noise has to leave, for there many F fit nearly, one of them best: with ten points two planes in a hundred are
    missed.
    """
    n = first.shape[-2]
    size = np.maximum(np.ptp(first, -2).max(-1), np.ptp(second, -2).max(-1))
    off = projective3.sampson_distance(matrix[..., None, :, :], first, second)
    noise = np.sqrt((off**2).sum(-1) / max(n - 7, 1))
    # Few points beyond seven say little about their noise: the ratio of both variances has Fisher's distribution.
    doubt = np.sqrt(fdtri(2 * n - 8, max(n - 7, 1), _CONFIDENCE))
    told = _PLANAR * noise * doubt
    if known is not None:
        # Noise of both images is in the distance of a transfer.
        told = np.full_like(noise, known * np.sqrt(2 * chdtri(2 * n - 8, 1 - _SURELY) / (2 * n - 8)))
    allowed = np.maximum(told, _ROUNDING * size)
    (thin, long), (other_thin, other_long) = extents(first), extents(second)
    # Both ways: where one image shows all much larger, distances there are larger too.
    forward, _ = linear_homography(first, second)
    planes = []
    for model, a, b in ((forward, first, second), (_inverse(forward), second, first)):
        moved = _transfer_distance(model[..., None, :, :], a, b)
        planes.append(np.sqrt((moved**2).sum(-1) / (2 * n - 8)) if n > 4 else np.zeros(moved.shape[:-1]))
    line = np.minimum(thin, other_thin) / np.sqrt(n) <= allowed
    flat = (thin <= _FLAT * long) | (other_thin <= _FLAT * other_long)
    return np.asarray(flat | line | (np.fmin(*planes) <= allowed) | _several(first, second, known))


def _several(first: Reals, second: Reals, known: float | None = None) -> Reals:
    """Whether linear equations of point sets (..., n, 2) have more than one solution: for repeated points, for example.

    Told from rounding, and from noise: with that of pixels known from what the best two solutions leave, else, for more
    than eight points, only where one leaves as much as the other.
    """
    n = first.shape[-2]
    (one, left), (two, right) = normalized(first), normalized(second)
    rows = projective3.epipolar_equation(one, two)
    if n < 8:
        return np.zeros(rows.shape[:-2], np.bool_)
    turned = np.swapaxes(rows, -1, -2)
    values = np.sqrt(np.maximum(np.linalg.eigvalsh(rows @ turned if n == 8 else turned @ rows), 0))
    several = values[..., -8] <= _OPEN * values[..., -1]
    if known is None:
        return np.asarray(several | (n > 8) & (values[..., -8] <= _NOISE * values[..., 0]))
    null = null_vectors(rows, 2)
    both = np.swapaxes(right, -1, -2)[..., None, :, :] @ null.reshape(*null.shape[:-1], 3, 3) @ left[..., None, :, :]
    off = projective3.sampson_distance(both[..., None, :, :], first[..., None, :, :], second[..., None, :, :])
    return np.asarray(several | ((off**2).sum((-1, -2)) <= known**2 * chdtri(2 * (n - 7), 1 - _LIKELY)))


def robust_fundamental_matrix(
    first: ArrayLike,
    second: ArrayLike,
    threshold: float = 1.0,
    seed: int = 0,
    confidence: float = 0.999,
    max_samples: int = 5000,
) -> RobustEstimate:
    """The fundamental matrix that most correspondences agree on.

    Samples of seven points, the best of them refined on all that agree; the last one has the least squares of Sampson
    distances.

    Parameters
    ----------
    first, second : array_like, (n, 2)
        Pixels of both images.
    threshold : float
        The Sampson distance, in pixels, from which a correspondence counts as wrong.
    seed : int
        Of the random samples; the same seed gives the same result.
    confidence : float
        With which a sample without wrong points is among those drawn.
    max_samples : int

    Returns
    -------
    RobustEstimate

    Raises
    ------
    TypeError, ValueError
        Where these are not n points each.
    """
    one, two = real_array(first, "first", (2,), "x y"), real_array(second, "second", (2,), "x y")
    status = check_points({"first": one, "second": two}, 8, "points")
    nothing = np.full((3, 3), np.nan)
    if status != VisionStatus.OK:
        return RobustEstimate(nothing, status, np.zeros(len(one), bool), np.nan, 0)

    def solve(sets: Reals) -> Reals:
        return seven_points(one[sets], two[sets]).reshape(-1, 3, 3)

    def distances(models: Reals) -> Reals:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.abs(projective3.sampson_distance(models[:, None], one, two)))

    def improve(model: Reals, inliers: Reals) -> Reals | None:
        return refined(model, one[inliers], two[inliers]) if inliers.sum() >= 8 else None

    found = consensus(Problem(len(one), 7, solve, distances, improve), threshold, seed, confidence, max_samples)
    status = found.status
    if status == VisionStatus.OK and degenerate(found.model, one[found.inliers], two[found.inliers]):
        status = VisionStatus.DEGENERATE
    if status == VisionStatus.OK:
        return found
    return RobustEstimate(nothing, status, found.inliers, found.distance, found.n_samples)


_TURNS = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]]
)


def _rotation(vector: Reals) -> Reals:
    return np.asarray(pga3.rotor_to_matrix(pga3.rotor_from_rotation_vector(vector)))


def _inverse(matrix: Reals) -> Reals:
    """Inverse homographies by cofactors, which are there for those without inverse too."""
    return np.asarray(np.swapaxes(projective2.line_homography(matrix), -1, -2))


def _transfer_distance(matrix: Reals, first: Reals, second: Reals) -> Reals:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.linalg.norm(projective2.transform_point(matrix, first) - second, axis=-1))


def _unit(matrix: Reals) -> Reals:
    return np.asarray(matrix / np.linalg.norm(matrix, axis=(-1, -2), keepdims=True))
