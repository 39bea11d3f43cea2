"""Euler angles of all twelve sequences, intrinsic or extrinsic, in radians."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from ..elements import ROTOR, elements

SEQUENCES = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz")
"""Sequences of axes. The first six are Tait-Bryan angles, the others proper Euler angles."""

_AXES = dict(zip("xyz", np.eye(3), strict=True))


def rotor_from_euler(sequence: str, angles: ArrayLike, *, fixed_axes: bool = False) -> Reals:
    """Return the rotor of three successive rotations.

    Parameters
    ----------
    sequence : str
        One of `SEQUENCES`, in the order of the rotations.
    angles : array_like, (..., 3)
        In the same order.
    fixed_axes : bool, optional
        Whether the axes are fixed (extrinsic rotations). By default they rotate with the body (intrinsic rotations).

    Returns
    -------
    array, (..., 4)
        1 e12 e13 e23.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or the sequence is unknown.
    """
    axes, given = _axes(sequence), real_array(angles, "angles", (3,), "three angles")
    if fixed_axes:
        axes, given = axes[::-1], given[..., ::-1]
    first, second, third = (axis.astype(given.dtype) for axis in axes)
    return np.asarray(pga3.rotor_from_euler_angles(first, second, third, given))


@elements(rotor=ROTOR)
def rotor_to_euler(sequence: str, rotor: ArrayLike, *, fixed_axes: bool = False) -> Reals:
    """Return the Euler angles of a rotor.

    Parameters
    ----------
    sequence : str
        One of `SEQUENCES`, in the order of the rotations.
    rotor : array_like, (..., 4)
        A unit rotor 1 e12 e13 e23.
    fixed_axes : bool, optional
        Whether the axes are fixed (extrinsic rotations). By default they rotate with the body (intrinsic rotations).

    Returns
    -------
    array, (..., 3)
        The first and third angle are in [-pi, pi], the second in [-pi/2, pi/2] for Tait-Bryan sequences and in [0, pi]
        for others. In gimbal lock, where the second angle is at an end of its interval, only the sum or difference of
        the others is determined: the third angle of an intrinsic or the first angle of an extrinsic sequence is set
        to 0.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or the sequence is unknown.
    """
    first, second, third = _axes(sequence)[::-1] if fixed_axes else _axes(sequence)
    given = real_array(rotor, "rotor", (4,), "a rotor")
    one, two = first.astype(given.dtype), second.astype(given.dtype)
    if np.array_equal(first, third):
        found = pga3.rotor_to_proper_euler_angles(given, one, two)
    else:
        orientation = np.array([1, 1, np.linalg.det([first, second, third])], given.dtype)
        found = pga3.rotor_to_tait_bryan_angles(given, one, two) * orientation
    return np.asarray(found[..., ::-1] if fixed_axes else found)


def matrix_from_euler(sequence: str, angles: ArrayLike, *, fixed_axes: bool = False) -> Reals:
    """Return the 3 x 3 rotation matrix of Euler angles, with the arguments of `rotor_from_euler`."""
    return np.asarray(pga3.rotor_to_matrix(rotor_from_euler(sequence, angles, fixed_axes=fixed_axes)))


def matrix_to_euler(sequence: str, matrix: ArrayLike, *, fixed_axes: bool = False) -> Reals:
    """Return the Euler angles of a 3 x 3 rotation matrix, as defined in `rotor_to_euler`."""
    given = real_array(matrix, "matrix", (3, 3), "a rotation matrix")
    return rotor_to_euler(sequence, pga3.rotor_from_matrix(given), fixed_axes=fixed_axes)


def _axes(sequence: str) -> tuple[Reals, ...]:
    if sequence not in SEQUENCES:
        raise ValueError(f"sequence: {sequence!r}; expected one of {', '.join(SEQUENCES)}")
    return tuple(_AXES[letter] for letter in sequence)
