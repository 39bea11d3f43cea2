"""Intrinsic parameters and distortion from views of planes: circular points, and least squares over everything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3, projective2

from ..arguments import Reals
from ..precision import SINGLE
from .camera import Camera, matrix_of
from .distortion import NAMES, Distortion, Model
from .normalization import similarity
from .plane_adjustment import used_parameters, views_of
from .plane_equations import bending_of, closed_form, homographies_of, intrinsics_of_conics, normalizations
from .plane_judgement import Judged, judged, likely_views
from .plane_starts import lens_of_homographies, lens_starts
from .status import VisionStatus

_USUAL: dict[Model, int] = {"brown": 5, "fisheye": 4}
"""Numbers of coefficients that are estimated by default, as by OpenCV."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaneCalibration:
    """Intrinsic parameters estimated from views of planes, and what the views say about them."""

    intrinsics: Reals
    """(3, 3) as in `Camera`; NaN if the status is neither OK nor NOT_CONVERGED."""
    status: VisionStatus
    homographies: Reals
    """(v, 3, 3) from each plane to its view, of norm 1, without distortion."""
    singular_values: Reals
    """Singular values of the equations of the closed form, descending. The last is due to noise; the one before
    measures how much the views differ."""
    residual: float = np.nan
    """The root mean square distance of pixels from the images of the points, in pixels, over the views of `inliers`. If
    there is no camera, the images are those by the homographies."""
    bending: float = np.nan
    """Without `distortion`, the coefficient of the square of the radius, in focal lengths, of the radial distortion
    that the distances from the images by the homographies show."""
    distortion: Distortion | None = None
    """The distortion of the lens, if it was requested and the status is OK or NOT_CONVERGED."""
    parameters: tuple[str, ...] = ()
    """Names of the estimated parameters: ``fx fy cx cy``, ``skew`` if requested, and the coefficients."""
    covariance: Reals = field(default_factory=lambda: np.empty((0, 0)))
    """(p, p) Covariance of the parameters, for independent noise of pixels with the variance that residuals show;
    infinite if there are no more pixels than unknowns. If further terms of distortion, the shape of the planes, or
    motions while rows are read one after the other explain more of the residuals than noise would, it includes by how
    much these would move the parameters."""
    poses: Reals = field(default_factory=lambda: np.empty((0, 8)))
    """(v, 8) Unit motors from the frames of the planes, whose points are ``(x, y, 0)``, to the camera frame."""
    view_residuals: Reals = field(default_factory=lambda: np.empty(0))
    """(v,) The root mean square distance of the pixels of each view, in pixels."""
    inliers: Reals = field(default_factory=lambda: np.empty(0, bool))
    """(v,) bool, whether a view agrees with the others. The other views were not used for the camera."""

    @property
    def camera(self) -> Camera:
        """The camera in its own frame, with its distortion."""
        return Camera(self.intrinsics, np.eye(8)[0], self.distortion)


