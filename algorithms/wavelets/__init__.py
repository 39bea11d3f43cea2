"""Fourier and wavelet transforms with values in geometric algebras."""

from .clifford_fourier import clifford_fft, iclifford_fft, ispacetime_fft, spacetime_fft
from .clifford_wavelet import CliffordWavelet, clifford_wavelet
from .conformal_wavelet import conformal_wavelet, similarity_versor
from .convolution import clifford_convolve, clifford_correlate
from .discrete import WaveletPyramid, discrete_wavelet, wavelet_filters
from .dual_tree import DualTree, dual_tree
from .flow import Flow, optical_flow
from .phase import Phase, gabor_bank, quaternion_phase
from .pyramid import QuaternionPyramid
from .quaternion_fourier import Side, iqft, irqft, qft, rqft

__all__ = [
    "CliffordWavelet",
    "DualTree",
    "Flow",
    "Phase",
    "QuaternionPyramid",
    "Side",
    "WaveletPyramid",
    "clifford_convolve",
    "clifford_correlate",
    "clifford_fft",
    "clifford_wavelet",
    "conformal_wavelet",
    "discrete_wavelet",
    "dual_tree",
    "gabor_bank",
    "iclifford_fft",
    "iqft",
    "irqft",
    "ispacetime_fft",
    "optical_flow",
    "qft",
    "quaternion_phase",
    "rqft",
    "similarity_versor",
    "spacetime_fft",
    "wavelet_filters",
]
