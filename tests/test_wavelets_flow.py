"""Optical flow on warps of real images whose motion is known, and on a stereo pair with measured disparities."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.ndimage
from flow_truth import mean_error, pair

from algorithms.wavelets import optical_flow
from algorithms.wavelets.separable import filter_bank, median_5

data = pytest.importorskip("skimage.data")


def texture(name: str) -> np.ndarray:
    return getattr(data, name)()[60:364, 60:364]


@pytest.mark.parametrize("name", ["brick", "grass", "gravel", "camera"])
@pytest.mark.parametrize(("kind", "bound"), [("translation", 0.03), ("rotation", 0.07)])
def test_known_motions(name: str, kind: str, bound: float) -> None:
    first, second, motion = pair(texture(name), kind)
    flow = optical_flow(first, second)
    assert flow.uv.shape == (224, 224, 2)
    assert flow.confidence.shape == (224, 224)
    assert mean_error(flow.uv, motion) < bound


def test_stereo_pair() -> None:
    """Half of the disparities within 0.3 pixels and 68 % within 1, occluded places included."""
    left, right, disparity = data.stereo_motorcycle()
    grey = [np.asarray(image, float).mean(-1) for image in (left, right)]
    flow = optical_flow(*grey, levels=6)
    known = np.isfinite(disparity) & (disparity > 0)
    errors = np.abs(flow.uv[..., 0] + disparity)[known]
    assert np.median(errors) < 0.3
    assert (errors < 1).mean() > 0.68
    sure = flow.confidence[known] > np.median(flow.confidence[known])
    assert (errors[sure] < 1).mean() > 0.9


def test_brightness_and_contrast_do_not_count() -> None:
    first, second, motion = pair(texture("gravel"), "translation")
    flow = optical_flow(first, 40 + 0.5 * second)
    assert mean_error(flow.uv, motion) < 0.01


def test_integers_and_single_precision() -> None:
    first, second, motion = pair(texture("grass"), "rotation")
    both = [np.round(image).clip(0, 255).astype(np.uint8) for image in (first, second)]
    assert optical_flow(*both).uv.dtype == np.float64
    assert mean_error(optical_flow(*both).uv, motion) < 0.02
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


def test_same_image() -> None:
    image = texture("brick")[:101, :75]
    assert np.abs(optical_flow(image, image).uv).max() < 1e-3


@pytest.mark.parametrize("size", [(37, 71), (8, 8), (1, 5), (130, 64)])
def test_medians_and_filters_are_those_of_scipy(size: tuple[int, int]) -> None:
    image = np.random.default_rng(0).normal(size=size)
    assert np.array_equal(median_5(image), scipy.ndimage.median_filter(image, 5, mode="nearest"))
    taps = np.random.default_rng(1).normal(size=(2, 9))
    for axis in (0, 1):
        found = filter_bank(image, taps, axis)
        for k in range(2):
            assert np.abs(found[k] - scipy.ndimage.convolve1d(image, taps[k], axis, mode="reflect")).max() < 1e-13


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda x: optical_flow(x, x[:-1]), r"second: shape \(39, 50\); expected that of the first image"),
        (lambda x: optical_flow(x, x * np.nan), "second: a number is not finite"),
        (lambda x: optical_flow(x[None], x), "first: shape .*expected one image of at least 8 x 8 pixels"),
        (lambda x: optical_flow(x[:5], x[:5]), "first: shape .*at least 8 x 8"),
        (lambda x: optical_flow(x, x, 9), "levels: 9; expected 1 to 3 for images of 40 x 50 pixels"),
        (lambda x: optical_flow(x, x, 0), "levels: 0"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(np.random.default_rng(0).normal(size=(40, 50)))
