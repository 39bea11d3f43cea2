"""Versors that take an object to another of its kind: the minimal conformal map, or a similarity."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, overload

import numpy as np

from generated import cga3
from generated.gac_runtime.annotations import Numbers, Stored

from ..arguments import Reals
from ..elements import Coefficients, E
from .kinds import KINDS, Given, Kind, given, listed, named


def _parts(kind: str, x: Reals) -> tuple[Reals, Reals, Reals]:
    """Return centre, unit direction or normal, and squared radius."""
    if kind == "sphere":
        return cga3.sphere_centre(x), np.array([0.0, 0.0, 1.0]), cga3.sphere_radius_squared(x)
    if kind == "circle":
        return cga3.circle_centre(x), cga3.circle_normal(x), cga3.circle_radius_squared(x)
    return cga3.point_pair_centre(x), cga3.point_pair_direction(x), cga3.point_pair_radius_squared(x)


@overload
def similarity_between(a: E, b: E, /) -> E: ...
@overload
def similarity_between(kind: Kind, a: Numbers | Stored, b: Numbers | Stored, /) -> Coefficients: ...
def similarity_between(*arguments: Any) -> Any:
    """Return the similarity that takes a point pair, circle or sphere to another: rotation, scaling, translation.

    The orientation of circles and the order of point pairs are preserved, with the smallest possible rotation. The
    transversion of the result in ``versor_decomposition`` of `generated.cga3` is 0.

    Parameters
    ----------
    a, b : multivector
        Elements of one kind, or after the name of the kind arrays of shape (..., size of the kind). Both real or both
        imaginary; leading axes broadcast.
    kind : {"point pair", "circle", "sphere"}

    Returns
    -------
    array, (..., 16), or multivector
        A versor for the kernels ``transform_...``. NaN if one object is real and the other imaginary, or a radius is 0.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or the kind is not one of those above.
    """
    one, two = _pair("similarity_between", arguments, ("point pair", "circle", "sphere"))
    (p, n, r), (q, m, s) = _parts(one.kind, one.values), _parts(one.kind, two.values)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.sqrt(s / r)
    scale = np.where((scale > 0) & np.isfinite(scale), scale, np.nan)
    versor = cga3.similarity_between_rounds(p, q, n, m, scale)
    return _versor(one, np.where(np.isnan(scale)[..., None], np.nan, versor))


_BETWEEN: dict[str, Callable[[Reals, Reals], Reals]] = {
    "point": lambda a, b: cga3.versor_from_motor(cga3.motor_from_rotor_translation([1.0, 0, 0, 0], b - a)),
    "point pair": lambda a, b: cga3.versor_between_circles(cga3.point_pair_polarity(a), cga3.point_pair_polarity(b)),
    "line": lambda a, b: cga3.versor_from_motor(cga3.motor_between_lines(a, b)),
    "circle": cga3.versor_between_circles,
    "plane": lambda a, b: cga3.versor_from_motor(cga3.motor_between_planes(a, b)),
    "sphere": cga3.versor_between_spheres,
}


@overload
def versor_between(a: E, b: E, /) -> E: ...
@overload
def versor_between(kind: Kind, a: Numbers | Stored, b: Numbers | Stored, /) -> Coefficients: ...
def versor_between(*arguments: Any) -> Any:
    """Return the minimal conformal map that takes `a` to `b`: the square root of the ratio of the two objects.

    For points it is a translation, for lines and planes a motor. The result is NaN if there is no such versor; see
    ``versor_between_circles`` (also for point pairs) and ``versor_between_spheres`` of `generated.cga3`.

    Parameters
    ----------
    a, b : multivector
        Elements of one kind, or after the name of the kind arrays of shape (..., size of the kind). Leading axes
        broadcast.
    kind : str
        A key of `KINDS`.

    Returns
    -------
    array, (..., 16), or multivector

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or the kind is unknown.
    """
    one, two = _pair("versor_between", arguments, KINDS)
    return _versor(one, np.asarray(_BETWEEN[one.kind](one.values, two.values)))


def _pair(where: str, arguments: tuple[Any, ...], kinds: Iterable[str]) -> tuple[Given, Given]:
    """Return two arguments of one of the given kinds."""
    if len(arguments) == 3:
        kind, *pair = arguments
        one, two = (named(kind, value, name) for value, name in zip(pair, "ab", strict=True))
    else:
        one, two = given(where, arguments, ("a", "b"))
    if one.kind != two.kind or one.kind not in kinds:
        raise ValueError(f"{where}: kinds {one.kind} and {two.kind}; expected two of one kind: {listed([*kinds])}")
    return one, two


def _versor(like: Given, versor: Reals) -> Any:
    return versor if like.element is None else like.element.like(cga3.UNIT_EVEN, versor)
