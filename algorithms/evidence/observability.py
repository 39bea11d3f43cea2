"""What data determine: eigenvalues of their information, in relation to rounding and to noise."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals
from ..precision import NEGLIGIBLE


def spectrum(information: Reals) -> tuple[Reals, Reals, Reals]:
    """Return eigenvalues and vectors of an information scaled to ones on its diagonal, and the scale.

    Parameters
    ----------
    information : array, (p, p)

    Returns
    -------
    values, vectors, scale : array, (p,), (p, p), (p,)
        The rows of ``vectors.T * scale`` are directions of the parameters.
    """
    diagonal = np.diag(information)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1))
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    return values, vectors, scale


def rank(information: Reals) -> int:
    """Return how many directions of the parameters an information (p, p) determines."""
    return int((spectrum(information)[0] > NEGLIGIBLE).sum())


def undetermined(information: Reals) -> Reals:
    """Return the directions (p - rank, p), of norm 1, that an information (p, p) leaves undetermined."""
    values, vectors, scale = spectrum(information)
    free = vectors[:, : int((values <= NEGLIGIBLE).sum())].T * scale
    return np.asarray(free / np.linalg.norm(free, axis=1, keepdims=True))
