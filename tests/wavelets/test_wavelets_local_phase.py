"""Complex Gabor banks against skimage, and local phases and frequencies of waves and of moved textures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.ndimage

from algorithms.wavelets import complex_gabor_bank, gabor_bank, local_phase, quaternion_local_phase
from tests.support.all_cases import all_cases


def normal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def wrapped(angle: np.ndarray, period: float = 2 * np.pi) -> np.ndarray:
    return (angle + period / 2) % period - period / 2


def moved(image: np.ndarray, x: float, y: float) -> np.ndarray:
    """A periodic image shifted by (x, y), exactly, as the image has no frequencies near 1/2."""
    u, v = np.fft.fftfreq(image.shape[0])[:, None], np.fft.fftfreq(image.shape[1])
    return np.fft.ifft2(np.fft.fft2(image) * np.exp(-2j * np.pi * (u * x + v * y))).real


def test_banks_equal_those_of_skimage() -> None:
    filters = pytest.importorskip("skimage.filters")
    impulse = np.zeros((71, 71))
    impulse[35, 35] = 1
    for u, v, sigma, aspect in (
        (0.1, 0.2, 3.0, 1.0),
        (-0.15, 0.1, 4.0, 1.0),
        (0.0, 0.2, 3.0, 0.75),
        (0.25, 0.0, 4.0, 2.0),
    ):
        found = complex_gabor_bank(impulse, [(u, v)], sigma, aspect)[0]
        x, y = np.meshgrid(np.arange(-35.0, 36), np.arange(-35.0, 36), indexing="ij")
        windows = [
            np.where(np.abs(t) <= np.ceil(4 * s), np.exp(-(t**2) / (2 * s**2)), 0)
            for t, s in ((x, sigma), (y, sigma / aspect))
        ]
        window = windows[0] * windows[1]
        expected = window / window.sum() * np.exp(2j * np.pi * (u * x + v * y))
        assert np.abs(found - expected).max() < 1e-16
        if aspect == 1:
            kernel = filters.gabor_kernel(np.hypot(u, v), np.arctan2(u, v), sigma_x=sigma, sigma_y=sigma, n_stds=4)
            rows, columns = (n // 2 for n in kernel.shape)
            part = found[35 - rows : 36 + rows, 35 - columns : 36 + columns]
            inside = np.abs(kernel) > 0
            # skimage's Gaussian has the norm of the whole plane.
            assert np.abs(part - kernel)[inside].max() < 3e-4 * np.abs(kernel).max()


def test_banks_against_scipy_and_the_quaternionic_one() -> None:
    image = normal(3, 30, 40) + 5
    found = complex_gabor_bank(image, [(0.1, 0.2), (0.1, -0.2)], 2.5)
    w, x, y, z = np.moveaxis(gabor_bank(image, [(0.1, 0.2)], 2.5)[:, 0], -1, 0)
    assert np.abs(found[:, 0] - ((w - z) + 1j * (x + y))).max() < 1e-13
    assert np.abs(found[:, 1] - ((w + z) + 1j * (x - y))).max() < 1e-13
    t = np.arange(-10, 11.0)
    g = np.exp(-(t**2) / (2 * 2.5**2))
    kernel = np.outer(g, g) / g.sum() ** 2 * np.exp(2j * np.pi * (0.1 * t[:, None] + 0.2 * t))
    expected = scipy.ndimage.convolve(image[1], kernel.real, mode="reflect")
    assert np.abs(found[1, 0].real - expected).max() < 1e-12
    flat = complex_gabor_bank(np.full((30, 40), 7.0), [(0.1, 0.2), (0.02, 0.0)], (3.0, 2.0), 1.3, True)
    assert np.abs(flat).max() < 1e-13
    assert complex_gabor_bank(image.astype(np.float32), [(0.1, 0.2)]).dtype == np.complex64


def test_phase_and_frequency_of_a_wave() -> None:
    x, y = np.meshgrid(np.arange(80.0), np.arange(90.0), indexing="ij")
    angle = 2 * np.pi * (0.11 * x - 0.16 * y) + 0.5
    found = local_phase(3 * np.cos(angle), (0.1, -0.15), 4.0)
    inside = (slice(20, -20),) * 2
    gain = np.exp(-2 * np.pi**2 * 16 * 2e-4)
    assert np.abs(found.amplitude[inside] - 1.5 * gain).max() < 2e-3
    assert np.abs(wrapped(found.phase - angle))[inside].max() < 2e-3
    assert np.abs(found.frequency[inside] - 2 * np.pi * np.array([0.11, -0.16])).max() < 1e-3
    assert found.confidence[inside].min() > 0.8
    assert np.abs(found.frequency - 2 * np.pi * np.array([0.11, -0.16]))[0, 20:-20, 1].max() < 0.05
    wrong = local_phase(3 * np.cos(angle), (0.2, -0.05), 4.0)
    assert wrong.confidence[inside].max() < 0.2


def test_quaternionic_phase_and_frequency_of_a_wave() -> None:
    x, y = np.meshgrid(np.arange(80.0), np.arange(90.0), indexing="ij")
    a, b = 2 * np.pi * 0.11 * x + 0.4, 2 * np.pi * 0.16 * y - 0.2
    found = quaternion_local_phase(np.cos(a) * np.cos(b), (0.1, 0.15), 4.0)
    inside = (slice(20, -20),) * 2
    assert np.abs(wrapped(found.phi - a, np.pi))[inside].max() < 3e-3
    assert np.abs(wrapped(found.theta - b, np.pi))[inside].max() < 3e-3
    assert np.abs(found.psi)[inside].max() < 2e-3
    assert np.abs(found.frequency[inside] - 2 * np.pi * np.array([0.11, 0.16])).max() < 1e-3
    assert found.confidence[inside].min() > 0.8
    # A single diagonal wave is in the singular set.
    single = quaternion_local_phase(np.cos(a - b), (0.1, 0.15), 4.0)
    assert np.abs(single.psi[inside] - np.pi / 4).max() < 0.01 and single.confidence[inside].max() < 0.1


def area_under_curve(good: np.ndarray, score: np.ndarray) -> float:
    """The probability that a good pixel has a higher score than a bad one."""
    order = np.argsort(np.argsort(score))
    count = good.sum()
    return float((order[good].sum() - count * (count - 1) / 2) / (count * (good.size - count)))


def textures() -> list[tuple[str, np.ndarray]]:
    """Smoothed noise and parts of scikit-image's images, smoothed over a pixel."""
    data = pytest.importorskip("skimage.data")
    images = [(name, getattr(data, name)()[100:230, 120:260].astype(float)) for name in ("brick", "gravel")]
    images += [("camera", data.camera()[100:300, 120:330].astype(float)), ("noise", normal(130, 140))]
    return [
        (name, scipy.ndimage.gaussian_filter(image, 1.2 - 0.2 * (name != "noise"), mode="wrap"))
        for name, image in images
    ]


