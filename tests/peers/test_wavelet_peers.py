"""Wavelets compared with PyWavelets on the same input."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.wavelets import wavelet_filters, wavelet_names

pywt = pytest.importorskip("pywt")
pytestmark = pytest.mark.peers


def test_all_families_are_supported() -> None:
    assert set(wavelet_names()) == set(pywt.wavelist(kind="discrete"))


@pytest.mark.parametrize("name", wavelet_names())
def test_filters_equal_those_of_pywavelets(name: str) -> None:
    """Equal to the last digit for db and splines, to a rounding for coif; the others to the peer's error."""
    filters, peer = wavelet_filters(name), pywt.Wavelet(name).filter_bank
    own = (filters.low, filters.high, filters.low_back, filters.high_back)
    bound = {"sym": 2e-11, "coi": 2e-16, "bio": 7e-13, "rbi": 7e-13, "dme": 9e-4}.get(name[:3], 0)
    if name[:4] in ("bior", "rbio") and name[4:] not in ("4.4", "5.5", "6.8"):
        bound = 0
    assert max(np.abs(a - b).max() for a, b in zip(own, peer, strict=True)) <= bound
