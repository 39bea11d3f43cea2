"""Exponentials and logarithms of versors over six to eight vectors in kernels, by matrices and loops.

A unit versor ``R`` acts on vectors by the matrix ``M`` of ``x -> R x ~R``. For a versor with the scalar part ``c`` and
the bivector ``c w``, all other parts follow: ``R = c (1 + w + (w ^ w) / 2 + ...)``, the outer exponential, whose
coefficients are Pfaffians, and ``M = (1 + W) / (1 - W)`` with the matrix ``W`` of ``x -> w x - x w`` divided by two
(Lipschitz; Cayley). Near half turns `c` vanishes. There the same holds for ``R`` divided by a basis blade ``P``, whose
matrix is diagonal. These formulas replace products of elements with 32 to 128 coefficients by products of matrices with
six to eight rows.

*Logarithm.* The blade ``P`` is that of the largest coefficient. The principal logarithm of ``M`` follows from repeated
square roots (Higham, *Functions of Matrices*, 2008, ch. 11). A root of an isometry is the polar factor of ``1 + M``,
found by Newton's method. The differences from 1 are stored, which keeps the relative accuracy of small logarithms. A
half turn in a plane, in which ``M`` is nearly -1, is removed before; that plane is found by the matrix sign function.

*Exponential.* ``exp(b)`` is the square of the versor of the matrix ``exp(B)``, which gives its sign, and has the matrix
``exp(2 B)``.

*Null and oblique bases.* Elements are changed exactly to an orthogonal frame with rational coordinates, and back.

Iterations are loops in emitted text, with the statements of one step of an elimination or one row of a product.
Exponentials and logarithms share most of these loops, and are one file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import reduce
from math import pi
from operator import or_
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.multivector import Multivector
from ..errors import KernelError
from .expression import IN_FUNCTION, Expression
from .loops import iterate_scalars as iterate
from .operations import absolute, assemble, maximum, select, sqrt
from .recording import is_recording
from .squares import form_of
from .unit_frames import LEAST, MOST, Signature, frame_of, signature_of
from .unrolled import is_limited

Vector = tuple[Any, ...]
Matrix = tuple[Vector, ...]

STEPS = 80
"""Most steps of an iteration that doubles the correct digits, after as many steps as a number has binary places."""
SMALL = Fraction(1, 8)
"""Size of ``tanh(L / 2)`` below which eight terms of its inverse's series have the error ``SMALL**16 / 17``."""
TERMS = 8
ROOTS = 64
"""Most square roots for a logarithm, which halve it."""
SCALED = Fraction(1, 2)
"""Size of a matrix for which `TAYLOR` terms of the exponential have an error below ``SCALED**TAYLOR / TAYLOR!``."""
TAYLOR = 14
LARGEST = 1024
HALF = Fraction(1, 2)
CONVERGED = Fraction(1, 2**26)
"""Relative change of a step after which the error, its square, is below rounding."""
NOISE = Fraction(1, 2**44)
"""Squared cosines below this are rounding errors."""
HUGE = 2**1000
"""A number whose square overflows."""
RESIDUAL = Fraction(1, 2**30)
"""Largest difference of a versor's matrix from that of its logarithm, relative to its largest entry."""


def _changed(images: Mapping[int, Multivector], coefficient: Callable[[int], Any]) -> dict[int, Any]:
    """Return the coefficients of an element after a change of basis."""
    terms: dict[int, list[Any]] = {}
    for blade, image in images.items():
        for target, factor in image.terms.items():
            terms.setdefault(target, []).append(factor * coefficient(blade))
    return {target: _sum(values) for target, values in terms.items()}


def has_many_vectors(a: Any) -> bool:
    """Whether functions of an even element in a kernel are those of this file, because no closed form exists."""
    if not isinstance(a, Expression) or (signature_of(a.algebra) is None and frame_of(a.algebra) is None):
        return False
    used = reduce(or_, a.blades, 0)
    bivectors = frozenset(blade for blade in a.algebra.blades(2) if blade & used == blade)
    return all(blade.bit_count() % 2 == 0 for blade in a.blades) and form_of(a.algebra, bivectors) is None


