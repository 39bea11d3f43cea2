"""Wavelets on the sphere, for omnidirectional images, moved by conformal versors that preserve the sphere."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import cga3

from ..arguments import Reals, positive_number, real_array
from ..precision import SINGLE
from .checks import Samples, places_of, samples
from .discrete import check_finite
from .sharing import Progress, in_threads, steps

Complexes = NDArray[np.complexfloating]

_BIVECTORS = cga3.versor_exponential.layouts["b"].blades


class SphereInverse(NamedTuple):
    """Result of `isphere_wavelet`.

    Attributes
    ----------
    image : array, (P,)
        One number for each direction.
    rank : int
        Rank of the linear system. If it is P, `image` is the unique least-squares solution; otherwise it is the
        solution of least norm.
    """

    image: Reals
    rank: int


def sphere_versor(rotor: ArrayLike, scale: ArrayLike) -> Reals:
    """Return the versor that scales on the sphere, about the direction e3, and then rotates.

    Parameters
    ----------
    rotor : array_like, (..., 4)
        Unit rotors 1 e12 e13 e23.
    scale : array_like, (...)
        Positive factors a: an angle t from e3 becomes ``2 atan(a tan(t / 2))``.

    Returns
    -------
    array, (..., 16)
        Even elements of G(4,1), ordered as in ``cga3.even_product``.

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real numbers of these shapes, or if a scale is not positive.
    """
    unit_rotor, factor = real_array(rotor, "rotor", (4,), "unit rotors"), real_array(scale, "scale")
    check_finite(unit_rotor, "rotor")
    if not ((factor > 0) & np.isfinite(factor)).all():
        raise ValueError("scale: a number is not positive and finite; expected positive scales")
    blades = cga3.even_product.layouts["a"].blades
    motor = cga3.motor_from_rotor_translation(unit_rotor, np.zeros(3, unit_rotor.dtype))
    first = np.zeros((*motor.shape[:-1], 16), motor.dtype)
    first[..., [blades.index(name) for name in cga3.motor_from_rotor_translation.layouts["out"].blades]] = motor
    # e3 (e0 + einf / 2) has square 1 and preserves e0 - einf / 2, the unit sphere: it generates a boost along e3.
    bivector = np.zeros((*factor.shape, 10), factor.dtype)
    for name, share in (("e30", 0.5), ("e3inf", 0.25)):
        bivector[..., _BIVECTORS.index(name)] = share * np.log(factor)
    result: Reals = cga3.even_product(first, cga3.versor_exponential(bivector))
    return result


def sphere_wavelet(
    image: ArrayLike,
    directions: ArrayLike,
    versors: ArrayLike,
    frequency: float = 12.0,
    sigma: float = 0.25,
    weights: ArrayLike = 1.0,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Complexes:
    """Compute the wavelet transform of an image on the sphere with Gabor wavelets that versors scale and rotate.

    Parameters
    ----------
    image : array_like, (P,)
        Real numbers.
    directions : array_like, (P, 3)
        Unit vectors: the positions of the samples.
    versors : array_like, (K, 16)
        Results of `sphere_versor`, or products of them.
    frequency, sigma : float
        Frequency of the wavelet of the identity versor, which is centred at e3, in radians per radian along e1, and its
        standard deviation, both in the plane of the stereographic projection from -e3.
    weights : array_like, (P,) or a number
        The area that each direction represents; all areas together are 4 pi.
    workers : int, optional
        Number of threads that share the versors, as in `scipy.fft`; the result does not depend on it.
    progress : function of (done, total), optional
        Called after each versor.

    Returns
    -------
    array of complex, (K,)

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real numbers of these shapes, or if directions are not of length 1.

    Notes
    -----
    ``W(U) = sum f(x) ~psi(~U x U) weight``, times the square root of the change of area by ``~U``, so that all wavelets
    have the same norm (Antoine and Vandergheynst, *Appl. Comput. Harmon. Anal.* 7:262, 1999).

    Parseval's relation holds for each degree l of spherical harmonics: the mean of ``|W|**2`` over all rotations of a
    wavelet psi is the sum of ``|f_l|**2 |psi_l|**2 / (2 l + 1)``, where f_l and psi_l are the parts of degree l. Their
    factors differ, so the inverse is a solution of linear equations, see `isphere_wavelet`.
    """
    known = _samples("image", image, directions, versors, frequency, sigma, weights)
    result = np.empty(len(known.moves), np.result_type(known.values, known.moves, np.complex64))
    wavelet, step_done = _wavelets(known), steps(progress, len(result))

    def compare(k: int) -> None:
        result[k] = (known.values * known.weights * wavelet(k)).sum()
        step_done()

    in_threads(compare, range(len(result)), workers)
    return result


def isphere_wavelet(
    coefficients: ArrayLike,
    directions: ArrayLike,
    versors: ArrayLike,
    frequency: float = 12.0,
    sigma: float = 0.25,
    weights: ArrayLike = 1.0,
    tolerance: float = 1e-10,
    workers: int | None = None,
    progress: Progress | None = None,
) -> SphereInverse:
    """Return the real image on the sphere whose `sphere_wavelet` is nearest to the given coefficients.

    Parameters
    ----------
    coefficients : array_like of complex, (K,)
        One number for each versor.
    directions, versors, frequency, sigma, weights
        As in the transform. Weights must be positive.
    tolerance : float
        Singular values below this fraction of the largest one are treated as zero.
    workers, progress
        As in `sphere_wavelet`.

    Returns
    -------
    SphereInverse
        If the rank is P, the image of a transform is recovered to rounding times the condition number of the system,
        which is less than ``1 / tolerance``.

    Raises
    ------
    TypeError, ValueError
        As in `sphere_wavelet`.

    Notes
    -----
    The result is the least-squares solution; if there are several, the one with the least weighted sum of squares. Each
    coefficient is two real equations, so K must be at least half of P for a unique solution. The time is proportional
    to ``K P min(2 K, P)``. Wavelets much narrower than the sphere have almost no constant part: without large scales
    among the versors, the mean of the image is lost, and the rank is less than P.
    """
    given = np.asanyarray(coefficients)
    if given.ndim != 1:
        raise ValueError(f"coefficients: shape {given.shape}; expected (K,), one number for each versor")
    parts = [given.real, given.imag] if given.dtype.kind == "c" else [given]
    parts = [real_array(part, "coefficients", (-1,), "numbers") for part in parts]
    known = _samples("coefficients", parts[0], directions, versors, frequency, sigma, weights)
    for part in parts[1:]:
        check_finite(part, "coefficients")
    cut = positive_number(tolerance, "tolerance")
    if not (known.weights > 0).all():
        raise ValueError("weights: a number is not positive; expected positive weights")
    roots = np.broadcast_to(np.sqrt(known.weights), len(known.places))
    count = len(known.moves)
    matrix = np.empty((2 * count, len(roots)), np.result_type(known.places, known.moves, np.float32))
    wavelet, step_done = _wavelets(known), steps(progress, count)

    def fill(k: int) -> None:
        row = wavelet(k) * roots
        matrix[k], matrix[count + k] = row.real, row.imag
        step_done()

    in_threads(fill, range(count), workers)
    numbers = np.concatenate([parts[0], parts[1] if len(parts) > 1 else 0 * parts[0]])
    solution, _, rank, _ = scipy.linalg.lstsq(matrix, numbers, cut, overwrite_a=True, check_finite=False)
    image = np.asarray(solution / roots, np.result_type(matrix, numbers))
    return SphereInverse(image, int(rank))


def _samples(
    name: str,
    values: ArrayLike,
    directions: ArrayLike,
    versors: ArrayLike,
    frequency: float,
    sigma: float,
    weights: ArrayLike,
) -> Samples:
    known = samples(
        (name, values, (-1,), "numbers"),
        ("directions", directions, 3, "unit vectors"),
        ("versors", versors, 16, "even elements of G(4,1)"),
        frequency,
        sigma,
        weights,
        name == "coefficients",
    )
    if np.abs(np.linalg.norm(known.places, axis=-1) - 1).max() > SINGLE:
        raise ValueError("directions: not of length 1; expected unit vectors")
    return known


def _wavelets(known: Samples) -> Callable[[int], Complexes]:
    """Return a function that evaluates the reverse of a wavelet in all directions, by the number of its versor."""
    wave, width = known.frequency, known.sigma
    embedded, backward = cga3.embed_point(known.places), cga3.even_reverse(known.moves)

    def wavelet(k: int) -> Complexes:
        moved = cga3.transform_vector(backward[k], embedded)
        x, weight = places_of(moved, k)
        # Near -e3, the projection tends to infinity and the Gaussian is 0.
        height = np.maximum(1 + x[:, 2], np.finfo(x.dtype).tiny ** 0.25)
        y = 2 * x[:, :2] / height[:, None]
        gauss = np.exp(-((y / width) ** 2).sum(-1) / 2) / (2 * np.pi * width**2)
        mother = gauss * (np.exp(-1j * wave * y[:, 0]) - np.exp(-((wave * width) ** 2) / 2))
        # 2 / height is the square root of the ratio of the area in the plane to the area on the sphere.
        return np.asarray(mother * (2 / height) / np.abs(weight))

    return wavelet
