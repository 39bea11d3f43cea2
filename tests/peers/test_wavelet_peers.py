"""Wavelets compared with PyWavelets on the same input."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from algorithms.wavelets import (
    continuous_wavelet,
    denoise_wavelet,
    dwt,
    idwt,
    shrink,
    stationary_wavelet,
    wavelet_filters,
    wavelet_names,
    wavelet_packets,
)

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


def random(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def read_only(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


INPUTS = {
    "one sample": random(1),
    "two samples": random(2),
    "odd": random(37),
    "float32": random(40).astype(np.float32),
    "read-only": read_only(random(21)),
    "Fortran": np.asfortranarray(random(14, 23)),
    "every other column": random(9, 50)[:, ::2],
    "volume": random(5, 11, 6),
}


@pytest.mark.parametrize("mode", pywt.Modes.modes)
@pytest.mark.parametrize("kind", INPUTS)
def test_one_level_equals_that_of_pywavelets(kind: str, mode: str) -> None:
    """Every mode, along every axis, and back from bands of even and odd signals."""
    x = INPUTS[kind]
    if mode in ("reflect", "antireflect") and 1 in x.shape:
        pytest.skip("PyWavelets requires two samples")
    digits = 1e-6 if x.dtype == np.float32 else 1e-14
    for name, axis in product(("haar", "db5", "rbio3.1", "coif2", "db38"), range(x.ndim)):
        own, peer = dwt(x, name, mode, axis), pywt.dwt(x.copy(), name, mode, axis)
        for one, other in zip(own, peer, strict=True):
            assert one.dtype == other.dtype and one.shape == other.shape
            # The amplification of "smooth" and "antireflect" outside grows with the length of the filter.
            assert np.abs(one - other).max() <= 20 * digits * max(1, np.abs(other).max()), (name, axis)
        back = pywt.idwt(*peer, name, mode, axis)
        assert np.abs(idwt(*peer, name, mode, axis) - back).max() <= 50 * digits * max(1, np.abs(peer[0]).max())


@pytest.mark.parametrize("name", ["haar", "db4", "bior2.6", "coif3"])
@pytest.mark.parametrize("is_tight", [False, True])
@pytest.mark.filterwarnings("ignore:norm=True")
def test_stationary_transforms_equal_those_of_pywavelets(name: str, is_tight: bool) -> None:
    x = random(48)
    found, expected = stationary_wavelet(x, name, 3, is_tight=is_tight), pywt.swt(x, name, 3, norm=is_tight)
    for level in range(3):
        assert np.abs(found.detail[level]["D"] - expected[2 - level][1]).max() < 1e-13
    assert np.abs(found.approx - expected[0][0]).max() < 1e-13
    changed = [(each[0], np.abs(each[1])) for each in expected]
    for level in range(3):
        found.detail[level]["D"][...] = changed[2 - level][1]
    assert np.abs(found.inverse() - pywt.iswt(changed, name, norm=is_tight)).max() < 1e-13
    x = random(2, 16, 24)
    found = stationary_wavelet(x, name, 2, axes=(1, 2), is_tight=is_tight)
    expected = pywt.swt2(x, name, 2, axes=(1, 2), norm=is_tight)
    for level in range(2):
        for key, band in zip("HVD", expected[1 - level][1], strict=True):
            assert np.abs(found.detail[level][key] - band).max() < 1e-13


@pytest.mark.parametrize("mode", ["symmetric", "periodization", "smooth"])
def test_packets_equal_those_of_pywavelets(mode: str) -> None:
    x = random(45)
    found, expected = wavelet_packets(x, "db3", 3, mode), pywt.WaveletPacket(x, "db3", mode, 3)
    for level in (1, 2, 3):
        assert found.paths(level) == tuple(node.path for node in expected.get_level(level, "freq"))
        for node in expected.get_level(level):
            assert np.abs(found.nodes[node.path] - node.data).max() < 1e-12
    image = random(22, 24)
    found, expected = wavelet_packets(image, "db3", 2, mode), pywt.WaveletPacket2D(image, "db3", mode, 2)
    rows = expected.get_level(2, "freq")
    assert found.paths() == tuple(node.path for row in rows for node in row)
    assert max(np.abs(found.nodes[node.path] - node.data).max() for row in rows for node in row) < 1e-12


@pytest.mark.parametrize("numbers", [random(50), random(50) + 1j * random(50, seed=1)])
def test_shrinking_equals_that_of_pywavelets(numbers: np.ndarray) -> None:
    for kind in ("soft", "hard", "garrote"):
        assert np.abs(shrink(numbers, 0.7, kind) - pywt.threshold(numbers, 0.7, kind)).max() < 1e-15
    firm = shrink(numbers, 0.5, "firm", 1.2)
    assert np.abs(firm - pywt.threshold_firm(numbers, 0.5, 1.2)).max() < 1e-15


def test_denoising_against_scikit_image() -> None:
    """BayesShrink of scikit-image on signals with jumps: its errors are larger on average."""
    skimage = pytest.importorskip("skimage.restoration")
    t = np.arange(2048) / 2048
    clean = 4 * np.sin(4 * np.pi * t) - np.sign(t - 0.3) - np.sign(0.72 - t)
    own, peer = [], []
    for seed in range(5):
        noisy = clean + 0.3 * random(2048, seed=seed)
        own.append(((denoise_wavelet(noisy, "sym8") - clean) ** 2).mean())
        peer.append(((skimage.denoise_wavelet(noisy, wavelet="sym8", rescale_sigma=False) - clean) ** 2).mean())
    assert np.mean(own) < np.mean(peer)


@pytest.mark.parametrize(
    "name", ["gaus1", "gaus2", "gaus7", "cgau3", "cgau8", "cmor1.5-1.0", "shan1.5-1.0", "fbsp2-1.5-1.0"]
)
def test_continuous_transforms_equal_those_of_pywavelets(name: str) -> None:
    """PyWavelets averages over a sample and is delayed by half a sample; the signal is modified accordingly."""
    x = np.zeros(2048)
    x[900:-900] = random(248)
    w = 2 * np.pi * np.fft.fftfreq(2048)
    late = np.fft.ifft(np.fft.fft(x) * np.sinc(w / (2 * np.pi)) * np.exp(-0.5j * w)).real
    scales = [8.0, 17.0]
    found = continuous_wavelet(late, scales, name, "periodic").coefficients
    expected = pywt.cwt(x, scales, name, method="fft", precision=16)[0]
    # PyWavelets cuts its wavelets off, at 8 or 20 units of time for those that decay slowly.
    bound = 0.05 if name[:4] in ("shan", "fbsp") else 5e-3
    assert (np.abs(found - expected).max(-1) < bound * np.abs(expected).max(-1)).all()
