"""Points from many known views, and the metric scene of a projective one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, listed, real_array
from ..precision import EIGENVALUE
from .bundle import bundle_adjust
from .bundle_results import BundleAdjustment
from .camera import Camera, camera_matrix
from .factorization import Factorization
from .localization import checked_intrinsics
from .normalization import extents
from .pose_refinement import pixel_noise
from .status import VisionStatus, refuse

_PAIRS = ((0, 1), (0, 2), (1, 2))
_EXPECTED = "views that determine a metric frame: three or more, with rotations"


def triangulate_views(cameras: Sequence[Camera], pixels: ArrayLike, noise: float | None = None) -> BundleAdjustment:
    """Triangulate points that two or more known cameras see (`triangulate_multi_view_point` of COLMAP).

    The points nearest to their lines of sight are the start of least squares of distances in the images.

    Parameters
    ----------
    cameras : sequence of Camera
        v cameras, also with distortion.
    pixels : array_like, (v, n, 2)
        NaN where a camera does not see a point.
    noise : float, optional
        The standard deviation of pixels; see `bundle_adjust`.

    Returns
    -------
    BundleAdjustment
        The cameras as given, with `points` (n, 3), their `point_status` and `point_covariance`. Points that fewer than
        two cameras see are NaN, and TOO_FEW; those whose lines of sight are parallel, or start at one place, are NaN,
        and DEGENERATE. NO_CONSENSUS are those whose distances contradict the noise, which is the sooner seen if `noise`
        is given. `status` is that of all points together.

    Raises
    ------
    TypeError, ValueError
        If there are no cameras, or not as many arrays of pixels as cameras.
    """
    given = listed(cameras, "cameras", "cameras")
    image = real_array(pixels, "pixels", (-1, -1, 2), "views, points, x y").astype(np.float64)
    if not given or len(image) != len(given):
        raise ValueError(
            f"pixels: {len(image)} views; expected {len(given)}, as many as there are cameras, at least one"
        )
    for k, camera in enumerate(given):
        if not isinstance(camera, Camera):
            raise TypeError(f"cameras[{k}]: {type(camera).__name__}; expected a Camera")
    sights = np.array([camera.rays(each) for camera, each in zip(given, image, strict=True)])
    seen = np.isfinite(sights).all(-1)
    centres = np.array([camera.centre for camera in given])
    middle = centres.mean(0)
    across = np.where(seen[..., None, None], np.eye(3) - sights[..., :, None] * sights[..., None, :], 0.0)
    sums = np.einsum("vnij,vj->ni", across, centres - middle)
    start = np.einsum("nij,nj->ni", np.linalg.pinv(across.sum(0), hermitian=True), sums) + middle
    view, point = np.nonzero(seen)
    found = bundle_adjust(
        given, start, (view, point, image[view, point]), fixed_cameras=range(len(given)), covariance="points",
        noise=noise,
    )  # fmt: skip
    is_open = found.point_status == VisionStatus.TOO_FEW
    status = np.where(is_open & (seen.sum(0) > 1), VisionStatus.DEGENERATE, found.point_status)
    known = pixel_noise(np.diag([*np.mean([np.diag(each.intrinsics)[:2] for each in given], 0), 1.0]), noise)
    cost, count = np.bincount(point, found.residuals**2, minlength=len(status)), seen.sum(0)
    for n in np.unique(count[count > 1]):
        some = (count == n) & (status == VisionStatus.OK)
        status[some & known.contradicted(cost, 2 * int(n) - 3)] = VisionStatus.NO_CONSENSUS
    return replace(found, points=np.where(is_open[:, None], np.nan, found.points), point_status=status)


def metric_upgrade(
    model: Factorization, pixels: ArrayLike, camera: Camera | ArrayLike, noise: float | None = None
) -> BundleAdjustment:
    """Compute motors and points, up to their unit of length, from a projective scene (autocalibration).

    In each camera, the image of the absolute quadric is the dual of that of the absolute conic, ``K K'``, of which all
    or all but the focal length is known. This gives linear equations for the quadric, whose factors are the map of
    space to a metric frame (Triggs, *Autocalibration and the absolute quadric*, CVPR 1997). `bundle_adjust` follows.

    Parameters
    ----------
    model : Factorization
        Result of `factorize`.
    pixels : array_like, (v, n, 2)
        What was given to `factorize`; those that are not inliers are not used.
    camera : Camera or array_like, (3, 3) or (2,)
        The camera or matrix K of all views; or the principal point of cameras with square pixels and focal lengths that
        are not known, and may differ. The pose of a `Camera` is not used, and pixels have no distortion.
    noise : float, optional
        The standard deviation of pixels; see `bundle_adjust`.

    Returns
    -------
    BundleAdjustment
        In the frame of the first camera that the model has, with the median distance of points from it as unit.
        Cameras and points that the model does not have are TOO_FEW.

    Raises
    ------
    DegenerateError
        If views determine no metric frame: if there are fewer than three, or if motions leave it open, such as those
        without a rotation.
    TypeError, ValueError
        If shapes differ.
    """
    image = real_array(pixels, "pixels", (-1, -1, 2), "views, points, x y").astype(np.float64)
    if image.shape[:2] != model.inliers.shape:
        raise ValueError(f"pixels: {image.shape[:2]} views and points; expected {model.inliers.shape}, as in the model")
    refuse(model.status if model.status != VisionStatus.TOO_FEW else VisionStatus.OK, "metric_upgrade", "a model")
    views = np.flatnonzero(np.isfinite(model.cameras).all((1, 2)))
    used = model.inliers & np.isfinite(model.points).all(1)
    inner, is_known = _inner_parameters(camera, image[used])
    matrices = np.linalg.solve(inner, model.cameras[views])
    matrices /= np.linalg.norm(matrices, axis=(1, 2), keepdims=True)
    frame = _metric_frame(_absolute_quadric(matrices, is_known))
    with np.errstate(all="ignore"):
        places = np.linalg.solve(frame, model.points.T).T
        places = places[:, :3] / places[:, 3:]
    poses, focals = _poses(matrices @ frame, is_known)
    motors, scales = np.tile(np.eye(8)[0], (len(image), 1)), np.ones(len(image))
    motors[views], places = _in_front(poses, places, used[views])
    scales[views] = focals
    start = [Camera(inner @ np.diag([s, s, 1]), motor) for s, motor in zip(scales, motors, strict=True)]
    known, present = np.asarray(np.isfinite(places).all(1)), np.zeros((len(image), 1), bool)
    present[views] = True
    view, point = np.nonzero(used & known & present)
    return bundle_adjust(
        start, np.where(known[:, None], places, 0.0), (view, point, image[view, point]),
        intrinsics="fixed" if is_known else "each", estimated=None if is_known else ("f",), covariance="points",
        noise=noise,
    )  # fmt: skip


def _inner_parameters(camera: Camera | ArrayLike, pixels: Reals) -> tuple[Reals, bool]:
    """Return a matrix K and whether its focal length is known; otherwise it is of the size of the pixels (k, 2)."""
    if isinstance(camera, Camera):
        camera_matrix(camera, "camera")  # refuses distortion
        return camera.intrinsics, True
    given = np.asarray(real_array(camera, "camera"), np.float64)
    if given.shape == (3, 3):
        return checked_intrinsics(given), True
    if given.shape != (2,):
        raise ValueError(f"camera: shape {given.shape}; expected (3, 3), a matrix K, or (2,), a principal point")
    size = float(np.sqrt(extents(pixels)[1] / max(len(pixels), 1)))
    return np.array([[size, 0, given[0]], [0, size, given[1]], [0, 0, 1]]), False


def _in_front(poses: Reals, places: Reals, used: Reals) -> tuple[Reals, Reals]:
    """Return motors from cameras to the first one, and points, most of them in front, in units of their distance."""
    ahead = (np.einsum("vj,nj->vn", poses[:, 2, :3], places) + poses[:, 2, 3:])[used]
    if np.count_nonzero(ahead < 0) > np.count_nonzero(ahead > 0):
        places, poses = -places, poses * [1, 1, 1, -1]  # the mirror image has the same quadric
    whole = np.tile(np.eye(4), (len(poses), 1, 1))
    whole[:, :3] = poses
    places = places @ poses[0, :, :3].T + poses[0, :, 3]
    unit = float(np.nanmedian(np.linalg.norm(places, axis=1)))
    own = whole[0] @ np.linalg.inv(whole)
    own[:, :3, 3] /= unit
    return np.asarray(pga3.motor_from_matrix(own)), places / unit


def _absolute_quadric(matrices: Reals, is_known: bool) -> Reals:
    """Return the symmetric matrix (4, 4) whose images by cameras (v, 3, 4) are 1, or ``diag(f^2, f^2, 1)``."""
    basis = np.zeros((10, 4, 4))
    for k, (i, j) in enumerate(combinations_with_replacement(range(4), 2)):
        basis[k, i, j] = basis[k, j, i] = 1 if i == j else np.sqrt(0.5)
    images = np.einsum("vij,kjm,vnm->vink", matrices, basis, matrices)
    rows = [images[:, i, j] * np.sqrt(2) for i, j in _PAIRS] + [images[:, 0, 0] - images[:, 1, 1]]
    if is_known:
        rows.append((images[:, 0, 0] + images[:, 1, 1] - 2 * images[:, 2, 2]) / np.sqrt(3))
    equations = np.concatenate(rows)
    if len(equations) < 9:
        refuse(VisionStatus.TOO_FEW, "metric_upgrade", _EXPECTED)
    _, values, right = np.linalg.svd(equations)
    if values[8] <= EIGENVALUE * values[0]:
        refuse(VisionStatus.DEGENERATE, "metric_upgrade", _EXPECTED)
    return np.asarray(np.einsum("k,kij->ij", right[9], basis))


def _metric_frame(quadric: Reals) -> Reals:
    """Return the map (4, 4) from a metric frame to that of the quadric: its factors, and the plane at infinity."""
    values, vectors = np.linalg.eigh(quadric * np.copysign(1.0, np.trace(quadric)))
    order = np.argsort(np.abs(values))
    values, vectors = values[order], vectors[:, order]
    if values[1:].min() <= 0:
        refuse(VisionStatus.DEGENERATE, "metric_upgrade", _EXPECTED)
    return np.concatenate([vectors[:, 1:] * np.sqrt(values[1:]), vectors[:, :1]], 1)


def _poses(cameras: Reals, is_known: bool) -> tuple[Reals, Reals]:
    """Return poses (v, 3, 4) from the metric frame to that of each camera, and focal lengths (v,) in units of K's."""
    lengths = np.linalg.norm(cameras[:, :, :3], axis=2)
    focals = (
        np.ones(len(cameras)) if is_known else np.sqrt((lengths[:, 0] ** 2 + lengths[:, 1] ** 2) / 2) / lengths[:, 2]
    )
    rows = cameras / np.stack([focals, focals, np.ones_like(focals)], 1)[:, :, None]
    u, values, v = np.linalg.svd(rows[:, :, :3])
    signs = np.sign(np.linalg.det(u @ v))
    shifts = rows[:, :, 3] * (signs / values.mean(1))[:, None]
    return np.concatenate([signs[:, None, None] * (u @ v), shifts[:, :, None]], 2), focals
