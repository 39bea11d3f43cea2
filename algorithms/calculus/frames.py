"""Reciprocal frames: the vectors that give coordinates in a frame that need not be orthonormal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import real_array
from ..precision import EIGENVALUE
from ..subspaces.gram import gram_matrix
from .linear_functions import LinearStatus

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ReciprocalFrame:
    """Result of `reciprocal_frame`.

    Attributes
    ----------
    vectors : array, (..., k, n)
        NaN if the status is not OK.
    status : array, (...)
        `LinearStatus`: OK or SINGULAR.
    """

    vectors: Floats
    status: NDArray[np.int64]


def reciprocal_frame(vectors: ArrayLike, gram: ArrayLike | None = None) -> ReciprocalFrame:
    """Return the vectors ``f_i`` in the span of a frame with ``f_i . e_j = 1`` if ``i = j``, and 0 otherwise.

    They are ``f_i = (-1)**(i - 1) (e_1 ^ ... without e_i ... ^ e_k) E**-1`` with ``E = e_1 ^ ... ^ e_k``. The
    coordinates of any `x` in the span are ``f_i . x``; for other `x` these are the coordinates of its projection.

    Parameters
    ----------
    vectors : array_like, (..., k, n)
        The frame: k vectors of any lengths, with k at most n.
    gram : array_like, (n,) or (n, n), optional
        The squares of the basis vectors or all their inner products; the default is Euclidean.

    Returns
    -------
    ReciprocalFrame
        The status is SINGULAR if the vectors are dependent up to rounding, or if a vector of their span is orthogonal
        to the whole span: the reciprocal frame does not exist then.

    Raises
    ------
    TypeError, ValueError
        If shapes are inconsistent, or if values are not real numbers.

    Notes
    -----
    The computation uses an orthonormal basis of the span (QR), so that errors are proportional to the condition number
    of the frame and not to its square: the error of ``f_i . e_j`` is 1e-15 times the condition number of the frame with
    its vectors scaled to length 1
    (`tests/calculus/test_frames_and_simplexes.py`).

    Examples
    --------
    >>> import numpy as np
    >>> from algorithms.calculus import reciprocal_frame
    >>> frame = np.array([[1.0, 0, 0], [1, 2, 0]])
    >>> found = reciprocal_frame(frame).vectors
    >>> np.allclose(found @ frame.T, np.eye(2))
    True
    """
    array = real_array(vectors, "vectors", (-1, -1), "frames").astype(np.float64, copy=False)
    k, n = array.shape[-2:]
    if not 1 <= k <= n:
        raise ValueError(f"vectors: shape {array.shape}; expected (..., k, n), k from 1 to n vectors")
    metric = gram_matrix(gram, n)
    lengths = np.abs(array).max(-1, keepdims=True)
    with np.errstate(all="ignore"):
        scale = lengths * np.linalg.norm(array / lengths, axis=-1, keepdims=True)
        usable = np.isfinite(scale).all((-2, -1)) & (scale > 0).all((-2, -1))
        units = np.where(usable[..., None, None], array / scale, np.eye(k, n))
    q, r = np.linalg.qr(np.swapaxes(units, -1, -2))
    inner = np.swapaxes(q, -1, -2) @ metric @ q
    usable &= _least(r, 1.0) > EIGENVALUE
    usable &= _least(inner, float(np.abs(metric).max())) > EIGENVALUE
    safe = usable[..., None, None]
    inner, r = np.where(safe, inner, np.eye(k)), np.where(safe, r, np.eye(k))
    found = np.linalg.solve(r, np.linalg.solve(inner, np.swapaxes(q, -1, -2)))
    with np.errstate(all="ignore"):
        found = np.where(safe, found / scale, np.nan)
    status = np.where(usable, LinearStatus.OK, LinearStatus.SINGULAR).astype(np.int64)
    return ReciprocalFrame(found, status)


def _least(matrices: Floats, size: float) -> Floats:
    """Return the least singular value relative to `size`."""
    return np.asarray(np.linalg.svd(matrices, compute_uv=False)[..., -1] / max(size, np.finfo(float).tiny))
