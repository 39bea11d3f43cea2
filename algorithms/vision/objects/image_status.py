"""Statuses of measurements in raster images."""

from __future__ import annotations

from ...evidence import Status


class ImageStatus(Status):
    """Whether an object was measured in an image, or why not."""

    OK = 0
    TOUCHES_BORDER = 1
    """The border of the image cuts the object; pixels on the border are left out."""
    SEVERAL = 2
    """There are other objects of the colour, of a comparable size; the largest was traced."""
    NOT_FOUND = 3
    """Nothing in the image has the colour, or nothing where the object is expected has an edge."""
    TOO_SMALL = 4
    """The object has too few pixels."""
    OUTSIDE_IMAGE = 5
    """At the expected pose, the object is outside the image."""
    BEHIND_CAMERA = 6
    """At the expected pose, the object is not in front of the camera."""
    OCCLUDED = 7
    """Less of the outline than required is seen."""
    INCONSISTENT = 8
    """What is seen is not the outline of the model at any pose that was found."""
    NOT_FINITE = 9
    """A value of the image is infinite or NaN."""
