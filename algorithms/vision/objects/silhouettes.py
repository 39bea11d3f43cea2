"""The silhouette of an object in one raster image, and the parts of the outline of a model to which it belongs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ...arguments import Reals
from ...shapes.colour_segmentation import ColourSegment, segment_colour
from ...shapes.colour_status import ColourStatus
from ..camera import Camera
from .image_arguments import check_size
from .image_status import ImageStatus
from .pose_models import KINDS, ObjectModel, View
from .predicted_curves import Mesh, PredictedCurves, predicted_curves
from .scene import SceneCamera

_BORDER = 3.0
"""Pixels nearer to the border of the image than this are left out."""
_STEP, _REACH = 3, 4
"""Every third sample of a contour is used, about two pixels apart; its normal is that of the chord between the fourth
samples on both sides."""
_AGREE = 0.85
"""Least cosine of the angle between the normals of the contour and of the outline."""
_CORNER = 4.0
"""Pixels nearer than this to another element are left out: blur rounds corners, and where elements are tangent, a wrong
assignment would confirm a wrong pose."""
_WIDER = 0.15
"""The region in which an object is expected, beyond its outline, as a part of its size, and in pixels at least."""
_LEAST_WIDER = 12.0
"""The least number of pixels by which the region of an object is wider than expected."""
_NAMES = {
    ColourStatus.OK: ImageStatus.OK,
    ColourStatus.TOUCHES_BORDER: ImageStatus.TOUCHES_BORDER,
    ColourStatus.SEVERAL: ImageStatus.SEVERAL,
    ColourStatus.TOO_SMALL: ImageStatus.TOO_SMALL,
    ColourStatus.NOT_FOUND: ImageStatus.NOT_FOUND,
    ColourStatus.NOT_FINITE: ImageStatus.NOT_FINITE,
}


@dataclass(frozen=True, eq=False)
class Silhouette:
    """Points on the contour of an object in an image, without lens distortion."""

    camera: SceneCamera
    status: ImageStatus
    pixels: Reals
    """(n, 2) Without those near the border of the image."""
    normals: Reals
    """(n, 2) Unit normals, outwards."""
    segment: ColourSegment | None
    """None if the object cannot be in the image."""

    @property
    def size(self) -> float:
        """The square root of the area of the convex hull of the pixels; 0 if there are too few."""
        return float(np.sqrt(hull_area(self.pixels)))


def hull_area(pixels: Reals) -> float:
    """Return the area of the convex hull of pixels (n, 2); 0 if they are on a line."""
    try:
        return float(scipy.spatial.ConvexHull(pixels).volume)
    except (scipy.spatial.QhullError, ValueError):
        return 0.0


def silhouette_of_image(camera: SceneCamera, image: ArrayLike, colour: ArrayLike, region: Reals | None) -> Silhouette:
    """Segment an image by colour, and return the points of the contours of the object.

    Parameters
    ----------
    camera : SceneCamera
        With its pose in the world.
    image : array_like, (h, w, 3)
    colour, region
        As for `segment_colour`.

    Raises
    ------
    TypeError, ValueError
        As for `segment_colour`, and if the size of the image is not that of the camera.
    """
    check_size(camera, image)
    found = segment_colour(image, colour, region=region)
    parts = [_points(camera, line) for line in found.contours]
    pixels = np.concatenate([p for p, _ in parts]) if parts else np.zeros((0, 2))
    normals = np.concatenate([n for _, n in parts]) if parts else np.zeros((0, 2))
    return Silhouette(camera, _NAMES[found.status], pixels, normals, found)


def expected_region(
    model: ObjectModel, pose: Reals, camera: SceneCamera, mesh: Mesh
) -> tuple[ImageStatus, NDArray[np.bool_] | None]:
    """Return where an object at a pose is expected in an image, or why it cannot be there."""
    curves = predicted_curves(model, pose, camera.pinhole, mesh)
    if curves is None:
        return ImageStatus.BEHIND_CAMERA, None
    pixels = camera.camera.distort(curves.pixels)
    if not np.isfinite(pixels).all():
        return ImageStatus.OUTSIDE_IMAGE, None  # Points are beyond the range of the lens.
    low, high = pixels.min(0), pixels.max(0)
    size = np.array(camera.size)
    wider = max(_WIDER * float((high - low).max()), _LEAST_WIDER)
    if (high < 0).any() or (low > size - 1).any():
        return ImageStatus.OUTSIDE_IMAGE, None
    first = np.clip(np.floor(low - wider), 0, size).astype(int)
    last = np.clip(np.ceil(high + wider) + 1, 0, size).astype(int)
    found = np.zeros(camera.size[::-1], bool)
    found[first[1] : last[1], first[0] : last[0]] = True
    return ImageStatus.OK, found


@dataclass(frozen=True, eq=False)
class Assignment:
    """Points of a contour and the points of an outline that they belong to."""

    outline: PredictedCurves
    rows: NDArray[np.intp]
    """Of the contour."""
    at: NDArray[np.intp]
    """Of the outline, for each of the rows."""
    seen: NDArray[np.bool_]
    """For each point of the outline, whether a point of the contour is near."""
    agreeing: float
    """The part of the contour that is near the outline."""

    def shown(self, camera: SceneCamera) -> float:
        """Return the part of the outline within the image that is seen."""
        pixels = camera.camera.distort(self.outline.pixels)
        inside = ((pixels > _BORDER) & (pixels < np.array(camera.size) - 1 - _BORDER)).all(1)
        weight = np.where(inside, self.outline.steps, 0)
        return float(weight @ self.seen / weight.sum()) if weight.sum() > 0 else 0.0

    def view(self, camera: Camera, pixels: Reals) -> View:
        """Return the assigned pixels by the kind of element."""
        return view_of_elements(camera, self.outline.kinds[self.at], self.outline.elements[self.at], pixels[self.rows])


def assigned(silhouette: Silhouette, curves: PredictedCurves, gate: float, least: float = _AGREE) -> Assignment:
    """Assign the points of a contour to the nearest points of a predicted outline of similar direction.

    Parameters
    ----------
    silhouette : Silhouette
    curves : PredictedCurves
    gate : float
        The largest distance in pixels.
    least : float
        The least cosine of the angle between normals.
    """
    outline = curves.part(curves.is_outline & curves.is_visible)
    pixels, normals = silhouette.pixels, silhouette.normals
    if not len(outline.pixels) or not len(pixels):
        return Assignment(outline, np.zeros(0, int), np.zeros(0, int), np.zeros(len(outline.pixels), bool), 0.0)
    weight = max(gate, 5.0)
    tree = scipy.spatial.cKDTree(np.hstack([outline.pixels, weight * outline.normals]))
    _, at = tree.query(np.hstack([pixels, weight * normals]))
    off = pixels - outline.pixels[at]
    across = np.einsum("ij,ij->i", off, outline.normals[at])
    along = _along(off, outline.normals[at])
    near = (np.abs(across) <= gate) & (along <= np.maximum(outline.steps[at], gate) + 1)
    near &= np.einsum("ij,ij->i", normals, outline.normals[at]) >= least
    rows = np.flatnonzero(near)
    seen = _seen(outline, pixels[rows], gate)
    clear = rows[~_at_corners(outline, pixels[rows], at[rows])]
    return Assignment(outline, clear, at[clear], seen, len(rows) / len(pixels))


def view_of_elements(camera: Camera, kinds: Reals, elements: Reals, pixels: Reals) -> View:
    """Return pixels (n, 2) of elements by their kind, which are indices of `KINDS`."""
    found = {}
    for kind in np.unique(kinds):
        own = kinds == kind
        found[KINDS[kind]] = (elements[own], pixels[own])
    return View(camera, **found)


def _points(camera: SceneCamera, line: Reals) -> tuple[Reals, Reals]:
    """Return points of a closed contour (n, 2), with normals, without lens distortion and the border of the image."""
    plain = camera.camera.undistort(line)
    chord = np.roll(plain, -_REACH, 0) - np.roll(plain, _REACH, 0)
    # The object is to the left of the direction, with x to the right and y down.
    normals = np.column_stack([-chord[:, 1], chord[:, 0]])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    inside = ((line > _BORDER) & (line < np.array(camera.size) - 1 - _BORDER)).all(1)
    # Normals at the ends of a part along the border are those of both.
    inside &= scipy.ndimage.minimum_filter1d(inside.astype(np.uint8), 2 * _REACH + 1, mode="wrap").astype(bool)
    inside &= np.isfinite(plain).all(1) & np.isfinite(normals).all(1)
    kept = np.flatnonzero(inside)[::_STEP]
    return plain[kept], normals[kept]


def _along(off: Reals, normals: Reals) -> Reals:
    return np.asarray(np.abs(off[:, 0] * normals[:, 1] - off[:, 1] * normals[:, 0]))


def _seen(outline: PredictedCurves, pixels: Reals, gate: float) -> Reals:
    """Return for each point of an outline whether one of the pixels (n, 2) is within the gate, or half a step."""
    if not len(pixels):
        return np.zeros(len(outline.pixels), bool)
    far, _ = scipy.spatial.cKDTree(pixels).query(outline.pixels)
    return np.asarray(far <= gate + np.maximum(outline.steps / 2, _STEP))


def _at_corners(outline: PredictedCurves, pixels: Reals, at: Reals) -> Reals:
    """Return which pixels are near points of the outline of another element than that at which they are."""
    if not len(pixels):
        return np.zeros(0, bool)
    own = outline.kinds * (int(outline.elements.max()) + 1) + outline.elements
    found = np.zeros(len(pixels), bool)
    for k, around in enumerate(scipy.spatial.cKDTree(outline.pixels).query_ball_point(pixels, _CORNER)):
        found[k] = bool((own[around] != own[at[k]]).any())
    return found
