"""Calibration of a pair of cameras from planes that both see: the motion between them, with covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, listed, real_array
from ..evidence import Noise, differ, likely, rank
from ..evidence.misfit import contradicts
from .camera import Camera
from .plane_adjustment import N_POSE, Descended, Views, views_of
from .plane_equations import planes_of
from .starts import BEST
from .status import VisionStatus, one_set
from .stereo_planes import TO_TWIST, Pair, StereoFit, agreed, camera_of, eye_of

_UNITS = Noise(1.0, 4.0)
"""Residuals are in units of the noise of each camera, which is known at least as well as by four of them."""


@dataclass(frozen=True, slots=True, eq=False)
class StereoCalibration:
    """Result of `calibrate_stereo`: the motion from one camera to another, and how well planes determine it."""

    motor: Reals
    """(8,) The unit motor, in the order of `generated.pga3`, that maps coordinates of the first camera to those of the
    second; NaN if the status is not OK."""
    status: VisionStatus
    cameras: tuple[Camera, Camera]
    """The cameras in the frame of the first one. Their poses are NaN if the status is not OK."""
    covariance: Reals
    """(6, 6) Covariance of the rotation vector that follows the motor, in radians, and of its translation, in the unit
    of the planes; infinite without a motor."""
    motors: Reals
    """(m, 8) All motors that the data cannot separate, the most likely first: one if the status is OK, two or more if
    it is AMBIGUOUS, otherwise none."""
    poses: Reals
    """(v, 8) Unit motors from the frames of the planes, whose points are ``(x, y, 0)``, to that of the first camera;
    NaN for views that are no inliers."""
    residual: float
    """The root mean square distance of pixels from the images of the points, over the inliers, in pixels."""
    view_residuals: Reals
    """(v, 2) The same for each view and camera; NaN for views that are no inliers."""
    inliers: Reals
    """(v,) bool, whether both cameras show the plane of a view, and the view agrees with the others."""


def calibrate_stereo(
    planes: ArrayLike | Sequence[ArrayLike],
    first: Sequence[ArrayLike] | Reals,
    second: Sequence[ArrayLike] | Reals,
    camera: Camera,
    second_camera: Camera | None = None,
    *,
    refine: bool = False,
) -> StereoCalibration:
    """Estimate the motion between two cameras from planes that both see at the same time (`stereoCalibrate`).

    The squared distances of the pixels from the images of the points, in units of the noise of each camera, are
    minimised over the motion and the poses of all planes, by Levenberg and Marquardt's method. The poses are eliminated
    view by view. The motions of single views are starts, of which the one is taken first that is nearest to most
    others.

    Parameters
    ----------
    planes : array_like, (n, 2), or a sequence of (n_k, 2)
        Points of one plane for all views, or of one plane for each view, in any unit of length.
    first, second : sequence of array_like, (n_k, 2)
        Their pixels in both cameras. NaN are pixels of points that a camera does not show.
    camera : Camera
        The first camera with its distortion, as from `calibrate_from_planes`. Its pose is not used.
    second_camera : Camera, optional
        The second camera; by default the first.
    refine : bool
        Whether the focal lengths, the centres and the coefficients of both lenses are estimated too. This requires
        several views that are turned relative to each other. By default they are held.

    Returns
    -------
    StereoCalibration
        TOO_FEW if fewer than two views show four points of the plane to both cameras. NOT_FINITE if a point of a plane
        is not finite or a pixel is infinite. DEGENERATE if the views do not determine the parameters. NO_CONSENSUS if
        no more than half of the usable views agree with one motion. AMBIGUOUS if small or distant planes allow several
        motions. NOT_CONVERGED if iterations ended early, or if the motions of single views explain more of the
        residuals than they leave, and than noise would.

    Raises
    ------
    TypeError, ValueError
        If a camera is not a `Camera`, if the numbers of views or points differ, or if a pixel is NaN in one coordinate
        only.

    Notes
    -----
    A view is an inlier unless a motion of its own explains more of its residuals than noise would, and than it leaves.
    Views of a wrong instant, or with corners that are counted from another side, are left out in this way. Errors of
    intrinsic parameters that are held are not in the covariance.
    """
    other = camera if second_camera is None else second_camera
    for one, name in ((camera, "camera"), (other, "second_camera")):
        if not isinstance(one, Camera):
            raise TypeError(f"{name}: {type(one).__name__}; expected a Camera")
    views, middles, status = _checked(planes, first, second)
    count = len(middles)
    if status != VisionStatus.OK:
        return _nothing(status, count, (camera, other))
    fit = StereoFit(eye_of(camera, views[0]), eye_of(other, views[1]), refine)
    if fit.usable.sum() < 2:
        return _nothing(VisionStatus.TOO_FEW, count, (camera, other))
    found = list[tuple[Descended[Pair], Reals, Reals]]()
    known = list[Reals]()
    for motor, poses, squares in islice(fit.candidates(), BEST):
        result = agreed(fit, motor, poses, squares, known)
        if result is not None:
            found.append(result)
            if not fit.is_ambiguous:
                break
    if not found:
        return _nothing(VisionStatus.NO_CONSENSUS, count, (camera, other))
    found.sort(key=lambda one: (-int(one[1].sum()), float(one[0].sums[:, -1, -1].sum())))
    return _result(fit, found, (camera, other), middles)


def _result(
    fit: StereoFit,
    found: list[tuple[Descended[Pair], Reals, Reals]],
    cameras: tuple[Camera, Camera],
    middles: Reals,
) -> StereoCalibration:
    """Return the result for minima, the best one first."""
    best, inliers, alone = found[0]
    n = len(inliers)
    freedom = int(fit.freedoms[inliers].sum()) + N_POSE * int(inliers.sum()) - len(fit.used)
    cost = float(best.sums[:, -1, -1].sum())
    information = best.information
    if not np.isfinite(information).all() or rank(information) < len(fit.used) or freedom <= 0:
        return _nothing(VisionStatus.DEGENERATE, n, cameras)
    terms = N_POSE * (int(inliers.sum()) - 1)
    explained = cost - float(alone.sum())
    if not best.converged or contradicts(explained, cost, terms, freedom - terms, fit.exact):
        return _nothing(VisionStatus.NOT_CONVERGED, n, cameras)
    variance = max(cost / freedom, explained / terms)
    rivals = _rivals(found, fit, freedom, variance)
    motors = np.array([one.state.motor * (-1 if one.state.motor[0] < 0 else 1) for one, _, _ in rivals])
    status = VisionStatus.OK if len(rivals) == 1 else VisionStatus.AMBIGUOUS
    pair = best.state
    motor = motors[0] if status == VisionStatus.OK else np.full(8, np.nan)
    spread = variance * np.linalg.inv(information)[-N_POSE:, -N_POSE:]
    way = _to_parts(pair.motor)
    poses, residuals = np.full((n, 8), np.nan), np.full((n, 2), np.nan)
    back = np.insert(-middles[inliers], 2, 0, axis=1)
    poses[inliers] = pga3.motor_product(pair.lenses[0].poses, pga3.motor_from_rotor_translation(np.eye(4)[0], back))
    squares, counts = fit.squares(pair, inliers)
    residuals[inliers] = np.sqrt(squares / counts)
    return StereoCalibration(
        motor,
        status,
        (
            camera_of(pair.lenses[0], np.eye(8)[0], cameras[0]),
            camera_of(pair.lenses[1], np.asarray(pga3.motor_inverse(motor)), cameras[1]),
        ),
        way @ spread @ way.T,
        motors,
        poses,
        float(np.sqrt(squares.sum() / counts.sum())),
        residuals,
        inliers,
    )


def _rivals(
    found: list[tuple[Descended[Pair], Reals, Reals]], fit: StereoFit, freedom: int, variance: float
) -> list[tuple[Descended[Pair], Reals, Reals]]:
    """Return the best minimum, and those that are as likely and differ from it."""
    best, inliers, _ = found[0]
    kept = [found[0]]
    for other in found[1:]:
        is_same = np.array_equal(other[1], inliers)
        if other[1].sum() < inliers.sum():
            continue
        costs = np.array([one.sums[:, -1, -1].sum() for one in (best, other[0])])
        off = pga3.motor_logarithm(pga3.motor_product(other[0].state.motor, pga3.motor_inverse(best.state.motor)))
        information = np.linalg.inv(np.linalg.inv(best.information)[-N_POSE:, -N_POSE:])
        apart = differ(np.asarray(off), information, np.asarray(variance))
        if apart and (not is_same or likely(costs, freedom + len(fit.used), freedom, _UNITS)[1]):
            kept.append(other)
    return kept


def _to_parts(motor: Reals) -> Reals:
    """Return the matrix (6, 6) from bivectors of a step to rotation vectors and changes of the translation."""
    linear = np.linalg.inv(TO_TWIST)
    x, y, z = pga3.motor_to_matrix(motor)[:3, 3]
    # A rotation after the motor also moves its translation.
    turned = np.eye(N_POSE)
    turned[3:, :3] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    return np.asarray(turned @ linear)


def _checked(
    planes: ArrayLike | Sequence[ArrayLike], first: Sequence[ArrayLike] | Reals, second: Sequence[ArrayLike] | Reals
) -> tuple[list[Views], Reals, VisionStatus]:
    """Return the views of both cameras, with points relative to the same centroids."""
    pixels = [
        [
            one_set(real_array(view, f"{name}[{k}]", (2,), "x y in pixels"))
            for k, view in enumerate(listed(views, name, "arrays (n, 2), x y"))
        ]
        for views, name in ((first, "first"), (second, "second"))
    ]
    n = len(pixels[0])
    if len(pixels[1]) != n:
        raise ValueError(f"second: {len(pixels[1])} views; expected {n}, as many as first has")
    places = planes_of(planes, n)
    for views, name in zip(pixels, ("first", "second"), strict=True):
        for k, (image, place) in enumerate(zip(views, places, strict=True)):
            if place.ndim != 2 or image.shape != place.shape:
                raise ValueError(f"{name}[{k}]: shape {image.shape}; expected {place.shape}, a pixel for each point")
            if (np.isnan(image[:, 0]) != np.isnan(image[:, 1])).any():
                raise ValueError(f"{name}[{k}]: NaN in one coordinate of a pixel; expected both or none")
    if not all(np.isfinite(place).all() for place in places) or any(np.isinf(x).any() for v in pixels for x in v):
        return [], np.empty((n, 2)), VisionStatus.NOT_FINITE
    if not n or not max(map(len, places)):
        return [], np.empty((n, 2)), VisionStatus.TOO_FEW
    padded = [place if len(place) else np.zeros((1, 2)) for place in places]
    return (
        [_views(padded, own) for own in pixels],
        np.array([place.mean(0, dtype=float) for place in padded]),
        VisionStatus.OK,
    )


def _views(places: list[Reals], pixels: list[Reals]) -> Views:
    """Return views of points relative to the centroids of all points; those that are not seen have weight 0."""
    seen = [np.nan_to_num(image) if len(image) else np.zeros((1, 2)) for image in pixels]
    views, _ = views_of(places, seen)
    for k, image in enumerate(pixels):
        views.weights[k, : max(len(image), 1)] = np.isfinite(image).all(1) if len(image) else 0
    return views


def _nothing(status: VisionStatus, n: int, cameras: tuple[Camera, Camera]) -> StereoCalibration:
    unknown = np.full(8, np.nan)
    return StereoCalibration(
        unknown,
        status,
        (
            Camera(cameras[0].intrinsics, unknown, cameras[0].distortion),
            Camera(cameras[1].intrinsics, unknown, cameras[1].distortion),
        ),
        np.full((6, 6), np.inf),
        np.empty((0, 8)),
        np.full((n, 8), np.nan),
        np.nan,
        np.full((n, 2), np.nan),
        np.zeros(n, bool),
    )
