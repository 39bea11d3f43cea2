"""The fundamental matrix from seven, or from eight or more correspondences."""

from __future__ import annotations

import numpy as np

from generated import linear_views, matrices, pga3, projective3

from ..arguments import Reals
from .normalization import normalized
from .rank_two import directions, factors, of_factors

_STEPS = 30


def eight_points(first: Reals, second: Reals) -> Reals:
    """Return F of point sets (..., n, 2) by the normalised eight-point algorithm, with rank 2 and norm 1 (Hartley)."""
    equations, left, right = linear_views.epipolar_equations(first, second)
    entries, _, _ = matrices.null_vector(equations)
    return np.asarray(linear_views.fundamental_of_entries(entries, left, right))


def seven_points(first: Reals, second: Reals) -> Reals:
    """Return the one or three F (..., 3, 3, 3) of seven points (..., 7, 2); missing ones are NaN.

    They are the real roots of the cubic ``det(x A + y B) = 0`` in the null space of the seven equations.
    """
    equations, left, right = linear_views.epipolar_equations(first, second)
    # The orthogonal complement of the seven equations.
    null = np.linalg.qr(np.swapaxes(equations, -1, -2), mode="complete")[0][..., 7:]
    a, b = (null[..., k].reshape(*null.shape[:-2], 3, 3) for k in (0, 1))
    # det(x A + y B) is a cubic form, determined by its values at (1, 0), (0, 1), (1, 1) and (1, -1).
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
    """Return the F of rank 2 with the least sum of squared Sampson distances near a given one (Levenberg-Marquardt).

    ``F = U diag(1, s, 0) V'`` with rotations U and V; steps are in their six angles and s (Bartoli and Sturm 2004).
    Both images are scaled equally, so that distances keep their meaning.
    """
    size = np.sqrt(np.mean([np.var(first), np.var(second)])) or 1.0
    one, left = normalized(first, np.asarray(1 / size))
    two, right = normalized(second, np.asarray(1 / size))
    u, ratio, v = factors(np.linalg.inv(right).T @ matrix @ np.linalg.inv(left))
    damping, current = 1e-4, of_factors(u, ratio, v)
    residual = projective3.sampson_distance(current, one, two)
    cost = residual @ residual
    for _ in range(_STEPS):
        gradient = projective3.sampson_distance_gradient(current, one, two).reshape(-1, 9)
        if not np.isfinite(gradient).all():
            break  # A pixel is on both epipoles, for example if all pixels coincide.
        jacobian = gradient @ directions(u, ratio, v)
        normal, right_side = jacobian.T @ jacobian, jacobian.T @ residual
        step = -np.linalg.lstsq(normal + damping * np.diag(np.diag(normal) + 1e-300), right_side, rcond=1e-14)[0]
        trial_u, trial_v = u @ _rotation(step[:3]), v @ _rotation(step[3:6])
        trial = of_factors(trial_u, ratio + step[6], trial_v)
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


def _rotation(vector: Reals) -> Reals:
    return np.asarray(pga3.rotor_to_matrix(pga3.rotor_from_rotation_vector(vector)))


def _unit(matrix: Reals) -> Reals:
    return np.asarray(matrix / np.linalg.norm(matrix, axis=(-1, -2), keepdims=True))