@pytest.mark.parametrize(("motion", "area"), [((0.7, -0.4), 0.975), ((1.7, 1.2), 0.87)])
def test_confidence_of_complex_phases(motion: tuple[float, float], area: float) -> None:
    """Phases of a moved texture change by frequency times motion, except where confidence is low."""
    for name, texture in textures():
        first, second = (local_phase(image, (0.12, 0.1), 3.5) for image in (texture, moved(texture, *motion)))
        error = np.abs(wrapped(second.phase - first.phase + first.frequency @ np.array(motion)))[15:-15, 15:-15]
        confidence = first.confidence[15:-15, 15:-15]
        assert area_under_curve((error < 0.2).ravel(), confidence.ravel()) > area, name
        if motion[0] == 0.7:
            assert np.median(error[confidence > 0.5]) < 0.02


@pytest.mark.parametrize(("motion", "area"), [((0.7, -0.4), 0.945), ((1.7, 1.2), 0.86)])
def test_confidence_of_quaternionic_phases(motion: tuple[float, float], area: float) -> None:
    for name, texture in textures():
        first, second = (
            quaternion_local_phase(image, (0.12, 0.1), 3.5) for image in (texture, moved(texture, *motion))
        )
        errors = [
            np.abs(wrapped(after - before + frequency * shift, np.pi))
            for after, before, frequency, shift in (
                (second.phi, first.phi, first.frequency[..., 0], motion[0]),
                (second.theta, first.theta, first.frequency[..., 1], motion[1]),
            )
        ]
        inside = (slice(15, -15),) * 2
        error, confidence = np.maximum(*errors)[inside], first.confidence[inside]
        assert area_under_curve((error < 0.2).ravel(), confidence.ravel()) > area, name
        if motion[0] == 0.7:
            assert np.median(error[confidence > 0.4]) < 0.05


@all_cases("value", [0.0, 7.0, 1e-300, -1e300, np.float32(0.1)])
def test_constant_images_have_no_phase(value: float) -> None:
    """Bands of rounding errors have no confidence."""
    image = np.full((2, 40, 50), value)
    for found in (
        local_phase(image, (0.12, -0.1)),
        quaternion_local_phase(image, (0.12, 0.1)),
        local_phase(image, (0, 0)),
    ):
        assert all(np.isfinite(part).all() for part in found)
        assert not found.confidence.any()
    one = np.stack([image[0], normal(40, 50)])
    assert not local_phase(one, (0.12, 0.1)).confidence[0].any()
    assert (
        np.abs(local_phase(one, (0.12, 0.1)).confidence[1] - local_phase(one[1], (0.12, 0.1)).confidence).max() < 1e-12
    )


