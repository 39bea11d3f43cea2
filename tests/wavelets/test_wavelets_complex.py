"""Complex wavelets of Magarey and Kingsbury against explicit filters, and PyWavelets on one and three axes."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.wavelets import complex_pyramid, discrete_wavelet
from algorithms.wavelets.discrete import MODES
from tests.support.all_cases import all_cases

LOW = np.array([1 - 1j, 4 - 1j, 4 + 1j, 1 + 1j]) / 10
HIGH = np.array([-1 - 2j, 5 + 2j, -5 + 2j, 1 - 2j]) / 14


def normal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def halved(f: np.ndarray, taps: np.ndarray, axis: int) -> np.ndarray:
    """Periodic filtering, downsampled by two."""
    moved = np.moveaxis(f, axis, 0)
    n = len(moved)
    rows = [sum(taps[3 - k] * moved[(2 * m + k - 1) % n] for k in range(4)) for m in range(n // 2)]
    return np.moveaxis(np.array(rows), 0, axis)


def test_bands_are_filters_and_their_conjugates() -> None:
    image = normal(16, 24)
    found = complex_pyramid(image, 2)
    same, other = image.astype(complex), image.astype(complex)
    for level in found.detail:
        for rows, columns, pair in ((HIGH, LOW, (0, 5)), (LOW, HIGH, (2, 3)), (HIGH, HIGH, (1, 4))):
            across = halved(halved(other, rows, 0), columns.conj(), 1)
            along = halved(halved(same, rows, 0), columns, 1)
            for band, expected in zip(pair, (across, along), strict=True):
                assert np.abs(level[..., band] - expected).max() < 1e-14
        other, same = halved(halved(other, LOW, 0), LOW.conj(), 1), halved(halved(same, LOW, 0), LOW, 1)
    assert np.abs(found.approx - np.stack([other, same], -1)).max() < 1e-14


def test_filters_are_nearly_gabors() -> None:
    """A Gaussian times a wave, within a few percent, with the widths and frequencies of the paper."""
    n = np.arange(-1.5, 2)
    for taps, sigma, frequency, bound in ((LOW, 0.97, 0.51, 0.03), (HIGH, 1.07, 2.39, 0.03)):
        atom = np.exp(-(n**2) / (2 * sigma**2) + 1j * frequency * n)
        share = np.vdot(atom, taps) / np.vdot(atom, atom)
        assert np.abs(taps - share * atom).max() < bound * np.abs(taps).max()


def test_directions() -> None:
    """The band of a wave is that of its angle: waves of the second level, along both diagonals."""
    x, y = np.meshgrid(np.arange(64), np.arange(64), indexing="ij")
    for sign, best in ((1, 4), (-1, 1)):
        wave = np.cos(2 * np.pi * 12 / 64 * (x + sign * y))
        energy = (np.abs(complex_pyramid(wave, 2).detail[1]) ** 2).sum((0, 1))
        assert energy.argmax() == best
        assert energy[5 - best] < 0.05 * energy[best]


@pytest.mark.parametrize("size", [(16, 24), (2, 13, 18)])
def test_the_image_is_reconstructed(size: tuple[int, ...]) -> None:
    image = normal(*size)
    pyramid = complex_pyramid(image, 2)
    assert pyramid.detail[0].shape[-1] == 6
    assert np.abs(pyramid.inverse() - image).max() < 1e-9


@all_cases("mode", MODES)
@all_cases("name", ["haar", "db3", "sym4", "coif1", "bior2.4"])
def test_signals_and_volumes_equal_those_of_pywavelets(name: str, mode: str) -> None:
    pywt = pytest.importorskip("pywt")
    signal, volume = normal(150), normal(21, 24, 33)
    found, expected = discrete_wavelet(signal, name, 3, mode), pywt.wavedec(signal, name, mode, 3)
    scale = max(np.abs(each).max() for each in expected)
    assert np.abs(found.approx - expected[0]).max() < 1e-10 * scale
    for level in range(3):
        assert np.abs(found.detail[level]["D"] - expected[3 - level]).max() < 1e-10 * scale
    levels = discrete_wavelet(volume, name, 1, mode, (0, 1, 2))
    truth = pywt.wavedecn(volume, name, mode, 1)
    scale = max(1, np.abs(truth[0]).max())
    assert np.abs(levels.approx - truth[0]).max() < 1e-10 * scale
    assert set(levels.detail[0]) == set(truth[1])
    for word, band in truth[1].items():
        assert np.abs(levels.detail[0][word] - band).max() < 1e-10 * scale
