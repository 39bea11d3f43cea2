"""The conic through five points, or a status if it is not unique."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from algorithms.vision import VisionStatus, conic_through_points

Array = np.ndarray[Any, Any]


def value(conic: Array, x: Array, y: Array) -> Array:
    a, b, c, d, e, f = np.moveaxis(conic[..., None, :], -1, 0)
    return np.asarray(a * x * x + b * x * y + c * y * y + d * x + e * y + f)


def test_ellipses_and_hyperbolas() -> None:
    """Other points of the curve are also on the result."""
    rng = np.random.default_rng(0)
    angles = np.sort(rng.uniform(0, 2 * np.pi, (200, 9)), axis=1) + np.linspace(0, 0.5, 9)
    sizes, centre = rng.uniform(0.5, 3, (2, 200, 1)), rng.uniform(-5, 5, (2, 200, 1))
    for x, y in ((np.cos(angles), np.sin(angles)), (np.cosh(angles - 3), np.sinh(angles - 3))):
        p, q = sizes[0] * x + centre[0], sizes[1] * y + centre[1]
        five = np.stack([p[:, :5], q[:, :5]], -1)
        for points in (five, np.concatenate([five, np.ones((200, 5, 1))], -1) * rng.uniform(0.1, 9, (200, 5, 1))):
            found = conic_through_points(points)
            good = found.status == VisionStatus.OK
            assert good.mean() > 0.97
            np.testing.assert_allclose(np.linalg.norm(found.coefficients[good], axis=-1), 1, 0, 1e-14)
            a, b, c = ((sizes[1] ** 2)[:, 0], 0 * sizes[0][:, 0], (sizes[0] ** 2)[:, 0])
            c = c if y is not None and np.abs(x).max() <= 1 else -c
            d, e = -2 * a * centre[0][:, 0], -2 * c * centre[1][:, 0]
            f = a * centre[0][:, 0] ** 2 + c * centre[1][:, 0] ** 2 - a * sizes[0][:, 0] ** 2
            truth = np.stack([a, b, c, d, e, f], -1)
            truth /= np.linalg.norm(truth, axis=-1, keepdims=True)
            signs = np.sign((truth * found.coefficients).sum(-1, keepdims=True))
            assert np.median(np.abs(found.coefficients - signs * truth)[good]) < 1e-12


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("offset", [0.0, 1e3])
def test_points_that_determine_many_conics(scale: float, offset: float) -> None:
    rng = np.random.default_rng(1)
    along, direction = rng.uniform(-1, 1, (50, 4, 1)), rng.normal(size=(50, 1, 2))
    line = rng.normal(size=(50, 1, 2)) + along * direction
    four_on_a_line = np.concatenate([line, rng.normal(size=(50, 1, 2))], 1)
    twice = rng.normal(size=(50, 5, 2))
    twice[:, 4] = twice[:, 1]
    three_on_a_line = np.concatenate([line[:, :3], rng.normal(size=(50, 2, 2))], 1)
    for points, wanted in (
        (four_on_a_line, VisionStatus.DEGENERATE),
        (twice, VisionStatus.DEGENERATE),
        (three_on_a_line, VisionStatus.OK),
    ):
        for order in (slice(None), [4, 2, 0, 3, 1], [1, 4, 3, 0, 2]):
            found = conic_through_points(scale * (points[:, order] + offset))
            assert (found.status == wanted).all()
            assert np.isnan(found.coefficients).all() == (wanted != VisionStatus.OK)
    assert (conic_through_points(np.insert(four_on_a_line, 2, 1, axis=-1)).status == VisionStatus.DEGENERATE).all()


def test_exact_integers() -> None:
    """Regression test: for four points of the line ``y = x`` the conic was zero without an error."""
    found = conic_through_points([[0, 0], [1, 1], [2, 2], [3, 3], [0, 1]])
    assert found.status == VisionStatus.DEGENERATE and np.isnan(found.coefficients).all()
    circle = conic_through_points([[1, 0], [0, 1], [-1, 0], [0, -1], [0.6, 0.8]])
    np.testing.assert_allclose(circle.coefficients / circle.coefficients[0], [1, 0, 1, 0, 0, -1], 0, 1e-14)
    lines = conic_through_points([[0, 0], [1, 0], [2, 0], [5, 1], [-3, 1]])
    np.testing.assert_allclose(lines.coefficients / lines.coefficients[2], [0, 0, 1, 0, -1, 0], 0, 1e-13)


def test_bad_input() -> None:
    points = np.random.default_rng(2).normal(size=(3, 5, 2))
    points[1, 2, 0] = np.nan
    points[2, 4, 1] = np.inf
    found = conic_through_points(points)
    assert found.status.tolist() == [VisionStatus.OK, VisionStatus.NOT_FINITE, VisionStatus.NOT_FINITE]
    assert np.isnan(found.coefficients[1:]).all() and np.isfinite(found.coefficients[0]).all()
    assert conic_through_points(np.zeros((5, 3))).status == VisionStatus.DEGENERATE
    assert conic_through_points(np.zeros((5, 2))).status == VisionStatus.DEGENERATE
    assert conic_through_points(np.empty((0, 5, 2))).coefficients.shape == (0, 6)
    with pytest.raises(ValueError, match="points: shape"):
        conic_through_points(np.zeros((4, 2)))
    with pytest.raises(ValueError, match="points: shape"):
        conic_through_points(np.zeros((5, 4)))
