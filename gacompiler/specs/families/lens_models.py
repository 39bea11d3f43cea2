"""Models of lenses: where a lens shows the normalised coordinates ``x / z, y / z`` of a pinhole camera.

The functions take and return numbers of kernels. Coefficients are in OpenCV's order.
"""

from fractions import Fraction

import gacompiler as ga

N_BROWN, N_FISHEYE = 8, 4
"""Numbers of coefficients of the models."""
TINY = Fraction(1, 10**30)
"""Squares of tangents of angles from the axis are increased by this number, so that derivatives exist on the axis."""


def _polynomial(coefficients, s):
    """Return ``1 + c1 s + c2 s^2 + ...``."""
    value = 0
    for c in reversed(coefficients):
        value = (value + c) * s
    return 1 + value


def _padded(k):
    return (*k, *(0 for _ in range(N_BROWN - len(k))))


def brown_factor(k, s):
    """Return the factor ``(1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)`` of coordinates of square s.

    Coefficients that are left out at the end of `k`, as in `brown`, are 0.
    """
    k1, k2, _, _, k3, k4, k5, k6 = _padded(k)
    above = _polynomial((k1, k2, k3), s)
    return above / _polynomial((k4, k5, k6), s) if len(k) > 5 else above


def brown(x, y, k):
    """Return coordinates after radial and tangential distortion (Brown 1971; with k4 to k6 the rational model).

    Parameters
    ----------
    x, y
        Normalised coordinates.
    k
        Up to eight coefficients ``k1 k2 p1 p2 k3 k4 k5 k6``; those left out at the end are 0.
    """
    _, _, p1, p2, *_ = _padded(k)
    s, xy = x * x + y * y, x * y
    factor = brown_factor(k, s)
    return (
        x * factor + 2 * p1 * xy + p2 * (s + 2 * x * x),
        y * factor + p1 * (s + 2 * y * y) + 2 * p2 * xy,
    )


def fisheye_angle(angle, k):
    """Return the distance from the image centre, ``a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8)``, at an angle a."""
    return angle * _polynomial(tuple(k), angle * angle)


def fisheye_of_direction(x, y, z, k):
    """Return where a fisheye lens shows a direction, whose angle from the axis may exceed a right angle.

    Kannala and Brandt, PAMI 28, 2006, with the angle of the equidistant projection as first term.

    Parameters
    ----------
    x, y, z
        A direction in the camera frame, of any length.
    k
        Up to four coefficients ``k1 k2 k3 k4``.
    """
    square = x * x + y * y
    far = ga.sqrt(square + TINY * z * z)
    scale = fisheye_angle(ga.atan2(far, z), k) / far
    return x * scale, y * scale


def fisheye(x, y, k):
    """Return where a fisheye lens shows normalised coordinates; as `fisheye_of_direction` for (x, y, 1)."""
    return fisheye_of_direction(x, y, 1, k)
