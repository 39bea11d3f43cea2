"""Fourier and wavelet transforms with values in geometric algebras."""

from .clifford_fourier import clifford_fft, iclifford_fft, ispacetime_fft, spacetime_fft
from .convolution import clifford_convolve, clifford_correlate
from .quaternion_fourier import Side, iqft, irqft, qft, rqft

__all__ = [
    "Side",
    "clifford_convolve",
    "clifford_correlate",
    "clifford_fft",
    "iclifford_fft",
    "iqft",
    "irqft",
    "ispacetime_fft",
    "qft",
    "rqft",
    "spacetime_fft",
]
