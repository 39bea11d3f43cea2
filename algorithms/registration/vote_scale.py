"""The scale of votes for which tokens have enough neighbours."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

_NEIGHBOURS = 16
"""Tokens within three sigma."""


def default_sigma(points: ArrayLike) -> float:
    """Return a third of the median distance to the 16th neighbour among different finite points (n, d).

    It is 1 for fewer than two different points, and for arrays that are not points.
    """
    array = np.asarray(points)
    if array.ndim != 2 or array.dtype.kind not in "fiub":
        return 1.0
    places = np.unique(array[np.isfinite(array).all(1)], axis=0)
    if len(places) < 2:
        return 1.0
    k = min(_NEIGHBOURS, len(places) - 1)
    return float(np.median(scipy.spatial.cKDTree(places).query(places, k=k + 1)[0][:, k])) / 3
