"""Continuous wavelet transform of fields in the plane and in space over conformal versors, and its inverse."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import cga2, cga3, vga2, vga3

from ..arguments import Reals, positive_number, real_array
from .checks import Samples, places_of, samples
from .discrete import check_finite
from .sharing import Progress, in_threads, steps

_CONFORMAL: dict[int, Any] = {2: cga2, 3: cga3}
_ALGEBRAS: dict[int, Any] = {2: vga2, 3: vga3}
_NAMES = {2: "G(3,1)", 3: "G(4,1)"}


class ConformalInverse(NamedTuple):
    """Result of `iconformal_wavelet`.

    Attributes
    ----------
    field : array, (P, 4) or (P, 8)
        Elements of G(2) or G(3).
    rank : int
        Rank of the linear system. If it is P, `field` is the unique least-squares solution; otherwise it is the
        solution of least norm.
    """

    field: Reals
    rank: int


def similarity_versor(shift: ArrayLike, rotor: ArrayLike, scale: ArrayLike) -> Reals:
    """Return the versor of `conformal_wavelet` that scales, then rotates, then translates.

    Parameters
    ----------
    shift : array_like, (..., 2) or (..., 3)
    rotor : array_like, (..., 2) or (..., 4)
        Unit rotors 1 e12, or 1 e12 e13 e23.
    scale : array_like, (...)
        Positive numbers.

    Returns
    -------
    array, (..., 8) or (..., 16)
        Even elements of G(3,1), ordered as in ``cga2.even_product``, or of G(4,1), ordered as in ``cga3.even_product``.

    Raises
    ------
    TypeError, ValueError
        If arguments are not real numbers of these shapes, or if a scale is not positive.
    """
    place = real_array(shift, "shift", (-1,), "vectors")
    algebra = _CONFORMAL[_dimension(place, "shift")]
    unit_rotor = real_array(rotor, "rotor", (2 * place.shape[-1] - 2,), "unit rotors")
    factor = real_array(scale, "scale")
    for name, array in (("shift", place), ("rotor", unit_rotor), ("scale", factor)):
        check_finite(array, name)
    if not (factor > 0).all():
        raise ValueError("scale: a number is not positive; expected positive scales")
    motor = algebra.versor_from_motor(algebra.motor_from_rotor_translation(unit_rotor, place))
    dilator = algebra.versor_from_dilator(algebra.dilator_from_scale(factor))
    result: Reals = algebra.even_product(motor, dilator)
    return result


def conformal_wavelet(
    field: ArrayLike,
    points: ArrayLike,
    versors: ArrayLike,
    frequency: float = 1.5,
    sigma: float = 2.0,
    weights: ArrayLike = 1.0,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reals:
    """Compute the wavelet transform of a sampled field with Gabor wavelets transformed by conformal versors.

    Parameters
    ----------
    field : array_like, (P, 4) or (P, 8)
        In the plane, elements of G(2), coefficients 1 e1 e2 e12; in space, elements of G(3), coefficients
        1 e1 e2 e3 e12 e13 e23 e123.
    points : array_like, (P, 2) or (P, 3)
        Positions of the samples.
    versors : array_like, (K, 8) or (K, 16)
        Unit even versors of G(3,1) or G(4,1), from `similarity_versor`, from ``versor_exponential`` of `generated.cga2`
        or `generated.cga3`, or products of these: similarities and transversions.
    frequency, sigma : float
        Frequency of the wavelet of the identity versor, in radians per unit of length along e1, and its standard
        deviation.
    weights : array_like, (P,) or a number
        The area or volume that each point represents.
    workers : int, optional
        Number of threads that share the versors, as in `scipy.fft`; the result does not depend on it.
    progress : function of (done, total), optional
        Called after each versor.

    Returns
    -------
    array, (K, 4) or (K, 8)
        ``W(U) = sum f(x) ~psi(y) |dy / dx|**(1/2) weight``, where y is the point of ``~U X U`` and X the point at x.

    Raises
    ------
    TypeError, ValueError
        If arguments are not finite real numbers of these shapes, if `frequency` or `sigma` is not positive, or if a
        versor maps a point to infinity.

    Notes
    -----
    The wavelet is that of `clifford_wavelet_nd`, and in space that of `clifford_wavelet`. A conformal map scales
    lengths at x by ``1 / |m|``, where m is the weight of the transformed point, its coefficient of e0. Transformed
    wavelets therefore keep their norm, and transforming both field and wavelet changes nothing:
    ``W[V f](V U) = W[f](U)``. In the plane the pseudoscalar commutes with even elements only, so the field is the left
    factor.
    """
    known, dimension = _samples("field", field, points, versors, frequency, sigma, weights)
    result = np.empty((len(known.moves), 2**dimension), np.result_type(known.values, known.places, known.moves))
    wavelet, advance = _reversed_wavelets(known, dimension), steps(progress, len(known.moves))
    product = _ALGEBRAS[dimension].geometric_product

    def compare(k: int) -> None:
        scalar, pseudoscalar, share = wavelet(k)
        mother = np.zeros((len(scalar), 2**dimension), scalar.dtype)
        mother[:, 0], mother[:, -1] = scalar, pseudoscalar
        result[k] = product(known.values, mother * (known.weights * share)[:, None]).sum(0)
        advance()

    in_threads(compare, range(len(known.moves)), workers)
    return result


def iconformal_wavelet(
    coefficients: ArrayLike,
    points: ArrayLike,
    versors: ArrayLike,
    frequency: float = 1.5,
    sigma: float = 2.0,
    weights: ArrayLike = 1.0,
    tolerance: float = 1e-10,
    workers: int | None = None,
    progress: Progress | None = None,
) -> ConformalInverse:
    """Return the field whose `conformal_wavelet` is nearest to the given coefficients.

    Parameters
    ----------
    coefficients : array_like, (K, 4) or (K, 8)
        One element of G(2) or G(3) for each versor.
    points, versors, frequency, sigma, weights
        As in the transform. Weights must be positive.
    tolerance : float
        Singular values below this fraction of the largest one are treated as zero.
    workers, progress
        As in `conformal_wavelet`.

    Returns
    -------
    ConformalInverse
        The relative accuracy, with respect to the largest number, is that of rounding divided by `tolerance`.

    Raises
    ------
    TypeError, ValueError
        As in `conformal_wavelet`.

    Notes
    -----
    The result is the least-squares solution; if there are several, the one with the least weighted sum of squares.
    Multiplication by wavelets from the right acts on pairs of coefficients as on complex numbers, so one complex matrix
    of K by P numbers and its singular value decomposition suffice, in time proportional to ``K P min(K, P)``. For all
    translations on a periodic grid, `clifford_wavelet_nd` has a faster inverse.
    """
    known, dimension = _samples("coefficients", coefficients, points, versors, frequency, sigma, weights)
    cut = positive_number(tolerance, "tolerance")
    if not (known.weights > 0).all():
        raise ValueError("weights: a number is not positive; expected positive weights")
    roots = np.broadcast_to(np.sqrt(known.weights), len(known.places))
    matrix = np.empty((len(known.moves), len(roots)), np.result_type(known.places, known.moves, np.complex64))
    wavelet, advance = _reversed_wavelets(known, dimension), steps(progress, len(known.moves))

    def fill(k: int) -> None:
        scalar, pseudoscalar, share = wavelet(k)
        matrix[k] = (scalar + 1j * pseudoscalar) * (share * roots)
        advance()

    in_threads(fill, range(len(known.moves)), workers)
    algebra = _ALGEBRAS[dimension]
    numbers = np.stack([pair[:, 0] + 1j * pair[:, 1] for pair in algebra.pack_field(known.values)], -1)
    solution, _, rank, _ = scipy.linalg.lstsq(matrix, numbers, cut, overwrite_a=True, check_finite=False)
    solution = (solution / roots[:, None]).astype(np.result_type(matrix, numbers))
    field = algebra.unpack_field(*(np.stack([part.real, part.imag], -1) for part in solution.T))
    return ConformalInverse(np.asarray(field), int(rank))


def _samples(
    name: str,
    values: ArrayLike,
    points: ArrayLike,
    versors: ArrayLike,
    frequency: float,
    sigma: float,
    weights: ArrayLike,
) -> tuple[Samples, int]:
    """Return the validated arguments and the dimension of the space."""
    dimension = _dimension(real_array(points, "points", (-1, -1), "points x y or x y z"), "points")
    meaning = f"elements of G({dimension})"
    given = (name, values, (-1, 2**dimension), meaning)
    moves = ("versors", versors, 2 ** (dimension + 1), f"even elements of {_NAMES[dimension]}")
    places = ("points", points, dimension, "points")
    return samples(given, places, moves, frequency, sigma, weights, name == "coefficients"), dimension


def _dimension(array: Reals, name: str) -> int:
    if array.shape[-1] not in _CONFORMAL:
        raise ValueError(f"{name}: shape {array.shape}; expected (..., 2), in the plane, or (..., 3), in space")
    return int(array.shape[-1])


def _reversed_wavelets(known: Samples, dimension: int) -> Callable[[int], tuple[Reals, Reals, Reals]]:
    """Return a function that evaluates the reverse of a wavelet at all points, by the number of its versor.

    The reverse negates the pseudoscalar. The function returns the scalar and the pseudoscalar part of the reverse of
    psi(y), and ``|dy / dx|**(1/2)``.
    """
    algebra = _CONFORMAL[dimension]
    embedded, backward = algebra.embed_point(known.places), algebra.even_reverse(known.moves)
    frequency, sigma = known.frequency, known.sigma

    def wavelet(k: int) -> tuple[Reals, Reals, Reals]:
        moved = algebra.transform_vector(backward[k], embedded)
        y, weight = places_of(moved, k)
        g = np.exp(-((y / sigma) ** 2).sum(-1) / 2) / (2 * np.pi * sigma**2) ** (dimension / 2)
        scalar = g * (np.cos(frequency * y[:, 0]) - np.exp(-((frequency * sigma) ** 2) / 2))
        return scalar, -g * np.sin(frequency * y[:, 0]), np.abs(weight) ** (-dimension / 2)

    return wavelet
