"""The wavelets of continuous transforms, by their Fourier transforms."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import factorial, pi, prod, sqrt
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

_MORLET = 5.0
"""Frequency of the Morlet wavelet, in radians per unit of time."""
_REACH = 8.0
"""Standard deviations beyond which a Gaussian function is below 1e-13."""
_NUMBER = r"(\d+(?:\.\d*)?|\.\d+)"
_EXPECTED = (
    "'mexican_hat', 'morlet', 'analytic_morlet', 'gaus1' to 'gaus8', 'cgau1' to 'cgau8', or 'cmorB-C', 'shanB-C' or "
    "'fbspM-B-C' with positive numbers, as in 'cmor1.5-1.0'"
)

Times = NDArray[np.float64]


@dataclass(frozen=True)
class MotherWavelet:
    """A wavelet psi.

    Attributes
    ----------
    spectrum : function
        The Fourier transform, the integral of ``psi(t) exp(-i w t)``, of the frequencies w in radians per unit of time.
    is_complex : bool
    reach : float
        Time from 0 beyond which psi is below 1e-13 of its maximum; not used if there are `values`.
    highest : float
        Frequency above which the spectrum is below 1e-13 of its maximum.
    values : function, optional
        psi of times, for wavelets that decay slowly.
    band : (float, float), optional
        The frequencies outside which the spectrum is 0.
    """

    spectrum: Callable[[Times], NDArray[Any]]
    is_complex: bool
    reach: float
    highest: float
    values: Callable[[Times], NDArray[np.complex128]] | None = None
    band: tuple[float, float] | None = None


@lru_cache
def mother_wavelet(name: str) -> MotherWavelet:
    """Return a wavelet; `ContinuousWavelet` of PyWavelets, with the same functions and signs.

    - "mexican_hat", of norm 1: ``2 / (sqrt(3) pi**(1/4)) (1 - t**2) exp(-t**2 / 2)``.
    - "morlet": ``cos(5 t) exp(-t**2 / 2)``; "analytic_morlet": ``exp(5 i t) exp(-t**2 / 2)`` without its negative
      frequencies.
    - "gausP": ``(-1)**(P // 2)`` times the P-th derivative of ``exp(-t**2)``, of norm 1.
    - "cgauP": the P-th derivative of ``exp(-i t) exp(-t**2)``, of norm 1.
    - "cmorB-C": ``exp(2 pi i C t) exp(-t**2 / B) / sqrt(pi B)``.
    - "shanB-C": ``sqrt(B) sinc(B t) exp(2 pi i C t)``, with ``sinc(x) = sin(pi x) / (pi x)``.
    - "fbspM-B-C": ``sqrt(B) sinc(B t / M)**M exp(2 pi i C t)``, with a whole number M.

    Raises
    ------
    ValueError
        If the name is unknown.
    """
    if name == "mexican_hat":
        size = sqrt(8 / 3) * pi**0.25
        return MotherWavelet(lambda w: size * w**2 * np.exp(-(w**2) / 2), False, _REACH + 1, _REACH + 1)
    if name == "morlet":
        return MotherWavelet(lambda w: sqrt(pi / 2) * (_bell(w, 1) + _bell(w, -1)), False, _REACH, _MORLET + _REACH)
    if name == "analytic_morlet":
        return MotherWavelet(lambda w: np.where(w > 0, sqrt(2 * pi) * _bell(w, 1), 0), True, _REACH, _MORLET + _REACH)
    if found := re.fullmatch("(gaus|cgau)([1-8])", name):
        return _derivative(int(found[2]), found[1] == "cgau")
    if found := re.fullmatch(f"cmor{_NUMBER}-{_NUMBER}", name):
        width, centre = float(found[1]), 2 * pi * float(found[2])
        if width > 0 and centre > 0:
            reach = _REACH * sqrt(width / 2)
            return MotherWavelet(
                lambda w: np.exp(-width * (w - centre) ** 2 / 4), True, reach, centre + _REACH * sqrt(2 / width)
            )
    if found := re.fullmatch(f"(?:shan|fbsp([1-9][0-9]*)-){_NUMBER}-{_NUMBER}", name):
        order, width, centre = int(found[1] or 1), float(found[2]), float(found[3])
        if width > 0 and centre > 0:
            return _spline(order, width, centre)
    raise ValueError(f"wavelet: {name!r}; expected {_EXPECTED}")


def _bell(w: Times, sign: int) -> Times:
    return np.asarray(np.exp(-((w - sign * _MORLET) ** 2) / 2))


def _derivative(order: int, is_complex: bool) -> MotherWavelet:
    """Return the derivative of a Gaussian function, whose frequency is -1 if it is complex."""
    centre = -1.0 if is_complex else 0.0
    # The energy is the integral of w**(2 P) exp(-(w - centre)**2 / 2) / 2: a moment of a normal distribution.
    moments = [
        factorial(2 * order) // (factorial(2 * order - 2 * k) * factorial(2 * k)) * prod(range(1, 2 * k, 2))
        for k in range(order + 1)
    ]
    energy = sqrt(pi / 2) * (sum(moments) if is_complex else moments[-1])
    factor = (1j**order if is_complex else (1j if order % 2 else 1)) * sqrt(pi / energy)
    # Powers move the maximum outwards.
    highest = sqrt(2) * _REACH + sqrt(2 * order) + 1
    reach = (_REACH + sqrt(2 * order)) / sqrt(2)
    return MotherWavelet(lambda w: factor * w**order * np.exp(-((w - centre) ** 2) / 4), is_complex, reach, highest)


def _spline(order: int, width: float, centre: float) -> MotherWavelet:
    """Return the wavelet whose spectrum is a B-spline of a whole order, 1 for a rectangle."""
    pace = 2 * pi * width / order
    spline = scipy.interpolate.BSpline.basis_element(np.arange(order + 1) - order / 2, extrapolate=False)

    def spectrum(w: Times) -> Times:
        x = (w - 2 * pi * centre) / pace
        # At its ends, a rectangle has the mean of both sides, as the sum of the samples in time.
        values = np.sign(x + 0.5) / 2 - np.sign(x - 0.5) / 2 if order == 1 else np.nan_to_num(spline(x))
        return np.asarray(sqrt(width) * (order / width) * values)

    def values(t: Times) -> NDArray[np.complex128]:
        return np.asarray(sqrt(width) * np.sinc(width * t / order) ** order * np.exp(2j * pi * centre * t))

    band = 2 * pi * (centre - width / 2), 2 * pi * (centre + width / 2)
    return MotherWavelet(spectrum, True, 0.0, band[1], values, band)
