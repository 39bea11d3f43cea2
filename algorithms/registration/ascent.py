"""Ascent from tokens to the places at which a saliency of dense votes is largest, by fits of quadratic functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, moderate, real_array
from ..precision import TINY
from .voting import VoteField, Votes

_ROUNDS = 6
"""A limit on work: the number of steps, which are at most one distance of samples long."""
_SETTLED = 0.5
"""The longest last step of a place that has been reached, in units of the distance of samples."""


@dataclass(frozen=True, eq=False)
class Summits:
    """Places at which an ascent ended.

    Attributes
    ----------
    votes : Votes
        At the places.
    reached : bool array, (m,)
        Whether the saliency is largest there, among the samples around the place.
    """

    votes: Votes
    reached: NDArray[Any]


def finite_tokens(points: ArrayLike, dimensions: tuple[int, ...]) -> Reals:
    """Return the finite points of an array (n, d) with a dimension that is allowed."""
    places = real_array(points, "points", (-1,), "points").astype(float)
    if places.ndim == 1 and places.size == 0:
        places = places.reshape(0, dimensions[-1])
    if places.ndim != 2 or places.shape[1] not in dimensions:
        expected = " or ".join(f"(n, {d})" for d in dimensions)
        raise ValueError(f"points: shape {places.shape}; expected {expected}")
    return moderate(np.ascontiguousarray(places[np.isfinite(places).all(1)]), "points")


def climb(
    field: VoteField,
    start: Reals,
    measure: Callable[[Votes], Reals],
    span: Callable[[Votes], Reals],
    distance: float,
) -> Summits:
    """Move places to where a saliency is largest, in the directions that `span` gives (m, k, d) for the votes there.

    In each round, a quadratic function is fitted to the saliency at 3**k samples around each place, which are
    `distance` apart, and the place moves to its maximum, at most `distance` far.
    """
    at = np.ascontiguousarray(start)
    votes = field.votes(at)
    reached = np.zeros(len(at), bool)
    for _ in range(_ROUNDS if len(at) else 0):
        axes = span(votes)
        offsets = _grid(axes.shape[1])
        samples = at[:, None] + distance * np.einsum("sk,mkd->msd", offsets, axes)
        values = measure(field.votes(samples.reshape(-1, at.shape[1]))).reshape(len(at), -1)
        move, reached = _steps(values, offsets)
        at = at + distance * np.einsum("mk,mkd->md", move, axes)
        votes = field.votes(at)
    return Summits(votes, reached)


def well_apart(places: Reals, size: Reals, radius: float) -> NDArray[np.int64]:
    """Return rows of places that are at least a radius apart, the largest first."""
    tree = scipy.spatial.cKDTree(places) if len(places) else None
    free = np.ones(len(places), bool)
    chosen = []
    for k in np.argsort(-size, kind="stable"):
        if free[k] and tree is not None:
            chosen.append(k)
            free[tree.query_ball_point(places[k], radius)] = False
    return np.array(chosen, np.int64)


def _grid(k: int) -> Reals:
    return np.array(list(product((-1.0, 0.0, 1.0), repeat=k)))


def _steps(values: Reals, offsets: Reals) -> tuple[Reals, NDArray[Any]]:
    """Return steps (m, k) in units of the grid, and whether there is a maximum close by."""
    k = offsets.shape[1]
    rows, columns = np.triu_indices(k)
    design = np.concatenate([np.ones((len(offsets), 1)), offsets, offsets[:, rows] * offsets[:, columns]], 1)
    fit = values @ np.linalg.pinv(design).T
    slope = fit[:, 1 : k + 1]
    bend = np.zeros((len(values), k, k))
    bend[:, rows, columns] += fit[:, k + 1 :]
    bend[:, columns, rows] += fit[:, k + 1 :]
    largest, axes = np.linalg.eigh(bend)
    # Along axes without a maximum, the step is as long as allowed.
    along = np.einsum("mik,mi->mk", axes, slope)
    size = np.abs(along) + np.maximum(-largest, 0)
    curved = largest < -1e-6 * np.maximum(size, TINY)
    step = np.where(curved, along / np.where(curved, -largest, 1), np.sign(along))
    length = np.linalg.norm(step, axis=1)
    step /= np.maximum(length, 1)[:, None]
    return np.einsum("mik,mk->mi", axes, step), curved.all(1) & (length <= _SETTLED)
