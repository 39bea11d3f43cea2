"""Similarity distance, disparity, descriptions of textures and noise, on textures of known motion and real images."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
import scipy.ndimage

from algorithms.wavelets import (
    denoise,
    discrete_wavelet,
    disparity,
    estimated_noise,
    similarity_distance,
    texture_features,
)
from tests.support.all_cases import all_cases

TEXTURES = ("brick", "grass", "gravel")


def normal(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


@lru_cache
def picture(name: str) -> np.ndarray:
    data = pytest.importorskip("skimage.data")
    image = getattr(data, name)().astype(float)
    return np.asarray(image if image.ndim == 2 else image.mean(-1))


def moved(image: np.ndarray, u: float, v: float) -> np.ndarray:
    """The periodic image shifted by u columns and v rows."""
    rows, columns = np.fft.fftfreq(image.shape[0])[:, None], np.fft.fftfreq(image.shape[1])
    return np.fft.ifft2(np.fft.fft2(image) * np.exp(-2j * np.pi * (rows * v + columns * u))).real


def blurred(*shape: int) -> np.ndarray:
    return scipy.ndimage.gaussian_filter(normal(*shape), 1.3, mode="wrap")


def test_whole_shifts_have_distance_0() -> None:
    wide = blurred(70, 80)
    first, second = wide[6:-6, 6:-6], wide[4:-8, 9:-3]  # moves by u = -3, v = 2
    shifts = np.array([(u, v) for u in range(-4, 5) for v in range(-3, 4)])
    found = similarity_distance(first, second, shifts)
    assert (shifts[found.argmin(0)] == [-3, 2])[8:-8, 8:-8].all()
    truth = (shifts == [-3, 2]).all(1).argmax()
    assert found[truth, 12:-12, 12:-12].max() < 1e-3
    assert np.abs(similarity_distance(first, first, [(0, 0)])).max() < 1e-14
    assert np.abs(similarity_distance(first, -first, [(0, 0)]) - 2).max() < 1e-13
    assert 0.8 < similarity_distance(first, normal(58, 68, seed=5), [(0, 0)]).mean() < 1.2
    single = similarity_distance(first.astype(np.float32), second.astype(np.float32), shifts[:3])
    assert single.dtype == np.float32 and np.abs(single - found[:3]).max() < 1e-4


def nearest_shifts(first: np.ndarray, second: np.ndarray, u: float, v: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the shifts of least distance along each axis: minima of parabolas through quarters of a pixel."""
    steps = np.arange(-4, 5) / 4
    along = [(round(u) + step, v) for step in steps], [(u, round(v) + step) for step in steps]
    places = []
    for true, shifts in zip((u, v), along, strict=True):
        found = similarity_distance(first, second, shifts)[:, 14:-14, 14:-14]
        best = np.clip(found.argmin(0), 1, 7)
        before, here, after = (np.take_along_axis(found, best[None] + k, 0)[0] for k in (-1, 0, 1))
        places.append((best + (before - after) / (2 * (before - 2 * here + after)) - 4) / 4 + round(true))
    return places[0], places[1]


@pytest.mark.parametrize(("u", "v"), [(2.3, -1.4), (0.5, 0.0)])
def test_shifts_between_pixels(u: float, v: float) -> None:
    for texture, most in ((blurred(64, 60), 1e-3), (picture("gravel")[100:160, 100:164], 0.02)):
        for found, true in zip(nearest_shifts(texture, moved(texture, u, v), u, v), (u, v), strict=True):
            assert np.median(found) == pytest.approx(true, abs=most)


