"""Fourier and wavelet transforms with values in geometric algebras."""

from .analytic import (
    Monogenic,
    analytic_signal,
    monogenic_signal,
    partial_analytic_signal,
    quaternionic_analytic_signal,
    single_orthant_signal,
    total_analytic_signal,
)
from .clifford_fourier import clifford_fft, iclifford_fft, ispacetime_fft, spacetime_fft
from .clifford_wavelet import CliffordWavelet, clifford_wavelet
from .clifford_wavelet_nd import CliffordWaveletND, clifford_wavelet_nd
from .colours import from_rgb, to_rgb
from .complex_pyramid import ComplexPyramid, complex_pyramid
from .conformal_wavelet import ConformalInverse, conformal_wavelet, iconformal_wavelet, similarity_versor
from .continuous import ContinuousWavelet, admissibility, continuous_wavelet
from .convolution import clifford_convolve, clifford_correlate
from .denoise import denoise, estimated_noise
from .discrete import WaveletPyramid, discrete_wavelet, dwt, idwt
from .dual_tree import DualTree, dual_tree
from .families import wavelet_filters, wavelet_names
from .flow import Flow, optical_flow
from .geometric_fourier import geometric_fft, igeometric_fft
from .lie_filters import lie_filter, lie_responses
from .local_phase import (
    LocalPhase,
    QuaternionLocalPhase,
    complex_gabor_bank,
    local_phase,
    quaternion_local_phase,
)
from .mother_wavelets import MotherWavelet, mother_wavelet
from .orbits import KeyPoints, key_points, orbit_energies, orbit_energy
from .packets import WaveletPackets, wavelet_packets
from .phase import Phase, gabor_bank, quaternion_phase
from .pseudoscalar_fourier import (
    iproduct_fft,
    ipseudoscalar_fft,
    ivolume_time_fft,
    product_fft,
    pseudoscalar_fft,
    real_product_fft,
    volume_time_fft,
)
from .pyramid import QuaternionPyramid
from .quaternion_fourier import Side, iqft, irqft, qft, rqft
from .scalar_convolution import convolve, correlate
from .shrinkage import (
    bayes_threshold,
    denoise_wavelet,
    noise_deviation,
    shrink,
    sure_threshold,
    universal_threshold,
)
from .similarity import similarity_distance
from .spherical_wavelet import SphereInverse, isphere_wavelet, sphere_versor, sphere_wavelet
from .stationary import StationaryWavelet, stationary_wavelet
from .stereo_matching import Disparity, disparity
from .texture import texture_features
from .vector_fields import Match, derivative_mask, divergence_and_curl, match_template

__all__ = [
    "CliffordWavelet",
    "CliffordWaveletND",
    "ComplexPyramid",
    "ConformalInverse",
    "ContinuousWavelet",
    "Disparity",
    "DualTree",
    "Flow",
    "KeyPoints",
    "LocalPhase",
    "Match",
    "Monogenic",
    "MotherWavelet",
    "Phase",
    "QuaternionLocalPhase",
    "QuaternionPyramid",
    "Side",
    "SphereInverse",
    "StationaryWavelet",
    "WaveletPackets",
    "WaveletPyramid",
    "admissibility",
    "analytic_signal",
    "bayes_threshold",
    "clifford_convolve",
    "clifford_correlate",
    "clifford_fft",
    "clifford_wavelet",
    "clifford_wavelet_nd",
    "complex_gabor_bank",
    "complex_pyramid",
    "conformal_wavelet",
    "continuous_wavelet",
    "convolve",
    "correlate",
    "denoise",
    "denoise_wavelet",
    "derivative_mask",
    "discrete_wavelet",
    "disparity",
    "divergence_and_curl",
    "dual_tree",
    "dwt",
    "estimated_noise",
    "from_rgb",
    "gabor_bank",
    "geometric_fft",
    "iclifford_fft",
    "iconformal_wavelet",
    "idwt",
    "igeometric_fft",
    "iproduct_fft",
    "ipseudoscalar_fft",
    "iqft",
    "irqft",
    "ispacetime_fft",
    "isphere_wavelet",
    "ivolume_time_fft",
    "key_points",
    "lie_filter",
    "lie_responses",
    "local_phase",
    "match_template",
    "monogenic_signal",
    "mother_wavelet",
    "noise_deviation",
    "optical_flow",
    "orbit_energies",
    "orbit_energy",
    "partial_analytic_signal",
    "product_fft",
    "pseudoscalar_fft",
    "qft",
    "quaternion_local_phase",
    "quaternion_phase",
    "quaternionic_analytic_signal",
    "real_product_fft",
    "rqft",
    "shrink",
    "similarity_distance",
    "similarity_versor",
    "single_orthant_signal",
    "spacetime_fft",
    "sphere_versor",
    "sphere_wavelet",
    "stationary_wavelet",
    "sure_threshold",
    "texture_features",
    "to_rgb",
    "total_analytic_signal",
    "universal_threshold",
    "volume_time_fft",
    "wavelet_filters",
    "wavelet_names",
    "wavelet_packets",
]
