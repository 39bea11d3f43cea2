"""The twelve sequences of Euler angles, about moving or about fixed axes. Radians."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array

SEQUENCES = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz")
"""Three axes; the first six are Tait and Bryan's, the others proper Euler angles."""

_AXES = dict(zip("xyz", np.eye(3), strict=True))


def rotor_from_euler(sequence: str, angles: ArrayLike, *, fixed_axes: bool = False) -> Reals:
    """The rotor of three turns.

    Parameters
    ----------
    sequence : str
        One of `SEQUENCES`, in the order in which the turns are done.
    angles : array_like, (..., 3)
        In the same order.
    fixed_axes : bool, optional
        Whether axes stay (extrinsic); by default they turn along (intrinsic).

    Returns
    -------
    array, (..., 4)
        1 e12 e13 e23.

    Raises
    ------
    TypeError, ValueError
        Where an argument has another shape or type, or there is no such sequence.
    """
    axes, given = _axes(sequence), real_array(angles, "angles", (3,), "three angles")
    if fixed_axes:
        axes, given = axes[::-1], given[..., ::-1]
    return np.asarray(pga3.rotor_from_euler_angles(*(axis.astype(given.dtype) for axis in axes), given))


def rotor_to_euler(sequence: str, rotor: ArrayLike, *, fixed_axes: bool = False) -> Reals:
    """The three angles of a rotor.

    Parameters
    ----------
    sequence : str
        One of `SEQUENCES`, in the order in which the turns are done.
    rotor : array_like, (..., 4)
        A unit rotor 1 e12 e13 e23.
    fixed_axes : bool, optional
        Whether axes stay (extrinsic); by default they turn along (intrinsic).

    Returns
    -------
    array, (..., 3)
        The first and third in [-pi, pi], the second in [-pi/2, pi/2] for Tait and Bryan's sequences, else in
        [0, pi]. In gimbal lock, where the second is at an end, only the sum or difference of the others is known: the
        angle of the third axis of a moving sequence, the first of a fixed one, is then 0.

    Raises
    ------
    TypeError, ValueError
        Where an argument has another shape or type, or there is no such sequence.
    """
    first, second, third = _axes(sequence)[::-1] if fixed_axes else _axes(sequence)
    given = real_array(rotor, "rotor", (4,), "a rotor")
    one, two = first.astype(given.dtype), second.astype(given.dtype)
    if np.array_equal(first, third):
        found = pga3.rotor_to_proper_euler_angles(given, one, two)
    else:
        handed = np.array([1, 1, np.linalg.det([first, second, third])], given.dtype)
        found = pga3.rotor_to_tait_bryan_angles(given, one, two) * handed
    return np.asarray(found[..., ::-1] if fixed_axes else found)


def matrix_from_euler(sequence: str, angles: ArrayLike, *, fixed_axes: bool = False) -> Reals:
    """The 3 x 3 matrix of three turns, as `rotor_from_euler` takes them."""
    return np.asarray(pga3.rotor_to_matrix(rotor_from_euler(sequence, angles, fixed_axes=fixed_axes)))


def matrix_to_euler(sequence: str, matrix: ArrayLike, *, fixed_axes: bool = False) -> Reals:
    """The three angles of a 3 x 3 rotation matrix, as `rotor_to_euler` gives them."""
    given = real_array(matrix, "matrix", (3, 3), "a rotation matrix")
    return rotor_to_euler(sequence, pga3.rotor_from_matrix(given), fixed_axes=fixed_axes)


def _axes(sequence: str) -> tuple[Reals, ...]:
    if sequence not in SEQUENCES:
        raise ValueError(f"sequence: {sequence!r}; expected one of {', '.join(SEQUENCES)}")
    return tuple(_AXES[letter] for letter in sequence)
