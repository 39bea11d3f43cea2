"""Low-frequency quaternion Fourier coefficients of images of vowels and words, for classifiers."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals
from ..wavelets import rqft
from ..wavelets.checks import single_image

_FRAMES = 24
"""Number of frames to which words are resampled."""
_QUIET, _RANGE = 30.0, 60.0
"""Levels in decibels under the largest one: of frames outside a word, and of the lower limit of images."""


def vowel_features(image: ArrayLike, middle: float = 0.7) -> Reals:
    """Compute 10 features of a vowel: quaternion Fourier coefficients of the frequencies 1 to 5 along bands.

    Parameters
    ----------
    image : array_like, (M, N)
        Levels in M bands, at least 11, and N frames, as from `bark_image`.
    middle : float
        The share of the frames, around the middle, that is used.

    Returns
    -------
    array, (10,)
        The components 1 and i of the coefficients of the frequency 0 along time, where the components j and k vanish.

    Raises
    ------
    TypeError, ValueError
        If `image` is not one array of finite real numbers, has channels, or is too small or constant.
    """
    array = _image(image)
    if not 0 < middle <= 1:
        raise ValueError(f"middle: {middle}; expected a share above 0, at most 1")
    n = array.shape[1]
    cut = int(n * (1 - middle) / 2)
    used = np.maximum(array, array.max() - _RANGE)[:, cut : n - cut].mean(1, keepdims=True)
    spectrum = rqft(used - used.mean(), workers=1)[1:6, 0] / used.size
    return np.asarray(spectrum[:, :2].ravel())


def word_features(image: ArrayLike) -> Reals:
    """Compute 34 features of a word: its quaternion Fourier coefficients of low frequencies.

    Parameters
    ----------
    image : array_like, (M, N)
        Levels in M bands, at least 11, and N frames, as from `bark_image`.

    Returns
    -------
    array, (34,)
        The components that do not vanish of the coefficients of frequencies 0 to 3 along bands and 0 to 2 along time,
        without the mean. Quiet frames at both ends are cut, and the others resampled to 24.

    Raises
    ------
    TypeError, ValueError
        As in `vowel_features`.
    """
    word = word_image(image)
    # Components with a sine of the frequency 0 vanish: i and k for bands, j and k for time.
    spectrum = rqft(word - word.mean(), workers=1)[:4, :3] / word.size
    return np.concatenate([spectrum[0, 1:, ::2].ravel(), spectrum[1:, 0, :2].ravel(), spectrum[1:, 1:].ravel()])


def word_quaternions(image: ArrayLike) -> Reals:
    """Compute 3 quaternions for each of 24 times of a word, for time-delay networks.

    Parameters
    ----------
    image : array_like, (M, N)
        As in `word_features`.

    Returns
    -------
    array, (24, 3, 4)
        The Fourier coefficients along bands of the frequencies 1 to 6, two in a quaternion.
    """
    word = word_image(image)
    spectrum = np.stack([rqft(frame - frame.mean(), workers=1)[1:7, 0, :2] for frame in word.T[:, :, None]])
    return np.asarray(spectrum.reshape(_FRAMES, 3, 4) / len(word))


def word_image(image: ArrayLike) -> Reals:
    """Cut quiet frames at both ends of an image, limit its levels from below, and resample it to 24 frames."""
    array = _image(image)
    total = np.log10((10 ** ((array - array.max()) / 10)).sum(0)) * 10
    loud = np.flatnonzero(total > total.max() - _QUIET)
    array = np.maximum(array[:, loud[0] : loud[-1] + 1], array.max() - _RANGE)
    times = np.linspace(0, array.shape[1] - 1, _FRAMES)
    return np.stack([np.interp(times, np.arange(array.shape[1]), row) for row in array])


def _image(image: ArrayLike) -> Reals:
    array = single_image(image)
    if array.shape[0] < 11:
        raise ValueError(f"image: {array.shape[0]} bands; expected at least 11")
    if np.ptp(array) == 0:
        raise ValueError("image: the same everywhere; expected an image of speech")
    return array