def _signature(where: str, algebra: Algebra) -> Signature:
    frame = frame_of(algebra)
    found = frame.space if frame else signature_of(algebra)
    if found is None:
        raise KernelError(
            where, f"the metric of {algebra.name}", f"{LEAST} to {MOST} orthogonal vectors with the squares 1 and -1"
        )
    if IN_FUNCTION.get() and not is_limited():
        raise KernelError(
            where,
            f"{found.n} basis vectors in a kernel without loops",
            "@kernel(loops=True, ...), which keeps iterations as loops",
            "or call the method of numeric objects",
        )
    return found


def keeps_loops(algebra: Algebra) -> bool:
    """Whether exponentials use matrices: always in an orthogonal basis, otherwise only where loops are kept."""
    return signature_of(algebra) is not None or is_recording() or is_limited()


def versor_logarithm(r: Any) -> Any:
    """Return the bivector with the smallest angles whose exponential is the unit versor `r` or ``-r``, or NaN."""
    frame = frame_of(r.algebra)
    space = _signature("log", r.algebra)
    if frame is None:
        return _bivector(space, _logarithm(space, [r.coefficient_at(blade) for blade in space.blades]))
    values = _changed(frame.to_frame, r.coefficient_at)
    matrix = _logarithm(space, _stored(tuple(values[blade] for blade in space.blades)))
    terms = {1 << i | 1 << j: value for (i, j), value in _bivector_terms(space, _stored(matrix)).items()}
    return _element(r.algebra, _changed(_of_grade_2(frame.from_frame), terms.__getitem__))


def versor_exponential(b: Any) -> Any:
    """Return the exponential of a bivector."""
    frame = frame_of(b.algebra)
    space = _signature("exp", b.algebra)
    pairs = [1 << i | 1 << j for j in range(space.n) for i in range(j)]
    changed = _changed(_of_grade_2(frame.to_frame), b.coefficient_at) if frame else {}
    # The coefficients are read at several places, and can be long expressions of another function's result.
    values = _stored(tuple(changed.get(k, 0) if frame else b.coefficient_at(k) for k in pairs))
    terms = dict(zip(pairs, values, strict=True))
    values = _exponential(space, _matrix_of(space, lambda i, j: terms[1 << i | 1 << j]))
    if frame is None:
        return _even(space, values)
    known = dict(zip(space.blades, values, strict=True))
    return _element(b.algebra, _changed(frame.from_frame, known.__getitem__))


def _of_grade_2(images: Mapping[int, Multivector]) -> dict[int, Multivector]:
    return {blade: image for blade, image in images.items() if blade.bit_count() == 2}


def _element(algebra: Algebra, terms: Mapping[int, Any]) -> Any:
    """Return an element with these coefficients by bitmap."""
    spelled = ((algebra.spelling(blade), value) for blade, value in terms.items())
    return assemble(algebra, {name: sign * value for (sign, name), value in spelled})


def _even(space: Signature, values: Sequence[Any]) -> Any:
    names = (space.algebra.spelling(blade) for blade in space.blades)
    return assemble(space.algebra, {name: sign * x for (sign, name), x in zip(names, values, strict=True)})


def _bivector(space: Signature, matrix: Matrix) -> Any:
    """Return the bivector `b` with the matrix of ``x -> (b x - x b) / 2``; other parts are rounding errors."""
    named = {}
    for (i, j), value in _bivector_terms(space, matrix).items():
        sign, name = space.algebra.spelling(1 << i | 1 << j)
        named[name] = sign * value
    return assemble(space.algebra, named)


