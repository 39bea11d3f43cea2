"""Statuses of traced contours."""

from __future__ import annotations

from ..evidence import Status


class ContourStatus(Status):
    """Whether a contour agrees with the boundary in the image."""

    OK = 0
    """A closed cycle without crossings, near the boundary in both directions."""
    TOUCHES_BORDER = 1
    """As OK, but the object is cut by the border of the image, which the contour follows there."""
    CROSSING = 2
    """The cycle crosses itself."""
    TOO_FAR = 3
    """The contour and the boundary differ by more than the tolerance; more nodes are needed."""
    UNCERTAIN = 4
    """As OK, but the boundary moves too much if the level or the scale changes, or two objects may touch."""
