"""The equations of essential matrices that fit five pairs of directions, and their elimination to three equations.

Five pairs leave four unknowns, of which three are determined by ten cubic equations (Nister, *An Efficient Solution to
the Five-Point Relative Pose Problem*, PAMI 26, 2004). Equations are orthogonalized by reflections, which need no
exchanges of rows.
"""

from fractions import Fraction
from itertools import product
from typing import Any

from gacompiler import absolute, select, sqrt
from gacompiler.specs.families.covariances import dot

HALF = Fraction(1, 2)
ELIMINATED = (
    (3, 0, 0), (0, 3, 0), (2, 1, 0), (1, 2, 0), (2, 0, 1), (2, 0, 0), (0, 2, 1), (0, 2, 0), (1, 1, 1), (1, 1, 0),
)  # fmt: skip
"""Exponents of x, y, z in the monomials that are eliminated,"""
KEPT = (
    (1, 0, 2), (1, 0, 1), (1, 0, 0), (0, 1, 2), (0, 1, 1), (0, 1, 0), (0, 0, 3), (0, 0, 2), (0, 0, 1), (0, 0, 0),
)  # fmt: skip
"""and in those that are kept, which are linear in x and y."""


def nonzero(x):
    """Return a number, or 1 instead of 0, as a divisor."""
    return select(absolute(x) > 0, x, 1)


class Polynomial:
    """A polynomial in x, y and z with scalars as coefficients."""

    def __init__(self, terms):
        self.terms = terms

    def __add__(self, other):
        merged = dict(self.terms)
        for powers, factor in other.terms.items():
            merged[powers] = merged[powers] + factor if powers in merged else factor
        return Polynomial(merged)

    def __sub__(self, other):
        return self + other.times(-1)

    def __mul__(self, other):
        found: dict[tuple[int, ...], Any] = {}
        for (p, a), (q, b) in product(self.terms.items(), other.terms.items()):
            powers = tuple(i + j for i, j in zip(p, q, strict=True))
            found[powers] = found[powers] + a * b if powers in found else a * b
        return Polynomial(found)

    def times(self, number):
        """Return the product with a scalar."""
        return Polynomial({powers: number * factor for powers, factor in self.terms.items()})


def sum_of(polynomials):
    """Return the sum of polynomials."""
    first, *others = polynomials
    for each_ in others:
        first = first + each_
    return first


def _reflection(column):
    """Return the vector and the factor of the reflection that moves a column to its first axis, and what is there."""
    size = sqrt(dot(column, column))
    first = column[0] + select(column[0] < 0, -size, size)
    square = size * absolute(first)
    inverse = select(square > 0, 1 / select(square > 0, square, 1), 0)
    return (first, *column[1:]), inverse, select(column[0] < 0, size, -size)


def _reflected(column, vector, factor):
    along = factor * dot(column, vector)
    return tuple(x - along * v for x, v in zip(column, vector, strict=True))


def null_space(equations):
    """Return orthonormal vectors that solve equations, as many as there are more unknowns than equations."""
    n, unknowns = len(equations), len(equations[0])
    columns, reflections = [tuple(row) for row in equations], []
    for k in range(n):
        vector, factor, _ = _reflection(columns[k][k:])
        reflections.append((vector, factor))
        columns = [(*c[:k], *_reflected(c[k:], vector, factor)) for c in columns]
    basis = [tuple(int(i == j) for i in range(unknowns)) for j in range(n, unknowns)]
    for k in reversed(range(n)):
        vector, factor = reflections[k]
        basis = [(*b[:k], *_reflected(b[k:], vector, factor)) for b in basis]
    return basis


def constraints(basis):
    """Return the ten cubic equations of essential matrices, as polynomials in the factors of three of four matrices."""
    powers = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)]

    def entry(i, j):
        return Polynomial({p: b[3 * i + j] for p, b in zip(powers, basis, strict=True)})

    e = [[entry(i, j) for j in range(3)] for i in range(3)]
    squares = {(i, j): sum_of(e[i][k] * e[j][k] for k in range(3)) for i in range(3) for j in range(i, 3)}
    half = sum_of(squares[i, i] for i in range(3)).times(HALF)
    table = [[squares[min(i, j), max(i, j)] for j in range(3)] for i in range(3)]
    for i in range(3):
        table[i][i] = table[i][i] - half
    cubic = [sum_of(table[i][k] * e[k][j] for k in range(3)) for i in range(3) for j in range(3)]
    minors = [e[1][a] * e[2][b] - e[1][b] * e[2][a] for a, b in ((1, 2), (2, 0), (0, 1))]
    return [*cubic, sum_of(e[0][k] * minors[k] for k in range(3))]


def eliminated(equations):
    """Return the rows of the last six eliminated monomials, each as the factors of the ten that are kept."""
    columns = [tuple(each_.terms[powers] for each_ in equations) for powers in (*ELIMINATED, *KEPT)]
    for k in range(10):
        vector, factor, first = _reflection(columns[k][k:])
        columns[k] = (*columns[k][:k], first, *(0 for _ in range(9 - k)))
        for j in range(k + 1, 20):
            columns[j] = (*columns[j][:k], *_reflected(columns[j][k:], vector, factor))
    rows: dict[int, tuple[Any, ...]] = {}
    for k in reversed(range(4, 10)):
        scale = 1 / nonzero(columns[k][k])
        rows[k] = tuple(
            scale * (column[k] - sum((columns[m][k] * rows[m][j] for m in range(k + 1, 10)), 0))
            for j, column in enumerate(columns[10:])
        )
    return [rows[k] for k in range(4, 10)]


def pencil(first, second):
    """Return factors of powers of z, in descending order, in ``first - z second``, of x, y and 1."""
    parts = []
    for begin, end in ((0, 3), (3, 6), (6, 10)):
        a, b = first[begin:end], second[begin:end]
        parts.append((-b[0], *(p - q for p, q in zip(a, b[1:], strict=False)), a[-1]))
    return parts


def times(a, b):
    """Return the product of two polynomials of one variable."""
    found = [0] * (len(a) + len(b) - 1)
    for (i, x), (j, y) in product(enumerate(a), enumerate(b)):
        found[i + j] = found[i + j] + x * y
    return found


def minus(a, b):
    """Return the difference of two polynomials of the same degree."""
    return [x - y for x, y in zip(a, b, strict=True)]