def calibrate_from_planes(
    planes: ArrayLike | Sequence[ArrayLike],
    views: Sequence[ArrayLike] | Reals,
    skew: bool = False,
    *,
    distortion: Model | None = None,
    n_coefficients: int | None = None,
) -> PlaneCalibration:
    """Estimate the intrinsic parameters and the distortion of a camera from views of known points of planes.

    The squared distances of the pixels from the images of the points are minimised over the intrinsic parameters, the
    coefficients of the distortion and the poses of all planes, by Levenberg and Marquardt's method; the poses are
    eliminated view by view (Schur complement). It starts from a closed form. The homography of a plane maps its
    circular points to ``h1 + i h2`` and its conjugate, which lie on the image of the absolute conic, ``(K K')^-1``:
    each view gives two real equations (as in Zhang 2000, derived differently). With distortion, models with one
    parameter first straighten the pixels: the division model of Fitzgibbon (2001), or the equidistant one.

    Parameters
    ----------
    planes : array_like, (n, 2), or a sequence of (n_k, 2)
        Points of one plane for all views, or of one plane for each view, in any unit.
    views : sequence of array_like, (n_k, 2)
        Their pixels. The numbers of points may differ.
    skew : bool
        Whether entry (0, 1) of K is estimated too. This requires three views, otherwise two suffice.
    distortion : {"brown", "fisheye"}, optional
        The model of the lens, as in `Distortion`. By default, pixels are without distortion.
    n_coefficients : int, optional
        The number of coefficients that are estimated, in the order of the model; the others are 0. The default is five
        for "brown", and four for "fisheye". The rational model has eight.

    Returns
    -------
    PlaneCalibration
        TOO_FEW if there are fewer views than the parameters need, or not more pixel coordinates than parameters.
        DEGENERATE if points of a plane are on a line, if planes are parallel, if the conic is not that of a camera, or
        if the views do not determine a parameter: the information about the parameters is then singular, or 3.3
        standard deviations of 1 / f^2 include 0, or those of the principal point a focal length. NO_CONSENSUS if no
        more than half of the views agree. NOT_CONVERGED if points are beyond the range of the lens, or if the residuals
        contradict the camera: if what `covariance` names explains more of them than it leaves, and than noise would
        with a probability of a thousandth. Without `distortion`, `intrinsics` are then those of the closed form.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points and pixels differ, if `distortion` is not a model, or if `n_coefficients` is not a
        number of its coefficients.

    Notes
    -----
    The noise of a photograph, by blur and light, is known from that of the others as well as by four residuals. A view
    is not used (`inliers`) if its mean square is larger than that explains, or if a homography fits it better. With
    distortion, two to four nearly parallel views may have several minima: of 150 such sets with tilts of 0.01 to 0.5,
    66 are OK, and 2 of these are off by more than 5 standard deviations.
    All 95 accepted of 150 such sets of five to eight views are within 3.4.
    """
    count = _checked_count(distortion, n_coefficients)
    nothing = np.full((3, 3), np.nan)
    matrices, places, pixels, status = homographies_of(planes, views, 3 if skew else 2)
    if status != VisionStatus.OK:
        return PlaneCalibration(nothing, status, matrices, np.empty(0))
    points, centroids = views_of(places, pixels)
    shifts = np.tile(np.eye(3), (len(centroids), 1, 1))
    shifts[:, :2, 2] = centroids
    used = used_parameters(distortion or "brown", skew, count)
    if distortion is None:
        usable = likely_views(points, matrices @ shifts)
        result = _of_pinhole(places, pixels, matrices, usable, skew)
        if result.status != VisionStatus.OK:
            return result
        starts = [lens_of_homographies(result.intrinsics, matrices @ shifts, "brown")]
    else:
        result = PlaneCalibration(nothing, VisionStatus.DEGENERATE, matrices, np.empty(0))
        if 2 * sum(map(len, pixels)) <= len(used) + 6 * len(places):
            return replace(result, status=VisionStatus.TOO_FEW)
        if len({image.tobytes() for image in pixels}) < 2:
            return result
        starts, usable = lens_starts(points, distortion, skew)
    found = judged(starts, points, used, usable)
    return _result(result, found, distortion, count, skew, centroids)


def _of_pinhole(
    places: list[Reals], pixels: list[Reals], matrices: Reals, usable: Reals, skew: bool
) -> PlaneCalibration:
    """Return the camera without distortion in closed form, by the usable views if they suffice."""
    some = np.flatnonzero(usable)
    if len(some) < (3 if skew else 2):
        some = np.arange(len(places))
    own, seen = [places[k] for k in some], [pixels[k] for k in some]
    closed, values = closed_form(matrices[some], similarity(np.concatenate(seen)), normalizations(own), skew)
    result = PlaneCalibration(closed, VisionStatus.DEGENERATE, matrices, values)
    if not np.isfinite(closed).all():
        return result
    bending, residual, status = bending_of(closed, matrices[some], own, seen)
    return replace(result, status=status, bending=bending, residual=residual, inliers=usable)


def _checked_count(distortion: Model | None, n_coefficients: int | None) -> int:
    if distortion is None:
        if n_coefficients is not None:
            raise ValueError(f"n_coefficients: {n_coefficients!r} without a model; expected distortion='brown'")
        return 0
    if distortion not in NAMES:
        raise ValueError(f"distortion: {distortion!r}; expected 'brown', 'fisheye' or None")
    if n_coefficients is None:
        return _USUAL[distortion]
    most = len(NAMES[distortion])
    if isinstance(n_coefficients, bool) or not isinstance(n_coefficients, (int, np.integer)):
        raise TypeError(f"n_coefficients: {n_coefficients!r}; expected a whole number")
    if not 1 <= n_coefficients <= most:
        raise ValueError(f"n_coefficients: {n_coefficients}; expected 1 to {most} for {distortion!r}")
    return int(n_coefficients)


