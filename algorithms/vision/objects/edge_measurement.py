"""Edges of an object in an image, measured along the normals of the model's curves at a predicted pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ...arguments import Reals, finite_number
from ...elements import MOTOR, elements
from ...shapes.colour_segmentation import noise_of_image
from .image_arguments import check_outline, checked_mesh, checked_start, real_image
from .image_status import ImageStatus
from .pose_models import ObjectModel, View
from .predicted_curves import Mesh, PredictedCurves, predicted_curves
from .scene import SceneCamera
from .silhouettes import view_of_elements

_SAMPLE = 0.5
"""Distance in pixels of samples along a normal."""
_ASIDE = (-1.0, 0.0, 1.0)
"""Profiles at these distances along the curve, in pixels, are averaged."""
_WIDTH = 1.0
"""The standard deviation in pixels of the derivative of a Gaussian with which profiles are filtered."""
_CONTRAST, _LEAST_CONTRAST = 4.0, 0.02
"""The least contrast of an edge: in standard deviations of the noise, and as a part of the range of the image."""
_STRONG = 0.5
"""Of edges with at least this part of the strength of the strongest, the nearest is taken."""
_BORDER = 2.0
"""Pixels nearer to the border of an image have no neighbours for their gradients."""
_CROWDED, _APART, _COSINE = 4.0, 0.3, 0.9
"""Curves of other elements within the first distance hide each other's edges, unless they are within the second and of
the same direction."""
_LEAST_SHOWN = 0.25
"""Least part of the visible curves in the image that is measured."""


_LEAST_OF_CURVE = 0.4
"""Least part of the visible points of one curve that must have an edge: fewer edges belong to what hides the curve."""


@dataclass(frozen=True, eq=False)
class MeasuredEdges:
    """Result of `measure_edges`."""

    status: ImageStatus
    view: View
    """The pixels with the elements of the model; without pixels if nothing is measured."""
    offsets: Reals
    """(n,) The signed distances in pixels from the predicted curves, by elements as in `view`."""
    n_predicted: int
    """The number of visible points of curves in the image, at which edges were searched."""

    @property
    def shown(self) -> float:
        """The part of the predicted points that have an edge."""
        return len(self.offsets) / max(self.n_predicted, 1)


@elements(start=MOTOR)
def measure_edges(
    model: ObjectModel,
    camera: SceneCamera,
    image: ArrayLike,
    start: ArrayLike,
    *,
    reach: float = 8.0,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
) -> MeasuredEdges:
    """Measure where the visible curves of a model are in an image, near those of a predicted pose.

    At points of visible edges, silhouettes and rims, the image is sampled along the normal of the curve. The edge is at
    the largest derivative of the colour, between samples by a parabola (as in RAPiD by Harris). Points at which curves
    of several elements are too near to each other are left out, and so are curves with edges at less than two fifths of
    their points: they are hidden.

    Parameters
    ----------
    model : ObjectModel
        With edges, spheres or cylinders.
    camera : SceneCamera
        With its pose in the world: `Scene.placed_camera`.
    image : array_like, (h, w, 3) or (h, w)
        Of any real type.
    start : array_like, (8,)
        The predicted pose.
    reach : float
        The largest distance in pixels from the predicted curve.
    mesh : (array_like, (n, 3), array_like, (m, 3)), optional
        Vertices and faces, in the frame of the object, that hide curves. By default the convex hull of edges and
        points.

    Returns
    -------
    MeasuredEdges

    Raises
    ------
    TypeError, ValueError
        If shapes or types disagree, the camera is mounted, `reach` is less than 2, or the model consists of points
        only.

    Notes
    -----
    In rendered images with noise of 1 % and a blur of 0.6 pixels, the distances from the exact curves are 0.1 pixels
    (root mean square).
    """
    check_outline(model)
    pose = checked_start(start)
    if finite_number(reach, "reach") < 2:
        raise ValueError(f"reach: {reach}; expected at least 2 pixels")
    return edges_near(model, camera, real_image(camera, image), pose, reach, checked_mesh(model, mesh))


def edges_near(
    model: ObjectModel, camera: SceneCamera, image: Reals, pose: Reals, reach: float, mesh: Mesh
) -> MeasuredEdges:
    """As `measure_edges`, of checked arguments: an image (h, w, c) of float64."""
    nothing = MeasuredEdges(ImageStatus.NOT_FOUND, View(camera.pinhole), np.zeros(0), 0)
    if not np.isfinite(image).all():
        return _because(ImageStatus.NOT_FINITE, nothing)
    curves = predicted_curves(model, pose, camera.pinhole, mesh)
    if curves is None:
        return _because(ImageStatus.BEHIND_CAMERA, nothing)
    curves = curves.part(curves.is_visible)
    curves = curves.part(_in_image(curves, camera) & ~_crowded(curves))
    if not len(curves.pixels):
        return _because(ImageStatus.OUTSIDE_IMAGE, nothing)
    offsets, is_edge = _offsets(curves, camera, image, reach)
    is_edge &= _is_seen(curves, is_edge)
    found, offsets = curves.part(is_edge), offsets[is_edge]
    pixels = found.pixels + offsets[:, None] * found.normals
    view = view_of_elements(camera.pinhole, found.kinds, found.elements, pixels)
    share = len(offsets) / len(curves.pixels)
    status = ImageStatus.NOT_FOUND if not share else ImageStatus.OK if share >= _LEAST_SHOWN else ImageStatus.OCCLUDED
    order = np.argsort(found.kinds, kind="stable")
    return MeasuredEdges(status, view, offsets[order], len(curves.pixels))


def _because(status: ImageStatus, nothing: MeasuredEdges) -> MeasuredEdges:
    return MeasuredEdges(status, nothing.view, nothing.offsets, nothing.n_predicted)


def _in_image(curves: PredictedCurves, camera: SceneCamera) -> Reals:
    pixels = camera.camera.distort(curves.pixels)
    return np.asarray(((pixels >= _BORDER) & (pixels <= np.array(camera.size) - 1 - _BORDER)).all(1))


def _crowded(curves: PredictedCurves) -> Reals:
    """Return at which points the edges of several elements cannot be distinguished."""
    found = np.zeros(len(curves.pixels), bool)
    pairs = scipy.spatial.cKDTree(curves.pixels).query_pairs(_CROWDED, output_type="ndarray")
    i, j = pairs.T
    other = (curves.kinds[i] != curves.kinds[j]) | (curves.elements[i] != curves.elements[j])
    i, j = i[other], j[other]
    crosses = np.abs(np.einsum("ij,ij->i", curves.normals[i], curves.normals[j])) < _COSINE
    off = curves.pixels[i] - curves.pixels[j]
    apart = np.abs(np.einsum("ij,ij->i", off, curves.normals[i])) > _APART
    found[i[crosses | apart]] = True
    found[j[crosses | apart]] = True
    return found


def _is_seen(curves: PredictedCurves, is_edge: Reals) -> Reals:
    """Return which points belong to a curve that has an edge at enough of its points."""
    _, curve = np.unique(np.column_stack([curves.kinds, curves.elements]), axis=0, return_inverse=True)
    curve = curve.reshape(-1)
    return np.asarray((np.bincount(curve, is_edge) >= _LEAST_OF_CURVE * np.bincount(curve))[curve])


def _offsets(curves: PredictedCurves, camera: SceneCamera, image: Reals, reach: float) -> tuple[Reals, Reals]:
    """Return the distances (n,) of edges from curves along normals, and whether there is an edge."""
    count = int(np.ceil((reach + 2 * _WIDTH) / _SAMPLE))
    along = np.arange(-count, count + 1) * _SAMPLE
    tangents = np.column_stack([-curves.normals[:, 1], curves.normals[:, 0]])
    profiles = np.zeros((image.shape[2], len(curves.pixels), len(along)))
    for aside in _ASIDE:
        places = (curves.pixels + aside * tangents)[:, None] + along[:, None] * curves.normals[:, None]
        bent = camera.camera.distort(places)
        rows = [
            scipy.ndimage.map_coordinates(image[..., k], [bent[..., 1], bent[..., 0]], order=1, mode="nearest")
            for k in range(image.shape[2])
        ]
        profiles = profiles + np.stack(rows) / len(_ASIDE)
    width = _WIDTH / _SAMPLE
    slopes = scipy.ndimage.gaussian_filter1d(profiles, width, axis=-1, order=1, mode="nearest")
    strength = np.sqrt(np.square(slopes).sum(0))
    # A step of height h has the largest derivative h / (width sqrt(2 pi)).
    contrast = strength * width * np.sqrt(2 * np.pi)
    least = max(_CONTRAST * noise_of_image(image), _LEAST_CONTRAST * float(np.ptp(image)))
    middle, sides = contrast[:, 1:-1], (contrast[:, :-2], contrast[:, 2:])
    within = np.abs(along[1:-1]) <= reach
    peaks = (middle >= sides[0]) & (middle > sides[1]) & (middle > least) & within
    peaks &= middle >= _STRONG * np.where(peaks, middle, 0).max(1, keepdims=True)
    far = np.where(peaks, np.abs(along[1:-1]), np.inf)
    at, rows_of = far.argmin(1), np.arange(len(far))
    a, b, c = sides[0][rows_of, at], middle[rows_of, at], sides[1][rows_of, at]
    bend = a - 2 * b + c
    shift = np.where(bend < 0, 0.5 * (a - c) / np.where(bend < 0, bend, -1), 0)
    return along[1:-1][at] + _SAMPLE * shift, peaks.any(1)
