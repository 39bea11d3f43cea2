"""Uncalibrated views: projective depths, completion of points that one view does not show, and camera centres."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import projective3

from ..arguments import Reals, real_array
from ..precision import ROOT, SINGLE
from .degeneracy import degenerate
from .invariants import invariants_3d, normalized_pair, places_of_two_views
from .linear_cameras import linear_cameras_of
from .normalization import flatness, homogeneous, normalized
from .pose_starts import linear_camera_and_gap
from .status import VisionStatus, check_points, distinct, one_set, refuse
from .two_views import epipoles

_CHOICES = 200
"""Maximum number of sets of five points that are compared to find those farthest from a plane."""


def projective_depths(fundamental: ArrayLike, pixels: ArrayLike, partners: ArrayLike) -> Reals:
    """Return the depths of partners relative to those of pixels, with which the join-image of two views has rank 4.

    The join-image is the matrix of columns ``(x, y, 1)`` of the first view above ``depth (x', y', 1)`` of the second
    (Sturm and Triggs 1996).

    Parameters
    ----------
    fundamental : array_like, (3, 3)
        Fundamental matrix of rank 2.
    pixels, partners : array_like, (..., 2)
        Points in the first and in the second view.

    Returns
    -------
    array, (...)
        Depths up to one factor for all points; infinite or NaN for a partner at the epipole.

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type, or if the matrix does not have rank 2.
    """
    matrix = real_array(fundamental, "fundamental", (3, 3), "a fundamental matrix")
    if matrix.ndim != 2:
        raise ValueError(f"fundamental: shape {matrix.shape}; expected (3, 3), one matrix")
    one, two = real_array(pixels, "pixels", (2,), "x y"), real_array(partners, "partners", (2,), "x y")
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(projective3.depth_ratio(matrix, epipoles(matrix)[1], one, two))


def complete_points(first: ArrayLike, second: ArrayLike, third: ArrayLike, fundamental: ArrayLike) -> Reals:
    """Return the third view, completed with points that the first two views show, by invariants of six points.

    The invariants of a point and five others are its coordinates in their frame (`invariants_3d`). Six or more points
    that all three views show determine the third camera in this frame, which then projects all points.

    Parameters
    ----------
    first, second : array_like, (n, 2)
        Pixels of all points.
    third : array_like, (n, 2)
        NaN where a point is not seen; at least six points are required.
    fundamental : array_like, (3, 3)
        Fundamental matrix of the first two views.

    Returns
    -------
    array, (n, 2)
        `third` with NaN values filled in; without noise, accurate to about 1e-9 pixels.

    Raises
    ------
    TypeError, ValueError
        If the numbers of pixels differ, or if the matrix is not finite.
    DegenerateError
        With TOO_FEW if fewer than six points are in all views, NOT_FINITE if other points are not finite, and
        DEGENERATE if the points in all views are on a plane.
    """
    one, two = real_array(first, "first", (2,), "x y"), real_array(second, "second", (2,), "x y")
    three = real_array(third, "third", (2,), "x y")
    where, expected = "complete_points", "six finite points in all three views, not on a plane"
    refuse(check_points({"first": one, "second": two}, 6, "points"), where, expected)
    seen = np.asarray(~np.isnan(three).any(-1))
    if three.shape == one.shape:
        refuse(VisionStatus.OK if np.isfinite(three[seen]).all() else VisionStatus.NOT_FINITE, where, expected)
    filled = np.where(seen[:, None], three, 0.0)
    refuse(check_points({"first": one, "third": filled}, 6, "points"), where, expected)
    if seen.sum() < 6:
        refuse(VisionStatus.TOO_FEW, where, expected)
    matrix = real_array(fundamental, "fundamental", (3, 3), "a fundamental matrix")
    epipoles(matrix)  # Refuses matrices of another rank.
    known = np.nonzero(seen)[0]
    base = known[_frame(places_of_two_views(*normalized_pair(matrix, one, two))[known], where, expected)]
    rest = np.setdiff1d(np.arange(len(one)), base)
    six = np.array([[*base, k] for k in rest])
    shape = np.empty((len(one), 4))
    shape[base] = np.vstack([np.eye(4), np.ones(4)])
    shape[rest] = homogeneous(invariants_3d(one[six], two[six], fundamental=matrix))
    shape /= np.linalg.norm(shape, axis=-1, keepdims=True)
    scaled, scale = normalized(three[known])
    if not np.isfinite(shape).all() or (len(known) >= 8 and degenerate(matrix, one[known], two[known])):
        refuse(VisionStatus.DEGENERATE, where, expected)
    camera = np.linalg.inv(scale) @ linear_cameras_of(scaled[None], np.ones((1, len(known))), shape[known])[0]
    image = projective3.project_homogeneous_point(camera, shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(seen[:, None], three, image[:, :2] / image[:, 2:]))


def camera_centre(points: ArrayLike, pixels: ArrayLike) -> Reals:
    """Return the centre of a camera of unknown calibration from six or more points that it sees.

    Any cross-ratio of brackets with the centre, ``[C 1 2 3] [C 1 4 5] / ([C 1 2 4] [C 1 3 5])``, equals that of
    brackets of the pixels. The pixels give linear equations for the three planes of the camera, which meet at its
    centre.

    Parameters
    ----------
    points : array_like, (n, 3)
        World coordinates, in general position.
    pixels : array_like, (n, 2) or (n, 1, 2)

    Returns
    -------
    array, (3,)
        World coordinates; not finite for a parallel projection.

    Raises
    ------
    TypeError, ValueError
        If the numbers of points and pixels differ.
    DegenerateError
        If there are too few points, if they are not finite or nearly on a plane, or if the camera is not unique.
    """
    places = one_set(real_array(points, "points", (3,), "x y z"))
    image = one_set(real_array(pixels, "pixels", (2,), "x y"))
    where, expected = "camera_centre", "six finite points and more, not on a plane"
    refuse(check_points({"points": places, "pixels": image}, 6, "points"), where, expected)
    if distinct(places, 6) < 6:
        refuse(VisionStatus.TOO_FEW, where, expected)
    if flatness(places) <= SINGLE or flatness(image) <= SINGLE:
        refuse(VisionStatus.DEGENERATE, where, expected)
    matrix, gap = linear_camera_and_gap(places, image)
    if not gap > ROOT:
        refuse(VisionStatus.DEGENERATE, where, expected)
    centre = projective3.camera_centre(matrix)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(centre[:3] / centre[3])


def _frame(places: Reals, where: str, expected: str) -> Reals:
    """Return five of the homogeneous points (n, 4), no four of which are near a plane."""
    sets = np.array(list(combinations(range(min(len(places), 12)), 5)))
    if len(sets) > _CHOICES:
        sets = sets[np.linspace(0, len(sets) - 1, _CHOICES).astype(int)]
    # Volumes are compared in a frame in which the points have unit second moments.
    spread = np.linalg.cholesky(places.T @ places / len(places) + 1e-15 * np.eye(4))
    even = np.linalg.solve(spread, places.T).T
    even /= np.linalg.norm(even, axis=-1, keepdims=True)
    bracket: Any = projective3.bracket  # mypy takes seconds to compare unpacked arguments with overloads
    volumes = [
        np.abs(bracket(*(np.ascontiguousarray(even[sets[:, k]]) for k in four))) for four in combinations(range(5), 4)
    ]
    least = np.min(volumes, axis=0)
    best = int(np.argmax(np.nan_to_num(least, nan=-1.0)))
    if not least[best] > SINGLE:
        refuse(VisionStatus.DEGENERATE, where, expected)
    return np.asarray(sets[best])
