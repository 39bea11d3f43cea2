"""Normals of clouds by tensor voting, refined by local fits, and oriented along a spanning tree."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, finite_number, real_array
from ..precision import SINGLE, TINY
from .jets import jet_normals
from .vote_scale import default_sigma
from .vote_status import VoteStatus
from .voting import Votes, tensor_vote

_LINKS = 10
"""Neighbours that orient each other."""


@dataclass(frozen=True, eq=False)
class Normals:
    """Normals of a cloud.

    Attributes
    ----------
    normals : array, (n, d)
        Unit vectors, or 0 where the status is not OK. In each connected part, they point outwards at the point that is
        farthest from its centre.
    confidence : array, (n,)
        From 0 to 1: the saliency of the surface relative to the largest eigenvalue.
    status : int array, (n,)
        `VoteStatus`; UNDETERMINED also for points on a line in space, all of whose normals are equally possible.
    sigma : float
        The scale of the votes.
    """

    normals: Reals
    confidence: Reals
    status: NDArray[Any]
    sigma: float


def estimate_normals(points: ArrayLike, sigma: float | None = None, passes: int = 2) -> Normals:
    """Estimate the normals of a surface in space, or of a curve in the plane, and orient them consistently.

    Normals of the votes are refined by quadratic functions that are fitted to 64 neighbours, without those beyond edges
    and outliers. For tori, spheres and boxes with noise of 0 to 1 % of the diagonal and up to 300 % of outliers, the
    mean error was less than those by principal axes of 10, 20 and 50 neighbours, in 24 of 24 clouds.

    Parameters
    ----------
    points : array_like, (n, 3) or (n, 2)
    sigma : float, optional
        The scale of the votes. By default it is the median of the scales of the points: a third of the distance to the
        16th neighbour, times a multiple between 1.4 and 4 that grows with the cube root of the noise.
    passes : int, optional
        Number of passes of `tensor_vote`.

    Returns
    -------
    Normals
    """
    places = real_array(points, "points", (-1,), "points")
    scale = default_sigma(places) if sigma is None else finite_number(sigma, "sigma")
    votes = tensor_vote(places, sigma=scale, passes=passes)
    largest = votes.eigenvalues[:, 0]
    gap = largest - votes.eigenvalues[:, 1]
    confidence = np.where(largest > 0, gap / np.where(largest > 0, largest, 1), 0)
    status = votes.status.copy()
    status[(status == VoteStatus.OK) & (confidence <= SINGLE)] = VoteStatus.UNDETERMINED
    votes = replace(votes, status=status)
    return Normals(_oriented(votes), confidence, status, scale)


def _oriented(votes: Votes) -> Reals:
    normals = np.zeros_like(votes.points)
    rows = np.flatnonzero(votes.status == VoteStatus.OK)
    if not len(rows):
        return normals
    places = votes.points[rows]
    own = jet_normals(places, votes.normals[rows])
    n, k = len(rows), min(_LINKS, len(rows) - 1)
    if k:
        distance, near = scipy.spatial.cKDTree(places).query(places, k=k + 1)
        first, second = np.repeat(np.arange(n), k + 1), near.ravel()
        # Short links between parallel normals come first in the tree; a link must not have the weight 0.
        turned = 1 - np.abs((own[first] * own[second]).sum(1))
        cost = 1e-6 + turned + 0.01 * distance.ravel() / max(distance.max(), TINY)
        kept = first != second
        links = scipy.sparse.coo_matrix((cost[kept], (first[kept], second[kept])), shape=(n, n)).tocsr()
        links = links.maximum(links.T)
        tree = scipy.sparse.csgraph.minimum_spanning_tree(links)
        _, part = scipy.sparse.csgraph.connected_components(tree, directed=False)
        for label in range(part.max() + 1):
            _orient_part(own, places, tree, np.flatnonzero(part == label))
    normals[rows] = own
    return normals


def _orient_part(own: Reals, places: Reals, tree: Any, members: NDArray[Any]) -> None:
    """Orient the normals of a connected part in place."""
    away = places[members] - places[members].mean(0)
    start = int(np.argmax((away**2).sum(1)))
    root = members[start]
    if own[root] @ away[start] < 0:
        own[root] *= -1
    order, before = scipy.sparse.csgraph.breadth_first_order(tree, root, directed=False)
    for row in order[1:]:
        if own[row] @ own[before[row]] < 0:
            own[row] *= -1