def _bivector_terms(space: Signature, matrix: Matrix) -> dict[tuple[int, int], Any]:
    g = space.squares
    return {(i, j): (g[j] * matrix[i][j] - g[i] * matrix[j][i]) * HALF for j in range(space.n) for i in range(j)}


def _matrix_of(space: Signature, coefficient: Callable[[int, int], Any]) -> Matrix:
    """Return the matrix of ``x -> (b x - x b) / 2`` for the bivector with these coefficients."""
    g, n = space.squares, space.n
    return tuple(
        tuple(0 if i == j else g[j] * (coefficient(i, j) if i < j else -coefficient(j, i)) for j in range(n))
        for i in range(n)
    )


# Matrices as loops ------------------------------------------------------------------------------------------------


def _one(n: int) -> Matrix:
    return tuple(tuple(int(i == j) for j in range(n)) for i in range(n))


def _map(function: Callable[..., Any], *matrices: Matrix) -> Matrix:
    return tuple(tuple(map(function, *rows)) for rows in zip(*matrices, strict=True))


def _stored(value: Any) -> Any:
    """Return a value that is stored, so that several loops that use it do not compute it again."""
    return iterate(lambda carry: carry, value, lambda old, new: 1, 1)[0]


def _rows(body: Callable[[Vector], Vector], a: Matrix) -> Matrix:
    """Apply a function to every row in a loop, by moving the first row to the end."""
    n = len(a)

    def step(state: Any) -> Any:
        rows, k = state
        return (*rows[1:], body(rows[0])), k + 1

    found: Matrix = iterate(step, (a, 0), lambda _, new: new[1] >= n, n)[0][0]
    return found


def _product(a: Matrix, b: Matrix) -> Matrix:
    def row(x: Vector) -> Vector:
        return tuple(_sum(x[k] * b[k][j] for k in range(len(b))) for j in range(len(b)))

    return _rows(row, a)


def _sum(values: Any) -> Any:
    total: Any = None
    for each in values:
        total = each if total is None else total + each
    return total


def _inverse(a: Matrix) -> Matrix:
    """Return the inverse by elimination with partial pivoting; the pivot is always in the first row and column."""
    n = len(a)
    start = tuple((*row, *one) for row, one in zip(a, _one(n), strict=True))

    def step(state: Any) -> Any:
        rows, k = list(state[0]), state[1]
        for i in range(1, n):
            # The last k rows have been pivots.
            swap = select(i + k < n, absolute(rows[0][0]) < absolute(rows[i][0]), 0)
            first, other = rows[0], rows[i]
            rows[0] = tuple(select(swap, y, x) for x, y in zip(first, other, strict=True))
            rows[i] = tuple(select(swap, x, y) for x, y in zip(first, other, strict=True))
        scale = 1 / rows[0][0]
        pivot = tuple(x * scale for x in rows[0][1:])
        others = (tuple(x - row[0] * y for x, y in zip(row[1:], pivot, strict=True)) for row in rows[1:])
        return tuple((*row, 0) for row in (*others, pivot)), k + 1

    rows = iterate(step, (start, 0), lambda _, new: new[1] >= n, n)[0][0]
    return tuple(row[:n] for row in rows)


def _adjoint(space: Signature, a: Matrix) -> Matrix:
    """Return the adjoint by the metric, the inverse of an isometry."""
    g, n = space.squares, space.n
    return tuple(tuple(g[i] * g[j] * a[j][i] for j in range(n)) for i in range(n))


def _size(a: Matrix) -> Any:
    """Return the largest sum of absolute values of a row."""
    total: Any = None
    for row in a:
        size = _sum(map(absolute, row))
        total = size if total is None else maximum(total, size)
    return total


def _not_above(x: Any, limit: Any) -> Any:
    """Return whether an iteration may end because a number is small enough, or NaN."""
    return 1 - (limit < x)


def _is_close(old: Matrix, new: Matrix) -> Any:
    return _not_above(_size(_map(lambda x, y: x - y, old, new)), CONVERGED * _size(new))


