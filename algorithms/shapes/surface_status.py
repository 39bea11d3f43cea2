"""Statuses of surfaces."""

from __future__ import annotations

from ..evidence import Status


class SurfaceStatus(Status):
    """Whether a triangulated graph is a closed surface near the samples in both directions."""

    OK = 0
    """Closed, manifold, and near the samples in both directions."""
    NOT_MANIFOLD = 1
    """Not every edge belongs to two triangles of opposite directions, or triangles meet at a corner only."""
    TOO_FAR = 2
    """Closed and manifold, but the distances exceed the limits: more nodes are needed."""
    HOLES = 3
    """Closed and manifold, but parts of the surface have no samples near them: gaps of the data that were closed."""
    UNSTABLE = 4
    """Closed and manifold, but the genus or the number of components differed with fewer nodes, or in the mask."""
    FOLDED = 5
    """Closed and manifold, but triangles of a graph that was adapted to a moved shape face inwards."""
