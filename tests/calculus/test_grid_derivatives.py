"""Vector derivatives on grids, against closed forms, numpy and the identities of calculus."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.calculus import embed, grid_derivative, product_of
from tests.support.all_cases import all_cases


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def grid(*shape: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Places on a grid of periods 2 pi, and its steps."""
    steps = 2 * np.pi / np.array(shape)
    return np.meshgrid(*(np.arange(n) * h for n, h in zip(shape, steps, strict=True)), indexing="ij"), steps


def vectors(*parts: np.ndarray) -> np.ndarray:
    return embed(np.stack(parts, -1), len(parts), 1)


def test_trigonometric_fields_are_exact() -> None:
    (x, y, z), steps = grid(8, 9, 10)
    f = vectors(np.sin(x) * np.cos(y), np.sin(2 * y + z), np.cos(x - 2 * z))
    divergence = np.cos(x) * np.cos(y) + 2 * np.cos(2 * y + z) + 2 * np.sin(x - 2 * z)
    curl = [
        np.sin(x) * np.sin(y),
        -np.sin(x - 2 * z),
        -np.cos(2 * y + z),
    ]  # d1 f2 - d2 f1, d1 f3 - d3 f1, d2 f3 - d3 f2
    expected = np.zeros((8, 9, 10, 8))
    expected[..., 0], expected[..., 4:7] = divergence, np.stack(curl, -1)
    np.testing.assert_allclose(grid_derivative(f, steps, "spectral"), expected, atol=1e-12)
    inner, outer = (grid_derivative(f, steps, "spectral", part=part) for part in ("inner", "outer"))
    np.testing.assert_allclose(inner[..., 0], divergence, atol=1e-12)
    np.testing.assert_allclose(outer[..., 4:7], np.stack(curl, -1), atol=1e-12)
    assert not inner[..., 1:].any() and not outer[..., :4].any()
    laplacian = grid_derivative(grid_derivative(f, steps, "spectral"), steps, "spectral")
    waves = vectors(-2 * np.sin(x) * np.cos(y), -5 * np.sin(2 * y + z), -5 * np.cos(x - 2 * z))
    np.testing.assert_allclose(laplacian, waves, atol=1e-11)


@all_cases("periodic", [True, False])
@all_cases("order", [2, 4])
def test_differences_have_their_order(order: int, periodic: bool) -> None:
    errors = []
    for n in (64, 128, 256):
        (x, _), steps = grid(n, 5)
        if periodic:
            f, d1, d2 = vectors(np.sin(x), np.cos(x)), np.cos(x), -np.sin(x)
        else:
            f, d1, d2 = vectors(np.sin(x + 0.3), x**7 / 1e4), np.cos(x + 0.3), 7 * x**6 / 1e4
        found = grid_derivative(f, steps, order, periodic=periodic)
        errors.append(np.abs(found[..., [0, 3]] - np.stack([d1, d2], -1)).max())
    # one-sided differences at the ends have larger terms of higher order
    assert np.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.05 if periodic else 0.25)


def test_second_order_is_that_of_numpy(rng: np.random.Generator) -> None:
    f, steps = rng.normal(size=(5, 6, 7, 8)), np.array([0.1, 0.2, 0.3])
    parts = np.gradient(f, *steps, axis=(0, 1, 2), edge_order=2)
    axes = embed(np.eye(3), 3, 1)
    expected = sum(product_of(3)(axis, part) for axis, part in zip(axes, parts, strict=True))
    np.testing.assert_allclose(grid_derivative(f, steps, periodic=False), expected, atol=1e-12)


@pytest.mark.parametrize("order", [2, 4, "spectral"])
def test_curls_of_gradients_and_divergences_of_divergences_vanish(order: int | str, rng: np.random.Generator) -> None:
    """Differences along different axes commute, so these hold for any field on any grid."""
    for n, shape in ((2, (6, 7)), (3, (5, 6, 7)), (4, (5, 5, 6, 5))):
        steps = rng.uniform(0.5, 1.5, n)
        f = rng.normal(size=(*shape, 1 << n))
        for part in ("outer", "inner"):
            once = grid_derivative(f, steps, order, part=part)
            twice = grid_derivative(once, steps, order, part=part)
            assert np.abs(once).max() > 0.1 and np.abs(twice).max() < 1e-12 * max(1, np.abs(once).max()) * 10
        both = grid_derivative(f, steps, order, part="outer") + grid_derivative(f, steps, order, part="inner")
        np.testing.assert_allclose(both, grid_derivative(f, steps, order), atol=1e-12)


def test_the_wave_operator_of_spacetime(rng: np.random.Generator) -> None:
    """In G(1,3) the derivative twice is ``d0**2 - d1**2 - d2**2 - d3**2``, and light solves the wave equation."""
    (t, x, y, z), steps = grid(8, 4, 5, 6)
    squares = [1, -1, -1, -1]
    amplitude = rng.normal(size=16)
    f = np.sin(3 * t - x - 2 * y - 2 * z)[..., None] * amplitude
    once = grid_derivative(f, steps, "spectral", squares=squares)
    assert np.abs(once).max() > 1
    np.testing.assert_allclose(grid_derivative(once, steps, "spectral", squares=squares), 0, atol=1e-11)
    # of a scalar the derivative has the coefficients of reciprocal vectors
    scalar = embed(np.cos(x)[..., None], 4, 0)
    gradient = grid_derivative(scalar, steps, "spectral", squares=squares)
    np.testing.assert_allclose(gradient[..., 2], np.sin(x), atol=1e-12)
    g = grid_derivative(embed(np.cos(t)[..., None], 4, 0), steps, "spectral", squares=squares)
    np.testing.assert_allclose(g[..., 1], -np.sin(t), atol=1e-12)


def test_wrong_arguments_are_rejected() -> None:
    f = np.zeros((5, 6, 4))
    for arguments, options, text in (
        ((f, [1.0, 1.0, 1.0]), {}, "values: shape"),
        ((f, [1.0, -1.0]), {}, "spacing: .* expected positive steps"),
        ((f, [1.0, 1.0], 3), {}, "order: 3; expected 2, 4"),
        ((f, [1.0, 1.0], "spectral"), {"periodic": False}, "order: 'spectral'"),
        ((f, [1.0, 1.0]), {"part": "cross"}, "part: 'cross'; expected one of whole, outer, inner"),
        ((f, [1.0, 1.0]), {"squares": [1, 0]}, "squares: .* expected 1 and -1"),
        ((f[:2], [1.0, 1.0], 4), {}, "an axis of 2 points; expected 5 or more"),
    ):
        with pytest.raises(ValueError, match=text):
            grid_derivative(*arguments, **options)
