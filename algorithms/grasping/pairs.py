"""Pairs of contacts for two soft fingers."""

from __future__ import annotations

import numpy as np

from generated import grasping

from ..arguments import Reals
from ..geometry.meshes import Integers
from .meshes import Surface
from .quality import contact_wrenches
from .triples import LEAST_QUALITY, Span

_FIRST, _SECOND = 384, 1024
"""Limit on work: for so many samples, at equal distances, a partner is found among so many others."""
_KEPT = 120
"""Limit on work: the number of pairs whose bounds are computed."""
_NONE = 1e30
"""The cost of samples without a partner."""
_TWISTS = 64
"""Limit on work: the number of random twists by which the quality of pairs is bounded."""


def _twists() -> Reals:
    """Return unit twists in all directions, with those along and about the axes of a frame."""
    found = np.concatenate([np.eye(6), -np.eye(6), np.random.default_rng(21).standard_normal((_TWISTS, 6))])
    return found / np.linalg.norm(found, axis=1, keepdims=True)  # type: ignore[no-any-return]


_DIRECTIONS = _twists()


def pairs(surface: Surface, friction: float, torsion: float, span: Span) -> tuple[Integers, Reals]:
    """Return rows of two samples (t, 2) that soft fingers can hold, and bounds of their qualities (t,), best first."""
    one, other = (np.arange(most) * len(surface.points) // most for most in (_FIRST, _SECOND))
    p, n = surface.points, surface.normals
    within = max(span.most - 2 * span.radius, 0.0)
    cost, number = grasping.partner(p[one], n[one], p[other], n[other], friction, surface.length, min(within, _NONE))
    order = np.argsort(np.round(cost, 9), kind="stable")
    order = order[cost[order] < _NONE]
    rows = np.sort(np.stack([one[order], other[number[order].astype(np.intp)]], -1), axis=1)
    rows = rows[np.sort(np.unique(rows, axis=0, return_index=True)[1])][:_KEPT]
    if not len(rows):
        return rows, np.zeros(0)
    wrenches = contact_wrenches(p[rows].reshape(-1, 3), n[rows].reshape(-1, 3), friction, torsion=torsion)
    scaled = wrenches.reshape(len(rows), -1, 6) / np.array([1, 1, 1, *[surface.length] * 3])
    bounds = (scaled @ _DIRECTIONS.T).max(1).min(-1)
    order = np.argsort(-np.round(bounds, 8), kind="stable")
    order = order[bounds[order] > LEAST_QUALITY]
    return rows[order], bounds[order]
