"""Nodes of a surface that follow a shape that has moved."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from generated import shapes

from ..arguments import Reals
from .surface_samples import Samples, unit

_RIGID, _ROUNDS = 25, 12
"""Rounds in which the graph moves as a rigid body, and in which it is deformed."""
_SMOOTHINGS = 20
"""Averages over neighbours of the displacements of the first round; they decrease to none in the last."""
_TURN = 0.1
"""Distance, in sizes of the samples, that counts as much as a difference of unit normals of length 1."""


def moved_nodes(nodes: Reals, normals: Reals, triangles: NDArray[np.intp], samples: Samples) -> Reals:
    """Return nodes on moved samples: each goes to a near place of similar normal, together with its neighbours.

    The graph first moves as a rigid body. Displacements are then averaged over neighbours, at first widely. In the last
    rounds nodes are projected onto the planes of their nearest samples.

    Parameters
    ----------
    nodes, normals : array, (n, 3)
        Of the surface before.
    triangles : array of int, (t, 3)
    samples : Samples
        Of the surface after.
    """
    size = float(np.linalg.norm(np.ptp(samples.places, 0)))
    turn = _TURN * size
    tree = scipy.spatial.cKDTree(np.hstack([samples.places, turn * samples.normals]))
    average = _averages(len(nodes), triangles)
    places = nodes + samples.places.mean(0) - nodes.mean(0)
    places, directions = _rigidly_moved(places, normals, samples, tree, turn)
    for step in range(_ROUNDS):
        _, at = tree.query(np.hstack([places, turn * directions]))
        # Along the normal of the sample only: nodes with one nearest sample remain apart.
        off = ((samples.places[at] - places) * samples.normals[at]).sum(1)
        shift = off[:, None] * samples.normals[at]
        for _ in range(round(_SMOOTHINGS * (1 - (step + 1) / _ROUNDS) ** 2)):
            shift = average @ shift
        places = places + shift
        directions = unit(np.asarray(shapes.normals_of_triangles(places, *triangles.T)))
    return np.asarray(places)


def _rigidly_moved(
    places: Reals, directions: Reals, samples: Samples, tree: scipy.spatial.cKDTree, turn: float
) -> tuple[Reals, Reals]:
    """Move nodes and normals by the rigid motion with the least squares of the distances from planes of samples."""
    for _ in range(_RIGID):
        _, at = tree.query(np.hstack([places, turn * directions]))
        middle = places.mean(0)
        away, normals = places - middle, samples.normals[at]
        off = ((samples.places[at] - places) * normals).sum(1)
        rows = np.hstack([np.cross(away, normals), normals])
        twist = np.linalg.lstsq(rows, off, rcond=1e-6)[0]
        motion = scipy.spatial.transform.Rotation.from_rotvec(twist[:3])
        places, directions = motion.apply(away) + middle + twist[3:], motion.apply(directions)
    return places, directions


def is_folded(nodes: Reals, triangles: NDArray[np.intp], samples: Samples, tree: scipy.spatial.cKDTree) -> bool:
    """Whether a triangle faces against the surface at its centre."""
    corners = nodes[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    _, at = tree.query(corners.mean(1))
    return bool(((faces * samples.normals[at]).sum(1) <= 0).any())


def _averages(count: int, triangles: NDArray[np.intp]) -> scipy.sparse.csr_array:
    """Return the matrix that takes values of nodes to their means with those of the neighbours."""
    a, b = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).T
    own = np.arange(count)
    rows, columns = np.concatenate([a, b, own]), np.concatenate([b, a, own])
    weights = scipy.sparse.csr_array(scipy.sparse.coo_array((np.ones(len(rows)), (rows, columns)), (count, count)))
    return scipy.sparse.csr_array(weights.multiply(1 / weights.sum(1)[:, None]))
