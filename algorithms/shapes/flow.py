"""Generalised gradient vector flow (section 17.1.1), and samples along its streamlines."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import shapes

from ..arguments import Reals, finite, positive_number, real_array, whole_number
from ..precision import TINY
from .images import checked_image, checked_spacing

_FACTOR, _SPREAD = 4.0, 16.0
"""Limits on work: the factor between lengths of pseudo time, of which short ones damp fine errors and long ones spread
the flow, and the part of the squared side of the image that the longest one is."""


def gradient_vector_flow(
    image: ArrayLike, sharpness: float = 0.05, sweeps: int = 24, sigma: float = 1.0, spacing: ArrayLike = (1, 1, 1)
) -> Reals:
    """Compute the generalised gradient vector flow of the edges of an image.

    The flow v is the steady state of ``g laplacian(v) - (1 - g) (v - grad f)`` with the edge map f, the length of the
    gradient scaled to [0, 1], and ``g = exp(-|grad f| / sharpness)``: near edges it is the gradient of f, elsewhere it
    is smooth. It is computed by alternating directions (Douglas), implicitly along one axis at a time.

    Parameters
    ----------
    image : array_like, (rows, columns) or (slices, rows, columns)
    sharpness : float, optional
    sweeps : int, optional
        Number of implicit steps. With 24, a star in images of 96 to 256 pixels differs from the solution of the linear
        equations by at most 0.5 %, and by 0.1 % with 48.
    sigma : float, optional
        Standard deviation of the Gaussian by which the image is smoothed, in pixels.
    spacing : array_like, (axes,), optional

    Returns
    -------
    array, (axes, ...)
        In units of the inverse spacing.
    """
    array = checked_image(image, "image", (2, 3)).astype(float)
    if min(array.shape) < 2:
        raise ValueError(f"image: shape {array.shape}; expected axes of at least 2, which have a gradient")
    step = checked_spacing(spacing, array.ndim)
    positive_number(sharpness, "sharpness")
    whole_number(sweeps, "sweeps")
    force, g = forces(array, sharpness, sigma, step)
    flow = force.copy()
    times = _times(array.shape, step)
    for k in range(sweeps):
        flow = _swept(flow, force, g, times[k % len(times)], step)
    return np.asarray(flow)


def _times(shape: tuple[int, ...], step: Reals) -> Reals:
    """Return lengths of pseudo time from that of neighbours to that of the whole image."""
    shortest = min(_FACTOR, _FACTOR * float(step.min()) ** 2)
    longest = max(_FACTOR, float((np.array(shape) * step).max()) ** 2 / _SPREAD)
    return np.asarray(shortest * _FACTOR ** np.arange(1 + round(float(np.log(longest / shortest) / np.log(_FACTOR)))))


def forces(image: Reals, sharpness: float, sigma: float, step: Reals) -> tuple[Reals, Reals]:
    """Return the gradient of the edge map, and the weight of smoothness."""
    orders = np.eye(image.ndim, dtype=int)
    slopes = [scipy.ndimage.gaussian_filter(image, sigma, order) / step[a] for a, order in enumerate(orders)]
    edges = np.linalg.norm(slopes, axis=0)
    force = np.stack(np.gradient(edges / max(float(edges.max()), TINY), *step))
    return force, np.exp(-np.sqrt((force**2).sum(0)) / sharpness)


def _swept(flow: Reals, force: Reals, g: Reals, time: float, step: Reals) -> Reals:
    """Return the flow after one implicit step; a steady state is not changed."""
    axes = g.ndim
    h = (1 - g) / axes
    changes = [g * second_difference(flow, a + 1) / step[a] ** 2 - h * flow for a in range(axes)]
    found = flow + time * (sum(changes) + (1 - g) * force)
    for a in range(axes):
        found = _implicit(found - time * changes[a], g * (time / step[a] ** 2), 1 + time * h, a)
    return np.asarray(found)


def _implicit(right: Reals, weight: Reals, middle: Reals, axis: int) -> Reals:
    """Solve ``middle x - weight x'' = right`` along an axis, with no flow across the border."""
    w, m = np.moveaxis(weight, axis, -1), np.moveaxis(middle, axis, -1)
    diagonal = m + 2 * w
    diagonal[..., 0] -= w[..., 0]
    diagonal[..., -1] -= w[..., -1]
    found = shapes.solve_tridiagonal(-w, diagonal, -w, np.moveaxis(right, axis + 1, -1))
    return np.moveaxis(found, -1, axis + 1)


def second_difference(x: Reals, axis: int) -> Reals:
    """Return the second differences along an axis, with mirrored borders."""
    return np.asarray(scipy.ndimage.correlate1d(x, [1.0, -2.0, 1.0], axis=axis, mode="nearest"))


def streamline_samples(flow: Reals, starts: Reals, count: int = 60, length: float = 0.5) -> tuple[Reals, Reals]:
    """Move points along streamlines to where the flow converges.

    Steps follow the direction of the flow by the midpoint rule; where it turns back, they are halved.

    Parameters
    ----------
    flow : array, (axes, ...)
    starts : array, (n, axes)
        In pixels.
    count : int, optional
        Steps.
    length : float, optional
        Of a step in pixels.

    Returns
    -------
    samples : array, (n, axes)
    turned : array of bool, (n,)
        Whether the flow turned back, so that the sample is where streamlines converge.
    """
    field = finite(real_array(flow, "flow", (-1, -1, -1), "vectors of two or three axes").astype(float), "flow")
    if field.ndim not in (3, 4) or len(field) != field.ndim - 1:
        raise ValueError(f"flow: shape {field.shape}; expected (2, rows, columns) or (3, slices, rows, columns)")
    at = np.array(real_array(starts, "starts", (-1, len(field)), "points"), float)
    if at.ndim != 2:
        raise ValueError(f"starts: shape {at.shape}; expected (n, {len(field)})")
    whole_number(count, "count")
    steps = np.full(len(at), positive_number(length, "length"))
    turned = np.zeros(len(at), bool)
    before = np.zeros_like(at)
    limit = np.array(field.shape[1:]) - 1.0
    for _ in range(count):
        half = np.clip(at + steps[:, None] / 2 * _direction(field, at), 0, limit)
        direction = _direction(field, half)
        back = (direction * before).sum(1) < 0
        turned |= back
        steps[back] /= 2
        at = np.clip(at + steps[:, None] * direction, 0, limit)
        before = direction
    return at, turned


def _direction(flow: Reals, at: Reals) -> Reals:
    found = np.stack([scipy.ndimage.map_coordinates(part, at.T, order=1, mode="nearest") for part in flow], -1)
    return np.asarray(found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), TINY))
