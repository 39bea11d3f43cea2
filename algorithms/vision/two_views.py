"""The geometry of two views: fundamental matrix, epipoles, epipolar lines and distances."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from generated import projective3

from ..arguments import Reals, check_pixels, real_array
from ..precision import ROUNDING
from .camera import Camera
from .centring import centred_cameras
from .degeneracy import degenerate
from .fundamental import eight_points, refined, seven_points
from .robust_fundamental import robust_fundamental_matrix
from .status import VisionStatus, check_points, one_set, refuse

Method = Literal["8-point", "7-point", "robust"]


def fundamental_matrix(
    first: Camera | ArrayLike,
    second: Camera | ArrayLike,
    method: Method = "8-point",
    *,
    refine: bool = True,
    seed: int = 0,
    noise: float | None = None,
) -> Reals:
    """Return the matrix F with ``x2 . F x1 = 0`` for homogeneous images x1, x2 of the same point.

    From two cameras, its entries are brackets of rows of their matrices (Faugeras and Mourrain, ICCV 1995). From pixels
    of the same points in both images, it is estimated.

    Parameters
    ----------
    first, second : Camera or array_like, (..., 3, 4), (n, 2) or (n, 1, 2)
        Cameras without distortion or camera matrices, whose leading axes broadcast; or pixels without distortion.
    method : {"8-point", "7-point", "robust"}
        The method for pixels: "8-point" is the normalised eight-point algorithm, with n at least 8; "7-point" solves
        the cubic of seven points, with n = 7; "robust" uses samples of seven points, with n at least 8, if some pairs
        are wrong (`robust_fundamental_matrix` also returns which ones).
    refine : bool
        With "8-point", whether to minimise the squares of Sampson distances.
    seed : int
        With "robust", seed of the random samples.
    noise : float, optional
        The standard deviation of pixels, if known; with it, points of a plane are reliably separated from others. By
        default it is estimated from the residuals of F, and for few points from the size of the images.

    Returns
    -------
    array, (..., 3, 3)
        Matrix of rank 2. From cameras, its scale is determined by the matrices; from pixels, its norm is 1. With
        "7-point", (3, 3, 3): one or three matrices, the others NaN.

    Raises
    ------
    TypeError, ValueError
        If the arguments are neither cameras nor pixels of the same points, if a camera matrix has rank less than 3, or
        if both cameras have the same centre, because then every F fits.
    DegenerateError
        If pixels are too few or not finite, or if they are those of points on one plane or line or from one centre.

    Notes
    -----
    The error for exact pixels is about 1e-12 for points well spread in space.

    Pixels are rejected if a homography, or a line, fits them as well as F does: if the mean square of its residuals is
    below the 99.5 % quantile of Fisher's distribution times that of F. F leaves n - 7 residuals, which are unreliable
    if n is small; four residuals of 1.2 thousandths of the extent of the pixels are therefore added. With `noise`, its
    square replaces the estimate, with the quantile 99.9 %, and points are also rejected if all but one are on a plane,
    or if fewer than eight pairs differ by more than noise. Of scenes with a baseline of a quarter of the distance, one
    in a hundred is rejected for n = 8, and at most two in a thousand from n = 12. Of planes, 0.2 % pass with half a
    pixel of noise, 1 to 8 % with one pixel for n = 8, 1 % from n = 9, and 0.3 % with `noise`.
    """
    if not isinstance(first, Camera) and not isinstance(second, Camera) and np.shape(first)[-1:] == (2,):
        return _from_pixels(first, second, method, refine, seed, noise)
    (one, two), place = centred_cameras((first, second), ("first", "second"))
    away = np.linalg.norm(place, axis=-1)
    for matrix, other, name in ((one, two, "first"), (two, one, "second")):
        centre = np.linalg.norm(projective3.camera_centre(matrix), axis=-1)
        rows = np.linalg.norm(matrix, axis=-1)
        if not np.all(centre > ROUNDING * rows.prod(-1)):
            raise ValueError(
                f"{name}: a camera matrix of rank less than 3, or not finite; expected one that has a centre"
            )
        epipole = np.abs(projective3.epipole_from_cameras(matrix, other))
        size = np.linalg.norm(other, axis=-1) + np.linalg.norm(other[..., :3], axis=-1) * away[..., None]
        if np.any((epipole <= ROUNDING * size * centre[..., None]).all(-1)):
            raise ValueError("first, second: cameras with the same centre; expected two centres")
    return projective3.fundamental_matrix_from_cameras(one, two)


def _from_pixels(
    first: ArrayLike, second: ArrayLike, method: Method, refine: bool, seed: int, noise: float | None
) -> Reals:
    one, two = one_set(_pixels(first, "first")), one_set(_pixels(second, "second"))
    if method not in ("8-point", "7-point", "robust"):
        raise ValueError(f"method: {method!r}; expected '8-point', '7-point' or 'robust'")
    check_pixels(noise, "noise")
    where, least = "fundamental_matrix", 7 if method == "7-point" else 8
    expected = f"at least {least} finite points, not on one plane or line, seen from two centres"
    refuse(check_points({"first": one, "second": two}, least, "points"), where, expected)
    if method == "robust":
        found = robust_fundamental_matrix(one, two, seed=seed)
        refuse(found.status, where, expected)
        return found.model
    if method == "7-point":
        if len(one) != 7:
            raise ValueError(f"first: {len(one)} points; expected 7 for the method '7-point'")
        several = seven_points(one, two)
        usable = several[np.isfinite(several).all((-1, -2))]
        if not len(usable) or any(degenerate(each, one, two) for each in usable):
            refuse(VisionStatus.DEGENERATE, where, expected)
        return several
    matrix = eight_points(one, two)
    if refine:
        matrix = refined(matrix, one, two)
    if degenerate(matrix, one, two, noise):
        refuse(VisionStatus.DEGENERATE, where, expected)
    return matrix


def sampson_distance(fundamental: ArrayLike, pixels: ArrayLike, partners: ArrayLike) -> Reals:
    """Return the signed Sampson distances, in pixels, of pairs of pixels from those that fit F exactly.

    Parameters
    ----------
    fundamental : array_like, (..., 3, 3)
    pixels, partners : array_like, (..., 2)
        Points in the first and in the second image.

    Returns
    -------
    array, (...)

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type.
    """
    matrix = real_array(fundamental, "fundamental", (3, 3), "a fundamental matrix")
    return projective3.sampson_distance(matrix, _pixels(pixels, "pixels"), _pixels(partners, "partners"))


def epipoles(fundamental: ArrayLike) -> tuple[Reals, Reals]:
    """Return the images of the second centre in the first view and of the first centre in the second.

    Parameters
    ----------
    fundamental : array_like, (..., 3, 3)

    Returns
    -------
    first, second : array, (..., 3)
        Homogeneous, of norm 1: the null vectors of F and of its transpose. The last component of an epipole at infinity
        is 0.

    Raises
    ------
    TypeError, ValueError
        If `fundamental` is not a matrix of finite numbers with rank 2.
    """
    matrix = real_array(fundamental, "fundamental", (3, 3), "a fundamental matrix")
    if not np.isfinite(matrix).all():
        raise ValueError("fundamental: a number is not finite; expected a matrix of rank 2")
    left, values, right = np.linalg.svd(matrix)
    if np.any(values[..., 1] <= ROUNDING * values[..., 0]) or np.any(values[..., 2] > 1e-3 * values[..., 1]):
        raise ValueError("fundamental: a matrix of another rank; expected rank 2")
    return right[..., 2, :], left[..., :, 2]


def epipolar_lines(fundamental: ArrayLike, pixels: ArrayLike) -> Reals:
    """Return the lines of the second image that contain the partners of pixels of the first image.

    Parameters
    ----------
    fundamental : array_like, (..., 3, 3)
        As returned by `fundamental_matrix`; its transpose gives the lines of the first image.
    pixels : array_like, (..., 2)

    Returns
    -------
    array, (..., 3)
        (a, b, c) of ``a x + b y + c = 0``, with arbitrary norm; 0 for the epipole.

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type.
    """
    matrix = real_array(fundamental, "fundamental", (3, 3), "a fundamental matrix")
    return projective3.epipolar_line(matrix, _pixels(pixels, "pixels"))


def epipolar_distance(fundamental: ArrayLike, pixels: ArrayLike, partners: ArrayLike) -> Reals:
    """Return the signed distances, in pixels, of partners from the epipolar lines of pixels of the first image.

    Parameters
    ----------
    fundamental : array_like, (..., 3, 3)
    pixels, partners : array_like, (..., 2)
        Points in the first and in the second image.

    Returns
    -------
    array, (...)

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type.
    """
    matrix = real_array(fundamental, "fundamental", (3, 3), "a fundamental matrix")
    one, two = _pixels(pixels, "pixels"), _pixels(partners, "partners")
    return projective3.distance_to_epipolar_line(matrix, one, two)


def _pixels(value: ArrayLike, name: str) -> Reals:
    return real_array(value, name, (2,), "x y in pixels").astype(np.float64, copy=False)
