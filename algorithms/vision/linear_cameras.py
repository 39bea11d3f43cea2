"""Cameras from points and their images by linear equations (direct linear transform)."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals


def unit_moments(points: Reals) -> tuple[Reals, Reals]:
    """Return points (n, 4) in a frame in which their second moments are the unit matrix, and the root of the moments.

    In this frame the equations for cameras are evenly scaled.
    """
    root = np.linalg.cholesky(points.T @ points / len(points) + 1e-14 * np.eye(4) * (points**2).mean())
    return np.linalg.solve(root, points.T).T, root


def camera_equations(image: Reals, points: Reals) -> Reals:
    """Return equations (..., 2 n, 12) for cameras that map points (..., n, 4) to pixels (..., n, 2)."""
    x = np.broadcast_to(points, (*image.shape[:-1], 4))
    nothing = np.zeros_like(x)
    rows = [[x, nothing, -image[..., :1] * x], [nothing, x, -image[..., 1:] * x]]
    return np.concatenate([np.concatenate(row, -1) for row in rows], -2)


def linear_cameras_of(image: Reals, weights: Reals, points: Reals) -> Reals:
    """Return cameras (v, 3, 4) from pixels (v, n, 2) of points (n, 4), with weights (v, n)."""
    x, root = unit_moments(points)
    rows = camera_equations(image, x) * np.concatenate([weights, weights], -1)[..., None]
    triangle = np.linalg.qr(rows, mode="r")
    found = np.linalg.svd(triangle)[2][:, -1].reshape(-1, 3, 4)
    return np.asarray(np.linalg.solve(root.T, np.swapaxes(found, 1, 2)).swapaxes(1, 2))
