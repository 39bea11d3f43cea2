"""Projective invariants: cross-ratios, and invariants of points in space from uncalibrated views."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from generated import projective2, projective3

from ..arguments import Reals, finite_number, real_array
from .centring import centred_points
from .normalization import homogeneous, normalized, similarity
from .tensors import cameras_of_tensor

Method = Literal["points", "joins"]
_PENCILS = [[k, *(m for m in range(5) if m != k)] for k in range(5)]
_DIMENSION = {4: 1, 5: 2, 6: 3}
_KERNEL: dict[int, Callable[..., Any]] = {
    4: projective2.cross_ratio_on_line,
    5: projective2.cross_ratio_of_lines,
    6: projective3.cross_ratio_of_planes,
}


def cross_ratio(points: ArrayLike) -> Reals:
    """Return the cross-ratio ``{a, b; c, d} = [a c] [b d] / ([a d] [b c])`` by brackets.

    It is the cross-ratio of four points of a line, of the lines from the first of five points of a plane to the others,
    or of the planes through the first two of six points of space and each of the others.

    Parameters
    ----------
    points : array_like, (..., d + 3, d) or (..., d + 3, d + 1)
        Points in dimension d = 1, 2 or 3, Euclidean or homogeneous; the number of points determines the dimension.

    Returns
    -------
    array, (...)
        Infinite if a bracket in the denominator vanishes, NaN if one in the numerator vanishes too.

    Raises
    ------
    TypeError, ValueError
        If `points` is not an array of four, five or six points with that many coordinates.
    """
    array = real_array(points, "points", (-1, -1), "4, 5 or 6 points")
    n, size = array.shape[-2:]
    if n not in _DIMENSION or size not in (_DIMENSION[n], _DIMENSION[n] + 1):
        raise ValueError(
            f"points: shape {array.shape}; expected (..., 4, 1), (..., 5, 2) or (..., 6, 3), or one coordinate more"
        )
    array = homogeneous(centred_points(array)) if size == _DIMENSION[n] else array
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(_KERNEL[n](array))


def permutation_invariant(ratio: ArrayLike) -> Reals:
    """Return an invariant of the cross-ratio that does not depend on the order of the four points.

    ``J = (2r^6 - 6r^5 + 9r^4 - 8r^3 + 9r^2 - 6r + 2) / (r^6 - 3r^5 + 3r^4 - r^3 + 3r^2 - 3r + 1)`` (Meer, Lenz and
    Ramakrishna, *IJCV* 26:137, 1998).

    Parameters
    ----------
    ratio : array_like, (...)
        Cross-ratios, which may be infinite.

    Returns
    -------
    array, (...)
        Between 2 and 14/5.

    Raises
    ------
    TypeError, ValueError
        If `ratio` is not an array of real numbers.
    """
    r = real_array(ratio, "ratio")
    # J is the same at 1/r, which is smaller in magnitude.
    with np.errstate(divide="ignore", invalid="ignore"):
        r = np.where(np.abs(r) > 1, 1 / r, r)
    above = np.polynomial.polynomial.polyval(r, [2, -6, 9, -8, 9, -6, 2])
    return np.asarray(above / np.polynomial.polynomial.polyval(r, [1, -3, 3, -1, 3, -3, 1]))


def p2_invariants(points: ArrayLike) -> Reals:
    """Return five numbers of five points of a plane that are invariant under projective maps and permutations.

    They are the `permutation_invariant` of the cross-ratio of the four lines from each of the points to the others,
    sorted (Meer, Lenz and Ramakrishna, *IJCV* 26:137, 1998).

    Parameters
    ----------
    points : array_like, (..., 5, 2) or (..., 5, 3)
        Euclidean or homogeneous points, for example directions of points from an omnidirectional camera.

    Returns
    -------
    array, (..., 5)
        Between 2 and 14/5, ascending; NaN, at the end, if a point and two others are on a line.

    Raises
    ------
    TypeError, ValueError
        If `points` is not an array of five points.
    """
    array = real_array(points, "points", (5, -1), "five points")
    if array.shape[-1] not in (2, 3):
        raise ValueError(f"points: shape {array.shape}; expected (..., 5, 2) or (..., 5, 3)")
    return np.sort(each_pencil(homogeneous(centred_points(array)) if array.shape[-1] == 2 else array), axis=-1)


def each_pencil(points: Reals) -> Reals:
    """Return the permutation invariant about each of five homogeneous points."""
    permuted = np.stack([points[..., _PENCILS[k], :] for k in range(5)], -3)
    return permutation_invariant(_quotients(projective2.cross_ratio_of_lines, permuted))


def invariants_3d(
    *points: ArrayLike,
    fundamental: ArrayLike | None = None,
    tensor: ArrayLike | None = None,
    method: Method = "points",
) -> Reals:
    """Return three projective invariants of six points in space: coordinates of the last in a frame of the others.

    They are computed from the points themselves, from two views and their fundamental matrix, or from three views and
    their trifocal tensor. No calibration is needed, and the results are equal.

    Parameters
    ----------
    *points : array_like, (..., 6, 3) or (..., 6, 4); or two or three arrays, (..., 6, 2)
        Points in space, Euclidean or homogeneous; or their pixels in each view.
    fundamental : array_like, (..., 3, 3)
        For two views, as returned by `fundamental_matrix`.
    tensor : array_like, (3, 3, 3)
        For three views, as returned by `trifocal_tensor`.
    method : {"points", "joins"}
        The method for views. "points" uses brackets of the points in which lines of sight meet, in any frame of space
        compatible with the matrix or tensor. "joins" uses brackets of lines that join image points (Bayro-Corrochano,
        *Geometric Computing*, 2010, 14.5), which need no frame. Both agree without noise; with noise, "points" is
        about 2.5 times as accurate.

    Returns
    -------
    array, (..., 3)
        Cross-ratios of planes about edges of the tetrahedron of the first four points: 1 if these are on a plane,
        infinite or NaN if a bracket in the denominator vanishes or a number of the input is not finite.

    Raises
    ------
    TypeError, ValueError
        If the arrays are not points or pixels of six points, or if the matrix or tensor for the views is missing.

    Notes
    -----
    Rounding of the pixels alone, with about 300 units each, changes the invariants of random points and cameras by
    1e-15 (median) to 1e-12 (one of 500) and more, if a bracket in the denominator is small or a line of sight nearly
    passes through the other centre; `invariants_3d_deviation` estimates this. With "points" the error is 1.6 times as
    large (median) and 5 times in one of ten cases: below 1e-12 for 99.7 % from two views and for 99.9 % from three.
    With "joins" it is below 1e-12 for 97 %, because joins that nearly pass through an epipole are ill-conditioned too.
    """
    if method not in ("points", "joins"):
        raise ValueError(f"method: {method!r}; expected 'points' or 'joins'")
    if len(points) == 1:
        array = real_array(points[0], "points", (6, -1), "six points")
        if array.shape[-1] not in (3, 4):
            raise ValueError(f"points: shape {array.shape}; expected (..., 6, 3) or (..., 6, 4)")
        if fundamental is not None or tensor is not None:
            raise ValueError("invariants_3d: points of space and a tensor of views; expected one of both")
        places = homogeneous(centred_points(array)) if array.shape[-1] == 3 else array
        return _quotients(projective3.invariants_of_points, places)
    views = [real_array(each, f"points[{k}]", (6, 2), "six pixels") for k, each in enumerate(points)]
    if len(views) == 2:
        if fundamental is None:
            raise ValueError("fundamental: left out; expected the matrix of the two views")
        matrix = real_array(fundamental, "fundamental", (3, 3), "a fundamental matrix")
        if not np.isfinite(matrix).all() or not matrix.any((-1, -2)).all():
            raise ValueError("fundamental: a number is not finite, or all are 0; expected a matrix of rank 2")
        pair = normalized_pair(matrix, *views)
        if method == "joins":
            return _quotients(projective3.invariants_of_two_views, *pair)
        return _quotients(projective3.invariants_of_points, places_of_two_views(*pair))
    if len(views) != 3:
        raise ValueError(f"invariants_3d: {len(points)} arrays; expected 1 of points or 2 or 3 of pixels")
    if tensor is None:
        raise ValueError("tensor: left out; expected the trifocal tensor of the three views")
    array = real_array(tensor, "tensor", (3, 3, 3), "a trifocal tensor")
    if array.ndim != 3 or not np.isfinite(array).all():
        raise ValueError(f"tensor: shape {array.shape}; expected (3, 3, 3), one tensor of finite numbers")
    return _three_views(array, views, method)


def invariants_3d_deviation(
    *views: ArrayLike,
    fundamental: ArrayLike | None = None,
    tensor: ArrayLike | None = None,
    noise: float = 1.0,
) -> Reals:
    """Return the effect of pixel noise on `invariants_3d`, which limits how well six points can be distinguished.

    Parameters
    ----------
    *views : two or three arrays, array_like, (..., 6, 2)
    fundamental, tensor : array_like
        As in `invariants_3d`; assumed exact.
    noise : float
        Standard deviation of each coordinate of a pixel. With the standard deviation of rounding, 1e-16 of the size of
        pixels, the result is the error that no method can avoid.

    Returns
    -------
    array, (..., 3)
        Standard deviations of the invariants to first order, from differences; infinite or NaN if an invariant is.

    Raises
    ------
    TypeError, ValueError
        As in `invariants_3d`, and if `noise` is negative or not finite.
    """
    size = finite_number(noise, "noise")
    if size < 0:
        raise ValueError(f"noise: {noise}; expected 0 pixels or more")
    arrays = [np.asarray(real_array(each, f"views[{k}]", (6, 2), "six pixels"), float) for k, each in enumerate(views)]
    if len(arrays) not in (2, 3):
        raise ValueError(f"invariants_3d_deviation: {len(arrays)} arrays; expected pixels of 2 or 3 views")
    total: Reals = np.zeros(3)
    with np.errstate(invalid="ignore"):
        steps = [1e-6 * np.std(each, axis=(-1, -2), keepdims=True) for each in arrays]
    for k, point, axis in np.ndindex(len(arrays), 6, 2):
        moved = np.zeros((6, 2))
        moved[point, axis] = 1
        more, less = (
            invariants_3d(
                *arrays[:k],
                arrays[k] + sign * steps[k] * moved,
                *arrays[k + 1 :],
                fundamental=fundamental,
                tensor=tensor,
            )
            for sign in (1, -1)
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            total = total + ((more - less) / (2 * steps[k][..., 0])) ** 2
    return np.asarray(size * np.sqrt(total))


def _quotients(kernel: Callable[..., Any], *arrays: Reals) -> Reals:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(kernel(*arrays))


def normalized_pair(matrix: Reals, first: Reals, second: Reals) -> tuple[Reals, Reals, Reals]:
    """Return F and pixels in normalised coordinates, which give the same invariants with smaller rounding errors."""
    (one, left), (two, right) = _scaled(first), _scaled(second)
    back, other = np.linalg.inv(left), np.linalg.inv(right)
    return np.swapaxes(other, -1, -2) @ matrix @ back, one, two


def _scaled(pixels: Reals) -> tuple[Reals, Reals]:
    """Return pixels after a similarity, and the similarity; pixels that are not finite do not affect it."""
    good = np.isfinite(pixels).all((-1, -2), keepdims=True)
    _, matrix = normalized(np.where(good, pixels, np.arange(2.0 * pixels.shape[-2]).reshape(-1, 2)))
    return pixels * matrix[..., :1, :1] + matrix[..., None, :-1, -1], matrix


def places_of_two_views(matrix: Reals, first: Reals, second: Reals) -> Reals:
    """Return points (..., 4), of norm 1, in the frame in which the first camera is [I | 0]."""
    matrix = matrix / np.linalg.norm(matrix, axis=(-1, -2), keepdims=True)
    left = np.linalg.svd(matrix)[0][..., :, 2]
    cross = np.cross(left[..., None, :], np.swapaxes(matrix, -1, -2)).swapaxes(-1, -2)
    other = np.concatenate([cross, left[..., None]], -1)
    other = other / np.linalg.norm(other, axis=(-1, -2), keepdims=True)
    return _places(np.broadcast_to(np.eye(3, 4, dtype=other.dtype), other.shape), other, first, second)


def _places(one: Reals, two: Reals, first: Reals, second: Reals) -> Reals:
    places = projective3.triangulate(one[..., None, :, :], two[..., None, :, :], first, second)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(places / np.linalg.norm(places, axis=-1, keepdims=True))


def _three_views(tensor: Reals, views: list[Reals], method: Method) -> Reals:
    """Return the median of the results for all orders of the views, which has less noise than a single order."""
    scaled, maps = [], []
    for view in views:
        finite = view[np.isfinite(view).all(-1)]
        matrix = similarity(finite) if len(finite) else np.eye(3)
        with np.errstate(invalid="ignore"):
            scaled.append(view * matrix[0, 0] + matrix[:2, 2])
        maps.append(matrix)
    cameras = cameras_of_tensor(np.einsum("abc,ai,jb,kc->ijk", tensor, np.linalg.inv(maps[0]), maps[1], maps[2]))
    found = []
    for order in permutations(range(3)):
        one, two, three = (cameras[k] / np.linalg.norm(cameras[k]) for k in order)
        if method == "points":
            # The point on the first line of sight that the second view locates best.
            places = _places(one, two, scaled[order[0]], scaled[order[1]])
            found.append(_quotients(projective3.invariants_of_points, places))
            continue
        array = projective3.trifocal_tensor_from_cameras(one, two, three)
        second, third = projective3.epipole_from_cameras(one, two), projective3.epipole_from_cameras(one, three)
        views_in_order = [scaled[k] for k in order]
        found.append(_quotients(projective3.invariants_of_three_views, array, second, third, *views_in_order))
    with np.errstate(invalid="ignore"):
        return np.asarray(np.median(found, axis=0))
