"""Continuous wavelets of fields in space whose parameters are conformal versors."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3, vga3

from ..arguments import Reals, real_array
from .checks import samples
from .discrete import check_finite
from .sharing import Progress, in_threads, steps


def similarity_versor(shift: ArrayLike, rotor: ArrayLike, scale: ArrayLike) -> Reals:
    """The versor of `conformal_wavelet` that scales, then turns, then shifts.

    Parameters
    ----------
    shift : array_like, (..., 3)
    rotor : array_like, (..., 4)
        Unit rotors 1 e12 e13 e23.
    scale : array_like, (...)
        Positive numbers.

    Returns
    -------
    array, (..., 16)
        Even elements of G(4,1), in the order of ``cga3.even_product``.

    Raises
    ------
    TypeError, ValueError
        Where arguments are not real numbers of these shapes, or a scale is not positive.
    """
    motor = cga3.motor_from_rotor_translation(real_array(rotor, "rotor", (4,)), real_array(shift, "shift", (3,)))
    factor = real_array(scale, "scale")
    for name, array in (("shift", shift), ("rotor", rotor), ("scale", factor)):
        check_finite(np.asarray(array), name)
    if not (factor > 0).all():
        raise ValueError("scale: a number is not positive; expected positive scales")
    dilator = cga3.dilator_from_scale(factor)
    blades = cga3.even_product.layouts["a"].blades
    parts = []
    for part, kernel in ((motor, cga3.motor_from_rotor_translation), (dilator, cga3.dilator_from_scale)):
        element = np.zeros((*part.shape[:-1], 16), part.dtype)
        element[..., [blades.index(name) for name in kernel.layouts["out"].blades]] = part
        parts.append(element)
    result: Reals = cga3.even_product(*parts)
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
    """The wavelet transform of a sampled field in space by Gabor wavelets that conformal versors move.

    Parameters
    ----------
    field : array_like, (P, 8)
        Elements of G(3), of coefficients 1 e1 e2 e3 e12 e13 e23 e123.
    points : array_like, (P, 3)
        Where they are.
    versors : array_like, (K, 16)
        Unit even versors of G(4,1), of `similarity_versor`, ``cga3.versor_exponential`` or products: similarities and
        transversions.
    frequency, sigma : float
        Of the wavelet that the versor 1 stands for: radians per unit of length along e1, and the standard deviation.
    weights : array_like, (P,) or a number
        The volume for which each point stands.
    workers : int, optional
        How many threads share the versors, counted as in `scipy.fft`; the result is the same.
    progress : function of (done, total), optional
        Called after each versor.

    Returns
    -------
    array, (K, 8)
        ``W(U) = sum f(x) ~psi(y) |dy / dx|**(1/2) weight`` with the point y of ``~U X U``, of the points X at x.

    Raises
    ------
    TypeError, ValueError
        Where arguments are not finite real numbers of these shapes, frequency or sigma are not positive, or a versor
        takes a point to infinity.

    Notes
    -----
    The wavelet is that of `clifford_wavelet`. A conformal map scales lengths at x by ``1 / |m|``, where m is the weight
    of the moved point, the coefficient of e0; so a moved wavelet has the norm of the first one, and moving field and
    wavelet alike changes nothing: ``W[V f](V U) = W[f](U)``.
    """
    field_of = ("field", field, (-1, 8), "elements of G(3)")
    known = samples(field_of, ("points", points, "points"), versors, frequency, sigma, weights)
    embedded, backward = cga3.embed_point(known.places), cga3.even_reverse(known.moves)
    result = np.empty((len(backward), 8), np.result_type(known.values, known.places, known.moves))
    told = steps(progress, len(backward))

    def compare(k: int) -> None:
        moved = cga3.transform_vector(backward[k], embedded)
        weight = moved[:, 3]
        if not np.abs(weight).min() > 0:
            raise ValueError(f"versors: number {k} takes a point of the field to infinity; expected finite points")
        share = known.weights * np.abs(weight) ** -1.5
        mother = _reversed_gabor(moved[:, :3] / weight[:, None], known.frequency, known.sigma) * share[:, None]
        result[k] = vga3.geometric_product(known.values, mother).sum(0)
        told()

    in_threads(compare, range(len(backward)), workers)
    return result


def _reversed_gabor(y: Reals, frequency: float, sigma: float) -> Reals:
    """The reverse of the wavelet, which negates e123."""
    g = np.exp(-((y / sigma) ** 2).sum(-1) / 2) / (2 * np.pi * sigma**2) ** 1.5
    result = np.zeros((len(y), 8), y.dtype)
    result[:, 0] = g * (np.cos(frequency * y[:, 0]) - np.exp(-((frequency * sigma) ** 2) / 2))
    result[:, 7] = -g * np.sin(frequency * y[:, 0])
    return result
