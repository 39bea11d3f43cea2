"""Filters made of the generators of the affine plane, applied to Gaussians."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import lie_filters

from ..arguments import Reals, finite_number, positive_number
from ..scaling import back_in_range, in_range
from .checks import TRUNCATE, image_stack

GENERATORS = ("x", "y", "rotation", "dilation", "hyperbolic", "hyperbolic45")
"""``d/dx``, ``d/dy``, ``-y d/dx + x d/dy``, ``x d/dx + y d/dy``, ``x d/dx - y d/dy`` and ``y d/dx + x d/dy``."""

Generator = str | Mapping[str, float]
"""One of `GENERATORS`, or the coefficients of a sum of them, such as ``{"rotation": 1, "dilation": 0.2}``, a spiral."""


def coefficients(generator: Generator) -> NDArray[np.float64]:
    """Return the six coefficients of a generator in the order of `GENERATORS`.

    Raises
    ------
    TypeError, ValueError
        If `generator` is not one of the names or a mapping from names to finite numbers that are not all 0.
    """
    if isinstance(generator, str):
        generator = {generator: 1.0}
    if not isinstance(generator, Mapping):
        raise TypeError(
            f"generator: {generator!r}; expected one of {', '.join(GENERATORS)}, or a dict from names to numbers"
        )
    unknown = [name for name in generator if name not in GENERATORS]
    if unknown:
        raise ValueError(f"generator: {unknown[0]!r}; expected {', '.join(GENERATORS)}")
    found = np.array([finite_number(generator.get(name, 0.0), f"generator[{name!r}]") for name in GENERATORS])
    if not found.any():
        raise ValueError("generator: all coefficients are 0; expected at least one that is not 0")
    return found


def lie_filter(generator: Generator, sigma: float) -> NDArray[np.float64]:
    """Compute the filter of a generator applied to a Gaussian.

    Parameters
    ----------
    generator : str or dict
        "x", "y", "rotation", "dilation", "hyperbolic" (``x d/dx - y d/dy``), "hyperbolic45" (``y d/dx + x d/dy``), or
        the coefficients of a sum of them, such as ``{"x": 0.6, "y": 0.8}``. x runs along columns and y along rows.
    sigma : float
        Standard deviation in pixels of the Gaussian, of sum 1.

    Returns
    -------
    array, (2 R + 1, 2 R + 1)
        The filter for `convolve`, with ``R = ceil(4 sigma)``. That of the rotation is 0 up to rounding, because
        rotations leave the Gaussian as it is: use `orbit_energy` to detect invariant patterns.

    Raises
    ------
    TypeError, ValueError
        If `generator` is not one of these, or `sigma` is not a positive number.

    Notes
    -----
    Filters of size ``s sigma`` are those of size sigma at ``x / s``, divided by ``s**3`` for translations and by
    ``s**2`` for the other generators. Rotating the plane by an angle steers the pair of translations by this angle, and
    that of hyperbolic generators by twice the angle; the dilation remains.
    """
    own = coefficients(generator)
    g, x = _gaussian(positive_number(sigma, "sigma"))
    points = np.stack(np.broadcast_arrays(x, x[:, None]), -1)
    plane = g * g[:, None]
    gradient = points * (-plane / sigma**2)[..., None]
    return np.array(lie_filters.orbit_derivative(own, points, gradient))


def lie_responses(image: ArrayLike, sigma: float = 1.0) -> Reals:
    """Filter images with the filters of all six generators.

    Parameters
    ----------
    image : array_like, (..., M, N)
        Real images, mirrored at their edges.
    sigma : float
        As in `lie_filter`.

    Returns
    -------
    array, (..., 6, M, N)
        The convolutions in the order "x", "y", "rotation", "dilation", "hyperbolic", "hyperbolic45". The third one is
        0, see `lie_filter`.

    Raises
    ------
    TypeError, ValueError
        If `image` is not an array of finite real numbers with two axes or has channels, or `sigma` is not positive.

    Notes
    -----
    Eight passes along one axis compute all of them, two thirds of those of six Gaussian filters.
    """
    array, exponents = in_range(image_stack(image))
    size = positive_number(sigma, "sigma")
    g, x = _gaussian(size)
    # Correlations with odd filters of the opposite sign are convolutions.
    taps = g, g * x / size, g * x * x / size**2
    low, odd, square = (_along(array, t, -2) for t in taps)
    result = np.empty((*array.shape[:-2], 6, *array.shape[-2:]), array.dtype)
    result[..., 0, :, :] = _along(low, taps[1], -1) / size
    result[..., 1, :, :] = _along(odd, taps[0], -1) / size
    result[..., 2, :, :] = 0
    columns, rows = _along(low, taps[2], -1), _along(square, taps[0], -1)
    result[..., 3, :, :] = -columns - rows
    result[..., 4, :, :] = rows - columns
    result[..., 5, :, :] = -2 * _along(odd, taps[1], -1)
    return back_in_range(result, exponents[..., None])


@cache
def _gaussian(sigma: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a Gaussian of sum 1, and where it is sampled."""
    reach = int(np.ceil(TRUNCATE * sigma))
    x = np.arange(-reach, reach + 1.0)
    g = np.exp(-(x**2) / (2 * sigma**2))
    g /= g.sum()
    g.flags.writeable = x.flags.writeable = False
    return g, x


def _along(array: Reals, taps: NDArray[np.float64], axis: int) -> Reals:
    result: Reals = scipy.ndimage.correlate1d(array, taps, axis, mode="reflect")
    return result


def smoothed_gradient(array: Reals, sigma: float) -> tuple[Reals, Reals]:
    """Return the derivatives along columns and rows of images smoothed by a Gaussian."""
    g, x = _gaussian(sigma)
    odd = g * x
    odd = odd / (odd @ x)  # Exact for linear images, also where the Gaussian is narrow.
    low, steep = _along(array, g, -2), _along(array, odd, -2)
    return _along(low, odd, -1), _along(steep, g, -1)
