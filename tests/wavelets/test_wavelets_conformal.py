"""Conformal wavelets against the transform over similarities, and their equivariance under conformal maps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.wavelets import (
    clifford_wavelet,
    clifford_wavelet_nd,
    conformal_wavelet,
    iconformal_wavelet,
    similarity_versor,
)
from generated import cga2, cga3, vga2, vga3
from tests.support.all_cases import all_cases

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


def test_similarities_equal_the_clifford_wavelet() -> None:
    """On a grid that contains the wavelet; its tails in space and in frequency are below 1e-8."""
    n, field = 32, normal(32, 32, 32, 8)
    for place in ((15, 16, 17), (16, 16, 16)):
        expected = clifford_wavelet(field, [1.3], ROTOR, 0.9, (2.0, 2.0, 2.0)).coefficients[0, 0][place]
        points = np.stack(np.meshgrid(*([np.arange(float(n))] * 3), indexing="ij"), -1).reshape(-1, 3)
        versor = similarity_versor(np.array(place, float), ROTOR, 1.3)
        found = conformal_wavelet(field.reshape(-1, 8), points, versor, 0.9, 2.0)[0]
        assert np.abs(found - expected).max() < 1e-7


def test_versors_of_similarities() -> None:
    """Versors scale by 1.7, rotate and translate like matrices."""
    shift, points = np.array([1.0, -2.0, 0.5]), normal(50, 3)
    moved = cga3.transform_vector(similarity_versor(shift, ROTOR, 1.7), cga3.embed_point(points))
    expected = 1.7 * vga3.rotate_vector(ROTOR, points) + shift
    assert np.abs(moved[:, :3] / moved[:, 3:4] - expected).max() < 1e-13


def test_the_transform_is_equivariant_under_similarities() -> None:
    """Moving points, their volumes and the wavelet together changes results only by the square root of the measure."""
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


def test_moved_wavelets_preserve_their_norm() -> None:
    """Also for transversions, the scalar part of W of a moved wavelet with itself is the norm of the original."""
    step, sigma, frequency = 0.08, 0.25, 6.0
    points = grid(40, step)
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


def general_versors(dimension: int, count: int, seed: int = 3) -> np.ndarray:
    """Similarities after transversions."""
    rng = np.random.default_rng(seed)
    algebra = cga2 if dimension == 2 else cga3
    bivectors = np.zeros((count, 6 if dimension == 2 else 10))
    first = 1 if dimension == 2 else 3
    bivectors[:, first : first + dimension] = 0.1 * rng.normal(size=(count, dimension))
    rotors = (
        vga2.rotor_from_angle(rng.uniform(-3, 3, count))
        if dimension == 2
        else vga3.rotor_from_rotation_vector(rng.normal(size=(count, 3)))
    )
    moves = similarity_versor(2 * rng.normal(size=(count, dimension)), rotors, np.exp(rng.uniform(-1.5, 0.5, count)))
    return np.asarray(algebra.even_product(moves, algebra.versor_exponential(bivectors)))


def test_the_plane_by_explicit_formulas() -> None:
    """Maps as explicit formulas, and products with ``a + b e12`` from the right, coefficient by coefficient."""
    field, points, weights = normal(40, 4), normal(40, 2, seed=1), np.random.default_rng(2).uniform(1, 2, 40)
    shift, angle, scale, b = np.array([0.3, -0.8]), 0.7, 1.4, np.array([0.1, -0.05])
    frequency, sigma = 1.2, 0.9
    # The transversion 1 + b e0 takes x to (x - x**2 b) / (1 - 2 b . x + b**2 x**2).
    bent = cga2.versor_from_transversor(cga2.transversor_from_vector(b))
    versor = cga2.even_product(similarity_versor(shift, vga2.rotor_from_angle(angle), scale), bent)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    z = (points - shift) @ turn / scale
    square = (z**2).sum(-1)
    d = 1 + 2 * z @ b + b @ b * square
    y = (z + square[:, None] * b) / d[:, None]
    share = weights / (scale * np.abs(d))
    g = np.exp(-(y**2).sum(-1) / (2 * sigma**2)) / (2 * np.pi * sigma**2) * share
    even = g * (np.cos(frequency * y[:, 0]) - np.exp(-((frequency * sigma) ** 2) / 2))
    odd = -g * np.sin(frequency * y[:, 0])
    one, e1, e2, e12 = field.T
    expected = [one * even - e12 * odd, e1 * even - e2 * odd, e2 * even + e1 * odd, e12 * even + one * odd]
    found = conformal_wavelet(field, points, versor, frequency, sigma, weights)[0]
    assert np.abs(found - np.sum(expected, -1)).max() < 1e-14
    assert np.ptp(np.abs(d)) > 0.3


def test_similarities_of_the_plane_equal_the_clifford_wavelet() -> None:
    n, field, angle = 40, normal(40, 40, 4), 0.6
    turn = vga2.rotor_to_matrix(vga2.rotor_from_angle(angle))
    expected = clifford_wavelet_nd(field, [1.3], turn, 0.9, 2.0).coefficients[0, 0]
    points = np.stack(np.meshgrid(*([np.arange(float(n))] * 2), indexing="ij"), -1).reshape(-1, 2)
    for place in ((19, 20), (20, 21)):
        versor = similarity_versor(np.array(place, float), vga2.rotor_from_angle(angle), 1.3)
        found = conformal_wavelet(field.reshape(-1, 4), points, versor, 0.9, 2.0)[0]
        assert np.abs(found - expected[place]).max() < 1e-7


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_transform_is_equivariant_under_conformal_maps(dimension: int) -> None:
    """Also under transversions: fields are divided by the square root of the growth of areas or volumes."""
    algebra = cga2 if dimension == 2 else cga3
    field, points = normal(150, 2**dimension), normal(150, dimension, seed=1)
    weights = np.random.default_rng(2).uniform(1, 2, 150)
    versors, (move,) = general_versors(dimension, 6), general_versors(dimension, 1, seed=8)
    moved = algebra.transform_vector(move, algebra.embed_point(points))
    places = moved[:, :dimension] / moved[:, dimension, None]
    growth = np.abs(moved[:, dimension]) ** -dimension
    before = conformal_wavelet(field, points, versors, 1.2, 0.8, weights)
    product = algebra.even_product(move, versors)
    after = conformal_wavelet(field / np.sqrt(growth)[:, None], places, product, 1.2, 0.8, weights * growth)
    assert np.abs(after - before).max() < 1e-11 * np.abs(before).max()
    assert np.ptp(growth) > 0.1 * growth.mean()


def test_moved_wavelets_of_the_plane_preserve_their_norm() -> None:
    step, sigma, frequency = 0.02, 0.25, 6.0
    axis = (np.arange(301) - 150) * step
    points = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)
    rotor = vga2.rotor_from_angle(0.4)
    bent = cga2.versor_exponential(np.array([0, 0.15, -0.1, 0, 0, 0]))
    for versor in (np.eye(8)[0], bent, similarity_versor(np.array([0.1, 0.2]), rotor, 0.9)):
        back = cga2.transform_vector(cga2.even_reverse(versor), cga2.embed_point(points))
        y = back[:, :2] / back[:, 2:3]
        g = np.exp(-((y / sigma) ** 2).sum(-1) / 2) / (2 * np.pi * sigma**2) / np.abs(back[:, 2])
        own = np.zeros((len(points), 4))
        own[:, 0] = g * (np.cos(frequency * y[:, 0]) - np.exp(-((frequency * sigma) ** 2) / 2))
        own[:, 3] = g * np.sin(frequency * y[:, 0])
        found = conformal_wavelet(own, points, versor, frequency, sigma, step**2)[0]
        damping = np.exp(-((frequency * sigma) ** 2))
        expected = (1 + damping - 2 * damping**0.75) / (4 * np.pi * sigma**2)
        assert found[0] == pytest.approx(expected, rel=1e-3)
        assert np.abs(found[1:]).max() < 1e-12 * expected


@pytest.mark.parametrize("dimension", [2, 3])
def test_fields_are_reconstructed(dimension: int) -> None:
    """With more versors than points; with errors, the nearest field; with fewer versors, the smallest."""
    field, points = normal(40, 2**dimension), 2 * normal(40, dimension, seed=1)
    weights = np.random.default_rng(2).uniform(0.5, 2, 40)
    versors, options = general_versors(dimension, 160), (2.0, 0.7, weights)
    reported: list[tuple[int, int]] = []
    known = conformal_wavelet(field, points, versors, *options)
    found = iconformal_wavelet(
        known, points, versors, *options, workers=2, progress=lambda done, total: reported.append((done, total))
    )
    assert found.rank == 40 and np.abs(found.field - field).max() < 1e-10 and reported[-1] == (160, 160)

    wrong = known + 0.1 * normal(*known.shape, seed=4)
    nearest = iconformal_wavelet(wrong, points, versors, *options).field
    least = ((conformal_wavelet(nearest, points, versors, *options) - wrong) ** 2).sum()
    for seed in range(20):
        other = nearest + 1e-3 * normal(*field.shape, seed=seed)
        assert ((conformal_wavelet(other, points, versors, *options) - wrong) ** 2).sum() > least

    few = iconformal_wavelet(known[:25], points, versors[:25], *options)
    # Wavelets that are far from all points give zero.
    assert 20 <= few.rank <= 25
    assert np.abs(conformal_wavelet(few.field, points, versors[:25], *options) - known[:25]).max() < 1e-9
    assert (weights[:, None] * few.field**2).sum() < (weights[:, None] * field**2).sum()


@pytest.mark.slow
@pytest.mark.parametrize("dimension", [2, 3])
def test_fields_in_single_precision(dimension: int) -> None:
    field, points, versors = (
        normal(40, 2**dimension),
        2 * normal(40, dimension, seed=1),
        general_versors(dimension, 160),
    )
    known = conformal_wavelet(field, points, versors, 2.0, 0.7)
    single = iconformal_wavelet(*(each.astype(np.float32) for each in (known, points, versors)), 2.0, 0.7)
    assert np.abs(single.field - field).max() < 1e-3


@all_cases(
    "call, message",
    [
        (lambda f, x: conformal_wavelet(f, x[:-1], IDENTITY), r"points: shape \(9, 3\); expected \(10, 3\)"),
        (lambda f, x: conformal_wavelet(f, x * np.inf, IDENTITY), "points: a number is not finite"),
        (lambda f, x: conformal_wavelet(f, x, IDENTITY[:8]), "versors: shape .*even elements"),
        (lambda f, x: conformal_wavelet(f, x, IDENTITY, sigma=0.0), "expected a positive number"),
        (lambda f, x: conformal_wavelet(f, x, IDENTITY, weights=np.ones(3)), "weights: shape"),
        (lambda f, x: conformal_wavelet(f, x[:, :2], IDENTITY), r"field: shape .*elements of G\(2\)"),
        (lambda f, x: conformal_wavelet(f[:, :4], x[:, :2], IDENTITY), r"versors: shape .*even elements of G\(3,1\)"),
        (
            lambda f, x: conformal_wavelet(f, x[:, :1], IDENTITY),
            r"points: shape \(10, 1\); expected \(..., 2\), in the",
        ),
        (lambda f, x: iconformal_wavelet(f, x, IDENTITY), "coefficients: shape .*expected one for each of 1 versors"),
        (lambda f, x: iconformal_wavelet(f[:1], x, IDENTITY, weights=0.0), "weights: a number is not positive"),
        (lambda f, x: iconformal_wavelet(f[:1], x, IDENTITY, tolerance=0.0), "tolerance: 0.0"),
        (lambda f, x: similarity_versor(x[0, :2], ROTOR, 1.0), "rotor: shape"),
        (lambda f, x: similarity_versor(x[0, :1], ROTOR, 1.0), "shift: shape"),
        (lambda f, x: similarity_versor(x[0], ROTOR, -1.0), "scale: a number is not positive"),
        (lambda f, x: similarity_versor(x[0], ROTOR, np.inf), "scale: a number is not finite"),
        (lambda f, x: similarity_versor(x[0] * np.nan, ROTOR, 1.0), "shift: a number is not finite"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(normal(10, 8), normal(10, 3) + 1.0)
