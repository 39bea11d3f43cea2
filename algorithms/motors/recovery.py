"""Least-squares rotations, rigid motions and similarities between corresponding vectors, frames or points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3, pga3

from ..arguments import Reals, finite, leading_axes, real_array
from ..elements import DIRECTION, MOTOR, POINT, ROTOR, VERSOR, Coefficients, E, Some, elements
from ..precision import CONVERGED, rounding_of


@dataclass(frozen=True, slots=True, eq=False)
class RotorFit:
    """The best rotation, and whether the data determine it."""

    rotor: Coefficients
    """(..., 4) 1 e12 e13 e23, with nonnegative scalar part."""
    residual: Reals
    """(...) The square root of the weighted mean of squared distances."""
    determined: Reals
    """(...) bool. False if the rotation is not unique: all vectors are parallel or zero."""


@dataclass(frozen=True, slots=True, eq=False)
class MotorFit:
    """The best rigid motion, and whether the data determine it."""

    motor: Coefficients
    """(..., 8) With nonnegative scalar part."""
    residual: Reals
    """(...) The square root of the weighted mean of squared distances."""
    determined: Reals
    """(...) bool. False if the motion is not unique: all points are collinear or equal."""


@dataclass(frozen=True, slots=True, eq=False)
class SimilarityFit:
    """The best similarity, and whether the data determine it."""

    versor: Coefficients
    """(..., 16) For the kernels ``transform_...`` of `generated.cga3`: dilation, then rotation, then translation."""
    scale: Reals
    """(...) The factor of the dilation."""
    residual: Reals
    """(...) The square root of the weighted mean of squared distances."""
    determined: Reals
    """(...) bool. False if the similarity is not unique: all points are collinear or equal."""


@elements({"rotor": ROTOR}, a=DIRECTION, b=DIRECTION)
def rotor_from_vectors(a: ArrayLike, b: ArrayLike, weights: ArrayLike | None = None) -> RotorFit:
    """Return the rotation that minimises the weighted sum of squared distances of the rotated `a` to `b`.

    This is Wahba's problem. ``b . (r a ~r)`` is a quadratic form in the four coefficients of the rotor. The solution is
    the eigenvector of the largest eigenvalue of the sum of these forms (Davenport's method; Lasenby, Fitzgerald, Doran
    and Lasenby, *IJCV* 1998). It needs no special case for rotations by 180 degrees, and is never a reflection.

    Parameters
    ----------
    a, b : array_like, (..., n, 3)
        Vectors and their target vectors, of any lengths. Leading axes broadcast.
    weights : array_like, (..., n), optional
        Nonnegative weights with a positive sum. By default all are equal.

    Returns
    -------
    RotorFit

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type or is not finite, there is no vector, a weight is negative or all
        weights are 0.
    """
    one, two, share = _pairs(a, b, weights)
    forms = np.einsum("...n,...nij->...ij", share, pga3.rotation_form(one, two))
    values, vectors = np.linalg.eigh(forms)
    rotor = vectors[..., -1] * np.where(vectors[..., :1, -1] < 0, -1, 1)
    off = two - pga3.move_direction(_motor(rotor)[..., None, :], one)
    sizes = np.sqrt(_mean_square(one, share) * _mean_square(two, share))
    gap = values[..., -1] - values[..., -2]
    least = rounding_of(one, two, part=CONVERGED) * np.where(sizes > 0, sizes, 1)
    return RotorFit(rotor, np.sqrt(_mean_square(off, share)), gap > least)


@overload
def rotor_from_frames(frame: Some[E], image: Some[E]) -> E: ...
@overload
def rotor_from_frames(frame: ArrayLike, image: ArrayLike) -> Reals: ...
@elements(ROTOR, frame=DIRECTION, image=DIRECTION)
def rotor_from_frames(frame: Any, image: Any) -> Any:
    """Return the rotation that takes a frame of three vectors, orthogonal or not, to a rotated copy of it.

    ``1 + sum of image_k frame^k`` with the reciprocal frame, normalised, is that rotor except for rotations by 180
    degrees (Hestenes and Sobczyk; Doran and Lasenby, *Geometric Algebra for Physicists*, 4.3). It is the first of the
    four columns of a quadratic form. All four are used here, so that rotations by 180 degrees are as accurate.

    Parameters
    ----------
    frame, image : array_like, (..., 3, 3)
        Rows are vectors. Leading axes broadcast.

    Returns
    -------
    array, (..., 4)
        The rotor 1 e12 e13 e23, with nonnegative scalar part. NaN if the vectors of the frame are coplanar.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or is not finite.
    """
    rows, images = (
        finite(real_array(value, name, (3, 3), "three vectors as rows"), name)
        for value, name in ((frame, "frame"), (image, "image"))
    )
    leading_axes(("frame", rows.shape[:-2]), ("image", images.shape[:-2]))
    sizes = np.linalg.norm(rows, axis=-1)
    unit = rows / np.where(sizes > 0, sizes, 1)[..., None]
    flat = np.abs(np.linalg.det(unit)) <= rounding_of(rows, part=CONVERGED)
    safe = np.where(flat[..., None, None], np.eye(3, dtype=rows.dtype), rows)
    matrix = np.einsum("...ki,...jk->...ij", images, np.linalg.inv(safe))
    rotor: Reals = pga3.rotor_from_matrix(matrix)
    return np.where(flat[..., None], np.nan, rotor)


@elements({"motor": MOTOR}, a=POINT, b=POINT)
def motor_from_points(a: ArrayLike, b: ArrayLike, weights: ArrayLike | None = None) -> MotorFit:
    """Return the rigid motion that minimises the weighted sum of squared distances of the moved points `a` to `b`.

    This is the rigid Procrustes problem. The motion maps centroid to centroid, and its rotation is that of
    `rotor_from_vectors` for the points relative to their centroids.

    Parameters
    ----------
    a, b : array_like, (..., n, 3)
        Points and their target points. Leading axes broadcast.
    weights : array_like, (..., n), optional
        Nonnegative weights with a positive sum. By default all are equal.

    Returns
    -------
    MotorFit

    Raises
    ------
    TypeError, ValueError
        As in `rotor_from_vectors`.
    """
    one, two, share = _pairs(a, b, weights)
    (start, inner), (end, outer) = _about_centroid(one, share), _about_centroid(two, share)
    fit = rotor_from_vectors(inner, outer, share)
    rotated = pga3.move_direction(_motor(fit.rotor), start)
    motor = pga3.motor_from_rotor_translation(fit.rotor, end - rotated)
    off = two - pga3.move_point(motor[..., None, :], one)
    return MotorFit(motor, np.sqrt(_mean_square(off, share)), fit.determined)


@elements({"versor": VERSOR}, a=POINT, b=POINT)
def similarity_from_points(a: ArrayLike, b: ArrayLike, weights: ArrayLike | None = None) -> SimilarityFit:
    """Return the similarity that minimises the weighted sum of squared distances of the images of points `a` to `b`.

    The rotation is that of `motor_from_points`, since it does not depend on the scale. Scale and translation follow
    from it (Umeyama, *IEEE Transactions on Pattern Analysis and Machine Intelligence* 13:376-380, 1991). The result
    never contains a reflection.

    Parameters
    ----------
    a, b, weights : array_like
        As in `motor_from_points`.

    Returns
    -------
    SimilarityFit
        The versor is NaN if the scale is 0: if all points of `a` or of `b` are equal up to rounding.

    Raises
    ------
    TypeError, ValueError
        As in `rotor_from_vectors`.
    """
    one, two, share = _pairs(a, b, weights)
    (start, inner), (end, outer) = _about_centroid(one, share), _about_centroid(two, share)
    fit = rotor_from_vectors(inner, outer, share)
    rotated = pga3.move_direction(_motor(fit.rotor)[..., None, :], inner)
    size = _mean_square(inner, share)
    scale = np.einsum("...n,...ni,...ni->...", share, rotated, outer) / np.where(size > 0, size, 1)
    off = outer - scale[..., None, None] * rotated
    rotated_start = pga3.move_direction(_motor(fit.rotor), start)
    motor = cga3.motor_from_rotor_translation(fit.rotor, end - scale[..., None] * rotated_start)
    dilator = cga3.dilator_from_scale(np.where(scale > 0, scale, np.nan))
    versor = cga3.even_product(cga3.versor_from_motor(motor), cga3.versor_from_dilator(dilator))
    return SimilarityFit(np.asarray(versor), scale, np.sqrt(_mean_square(off, share)), fit.determined)


def motor_from_objects(
    *,
    points: tuple[ArrayLike, ArrayLike] | None = None,
    lines: tuple[ArrayLike, ArrayLike] | None = None,
    planes: tuple[ArrayLike, ArrayLike] | None = None,
    spheres: tuple[ArrayLike, ArrayLike] | None = None,
    circles: tuple[ArrayLike, ArrayLike] | None = None,
) -> MotorFit:
    """Return the rigid motion that best takes points, directed lines, oriented planes, spheres and circles to others.

    The rotation is that of `rotor_from_vectors` for the directions, the normals, and the points relative to their
    centroids. The translation minimises the sum of the remaining squared errors: distances of points, moments of lines,
    offsets of planes. The result is exact for exact objects. For points only it equals `motor_from_points`.

    Parameters
    ----------
    points : pair of array_like, (..., n, 3), optional
        Points and their target points. Leading axes broadcast.
    lines : pair of array_like, (..., n, 6), optional
        Lines of `generated.pga3` and their target lines. They are normalised, so that all have the same weight.
    planes : pair of array_like, (..., n, 4), optional
        Planes of `generated.pga3` and their target planes, likewise normalised.
    spheres : pair of array_like, (..., n, 5), optional
        Spheres of `generated.cga3`, each represented by its centre. Radii are not compared.
    circles : pair of array_like, (..., n, 10), optional
        Oriented circles of `generated.cga3`, each represented by its centre and by the line through it along its
        normal.

    Returns
    -------
    MotorFit
        The residual is the square root of the sum of these squared errors divided by the number of objects.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type or is not finite, or there is no object.
    """
    sizes = {"points": 3, "lines": 6, "planes": 4, "spheres": 5, "circles": 10}
    given = dict(zip(sizes, (points, lines, planes, spheres, circles), strict=True))
    known = {name: _both(pair, name, sizes[name]) for name, pair in given.items() if pair is not None}
    if not sum(one.shape[-2] for one, _ in known.values()):
        raise ValueError("points, lines, planes, spheres, circles: none; expected at least one object")
    _take_rounds(known)
    leading = leading_axes(*((name, each.shape[:-2]) for name, pair in known.items() for each in pair))
    for name, (one, two) in known.items():
        known[name] = _spread_over(leading, one), _spread_over(leading, two)
    vectors = [_directions(name, *pair) for name, pair in known.items()]
    fit = rotor_from_vectors(*(np.concatenate([pair[k] for pair in vectors], -2) for k in (0, 1)))
    rotation = _motor(fit.rotor)[..., None, :]
    parts = [_translation_equations(name, rotation, *pair) for name, pair in known.items()]
    matrix, rest = (np.concatenate([part[k] for part in parts], -1 - (k == 0)) for k in (0, 1))
    translation = (np.linalg.pinv(matrix) @ rest[..., None])[..., 0]
    off = rest - (matrix @ translation[..., None])[..., 0]
    values = np.linalg.svd(matrix, compute_uv=False)
    full = values[..., -1] > CONVERGED * values[..., 0] if values.shape[-1] == 3 else np.zeros(leading, bool)
    count = sum(one.shape[-2] for one, _ in known.values())
    motor = pga3.motor_from_rotor_translation(fit.rotor, translation)
    return MotorFit(motor, np.sqrt(np.sum(off * off, -1) / count), fit.determined & full)


def _take_rounds(known: dict[str, tuple[Reals, Reals]]) -> None:
    """Replace spheres and circles by the points and lines that represent them."""
    further: list[tuple[str, tuple[Reals, Reals]]] = []
    if "spheres" in known:
        one, two = known.pop("spheres")
        further.append(("points", (cga3.sphere_centre(one), cga3.sphere_centre(two))))
    if "circles" in known:
        pair = known.pop("circles")
        places = tuple(cga3.circle_centre(each) for each in pair)
        lines = (
            pga3.join_point_direction(place, cga3.circle_normal(each)) for place, each in zip(places, pair, strict=True)
        )
        one, two = (pga3.normalize_line(line) for line in lines)
        further += [("points", (places[0], places[1])), ("lines", (one, two))]
    for name, (one, two) in further:
        if name not in known:
            known[name] = one, two
            continue
        leading = np.broadcast_shapes(*(each.shape[:-2] for each in (one, *known[name])))
        known[name] = (
            np.concatenate([_spread_over(leading, known[name][0]), _spread_over(leading, one)], -2),
            np.concatenate([_spread_over(leading, known[name][1]), _spread_over(leading, two)], -2),
        )


def _spread_over(leading: tuple[int, ...], rows: Reals) -> Reals:
    return np.broadcast_to(rows, leading + rows.shape[-2:])


def _both(pair: tuple[ArrayLike, ArrayLike], name: str, size: int) -> tuple[Reals, Reals]:
    one, two = (finite(real_array(each, name, (-1, size), f"{name} as rows"), name) for each in pair)
    leading_axes((f"{name}[0]", one.shape[:-2]), (f"{name}[1]", two.shape[:-2]))
    if one.shape[-2] != two.shape[-2]:
        raise ValueError(f"{name}: {one.shape[-2]} and {two.shape[-2]} objects; expected equal numbers")
    if name in ("points", "spheres", "circles"):
        return one, two
    unit = pga3.normalize_line if name == "lines" else pga3.normalize_plane
    return unit(one), unit(two)


def _directions(name: str, one: Reals, two: Reals) -> tuple[Reals, Reals]:
    """Return direction vectors of objects, and of their targets."""
    if name == "points":
        share = np.full(one.shape[-2], 1 / max(one.shape[-2], 1))
        return _about_centroid(one, share)[1], _about_centroid(two, share)[1]
    parts = pga3.line_to_direction_moment if name == "lines" else pga3.plane_to_normal
    return parts(one)[0], parts(two)[0]


def _translation_equations(name: str, rotation: Reals, one: Reals, two: Reals) -> tuple[Reals, Reals]:
    """Return the matrix and the right-hand side of linear equations for the translation."""
    if name == "planes":
        (_, before), (normal, after) = pga3.plane_to_normal(pga3.move_plane(rotation, one)), pga3.plane_to_normal(two)
        return normal, after - before
    if name == "points":
        rows, rest = np.broadcast_to(np.eye(3), (*one.shape, 3)), two - pga3.move_point(rotation, one)
    else:  # the moment of a line is the cross product of its direction with minus any of its points
        (direction, moment), (_, wanted) = (
            pga3.line_to_direction_moment(each) for each in (pga3.move_line(rotation, one), two)
        )
        rows, rest = np.cross(np.eye(3), direction[..., None, :]).swapaxes(-1, -2), wanted - moment
    return rows.reshape(*one.shape[:-2], -1, 3), rest.reshape(*one.shape[:-2], -1)


def _pairs(a: ArrayLike, b: ArrayLike, weights: ArrayLike | None) -> tuple[Reals, Reals, Reals]:
    """Return both sets of vectors, and weights with sum 1."""
    one, two = (
        finite(real_array(value, name, (-1, 3), "vectors as rows"), name) for value, name in ((a, "a"), (b, "b"))
    )
    count = one.shape[-2]
    if not count or two.shape[-2] != count:
        raise ValueError(f"a, b: {count} and {two.shape[-2]} vectors; expected equal numbers, at least one")
    share = real_array(np.ones(count) if weights is None else weights, "weights", (count,), "a weight for each pair")
    leading_axes(("a", one.shape[:-2]), ("b", two.shape[:-2]), ("weights", share.shape[:-1]))
    total = share.sum(-1, keepdims=True)
    if np.any(share < 0) or np.any(total <= 0) or not np.all(np.isfinite(total)):
        raise ValueError("weights: expected finite nonnegative numbers with a positive sum")
    return one, two, share / total


def _about_centroid(points: Reals, share: Reals) -> tuple[Reals, Reals]:
    """Return the centroid, (..., 3), and the points relative to it, 0 if all are equal up to rounding."""
    centroid = np.einsum("...n,...ni->...i", share, points)
    left = points - centroid[..., None, :]
    more = np.einsum("...n,...ni->...i", share, left)  # corrects rounding of the sum over many points
    left -= more[..., None, :]
    least = (8 * np.finfo(points.dtype).eps) ** 2 * _mean_square(points, share)
    return centroid + more, np.where((_mean_square(left, share) <= least)[..., None, None], 0, left)


def _motor(rotor: Reals) -> Reals:
    return np.concatenate([rotor, np.zeros_like(rotor)], -1)


def _mean_square(vectors: Reals, share: Reals) -> Reals:
    return np.asarray(np.einsum("...n,...ni,...ni->...", share, vectors, vectors))
