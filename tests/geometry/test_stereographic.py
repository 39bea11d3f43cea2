"""The stereographic projection and its inverse, against the analytic formula in 40 digits and the inversion."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from algorithms.geometry import inverse_stereographic_projection, stereographic_projection


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_round_trip(n: int) -> None:
    rng = np.random.default_rng(n)
    y = rng.normal(size=(300, n)) * 10.0 ** rng.uniform(-12, 7, (300, 1))
    x = inverse_stereographic_projection(y)
    np.testing.assert_allclose(np.linalg.norm(x, axis=-1), 1, 0, 4e-16)
    np.testing.assert_allclose(stereographic_projection(x), y, 2e-15 * n, 1e-30)


def test_digits() -> None:
    """Near the pole too, where ``1 - z`` would have lost all its digits."""
    rng = np.random.default_rng(0)
    y = rng.normal(size=(100, 2)) * 10.0 ** rng.uniform(-9, 9, (100, 1))
    with mp.workdps(50):
        for (a, b), found in zip(y, inverse_stereographic_projection(y), strict=True):
            a, b = mp.mpf(a), mp.mpf(b)
            square = a * a + b * b
            truth = 2 * a / (square + 1), 2 * b / (square + 1), (square - 1) / (square + 1)
            assert all(abs(t - f) <= 1e-15 * abs(t) or abs(t - f) < 2e-16 for t, f in zip(truth, found, strict=True))
            p, q, z = map(mp.mpf, found)
            length = mp.sqrt(p * p + q * q + z * z)
            image = stereographic_projection(found)
            height = 1 - mp.sqrt(1 - (p * p + q * q) / length**2) if z > 0 else 1 - z / length
            assert abs(p / length / height - image[0]) <= 3e-15 * mp.sqrt(square)


def test_it_is_an_inversion() -> None:
    """It is the inversion in the sphere about the pole through the equator, by the conformal algebra."""
    rng = np.random.default_rng(1)
    x = rng.normal(size=(50, 3))
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    pole = np.array([0, 0, 1.0])
    offset = x - pole
    truth = pole + 2 * offset / (offset**2).sum(-1, keepdims=True)
    np.testing.assert_allclose(stereographic_projection(x), truth[:, :2], 1e-12)
    np.testing.assert_allclose(truth[:, 2], 0, 0, 1e-12)


def test_circles_become_circles() -> None:
    """The images of four points of a circle on the sphere are on a circle: their complex cross-ratio is real."""
    angles = np.array([0.1, 1.0, 2.5, 4.0])
    axis = np.array([0.3, -0.4, np.sqrt(0.75)])
    u = np.cross(axis, [1.0, 0, 0])
    u /= np.linalg.norm(u)
    v = np.cross(axis, u)
    circle = 0.6 * axis + 0.8 * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v)
    z = stereographic_projection(circle) @ [1, 1j]
    ratio = (z[0] - z[2]) * (z[1] - z[3]) / ((z[0] - z[3]) * (z[1] - z[2]))
    assert abs(ratio.imag) < 1e-14 * abs(ratio)


def test_poles_and_errors() -> None:
    assert stereographic_projection([0, 0, -1.0]).tolist() == [0, 0]
    assert stereographic_projection([0, 0, 1.0]).tolist() == [np.inf, np.inf]
    assert inverse_stereographic_projection([0.0, 0]).tolist() == [0, 0, -1]
    for far in ([np.inf, 1.0], [-np.inf, np.inf], [1e300, -1e300]):
        np.testing.assert_allclose(inverse_stereographic_projection(far), [0, 0, 1], 0, 1e-15)
    assert np.isnan(inverse_stereographic_projection([np.nan, 0.0])).all()
    assert np.isnan(stereographic_projection([np.nan, 0.0, 1.0])).all()
    assert stereographic_projection(np.empty((0, 3))).shape == (0, 2)
    assert stereographic_projection(np.float32([0.6, 0.8])).dtype == np.float32
    with pytest.raises(ValueError, match="a squared length of 4"):
        stereographic_projection([[0, 0, 1.0], [0, 2, 0]])
    with pytest.raises(ValueError, match="shape"):
        stereographic_projection([1.0])
