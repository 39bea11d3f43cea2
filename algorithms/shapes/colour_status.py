"""Statuses of segmentation by colour."""

from __future__ import annotations

from ..evidence import Status


class ColourStatus(Status):
    """Whether one object of a colour was found in an image."""

    OK = 0
    TOUCHES_BORDER = 1
    """As OK, but the object is cut by the border of the image, which its contour follows there."""
    SEVERAL = 2
    """As OK, but there are other objects of the colour, of a comparable size. The largest was chosen."""
    TOO_SMALL = 3
    """The largest object of the colour has fewer pixels than required."""
    NOT_FOUND = 4
    """No pixel has the colour."""
    NOT_FINITE = 5
    """A value of the image is infinite or NaN."""
