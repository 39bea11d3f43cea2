"""Pairs of contacts for two soft fingers."""

from __future__ import annotations

import numpy as np

from ..arguments import Reals
from ..geometry.meshes import Integers
from .meshes import Surface
from .quality import contact_wrenches
from .triples import LEAST_QUALITY, Span

_FIRST, _SECOND = 384, 1536
"""Limit on work: so many samples, at equal distances, are compared with so many others."""
_KEPT = 240
"""Limit on work: the number of pairs whose bounds are computed."""
_EDGES = 8
_TWISTS = 64


def _twists() -> Reals:
    """Return unit twists in all directions, with those along and about the axes of a frame."""
    found = np.concatenate([np.eye(6), -np.eye(6), np.random.default_rng(21).standard_normal((_TWISTS, 6))])
    return found / np.linalg.norm(found, axis=1, keepdims=True)  # type: ignore[no-any-return]


_DIRECTIONS = _twists()


def pairs(surface: Surface, friction: float, torsion: float, span: Span) -> tuple[Integers, Reals]:
    """Return rows of two samples (t, 2) that soft fingers can hold, and bounds of their qualities (t,), best first.

    The line between the contacts of two soft fingers is inside both friction cones (Nguyen, 1988).
    """
    count = len(surface.points)
    one, other = (np.unique(np.linspace(0, count - 1, most).astype(np.intp)) for most in (_FIRST, _SECOND))
    p, n = surface.points, surface.normals
    gaps = p[other] - p[one][:, None]
    lengths = np.sqrt(np.square(gaps).sum(-1))
    with np.errstate(all="ignore"):
        left = -(gaps * n[one][:, None]).sum(-1) / lengths
        right = (gaps * n[other]).sum(-1) / lengths
    cosine = 1 / np.sqrt(1 + friction**2)
    fits = lengths + 2 * span.radius < span.most
    row, column = np.nonzero(fits & (np.minimum(left, right) > cosine))
    # Steep forces may slip, pads do not lie flat against sides that are not parallel, and weights far from the line
    # between the contacts turn the object. The parts of the largest angle and of the largest lever are added.
    cosines = np.minimum(left, right)[row, column]
    steep = np.sqrt(np.maximum(1 - cosines**2, 0)) / cosines / friction
    middle = (p[one[row]] + p[other[column]]) / 2
    along = gaps[row, column] / lengths[row, column, None]
    lever = np.sqrt(np.square(np.cross(middle, along)).sum(-1)) / surface.length
    order = np.argsort(np.round(lever + steep, 9), kind="stable")[: 2 * _KEPT]
    rows = np.sort(np.stack([one[row[order]], other[column[order]]], -1), axis=1)
    rows = rows[np.sort(np.unique(rows, axis=0, return_index=True)[1])][:_KEPT]
    if not len(rows):
        return rows, np.zeros(0)
    wrenches = contact_wrenches(p[rows].reshape(-1, 3), n[rows].reshape(-1, 3), friction, _EDGES, torsion=torsion)
    scaled = wrenches.reshape(len(rows), -1, 6) / np.array([1, 1, 1, *[surface.length] * 3])
    bounds = (scaled @ _DIRECTIONS.T).max(1).min(-1)
    order = np.argsort(-np.round(bounds, 8), kind="stable")
    order = order[bounds[order] > LEAST_QUALITY]
    return rows[order], bounds[order]
