"""Optical flow on warps of real images whose motion is known, and on a stereo pair with measured disparities."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import scipy.ndimage
from flow_truth import mean_error, moving_square, pair, warped
from selection import some_slow

from algorithms.wavelets import optical_flow
from generated import images
from tests.support.all_cases import all_cases

data = pytest.importorskip("skimage.data")


def texture(name: str) -> np.ndarray:
    return getattr(data, name)()[60:364, 60:364]


@cache
def part_of(name: str, kind: str) -> tuple[np.ndarray, ...]:
    """A corner of two images and of their motion."""
    return tuple(each[:96, :96] for each in pair(texture(name), kind))


@pytest.mark.parametrize("name", some_slow(["brick", "grass", "gravel", "camera"], "grass", "gravel", "camera"))
@pytest.mark.parametrize(("kind", "bound"), [("translation", 0.018), ("rotation", 0.05)])
def test_known_motions(name: str, kind: str, bound: float) -> None:
    shape = (150, 140) if name == "brick" else (224, 224)
    first, second, motion = (each[: shape[0], : shape[1]] for each in pair(texture(name), kind))
    flow = optical_flow(first, second)
    assert flow.uv.shape == (*shape, 2)
    assert flow.confidence.shape == shape
    assert mean_error(flow.uv, motion) < bound


@pytest.mark.slow
def test_stereo_pair() -> None:
    """Half of the disparities within 0.16 pixels and 79 % within 1, occluded places included."""
    left, right, disparity = data.stereo_motorcycle()
    grey = [np.asarray(image, float).mean(-1) for image in (left, right)]
    flow = optical_flow(*grey, levels=6)
    known = np.isfinite(disparity) & (disparity > 0)
    errors = np.abs(flow.uv[..., 0] + disparity)[known]
    assert np.median(errors) < 0.16
    assert (errors < 1).mean() > 0.79
    sure = flow.confidence[known] > np.median(flow.confidence[known])
    assert (errors[sure] < 1).mean() > 0.95


@pytest.mark.parametrize(
    ("name", "kind", "sigma", "bound"),
    [
        pytest.param("chelsea", "rotation", 10, 0.13, marks=pytest.mark.slow),
        pytest.param("coins", "rotation", 25, 0.16, marks=pytest.mark.slow),
        ("camera", "zoom", 10, 0.18),
        ("moon", "rotation", 10, 0.45),
    ],
)
def test_noise(name: str, kind: str, sigma: float, bound: float) -> None:
    """Errors are a quarter to two fifths of those of equations solved without a model of noise."""
    case = warped(name, kind).noisy(sigma)
    assert case.error(optical_flow(case.first, case.second).uv) < bound


@pytest.mark.slow
def test_given_noise() -> None:
    """Noise is in units of the images; a large value smooths the motion, and the estimated value changes little."""
    case = warped("coins", "rotation").noisy(25)
    found = {noise: case.error(optical_flow(case.first, case.second, noise=noise).uv) for noise in (None, 0.0, 25.0)}
    assert found[25.0] < 0.16 < found[0.0]
    assert abs(found[25.0] - found[None]) < 0.02
    scaled = optical_flow(case.first / 255, case.second / 255, noise=25 / 255)
    assert abs(case.error(scaled.uv) - found[25.0]) < 1e-3


@pytest.mark.parametrize(
    ("name", "kind", "bound"),
    some_slow(
        [("coins", "square", 0.09), ("moon", "fast square", 0.15), ("chelsea", "fast square", 0.1)],
        ("chelsea", "fast square", 0.1),
    ),
)
def test_moving_squares(name: str, kind: str, bound: float) -> None:
    """Boundaries are sharp; what the square covers in the second image is not visible and moves like what is."""
    case = moving_square(name, kind).noisy(0)
    flow = optical_flow(case.first, case.second)
    assert case.error(flow.uv) < bound
    assert (np.linalg.norm(flow.uv - case.motion, axis=-1)[case.visible] > 1).mean() < 0.03
    assert flow.visible.dtype == bool
    assert flow.visible[case.visible].mean() > 0.97
    assert flow.visible[~case.visible].mean() < 0.25
    assert (flow.confidence[~flow.visible] == 0).all()
    if kind == "square":
        hidden = ~case.visible & (np.linalg.norm(case.motion, axis=-1) == 0)
        assert np.median(np.linalg.norm(flow.uv[hidden], axis=-1)) < 1


def test_extreme_and_read_only_images() -> None:
    first, second, motion = part_of("gravel", "translation")
    expected = optical_flow(first, second).uv
    for scale in (1e300, 1e-300):
        a, b = first * scale, second * scale
        for image in (a, b):
            image.flags.writeable = False
        assert np.abs(optical_flow(a, b).uv - expected).max() < 1e-3
    assert mean_error(expected, motion) < 0.01


def test_brightness_and_contrast_do_not_matter() -> None:
    first, second, motion = part_of("gravel", "translation")
    flow = optical_flow(first, 40 + 0.5 * second)
    assert mean_error(flow.uv, motion) < 0.01


def test_integers_and_single_precision() -> None:
    first, second, motion = part_of("grass", "rotation")
    both = [np.round(image).clip(0, 255).astype(np.uint8) for image in (first, second)]
    flow = optical_flow(*both)
    assert flow.uv.dtype == np.float64 and mean_error(flow.uv, motion) < 0.02
    single = optical_flow(first.astype(np.float32), second.astype(np.float32))
    assert single.uv.dtype == single.confidence.dtype == np.float32
    assert mean_error(single.uv, motion) < 0.02


def test_no_structure_gives_no_motion_and_no_confidence() -> None:
    flat = optical_flow(np.full((64, 70), 3.0), np.full((64, 70), 3.0))
    assert np.abs(flat.uv).max() < 1e-6
    assert np.abs(flat.confidence).max() < 1e-6
    line = scipy.ndimage.gaussian_filter1d(np.random.default_rng(2).normal(size=130), 1.5)
    stripes = optical_flow(np.tile(line[1:-1], (128, 1)), np.tile(line[:-2], (128, 1)))
    assert stripes.confidence[24:-24, 24:-24].max() < 0.01
    assert np.abs(stripes.uv[24:-24, 24:-24] - [1, 0]).max() < 0.05


@pytest.mark.parametrize("sigma", [0.05, 0.2])
def test_noise_is_no_structure(sigma: float) -> None:
    """Along stripes, noise alone exceeds the limit in a thousandth of the places; a texture in both directions does."""
    rng = np.random.default_rng(3)
    texture = scipy.ndimage.gaussian_filter(rng.normal(size=(98, 98)), 1.5)
    stripes = np.tile(scipy.ndimage.gaussian_filter1d(rng.normal(size=98), 1.5), (98, 1))
    for image, limits in ((stripes, (0, 0.01)), (texture, (0.8, 1))):
        pair = [image[1:-1, part : part + 96] / image.std() + sigma * rng.normal(size=(96, 96)) for part in (1, 0)]
        flow = optical_flow(*pair)
        assert limits[0] <= (flow.confidence > 0).mean() <= limits[1]
        assert np.abs(np.median(flow.uv[..., 0]) - 1) < 0.05


@pytest.mark.parametrize("row", [7, 8])
def test_a_single_pixel_is_visible_wherever_it_is(row: int) -> None:
    first, second = np.zeros((2, 16, 16))
    first[row, 7] = second[row, 9] = 1
    flow = optical_flow(first, second)
    assert np.abs(flow.uv[row, 7] - [2, 0]).max() < 0.01
    assert flow.visible[:, :13].all() and not flow.visible[:, 14:].any()


@all_cases("period", [5, 2 * np.pi, 8, 12, 20])
@all_cases("turned", [False, True])
def test_of_the_motions_of_stripes_the_smallest_one_is_found(period: float, turned: bool) -> None:
    """Too few pixels of a period at a coarse level would lead to another one of them."""
    x, motion = np.arange(64), 0.3 * period
    pair = [np.tile(np.sin(2 * np.pi / period * (x - part)), (64, 1)) for part in (0, motion)]
    flow = optical_flow(*(image.T if turned else image for image in pair))
    assert np.abs(flow.uv[8:-8, 8:-8, int(turned)] - motion).mean() < 0.1
    assert flow.visible[8:-8, 8:-8].mean() > 0.9


def test_same_image() -> None:
    image = texture("brick")[:101, :75]
    assert np.abs(optical_flow(image, image).uv).max() < 1e-3


SIZES = [(37, 71), (8, 8), (1, 5), (130, 164), (9, 300)]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_medians_equal_those_of_scipy(dtype: type) -> None:
    rng = np.random.default_rng(0)
    for size in [*SIZES, (1, 1), (2, 3), (1, 40)]:
        many = np.stack([rng.normal(size=size), rng.integers(0, 3, size)]).astype(dtype)
        for image, found in zip(many, images.medians(many), strict=True):
            assert np.array_equal(found, scipy.ndimage.median_filter(image, 3, mode="nearest"))


def test_workers_change_nothing_and_progress_is_reported() -> None:
    first, second, _ = part_of("gravel", "rotation")
    reported: list[tuple[int, int]] = []
    alone = optical_flow(first, second)
    shared = optical_flow(first, second, workers=3, progress=lambda done, total: reported.append((done, total)))
    assert np.array_equal(alone.uv, shared.uv)
    assert np.array_equal(alone.confidence, shared.confidence)
    assert np.array_equal(alone.visible, shared.visible)
    assert reported == [(k, 12) for k in range(1, 13)]


@all_cases(
    "call, message",
    [
        (lambda x: optical_flow(x, x[:-1]), r"second: shape \(39, 50\); expected that of the first image"),
        (lambda x: optical_flow(x, x * np.nan), "second: a number is not finite"),
        (lambda x: optical_flow(x[None], x), "first: shape .*expected one image of at least 8 x 8 pixels"),
        (lambda x: optical_flow(np.stack([x] * 3, -1), x), "first: shape .*looks like RGB: take grey values"),
        (lambda x: optical_flow(x, x, noise=-1), "noise: -1.0; expected 0 or more"),
        (lambda x: optical_flow(x, x, noise=np.nan), "noise: nan; expected a finite number"),
        (lambda x: optical_flow(x[:0], x[:0]), "first: shape .*at least 8 x 8"),
        (lambda x: optical_flow(x[:5], x[:5]), "first: shape .*at least 8 x 8"),
        (lambda x: optical_flow(x, x, 9), "levels: 9; expected 1 to 3 for images of 40 x 50 pixels"),
        (lambda x: optical_flow(x, x, 0), "levels: 0"),
        (lambda x: optical_flow(x, x, workers=0), "workers: 0; expected 1 or more"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(np.random.default_rng(0).normal(size=(40, 50)))
