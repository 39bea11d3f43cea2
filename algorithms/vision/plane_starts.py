"""Starts of calibrations with distortion: radial models with one parameter that make images of planes homographies."""

from __future__ import annotations

import numpy as np

from generated import linear_views, pga3, projective2

from ..arguments import Reals
from .distortion import NAMES, Model
from .plane_adjustment import Lens, Views
from .plane_equations import closed_form
from .plane_judgement import agreeing
from .planes import linear_homography

_DIVISIONS = np.array([0.4, 0.2, 0.1, 0.0, -0.05, -0.1, -0.2, -0.3, -0.4, -0.5, -0.6, -0.7, -0.8, -0.9])
"""A limit on work: parameters of the division model (Fitzgibbon 2001) at the farthest pixel from the centre."""
_ANGLES = np.radians([15, 25, 35, 45, 55, 65, 75, 85, 95, 105])
"""A limit on work: angles from the axis of an equidistant lens at the farthest pixel from the centre."""
_WIDEST = np.radians(80)
"""From floating point: points at larger angles are not used, whose tangents make homographies ill-conditioned."""
_FEW = 16
"""A limit on work: the number of points of a view with which models are compared."""
_SCALES = (0.6, 1.7)
"""A limit on work: further focal lengths from which few views, which have several minima, are adjusted, relative to
that of the equations;"""
_FEW_VIEWS = 4
"""and the largest number of such views."""
_FEWEST = 6
"""Points of a view without which a model is not tried: a homography leaves at least four residuals."""


def lens_starts(views: Views, model: Model, skew: bool) -> tuple[list[Lens], Reals]:
    """Return candidates for the parameters of a lens and the poses of planes, and which views (v,) are likely.

    The centre of distortion is taken to be the middle of the pixels; the candidates differ in their principal points.
    Unlikely views are not images of planes, as well as the others are.
    """
    weights = views.weights > 0
    low, high = views.pixels[weights].min(0), views.pixels[weights].max(0)
    centre = (low + high) / 2
    radius = float(np.linalg.norm(views.pixels[weights] - centre, axis=1).max())
    about = (views.pixels - centre) / radius
    far = np.linalg.norm(about, axis=-1)
    strengths = _DIVISIONS if model == "brown" else _ANGLES
    plain, slope, usable = _straightened(about, far, strengths, model)
    found = list[tuple[float, Reals, Reals]]()
    for own, rate, which in zip(plain, slope, usable & weights, strict=True):
        found.append(_homographies(views.places, own, rate, which, _FEW))
    best = int(np.argmin([cost for cost, _, _ in found]))
    if not np.isfinite(found[best][0]):
        return [], np.ones(len(views.places), bool)
    most = views.weights.shape[1]
    cost, matrices, costs = _homographies(views.places, plain[best], slope[best], usable[best] & weights, most)
    if not np.isfinite(cost):
        return [], np.ones(len(views.places), bool)
    usable_views = agreeing(radius**2 * costs, 2 * weights.sum(1) - 8, views)
    result = []
    candidates = _intrinsics(matrices[usable_views], skew)
    if len(matrices) <= _FEW_VIEWS and candidates:
        candidates += [candidates[-1] * [[scale], [scale], [1.0]] for scale in _SCALES]
    for k in candidates:
        lens = _lens(k, matrices, model)
        if model == "brown":
            lens.k[0] = strengths[best] * k[0, 0] * k[1, 1]
        lens.intrinsics[:] = _in_pixels(k, centre, radius)
        result.append(lens)
    if model == "fisheye":
        # The angle that was found gives the focal length of the equidistant model.
        k = np.diag([1 / strengths[best], 1 / strengths[best], 1])
        lens = _lens(k, matrices, model)
        lens.intrinsics[:] = _in_pixels(k, centre, radius)
        result.insert(0, lens)
    return result, usable_views


def lens_of_homographies(intrinsics: Reals, matrices: Reals, model: Model) -> Lens:
    """Return the parameters of a camera without distortion, with the poses of planes by their homographies."""
    lens = _lens(intrinsics, matrices, model)
    lens.intrinsics[:] = _in_pixels(intrinsics, np.zeros(2), 1.0)
    return lens


