"""Whether the boundary of an object in an image is certain: changes of its level and of the scale, and its necks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from ..arguments import Reals
from ..precision import NEGLIGIBLE
from .images import Mask
from .level_lines import level_line
from .objects_of_images import Object

_SHARE = 0.2
"""Part of the contrast by which the level is changed."""
_BLUR = 1.7
"""Standard deviation in pixels of the additional smoothing."""
_NECK, _DEEP = 0.5, 0.6
"""Parts of the largest depth: of a neck, at most, and of the bodies that it joins, at least."""


class Stability(NamedTuple):
    """How much the boundary moves, and whether the object is one.

    Attributes
    ----------
    mean, largest : float
        Distances in pixels by which the boundary moves if its level changes by a fifth of the contrast, or if the image
        is smoothed; the largest of the three changes.
    bodies : int
        Parts of similar depth that are joined by a narrow neck, as two objects that touch.
    """

    mean: float
    largest: float
    bodies: int


def stability(found: Object, samples: Reals) -> Stability:
    """Return how certain the boundary of an object is.

    Where the edge is weak, or where another object or the background is joined at another level, distances are large.
    Of an image of two values, the boundary is certain.

    Parameters
    ----------
    found : Object
    samples : array, (n, 2)
        Its boundary.
    """
    field = found.smooth
    if field is None:
        return Stability(0.0, 0.0, 1)
    contrast = float(np.median(field[found.mask]) - np.median(field[field <= found.level]))
    change = _SHARE * contrast
    variants = [(field, found.level - change), (field, found.level + change),
                (scipy.ndimage.gaussian_filter(field, _BLUR), found.level)]  # fmt: skip
    mean = largest = 0.0
    for image, level in variants:
        moved = _moved_boundary(image, level, found.mask, NEGLIGIBLE * contrast)
        if moved is None:
            return Stability(np.inf, np.inf, 0)
        for one, two in ((samples, moved), (moved, samples)):
            distances = scipy.spatial.cKDTree(one).query(two)[0]
            mean, largest = max(mean, float(distances.mean())), max(largest, float(distances.max()))
    return Stability(mean, largest, _bodies(found.mask))


def _moved_boundary(field: Reals, level: float, mask: Mask, small: float) -> Reals | None:
    """Return the boundary at another level of the component with the largest part in a mask, if there is one."""
    labels, count = scipy.ndimage.label(field > level)
    sizes = np.bincount(labels[mask], minlength=count + 1)
    sizes[0] = 0
    if not sizes.any():
        return None
    object_there = scipy.ndimage.binary_fill_holes(labels == int(sizes.argmax()))
    return level_line(np.where(object_there, np.maximum(field, level + small), np.minimum(field, level - small)), level)


def _bodies(mask: Mask) -> int:
    depth = scipy.ndimage.distance_transform_edt(np.pad(mask, 1))
    labels, count = scipy.ndimage.label(depth > _NECK * depth.max())
    deepest = scipy.ndimage.maximum(depth, labels, np.arange(1, count + 1))
    return int((deepest >= _DEEP * depth.max()).sum())
