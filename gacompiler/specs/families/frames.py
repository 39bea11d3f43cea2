"""Frames of vectors in kernels."""

from gacompiler import select


def across(d):
    """Return two unit vectors u and v such that u, v, d are a right-handed orthonormal frame (Duff et al. 2017)."""
    x, y, z = d
    sign = select(z < 0, -1, 1)
    a = -1 / (sign + z)
    b = x * y * a
    return (1 + sign * x * x * a, sign * b, -sign * x), (b, sign + y * y * a, -y)
