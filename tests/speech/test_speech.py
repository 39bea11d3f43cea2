"""Images of speech and features of phonemes: closed forms, and bad input."""

from __future__ import annotations

import re
import wave
from pathlib import Path

import numpy as np
import pytest

from algorithms.speech import band_filters, band_powers, bark_image, phoneme_features, read_wav
from tests.support.all_cases import all_cases

RATE = 8000
NOISE = np.random.default_rng(0).normal(size=4000) / 10


def test_mel_filters_are_those_of_the_definition() -> None:
    """Slaney's scale in scalar arithmetic: corners, areas, and triangles by interpolation."""

    def hertz(mel: float) -> float:
        return mel * 200 / 3 if mel < 15 else float(1000 * 6.4 ** ((mel - 15) / 27))

    top = 15 + 27 * np.log(4.0) / np.log(6.4)
    corners = [hertz(top * k / 21) for k in range(22)]
    f = np.arange(129) * RATE / 256
    want = [np.interp(f, corners[k : k + 3], [0, 1, 0], 0, 0) * 2 / (corners[k + 2] - corners[k]) for k in range(20)]
    assert np.allclose(band_filters(RATE, 256, 20, "mel"), want, rtol=1e-9, atol=1e-12)


def test_powers_equal_sums_over_frames() -> None:
    found = band_powers(NOISE, RATE, 12, "mel", 0.02, 0.01)
    n, hop = 160, 80
    t = np.arange(n)
    matrix = np.exp(-2j * np.pi * np.outer(np.arange(n // 2 + 1), t) / n)
    padded = np.concatenate([np.zeros(n // 2), NOISE, np.zeros(n // 2)])
    frames = [padded[k * hop : k * hop + n] * np.sin(np.pi * t / n) ** 2 for k in range(1 + len(NOISE) // hop)]
    want = band_filters(RATE, n, 12, "mel") @ np.array([abs(matrix @ frame) ** 2 for frame in frames]).T
    assert found.shape == want.shape and np.allclose(found, want, rtol=1e-9)


@all_cases("rate", [8000, 11025, 16000, 44100])
def test_a_tone_is_in_its_band(rate: int) -> None:
    image = bark_image(np.sin(2 * np.pi * 1500 * np.arange(rate // 4) / rate), rate)
    top = 26.81 * (rate / 2) / (1960 + rate / 2)
    band = 26.81 * 1500 / 3460 / top * 21 - 1
    assert image.shape[0] == 20 and abs(int(image[:, 10].argmax()) - band) <= 1
    assert image.max() - image.min() <= 80


@pytest.mark.parametrize("width", [1, 2, 3, 4])
def test_wav_files(tmp_path: Path, width: int) -> None:
    values = [-(2 ** (8 * width - 1)), -1, 0, 2 ** (8 * width - 1) - 1]
    raw = b"".join(
        (v + 128).to_bytes(1, "little") if width == 1 else v.to_bytes(width, "little", signed=True) for v in values
    )
    for channels in (1, 2):
        with wave.open(str(tmp_path / "a.wav"), "wb") as file:
            file.setparams((channels, width, 8000, 0, "NONE", ""))
            file.writeframes(raw)
        samples, rate = read_wav(tmp_path / "a.wav", None if channels == 1 else 1)
        assert rate == 8000 and np.array_equal(
            samples, np.array(values)[channels - 1 :: channels] / 2.0 ** (8 * width - 1)
        )
    with pytest.raises(ValueError, match="2 channels"):
        read_wav(tmp_path / "a.wav")
    (tmp_path / "b.wav").write_bytes(b"")
    with pytest.raises(ValueError, match="not a WAV file"):
        read_wav(tmp_path / "b.wav")


def test_features() -> None:
    image = np.random.default_rng(1).normal(size=(20, 22))
    found = phoneme_features(image)
    assert found.shape == (60,) and np.allclose(found, phoneme_features(image + 30))
    # The last coefficients against sums of cosines and sines: F = CC - i SC - j CS + k SS.
    u, v = 2 * np.pi * np.arange(20) / 20, 2 * np.pi * np.arange(22) / 22
    c, s = np.cos(5 * u) @ image, np.sin(5 * u) @ image
    want = np.array([c @ np.cos(v), -s @ np.cos(v), -c @ np.sin(v), s @ np.sin(v)]) / image.size
    assert np.allclose(found[-4:], want)
    assert np.allclose(phoneme_features(2 * image)[:10] - found[:10], np.log(4))


@all_cases(
    "samples, rate, message",
    [
        (np.zeros(4000), RATE, "not silent"),
        (np.clip(20 * NOISE, -1, 1), RATE, "clipping"),
        (np.ones(1), RATE, "samples: 1;"),
        (np.ones(0), RATE, "samples: 0;"),
        (NOISE[:100], RATE, "at least 205"),
        (np.stack([NOISE, NOISE], 1), RATE, "one channel"),
        (np.where(np.arange(4000) == 7, np.nan, NOISE), RATE, "nan at (7,)"),
        ((NOISE * 1000).astype(np.int16), RATE, "whole numbers"),
        (NOISE, 100, "at least 4000"),
    ],
)
def test_bad_samples(samples: np.ndarray, rate: float, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=re.escape(message)):
        bark_image(samples, rate)


@pytest.mark.parametrize(
    ("image", "message"),
    [(np.ones((20, 20)), "the same"), (np.ones((4, 9)), "4 bands"), (np.ones((20, 20, 3)), "looks like")],
)
def test_bad_images(image: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        phoneme_features(image)
