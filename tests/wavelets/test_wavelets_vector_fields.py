"""Divergence, curl and rotated templates of vector fields in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.wavelets import derivative_mask, divergence_and_curl, match_template
from generated import vga2, vga3
from tests.support.all_cases import all_cases


def normal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def test_derivatives_of_linear_fields_are_exact() -> None:
    for dimension, size in ((2, (30, 28)), (3, (21, 22, 23))):
        matrix, x = normal(dimension, dimension), np.moveaxis(np.indices(size), 0, -1)
        found = divergence_and_curl(x @ matrix.T, 1.2)
        middle = found[tuple(slice(8, -8) for _ in size)].reshape(-1, found.shape[-1])
        slopes = matrix.T
        curl = [slopes[a, b] - slopes[b, a] for a, b in ((0, 1), (0, 2), (1, 2)) if b < dimension]
        assert np.abs(middle - [np.trace(matrix), *curl]).max() < 1e-12


def test_waves_in_space() -> None:
    """Divergence and curl of ``a cos(w x)``, attenuated by the Gaussian."""
    sizes = np.array([24, 20, 18])
    w, a = 2 * np.pi * np.array([2, -1, 1]) / sizes, np.array([0.3, -1.0, 0.7])
    phase = np.moveaxis(np.indices(sizes), 0, -1) @ w
    sigma = 1.5
    found = divergence_and_curl(np.cos(phase)[..., None] * a, sigma, "wrap")
    bivector = [w[i] * a[j] - w[j] * a[i] for i, j in ((0, 1), (0, 2), (1, 2))]
    smooth = np.exp(-(sigma**2) * (w @ w) / 2)
    expected = -np.sin(phase)[..., None] * smooth * np.array([w @ a, *bivector])
    # The derivative of a sampled Gaussian is scaled to be exact for linear functions.
    assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max()
    single = divergence_and_curl((np.cos(phase)[..., None] * a).astype(np.float32), sigma, "wrap")
    assert single.dtype == np.float32 and np.abs(single - found).max() < 1e-6
    assert derivative_mask(3, 1.5).shape == (13, 13, 13, 3)
    assert derivative_mask(2, 1.5, truncate=5.0).shape == (17, 17, 2)


def test_truncation_of_masks_of_derivatives() -> None:
    """Waves in the plane: results converge to those of the whole Gaussian for longer masks."""
    phase = 2 * np.pi * (2 * np.arange(64)[:, None] + np.arange(72) * 64 / 72) / 64
    u, v = 4 * np.pi / 64, 2 * np.pi / 72
    field = np.stack([np.cos(phase), 2 * np.sin(phase)], -1)
    waves = [-u * np.sin(phase) + 2 * v * np.cos(phase), 2 * u * np.cos(phase) + v * np.sin(phase)]
    for sigma in (2.0, 4.0):
        expected = np.exp(-(sigma**2) * (u**2 + v**2) / 2) * np.stack(waves, -1)
        errors = [
            np.abs(divergence_and_curl(field, sigma, "wrap", truncate=each) - expected).max() / np.abs(expected).max()
            for each in (4.0, 5.5)
        ]
        assert 1e-4 < errors[0] < 1e-3 and errors[1] < 1e-6


@all_cases("angle", [0.3, -2.9, 3.1, np.pi])
def test_rotated_vectors_in_the_plane(angle: float) -> None:
    template, rotor = normal(7, 5, 2), vga2.rotor_from_angle(angle)
    field = 0.1 * normal(40, 50, 2, seed=1)
    field[10:17, 20:25] = vga2.rotate_vector(rotor, template)
    (found,) = match_template(field, template, "values")
    assert found.place == (13, 22) and found.similarity == pytest.approx(1, abs=1e-12)
    assert abs(found.rotor @ rotor) == pytest.approx(1, abs=1e-12)


@all_cases("turn", [(0.3, 0.2, -0.1), (2.0, 1.0, 2.0), (0.0, 3.1, 0.0), (0.0, 0.0, np.pi)])
def test_rotated_vectors_in_space(turn: Any) -> None:
    template, rotor = normal(5, 5, 5, 3), vga3.rotor_from_rotation_vector(np.array(turn))
    field = 0.1 * normal(14, 15, 16, 3, seed=1)
    field[3:8, 6:11, 7:12] = vga3.rotate_vector(rotor, template)
    (found,) = match_template(field, template, "values")
    assert found.place == (5, 8, 9) and found.similarity == pytest.approx(1, abs=1e-12)
    assert abs(found.rotor @ rotor) == pytest.approx(1, abs=1e-12)


def saddle(x: np.ndarray) -> np.ndarray:
    g = np.exp(-(x**2).sum(-1) / 14)
    return np.stack([(x[..., 0] + 0.3 * x[..., 1]) * g, (-x[..., 1] + 0.05 * x[..., 0] ** 2) * g], -1)


def vortex(x: np.ndarray) -> np.ndarray:
    g = np.exp(-(x**2).sum(-1) / 12)
    return np.stack([-x[..., 1] * g, (x[..., 0] + 0.1 * x[..., 1] ** 2) * g], -1)


def placed(pattern: Any, place: tuple[int, int], angle: float, size: tuple[int, int]) -> np.ndarray:
    x = np.moveaxis(np.indices(size), 0, -1) - np.array(place, float)
    return vga2.rotate_vector(
        vga2.rotor_from_angle(angle), pattern(vga2.rotate_vector(vga2.rotor_from_angle(-angle), x))
    )


@pytest.mark.parametrize("pattern", [saddle, vortex])
@pytest.mark.parametrize("angle", [-1.3, 2.9])
def test_a_whole_pattern_is_rotated(pattern: Any, angle: float) -> None:
    """The position is exact and the angle within 1e-3, also with noise; then test the second best match."""
    size = (60, 70)
    field = placed(pattern, (25, 40), angle, size) + 0.8 * placed(pattern, (44, 15), angle - 2, size)
    template = pattern(np.moveaxis(np.indices((15, 15)), 0, -1) - 7.0)
    first, second = match_template(field, template, count=2)
    assert {first.place, second.place} == {(25, 40), (44, 15)}
    for match in (first, second):
        truth = vga2.rotor_from_angle(angle if match.place == (25, 40) else angle - 2)
        assert abs(match.rotor @ truth) == pytest.approx(1, abs=2.5e-7)  # 1.4e-3 radians
        assert match.similarity > 0.9999
    (noisy,) = match_template(field + 0.02 * normal(*size, 2), template)
    truth = vga2.rotor_from_angle(angle if noisy.place == (25, 40) else angle - 2)
    assert noisy.place in {(25, 40), (44, 15)} and abs(noisy.rotor @ truth) > 1 - 5e-5


@pytest.mark.slow
def test_a_whole_pattern_is_rotated_in_space() -> None:
    def pattern(x: np.ndarray) -> np.ndarray:
        g = np.exp(-(x**2).sum(-1) / 6)[..., None]
        a, b, c = np.moveaxis(x, -1, 0)
        return g * np.stack([a + 0.5 * b, -b + c**2 / 3, 0.3 * c - 0.6 * a], -1)

    template = pattern(np.moveaxis(np.indices((11, 11, 11)), 0, -1) - 5.0)
    rotor = vga3.rotor_from_rotation_vector(np.array([-0.7, 0.7, 0.1]))
    x = np.moveaxis(np.indices((17, 18, 19)), 0, -1) - np.array([8.0, 9, 10])
    field = vga3.rotate_vector(rotor, pattern(vga3.rotate_vector_back(rotor, x)))
    (found,) = match_template(field, template)
    assert found.place == (8, 9, 10)
    assert abs(found.rotor @ rotor) > 1 - 1e-6


@all_cases(
    "call, message",
    [
        (lambda f: match_template(f, f[:4, :5]), "template: shape .*odd sizes that fit"),
        (lambda f: match_template(f[:3], f[:5, :5]), "odd sizes that fit"),
        (lambda f: match_template(f, 0 * f[:5, :5]), "template: all vectors are 0"),
        (lambda f: match_template(f, f[:5, :5], "both"), "turned: 'both'; expected 'values' or 'whole'"),
        (lambda f: match_template(f, f[:5, :5], count=0), "count: 0; expected a whole number"),
        (lambda f: match_template(f * np.nan, f[:5, :5]), "field: a number is not finite"),
        (lambda f: match_template(f[..., :1], f[:5, :5]), "field: shape .*a vector field M N 2 or L M N 3"),
        (lambda f: divergence_and_curl(f, mode="full"), "mode: 'full'; expected 'same' or 'wrap'"),
        (lambda f: divergence_and_curl(f, -1.0), "sigma: -1.0; expected a positive number"),
        (lambda f: divergence_and_curl(f[0]), "field: shape"),
        (lambda f: derivative_mask(2, 1.0, 0.0), "truncate: 0.0; expected a positive number"),
        (lambda f: derivative_mask(4), "dimension: 4; expected 2 or 3"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(normal(12, 13, 2))