def _result(
    before: PlaneCalibration, found: Judged, distortion: Model | None, count: int, skew: bool, centroids: Reals
) -> PlaneCalibration:
    """Return the result of an adjustment."""
    if found.status not in (VisionStatus.OK, VisionStatus.NOT_CONVERGED) or found.fit is None:
        return replace(before, intrinsics=np.full((3, 3), np.nan), status=found.status, inliers=found.inliers)
    lens = found.fit.lens
    names = ("fx", "fy", "cx", "cy", *(("skew",) if skew else ()), *NAMES[lens.model][:count])
    back = np.zeros((len(centroids), 3))
    back[:, :2] = -centroids
    shifts = pga3.motor_from_rotor_translation(np.eye(4)[0], back)
    return replace(
        before,
        intrinsics=matrix_of(lens.intrinsics),
        status=found.status,
        residual=found.residual,
        distortion=None if distortion is None else Distortion(distortion, tuple(map(float, lens.k[:count]))),
        parameters=names,
        covariance=found.covariance,
        poses=pga3.motor_product(lens.poses, shifts),
        view_residuals=found.view_residuals,
        inliers=found.inliers,
    )


def calibrate_by_pascal(
    planes: ArrayLike | Sequence[ArrayLike], views: Sequence[ArrayLike] | Reals
) -> PlaneCalibration:
    """Estimate the intrinsic parameters of a camera from images of circular points, by Pascal's theorem.

    Every three views give six circular points. Five of them, which are complex, determine the image of the absolute
    conic by brackets; without noise the sixth one completes Pascal's hexagon. The result is the median of the
    parameters over all triples of views and three choices of the omitted point (Bayro-Corrochano, *Geometric
    Computing*, 2010, 14.3).

    Parameters
    ----------
    planes, views
        As for `calibrate_from_planes`, with at least three views.

    Returns
    -------
    PlaneCalibration
        The skew is estimated. The singular values are the magnitudes of Pascal's bracket for all triples of views,
        ascending, for points of norm 1: 0 without noise. The status is DEGENERATE if no triple gives a camera, and
        NOT_CONVERGED as for `calibrate_from_planes`.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points and pixels differ.
    """
    nothing = np.full((3, 3), np.nan)
    matrices, places, pixels, status = homographies_of(planes, views, 3)
    if status != VisionStatus.OK:
        return PlaneCalibration(nothing, status, matrices, np.empty(0))
    scale = similarity(np.concatenate(pixels))
    circular = scale @ (matrices[:, :, 0] + 1j * matrices[:, :, 1])[..., None]
    points = circular[..., 0] / np.linalg.norm(circular[..., 0], axis=-1, keepdims=True)
    triples = points[np.array(list(combinations(range(len(points)), 3)))]
    hexagons = np.stack([triples, triples.conj()], -2).reshape(len(triples), 6, 3)
    defects = np.sort(np.abs(projective2.pascal_bracket(hexagons)))
    cyclic = np.concatenate([np.roll(hexagons, 2 * k, axis=1) for k in range(3)])
    conics = projective2.conic_from_points(cyclic[:, :5])
    sizes = np.linalg.norm(conics, axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        conics = conics / sizes
        # The conic is real up to a factor: the one that makes the sum of its squares positive.
        phase = np.sqrt((conics**2).sum(-1, keepdims=True))
        real = (conics * (phase.conj() / np.abs(phase))).real
    usable = np.isfinite(real).all(-1) & (sizes[:, 0] > SINGLE**2)
    found = intrinsics_of_conics(real[usable], scale)
    found = found[np.isfinite(found).all((1, 2))]
    if not len(found):
        return PlaneCalibration(nothing, VisionStatus.DEGENERATE, matrices, defects)
    intrinsics = np.median(found, axis=0)
    bending, residual, status = bending_of(intrinsics, matrices, places, pixels)
    return PlaneCalibration(intrinsics, status, matrices, defects, residual, bending)
