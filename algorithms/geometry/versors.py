"""Versors that take an object to another of its kind: the minimal conformal map, or a similarity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3

from ..arguments import Reals, real_array
from .pairs import KINDS, LAYOUTS


def _parts(kind: str, x: Reals) -> tuple[Reals, Reals, Reals]:
    """Return centre, unit direction or normal, and squared radius."""
    if kind == "sphere":
        return cga3.sphere_centre(x), np.array([0.0, 0.0, 1.0]), cga3.sphere_radius_squared(x)
    if kind == "circle":
        return cga3.circle_centre(x), cga3.circle_normal(x), cga3.circle_radius_squared(x)
    return cga3.point_pair_centre(x), cga3.point_pair_direction(x), cga3.point_pair_radius_squared(x)


def similarity_between(kind: str, a: ArrayLike, b: ArrayLike) -> Reals:
    """Return the similarity that takes a point pair, circle or sphere to another: rotation, scaling, translation.

    The orientation of circles and the order of point pairs are preserved, with the smallest possible rotation. The
    transversion of the result in ``versor_decomposition`` of `generated.cga3` is 0.

    Parameters
    ----------
    kind : {"point pair", "circle", "sphere"}
    a, b : array_like, (..., size of the kind)
        Both real or both imaginary; leading axes broadcast.

    Returns
    -------
    array, (..., 16)
        A versor for the kernels ``transform_...``. NaN if one object is real and the other imaginary, or a radius is 0.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or the kind is not one of those above.
    """
    if kind not in ("point pair", "circle", "sphere"):
        raise ValueError(f"kind: {kind!r}; expected point pair, circle or sphere")
    one, two = (real_array(x, name, (KINDS[kind],), f"a {kind}", LAYOUTS[kind]) for x, name in ((a, "a"), (b, "b")))
    (p, n, r), (q, m, s) = _parts(kind, one), _parts(kind, two)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.sqrt(s / r)
    scale = np.where((scale > 0) & np.isfinite(scale), scale, np.nan)
    versor = cga3.similarity_between_rounds(p, q, n, m, scale)
    return np.where(np.isnan(scale)[..., None], np.nan, versor)


_BETWEEN: dict[str, Callable[[Reals, Reals], Reals]] = {
    "point": lambda a, b: cga3.versor_from_motor(cga3.motor_from_rotor_translation([1.0, 0, 0, 0], b - a)),
    "point pair": lambda a, b: cga3.versor_between_circles(cga3.point_pair_polarity(a), cga3.point_pair_polarity(b)),
    "line": lambda a, b: cga3.versor_from_motor(cga3.motor_between_lines(a, b)),
    "circle": cga3.versor_between_circles,
    "plane": lambda a, b: cga3.versor_from_motor(cga3.motor_between_planes(a, b)),
    "sphere": cga3.versor_between_spheres,
}


def versor_between(kind: str, a: ArrayLike, b: ArrayLike) -> Reals:
    """Return the minimal conformal map that takes `a` to `b`: the square root of the ratio of the two objects.

    For points it is a translation, for lines and planes a motor. The result is NaN if there is no such versor; see
    ``versor_between_circles`` (also for point pairs) and ``versor_between_spheres`` of `generated.cga3`.

    Parameters
    ----------
    kind : str
        A key of `KINDS`.
    a, b : array_like, (..., size of the kind)
        Leading axes broadcast.

    Returns
    -------
    array, (..., 16)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or the kind is unknown.
    """
    if kind not in _BETWEEN:
        raise ValueError(f"kind: {kind!r}; expected {', '.join(KINDS)}")
    one, two = (real_array(x, name, (KINDS[kind],), f"a {kind}", LAYOUTS[kind]) for x, name in ((a, "a"), (b, "b")))
    return np.asarray(_BETWEEN[kind](one, two))
