"""Disparities: the kernels against plain numpy, textures moved by known shifts, and a measured pair."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.ndimage

from algorithms.wavelets import disparity
from benchmarks import stereo_scenes
from generated import images
from tests.support.all_cases import all_cases


def texture(rows: int, columns: int, seed: int = 0) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(size=(rows, columns))
    return np.asarray(scipy.ndimage.gaussian_filter(noise, 1.0))


def pair(rows: int, columns: int, shift: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Two images of which what is at x in the first one is at x - shift in the second."""
    wide = texture(rows, columns + 2 * abs(shift), seed)
    start = abs(shift)
    return wide[:, start : start + columns], wide[:, start + shift : start + shift + columns]


def messages(costs: np.ndarray, small: float, large: float) -> np.ndarray:
    """What pixels (d, w) pass to the next row, by comparing all pairs of levels."""
    levels = np.arange(len(costs))
    jump = np.abs(levels[:, None] - levels)
    penalty = np.where(jump == 0, 0, np.where(jump == 1, min(small, large), large))
    passed = (costs[None] + penalty[:, :, None]).min(1) - costs.min(0)
    wide = np.pad(passed, [(0, 0), (1, 1)], "edge")
    return np.asarray((wide[:, :-2] + wide[:, 1:-1] + wide[:, 2:]) / 3)


def propagated(own: np.ndarray, small: float, large: float) -> np.ndarray:
    """The costs (h, d, w) from above."""
    found, costs = [], np.zeros(own.shape[1:])
    for row in own:
        costs = row + messages(costs, small, large)
        found.append(costs)
    return np.array(found)


@all_cases("shape, n", [((9, 17), 6), ((1, 5), 4), ((4, 40), 1)])
def test_costs_and_best_levels(shape: tuple[int, int], n: int) -> None:
    rng = np.random.default_rng(3)
    left, right = rng.normal(size=(2, 2, *shape))
    small, large, hidden = 0.6, 1.7, 0.9
    columns = np.arange(shape[1])
    levels = np.arange(float(n))
    walls = np.where(columns < levels[:, None], 1e9, 0)
    own = np.stack([np.abs(left - np.roll(right, k, 2)).sum(0) for k in range(n)], 1)
    own = np.where(walls > 0, hidden, own)
    up, down = propagated(own, small, large), propagated(own[::-1], small, large)[::-1]
    arguments = *left, *right, levels, walls, np.array([small, large, hidden])
    above = images.costs_from_above(*arguments)
    assert np.allclose(above, up, rtol=0, atol=1e-12)
    least, level, second, partner = images.best_levels(above, *arguments)
    total = up + down + walls
    assert np.allclose(least, total.min(1), rtol=0, atol=1e-12) and np.array_equal(level, total.argmin(1))
    far = np.abs(levels[:, None] - level[:, None]) > 1
    assert np.allclose(np.minimum(second, 1e9), np.where(far, total, 1e9).min(1).clip(max=1e9), rtol=0, atol=1e-6)
    of_right = np.stack([np.roll(total[:, k], -k, 1) for k in range(n)], 1)
    best = n - 1 - of_right[:, ::-1].argmin(1)
    assert np.array_equal(partner, best)


def test_contrasts_do_not_depend_on_brightness() -> None:
    image = texture(20, 31)
    relative, across, down = images.contrasts(image, 0.01)
    mean, square = (scipy.ndimage.uniform_filter(power, 7) for power in (image, image**2))
    assert np.allclose(relative, (image - mean) / np.sqrt(square - mean**2 + 0.01), rtol=0, atol=1e-12)
    assert np.allclose(across[:, 1:-1], relative[:, 2:] - relative[:, :-2], rtol=0, atol=1e-12)
    assert np.allclose(down[1:-1], relative[2:] - relative[:-2], rtol=0, atol=1e-12)
    others = images.contrasts(5 * image + 3, 0.25)
    assert np.allclose(others, [relative, across, down], rtol=0, atol=1e-12)


@all_cases("smoothness, most", [(0.5, 0.02), (1.0, 0.02), (2.0, 0.04)])
def test_fractions_of_pixels(smoothness: float, most: float) -> None:
    """Textures moved by eighths of pixels, which are means of finer pixels; the median error is the bias."""
    fine, rows, columns = 8, 40, 90
    noise = np.random.default_rng(1).normal(size=(rows * fine, (columns + 10) * fine))
    wide = scipy.ndimage.gaussian_filter(noise, smoothness * fine)

    def seen(start: int) -> np.ndarray:
        part = wide[:, start : start + columns * fine]
        return np.asarray(part.reshape(rows, fine, columns, fine).mean((1, 3)))

    for eighths in (32, 34, 38):
        error = (disparity(seen(0), seen(eighths), 9).disparity - eighths / fine)[3:-3, 10:-10]
        assert abs(np.median(error)) < most and np.abs(error).max() < 0.25


def test_disparities_that_jump() -> None:
    """Two planes at different depths: accurate except at borders, which only one eye sees."""
    left, right = pair(60, 100, 3)
    front = texture(30, 50, seed=4)
    left, right = left.copy(), right.copy()
    left[15:45, 30:70], right[15:45, 22:62] = front[:, :40], front[:, :40]
    found = disparity(left, right, 12)
    assert np.abs(found.disparity[20:40, 35:65] - 8).max() < 0.1
    assert np.abs(found.disparity[3:10, 12:-8] - 3).max() < 0.1
    truth = np.full(left.shape, 3.0)
    truth[15:45, 30:70] = 8
    sure = found.confidence > 0.5
    wrong = np.abs(found.disparity - truth) > 0.5
    assert sure.mean() > 0.8 and wrong[sure].mean() < 0.02 and wrong.mean() < 0.06
    assert wrong[~sure].mean() > 5 * wrong[sure].mean()
    # Points that only the left eye sees have no confidence.
    assert found.confidence[20:40, 25:29].mean() < 0.1 and np.median(np.abs(found.disparity[20:40, 25:28] - 3)) < 1


