"""Eigenvalues and eigenvectors of small symmetric matrices, as functions for kernels.

The method uses no iteration on the matrix, no angles and no branches except `select`. A well-separated eigenvalue
determines its eigenvector, and the matrix is deflated to the orthogonal complement of that vector. Repeated eigenvalues
therefore need no special case.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from ..algebra.coefficients import divide
from ..errors import KernelError
from .equations import nonzero
from .operands import check_matrix
from .operations import absolute, maximum, minimum, select, sqrt
from .roots import separated_root

Matrix = Sequence[Sequence[Any]]
Vector = tuple[Any, ...]
HALF = Fraction(1, 2)


def eigenvalues_symmetric(matrix: Matrix) -> Vector:
    """Compute the eigenvalues of a symmetric matrix, in ascending order.

    Parameters
    ----------
    matrix : n rows of n scalars
        n is 2, 3 or 4; only the lower triangle is used.

    Returns
    -------
    n scalars

    Raises
    ------
    KernelError
        If the matrix is not square, or n is not 2, 3 or 4.

    Notes
    -----
    The method is that of `eigenvectors_symmetric`, without the operations that only the eigenvectors need.
    """
    return _solver("eigenvalues_symmetric", matrix)(matrix)[0]


def eigenvectors_symmetric(matrix: Matrix) -> tuple[Vector, tuple[Vector, ...]]:
    """Compute the eigenvalues of a symmetric matrix, in ascending order, and an orthonormal basis of eigenvectors.

    Parameters
    ----------
    matrix : n rows of n scalars
        n is 2, 3 or 4; only the lower triangle is used. Squares of the entries must not overflow.

    Returns
    -------
    values : n scalars
    vectors : n rows of n scalars
        Eigenvectors as columns, in the order of the values, so that ``matrix = vectors diag(values) vectors^T``. Their
        signs are arbitrary, and so is the basis of the eigenspace of a repeated eigenvalue.

    Raises
    ------
    KernelError
        If the matrix is not square, or n is not 2, 3 or 4.

    Notes
    -----
    Errors in double precision, measured over ordinary, graded, equal and nearly equal eigenvalues, are below 3e-15
    times the norm of the matrix for the values, and below 2e-15 for ``vectors^T vectors - 1``. Derivatives exist only
    where the eigenvalues are distinct.

    For n = 3, the eigenvalue farthest from the other two is a root of a cubic, found by Newton's method from a
    polynomial initial guess. Its eigenvector is the largest cross product of two rows of ``matrix - value``, and the
    other two are found in the orthogonal plane (Eberly, *A Robust Eigensolver for 3 x 3 Symmetric Matrices*).

    For n = 4, a symmetric matrix is a multiple of the identity plus the map ``x -> sum M[i][j] e_i x e_j`` of
    quaternions, with a 3 x 3 matrix M and the imaginary units e. With rotors p and q that rotate the first axis to the
    first singular vectors of M, the matrix has two diagonal blocks of two rows in the basis ``p e ~q``.
    """
    return _solver("eigenvectors_symmetric", matrix)(matrix)


def _solver(where: str, matrix: Matrix) -> Callable[[Matrix], tuple[Vector, tuple[Vector, ...]]]:
    solvers = {2: _two_rows, 3: _three_rows, 4: _four_rows}
    check_matrix(f"{where}()", matrix)
    n = len(matrix)
    if n not in solvers or any(len(row) != n for row in matrix):
        raise KernelError(f"{where}()", f"a matrix of {n} rows", "n rows of n scalars, n from 2 to 4")
    return solvers[n]


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    total = a[0] * b[0]
    for x, y in zip(a[1:], b[1:], strict=True):
        total = total + x * y
    return total


def _times(rows: Matrix, vector: Vector) -> Vector:
    return tuple(_dot(row, vector) for row in rows)


def _cross(a: Sequence[Any], b: Sequence[Any]) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _scaled(vector: Vector, factor: Any) -> Vector:
    return tuple(x * factor for x in vector)


def _selected(condition: Any, a: Sequence[Any], b: Sequence[Any]) -> Vector:
    return tuple(select(condition, x, y) for x, y in zip(a, b, strict=True))


def _combined(x: Any, a: Vector, y: Any, b: Vector) -> Vector:
    return tuple(x * p + y * q for p, q in zip(a, b, strict=True))


def _largest(values: Sequence[Any]) -> Any:
    result = absolute(values[0])
    for value in values[1:]:
        result = maximum(result, absolute(value))
    return result


def _columns(vectors: Sequence[Vector]) -> tuple[Vector, ...]:
    return tuple(zip(*vectors, strict=True))


def _block(difference: Any, mixed: Any) -> tuple[Any, Any, Any]:
    """Return half the distance of the eigenvalues of [[d, e], [e, -d]], and the unit eigenvector (c, s) of the larger.

    The half angle is computed from the side without cancellation; for the zero matrix it is 0.
    """
    half = sqrt(difference * difference + mixed * mixed)
    is_first = difference >= 0
    long = half + select(is_first, difference, -difference)
    c, s = select(is_first, long, mixed), select(is_first, mixed, long)
    length = sqrt(c * c + s * s)
    is_zero = length <= 0
    scale = divide(1, select(is_zero, 1, length))
    return half, select(is_zero, 1, c * scale), s * scale


def _two_rows(matrix: Matrix) -> tuple[Vector, tuple[Vector, ...]]:
    (a, _), (b, d) = matrix
    scale = _largest([a, b, d])
    unit = divide(1, nonzero(scale))
    mean, difference, mixed = (a + d) * HALF, (a - d) * unit * HALF, b * unit
    half, c, s = _block(difference, mixed)
    return (mean - half * scale, mean + half * scale), ((-s, c), (c, s))


def _three_rows(matrix: Matrix) -> tuple[Vector, tuple[Vector, ...]]:
    (a, _, _), (d, b, _), (e, f, c) = matrix
    mean = (a + b + c) * Fraction(1, 3)
    a, b, c = a - mean, b - mean, c - mean
    size = sqrt((a * a + b * b + c * c + 2 * (d * d + e * e + f * f)) * Fraction(1, 6))
    unit = divide(1, nonzero(size))
    a, b, c, d, e, f = (x * unit for x in (a, b, c, d, e, f))
    value, vector, (half, first, second) = _deflated(((a, d, e), (d, b, f), (e, f, c)))
    # The other two eigenvalues are on the other side of 0, because the sum of all three is 0.
    low, high = -value * HALF - half, -value * HALF + half
    is_last = value > 0
    values = select(is_last, low, value), select(is_last, high, low), select(is_last, value, high)
    vectors = (
        _selected(is_last, first, vector), _selected(is_last, second, first), _selected(is_last, vector, second),
    )  # fmt: skip
    return tuple(mean + size * x for x in values), _columns(vectors)


def _deflated(matrix: Matrix) -> tuple[Any, Vector, tuple[Any, Vector, Vector]]:
    """Return the separated eigenvalue of a matrix of trace 0 and squared norm 6, its eigenvector, and the other two.

    The last result consists of half the distance of the other two eigenvalues and their eigenvectors, that of the
    smaller eigenvalue first.
    """
    (a, d, e), (_, b, f), (_, _, c) = matrix
    half_determinant = (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)) * HALF
    sign = select(half_determinant < 0, -1, 1)
    value = sign * separated_root(minimum(sign * half_determinant, 1))
    rows = (a - value, d, e), (d, b - value, f), (e, f, c - value)
    vector = _cross(rows[0], rows[1])
    squared = _dot(vector, vector)
    for other in (_cross(rows[0], rows[2]), _cross(rows[1], rows[2])):
        length = _dot(other, other)
        is_longer = squared < length
        vector, squared = _selected(is_longer, other, vector), maximum(squared, length)
    vector = _scaled(vector, divide(1, sqrt(squared)))
    u, v = _plane(vector)
    image = _times(matrix, u)
    half, cosine, sine = _block(_dot(u, image) + value * HALF, _dot(v, image))
    return value, vector, (half, _combined(-sine, u, cosine, v), _combined(cosine, u, sine, v))


def _plane(axis: Vector) -> tuple[Vector, Vector]:
    """Return two unit vectors that are orthogonal to a unit vector and to each other.

    They are the images of the first two axes under the rotation of the third axis, or its opposite, to the vector (Duff
    et al., *Building an Orthonormal Basis, Revisited*, 2017).
    """
    x, y, z = axis
    sign = select(z < 0, -1, 1)
    k = divide(-1, sign + z)
    mixed = x * y * k
    return (1 + sign * x * x * k, sign * mixed, -sign * x), (mixed, sign + y * y * k, -y)


def _four_rows(matrix: Matrix) -> tuple[Vector, tuple[Vector, ...]]:
    (a, _, _, _), (ab, b, _, _), (ac, bc, c, _), (ad, bd, cd, d) = matrix
    mean = (a + b + c + d) * Fraction(1, 4)
    pairing = (
        ((c + d - a - b) * Fraction(1, 4), (ad - bc) * HALF, (-ac - bd) * HALF),
        ((-ad - bc) * HALF, (b + d - a - c) * Fraction(1, 4), (ab - cd) * HALF),
        ((ac - bd) * HALF, (-ab - cd) * HALF, (b + c - a - d) * Fraction(1, 4)),
    )
    size = _largest([entry for row in pairing for entry in row])
    unit = divide(1, nonzero(size))
    pairing = tuple(_scaled(row, unit) for row in pairing)  # type: ignore[assignment]
    left, right, image = _first_singular_vectors(pairing)
    p, left_plane = _rotor(left)
    q, right_plane = _rotor(right)
    value = _dot(left, image)
    (e, f), (g, h) = (
        tuple(_dot(u, column) for column in (_times(pairing, v) for v in right_plane)) for u in left_plane
    )
    lower, upper = _block(-e - h, f - g), _block(h - e, -f - g)
    basis = _rotated_basis(p, q)
    pairs = []
    for sign, (half, cosine, sine), u, v in ((-1, lower, *basis[:2]), (1, upper, *basis[2:])):
        vectors = _combined(-sine, u, cosine, v), _combined(cosine, u, sine, v)
        pairs.append(((sign * value - half, vectors[0]), (sign * value + half, vectors[1])))
    ordered = _merged(*pairs)
    return tuple(mean + size * x for x, _ in ordered), _columns([vector for _, vector in ordered])


def _first_singular_vectors(matrix: Matrix) -> tuple[Vector, Vector, Vector]:
    """Return the left and right singular vectors u and v of the largest singular value, and ``matrix v``.

    Both have a non-negative first coordinate, so the singular value may be negative. For the zero matrix, both are the
    first axis.
    """
    columns = _columns([tuple(row) for row in matrix])
    _, vectors = _three_rows([[_dot(a, b) for b in columns] for a in columns])
    right = tuple(row[2] for row in vectors)
    right = _scaled(right, select(right[0] < 0, -1, 1))
    image = _times(matrix, right)
    length = sqrt(_dot(image, image))
    is_zero = length <= 0
    left = _scaled(image, divide(select(image[0] < 0, -1, 1), select(is_zero, 1, length)))
    return (select(is_zero, 1, left[0]), *left[1:]), right, image


def _rotor(axis: Vector) -> tuple[Vector, tuple[Vector, Vector]]:
    """Return the unit quaternion (w, y, z; x is 0) that rotates the first axis to `axis`, and the other two rotated."""
    x, y, z = axis
    k = divide(1, 1 + x)
    mixed = -y * z * k
    w = sqrt((1 + x) * HALF)
    scale = divide(HALF, w)
    return (w, -z * scale, y * scale), ((-y, 1 - y * y * k, mixed), (-z, mixed, 1 - z * z * k))


def _rotated_basis(p: Vector, q: Vector) -> tuple[Vector, Vector, Vector, Vector]:
    """Return ``p e ~q`` for the units e = 1, i, j, k, for quaternions p and q without a part along i."""
    (ww, wy, wz), (yw, yy, yz), (zw, zy, zz) = (tuple(a * b for b in q) for a in p)
    one = (ww + yy + zz, zy - yz, yw - wy, zw - wz)
    i = (zy - yz, ww - yy - zz, wz + zw, -wy - yw)
    j = (wy - yw, -zw - wz, ww + yy - zz, yz + zy)
    k = (wz - zw, yw + wy, yz + zy, ww - yy + zz)
    return one, i, j, k


def _merged(
    first: Sequence[tuple[Any, Vector]], second: Sequence[tuple[Any, Vector]]
) -> tuple[tuple[Any, Vector], ...]:
    """Merge two ascending pairs of values with their vectors into one ascending sequence."""
    (a, b), (c, d) = first, second
    least, third = _ascending(a, c)
    fourth, greatest = _ascending(b, d)
    return (least, *_ascending(third, fourth), greatest)


def _ascending(a: tuple[Any, Vector], b: tuple[Any, Vector]) -> tuple[tuple[Any, Vector], tuple[Any, Vector]]:
    swap = b[0] < a[0]
    return (
        (minimum(a[0], b[0]), _selected(swap, b[1], a[1])),
        (maximum(a[0], b[0]), _selected(swap, a[1], b[1])),
    )