def _add_identity(a: Matrix, value: Any) -> Matrix:
    return tuple(tuple(x + value if i == j else x for j, x in enumerate(row)) for i, row in enumerate(a))


def _scaled(a: Matrix, factor: Any) -> Matrix:
    return _map(lambda x: factor * x, a)


# Multiplication by basis blades -------------------------------------------------------------------------------------


def _times_blade(space: Signature, values: Sequence[Any], bits: Sequence[Any], inverse: bool) -> list[Any]:
    """Multiply an even element by the blade of the vectors whose bit is 1, of one or the other sign, or its inverse.

    The number of a coefficient is combined with that of the blade by "exclusive or", one bit in each step of a loop,
    after which the bits of all numbers are rotated. Signs are products of one sign for each vector of the blade.
    """
    last, size = space.n - 1, len(values)
    signs: list[Any] = [1]
    for bit in bits:
        sign = select(bit, -1, 1)
        signs += [sign if each is signs[0] else each * sign for each in signs]
    characters = []
    for blade in space.blades:
        known = [space.algebra.blade_product(1 << i | 1 << last, blade) for i in range(last)]
        characters.append(signs[sum(1 << i for i, found in enumerate(known) if sum(found.values()) < 0)])

    def step(state: Any) -> Any:
        x, bits, k = state
        moved = [select(bits[0], x[number ^ 1], x[number]) for number in range(size)]
        rotated = tuple(moved[(number << 1) % size | number >> (last - 1)] for number in range(size))
        return rotated, (*bits[1:], bits[0]), k + 1

    def signed(x: Sequence[Any]) -> tuple[Any, ...]:
        return tuple(sign * value for sign, value in zip(characters, x, strict=True))

    start = tuple(values) if inverse else signed(values)
    moved = iterate(step, (start, tuple(select(bit, 1, 0) for bit in bits), 0), lambda _, new: new[2] >= last, last)[0][
        0
    ]
    return list(signed(moved) if inverse else moved)


def _largest(space: Signature, values: Sequence[Any]) -> list[Any]:
    """Return the bits of the number of the largest coefficient, without that of the last vector."""
    sizes, bits = [absolute(x) for x in values], list[Any]()
    for _ in range(space.n - 1):  # the highest bit first
        half = len(sizes) // 2
        low, high = sizes[:half], sizes[half:]
        bit = _maximum(low) < _maximum(high)
        sizes = [select(bit, y, x) for x, y in zip(low, high, strict=True)]
        bits.insert(0, bit)
    return bits


def _maximum(values: Sequence[Any]) -> Any:
    found = list(values)
    while len(found) > 1:
        found = [maximum(*found[k : k + 2]) if k + 1 < len(found) else found[k] for k in range(0, len(found), 2)]
    return found[0]


# Exponentials -------------------------------------------------------------------------------------------------------


def _exponential(space: Signature, generator: Matrix) -> Vector:
    """Return the coefficients of the versor ``exp(b)``, for the matrix of ``x -> (b x - x b) / 2``."""
    rest = _exponential_of_matrix(generator)
    start = (rest, tuple(int(k == 0) for k in range(len(space.blades))), 0)

    def step(state: Any) -> Any:
        rest, root, k = state
        bits, values = _versor_of(space, rest)
        moved = _times_blade(space, root, bits, inverse=True)
        # The scalar part of the square of the root, divided by the blade.
        signs = (space.algebra.blade_product(blade, blade)[0] for blade in space.blades)
        scalar = _sum(sign * x * y for sign, x, y in zip(signs, moved, root, strict=True))
        signed = [select(scalar < 0, -x, x) for x in values]
        square = _map(lambda x, y: 2 * x + y, rest, _product(rest, rest))
        return square, tuple(_times_blade(space, signed, bits, inverse=False)), k + 1

    found: Vector = iterate(step, start, lambda _, new: new[2] >= 2, 2)[0][1]
    return found


