"""Kernels of optical flow, compared with scipy and with closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.ndimage

from algorithms.evidence import largest_ratio
from algorithms.wavelets import flow_equations
from generated import images
from tests.support.all_cases import all_cases


def whole(taps: np.ndarray) -> np.ndarray:
    """Symmetric taps, from those from the middle one on."""
    return np.concatenate([taps[:0:-1], taps])


def filtered(image: np.ndarray, taps: np.ndarray, mode: str) -> np.ndarray:
    rows = scipy.ndimage.convolve1d(image.astype(float), whole(taps), 0, mode=mode)
    return scipy.ndimage.convolve1d(rows, whole(taps), 1, mode=mode)


@all_cases("dtype, error", [(np.float32, 2e-5), (np.float64, 1e-12)])
@all_cases("size", [(37, 71), (8, 8), (1, 5), (40, 3)])
def test_band_is_the_difference_of_two_filters(size: tuple[int, int], dtype: type, error: float) -> None:
    rng = np.random.default_rng(0)
    image, fine, coarse = (rng.normal(size=shape).astype(dtype) for shape in (size, 4, 8))
    expected = filtered(image, fine, "reflect") - filtered(image, coarse, "reflect")
    assert np.abs(images.band(image, fine, coarse) - expected).max() < error * np.abs(expected).max()


@pytest.mark.parametrize("size", [(38, 71), (8, 8), (2, 5)])
def test_means_at_even_rows(size: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    image, taps = rng.normal(size=size), rng.normal(size=6)
    found = images.pair_means(image[::2], image[1::2], taps)
    expected = filtered(image, taps, "nearest")[::2]
    # Beyond the edges, the last even and the last odd row are repeated.
    inner = slice(3, -3) if size[0] > 12 else slice(0, 0)
    assert np.allclose(found[inner], expected[inner], rtol=0, atol=1e-12)
    assert found.shape == expected.shape


def test_jets_are_derivatives_of_polynomials() -> None:
    """Differences of nine neighbours are exact for polynomials of eighth degree along an axis.

    Of terms of third degree, the part remains that is linear within a pixel: 3/20 x of x^3 and x/12 of x y^2.
    """
    y, x = np.indices((24, 30)) - 12.0
    factors = np.random.default_rng(2).normal(size=10)
    powers = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)]
    image = sum(c * x**i * y**j for c, (i, j) in zip(factors, powers, strict=True))
    found = [plane[12, 12] for plane in images.jets(np.asarray(image))]
    factors[1:3] += [3 / 20 * factors[6] + factors[8] / 12, 3 / 20 * factors[9] + factors[7] / 12]
    assert np.allclose(found, factors[:6], rtol=0, atol=1e-10)


def test_terms_of_the_equations() -> None:
    """For a polynomial of second degree, the moved image is exact: its shift by the motion."""

    def surface(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return 0.3 * x - 0.2 * y + 0.01 * x * y + 0.002 * x**2 - 1e-3 * y**2

    def slopes(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return 0.3 + 0.01 * y + 0.004 * x, -0.2 + 0.01 * x - 2e-3 * y

    y, x = np.indices((26, 34)) - 12.0
    jets = [part.reshape(-1) for part in images.jets(surface(x, y))]
    row, column = (part.reshape(-1) for part in np.mgrid[10:16, 10:24])
    u, v = x[row, column], y[row, column]
    first = surface(u, v) + 0.1
    known = (column % 2).astype(float)
    # The motion (2.3, -1.6) ends 0.3 to the right of a pixel and 0.4 below it.
    ends = 34 * (row - 2) + column + 2, np.full(u.shape, 0.3), np.full(u.shape, 0.4), known
    found = np.stack(images.motion_terms(*jets, *ends, first, *slopes(u, v)))
    gx, gy = (np.add(*pair) / 2 for pair in zip(slopes(u, v), slopes(u + 2.3, v - 1.6), strict=True))
    d = surface(u + 2.3, v - 1.6) - first
    expected = known * np.stack([gx * gx, gx * gy, gy * gy, -gx * d, -gy * d, d * d])
    assert np.abs(found - expected).max() < 1e-9


@pytest.mark.parametrize("size", [(38, 71), (8, 8), (1, 5)])
def test_averages(size: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    (even, odd), taps = rng.normal(size=(2, *size)), rng.normal(size=7)
    evens, odds = np.concatenate([taps[6:0:-2], taps[::2]]), np.concatenate([taps[5::-2], taps[1::2]])
    expected = []
    for part, weights in ((even, evens), (odd, odds)):
        rows = scipy.ndimage.correlate1d(part, weights, 0, mode="nearest")
        expected.append(scipy.ndimage.correlate1d(rows, weights, 1, mode="nearest"))
    assert np.allclose(images.averaged(even, odd, taps), sum(expected), rtol=0, atol=1e-12)


def test_ends_of_motions() -> None:
    u, v = np.array([[0.6, 3.0]]), np.array([[-1.4, -9.0]])
    row, column, right, down, known = images.motion_ends(
        u, v, np.array([8.0]), np.array([4.0, 6.0]), np.array([8.0, 9.0])
    )
    assert row.tolist() == [[7, 0]] and column.tolist() == [[5, 8]]
    assert np.allclose([right, down], [[[-0.4, 0]], [[-0.4, 0]]], rtol=0, atol=1e-12)
    assert known.tolist() == [[1, 0]]


def test_slopes_are_derivatives_of_polynomials() -> None:
    y, x = np.indices((12, 15)) - 5.0
    across, down = images.slopes(x**3 - x * y**2 + 2 * y**4)
    assert np.allclose(across[2:-2, 2:-2], (3 * x**2 - y**2)[2:-2, 2:-2], rtol=0, atol=1e-11)
    assert np.allclose(down[2:-2, 2:-2], (8 * y**3 - 2 * x * y)[2:-2, 2:-2], rtol=0, atol=1e-11)
    across, down = images.slopes(np.arange(5.0)[:, None] + np.zeros(3))
    # Mirrored at the middle of edges: 1, 0, 0, 1, 2 about the first pixel.
    assert not across.any() and np.allclose(down[:, 0], [7 / 12, 13 / 12, 1, 13 / 12, 7 / 12])


@pytest.mark.parametrize("noise", [(1.0, 0.0, 0.0), (0.7, 3.0, 2.0)])
def test_relaxed_motion_satisfies_its_equations(noise: tuple[float, float, float]) -> None:
    """After many sweeps, the motion solves the linear system with the weights of the motion before."""
    rng = np.random.default_rng(3)
    rows, columns = 5, 7
    gradients = rng.normal(size=(2, 3, rows, columns))
    xx, xy, yy = (np.sum(gradients[i] * gradients[j], 0) for i, j in ((0, 0), (0, 1), (1, 1)))
    bx, by, square = rng.normal(size=(3, rows, columns))
    square = 3 + square**2
    before, start = rng.normal(size=(2, 2, rows, columns))
    sides = rng.uniform(0.5, 2, (2, rows, columns))
    sides[0, :, -1], sides[1, -1] = 0, 0
    found = np.stack(
        images.relaxed_motion(
            xx, xy, yy, bx, by, square, *before, *start, *sides, np.array(noise), np.ones(1), np.ones(1500)
        )
    )
    u, v = start - before
    left = square - 2 * (bx * u + by * v) + xx * u * u + 2 * xy * u * v + yy * v * v
    weight = noise[0] / (1 + noise[1] * np.maximum(left, 0))
    count = rows * columns
    matrix, right = np.zeros((2, count, 2, count)), np.zeros((2, count))
    number = np.arange(count).reshape(rows, columns)
    for place in np.ndindex(rows, columns):
        own = number[place]
        a = weight[place] * np.array([[xx[place], xy[place]], [xy[place], yy[place]]])
        matrix[:, own, :, own] += a
        right[:, own] = weight[place] * np.array([bx[place], by[place]]) + a @ before[:, *place]
        for axis, other in ((0, (place[0], place[1] + 1)), (1, (place[0] + 1, place[1]))):
            if other[0] < rows and other[1] < columns:
                difference = start[:, *other] - start[:, *place]
                stiff = sides[axis][place] / np.sqrt(1 + noise[2] * (difference**2).sum())
                for p, q in ((own, number[other]), (number[other], own)):
                    matrix[[0, 1], p, [0, 1], p] += stiff
                    matrix[[0, 1], p, [0, 1], q] -= stiff
    expected = np.linalg.solve(matrix.reshape(2 * count, -1), right.reshape(-1)).reshape(2, rows, columns)
    assert np.abs(found - expected).max() < 1e-8


def test_costs_equal_those_of_scipy() -> None:
    rng = np.random.default_rng(4)
    first, second = rng.normal(size=(2, 20, 24))
    row, column = rng.integers(4, 15, (2, 9)).astype(float)
    u, v = rng.uniform(-2, 2, (2, 9))
    down, across = (part.reshape(-1).astype(float) for part in np.mgrid[-1:2, -1:2])
    weights = rng.uniform(size=9)
    found = images.motion_costs(first, second, row, column, u, v, down, across, weights, np.array([22.0, 18.0]), 1.5)
    y, x = row[:, None] + down, column[:, None] + across
    there = scipy.ndimage.map_coordinates(second, [y + v[:, None], x + u[:, None]], order=1)
    squares = np.minimum((first[y.astype(int), x.astype(int)] - there) ** 2, 1.5)
    assert np.abs(found - squares @ weights).max() < 1e-12


def test_evidence_is_that_of_the_weaker_direction() -> None:
    """For the matrix diag(9, 1), the right-hand side (9, 2) and the sum of squares 15, the residual is 2."""
    left, least = images.motion_evidence(np.array([9.0, 0, 1, 9, 2, 15]), 1e-9)
    assert abs(left - 2) < 1e-6 and abs(least - 1) < 1e-6
    turned = images.motion_evidence(np.array([1.0, 1, 1, 0, 0, 0]), 1e-9)
    assert abs(turned[1]) < 1e-6


def structure_of_noise() -> float:
    """Return the mean square of a derivative that white noise alone exceeds with the probability `WRONG`.

    The unit is the least mean squared difference of the two images at the same place, as noise may vary. The derivative
    is that of their mean, whose variance is a quarter of that of the difference.
    """
    width = len(flow_equations._COARSE)
    fine, coarse = (
        np.concatenate([taps[:0:-1], taps]).astype(float) for taps in (flow_equations._FINE, flow_equations._COARSE)
    )
    band = np.pad(np.outer(fine, fine), width - len(flow_equations._FINE)) - np.outer(coarse, coarse)
    slopes = np.apply_along_axis(np.convolve, 1, band, [1 / 12, -2 / 3, 0, 2 / 3, -1 / 12])
    # The motion, two numbers, takes its part of the differences.
    differences = _freedom(band)
    variance = differences / (differences - 2)
    ratio = largest_ratio(_freedom(slopes), differences - 2)
    return float(variance * ratio * (slopes**2).sum() / (band**2).sum() / 4)


def _freedom(taps: np.ndarray) -> int:
    """Return the degrees of freedom of the distribution of chi-square that averaged squares of filtered noise have.

    It is the one with the same variance.
    """
    weights = np.outer(*[np.concatenate([flow_equations._NEAR[:0:-1], flow_equations._NEAR]).astype(float)] * 2)
    # Half of the pixels.
    weights[np.indices(weights.shape).sum(0) % 2 == 1] = 0
    pairs, alike = _correlated(weights), _correlated(taps)
    rows, columns = ((large - small) // 2 for large, small in zip(alike.shape, pairs.shape, strict=True))
    part = alike[rows : rows + len(pairs), columns : columns + len(pairs)] / alike.max()
    return round(float(weights.sum() ** 2 / (pairs * part**2).sum()))


def _correlated(taps: np.ndarray) -> np.ndarray:
    """Return the correlation of a filter with itself. (Importing `scipy.signal` takes half a second.)"""
    sizes = [2 * n - 1 for n in taps.shape]
    return np.asarray(np.fft.fftshift(np.fft.irfft2(np.abs(np.fft.rfft2(taps, sizes)) ** 2, sizes)))


def test_what_noise_alone_explains() -> None:
    assert abs(flow_equations._STRUCTURE_OF_NOISE / structure_of_noise() - 1) < 1e-3
