"""Fourier and wavelet transforms with values in geometric algebras."""

from .quaternion_fourier import Side, iqft, qft

__all__ = ["Side", "iqft", "qft"]
