"""Clifford wavelets in 2, 3 and 6 dimensions and on the sphere: direct sums, inverses, equivariance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.integrate
from test_wavelets_fields import PLANE, field, table, times
from test_wavelets_geometric_fourier import blades

from algorithms.wavelets import (
    clifford_wavelet,
    clifford_wavelet_nd,
    ipseudoscalar_fft,
    pseudoscalar_fft,
    sphere_versor,
    sphere_wavelet,
)
from generated import cga3, vga2, vga3
from tests.support.all_cases import all_cases


def turns(count: int) -> np.ndarray:
    return vga2.rotor_to_matrix(vga2.rotor_from_angle(np.arange(count) * 2 * np.pi / count))


def test_direct_sum_in_the_plane() -> None:
    """The field is the first factor: vectors do not commute with the wavelet's e12."""
    n, scale, angle, by = 48, 1.3, 0.7, table(PLANE, {})
    f = field(n, n, 4)
    sigma, frequency = np.array([2.0, 2.5]), 0.9
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    found = clifford_wavelet_nd(f, [scale], turn, frequency, sigma).coefficients[0, 0]
    offsets = np.stack(np.meshgrid(*([np.fft.fftfreq(n, 1 / n)] * 2), indexing="ij"), -1)
    for b in ((3, 4), (0, 0), (40, 21)):
        x = offsets @ turn / scale
        g = np.exp(-((x / sigma) ** 2).sum(-1) / 2) / (2 * np.pi * sigma.prod())
        psi = np.zeros((n, n, 4))
        psi[..., 0] = g * (np.cos(frequency * x[..., 0]) - np.exp(-((frequency * sigma[0]) ** 2) / 2))
        # The reverse negates e12.
        psi[..., 3] = -g * np.sin(frequency * x[..., 0])
        there = np.roll(f, [-k for k in b], (0, 1))
        assert np.abs(found[b] - times(there, psi, by).sum((0, 1)) / scale).max() < 1e-7 * np.abs(found).max()
        assert np.abs(found[b] - times(psi, there, by).sum((0, 1)) / scale).max() > 1e-3


def test_in_space_it_equals_the_clifford_wavelet() -> None:
    f = field(8, 9, 10, 8)
    rotors = vga3.rotor_from_rotation_vector(field(3, 3))
    reported: list[tuple[int, int]] = []
    known = clifford_wavelet(f, [1.0, 1.7], rotors, 1.2, (1.0, 1.5, 2.0), progress=lambda *done: reported.append(done))
    assert reported == [(k + 1, 2 * len(rotors)) for k in range(2 * len(rotors))]
    calls: list[tuple[int, int]] = []
    found = clifford_wavelet_nd(
        f, [1.0, 1.7], vga3.rotor_to_matrix(rotors), 1.2, (1.0, 1.5, 2.0), lambda *done: calls.append(done)
    )
    assert np.abs(found.filters - known.filters).max() < 1e-13
    assert np.abs(found.coefficients - known.coefficients).max() < 1e-13
    assert calls == [(k + 1, 6) for k in range(6)]


@pytest.mark.parametrize("size", [(20, 21), (7, 8, 6), (2, 3, 2, 2, 3, 2)])
def test_inverse_and_shifts(size: tuple[int, ...]) -> None:
    n = len(size)
    f = field(*size, 2**n)
    matrices = [np.eye(n)[np.roll(np.arange(n), k)] for k in range(n)] if n > 2 else turns(8)
    transform = clifford_wavelet_nd(f, [0.7, 1.0, 1.5], matrices, 1.5, 1.0)
    spectrum = pseudoscalar_fft(f)
    spectrum[~transform.covered] = 0
    assert transform.covered.mean() > (0.8 if n == 2 else 0.3)
    assert not transform.covered[(0,) * n]
    assert np.abs(transform.inverse() - ipseudoscalar_fft(spectrum)).max() < 1e-10
    steps = tuple(range(1, n + 1))
    moved = clifford_wavelet_nd(np.roll(f, steps, range(n)), [0.7, 1.0, 1.5], matrices, 1.5, 1.0)
    expected = np.roll(transform.coefficients, steps, range(2, n + 2))
    assert np.abs(moved.coefficients - expected).max() < 1e-12
    if n == 6:
        return
    # The inverse has the coefficients that it was computed from: the kernel reproduces.
    again = clifford_wavelet_nd(transform.inverse(), [0.7, 1.0, 1.5], matrices, 1.5, 1.0)
    seen = np.abs(again.coefficients - transform.coefficients).max()
    assert seen < 2e-3 * np.abs(transform.coefficients).max()


