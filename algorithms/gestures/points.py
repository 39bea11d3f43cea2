"""Features of key points of hands that translations, rotations and dilations leave as they are."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import Reals, finite, real_array, whole_number

_MIDDLE = 9
"""The first joint of the middle finger, in the order of MediaPipe: the wrist, and four points of each finger."""


def point_features(points: ArrayLike) -> Reals:
    """Compute 40 features of hands from 21 key points.

    Parameters
    ----------
    points : array_like, (..., 21, 2)
        The wrist, and four points of the thumb and of each finger, in the order of MediaPipe.

    Returns
    -------
    array, (..., 40)
        The quotients in the even subalgebra of G(2), which are scalars plus bivectors, of the vectors from the wrist
        and that to the first joint of the middle finger: scalar parts, then bivector parts. Rotations and dilations
        cancel; reflections change the sign of the bivectors.

    Raises
    ------
    TypeError, ValueError
        If `points` is not such an array of finite numbers, or the first joint of a middle finger is at the wrist.
    """
    array = finite(real_array(points, "points", (21, 2), "21 key points"), "points")
    from_wrist = array[..., 1:, :] - array[..., :1, :]
    base = from_wrist[..., _MIDDLE - 1 : _MIDDLE, :]
    square = (base**2).sum(-1)
    if (square == 0).any():
        raise ValueError("points: the first joint of a middle finger is at the wrist; expected different points")
    x, y = np.moveaxis(from_wrist, -1, 0)
    u, v = np.moveaxis(base, -1, 0)
    return np.concatenate([(u * x + v * y) / square, (u * y - v * x) / square], -1)


def mean_of_sequence(probabilities: ArrayLike, window: int = 5) -> Reals:
    """Average the probabilities of the classes over the last frames of a sequence, with more weight on certain ones.

    Parameters
    ----------
    probabilities : array_like, (frames, classes)
    window : int
        The number of frames, of which earlier ones than the first are left out.

    Returns
    -------
    array, (frames, classes)
        Normalised products of the probabilities, the evidence of independent frames, to the power ``1 / window``.

    Raises
    ------
    TypeError, ValueError
        If probabilities are not positive numbers or 0, or `window` is not positive.
    """
    array = finite(real_array(probabilities, "probabilities"), "probabilities")
    if array.ndim != 2 or array.size == 0 or (array < 0).any():
        raise ValueError(f"probabilities: shape {array.shape}; expected (frames, classes), not negative")
    whole_number(window, "window", 1)
    total = np.cumsum(np.log(np.maximum(array, 1e-12)), axis=0)
    total[window:] = total[window:] - total[:-window]
    return np.asarray(scipy.special.softmax(total / window, axis=1))