def _exponential_of_matrix(a: Matrix) -> Matrix:
    """Return ``exp(a) - 1`` by a Taylor polynomial and repeated squaring."""
    n = len(a)
    scaled, _, halvings = iterate(
        lambda s: (s[0] * HALF, s[1] * HALF), (2 * _size(a), 2), lambda _, new: _not_above(new[0], SCALED), LARGEST
    )
    small = _scaled(a, scaled[1])

    def term(state: Any) -> Any:
        sum_, k = state
        return _add_identity(_scaled(_product(small, sum_), 1 / k), 1), k - 1

    start = _product(small, iterate(term, (_one(n), TAYLOR), lambda _, new: new[1] < 2, TAYLOR)[0][0])

    def doubled(state: Any) -> Any:
        y, k = state
        return _map(lambda x, z: 2 * x + z, y, _product(y, y)), k + 1

    # An iteration takes at least one step, so that one doubling more than necessary is compared.
    found = iterate(doubled, (start, 1), lambda _, new: new[1] >= halvings, LARGEST)[0][0]
    chosen: Matrix = _stored(_map(lambda x, y: select(halvings < 2, x, y), start, found))
    return chosen


def _versor_of(space: Signature, rest: Matrix) -> tuple[list[Any], list[Any]]:
    """Return the versor of the isometry ``1 + rest`` up to its sign: the bits of a blade, and the other factor.

    With the diagonal matrix ``D`` of a blade, ``w = (D M - 1) / (D M + 1)``. An elimination without exchanges chooses
    the signs of ``D`` so that no pivot of ``M + D`` is below 1. The current row and columns are always the first ones.
    """
    n = space.n
    start = tuple((left, right) for left, right in zip(_add_identity(rest, 1), rest, strict=True))

    def step(state: Any) -> Any:
        ((first, own), *rows), signs, determinant, k = state
        sign = select(first[0] < 0, -1, 1)
        diagonal = first[0] + sign
        left = [x / diagonal for x in first[1:]]
        right = [x / diagonal for x in (own[0] + (1 - sign), *own[1:])]
        reduced = [
            (
                [x - row[0] * y for x, y in zip(row[1:], left, strict=True)],
                [x - row[0] * y for x, y in zip(other, right, strict=True)],
            )
            for row, other in rows
        ]
        turned = tuple(((*a, 0), (*b[1:], b[0])) for a, b in (*reduced, (left, right)))
        return turned, (*signs[1:], sign), determinant * diagonal, k + 1

    rows, signs, determinant, _ = iterate(step, (start, (1,) * n, 1, 0), lambda _, new: new[3] >= n, n)[0]
    terms = _bivector_terms(space, tuple(right for _, right in rows))
    # The square of the scalar part is the determinant of (D M + 1) / 2.
    parts = {0: sqrt(absolute(determinant) * Fraction(1, 2**n))}
    for blade in sorted(space.blades, key=int.bit_count)[1:]:
        i, *others = (j for j in range(n) if blade >> j & 1)
        rest_of = (parts[blade ^ 1 << i ^ 1 << j] for j in others)
        products = [terms[i, j] * part for j, part in zip(others, rest_of, strict=True)]
        parts[blade] = _sum(-x if k & 1 else x for k, x in enumerate(products))
    return [sign < 0 for sign in signs[:-1]], [parts[blade] for blade in space.blades]


# Logarithms ---------------------------------------------------------------------------------------------------------


def _logarithm(space: Signature, values: Sequence[Any]) -> Matrix:
    """Return half the principal logarithm of the matrix of a versor, or NaN where it is not determined."""
    rest = _stored(_isometry(space, values))
    turn, without = _half_turn(space, rest)
    found = _stored(_map(lambda x, y: x * HALF + y * Fraction(pi) * HALF, _logarithm_of(space, without), turn))
    again = _exponential_of_matrix(_scaled(found, 2))
    lack = _size(_map(lambda x, y: x - y, again, rest))
    # The quotient is infinity divided by infinity, NaN, where there is no result; it has a value in exact arithmetic.
    large = select(lack <= RESIDUAL * (1 + _size(rest)), 0, HUGE)
    factor = _stored((1 + large * large) / (1 + large * large * large))
    return _map(lambda x: x * factor, found)


