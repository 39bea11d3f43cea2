"""Conformal wavelets against the transform over similarities, and how they follow conformal maps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.wavelets import clifford_wavelet, conformal_wavelet, similarity_versor
from generated import cga3, vga3

ROTOR = vga3.rotor_from_rotation_vector(np.array([0.3, -0.5, 0.7]))
IDENTITY = np.eye(16)[0]


def normal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def grid(n: int, step: float) -> np.ndarray:
    axis = (np.arange(n) - (n - 1) / 2) * step
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)


def transversion(c: np.ndarray) -> np.ndarray:
    """The versor ``1 + c e0`` up to its sign, from the exponential of a null bivector."""
    bivector = np.zeros(10)
    bivector[3:6] = c
    return cga3.versor_exponential(bivector)


def test_similarities_are_those_of_the_clifford_wavelet() -> None:
    """On a grid that holds the wavelet; its ends in space and in frequency are below 1e-8."""
    n, field = 32, normal(32, 32, 32, 8)
    for place in ((15, 16, 17), (16, 16, 16)):
        expected = clifford_wavelet(field, [1.3], ROTOR, 0.9, (2.0, 2.0, 2.0)).coefficients[0, 0][place]
        points = np.stack(np.meshgrid(*([np.arange(float(n))] * 3), indexing="ij"), -1).reshape(-1, 3)
        versor = similarity_versor(np.array(place, float), ROTOR, 1.3)
        found = conformal_wavelet(field.reshape(-1, 8), points, versor, 0.9, 2.0)[0]
        assert np.abs(found - expected).max() < 1e-7


def test_versors_of_similarities() -> None:
    """Scaled by 1.7, turned, shifted, as matrices do it."""
    shift, points = np.array([1.0, -2.0, 0.5]), normal(50, 3)
    moved = cga3.transform_vector(similarity_versor(shift, ROTOR, 1.7), cga3.embed_point(points))
    expected = 1.7 * vga3.rotate_vector(ROTOR, points) + shift
    assert np.abs(moved[:, :3] / moved[:, 3:4] - expected).max() < 1e-13


def test_the_transform_follows_similarities() -> None:
    """Moving points and wavelet alike, with the volumes of the points, changes nothing but the measure's root."""
    field, points, weights = normal(200, 8), normal(200, 3), np.random.default_rng(1).uniform(1, 2, 200)
    versors = similarity_versor(normal(5, 3, seed=2), np.tile(ROTOR, (5, 1)), np.linspace(0.5, 2, 5))
    move = similarity_versor(np.array([0.3, 1.0, -2.0]), vga3.rotor_from_rotation_vector(np.array([1.0, 0.2, 0])), 1.6)
    moved = cga3.transform_vector(move, cga3.embed_point(points))
    before = conformal_wavelet(field, points, versors, weights=weights)
    after = conformal_wavelet(
        field * 1.6**-1.5,
        moved[:, :3] / moved[:, 3:4],
        cga3.even_product(move, versors),
        weights=weights * 1.6**3,
    )
    assert np.abs(after - before).max() < 1e-12 * np.abs(before).max()


def test_moved_wavelets_keep_their_norm() -> None:
    """Also by transversions: the scalar part of W of a moved wavelet with itself is the norm of the first one."""
    step, sigma, frequency = 0.05, 0.25, 6.0
    points = grid(64, step)
    for versor in (
        IDENTITY,
        transversion(np.array([0.2, -0.1, 0.15])),
        similarity_versor(np.array([0.1, 0, 0]), ROTOR, 0.9),
    ):
        back = cga3.transform_vector(cga3.even_reverse(versor), cga3.embed_point(points))
        y = back[:, :3] / back[:, 3:4]
        g = np.exp(-((y / sigma) ** 2).sum(-1) / 2) / (2 * np.pi * sigma**2) ** 1.5 * np.abs(back[:, 3]) ** -1.5
        own = np.zeros((len(points), 8))
        own[:, 0] = g * (np.cos(frequency * y[:, 0]) - np.exp(-((frequency * sigma) ** 2) / 2))
        own[:, 7] = g * np.sin(frequency * y[:, 0])
        found = conformal_wavelet(own, points, versor, frequency, sigma, step**3)[0]
        damping = np.exp(-((frequency * sigma) ** 2))
        # The integral of g**2 (1 - 2 c cos + c**2), with c = exp(-(w s)**2 / 2) and g**2 a Gaussian of half the square.
        expected = (1 + damping - 2 * damping**0.5 * damping**0.25) / (8 * np.pi**1.5 * sigma**3)
        assert found[0] == pytest.approx(expected, rel=1e-3)
        assert np.abs(found[1:]).max() < 1e-12 * expected


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda f, x: conformal_wavelet(f, x[:-1], IDENTITY), r"points: shape \(9, 3\); expected \(10, 3\)"),
        (lambda f, x: conformal_wavelet(f, x * np.inf, IDENTITY), "points: a number is not finite"),
        (lambda f, x: conformal_wavelet(f, x, IDENTITY[:8]), "versors: shape .*even elements"),
        (lambda f, x: conformal_wavelet(f, x, IDENTITY, sigma=0.0), "expected positive numbers"),
        (lambda f, x: conformal_wavelet(f, x, IDENTITY, weights=np.ones(3)), "weights: shape"),
        (lambda f, x: similarity_versor(x[0], ROTOR, -1.0), "scale: a number is not positive"),
        (lambda f, x: similarity_versor(x[0], ROTOR, np.inf), "scale: a number is not finite"),
        (lambda f, x: similarity_versor(x[0] * np.nan, ROTOR, 1.0), "shift: a number is not finite"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(normal(10, 8), normal(10, 3) + 1.0)