@all_cases(
    "shape, shift, smallest, largest",
    [
        ((37, 61), 5, 0, 60),
        ((20, 50), -3, -6, 3),
        ((20, 50), -4, -9, -2),
        ((20, 50), 7, 5, 12),
        ((31, 47), 0, -20, 20),
        ((60, 33), 2, -32, 32),
        ((1, 60), 4, 0, 9),
        ((2, 60), 4, 0, 9),
    ],
)
def test_ranges_and_sizes(shape: tuple[int, int], shift: int, smallest: int, largest: int) -> None:
    found = disparity(*pair(*shape, shift), largest, smallest)
    assert (np.abs(found.disparity - shift) < 0.1).mean() > 0.83 and (found.confidence > 0.5).mean() > 0.8
    assert smallest <= found.disparity.min() and found.disparity.max() <= largest
    assert found.confidence.min() >= 0 and found.confidence.max() <= 1


def test_brightness_size_and_type_do_not_matter() -> None:
    left, right = pair(40, 60, 4)
    expected = disparity(left, right, 9)
    for one, two in ((left * 1e-200, right * 1e-200), (left + 1e7, right + 1e7), (left * 1e30, right * 1e30)):
        found = disparity(one, two, 9)
        assert np.abs(found.disparity - expected.disparity).max() < 1e-4
        assert np.abs(found.confidence - expected.confidence).max() < 1e-4
    brighter = disparity(left, 3 * right + 1, 9)
    assert np.abs(brighter.disparity - expected.disparity).max() < 1e-3
    left.flags.writeable = right.flags.writeable = False
    assert np.array_equal(disparity(np.asfortranarray(left), right, 9).disparity, expected.disparity)
    single = disparity(left.astype(np.float32), right.astype(np.float32), 9)
    assert single.disparity.dtype == single.confidence.dtype == np.float32
    assert np.abs(single.disparity - expected.disparity).max() < 1e-4


def test_strips_and_threads() -> None:
    """The rows of an image of several strips are those of one image, and do not depend on threads."""
    left, right = pair(700, 50, 5)
    calls: list[tuple[int, int]] = []
    found = disparity(left, right, 9, progress=lambda *state: calls.append(state))
    assert calls == [(1, 3), (2, 3), (3, 3)]
    assert all(np.array_equal(a, b) for a, b in zip(found, disparity(left, right, 9, workers=2), strict=True))
    assert (np.abs(found.disparity - 5) < 0.1)[:, 8:].mean() > 0.98


def test_noise() -> None:
    """White noise of a fifth of the contrast: differences of pixels of smooth textures are mostly noise."""
    rng = np.random.default_rng(5)
    wide = scipy.ndimage.gaussian_filter(rng.normal(size=(72, 110)), 3.5)
    left, right = (wide[:, k : k + 100] / wide.std() + 0.2 * rng.normal(size=(72, 100)) for k in (0, 4))
    found = disparity(left, right, 10)
    assert (np.abs(found.disparity - 4) < 1).mean() > 0.9 and (found.confidence > 0.1).mean() > 0.8


def test_nothing_is_known_of_constant_and_unrelated_images() -> None:
    flat = np.full((20, 30), 7.0)
    found = disparity(flat, flat, 5)
    assert not found.disparity.any() and not found.confidence.any()
    for seed in range(5):
        assert not disparity(texture(60, 90, seed), texture(60, 90, seed + 50), 20).confidence.any()
    with pytest.raises(ValueError, match="left: a number is not finite"):
        disparity(flat * np.nan, flat, 5)


def test_nothing_is_known_of_stripes_away_from_the_edge() -> None:
    """Three disparities fit equally well, up to rounding, where none of them leads out of the right image."""
    wide = np.sin(2 * np.pi * np.arange(140.0) / 7) + np.zeros((30, 1))
    found = disparity(wide[:, 5:135], wide[:, 8:138], 20)
    assert not found.confidence[:, 24:].any()


@pytest.mark.slow
def test_costs_fit_random_scenes() -> None:
    """Half and twice the costs of changes, and of hidden pixels, give more wrong disparities on unseen scenes."""
    pytest.importorskip("skimage.data")
    scenes = [stereo_scenes.scene(seed) for seed in range(200, 208)]
    own, _ = stereo_scenes.wrong(scenes)
    for costs in ({"_SMALL": 1.0, "_LARGE": 2.0}, {"_SMALL": 4.0, "_LARGE": 8.0}, {"_HIDDEN": 0.5}, {"_HIDDEN": 2.0}):
        assert own < stereo_scenes.wrong(scenes, **costs)[0]


def test_disparities_of_a_real_pair() -> None:
    """A part of the Motorcycle pair, against its measured disparities."""
    data = pytest.importorskip("skimage.data")
    left, right, truth = data.stereo_motorcycle()
    rows = slice(200, 265)
    left, right, truth = (each[rows].astype(float) for each in (left, right, truth))
    found = disparity(left.mean(-1), right.mean(-1), 65)
    known = np.isfinite(truth) & (truth > 0)
    error = np.abs(found.disparity - truth)[known]
    assert np.median(error) < 0.2 and (error < 1).mean() > 0.85
    confidence = found.confidence[known]
    assert (error[confidence > np.median(confidence)] < 1).mean() > 0.96
    assert (error[confidence > 0] < 1).mean() > 0.89
