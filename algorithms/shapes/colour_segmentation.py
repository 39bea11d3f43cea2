"""Segmentation of images by colour, and contours between pixels from the part of each pixel that an object covers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import Reals, as_given, finite, finite_number, real_array
from ..evidence.noise import NORMAL
from ..precision import TINY
from ..scaling import in_range
from .colour_status import ColourStatus
from .images import Mask
from .level_lines import level_line

_SPREAD = 0.06
"""The standard deviation of the chromaticity about a single given colour, as a tangent."""
_LEAST_SPREAD, _FEWEST_SAMPLES = 0.012, 8
"""The least standard deviation of chromaticities, and the number of colours from which on it is computed."""
_LIMIT = 13.8
"""The square of the distance in standard deviations that one pixel in a thousand of the object exceeds."""
_DARK, _BRIGHT = 0.12, 2.5
"""Least and largest brightness of the object, as multiples of that of the given colour."""
_INSIDE, _OUTSIDE = 3, 4
"""Distances in pixels from the boundary of the classified pixels at which colours are not mixed."""
_SHADING = 0.15
"""The standard deviation of the brightness at the boundary relative to that of pixels inside."""
_SMOOTH = 0.7
"""The standard deviation in pixels with which the covered part is smoothed."""
_AVERAGE = 1.5
"""The standard deviation in pixels with which colours are averaged."""
_COMPARABLE = 0.25
"""Other objects of at least this part of the size of the largest are counted."""
_BORDER = 2.5
"""An object is cut by the border if its contour is nearer to it than this, in pixels."""


@dataclass(frozen=True, eq=False)
class ColourSegment:
    """Result of `segment_colour`."""

    status: ColourStatus
    mask: Mask
    """(h, w) The pixels of the object, with its holes filled."""
    coverage: Reals
    """(h, w) The part of each pixel that the object covers, from 0 to 1, smoothed; 0 away from the object."""
    contours: tuple[Reals, ...]
    """For each chosen component its outer contour (n, 2) as x and y, closed, with a step of about 0.7 pixels."""
    sizes: NDArray[np.intp]
    """Pixels of all components of the colour, largest first."""
    colour: Reals
    """(3,) The median colour of the object; NaN if there is none."""
    noise: float
    """The standard deviation of the noise of the image, in its unit."""


class _Model(NamedTuple):
    """A colour by its direction, with its distribution across it."""

    axes: Reals
    """(3, 3) The direction of the colour, and two orthogonal ones, as rows."""
    middle: Reals
    covariance: Reals
    """(2, 2) Without the noise of the sensor."""
    brightness: tuple[float, float]


def segment_colour(
    image: ArrayLike, colour: ArrayLike, *, region: ArrayLike | None = None, least: float = 80.0,
) -> ColourSegment:  # fmt: skip
    """Find the object of a colour in an image, and trace its contour between pixels.

    Pixels are classified by the direction of their colour, which shading does not change, with a normal distribution
    that is adapted robustly to the object. Near the boundary, a pixel is a mixture of the colours on both sides; the
    covered part is their weight by least squares, in which the brightness of the object may vary. The contour is the
    level line of one half of the covered part.

    Parameters
    ----------
    image : array_like, (h, w, 3)
        Red, green and blue of any real type.
    colour : array_like, (3,) or (n, 3)
        The colour of the object, or colours of some of its pixels, in the unit of the image. For an image of integers,
        numbers of at most 1 are multiples of the largest value of its type.
    region : array_like of bool, (h, w), optional
        Where the object is expected. All components that are mostly in it are chosen, as an object may be divided by
        another one that hides it; those outside are ignored. By default the largest component is chosen.
    least : float
        The least number of pixels of an object.

    Returns
    -------
    ColourSegment
        The status is the first that applies of NOT_FINITE, NOT_FOUND, TOO_SMALL, SEVERAL and TOUCHES_BORDER.

    Raises
    ------
    TypeError, ValueError
        If the image or the colour has a wrong shape or type, or the colour is black or negative.

    Notes
    -----
    Contours of rendered spheres differ from the exact conic by 0.03 pixels (root mean square) without noise, and by
    0.05 pixels for noise of 2 % of the largest value, if the colours on both sides differ by half of it.
    """
    array, given, exponent = _arguments(image, colour)
    expected = None if region is None else as_given(region, "region")
    if expected is not None and (expected.dtype != bool or expected.shape != array.shape[:2]):
        raise ValueError(f"region: shape {expected.shape} of {expected.dtype}; expected {array.shape[:2]} of bool")
    if finite_number(least, "least") < 1:
        raise ValueError(f"least: {least}; expected at least 1 pixel")
    blank = ColourSegment(
        ColourStatus.NOT_FOUND, np.zeros(array.shape[:2], bool), np.zeros(array.shape[:2]), (), np.zeros(0, np.intp),
        np.full(3, np.nan), np.nan,
    )  # fmt: skip
    if not np.isfinite(array).all():
        return replace(blank, status=ColourStatus.NOT_FINITE)
    noise = noise_of_image(array)
    model = _given_model(given)
    classified = _classified(array, model, noise)
    labels, count = scipy.ndimage.label(classified)
    chosen, sizes = _chosen(labels, count, expected, 1.0)
    if len(given) < _FEWEST_SAMPLES and chosen.size and sizes[chosen[0] - 1] >= least:
        core = labels == chosen[0]
        inner = scipy.ndimage.binary_erosion(core, iterations=_INSIDE)
        model = _model_of(array[inner if inner.sum() >= _FEWEST_SAMPLES else core], model)
        classified = _classified(array, model, noise)
        labels, count = scipy.ndimage.label(classified)
        chosen, sizes = _chosen(labels, count, expected, 1.0)
    found = replace(blank, noise=math.ldexp(noise, exponent), sizes=np.sort(sizes)[::-1])
    if not chosen.size:
        return found
    large = chosen[sizes[chosen - 1] >= least]
    if not large.size:
        return replace(found, status=ColourStatus.TOO_SMALL)
    biggest = sizes[large - 1].max()
    kept = large[sizes[large - 1] >= (_COMPARABLE * biggest if expected is None else least)]
    others = expected is None and len(kept) > 1
    if expected is None:
        kept = kept[:1]
    mask = scipy.ndimage.binary_fill_holes(np.isin(labels, kept))
    other = classified & ~mask
    coverage = _coverage(array, mask, other, noise)
    contours = _contours(coverage, mask)
    if not contours:
        return replace(found, status=ColourStatus.TOO_SMALL)
    last = np.array(mask.shape[::-1]) - 1
    near = any((line < _BORDER).any() or (line > last - _BORDER).any() for line in contours)
    status = ColourStatus.SEVERAL if others else ColourStatus.TOUCHES_BORDER if near else ColourStatus.OK
    median = np.ldexp(np.median(array[mask & classified], axis=0), exponent)
    return replace(found, status=status, mask=mask, coverage=coverage, contours=contours, colour=median)


def noise_of_image(image: Reals) -> float:
    """Return the standard deviation of the noise of an image (h, w, ...), robustly from its second differences.

    It is at least what rounding to 1 / 255 of the largest value gives.
    """
    least = 0.3 / 255 * max(float(np.abs(image).max()), TINY)
    if image.shape[1] < 3:
        return least
    second = image[:, 2:] - 2 * image[:, 1:-1] + image[:, :-2]
    return max(float(np.median(np.abs(second))) / (0.6745 * 6**0.5), least)


def _arguments(image: ArrayLike, colour: ArrayLike) -> tuple[Reals, Reals, int]:
    """Return the image and the colours in the range of floats, and the exponent of the power of 2 that divided both."""
    array = real_array(image, "image", (-1, -1, 3), "rows, columns, red green blue")
    if array.ndim != 3 or not array.size:
        raise ValueError(f"image: shape {array.shape}; expected (h, w, 3) with at least one pixel")
    given = finite(real_array(colour, "colour", (3,), "red green blue").astype(float), "colour").reshape(-1, 3)
    if not len(given) or (given < 0).any() or not given.any(1).all() or not np.median(given, axis=0).any():
        raise ValueError(f"colour: {given.tolist()}; expected nonnegative colours that are not black")
    kind = np.asarray(image).dtype
    if kind.kind in "iu" and given.max() <= 1:
        given = given * np.iinfo(kind).max
    divided, exponents = in_range(array.astype(float), (0, 1, 2))
    exponent = int(exponents.item())
    return divided, np.ldexp(given, -exponent), exponent


def _given_model(given: Reals) -> _Model:
    direction = np.median(given, axis=0)
    direction = direction / direction.max()
    direction /= np.linalg.norm(direction)
    first = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    first /= np.linalg.norm(first)
    axes = np.array([direction, first, np.cross(direction, first)])
    bright = float(np.median(given @ direction))
    model = _Model(axes, np.zeros(2), np.eye(2) * _SPREAD**2, (_DARK * bright, _BRIGHT * bright))
    return _model_of(given, model) if len(given) >= _FEWEST_SAMPLES else model


def _model_of(pixels: Reals, model: _Model) -> _Model:
    """Return a model with the robust mean and covariance of the chromaticity of pixels (n, 3) of the object."""
    along = np.maximum(pixels @ model.axes[0], TINY)
    across = pixels @ model.axes[1:].T / along[:, None]
    middle = np.median(across, axis=0)
    off = across - middle
    far = np.sqrt(np.square(off).sum(1))
    usual = off[far <= 3 * NORMAL * np.median(far) + 1e-12]
    covariance = usual.T @ usual / max(len(usual), 1) + np.eye(2) * _LEAST_SPREAD**2
    return model._replace(middle=middle, covariance=covariance)


def _classified(array: Reals, model: _Model, noise: float) -> Mask:
    """Return which pixels have the colour."""
    along = array @ model.axes[0]
    usable = (along > max(model.brightness[0], 3 * noise)) & (along < model.brightness[1])
    sizes = along[usable]
    off = array[usable] @ model.axes[1:].T / sizes[:, None] - model.middle
    # The noise of the sensor adds to the covariance, the more the darker a pixel is.
    extra = np.square(noise / sizes)
    (a, b), (_, d) = model.covariance
    a, d = a + extra, d + extra
    x, y = off.T
    squares = (d * x * x - 2 * b * x * y + a * y * y) / (a * d - b * b)
    found = np.zeros(array.shape[:2], bool)
    found[usable] = squares < _LIMIT
    return found


def _chosen(labels: Reals, count: int, region: Reals | None, least: float) -> tuple[Reals, Reals]:
    """Return the labels of components in a region, largest first, and the sizes of all components."""
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    if not count:
        return np.zeros(0, np.intp), sizes
    order = 1 + np.argsort(-sizes, kind="stable")
    if region is not None:
        inside = np.bincount(labels[region], minlength=count + 1)[1:]
        order = order[inside[order - 1] * 2 > sizes[order - 1]]
    return order[sizes[order - 1] >= least], sizes


def _coverage(array: Reals, mask: Mask, other: Mask, noise: float) -> Reals:
    """Return the part of each pixel that the object covers, by the mixture of the colours on both sides."""
    rows, columns = scipy.ndimage.find_objects(mask.astype(np.uint8))[0]
    pad = 4 * _OUTSIDE
    window = (
        slice(max(rows.start - pad, 0), rows.stop + pad), slice(max(columns.start - pad, 0), columns.stop + pad),
    )  # fmt: skip
    part, whole = array[window], mask[window]
    depth = scipy.ndimage.distance_transform_edt(np.pad(whole, pad, mode="edge"))[pad:-pad, pad:-pad]
    inner = depth > min(_INSIDE, 0.6 * float(depth.max()))
    away = scipy.ndimage.distance_transform_edt(~(whole | other[window]))
    outer = away > _OUTSIDE
    if not outer.any():
        outer = away > 0
    found = np.zeros(mask.shape)
    covered = whole.astype(float)
    band = ~inner & (scipy.ndimage.distance_transform_edt(~whole) <= _OUTSIDE)
    if outer.any() and band.any():
        covered[band] = _shares(part[band], _nearest(part, inner)[band], _nearest(part, outer)[band], noise)
    found[window] = scipy.ndimage.gaussian_filter(covered, _SMOOTH, mode="nearest")
    return found


def _nearest(part: Reals, where: Mask) -> Reals:
    """Return for each pixel the mean colour around the nearest pixel of a mask, of pixels of the mask."""
    weight = scipy.ndimage.gaussian_filter(where.astype(float), _AVERAGE)
    sums = scipy.ndimage.gaussian_filter(part * where[..., None], (_AVERAGE, _AVERAGE, 0))
    at = scipy.ndimage.distance_transform_edt(~where, return_distances=False, return_indices=True)
    return np.asarray((sums / np.maximum(weight, TINY)[..., None])[tuple(at)])


def _shares(pixels: Reals, front: Reals, behind: Reals, noise: float) -> Reals:
    """Return the weights a of pixels ``a s front + (1 - a) behind``, where the brightness s is about 1.

    The unknowns are ``x = a s`` and ``y = 1 - a``; the equation ``x + y = 1`` has the standard deviation of s.
    """
    trust = np.square(noise / _SHADING)
    ff = np.einsum("ij,ij->i", front, front) + trust
    fb = np.einsum("ij,ij->i", front, behind) + trust
    bb = np.einsum("ij,ij->i", behind, behind) + trust
    fp = np.einsum("ij,ij->i", front, pixels) + trust
    bp = np.einsum("ij,ij->i", behind, pixels) + trust
    rest = (ff * bp - fb * fp) / np.maximum(ff * bb - fb * fb, TINY)
    return np.asarray(np.clip(1 - rest, 0, 1))


def _contours(coverage: Reals, mask: Mask) -> tuple[Reals, ...]:
    """Return the level line of one half around each component, as x and y."""
    labels, count = scipy.ndimage.label(scipy.ndimage.binary_dilation(mask, iterations=_OUTSIDE))
    found = []
    for k, window in enumerate(scipy.ndimage.find_objects(labels)):
        field = np.where(labels[window] == k + 1, coverage[window], 0)
        if count and (field > 0.5).any():
            line = level_line(field, 0.5)[:, ::-1]
            found.append(line + np.array([window[1].start, window[0].start]))
    return tuple(found)
