"""What two images of the same points have to do with each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from generated import projective3

from ..arguments import Reals, real_array
from .camera import Camera, camera_matrix

_SAME_CENTRE = 1e-12
"""A baseline shorter than this, of the distance to the origin of the world, is rounding."""


def fundamental_matrix(first: Camera | ArrayLike, second: Camera | ArrayLike) -> Reals:
    """The matrix F with ``x2 . F x1 = 0`` for homogeneous images x1, x2 of the same point, from two cameras.

    Its entries are brackets of rows of the two camera matrices (Faugeras and Mourrain, ICCV 1995).

    Parameters
    ----------
    first, second : Camera or array_like, (..., 3, 4)
        Cameras or camera matrices; leading axes broadcast.

    Returns
    -------
    array, (..., 3, 3)
        Of rank 2, in the scale that the matrices give.

    Raises
    ------
    TypeError, ValueError
        Where these are not cameras, where a matrix has rank less than 3, and where both cameras have the same centre:
        then every F fits.
    """
    one, two = camera_matrix(first, "first"), camera_matrix(second, "second")
    for matrix, other, name in ((one, two, "first"), (two, one, "second")):
        centre = np.linalg.norm(projective3.camera_centre(matrix), axis=-1)
        rows = np.linalg.norm(matrix, axis=-1)
        if np.any(centre <= _SAME_CENTRE * rows.prod(-1)):
            raise ValueError(f"{name}: a camera matrix of rank less than 3; expected one that has a centre")
        epipole = np.abs(projective3.epipole_from_cameras(matrix, other))
        if np.any((epipole <= _SAME_CENTRE * np.linalg.norm(other, axis=-1) * centre[..., None]).all(-1)):
            raise ValueError("first, second: cameras with the same centre; expected two centres")
    return projective3.fundamental_matrix_from_cameras(one, two)  # type: ignore[no-any-return]


def epipolar_lines(fundamental: ArrayLike, pixels: ArrayLike) -> Reals:
    """The lines of the second image on which the partners of pixels of the first lie.

    Parameters
    ----------
    fundamental : array_like, (..., 3, 3)
        As `fundamental_matrix` gives it; transposed, it gives the lines of the first image.
    pixels : array_like, (..., 2)

    Returns
    -------
    array, (..., 3)
        (a, b, c) of ``a x + b y + c = 0``, with any norm; 0 for the epipole.

    Raises
    ------
    TypeError, ValueError
        Where an argument has another shape or type.
    """
    matrix = real_array(fundamental, "fundamental", (3, 3), "a fundamental matrix")
    return projective3.epipolar_line(matrix, _pixels(pixels, "pixels"))  # type: ignore[no-any-return]


def epipolar_distance(fundamental: ArrayLike, pixels: ArrayLike, partners: ArrayLike) -> Reals:
    """The signed distances, in pixels, of partners in the second image to the epipolar lines of pixels of the first.

    Parameters
    ----------
    fundamental : array_like, (..., 3, 3)
    pixels, partners : array_like, (..., 2)
        In the first and in the second image.

    Returns
    -------
    array, (...)

    Raises
    ------
    TypeError, ValueError
        Where an argument has another shape or type.
    """
    matrix = real_array(fundamental, "fundamental", (3, 3), "a fundamental matrix")
    one, two = _pixels(pixels, "pixels"), _pixels(partners, "partners")
    return projective3.distance_to_epipolar_line(matrix, one, two)  # type: ignore[no-any-return]


def triangulate(cameras: Sequence[Camera | ArrayLike], pixels: Sequence[ArrayLike]) -> Reals:
    """The points that two cameras see in given pixels.

    The line of sight in the first camera meets the plane through the centre of the second that stands, in its image,
    across the epipolar line. For pixels with noise it is the point on the first line of sight whose image is nearest
    to the second pixel.

    Parameters
    ----------
    cameras : sequence of Camera or of array_like, (..., 3, 4)
        Two.
    pixels : sequence of array_like, (..., 2)
        One for each camera; leading axes broadcast.

    Returns
    -------
    array, (..., 3)
        World coordinates; not finite where the lines of sight are parallel.

    Raises
    ------
    TypeError, ValueError
        Where there are not two cameras and two arrays of pixels.
    """
    if len(cameras) != 2 or len(pixels) != 2:
        raise ValueError(f"triangulate: {len(cameras)} cameras, {len(pixels)} arrays of pixels; expected 2 and 2")
    one, two = (camera_matrix(camera, f"cameras[{k}]") for k, camera in enumerate(cameras))
    first, second = (_pixels(part, f"pixels[{k}]") for k, part in enumerate(pixels))
    homogeneous: Reals = projective3.triangulate(one, two, first, second)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(homogeneous[..., :3] / homogeneous[..., 3:])


def _pixels(value: ArrayLike, name: str) -> Reals:
    return real_array(value, name, (2,), "x y in pixels")
