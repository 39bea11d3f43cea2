"""Orthogonal maps of any metric as products of reflections (Cartan-Dieudonné)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import schur

from ..arguments import real_array
from .blade import Floats
from .gram import gram_matrix

_ORTHOGONAL = 1e-8
"""How far ``M^T G M`` may be from ``G``, of the squared norm of M."""
_FIXED = 1e-12
"""A direction that a map changes by less than this, of its norm, is fixed."""
_NULL = 1e-5
"""A direction is null where its square, of that of its length and of the largest inner product, is below this."""


def reflection_matrix(vectors: Floats, gram: Floats) -> Floats:
    """The matrices of ``x - 2 (v . x) / (v . v) v``, for rows ``(..., n)`` that are not null."""
    covector = vectors @ gram
    square = (covector * vectors).sum(-1)[..., None, None]
    return np.asarray(np.eye(len(gram)) - 2.0 * vectors[..., :, None] * covector[..., None, :] / square)


def reflections_of(matrix: ArrayLike, gram: ArrayLike | None = None) -> Floats:
    """Vectors whose reflections, the last one first, make up an orthogonal map.

    In a Euclidean metric the planes of rotation give two vectors each, the directions that are turned round one each;
    so there are as many as dimensions that change. In others a direction that changes and is farthest from null is
    reflected until nothing changes: again that many, or two more where all directions that change are null (Scherk).

    Parameters
    ----------
    matrix : array_like, (n, n)
        The images of basis vectors are its columns.
    gram : array_like, (n,) or (n, n), optional
        Squares, or all inner products, of the basis vectors; Euclidean, left out. It may be degenerate.

    Returns
    -------
    array, (k, n)
        Rows of length 1 in coordinates.

    Raises
    ------
    TypeError, ValueError
        Where the map does not keep the inner products, or changes what is orthogonal to all.
    """
    array = real_array(matrix, "matrix", (-1, -1), "an orthogonal map").astype(np.float64)
    n = array.shape[-1]
    if array.shape != (n, n) or n == 0:
        raise ValueError(f"matrix: shape {array.shape}; expected (n, n)")
    metric = gram_matrix(gram, n)
    off = np.abs(array.T @ metric @ array - metric).max()
    if not off <= _ORTHOGONAL * np.abs(metric).max() * max(1.0, np.linalg.norm(array, 2) ** 2):
        raise ValueError(f"matrix: inner products change by up to {off:.2g}; expected a map that keeps them")
    definite = np.abs(metric - metric[0, 0] * np.eye(n)).max() == 0.0 and metric[0, 0] != 0.0
    return _by_planes(array) if definite else _by_steps(array, metric)


def _by_planes(matrix: Floats) -> Floats:
    triangle, basis = schur(matrix, output="real")
    n, i = len(matrix), 0
    found = []
    while i < n:
        if i + 1 < n and triangle[i + 1, i] != 0.0:
            angle = np.arctan2(triangle[i + 1, i] - triangle[i, i + 1], triangle[i, i] + triangle[i + 1, i + 1]) / 2
            if abs(angle) > _FIXED:
                found += [np.cos(angle) * basis[:, i] + np.sin(angle) * basis[:, i + 1], basis[:, i]]
            i += 2
        else:
            if triangle[i, i] < 0:
                found.append(basis[:, i])
            i += 1
    return np.array(found).reshape(-1, n)


def _by_steps(matrix: Floats, metric: Floats) -> Floats:
    n = len(matrix)
    size = float(np.abs(np.linalg.eigvalsh(metric)).max())
    threshold = _FIXED * max(1.0, float(np.linalg.norm(matrix, 2)) ** 2)
    rest = matrix
    found: list[Floats] = []
    for _ in range(2 * n + 3):
        left, lengths, right = np.linalg.svd(rest - np.eye(n))
        rank = int((lengths > threshold).sum())
        if rank == 0:
            return np.array(found).reshape(-1, n)
        vector, steepness = _steepest(left[:, :rank], metric)
        if size == 0.0 or steepness <= _NULL * size:
            helper = _helper(rest, left[:, :rank], right[:rank], metric, threshold)
            if helper is None:
                break
            vector = helper
        rest = reflection_matrix(vector, metric) @ rest
        found.append(vector)
    raise ValueError("matrix: no product of reflections; expected a map that leaves alone what is orthogonal to all")


def _steepest(basis: Floats, metric: Floats) -> tuple[Floats, float]:
    """The unit vector of a subspace (orthonormal columns) that is farthest from null, and the size of its square."""
    squares, turn = np.linalg.eigh(basis.T @ metric @ basis)
    at = int(np.argmax(np.abs(squares)))
    return basis @ turn[:, at], float(abs(squares[at]))


def _helper(rest: Floats, changed: Floats, moved: Floats, metric: Floats, threshold: float) -> Floats | None:
    """A reflection to put in where all directions that change are null: the next one finds most to do after it."""
    n = len(rest)
    candidates = [*moved, *(m + s * c for m in moved for c in changed.T for s in (1.0, -1.0))]
    best: tuple[tuple[int, float], Floats] | None = None
    for candidate in candidates:
        length = np.linalg.norm(candidate)
        if length < 0.1:
            continue
        vector = candidate / length
        if abs(vector @ metric @ vector) <= 0.1 * np.abs(metric).max():
            continue
        left, lengths, _ = np.linalg.svd(reflection_matrix(vector, metric) @ rest - np.eye(n))
        rank = int((lengths > threshold).sum())
        score = (-rank, _steepest(left[:, :rank], metric)[1] if rank else 1.0)
        if best is None or score > best[0]:
            best = score, vector
    return None if best is None else best[1]
