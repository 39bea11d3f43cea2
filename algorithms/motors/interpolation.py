"""Interpolation of motors. Of ``m`` and ``-m`` the nearer one is used, so that signs do not matter."""

from __future__ import annotations

from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3, vga3

from ..arguments import Reals, real_array
from ..elements import MOTOR, ROTOR, E, Some, elements


@overload
def slerp(a: E, b: E, t: ArrayLike) -> E: ...
@overload
def slerp(a: ArrayLike, b: ArrayLike, t: ArrayLike) -> Reals: ...
@elements(ROTOR, a=ROTOR, b=ROTOR)
def slerp(a: Any, b: Any, t: ArrayLike) -> Any:
    """Interpolate from rotor `a` to rotor `b` at constant angular velocity along the shorter arc.

    Parameters
    ----------
    a, b : array_like, (..., 4)
        Unit rotors 1 e12 e13 e23; leading axes broadcast.
    t : array_like, (...)
        Parameters of any size: 0 gives `a`, 1 gives `b` or ``-b``.

    Returns
    -------
    array, (..., 4)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type.
    """
    one, two = real_array(a, "a", (4,), "a rotor"), real_array(b, "b", (4,), "a rotor")
    return np.asarray(vga3.interpolate_rotors(one, two, real_array(t, "t")))


@overload
def sclerp(a: E, b: E, t: ArrayLike) -> E: ...
@overload
def sclerp(a: ArrayLike, b: ArrayLike, t: ArrayLike) -> Reals: ...
@elements(MOTOR, a=MOTOR, b=MOTOR)
def sclerp(a: Any, b: Any, t: ArrayLike) -> Any:
    """Interpolate from motor `a` to motor `b` by a screw motion with constant twist.

    Parameters
    ----------
    a, b : array_like, (..., 8)
        Unit motors; leading axes broadcast.
    t : array_like, (...)
        Parameters of any size: 0 gives `a`, 1 gives `b` or ``-b``.

    Returns
    -------
    array, (..., 8)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type.
    """
    return np.asarray(pga3.interpolate_motors(_motors(a, "a"), _motors(b, "b"), real_array(t, "t")))


@overload
def nlerp(a: E, b: E, t: ArrayLike) -> E: ...
@overload
def nlerp(a: ArrayLike, b: ArrayLike, t: ArrayLike) -> Reals: ...
@elements(MOTOR, a=MOTOR, b=MOTOR)
def nlerp(a: Any, b: Any, t: ArrayLike) -> Any:
    """Interpolate linearly from motor `a` to motor `b` and project the result onto the Study quadric.

    The result approximates `sclerp` without trigonometric functions. Parameters and results are those of `sclerp`, with
    `t` in [0, 1].
    """
    return np.asarray(pga3.blend_motors(_motors(a, "a"), _motors(b, "b"), real_array(t, "t")))


@overload
def bezier(controls: Some[E], t: ArrayLike) -> E: ...
@overload
def bezier(controls: ArrayLike, t: ArrayLike) -> Reals: ...
@elements(MOTOR, controls=MOTOR)
def bezier(controls: Any, t: ArrayLike) -> Any:
    """Evaluate the Bézier curve of control motors by de Casteljau's algorithm with screw motions.

    The curve starts at the first motor, along the screw motion to the second, and ends at the last motor, along the
    screw motion from the last but one (Shoemake, *SIGGRAPH* 1985, for quaternions).

    Parameters
    ----------
    controls : array_like, (n, 8)
        Unit motors, at least one.
    t : array_like, (...)
        Parameters in [0, 1].

    Returns
    -------
    array, (..., 8)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or there is no motor.
    """
    given, where = real_array(controls, "controls", (-1, 8), "unit motors"), real_array(t, "t")
    if given.ndim != 2 or not len(given):
        raise ValueError(f"controls: shape {given.shape}; expected (any, 8), at least one motor")
    points = np.broadcast_to(given, (*where.shape, *given.shape))
    while points.shape[-2] > 1:
        points = pga3.interpolate_motors(points[..., :-1, :], points[..., 1:, :], where[..., None])
    return np.asarray(points[..., 0, :])


def _motors(value: ArrayLike, name: str) -> Reals:
    return real_array(value, name, (8,), "a motor")
