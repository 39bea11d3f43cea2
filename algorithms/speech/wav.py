"""WAV files, by the standard library."""

from __future__ import annotations

import wave
from os import PathLike

import numpy as np
from numpy.typing import NDArray


def read_wav(path: str | PathLike[str], channel: int | None = None) -> tuple[NDArray[np.float64], int]:
    """Read a WAV file of 8, 16, 24 or 32 bits per sample.

    Parameters
    ----------
    path : path
    channel : int, optional
        The channel to return, from 0. Required for files of several channels.

    Returns
    -------
    samples : array, (N,)
        From -1 to 1.
    rate : int
        Samples per second.

    Raises
    ------
    ValueError
        If the file is not a WAV file of such samples, has no samples, or has several channels and none is chosen.
    """
    try:
        with wave.open(str(path), "rb") as file:
            count, width, rate = file.getnchannels(), file.getsampwidth(), file.getframerate()
            data = file.readframes(file.getnframes())
    except (wave.Error, EOFError) as error:
        raise ValueError(f"{path}: not a WAV file of whole numbers ({error or 'it ends early'})") from None
    if width not in (1, 2, 3, 4):
        raise ValueError(f"{path}: {8 * width} bits per sample; expected 8, 16, 24 or 32")
    if channel is None and count != 1:
        raise ValueError(f"{path}: {count} channels; expected one, or channel=0 to {count - 1}")
    if channel is not None and not 0 <= channel < count:
        raise ValueError(f"{path}: {count} channels; expected channel from 0 to {count - 1}, found {channel}")
    size = len(data) // (width * count)
    if size == 0:
        raise ValueError(f"{path}: no samples; expected at least one")
    raw = np.frombuffer(data[: size * width * count], np.uint8).reshape(size, count, width)[:, channel or 0]
    if width == 1:
        return (raw[:, 0] - 128.0) / 128, rate
    # The bytes become the upper ones of 32 bits, which keeps the sign.
    whole = np.zeros((size, 4), np.uint8)
    whole[:, 4 - width :] = raw
    return whole.view("<i4")[:, 0] / 2.0**31, rate
