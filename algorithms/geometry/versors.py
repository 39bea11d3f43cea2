"""Versors that take an object to another of its kind: the least conformal map, or turn, scale and translation alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3

from ..arguments import Reals, real_array
from .pairs import KINDS


def _parts(kind: str, x: Reals) -> tuple[Reals, Reals, Reals]:
    """Centre, unit direction or normal, squared radius."""
    if kind == "sphere":
        return cga3.sphere_centre(x), np.array([0.0, 0.0, 1.0]), cga3.sphere_radius_squared(x)
    if kind == "circle":
        return cga3.circle_centre(x), cga3.circle_normal(x), cga3.circle_radius_squared(x)
    return cga3.point_pair_centre(x), cga3.point_pair_direction(x), cga3.point_pair_radius_squared(x)


def similarity_between(kind: str, a: ArrayLike, b: ArrayLike) -> Reals:
    """The versor that turns, scales and translates a round into another of its kind.

    A circle goes to a circle along with its sense, a point pair with its order; by the smaller rotation. In
    ``versor_decomposition`` of `generated.cga3` its transversion is 0.

    Parameters
    ----------
    kind : {"point pair", "circle", "sphere"}
    a, b : array_like, (..., numbers of the kind)
        Both real or both imaginary; leading axes broadcast.

    Returns
    -------
    array, (..., 16)
        For the kernels ``transform_...``; not a number where one is real and the other imaginary, or a radius is 0.

    Raises
    ------
    TypeError, ValueError
        Where an argument has another shape or type, or the kind is no round.
    """
    if kind not in ("point pair", "circle", "sphere"):
        raise ValueError(f"kind: {kind!r}; expected point pair, circle or sphere")
    one, two = (real_array(x, name, (KINDS[kind],), f"a {kind}") for x, name in ((a, "a"), (b, "b")))
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
    """The versor half way to the ratio of two objects of one kind, which takes `a` to `b`: the least conformal map.

    For points a translation, for lines and planes a motor. What has no such versor gives not a number: see
    ``versor_between_circles`` (whose rules point pairs share) and ``versor_between_spheres`` of `generated.cga3`.

    Parameters
    ----------
    kind : str
        Of `KINDS`.
    a, b : array_like, (..., numbers of the kind)
        Leading axes broadcast.

    Returns
    -------
    array, (..., 16)

    Raises
    ------
    TypeError, ValueError
        Where an argument has another shape or type, or the kind is none.
    """
    if kind not in _BETWEEN:
        raise ValueError(f"kind: {kind!r}; expected {', '.join(KINDS)}")
    one, two = (real_array(x, name, (KINDS[kind],), f"a {kind}") for x, name in ((a, "a"), (b, "b")))
    return np.asarray(_BETWEEN[kind](one, two))
