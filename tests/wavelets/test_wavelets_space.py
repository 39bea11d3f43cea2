"""Clifford wavelets in space against direct sums, and their equivariance under shifts and rotations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from algorithms.wavelets import clifford_fft, clifford_wavelet, iclifford_fft
from generated import vga3
from tests.support.all_cases import all_cases

QUARTER = vga3.rotor_from_axis_angle(np.array([0.0, 0.0, 1.0]), np.pi / 2)
NO_TURN = np.array([1.0, 0, 0, 0])


def field(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(*shape, 8))


def directions() -> np.ndarray:
    """Rotors that take e1 to the twelve corners of an icosahedron."""
    golden = (1 + 5**0.5) / 2
    corners = [np.roll([0, a, b * golden], k) for k in range(3) for a in (-1, 1) for b in (-1, 1)]
    return vga3.rotor_between_vectors(np.array([1.0, 0, 0]), np.array(corners, float))


def wavelet(x: np.ndarray, frequency: float, sigma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Scalar and e123 part of the Gabor wavelet at places x."""
    g = np.exp(-((x / sigma) ** 2).sum(-1) / 2) / ((2 * np.pi) ** 1.5 * sigma.prod())
    return g * (np.cos(frequency * x[..., 0]) - np.exp(-((frequency * sigma[0]) ** 2) / 2)), g * np.sin(
        frequency * x[..., 0]
    )


def test_direct_sum() -> None:
    """In space, with the wavelet of the definition, rotated by scipy; its tails in both domains are below 1e-8."""
    f, n, scale, sigma = field(32, 32, 32), 32, 1.3, np.array([2.0, 1.95, 2.05])
    turn = Rotation.from_rotvec([0.3, -0.5, 0.7])
    rotor = vga3.rotor_from_rotation_vector(turn.as_rotvec())
    found = clifford_wavelet(f, [scale], rotor, 0.9, tuple(sigma)).coefficients[0, 0]
    offsets = np.stack(np.meshgrid(*([np.fft.fftfreq(n, 1 / n)] * 3), indexing="ij"), -1)
    for b in ((3, 4, 5), (0, 0, 0), (20, 11, 2)):
        x = turn.inv().apply(offsets.reshape(-1, 3)).reshape(offsets.shape) / scale
        real, imaginary = wavelet(x, 0.9, sigma)
        psi = np.zeros((n, n, n, 8))
        # The reverse negates e123.
        psi[..., 0], psi[..., 7] = real, -imaginary
        there = np.roll(f, [-k for k in b], (0, 1, 2))
        expected = vga3.geometric_product(there, psi).sum((0, 1, 2)) * scale**-1.5
        assert np.abs(found[b] - expected).max() < 1e-7 * np.abs(found).max()


def test_equivariant_under_shifts_and_quarter_turns() -> None:
    f = field(8, 8, 6)
    sigma = (2.0, 1.5, 1.0)
    before = clifford_wavelet(f, [1.0, 1.7], directions()[:3], sigma=sigma).coefficients
    moved = clifford_wavelet(np.roll(f, (1, 2, 3), (0, 1, 2)), [1.0, 1.7], directions()[:3], sigma=sigma).coefficients
    assert np.abs(np.roll(before, (1, 2, 3), (2, 3, 4)) - moved).max() < 1e-13
    # For odd sizes, a grid rotated about its first point is the same grid.
    f = field(9, 9, 5)

    def turned(g: np.ndarray, first: int) -> np.ndarray:
        """Rotate a field: the value at (x, y) moves to (-y, x)."""
        return np.roll(np.flip(np.swapaxes(g, first, first + 1), first), 1, first)

    turns = [vga3.rotor_product(QUARTER, r) for r in directions()[:3]]
    first = clifford_wavelet(f, [1.3], directions()[:3], sigma=sigma).coefficients
    second = clifford_wavelet(turned(f, 0), [1.3], turns, sigma=sigma).coefficients
    assert np.abs(turned(first, 2) - second).max() < 1e-12


def test_inverse_on_the_covered_frequencies() -> None:
    f = field(16, 15, 12)
    transform = clifford_wavelet(f, [0.7, 1.0, 1.4, 2.0], directions(), 1.5, (1.0, 1.0, 1.0))
    assert transform.covered.mean() > 0.9
    assert not transform.covered[0, 0, 0]
    spectrum = clifford_fft(f)
    spectrum[~transform.covered] = 0
    assert np.abs(transform.inverse() - iclifford_fft(spectrum)).max() < 1e-10
    single = clifford_wavelet(f.astype(np.float32), [1.0], NO_TURN)
    assert single.coefficients.dtype == single.inverse().dtype == np.float32


def test_a_wave_matches_the_wavelet_of_its_frequency_and_direction() -> None:
    x = np.arange(24)
    wave = np.zeros((24, 24, 24, 8))
    wave[..., 2] = np.cos(2 * np.pi * 3 * x / 24)[:, None]
    found = clifford_wavelet(wave, [0.5, 1.0, 2.0], [NO_TURN, QUARTER], 2 * np.pi * 3 / 24, (8.0, 8.0, 8.0))
    energy = (found.coefficients**2).sum((2, 3, 4, 5)) / np.array([0.5, 1.0, 2.0])[:, None] ** 3
    assert np.unravel_index(energy.argmax(), energy.shape) == (1, 1)
    assert energy[1, 1] > 0.99 * energy.sum()


@all_cases(
    "call, message",
    [
        (lambda f: clifford_wavelet(f[..., :4], [1.0], NO_TURN), "field: shape .*fields L M N 8"),
        (lambda f: clifford_wavelet(f[None], [1.0], NO_TURN), "expected one field L M N 8"),
        (lambda f: clifford_wavelet(f * np.nan, [1.0], NO_TURN), "field: a number is not finite"),
        (lambda f: clifford_wavelet(f, [-1.0], NO_TURN), "scales: -1.0; expected a positive number"),
        (lambda f: clifford_wavelet(f, [], NO_TURN), "at least one scale"),
        (lambda f: clifford_wavelet(f, [1.0], 2 * NO_TURN), "rotors: not of norm 1"),
        (lambda f: clifford_wavelet(f, [1.0], NO_TURN, 0.0), "frequency: 0.0"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(field(4, 5, 6))