@pytest.mark.parametrize(("power", "most"), [(0.5, 0.07), (1.0, 0.03), (1.5, 0.03)])
def test_shifts_of_rough_textures_are_not_drawn_to_whole_pixels(power: float, most: float) -> None:
    """Images of a finer texture with amplitudes of 1 / f**power, with aliasing, as square pixels record it."""
    fine, size = 4, 64
    wide = fine * (size + 16)
    f = np.hypot(np.fft.fftfreq(wide)[:, None], np.fft.fftfreq(wide))
    f[0, 0] = np.inf
    texture = np.fft.ifft2(np.fft.fft2(normal(wide, wide, seed=7)) / f**power).real

    def seen(right: int, down: int) -> np.ndarray:
        part = texture[32 - down : 32 - down + fine * size, 32 - right : 32 - right + fine * size]
        return np.asarray(part.reshape(size, fine, size, fine).mean((1, 3)))

    for right, down in ((1, 2), (9, -7)):
        shifts = nearest_shifts(seen(0, 0), seen(right, down), right / fine, down / fine)
        for found, true in zip(shifts, (right / fine, down / fine), strict=True):
            assert np.median(found) == pytest.approx(true, abs=most)


def patches(image: np.ndarray, first: int, last: int) -> np.ndarray:
    size = 64
    starts = [(r, c) for r in range(first, last - size + 1, 32) for c in range(0, 512 - size + 1, 32)]
    return np.array([image[r : r + size, c : c + size] for r, c in starts])


def real_features(images: np.ndarray) -> np.ndarray:
    """The same means of a real wavelet transform."""
    bands = [b for level in discrete_wavelet(images, "db4", 3, "periodization").detail for b in level.values()]
    means = [np.log(np.abs(band).mean((-2, -1))) for band in bands]
    roots = [np.log((band**2).mean((-2, -1))) / 2 for band in bands]
    return np.stack([*means, *(root - mean for root, mean in zip(roots, means, strict=True))], -1)


def accuracy(features: Any) -> float:
    """Classify by the nearest mean, trained on the upper halves of the images and tested on the lower ones."""
    known = [features(patches(picture(name), 0, 256)) for name in TEXTURES]
    means, scale = np.array([each.mean(0) for each in known]), np.concatenate(known).std(0)
    right = []
    for k, name in enumerate(TEXTURES):
        there = features(patches(picture(name), 256, 512))
        right.append(np.linalg.norm((there[:, None] - means) / scale, axis=-1).argmin(1) == k)
    return float(np.mean(right))


@pytest.mark.slow
def test_textures_are_distinguished() -> None:
    own = accuracy(lambda images: texture_features(images, 3))
    assert own >= 0.99
    assert own > accuracy(real_features)


def test_descriptions_hardly_change_under_shifts() -> None:
    """For windowed textures the change is less than half that of a real transform, relative to their spread."""
    window = np.outer(np.hanning(66)[1:-1], np.hanning(66)[1:-1])
    changes = {}
    for name, features in (
        ("own", lambda images: texture_features(images, 3)[..., ::3]),
        ("real", lambda images: real_features(images)[..., :9]),
    ):
        between = np.concatenate([features(patches(picture(each), 0, 256)) for each in TEXTURES]).std(0)
        spread = []
        for each in TEXTURES:
            part = np.zeros((96, 96))
            part[16:80, 16:80] = (picture(each)[100:164, 100:164] - picture(each).mean()) * window
            spread.append(features(np.array([np.roll(part, (k, k), (0, 1)) for k in range(8)])).std(0) / between)
        changes[name] = np.mean(spread)
    assert changes["own"] < 0.5 * changes["real"], changes


@pytest.mark.slow
def test_brightness_and_contrast_of_textures() -> None:
    image = picture("gravel")[:64, :64]
    before, after = texture_features(image), texture_features(3 * image + 50)
    assert np.abs(after - before - np.tile([np.log(3), 0, 0], 12)).max() < 1e-6
    stack = texture_features(np.stack([image, image.T]), 2)
    assert np.abs(stack[0] - texture_features(image, 2)).max() < 1e-12
    assert texture_features(image.astype(np.float32)).dtype == np.float32


def test_diagonal_waves_have_psi() -> None:
    x, y = np.meshgrid(np.arange(64), np.arange(64), indexing="ij")
    one = texture_features(np.cos(2 * np.pi * 12 / 64 * (x + y)), 2)
    both = texture_features(np.cos(2 * np.pi * 12 / 64 * x) * np.cos(2 * np.pi * 12 / 64 * y), 2)
    # The last of the second level's band D.
    assert one[17] > 0.8 and both[17] < 0.2


