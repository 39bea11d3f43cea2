"""Which pixels of an image are the object: polarity, level by gradients, and choice of a component."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ..arguments import Reals
from ..precision import NEGLIGIBLE, TINY
from .images import Mask

_BINS = 128
"""A limit on work: the number of levels of brightness that are compared."""
_LEAST = 2
"""Pixels of the smallest object."""


class Object(NamedTuple):
    """A component, and the field and level of its boundary."""

    mask: Mask
    field: Reals
    level: float
    components: int
    is_cut: bool
    smooth: Reals | None
    """All of the smoothed image, with the object above the level; None for an image of two values."""


def object_of(image: NDArray[Any], near: tuple[int, int] | None) -> Object:
    """Choose the object of an image: large and central, or the one at a pixel.

    Raises
    ------
    ValueError
        If there is no object.
    """
    field = image.astype(float)
    if field.min() == field.max():
        raise ValueError("image: all pixels are equal; expected an object and a background")
    is_binary = len(np.unique(field)) == 2
    if is_binary:
        field = (field > field.min()).astype(float)
        level = 0.5
    else:
        field = scipy.ndimage.gaussian_filter(field, 1.0)
        level = _steepest_level(field)
    inside = field > level
    border = np.concatenate([inside[0], inside[-1], inside[:, 0], inside[:, -1]])
    if (near is not None and not inside[near]) or (near is None and border.mean() > 0.5):
        inside, field, level = ~inside, -field, -level
    labels, count = scipy.ndimage.label(inside)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    if not count or sizes.max() < _LEAST:
        raise ValueError(
            f"image: {count} objects, the largest of {sizes.max(initial=0)} pixels; expected at least {_LEAST}"
        )
    chosen = int(labels[near]) if near is not None else _central(labels, sizes)
    mask = scipy.ndimage.binary_fill_holes(labels == chosen)
    edge = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])
    small = NEGLIGIBLE * float(np.ptp(field))
    low = min(float(field.min()), 2 * level - float(field.max()))
    return Object(mask, np.where(mask | ~inside, np.where(mask, np.maximum(field, level + small), field), low), level,
                  int((sizes >= _LEAST).sum()), bool(edge.any()),
                  None if is_binary else field)  # fmt: skip


def _central(labels: NDArray[Any], sizes: NDArray[Any]) -> int:
    """Return the component with the largest size, reduced by the distance of its centre from that of the image."""
    centres = np.array(scipy.ndimage.center_of_mass(labels > 0, labels, np.arange(1, len(sizes) + 1)))
    middle = (np.array(labels.shape) - 1) / 2
    far = np.linalg.norm((centres - middle) / (middle + 1), axis=1)
    return 1 + int(np.argmax(sizes * np.exp(-far)))


def _steepest_level(field: Reals) -> float:
    """Return the level whose lines have the largest mean gradient, of those that enclose some part of the image."""
    size = np.hypot(*np.gradient(field)).ravel()
    edges = np.linspace(field.min(), field.max(), _BINS + 1)
    at = np.clip(np.digitize(field.ravel(), edges) - 1, 0, _BINS - 1)
    length = scipy.ndimage.gaussian_filter1d(np.bincount(at, size, _BINS), 2.0)
    squares = scipy.ndimage.gaussian_filter1d(np.bincount(at, size**2, _BINS), 2.0)
    below = np.cumsum(np.bincount(at, minlength=_BINS)) / field.size
    usable = (below > 0.01) & (below < 0.99) & (length > 0.02 * length.max())
    # The mean of the gradient along a line is the sum of squares over the sum, as the width of a bin on the image is
    # inverse to the gradient.
    score = np.where(usable, squares / np.maximum(length, TINY), 0)
    best = int(score.argmax())
    return float((edges[best] + edges[best + 1]) / 2)