@all_cases("frequency", [(0.0, 0.11), (0.11, 0.0), (0.1, 0.2), (0.5, 0.1)])
def test_balanced_bands_of_waves(frequency: tuple[float, float]) -> None:
    """A wave through the axis of the filter keeps its amplitude; the complex bank of both diagonals is the same."""
    x, y = np.meshgrid(np.arange(70.0), np.arange(80.0), indexing="ij")
    u, v = frequency
    image = 3 + np.cos(2 * np.pi * (u * x + v * y) + 0.3) + 0.01 * normal(70, 80)
    w, i, j, k = np.moveaxis(gabor_bank(image, [frequency], balanced=True)[0], -1, 0)
    found = complex_gabor_bank(image, [(u, v), (u, -v)], balanced=True)
    assert np.abs(found[0] - ((w - k) + 1j * (i + j))).max() < 1e-13
    assert np.abs(found[1] - ((w + k) + 1j * (i - j))).max() < 1e-13
    inside = (slice(20, -20),) * 2
    if frequency[0] < 0.5:
        assert np.abs(np.abs(found[0][inside]) - 0.5).max() < 0.02
    if 0 in frequency:
        local = quaternion_local_phase(image, frequency)
        assert np.abs(local.amplitude[inside] - 0.5).max() < 0.02
        assert np.abs(local.frequency[inside] / (2 * np.pi) - np.array(frequency)).max() < 2e-3
        assert local.confidence[inside].min() > 0.8
    assert np.abs(gabor_bank(np.full((30, 40), 7.0), [frequency], balanced=True)).max() < 1e-13


@all_cases(
    "call, message",
    [
        (lambda f: complex_gabor_bank(f, [(0.6, 0.0)]), "frequencies: 0.6; expected cycles per pixel from -0.5"),
        (lambda f: complex_gabor_bank(f, [(0.1, 0.0)], 0.0), "sigma: 0.0; expected a positive number"),
        (lambda f: complex_gabor_bank(f, [(0.1, 0.0)], aspect=-1.0), "aspect: -1.0"),
        (lambda f: complex_gabor_bank(f, [(0.1, 0.0)], (1.0, 2.0)), "sigma: 2 for 1 frequencies"),
        (lambda f: complex_gabor_bank(f, [(0.1, 0.0)], truncate=0.0), "truncate: 0.0; expected a positive number"),
        (lambda f: gabor_bank(f, [(0.1, 0.0)], truncate=np.inf), "truncate: inf; expected a finite number"),
        (lambda f: gabor_bank(f, [(0.1, 0.0)], aspect=0.0), "aspect: 0.0; expected a positive number"),
        (lambda f: local_phase(f * np.nan, (0.1, 0.1)), "image: a number is not finite"),
        (lambda f: local_phase(f[:1], (0.1, 0.1)), "at least 2 x 2 pixels"),
        (lambda f: quaternion_local_phase(f[0], (0.1, 0.1)), "image: shape .*images M N"),
        (lambda f: quaternion_local_phase(f, (-0.1, 0.1)), "frequencies: -0.1; expected"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(normal(12, 13))


@pytest.mark.parametrize("balanced", [False, True])
@pytest.mark.parametrize("shape", [(40, 51), (1, 7), (9, 1)])
def test_bands_equal_direct_filters(shape: tuple[int, int], balanced: bool) -> None:
    """Also where the filters are larger than the image, whose mirror images repeat."""
    image = np.random.default_rng(8).normal(size=(2, *shape))
    frequencies, sigma = [(0.1, -0.2), (0.0, 0.3)], [2.0, 3.5]
    found = complex_gabor_bank(image, frequencies, sigma, 0.8, balanced)
    for k, (pair, width) in enumerate(zip(frequencies, sigma, strict=True)):
        expected, smooth, even = image.astype(complex), image, 1.0
        for axis, frequency, size in ((-2, pair[0], width), (-1, pair[1], width / 0.8)):
            x = np.arange(-np.ceil(4 * size), np.ceil(4 * size) + 1)
            gaussian = np.exp(-(x**2) / (2 * size**2))
            gaussian /= gaussian.sum()
            wave = gaussian * np.exp(2j * np.pi * frequency * x)
            even *= wave.real.sum()
            expected = scipy.ndimage.convolve1d(expected, wave, axis, mode="reflect")
            smooth = scipy.ndimage.convolve1d(smooth, gaussian, axis, mode="reflect")
        assert np.abs(found[:, k] - expected + balanced * even * smooth).max() < 1e-14


def test_filters_much_larger_than_images_need_no_more_memory() -> None:
    """Of such widths, a filter of frequency 0 is the mean of the image, and of others 0."""
    image = np.random.default_rng(9).normal(size=(6, 9))
    found = complex_gabor_bank(image, [(0.0, 0.0), (0.1, 0.2)], 1e5)
    np.testing.assert_allclose(found[0], image.mean(), atol=1e-9)
    assert np.abs(found[1]).max() < 1e-9
