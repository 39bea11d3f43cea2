"""Points or triangles of a surface in small groups, so that most of them need no test against a capsule."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generated import collisions, grasping

from ..arguments import Reals
from ..geometry.meshes import Flags
from ..precision import TINY

_BITS = 5
"""The number of bits of each coordinate in the order of the points."""
_WIDE = np.array([sum((cell >> bit & 1) << 3 * bit for bit in range(_BITS)) for cell in range(2**_BITS)], np.uint16)
"""The bits of a coordinate, with two free bits after each."""


@dataclass(frozen=True, slots=True, eq=False)
class Clusters:
    """Groups of points, or of triangles, that are close together."""

    parts: Reals
    """(g, s, 3) or (g, s, 3, 3) Those of each group; the last group repeats some."""
    centres: Reals
    """(g, 3) Centres of spheres that contain the groups."""
    radii: Reals
    """(g,)"""

    def clear_of(self, ends: Reals, radii: Reals, least: float) -> Flags:
        """Return whether all points or triangles have more than a distance from sets of capsules.

        Parameters
        ----------
        ends : array, (n, k, 2, 3)
            The ends of the axes of n sets of capsules.
        radii : array, (k,) or (n, k)
        least : float
            A distance in metres; negative if the surface may be inside.
        """
        starts, stops = ends[..., 0, :], ends[..., 1, :]
        widths = np.broadcast_to(radii, starts.shape[:-1])
        lower = grasping.capsule_gap(
            self.centres, starts[..., None, :], stops[..., None, :], widths[..., None] + self.radii
        )
        case, capsule, group = np.nonzero(lower <= least)
        near = starts[case, capsule], stops[case, capsule], widths[case, capsule]
        if self.parts.ndim == 4:
            gaps = collisions.capsule_triangle_clearance(self.parts[group], *near)
        else:
            gaps = grasping.capsule_gap(self.parts[group], *(one[:, None] for one in near)).min(1)
        clear = np.ones(len(ends), bool)
        clear[case[gaps <= least]] = False
        return clear


def clusters_of(parts: Reals, size: int) -> Clusters:
    """Return groups of some number of points (n, 3), or triangles (n, 3, 3), with n > 0.

    They are in the order of a curve that fills space (Morton), triangles in that of their centres.
    """
    columns = np.ascontiguousarray((parts if parts.ndim == 2 else (parts[:, 0] + parts[:, 1] + parts[:, 2]) / 3).T)
    low, high = columns.min(1), columns.max(1)
    scale = (2**_BITS - 0.5) / max(float((high - low).max()), TINY)
    x, y, z = ((columns - low[:, None]) * scale).astype(np.intp)
    order = np.argsort(_WIDE[x] << 2 | _WIDE[y] << 1 | _WIDE[z], kind="stable")
    order = order[np.minimum(np.arange(-(-len(parts) // size) * size), len(parts) - 1)]
    grouped = parts[order].reshape(-1, size, *parts.shape[1:])
    corners = np.ascontiguousarray(grouped.reshape(len(grouped), -1, 3).transpose(2, 1, 0))
    centres = (corners.min(1) + corners.max(1)) / 2
    gaps = corners - centres[:, None]
    radii = np.sqrt(np.einsum("ijk,ijk->jk", gaps, gaps).max(0))
    return Clusters(grouped, np.ascontiguousarray(centres.T), radii)
