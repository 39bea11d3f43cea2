"""Fourier and wavelet transforms with values in geometric algebras."""

from .clifford_fourier import clifford_fft, iclifford_fft, ispacetime_fft, spacetime_fft
from .convolution import clifford_convolve, clifford_correlate
from .discrete import WaveletPyramid, discrete_wavelet, wavelet_filters
from .dual_tree import DualTree, dual_tree
from .quaternion_fourier import Side, iqft, irqft, qft, rqft

__all__ = [
    "DualTree",
    "Side",
    "WaveletPyramid",
    "clifford_convolve",
    "clifford_correlate",
    "clifford_fft",
    "discrete_wavelet",
    "dual_tree",
    "iclifford_fft",
    "iqft",
    "irqft",
    "ispacetime_fft",
    "qft",
    "rqft",
    "spacetime_fft",
    "wavelet_filters",
]
