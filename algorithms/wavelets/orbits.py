"""Energies of the derivatives of images along the orbits of generators, and the points where they vanish."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import lie_filters

from ..arguments import Reals, finite_number, positive_number
from ..scaling import back_in_range, in_range
from .checks import image_stack, single_image
from .lie_filters import Generator, coefficients, smoothed_gradient

_POWERS = ((2, 0), (1, 1), (1, 0), (0, 2), (0, 1), (0, 0))
"""Powers of x and y of the moments of `generated.lie_filters`."""

_SIX = ((0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 1), (2, 2, 0), (2, 0, 2))
"""The moments of `generated.lie_filters.six_orbit_energies`: the product of the gradient, and powers of x and y."""


class KeyPoints(NamedTuple):
    """Points around which an image is invariant under a generator, the most invariant first.

    Attributes
    ----------
    points : array of int, (K, 2)
        Rows and columns.
    energies : array, (K,)
        The orbit energies divided by those that gradients along the orbits would have, from 0 to 1.
    """

    points: NDArray[np.intp]
    energies: Reals


def orbit_energy(image: ArrayLike, generator: Generator, sigma: float = 1.0, window: float = 12.0) -> Reals:
    """Compute how much images change along the orbits of a generator about each pixel.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images; x runs along columns and y along rows.
    generator : str or dict
        "x", "y", "rotation", "dilation", "hyperbolic" (``x d/dx - y d/dy``), "hyperbolic45" (``y d/dx + x d/dy``), or
        the coefficients of a sum of them: ``{"rotation": 1, "dilation": k}`` is a spiral.
    sigma : float
        Standard deviation in pixels of the Gaussian that smooths the image before it is differentiated.
    window : float
        Radius in pixels of the neighbourhood. Its weights are a Gaussian of sum 1 and of standard deviation
        ``window / 3``.

    Returns
    -------
    array, (..., M, N)
        For each pixel p the sum of ``w(u) (v(u) . gradient(p + u))**2`` over the window, with the velocity v of the
        generator about p. It is 0 where the image around p is invariant: circles under rotations, rays under dilations,
        hyperbolas, lines along a translation, and spirals. Pixels outside the image contribute nothing.

    Raises
    ------
    TypeError, ValueError
        If `image` is not an array of finite real numbers with two axes or has channels, `generator` is not one of
        these, or `sigma` or `window` is not a positive number.
    """
    own = coefficients(generator)
    array, exponents = in_range(image_stack(image))
    products, radius = _products(array, positive_number(sigma, "sigma")), positive_number(window, "window")
    found = _weighted(products, lie_filters.orbit_weights(own), radius)
    return back_in_range(found, 2 * exponents)


def orbit_energies(image: ArrayLike, sigma: float = 1.0, window: float = 12.0) -> Reals:
    """Compute the orbit energies of all six generators, as `orbit_energy` does for each.

    Returns
    -------
    array, (..., 6, M, N)
        In the order "x", "y", "rotation", "dilation", "hyperbolic", "hyperbolic45".
    """
    array, exponents = in_range(image_stack(image))
    products = _products(array, positive_number(sigma, "sigma"))
    taps = _taps(positive_number(window, "window"))
    rows = {(k, n): _along(products[k], taps[n], -2) for k, n in {(k, n) for k, _, n in _SIX}}
    moments = [_along(rows[k, n], taps[m], -1) for k, m, n in _SIX]
    result = np.empty((*array.shape[:-2], 6, *array.shape[-2:]), array.dtype)
    lie_filters.six_orbit_energies(np.moveaxis(np.array(moments), 0, -1), out=np.moveaxis(result, -3, -1))
    return back_in_range(np.maximum(result, 0, out=result), 2 * exponents[..., None])


def key_points(
    image: ArrayLike,
    generator: Generator,
    sigma: float = 1.0,
    window: float = 12.0,
    threshold: float = 0.1,
    strength: float = 0.02,
) -> KeyPoints:
    """Find the points around which an image is invariant under a generator.

    Parameters
    ----------
    image, generator, sigma, window
        As in `orbit_energy`, for one image (M, N). Patterns that translations leave as they are have no centre: the
        generator must contain a rotation, dilation or hyperbolic generator.
    threshold : float
        Largest relative energy; 1/2 is that of gradients of all directions, independent of their position.
    strength : float
        Smallest energy of gradients around a point, relative to the largest one in the image, and the smallest ratio of
        both eigenvalues of the structure tensor. Straight edges have no centre, but small energies at many points.

    Returns
    -------
    KeyPoints
        Minima of the relative energy within a third of the window. None in constant images.

    Raises
    ------
    TypeError, ValueError
        As in `orbit_energy`; if the generator is a translation, or `threshold` or `strength` is not from 0 to 1.
    """
    own = coefficients(generator)
    if not own[2:].any():
        raise ValueError(
            "generator: a translation; expected a rotation, dilation or hyperbolic part, whose patterns have centres"
        )
    limits = [_share(value, name) for value, name in ((threshold, "threshold"), (strength, "strength"))]
    array, _ = in_range(single_image(image))
    products, radius = _products(array, positive_number(sigma, "sigma")), positive_number(window, "window")
    energy = _weighted(products, lie_filters.orbit_weights(own), radius)
    bound = _weighted(products, lie_filters.bound_weights(own), radius)
    strong = bound > limits[1] * bound.max()
    relative = np.divide(energy, bound, out=np.ones_like(energy), where=strong)
    near = scipy.ndimage.minimum_filter(relative, 2 * max(int(radius // 3), 1) + 1, mode="nearest")
    rows, columns = np.nonzero(
        strong & (relative == near) & (relative <= limits[0]) & _two_sided(products, radius, limits[1])
    )
    order = np.argsort(relative[rows, columns], kind="stable")
    points = np.stack([rows, columns], -1)[order]
    return KeyPoints(points, relative[rows, columns][order])


def _two_sided(products: list[Reals], radius: float, ratio: float) -> NDArray[np.bool_]:
    """Return where the smaller eigenvalue of the structure tensor, weighted by squared distances, is large enough."""
    xx, xy, yy = (
        _weighted(products, [[float(k == own and i in (0, 3)) for i in range(6)] for k in range(3)], radius)
        for own in range(3)
    )
    half, spread = (xx + yy) / 2, np.sqrt(((xx - yy) / 2) ** 2 + xy**2)
    return np.asarray(half - spread > ratio * (half + spread))


def _products(array: Reals, sigma: float) -> list[Reals]:
    x, y = smoothed_gradient(array, sigma)
    return [x * x, x * y, y * y]


def _weighted(products: list[Reals], weights: ArrayLike, radius: float) -> Reals:
    """Return the weighted sum of moments; those of equal powers of x share the passes along rows."""
    table, taps = np.asarray(weights), _taps(radius)
    along: dict[tuple[int, int], Reals] = {}
    sums: dict[int, Reals] = {}
    for k, row in enumerate(table):
        for (m, n), weight in zip(_POWERS, row, strict=True):
            if weight:
                if (k, n) not in along:
                    along[k, n] = _along(products[k], taps[n], -2)
                term = products[k].dtype.type(weight) * along[k, n]
                sums[m] = sums[m] + term if m in sums else term
    total = sum((_along(part, taps[m], -1) for m, part in sums.items()), start=np.zeros_like(products[0]))
    return np.asarray(np.maximum(total, 0))


@cache
def _taps(radius: float) -> tuple[NDArray[np.float64], ...]:
    """Return the Gaussian of the window times powers 0, 1 and 2 of the position."""
    reach = max(int(np.ceil(radius)), 1)
    x = np.arange(-reach, reach + 1.0)
    g = np.exp(-0.5 * (3 * x / radius) ** 2)
    g /= g.sum()
    return g, g * x, g * x * x


def _along(array: Reals, taps: NDArray[np.float64], axis: int) -> Reals:
    result: Reals = scipy.ndimage.correlate1d(array, taps, axis, mode="constant")
    return result


def _share(value: object, name: str) -> float:
    number = finite_number(value, name)
    if not 0 <= number <= 1:
        raise ValueError(f"{name}: {number}; expected a number from 0 to 1")
    return number
