"""Colour images as quaternions, and pictures with channels where images of one number per pixel are expected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.fft
from test_wavelets import product
from test_wavelets_inputs import CALLS

from algorithms.wavelets import discrete_wavelet, from_rgb, iqft, qft, real_product_fft, rqft, to_rgb
from algorithms.wavelets.colours import GREY
from algorithms.wavelets.pictures import draw_colours, draw_denoised, draw_flow
from tests.support.all_cases import all_cases

IMAGES = [
    name
    for name, (_, shape) in CALLS.items()
    if len(shape) == 2 and name not in ("conformal_wavelet", "iconformal_wavelet")
]
"""Functions of images of one number per pixel."""

ONE = {"optical_flow", "denoise", "disparity", "estimated_noise", "key_points", "similarity_distance"}
"""Functions that do not accept stacks."""


def colours(*size: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0, 1, (*size, 3))


def test_colours_are_pure_quaternions() -> None:
    rgb = colours(6, 5)
    q = from_rgb(rgb)
    assert not q[..., 0].any() and np.array_equal(q[..., 1:], rgb) and np.array_equal(to_rgb(q), rgb)
    whole = (255 * rgb).astype(np.uint8)
    assert np.array_equal(to_rgb(from_rgb(whole)), whole) and from_rgb(whole).dtype == np.float64
    assert from_rgb(rgb.astype(np.float32)).dtype == np.float32
    assert from_rgb(np.stack([rgb, rgb])).shape == (2, 6, 5, 4)
    assert np.abs(to_rgb(iqft(qft(q))) - rgb).max() < 1e-14


@pytest.mark.parametrize("axis", ["i", "k", GREY])
def test_transforms_of_colours_are_those_of_their_channels(axis: Any) -> None:
    """For the left transform, channels are factors on the right: three complex transforms times i, j or k."""
    rgb = colours(6, 5)
    mu = np.array([0, *({"i": (1, 0, 0), "k": (0, 0, 1)}.get(axis, axis) if isinstance(axis, str) else axis)])
    expected = np.zeros((6, 5, 4))
    for k in range(3):
        numbers = scipy.fft.fft2(rgb[..., k])[..., None]
        channel = numbers.real * np.eye(4)[0] + numbers.imag * mu
        expected += product(channel, np.broadcast_to(np.eye(4)[k + 1], channel.shape))
    assert np.abs(qft(from_rgb(rgb), "left", (axis, axis)) - expected).max() < 1e-13


def test_luminance_and_chrominance_are_separated(tmp_path: Any) -> None:
    """Grey images have only luminance, and constant ones only at frequency 0."""
    grey = np.repeat(colours(16, 20)[..., :1], 3, -1)
    tint = colours(16, 20, seed=1)
    tint -= tint.mean(-1, keepdims=True)
    for image, empty in ((grey, 2), (tint, 1)):
        figure = draw_colours(from_rgb(image))
        panels = [axes for axes in figure.axes if axes.images]
        sizes = [np.asarray(axes.images[0].get_array()) for axes in panels]
        assert np.array_equal(sizes[0], np.clip(image / image.max(), 0, 1))
        floor = max(size.max() for size in sizes[1:]) - 8
        assert np.abs(sizes[empty] - floor).max() < 1e-12 and sizes[3 - empty].max() > floor + 7
    figure.savefig(tmp_path / "colours.png", dpi=40)
    luminance = 10.0 ** np.asarray([a for a in draw_colours(from_rgb(grey)).axes if a.images][1].images[0].get_array())
    expected = np.abs(np.fft.fftshift(np.fft.fft2(grey.sum(-1) / np.sqrt(3))))
    assert np.abs(luminance - expected).max() < 1e-12 * expected.max()


def test_wrong_colour_images() -> None:
    q = from_rgb(colours(6, 5))
    with pytest.raises(ValueError, match=r"image: shape \(6, 5, 4\).*leave alpha out: image\[..., :3\]"):
        from_rgb(q)
    with pytest.raises(ValueError, match=r"image: shape \(5, 3\); expected \(..., any, any, 3\), RGB"):
        from_rgb(colours(5))
    with pytest.raises(ValueError, match=r"q: shape \(6, 5, 3\)"):
        to_rgb(colours(6, 5))
    with pytest.raises(ValueError, match=r"q: scalar parts up to 1 .*expected pure quaternions; tolerance=numpy.inf"):
        to_rgb(q + np.eye(4)[0])
    assert np.array_equal(to_rgb(q + np.eye(4)[0], np.inf), to_rgb(q))
    with pytest.raises(ValueError, match="scalar parts"):
        draw_colours(q + np.eye(4)[0])


@all_cases("name", IMAGES)
@all_cases("channels, word", [(1, "one channel"), (2, "grey and alpha"), (3, "RGB"), (4, "RGBA")])
def test_pictures_with_channels_are_rejected(name: str, channels: int, word: str) -> None:
    """Errors name the function, for bytes and floats; only `qft` accepts four channels of floats, as quaternions."""
    call, shape = CALLS[name]
    picture = np.random.default_rng(0).integers(0, 255, (*shape, channels)).astype(np.uint8)
    for each in (picture, picture / 255.0, picture.astype(np.float32)):
        if name == "qft" and channels == 4 and each.dtype != np.uint8:
            assert call(each).shape == each.shape
            continue
        with pytest.raises(ValueError, match=rf"looks like {word}: .*from_rgb"):
            call(each)


@all_cases("name", [name for name in IMAGES if name not in ONE and name != "real_product_fft"])
def test_channels_are_transformed_as_a_stack(name: str) -> None:
    call, shape = CALLS[name]
    picture = np.random.default_rng(0).normal(size=(*shape, 3))
    found = np.asarray(call(np.moveaxis(picture, -1, 0)))
    for k in range(3):
        alone = np.asarray(call(picture[..., k]))
        assert np.abs(found[k] - alone).max() < 1e-12 * (1 + np.abs(alone).max())


def test_small_stacks_are_not_pictures() -> None:
    for shape in ((2, 3, 4), (2, 9, 3), (9, 3, 3), (3, 5, 5)):
        stack = np.random.default_rng(0).normal(size=shape)
        assert np.abs(rqft(stack)[1] - rqft(stack[1])).max() < 1e-13
    for shape in ((4, 4, 3), (5, 5, 4), (2, 9, 7, 3)):
        with pytest.raises(ValueError, match=r"looks like RGB.*from_rgb"):
            rqft(np.ones(shape))


def test_stacks_of_few_columns() -> None:
    """Explicit arguments resolve the ambiguity."""
    stack = np.random.default_rng(0).normal(size=(5, 32, 4))
    assert np.abs(qft(stack, values="real")[1] - qft(stack[1])).max() < 1e-13
    assert np.abs(qft(stack) - qft(stack, values="quaternion")).max() == 0
    assert qft(stack.astype(np.uint8), values="quaternion").shape == stack.shape
    assert (
        np.abs(
            discrete_wavelet(stack, "haar", 1, axes=(-2, -1)).approx[2] - discrete_wavelet(stack[2], "haar", 1).approx
        ).max()
        < 1e-14
    )
    channels = discrete_wavelet(stack, "haar", 1, axes=(0, 1)).approx
    assert np.abs(channels[..., 2] - discrete_wavelet(stack[..., 2], "haar", 1).approx).max() < 1e-14
    assert real_product_fft(stack, 3).shape == (5, 32, 4, 8)
    calls: tuple[tuple[Callable[[], object], str], ...] = (
        (lambda: qft(stack, values="colour"), "values: 'colour'; expected 'real', 'quaternion' or None"),
        (lambda: qft(stack[..., 0], values="quaternion"), "image: shape .*quaternions M N 4"),
        (lambda: rqft(stack), "looks like RGBA"),
        (lambda: real_product_fft(stack), "dimension=3 takes all axes"),
        (lambda: discrete_wavelet(stack), r"axes=\(0, 1\) takes all channels"),
        (lambda: draw_denoised(stack, stack), "noisy: shape .*looks like RGBA"),
        (lambda: draw_flow(stack, None), "image: shape .*looks like RGBA"),  # type: ignore[arg-type]
    )
    for call, message in calls:
        with pytest.raises(ValueError, match=message):
            call()
