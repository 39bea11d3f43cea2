"""Points of a surface in small groups, so that most of them need no test against a capsule."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generated import grasping

from ..arguments import Reals
from ..geometry.meshes import Flags
from ..precision import TINY

_BITS = 5
"""The number of bits of each coordinate in the order of the points."""
_WIDE = np.array([sum((cell >> bit & 1) << 3 * bit for bit in range(_BITS)) for cell in range(2**_BITS)], np.uint16)
"""The bits of a coordinate, with two free bits after each."""


@dataclass(frozen=True, slots=True, eq=False)
class Clusters:
    """Groups of points that are close together."""

    points: Reals
    """(g, s, 3) The points of each group; the last group repeats some."""
    centres: Reals
    """(g, 3) Centres of spheres that contain the groups."""
    radii: Reals
    """(g,)"""

    def clear_of(self, ends: Reals, radii: Reals, least: float) -> Flags:
        """Return whether all points have more than a distance from sets of capsules.

        Parameters
        ----------
        ends : array, (n, k, 2, 3)
            The ends of the axes of n sets of capsules.
        radii : array, (k,)
        least : float
            A distance in metres; negative if points may be inside.
        """
        starts, stops = ends[..., 0, :], ends[..., 1, :]
        lower = grasping.capsule_gap(
            self.centres, starts[..., None, :], stops[..., None, :], radii[:, None] + self.radii
        )
        case, capsule, group = np.nonzero(lower <= least)
        near = starts[case, capsule, None], stops[case, capsule, None], radii[capsule, None]
        gaps = grasping.capsule_gap(self.points[group], *near)
        clear = np.ones(len(ends), bool)
        clear[case[np.flatnonzero(gaps.ravel() <= least) // self.points.shape[1]]] = False
        return clear


def clusters_of(points: Reals, size: int) -> Clusters:
    """Return groups of some number of points, (n, 3) with n > 0, along a curve that fills space in Morton's order."""
    columns = np.ascontiguousarray(points.T)
    low, high = columns.min(1), columns.max(1)
    scale = (2**_BITS - 0.5) / max(float((high - low).max()), TINY)
    x, y, z = ((columns - low[:, None]) * scale).astype(np.intp)
    order = np.argsort(_WIDE[x] << 2 | _WIDE[y] << 1 | _WIDE[z], kind="stable")
    order = order[np.minimum(np.arange(-(-len(points) // size) * size), len(points) - 1)]
    grouped = columns[:, order].reshape(3, -1, size)
    centres = (grouped.min(-1) + grouped.max(-1)) / 2
    gaps = grouped - centres[:, :, None]
    radii = np.sqrt(np.einsum("ijk,ijk->jk", gaps, gaps).max(-1))
    return Clusters(points[order].reshape(-1, size, 3), np.ascontiguousarray(centres.T), radii)
