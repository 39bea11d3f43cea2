"""Features of phonemes from quaternionic Gabor filters and quaternion Fourier transforms of their images."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals
from ..wavelets import gabor_bank, rqft
from ..wavelets.checks import single_image

_AREAS, _FREQUENCIES = 5, ((0.1, 0.0), (0.2, 0.05))
"""The number of areas of a spectrogram, and the frequencies of Gabor filters."""


def phoneme_features(image: ArrayLike) -> Reals:
    """Compute 60 features of the image of a phoneme.

    Parameters
    ----------
    image : array_like, (M, N)
        Levels in M bands, at least 10, and N frames, at least 2, as from `bark_image`. The mean level has no influence.

    Returns
    -------
    array, (60,)
        First, for each of two quaternionic Gabor filters and five areas of bands, the logarithm of the mean energy,
        and the cosine-like and sine-like shares of the band direction: the differences of squares of even and odd
        parts, and twice their products, divided by the energy. Then the nonzero quaternion Fourier coefficients of the
        image, divided by its size, for five frequencies along bands from 1 and two along time from 0.

    Raises
    ------
    TypeError, ValueError
        If `image` is not one array of finite real numbers, has channels, or is too small or constant.
    """
    array = single_image(image, least=2)
    if array.shape[0] < 2 * _AREAS:
        raise ValueError(f"image: {array.shape[0]} bands; expected at least {2 * _AREAS}")
    if np.ptp(array) == 0:
        raise ValueError("image: the same everywhere; expected the image of a phoneme")
    centred = array - array.mean()
    w, x, y, z = np.moveaxis(gabor_bank(centred, _FREQUENCIES, 2.0, workers=1), -1, 0)
    parts = w * w + y * y + x * x + z * z, w * w + y * y - x * x - z * z, 2 * (w * x + y * z)
    areas = np.linspace(0, array.shape[0], _AREAS + 1).astype(int)
    sums = [np.add.reduceat(part.mean(-1), areas[:-1], axis=-1) for part in parts]
    floor = 1e-6 * (centred**2).mean()
    energy = sums[0] / np.diff(areas) + floor
    gabor = np.stack([np.log(energy), *(s / np.diff(areas) / energy for s in sums[1:])])
    spectrum = rqft(centred, workers=1)[1:6, :2] / array.size
    # Sines of the frequency 0 are 0, so that only two components remain for time frequency 0.
    return np.concatenate([gabor.ravel(), spectrum[:, 0, :2].ravel(), spectrum[:, 1].ravel()])
