"""Orthogonal maps of any metric as products of reflections (Cartan-Dieudonné theorem)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import finite, real_array
from ..precision import ROUNDING
from .blade import Floats
from .gram import gram_matrix

_ORTHOGONAL = 1e-8
"""Tolerated difference of ``M^T G M`` and ``G``, relative to the squared norm of M."""
_NULL = 1e-4
"""A direction is null if its square, relative to its squared length and the largest inner product, is below this."""
_STEEP = 1e-2
"""After an auxiliary reflection, the remaining directions must be farther from null than this."""
_TRIED = 6
"""Number of directions that are combined with each other if no single direction is suitable."""


def reflection_matrix(vectors: Floats, gram: Floats) -> Floats:
    """Return the matrices of ``x - 2 (v . x) / (v . v) v``, for rows ``(..., n)`` that are not null."""
    covector = vectors @ gram
    square = (covector * vectors).sum(-1)[..., None, None]
    return np.asarray(np.eye(len(gram)) - 2.0 * vectors[..., :, None] * covector[..., None, :] / square)


def reflections_of(matrix: ArrayLike, gram: ArrayLike | None = None) -> Floats:
    """Return vectors whose reflections, the last one applied first, compose to an orthogonal map.

    In a Euclidean metric each plane of rotation contributes two vectors and each reversed direction one. The number of
    vectors is the rank of the map minus the identity. In other metrics, reflections in the changed direction farthest
    from null are applied until the identity remains. This gives the same number of vectors, or two more if all changed
    directions are null (Scherk). Rounding errors grow with the square of the norm of the map, so that strong boosts
    have no accurate reflections.

    Parameters
    ----------
    matrix : array_like, (n, n)
        The columns are the images of the basis vectors.
    gram : array_like, (n,) or (n, n), optional
        Squares, or all inner products, of the basis vectors. Euclidean by default. May be degenerate.

    Returns
    -------
    array, (k, n)
        Rows of length 1 in coordinates.

    Raises
    ------
    TypeError, ValueError
        If the map does not preserve the inner products, or changes vectors that are orthogonal to all.
    """
    given = real_array(matrix, "matrix", (-1, -1), "an orthogonal map")
    array = given.astype(np.float64)
    n = array.shape[-1]
    if array.shape != (n, n) or n == 0:
        raise ValueError(f"matrix: shape {array.shape}; expected (n, n)")
    finite(array, "matrix")
    metric = gram_matrix(gram, n)
    off = np.abs(array.T @ metric @ array - metric).max()
    rounding = max(_ORTHOGONAL, 8 * n * float(np.finfo(given.dtype).eps))
    if not off <= rounding * np.abs(metric).max() * max(1.0, np.linalg.norm(array, 2) ** 2):
        raise ValueError(f"matrix: inner products change by up to {off:.2g}; expected a map that preserves them")
    definite = np.abs(metric - metric[0, 0] * np.eye(n)).max() == 0.0 and metric[0, 0] != 0.0
    if definite:
        return _by_planes(array)
    squares, turn = np.linalg.eigh(metric)
    null = np.abs(squares) <= ROUNDING * np.abs(squares).max()
    if not null.any():
        return _by_steps(array, metric)
    # the unit of directions that are orthogonal to all is arbitrary; it is chosen so that translations have size 1
    shift = float(np.linalg.norm(turn[:, null].T @ array @ turn[:, ~null]))
    units = np.where(null, shift if shift > 0.0 else 1.0, 1.0)
    there, back = turn * units, (turn / units).T
    found = _by_steps(back @ array @ there, np.diag(np.where(null, 0.0, squares))) @ there.T
    return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True))


def _by_planes(matrix: Floats) -> Floats:
    triangle, basis = scipy.linalg.schur(matrix, output="real")
    n, i = len(matrix), 0
    found = []
    while i < n:
        if i + 1 < n and triangle[i + 1, i] != 0.0:
            angle = np.arctan2(triangle[i + 1, i] - triangle[i, i + 1], triangle[i, i] + triangle[i + 1, i + 1]) / 2
            if abs(angle) > ROUNDING:
                found += [np.cos(angle) * basis[:, i] + np.sin(angle) * basis[:, i + 1], basis[:, i]]
            i += 2
        else:
            if triangle[i, i] < 0:
                found.append(basis[:, i])
            i += 1
    return np.array(found).reshape(-1, n)


@dataclass(frozen=True, slots=True, eq=False)
class _Rest:
    """The remaining map, which further reflections have to reduce to the identity.

    Attributes
    ----------
    changed : array, (n, rank)
        An orthonormal basis of the range of the map minus the identity, as columns.
    moved : array, (rank, n)
        Rows orthogonal to all fixed vectors, in descending order of the change.
    steepness : float
        The largest absolute square of unit vectors of that range.
    """

    matrix: Floats
    changed: Floats
    moved: Floats
    squares: Floats
    turn: Floats

    @property
    def rank(self) -> int:
        return len(self.moved)

    @property
    def steepness(self) -> float:
        return float(np.abs(self.squares).max(initial=0.0))

    @classmethod
    def of(cls, matrix: Floats, metric: Floats, threshold: float) -> _Rest:
        left, lengths, right = np.linalg.svd(matrix - np.eye(len(matrix)))
        rank = int((lengths > threshold).sum())
        changed = left[:, :rank]
        squares, turn = np.linalg.eigh(changed.T @ metric @ changed)
        order = np.argsort(-np.abs(squares))
        return cls(matrix, changed, right[:rank], squares[order], turn[:, order])

    def directions(self) -> Iterator[Floats]:
        """Yield unit vectors of the range, those farthest from null first, then their sums and differences."""
        vectors = (self.changed @ self.turn).T
        yield from vectors
        for a, b in combinations(vectors[:_TRIED], 2):
            yield (a + b) / np.sqrt(2.0)
            yield (a - b) / np.sqrt(2.0)


def _by_steps(matrix: Floats, metric: Floats) -> Floats:
    n = len(matrix)
    size = float(np.abs(np.linalg.eigvalsh(metric)).max())
    threshold = ROUNDING * max(1.0, float(np.linalg.norm(matrix, 2)) ** 2)
    null = _NULL * size

    def after(rest: _Rest, vector: Floats) -> _Rest | None:
        if abs(vector @ metric @ vector) <= null:
            return None
        return _Rest.of(reflection_matrix(vector, metric) @ rest.matrix, metric, threshold)

    def one(rest: _Rest) -> tuple[tuple[Floats, ...], _Rest] | None:
        """Return one reflection after which some changed direction is not null, and the remaining map."""
        for vector in rest.directions():
            new = after(rest, vector)
            if new is None or new.rank >= rest.rank:
                continue
            # vectors orthogonal to all can only be changed by the exceptional case
            if new.steepness > null or np.abs(metric @ new.changed).max(initial=0.0) <= null:
                return (vector,), new
        return None

    def two(rest: _Rest) -> tuple[tuple[Floats, ...], _Rest] | None:
        """Return an auxiliary reflection and a second one that reduces the map (exceptional case)."""
        for helper in _helpers(rest, metric):
            middle = after(rest, helper)
            if middle is None:
                continue
            for vector in middle.directions():
                new = after(middle, vector)
                if new is not None and new.rank <= rest.rank and (new.rank == 0 or new.steepness > _STEEP * size):
                    return (helper, vector), new
        return None

    rest = _Rest.of(matrix, metric, threshold)
    found: list[Floats] = []
    for _ in range(2 * n + 3):
        if rest.rank == 0:
            return np.array(found).reshape(len(found), n)
        step = one(rest) or two(rest)
        if step is None:
            break
        vectors, rest = step
        found += vectors
    raise ValueError(
        "matrix: reflections do not reduce it to the identity; expected a map that fixes the vectors orthogonal to "
        "all, with entries up to some thousands"
    )


def _helpers(rest: _Rest, metric: Floats) -> Iterator[Floats]:
    """Yield unit vectors for auxiliary reflections if all changed directions are null."""
    moved = rest.moved[:_TRIED]
    partners = moved @ np.linalg.pinv(metric, rcond=1e-10)
    for vector in (*moved, *partners):
        for more in (0.0 * vector, *rest.changed.T[:_TRIED]):
            for total in (vector + more, vector - more):
                length = np.linalg.norm(total)
                if length > 1e-3:
                    yield total / length