def ratio(image: np.ndarray, other: np.ndarray) -> float:
    """The peak signal-to-noise ratio of images of bytes, in decibels."""
    return float(10 * np.log10(255**2 / ((image - other) ** 2).mean()))


@pytest.mark.parametrize("sigma", [10.0, 25.0])
@pytest.mark.parametrize("name", ["camera", "moon", "astronaut", "brick", "grass"])
def test_less_noise_remains_than_with_peers(name: str, sigma: float) -> None:
    """The ratio exceeds those of scikit-image's BayesShrink, with two wavelets, and of PyWavelets' soft thresholds."""
    restoration = pytest.importorskip("skimage.restoration")
    pywt = pytest.importorskip("pywt")
    image = picture(name)[:256, :256]
    noisy = image + sigma * normal(256, 256, seed=1)
    own = ratio(image, denoise(noisy, sigma))
    for wavelet in ("db1", "sym8"):
        peer = restoration.denoise_wavelet(noisy / 255, sigma / 255, wavelet, method="BayesShrink", rescale_sigma=False)
        assert own > ratio(image, 255 * peer)
    levels = pywt.wavedec2(noisy, "sym8", "symmetric", 4)
    universal = sigma * np.sqrt(2 * np.log(noisy.size)) / 2
    soft = [levels[0], *(tuple(pywt.threshold(band, universal, "soft") for band in level) for level in levels[1:])]
    assert own > ratio(image, pywt.waverec2(soft, "sym8", "symmetric")) + 0.1
    assert own > ratio(image, noisy) + 1
    assert ratio(image, denoise(noisy, sigma, rule="bayes")) > ratio(image, noisy) + 1


def test_noise_is_estimated_and_removed() -> None:
    flat = 100 + 7 * normal(200, 210)
    assert estimated_noise(flat) == pytest.approx(7, rel=0.02)
    clean = denoise(flat)
    assert np.abs(clean - 100).mean() < 0.7
    assert np.abs(denoise(flat, 0) - flat).max() == 0
    assert np.abs(denoise(flat, 1e-9) - flat).max() < 1e-7
    odd = denoise(flat[:33, :51].astype(np.float32), 7)
    assert odd.shape == (33, 51) and odd.dtype == np.float32
    assert denoise(np.arange(64).reshape(8, 8), 1).shape == (8, 8)


@all_cases(
    "call, message",
    [
        (lambda f: similarity_distance(f, f[:-1], [(0, 0)]), "second: shape .*expected that of the other image"),
        (lambda f: similarity_distance(f, f * np.nan, [(0, 0)]), "second: a number is not finite"),
        (lambda f: similarity_distance(f, f, [(50, 0)]), "shifts: up to 50.0"),
        (lambda f: similarity_distance(f, f, [1.0, 2.0, 3.0]), "shifts: shape .*shifts u v"),
        (lambda f: disparity(f, f, 1), "expected at least three disparities"),
        (lambda f: disparity(f, f, 5.5), "largest: 5.5; expected a whole number"),  # type: ignore[arg-type]
        (lambda f: disparity(f, f, 40), "of less than 30"),
        (lambda f: disparity(f[None], f[None], 9), "left: shape .*expected one image"),
        (lambda f: texture_features(0 * f), "the same everywhere"),
        (lambda f: texture_features(f, 0), "levels: 0; expected a whole number, 1 or more"),
        (lambda f: texture_features(f, 9), "levels: 9; expected at most 4"),
        (lambda f: denoise(f, -1.0), "sigma: -1.0; expected 0 or more"),
        (lambda f: denoise(f, 1.0, 9), "levels: 9; expected at most 4"),
        (lambda f: denoise(f, 1.0, rule="hard"), "rule: 'hard'; expected 'local' or 'bayes'"),
        (lambda f: denoise(f[:1]), "image: shape .*at least 2 x 2"),
        (lambda f: estimated_noise(f[0]), "image: shape"),
    ],
)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(normal(20, 30))