def test_quarter_turns_and_dilations() -> None:
    f, scales = field(9, 9, 4), [1.3]

    def turned(g: np.ndarray, first: int) -> np.ndarray:
        """Rotate a field: the value at (x, y) moves to (-y, x)."""
        return np.roll(np.flip(np.swapaxes(g, first, first + 1), first), 1, first)

    before = clifford_wavelet_nd(f, scales, turns(8)[:3], sigma=(2.0, 1.0)).coefficients
    after = clifford_wavelet_nd(turned(f, 0), scales, turns(8)[2:5], sigma=(2.0, 1.0)).coefficients
    assert np.abs(turned(before, 2) - after).max() < 1e-12
    # A smooth field, and the same twice as large: W(2a, r, 2b) is 2 W(a, r, b) in the plane.
    n = 64
    x = np.stack(np.meshgrid(*([np.arange(n) - n // 2.0] * 2), indexing="ij"), -1)
    small, large = (
        np.exp(-((x / s - [0.5, -1]) ** 2).sum(-1) / 8)[..., None] * np.array([1.0, 2, -1, 0.5]) for s in (1.0, 2.0)
    )
    one = clifford_wavelet_nd(small, [1.0], turns(5)[1:2], 0.8, 2.0).coefficients[0, 0]
    two = clifford_wavelet_nd(large, [2.0], turns(5)[1:2], 0.8, 2.0).coefficients[0, 0]
    inside = slice(n // 2 - 12, n // 2 + 13)
    twice = slice(n // 2 - 24, n // 2 + 25, 2)
    assert np.abs(two[twice, twice] - 2 * one[inside, inside]).max() < 1e-6 * np.abs(two).max()


def spread(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rotors from e1 to directions on rings, and weights of Gaussian quadrature on the sphere."""
    directions, weights = sphere(count)
    return vga3.rotor_to_matrix(vga3.rotor_between_vectors(np.array([1.0, 0, 0]), directions)), weights / (4 * np.pi)


def test_continuous_measure() -> None:
    """All rotations and scales with ``da / a**(n + 1)`` weight every frequency equally: the admissibility constant."""
    frequency, step = 1.5, 2**0.5

    def shell(s: float) -> float:
        """The mean of the squared spectrum over the sphere of radius ``exp(s)``, for deviations of 1."""
        r = np.exp(s)
        means = [np.sinh(k * r * frequency) / (k * r * frequency) for k in (2, 1)]
        return float(np.exp(-(r**2) - frequency**2) * (means[0] - 2 * means[1] + 1))

    constant = scipy.integrate.quad(shell, -15, 4, limit=200)[0]
    f = np.zeros((3, 3, 3, 8))
    scales = step ** np.arange(-16.0, 12)
    turns, weights = spread(6)
    filters = clifford_wavelet_nd(f, scales, turns, frequency, 1.0).filters
    gains = (filters**2 / scales[:, None, None, None, None] ** 3).sum(0)
    weight = np.tensordot(weights, gains, 1) * np.log(step)
    weight[0, 0, 0] = constant
    assert np.abs(weight / constant - 1).max() < 0.002


def test_types_of_six_dimensions() -> None:
    f = field(2, 2, 2, 2, 2, 2, 64).astype(np.float32)
    found = clifford_wavelet_nd(f, [1.0], np.eye(6))
    assert found.coefficients.dtype == found.inverse().dtype == np.float32
    assert len(blades(6)) == 64


def sphere(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions on rings and their areas, with Gaussian quadrature of heights."""
    heights, weights = np.polynomial.legendre.leggauss(count)
    angles = np.arange(2 * count) * np.pi / count
    flat = np.sqrt(1 - heights**2)[:, None]
    points = np.stack([flat * np.cos(angles), flat * np.sin(angles), heights[:, None] + 0 * angles], -1)
    return points.reshape(-1, 3), np.repeat(weights * np.pi / count, 2 * count)


TILT = vga3.rotor_from_rotation_vector(np.array([0.4, -0.8, 0.3]))


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.5])
def test_dilations_of_the_sphere(scale: float) -> None:
    """``t -> 2 atan(a tan(t / 2))`` maps the sphere to itself; areas change by Antoine and Vandergheynst's factor."""
    points, _ = sphere(12)
    versor = sphere_versor(np.array([1.0, 0, 0, 0]), scale)
    moved = cga3.transform_vector(versor, cga3.embed_point(points))
    x = moved[:, :3] / moved[:, 3:4]
    assert np.abs(np.linalg.norm(x, axis=-1) - 1).max() < 1e-13
    angle, there = np.arccos(points[:, 2]), np.arccos(np.clip(x[:, 2], -1, 1))
    assert np.abs(there - 2 * np.arctan(scale * np.tan(angle / 2))).max() < 1e-7
    # The inverse: 4 a**2 / ((a**2 - 1) cos t + a**2 + 1)**2.
    back = cga3.transform_vector(cga3.even_reverse(versor), cga3.embed_point(points))
    factor = 4 * scale**2 / ((scale**2 - 1) * points[:, 2] + scale**2 + 1) ** 2
    assert np.abs(back[:, 3] ** -2 / factor - 1).max() < 1e-12


def test_wavelets_on_the_sphere_preserve_the_norm_and_are_equivariant() -> None:
    points, areas = sphere(100)
    frequency, sigma = 12.0, 0.25
    versors = sphere_versor(np.stack([np.eye(4)[0], TILT, TILT]), np.array([1.0, 0.6, 1.8]))
    norms = []
    for versor in versors:
        back = cga3.transform_vector(cga3.even_reverse(versor), cga3.embed_point(points))
        x = back[:, :3] / back[:, 3:4]
        radius, angle = 2 * np.tan(np.arccos(np.clip(x[:, 2], -1, 1)) / 2), np.arctan2(x[:, 1], x[:, 0])
        wave = np.exp(1j * frequency * radius * np.cos(angle)) - np.exp(-((frequency * sigma) ** 2) / 2)
        plane = wave * np.exp(-((radius / sigma) ** 2) / 2) / (2 * np.pi * sigma**2)
        psi = plane * (1 + radius**2 / 4) / back[:, 3]
        own = sphere_wavelet(psi.real, points, versor, frequency, sigma, areas) + 1j * sphere_wavelet(
            psi.imag, points, versor, frequency, sigma, areas
        )
        norms.append(own[0])
    damping = np.exp(-((frequency * sigma) ** 2))
    expected = (1 + damping - 2 * damping**0.75) / (4 * np.pi * sigma**2)
    assert np.abs(np.array(norms) / expected - 1).max() < 1e-3
    image = np.random.default_rng(0).normal(size=len(points))
    turned = vga3.rotate_vector(TILT, points)
    scales = np.array([0.5, 1.0, 2.0])
    first = sphere_wavelet(image, points, sphere_versor(np.tile(np.eye(4)[0], (3, 1)), scales), weights=areas)
    second = sphere_wavelet(image, turned, sphere_versor(np.tile(TILT, (3, 1)), scales), weights=areas)
    assert np.abs(first - second).max() < 1e-12 * np.abs(first).max()


@all_cases(
    "call, message",
    [
        (lambda f: clifford_wavelet_nd(f[..., :3], [1.0], np.eye(2)), "field: shape .*n = 2, 3 or 6 dimensions"),
        (lambda f: clifford_wavelet_nd(f, [1.0], 2 * np.eye(2)), "turns: not orthogonal"),
        (lambda f: clifford_wavelet_nd(f, [1.0], np.eye(3)), "turns: shape"),
        (lambda f: clifford_wavelet_nd(f, [0.0], np.eye(2)), "scales: 0.0; expected a positive number"),
        (lambda f: clifford_wavelet_nd(f, [], np.eye(2)), "at least one scale"),
        (lambda f: clifford_wavelet_nd(f, [1.0], np.eye(2), sigma=(1.0,)), "2 sigmas"),
        (lambda f: clifford_wavelet_nd(f * np.nan, [1.0], np.eye(2)), "field: a number is not finite"),
        (lambda f: sphere_versor(TILT, -1.0), "scale: a number is not positive"),
        (lambda f: sphere_wavelet(f[0, :, 0], np.ones((5, 3)), np.eye(16)[0]), "directions: not of length 1"),
        (lambda f: sphere_wavelet(f[0, :, 0], np.ones((4, 3)), np.eye(16)[0]), r"directions: shape \(4, 3\)"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(field(6, 5, 4))
