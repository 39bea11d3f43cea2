"""Tensor voting: which curves, surfaces and junctions the tokens near a place agree on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from generated import tensor_voting as kernels

from ..arguments import Reals, finite_number, moderate, positive_number, real_array
from ..precision import ROUNDING
from .vote_scale import default_sigma
from .vote_status import VoteStatus
from .vote_tables import CELLS, REACH, Integers, ball_cubics, plate_table

_CHUNK = 20_000
"""Receivers of dense votes that are handled at once, which bounds the memory for pairs."""


@dataclass(frozen=True, eq=False)
class Votes:
    """Tensors that tokens receive, and what they say.

    Attributes
    ----------
    points : array, (m, d)
        The places of the tensors.
    tensors : array, (m, d, d)
        Symmetric tensors.
    eigenvalues : array, (m, d)
        In descending order.
    axes : array, (m, d, d)
        Unit eigenvectors as rows, in the order of the eigenvalues.
    status : int array, (m,)
        `VoteStatus`
    """

    points: Reals
    tensors: Reals
    eigenvalues: Reals
    axes: Reals
    status: NDArray[Any]

    @property
    def normals(self) -> Reals:
        """The normals (m, d) of surfaces, in the plane of curves: the first axes."""
        return np.asarray(self.axes[:, 0])

    @property
    def tangents(self) -> Reals:
        """The tangents (m, d) of curves: the last axes."""
        return np.asarray(self.axes[:, -1])

    @property
    def surface(self) -> Reals:
        """The saliency (m,) of surfaces in space: the difference of the first two eigenvalues.

        Raises
        ------
        ValueError
            In the plane, which has no surfaces.
        """
        if self.points.shape[1] != 3:
            raise ValueError("surface: the points are in the plane; expected points in space; see curve")
        return np.asarray(self.eigenvalues[:, 0] - self.eigenvalues[:, 1])

    @property
    def curve(self) -> Reals:
        """The saliency (m,) of curves: the difference of the last two eigenvalues."""
        return np.asarray(self.eigenvalues[:, -2] - self.eigenvalues[:, -1])

    @property
    def junction(self) -> Reals:
        """The saliency (m,) of junctions and separate points: the last eigenvalue."""
        return np.asarray(self.eigenvalues[:, -1])

    def rows(self, chosen: slice | NDArray[np.bool_] | Integers) -> Votes:
        """Return the votes of some rows."""
        return Votes(
            self.points[chosen], self.tensors[chosen], self.eigenvalues[chosen], self.axes[chosen], self.status[chosen]
        )


def published_curvature(sigma: float) -> float:
    """Return the weight of squared curvatures of Medioni, Lee and Tang for a scale of sigma pixels.

    Their constant ``-16 ln(0.1) (sigma - 1) / pi**2`` is a power of the length of a pixel; the result is in units of
    sigma.
    """
    positive_number(sigma, "sigma")
    return float(16 * np.log(10) * (sigma - 1) / np.pi**2 / sigma**4)


CURVATURE = published_curvature(10.0)
"""Of first passes."""
REFINED_CURVATURE = 2.0
"""Of further passes: their normals are accurate enough for a narrow field. A circle of the radius 1.4 sigma decays by
1 / e."""


def tensor_vote(
    points: ArrayLike,
    normals: ArrayLike | None = None,
    tangents: ArrayLike | None = None,
    *,
    sigma: float | None = None,
    at: ArrayLike | None = None,
    passes: int | None = None,
    curvature: float | None = None,
) -> Votes:
    """Let tokens vote for the surfaces, curves and junctions through their neighbours.

    Without normals and tangents, each token votes as a ball in the first pass. In further passes, it votes as the stick
    and the plate of the tensor that it received, relative to its first eigenvalue: clear tokens count more than others,
    but dense ones do not. Tokens within three sigma of each other are neighbours.

    Parameters
    ----------
    points : array_like, (n, 2) or (n, 3)
        Tokens. Those with numbers that are not finite are ignored.
    normals : array_like, (n, d), optional
        Normals of sticks: of surfaces in space, of curves in the plane. Their signs and lengths do not matter; tokens
        with a normal of length 0 do not vote.
    tangents : array_like, (n, 3), optional
        Tangents of curves in space, which vote as plates, or of curves in the plane. Not together with normals.
    sigma : float, optional
        The scale, in the units of the points; by default it follows from the
        spacing and the noise of the points, see `estimate_normals`.
    at : array_like, (m, d), optional
        Places for dense votes. By default, the tokens receive the votes of the others.
    passes : int, optional
        Number of passes, including the one at `at`. By default 3 without normals and tangents, and 1 with them.
    curvature : float, optional
        Weight of squared curvatures, in units of sigma, of all passes. By default, it is that of `published_curvature`
        for 10 pixels in the first pass, and 2 in further passes.

    Returns
    -------
    Votes
    """
    places, first = _tokens(points, normals, tangents)
    scale = default_sigma(places) if sigma is None else finite_number(sigma, "sigma")
    weights = (CURVATURE, REFINED_CURVATURE) if curvature is None else (finite_number(curvature, "curvature"),) * 2
    if scale <= 0 or weights[0] <= 0:
        raise ValueError(f"sigma, curvature: {scale}, {weights[0]}; expected positive numbers")
    count = (3 if first is None else 1) if passes is None else passes
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1:
        raise ValueError(f"passes: {count!r}; expected a positive integer")
    usable = np.isfinite(places).all(1) & (True if first is None else np.isfinite(first.weights).all(0))
    own = np.flatnonzero(usable)
    tokens = _Tokens(places[own], scale)
    sources = _balls(len(own), places.shape[1]) if first is None else first.rows(own)
    if at is None:
        found, _ = _passes(tokens, sources, weights, int(count))
        return _spread(found, places, own)
    _, sources = _passes(tokens, sources, weights, int(count) - 1)
    return _dense(tokens, sources, weights[count > 1], _rows(at, "at", places.shape[1], "points"))


class VoteField:
    """Dense votes at many places, one call after the other, by tokens that have voted as balls and then again.

    Parameters
    ----------
    points : array, (n, 2) or (n, 3)
        Finite tokens.
    sigma, curvature : float
        The scale, and the weight of squared curvatures in units of it.
    passes : int
        Passes among the tokens, at least 1.

    Attributes
    ----------
    tokens : Votes
        What the tokens received in the last pass.
    """

    def __init__(self, points: Reals, sigma: float, curvature: float, passes: int = 2) -> None:
        self._tokens, self._curvature = _Tokens(points, sigma), curvature
        first = _balls(*points.shape)
        self.tokens, self._sources = _passes(self._tokens, first, (curvature, curvature), passes)

    def votes(self, at: Reals) -> Votes:
        """Return the votes at places (m, d)."""
        return _dense(self._tokens, self._sources, self._curvature, at)


def _passes(tokens: _Tokens, sources: _Sources, curvatures: tuple[float, float], count: int) -> tuple[Votes, _Sources]:
    """Let tokens vote for each other, and return what they received, and what they vote as in the next pass."""
    d = tokens.points.shape[1]
    found = _voted(tokens.points, np.zeros((len(tokens.points), d * (d + 1) // 2)))
    pairs = tokens.pairs() if count else _no_pairs()
    for k in range(count):
        # Tokens without directions are balls of the weight 1, and all others are none.
        if d == 3 and sources.weights[2].any():
            sums = tokens.mutual_balls(curvatures[0], *pairs)
        else:
            sums = tokens.sums(sources, curvatures[k > 0], tokens.points, *pairs)
        found = _voted(tokens.points, sums)
        sources = _refined(found)
    return found, sources


def _rows(value: ArrayLike, name: str, dimension: int, meaning: str) -> Reals:
    array = real_array(value, name, (dimension,), meaning).astype(float)
    if array.ndim != 2:
        raise ValueError(f"{name}: shape {array.shape}; expected (n, {dimension})")
    return array


@dataclass(frozen=True, eq=False)
class _Sources:
    """What tokens vote as: weights (3, n) of sticks, plates and balls, normals and tangents."""

    weights: Reals
    normals: Reals
    tangents: Reals

    def rows(self, chosen: Integers) -> _Sources:
        return replace(
            self, weights=self.weights[:, chosen], normals=self.normals[chosen], tangents=self.tangents[chosen]
        )


def _tokens(points: ArrayLike, normals: ArrayLike | None, tangents: ArrayLike | None) -> tuple[Reals, _Sources | None]:
    places = real_array(points, "points", (-1,), "points").astype(float)
    if places.ndim == 1 and places.size == 0:
        places = places.reshape(0, 3)
    if places.ndim != 2 or places.shape[1] not in (2, 3):
        raise ValueError(f"points: shape {places.shape}; expected (n, 2) or (n, 3)")
    moderate(places[np.isfinite(places).all(1)], "points")
    n, d = places.shape
    if normals is not None and tangents is not None:
        raise ValueError("normals, tangents: both are given; expected one of them")
    if normals is None and tangents is None:
        return places, None
    name = "tangents" if normals is None else "normals"
    given = _rows(tangents if normals is None else normals, name, d, "directions")  # type: ignore[arg-type]
    if len(given) != n:
        raise ValueError(f"{name}: {len(given)} rows; expected {n}, one for each point")
    length = np.linalg.norm(given, axis=1)
    exists = np.where(np.isfinite(length), length > 0, np.nan)
    unit = given / np.where(length > 0, length, 1)[:, None]
    none, weights = np.zeros_like(unit), np.zeros((3, n))
    if name == "tangents" and d == 3:
        weights[1] = exists
        return places, _Sources(weights, none, unit)
    weights[0] = exists
    turned = np.column_stack([-unit[:, 1], unit[:, 0]]) if name == "tangents" else unit
    return places, _Sources(weights, turned, none)


def _balls(n: int, d: int) -> _Sources:
    weights = np.zeros((3, n))
    weights[2] = 1
    return _Sources(weights, np.zeros((n, d)), np.zeros((n, d)))


def _refined(found: Votes) -> _Sources:
    """Return the sticks and, in space, the plates of received tensors, relative to their first eigenvalues."""
    weights = np.zeros((3, len(found.points)))
    values = found.eigenvalues / np.where(found.eigenvalues[:, :1] > 0, found.eigenvalues[:, :1], 1)
    weights[0] = values[:, 0] - values[:, 1]
    if found.points.shape[1] == 3:
        weights[1] = values[:, 1] - values[:, 2]
    return _Sources(weights, found.normals, found.tangents)


class _Tokens:
    """Tokens in a tree, with the scale of their votes."""

    def __init__(self, points: Reals, sigma: float) -> None:
        self.points = np.ascontiguousarray(points)
        self._sigma = sigma
        self._reach = REACH * sigma
        self._tree = scipy.spatial.cKDTree(self.points) if len(points) else None

    def pairs(self) -> tuple[Integers, Integers, Reals]:
        """Return voters, receivers and distances of all pairs of tokens, in both directions."""
        if self._tree is None:
            return _no_pairs()
        half = self._tree.query_pairs(self._reach, output_type="ndarray").astype(np.int64, copy=False)
        voter, receiver = half.ravel("F"), half[:, ::-1].ravel("F")
        n = len(half)
        if self.points.shape[1] == 2:
            distance = np.linalg.norm(self.points[voter[:n]] - self.points[receiver[:n]], axis=1)
        else:
            distance = kernels.pair_distances(self.points, self.points, voter[:n], receiver[:n], 1.0)
        return voter, receiver, np.concatenate([distance, distance])

    def pairs_at(self, at: Reals) -> tuple[Integers, Integers, Reals]:
        """Return voters, receivers and distances of all pairs of a token and a place."""
        if self._tree is None or not len(at):
            return _no_pairs()
        found = scipy.spatial.cKDTree(at).sparse_distance_matrix(self._tree, self._reach, output_type="ndarray")
        return found["j"].astype(np.int64), found["i"].astype(np.int64), np.ascontiguousarray(found["v"])

    def sums(
        self, sources: _Sources, curvature: float, at: Reals, voter: Integers, receiver: Integers, distance: Reals
    ) -> Reals:
        """Sum votes, as upper triangles (m, 3) or (m, 6)."""
        in_space = self.points.shape[1] == 3
        zero = np.zeros(len(at))
        total = np.zeros((len(at), 6 if in_space else 3))
        if not len(voter):
            return total
        sticks, plates, balls = sources.weights
        if plates.any():
            total += self._sticks_and_plates(sources, curvature, at, voter, receiver)
        elif sticks.any():
            votes = kernels.stick_votes if in_space else kernels.stick_votes_in_plane
            total += votes(self.points, sources.normals, sticks, at, voter, receiver, self._sigma, curvature, zero)
        if balls.any():
            cell, place = self._cells(distance)
            cubics = ball_cubics(curvature, self.points.shape[1])
            of_balls = kernels.ball_votes if in_space else kernels.ball_votes_in_plane
            total += of_balls(self.points, balls, at, voter, receiver, self._sigma, place, cell, cubics, zero)
        return total

    def mutual_balls(self, curvature: float, voter: Integers, receiver: Integers, distance: Reals) -> Reals:
        """Sum the votes in space of balls of the weight 1 for each other, over all pairs in both directions."""
        half = len(voter) // 2
        cell, place = self._cells(distance[:half])
        pairs, zero = (voter[:half], receiver[:half]), np.zeros(len(self.points))
        first, second = kernels.mutual_ball_votes(
            self.points, *pairs, self._sigma, place, cell, ball_cubics(curvature, 3), zero
        )
        return np.asarray(first + second)

    def _cells(self, distance: Reals) -> tuple[Integers, Reals]:
        """Return the cells of distances in the table of balls, and the places in them from 0 to 1."""
        place = distance * (CELLS / self._reach)
        cell = np.minimum(place.astype(np.int64), CELLS - 1)
        return cell, place - cell

    def _sticks_and_plates(
        self, sources: _Sources, curvature: float, at: Reals, voter: Integers, receiver: Integers
    ) -> Reals:
        sticks, plates, _ = sources.weights
        table = plate_table(curvature)
        axes = sources.normals, sources.tangents
        invariants = kernels.pair_invariants(self.points, at, *axes, voter, receiver, self._sigma)
        decay, root, column = kernels.vote_places(*invariants, curvature, table.spread)  # type: ignore[call-overload]
        cell, x, y = table.cells(root, column)
        return np.asarray(
            kernels.stick_and_plate_votes(
                self.points, *axes, sticks, plates, at, voter, receiver, self._sigma, decay, x, y, cell, table.cubics,
                np.zeros(len(at)),
            )
        )  # fmt: skip


def _no_pairs() -> tuple[Integers, Integers, Reals]:
    return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)


def _dense(tokens: _Tokens, sources: _Sources, curvature: float, at: Reals) -> Votes:
    usable = np.flatnonzero(np.isfinite(at).all(1))
    rows = [np.zeros((0, 6 if at.shape[1] == 3 else 3))]
    for start in range(0, len(usable), _CHUNK):
        part = np.ascontiguousarray(at[usable[start : start + _CHUNK]])
        rows.append(tokens.sums(sources, curvature, part, *tokens.pairs_at(part)))
    return _spread(_voted(at[usable], np.concatenate(rows)), at, usable)


def _voted(points: Reals, sums: Reals) -> Votes:
    d = points.shape[1]
    values, axes = kernels.spectrum(sums) if d == 3 else kernels.spectrum_in_plane(sums)
    values = np.maximum(values, 0)
    order = np.zeros((d, d), int)
    order[np.triu_indices(d)] = np.arange(sums.shape[1])
    tensors = sums[:, np.maximum(order, order.T)]
    status = np.zeros(len(points), int)
    status[values[:, 0] - values[:, -1] <= ROUNDING * values[:, 0]] = VoteStatus.UNDETERMINED
    status[values[:, 0] == 0] = VoteStatus.ISOLATED
    return Votes(points, tensors, values, axes, status)


def _spread(found: Votes, points: Reals, own: Integers) -> Votes:
    """Return votes at all points, of which `own` are finite."""
    n, d = points.shape
    if len(own) == n:
        return found
    tensors, values = np.zeros((n, d, d)), np.zeros((n, d))
    axes, status = np.tile(np.eye(d), (n, 1, 1)), np.full(n, int(VoteStatus.NOT_FINITE))
    tensors[own], values[own], axes[own], status[own] = found.tensors, found.eigenvalues, found.axes, found.status
    return Votes(points, tensors, values, axes, status)