def _straightened(about: Reals, far: Reals, strengths: Reals, model: Model) -> tuple[Reals, Reals, Reals]:
    """Return pixels (s, v, n, 2) without distortion, the derivatives (s, v, n) of distances, and which are usable."""
    size = strengths[:, None, None]
    with np.errstate(all="ignore"):
        if model == "brown":
            divisor = 1 + size * far**2
            factor, slope = 1 / divisor, (2 - divisor) / divisor**2
            usable = (divisor > 0.05) & (slope > 0)
        else:
            angle = size * far
            factor, slope = np.where(far > 0, np.tan(angle) / angle, 1), 1 / np.cos(angle) ** 2
            usable = angle < _WIDEST
    return about * factor[..., None], slope, usable


def _homographies(places: Reals, plain: Reals, slope: Reals, usable: Reals, most: int) -> tuple[float, Reals, Reals]:
    """Return the median of mean squared distances of views before straightening, homographies, and sums of squares.

    The homographies are those of at most a number of points of each view.
    """
    nothing = np.inf, np.empty((0, 3, 3)), np.empty(0)
    if (usable.sum(1) < _FEWEST).any():
        return nothing
    order = np.argsort(~usable, axis=1, kind="stable")
    count = usable.sum(1, keepdims=True)
    # Short views repeat points of their own, whose weights do not matter here.
    n = min(most, int(count.max()))
    spread = np.where(count > n, np.linspace(0, count[:, 0] - 1, n).T.round().astype(int), np.arange(n) % count)
    index = np.take_along_axis(order, spread, 1)
    own, there = (np.take_along_axis(each, index[..., None], 1) for each in (places, plain))
    matrices, _ = linear_homography(own, there)
    with np.errstate(all="ignore"):
        off = projective2.transform_point(matrices[:, None], places) - plain
        squares = (off**2).sum(-1) / slope**2
    costs = np.where(usable, squares, 0).sum(1)
    cost = float(np.median(costs / count[:, 0]))
    if not np.isfinite(cost) or not np.isfinite(matrices).all():
        return nothing
    return cost, np.asarray(matrices), costs


def _intrinsics(matrices: Reals, skew: bool) -> list[Reals]:
    """Return matrices K by the circular points of planes: one with its own centre, and one with the centre at 0."""
    found = []
    k, _ = closed_form(matrices, np.eye(3), np.tile(np.eye(3), (len(matrices), 1, 1)), skew)
    if np.isfinite(k).all():
        found.append(k)
    # Both equations of a view in 1 / f^2, if the axes are at right angles and of equal length in the plane.
    first, second = matrices[:, :, 0], matrices[:, :, 1]
    flat = np.concatenate([(first * second)[:, :2].sum(1), (first**2 - second**2)[:, :2].sum(1)])
    deep = -np.concatenate([first[:, 2] * second[:, 2], first[:, 2] ** 2 - second[:, 2] ** 2])
    inverse_square = float(flat @ deep) / max(float(flat @ flat), np.finfo(float).tiny)
    if inverse_square > 0:
        f = 1 / np.sqrt(inverse_square)
        found.append(np.diag([f, f, 1]))
    return found


def _lens(k: Reals, matrices: Reals, model: Model) -> Lens:
    poses = np.asarray(linear_views.pose_of_plane(np.linalg.inv(k) @ matrices, np.eye(3)))
    whole = np.tile(np.eye(4), (len(poses), 1, 1))
    whole[:, :3] = poses
    return Lens(model, np.zeros(5), np.zeros(len(NAMES[model])), np.asarray(pga3.motor_from_matrix(whole)))


def _in_pixels(k: Reals, centre: Reals, radius: float) -> Reals:
    """Return ``fx fy cx cy skew`` in pixels, of a matrix K for pixels about a centre in units of a radius."""
    return np.array([radius * k[0, 0], radius * k[1, 1], *(centre + radius * k[:2, 2]), radius * k[0, 1]])
