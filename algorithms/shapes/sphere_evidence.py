"""A test against chance for matched models of spheres: balls are predicted by maps that were fitted without them."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from ..arguments import Reals
from ..evidence import Freedom, least_by_chance, log_choices
from ..precision import TINY
from .sphere_maps import Map, fitted_map, stretch

_FOLDS = 5
"""A limit on work: the parts of a model that are predicted by maps of the others."""
_DRAWN, _NEAREST = 20, 16
"""Limits on work: displaced copies of each ball, and the nearest of all from which smaller shares are extrapolated."""
_AWAY, _AWAY_SOLID = 2.0, 1.0
"""From a probability: unrelated balls are displaced by up to this number of spacings, so that of 64 one remains within
half of one. Balls of solid models do not leave the shape, so that the shape alone is no evidence."""
_FREEDOM = Freedom(sample_size=0, parameters=0, codimension=3, solutions=1, false_alarms=1.0)
"""Of maps that are fitted without the balls that they predict."""
_POSE = 12
"""Parameters of an affine map: its choice among all that so many numbers determine is paid for."""


def log_chance(
    kind: str, first: Reals, second: Reals, mean: Reals, weights: Reals, stiffness: float, radii: float,
    solid: bool,
) -> float:  # fmt: skip
    """Return the logarithm of the number of maps that would predict unrelated balls as well.

    Parameters
    ----------
    kind : str
        As of `fitted_map`.
    first, second : array, (n, 4), (m, 4)
    mean, weights : array, (n, 4), (n,)
        The ball that each of the first model is assigned to, and how much of it is assigned.
    stiffness : float
    radii : float
        The weight of squared differences of radii.
    solid : bool
        Whether most balls overlap: then shapes that resemble each other have balls at similar places.

    Returns
    -------
    float
        Infinite if too few balls are assigned.
    """
    predicted = _predicted(kind, first, mean, weights, stiffness)
    if predicted is None:
        return np.inf
    scale = np.array([1, 1, 1, np.sqrt(radii)])
    tree = scipy.spatial.cKDTree(second * scale)
    distances = _mutual(predicted * scale, second * scale, tree)
    spacing = float(np.median(scipy.spatial.cKDTree(second[:, :3]).query(second[:, :3], 2)[0][:, 1]))
    copies = _displaced(predicted, (_AWAY_SOLID if solid else _AWAY) * spacing)
    wrong = np.sort(np.concatenate([_mutual(copy * scale, second * scale, tree) for copy in copies]))

    def share(limits: Reals) -> Reals:
        # Few nearest ones do not give a share: below them, it falls with the volume.
        least = max(wrong[min(_NEAREST, len(wrong)) - 1], TINY)
        counted = np.searchsorted(wrong, np.maximum(limits, least), side="right") / len(wrong)
        return np.asarray(counted * np.minimum(limits / least, 1) ** _FREEDOM.codimension)

    return float(least_by_chance(distances, share, _FREEDOM)[0]) + float(log_choices(max(len(first), _POSE), _POSE))


def _displaced(balls: Reals, reach: float) -> Reals:
    """Return copies of balls that are displaced evenly within a distance."""
    rng = np.random.default_rng(0)
    away = rng.normal(size=(_DRAWN, len(balls), 3))
    away *= (reach * np.cbrt(rng.random((_DRAWN, len(balls)))) / np.linalg.norm(away, axis=-1))[..., None]
    copies = np.tile(balls, (_DRAWN, 1, 1))
    copies[..., :3] += away
    return copies


def _mutual(moved: Reals, second: Reals, tree: Any) -> Reals:
    """Return the distances of balls from the nearest of the second model, infinite if it is nearer to another one."""
    distances, near = tree.query(moved)
    back = scipy.spatial.cKDTree(moved).query(second)[1]
    return np.where(back[near] == np.arange(len(moved)), distances, np.inf)


def _predicted(kind: str, first: Reals, mean: Reals, weights: Reals, stiffness: float) -> Reals | None:
    """Return where maps that are fitted to the other parts take the balls of each part."""
    fold = np.random.default_rng(0).permutation(len(first)) % _FOLDS
    predicted = np.empty_like(first)
    for k in range(_FOLDS):
        rest, own = fold != k, fold == k
        found = fitted_map(kind, first[rest, :3], mean[rest, :3], weights[rest], stiffness)
        if found is None:
            return None
        if own.any():
            predicted[own] = moved_balls(found, first[own])
    return predicted


def moved_balls(found: Map, balls: Reals) -> Reals:
    """Return balls moved by a map."""
    return np.column_stack([found(balls[:, :3]), balls[:, 3] * stretch(found, balls)])