def _isometry(space: Signature, values: Sequence[Any]) -> Matrix:
    """Return the matrix of ``x -> R x ~R - x``."""
    n, last = space.n, space.n - 1
    bits = _largest(space, values)
    moved = _times_blade(space, values, bits, inverse=True)
    w, bits = _stored((_matrix_of(space, lambda i, j: moved[(1 << i | 1 << j) & ~(1 << last)] / moved[0]), tuple(bits)))
    # The vectors of the blade are negated, and their number is even.
    signs = [1 - 2 * select(bit, 1, 0) for bit in bits]
    product: Any = 1
    for sign in signs:
        product = product * sign
    signs.append(product)
    turned = _product(_scaled(w, 2), _inverse(_add_identity(_scaled(w, -1), 1)))
    return tuple(tuple(signs[i] * turned[i][j] + (signs[i] - 1 if i == j else 0) for j in range(n)) for i in range(n))


def _logarithm_of(space: Signature, rest: Matrix) -> Matrix:
    """Return the principal logarithm of the isometry ``1 + rest``."""

    def halved(state: Any) -> Any:
        rest, _, factor = state
        inverse = _inverse(_add_identity(_polar(space, _add_identity(_scaled(rest, HALF), 1)), 1))
        root = _product(rest, inverse)
        return root, _product(root, inverse), 2 * factor

    _, z, factor = iterate(halved, (rest, rest, 2), lambda _, new: _not_above(_size(new[1]), SMALL), ROOTS)[0]
    square = _product(z, z)

    def term(state: Any) -> Any:
        sum_, k = state
        return _add_identity(_product(square, sum_), 1 / (2 * k - 1)), k - 1

    start = _scaled(_one(space.n), Fraction(1, 2 * TERMS + 1))
    series = iterate(term, (start, TERMS), lambda _, new: new[1] < 1, TERMS)[0][0]
    return _scaled(_product(z, series), factor)


def _polar(space: Signature, a: Matrix) -> Matrix:
    """Return the isometry of the polar decomposition by Newton's method (Higham 2008, section 8.3)."""

    def step(u: Matrix) -> Matrix:
        return _map(lambda x, y: (x + y) * HALF, u, _adjoint(space, _inverse(u)))

    found: Matrix = iterate(step, a, _is_close, STEPS)[0]
    return found


