"""The common points of three quadrics, whose points are (x, y, z) and 1.

Kukelova, Heller and Fitzgibbon, *Efficient intersection of three quadrics and applications in computer vision*, CVPR
2016. A quadric is the coefficients of x^2, y^2, xy, and the polynomials in z of x, y and 1, in ascending powers.
"""

from gacompiler import maximum, sqrt
from gacompiler.specs.families.covariances import choose, cross, dot
from gacompiler.specs.families.essential import nonzero, times
from gacompiler.specs.families.two_views import transposed


def quadric(form):
    """Return the quadric of a bilinear form, a function from two of the four coordinates 1, x, y and z."""

    def pair(i, j):
        return form(i, j) + form(j, i)

    squares = form(1, 1), form(2, 2), pair(1, 2)
    return squares, (
        [pair(0, 1), pair(1, 3)],
        [pair(0, 2), pair(2, 3)],
        [form(0, 0), pair(0, 3), form(3, 3)],
    )


def _sum(*polynomials):
    """Return the sum of polynomials, in ascending powers."""
    n = max(map(len, polynomials))
    return [sum((p[k] for p in polynomials if k < len(p)), 0) for k in range(n)]


def _minus(a, b):
    return _sum(a, [-x for x in b])


def _reduced(factors, constant, tables):
    """Return the polynomials of x, y and 1 in a sum of x^2, y^2 and xy with factors, and of x, y and 1."""
    parts = [[times(f, p) for p in table] for f, table in zip(factors, tables, strict=True)]
    return [_sum(*(part[k] for part in parts), constant[k]) for k in range(3)]


def common_points(quadrics):
    """Return the polynomial in z of degree 8 whose roots are those of the common points of three quadrics.

    Returns
    -------
    coefficients
        Those after the first one, which is 1.
    pencil
        For three equations, the polynomials in z of x, y and 1, in ascending powers: 13 numbers each.
    """
    rows = [squares for squares, _ in quadrics]
    columns = transposed(rows)
    minors = [cross(columns[1], columns[2]), cross(columns[2], columns[0]), cross(columns[0], columns[1])]
    inverse = -1 / nonzero(dot(columns[0], minors[0]))
    # x^2, y^2 and xy as linear functions of x, y and 1.
    a, b, c = (
        [[inverse * dot(minor, [q[1][k][power] for q in quadrics]) for power in range(len(quadrics[0][1][k]))]
         for k in range(3)]
        for minor in minors
    )  # fmt: skip
    nothing = [0]
    tables = a, b, c
    # x (x y) = y x^2, y (x y) = x y^2, and (x y)^2 = x^2 y^2.
    one = _reduced((c[0], [-q for q in a[1]], _minus(c[1], a[0])), (c[2], [-q for q in a[2]], nothing), tables)
    two = _reduced(([-q for q in b[0]], c[1], _minus(c[0], b[1])), ([-q for q in b[2]], c[2], nothing), tables)
    three = _reduced(
        (
            _minus(times(c[0], c[0]), times(a[0], b[0])),
            _minus(times(c[1], c[1]), times(a[1], b[1])),
            _minus([2 * q for q in times(c[0], c[1])], _sum(times(a[0], b[1]), times(a[1], b[0]))),
        ),
        (
            _minus([2 * q for q in times(c[0], c[2])], _sum(times(a[0], b[2]), times(a[2], b[0]))),
            _minus([2 * q for q in times(c[1], c[2])], _sum(times(a[1], b[2]), times(a[2], b[1]))),
            _minus(times(c[2], c[2]), times(a[2], b[2])),
        ),
        tables,
    )  # fmt: skip
    pencil = [one, two, three]
    found = [0]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found = _sum(found, times(pencil[2][i], _minus(times(pencil[0][j], pencil[1][k]),
                                                      times(pencil[0][k], pencil[1][j]))))  # fmt: skip
    scale = 1 / nonzero(found[8])
    sizes = 4, 4, 5
    padded = [
        [x for part, size in zip(row, sizes, strict=True) for x in (*part, *(0 for _ in range(size - len(part))))]
        for row in pencil
    ]
    return tuple(scale * x for x in found[7::-1]), tuple(tuple(row) for row in padded)


def _at(polynomial, x):
    value = polynomial[-1]
    for coefficient in polynomial[-2::-1]:
        value = value * x + coefficient
    return value


def point_of_root(z, pencil):
    """Return 1, x, y and z of a root, times a factor that makes them a unit vector."""
    rows = [tuple(_at(row[begin:end], z) for begin, end in ((0, 4), (4, 8), (8, 13))) for row in pencil]
    best = cross(rows[0], rows[1])
    longest = dot(best, best)
    for i, j in ((0, 2), (1, 2)):
        other = cross(rows[i], rows[j])
        size = dot(other, other)
        best, longest = choose(size > longest, other, best), maximum(size, longest)
    x, y, w = best
    whole = w, x, y, z * w
    size = 1 / nonzero(sqrt(dot(whole, whole)))
    return [size * q for q in whole]