def _half_turn(space: Signature, rest: Matrix) -> tuple[Matrix, Matrix]:
    """Return the unit bivector of the only rotation by nearly pi as a matrix, and the isometry without a half turn.

    Both are returned as they are, and zero, if there is no such rotation. The squared cosines of the half angles are
    the eigenvalues of ``C = (2 + M + M**-1) / 4``, each of multiplicity two. The two smallest ones are estimated by
    quotients of the coefficients of the characteristic polynomial. Those of boosts are above 1: without a smaller one,
    the sum of up to four reciprocals is at most 4, and the least estimate, its reciprocal, at least 1 / 4.
    """
    n, back = space.n, _adjoint(space, rest)
    cosines = _stored(_add_identity(_map(lambda x, y: (x + y) / 4, rest, back), 1))
    least, second = _stored(_smallest(cosines))
    near = select(4 * least < second * second, 1, 0)
    # The projection onto the plane, by the matrix sign function of cosines minus a number between both.
    limit = sqrt(select(near, least * second, 0))
    sign, _, _ = iterate(
        lambda x: _map(lambda p, q: (p + q) * HALF, x, _inverse(x)),
        _map(lambda x, one: select(near, x, one), _add_identity(cosines, -limit), _one(n)),
        _is_close,
        STEPS,
    )
    plane = _stored(_add_identity(_scaled(sign, -HALF), HALF))
    # The first inverse is as large as 1 / limit, and leaves its rounding errors in the plane. One step of Newton's
    # method for the kernel of the cosines removes them, with a matrix in which the least eigenvalue is raised by 1.
    image = _stored(_product(cosines, plane))
    outside_plane = _map(lambda x, y: x - y, image, _product(plane, image))
    raised = _map(lambda x, y, one: select(near, x + y, one), cosines, plane, _one(n))
    plane = _stored(_map(lambda x, y: x - y, plane, _product(_inverse(raised), outside_plane)))
    columns = tuple(zip(*plane, strict=True))
    a = _longest(columns, lambda x: x)
    square = _stored(_dot(space, a, a))

    def outside(x: Vector) -> Vector:
        factor = _dot(space, a, x) / select(near, square, 1)
        return tuple(q - factor * p for p, q in zip(a, x, strict=True))

    b = _longest(columns, outside)
    area = square * _dot(space, b, b)
    is_there = select(area > 0, near, 0)
    size = sqrt(select(is_there, area, 1))
    unit = _stored(_matrix_of(space, lambda i, j: (a[i] * b[j] - a[j] * b[i]) / size))
    turning = _sum(unit[i][j] * (rest[j][i] - back[j][i]) for i in range(n) for j in range(n))
    factor = select(is_there, select(turning > 0, -1, 1), 0)
    # The projection is minus the square of the unit bivector's matrix.
    moved = _product(_product(_add_identity(rest, 1), _scaled(unit, -1)), unit)
    return _scaled(unit, factor), _map(lambda x, y: x - select(is_there, 2 * y, 0), rest, moved)


def _smallest(a: Matrix) -> tuple[Any, Any]:
    """Estimate the two smallest eigenvalues, for a matrix whose eigenvalues are double, and 1 once for an odd size."""
    n = len(a)
    square = _product(a, a)
    odd = n % 2
    powers = [
        (_trace(a) - odd) * HALF,
        (_trace(square) - odd) * HALF,
        (_trace_of_product(square, a) - odd) * HALF,
        (_trace_of_product(square, square) - odd) * HALF,
    ]
    e: list[Any] = [1]
    for k in range(1, n // 2 + 1):
        terms = [e[k - i] * powers[i - 1] for i in range(1, k + 1)]
        e.append(_sum(-x if i & 1 else x for i, x in enumerate(terms)) * Fraction(1, k))
    last, before, first = e[-1], e[-2], e[-3]  # Negative ones are those of complex eigenvalues.
    second = before / maximum(first, NOISE)
    return maximum(last / maximum(before, NOISE), NOISE), select(second < 1, second, 1)


def _trace(a: Matrix) -> Any:
    return _sum(a[i][i] for i in range(len(a)))


def _trace_of_product(a: Matrix, b: Matrix) -> Any:
    return _sum(a[i][j] * b[j][i] for i in range(len(a)) for j in range(len(a)))


def _dot(space: Signature, a: Vector, b: Vector) -> Any:
    return _sum(sign * x * y for sign, x, y in zip(space.squares, a, b, strict=True))


def _longest(vectors: Matrix, function: Callable[[Vector], Vector]) -> Vector:
    """Return the longest of the values of a function of vectors, computed in a loop."""
    n = len(vectors)

    def step(state: Any) -> Any:
        rows, found, size, k = state
        value = function(rows[0])
        other = _sum(x * x for x in value)
        longer = size < other
        return (
            (*rows[1:], rows[0]),
            tuple(map(lambda x, y: select(longer, y, x), found, value)),
            maximum(size, other),
            k + 1,
        )

    start = (vectors, (0,) * n, 0, 0)
    return tuple(iterate(step, start, lambda _, new: new[3] >= n, n)[0][1])
