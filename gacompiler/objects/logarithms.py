"""Logarithms of unit versors over six to eight vectors, by the rotation matrix and a correction in the algebra.

A unit versor ``R = exp(B)`` acts on vectors by the matrix ``M = exp(L)`` with ``L x = B x - x B``. The principal
logarithm of `M` follows from repeated square roots (Denman & Beavers 1976; Higham, *Functions of Matrices*, 2008, ch. 6
and 11). It exists in every metric and for every multiplicity of angles, null rotations included, which decompositions
into eigenvectors do not permit.

The matrix determines the plane of a rotation by nearly pi only up to the rounding error divided by the distance from
pi. There the plane is found as an invariant subspace (by the matrix sign function), and a half turn in it is removed
from `R` first. The result is then corrected in the algebra by Newton's method, with the derivative of the exponential,
``exp(B + X) = exp(phi(ad B) X) exp(B)`` up to second order, ``phi(z) = (exp(z) - 1) / z``. The correction restores the
relative accuracy of small logarithms, which the matrix ``M`` has lost.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..algebra.algebra import Algebra
from ..algebra.layout import Layout
from ..errors import AlgebraError
from .caches import cached_by_name
from .exponentials import RESIDUAL, exponential
from .tables import product_table

ROOTS = 60
"""Most square roots that are taken; the logarithm is halved by each, so that all doubles are covered."""
STEPS = 60
"""Most steps of an iteration for a root or a sign. Both double the number of correct digits, after as many steps as the
distance of an eigenvalue from the negative axis has bits, which are at most 53."""
SMALL = 0.125
"""Distance from 1 from which `TERMS` terms of the series of a logarithm suffice: ``(SMALL / 2)**(2 TERMS + 1)`` is
below the rounding error."""
TERMS = 7
TURNED = 0.5
"""Distance of a pair of eigenvalues from -1, below which its half turn is removed: 1/2 is as good as any other number
that keeps the remaining eigenvalues away from -1."""


class Frame(NamedTuple):
    """The bivectors and vectors of an algebra, and its metric as arrays."""

    bivectors: Layout
    vectors: Layout
    metric: Any
    pairs: tuple[tuple[int, int], ...]
    """The vectors of each stored bivector, with the sign of its name in `signs`."""
    signs: Any
    reverse: Any
    """The signs of the reverse of even elements."""


@cached_by_name
def _frame(algebra: Algebra) -> Frame:
    bivectors = algebra.layout("bivectors", " ".join(algebra.spelling(b)[1] for b in algebra.blades(2)))
    vectors = algebra.layout("vectors", " ".join(algebra.spelling(b)[1] for b in algebra.blades(1)))
    pairs, signs = [], []
    for slot in bivectors.stored:
        i = (slot.blade & -slot.blade).bit_length() - 1
        pairs.append((i, slot.blade.bit_length() - 1))
        signs.append(float(slot.sign))
    metric = np.array([[float(x) for x in row] for row in algebra.gram])
    reverse = np.array([float(algebra.reverse_sign(slot.blade.bit_count())) for slot in algebra.even.stored])
    return Frame(bivectors, vectors, metric, tuple(pairs), np.array(signs), reverse)


def versor_logarithm(versor: Any, wrap: Callable[[Layout, Any], Any], shorter: bool) -> Any:
    """Return bivectors whose exponentials are unit versors, or their negatives; NaN where none was found.

    Parameters
    ----------
    versor : MultivectorArray
        Even unit versors.
    wrap : callable
        Creates objects from a layout and coefficients.
    shorter : bool
        Whether the exponential may also be the negative of the versor. Then all angles of the motion are at most pi.

    Raises
    ------
    AlgebraError
        In a degenerate metric, in which the rotation of vectors does not determine the bivector.
    """
    algebra = versor.layout.algebra
    if algebra.is_degenerate:
        raise AlgebraError(
            f"log in {algebra.name}", f"a degenerate metric of {algebra.dimension} vectors", "up to five vectors",
            "or a metric without null directions that are orthogonal to all vectors",
        )  # fmt: skip
    frame, shape = _frame(algebra), versor.shape
    names = algebra.even.blades
    rows = np.stack([np.broadcast_to(np.asarray(versor[name], float), shape) for name in names], -1)
    flat = rows.reshape(-1, len(names))
    found = np.full((len(flat), frame.bivectors.size), np.nan)
    with np.errstate(all="ignore"):
        for k in np.flatnonzero(np.isfinite(flat).all(-1)):
            try:
                found[k] = _Versor(frame, flat[k], wrap).logarithm(shorter)
            except np.linalg.LinAlgError:
                continue
    return wrap(frame.bivectors, found.reshape(*shape, -1))


class _Versor:
    """One versor and the computation of its logarithm, on arrays of coefficients in the layout of even elements."""

    def __init__(self, frame: Frame, row: Any, wrap: Callable[[Layout, Any], Any]) -> None:
        self.frame, self.row, self.wrap = frame, row, wrap
        self.even = frame.bivectors.algebra.even
        self.product = product_table(self.even, self.even).product
        self.places = [self.even.blades.index(name) for name in frame.bivectors.blades]

    def logarithm(self, shorter: bool) -> Any:
        """Return the coefficients of the bivector, or NaN."""
        matrix = self.matrix(self.row)
        half = _half_turn(self.frame, matrix)
        start = 0.0
        if half is not None:
            start = np.pi / 2 * half
            matrix = self.matrix(self.product(self.row, -self.embedded(half)))  # exp(-pi B / 2) is -B
        sign, found = self.corrected(_bivector(self.frame, _logarithm_of(matrix)) + start)
        if shorter or sign >= 0:
            return found
        longest = _half_turn(self.frame, matrix if half is None else self.matrix(self.row), any_angle=True)
        if longest is None:
            return np.full(len(found), np.nan)
        sign, found = self.corrected(found - np.pi * longest)
        return found if sign > 0 else np.full(len(found), np.nan)

    def embedded(self, bivector: Any) -> Any:
        """Return a bivector in the layout of even elements."""
        found = np.zeros(self.even.size)
        found[self.places] = bivector
        return found

    def matrix(self, row: Any) -> Any:
        """Return the matrix of ``x -> R x ~R``."""
        vectors, frame = self.frame.vectors, self.frame
        first = product_table(self.even, vectors)
        second = product_table(first.result, self.even)
        moved = second.product(first.product(row, np.eye(vectors.size)), row * frame.reverse)
        return np.stack([moved[:, second.result.blades.index(name)] for name in vectors.blades])

    def power(self, bivector: Any) -> Any:
        """Return ``exp(B)``."""
        return exponential(self.wrap(self.frame.bivectors, bivector), self.even, self.wrap).values

    def corrected(self, bivector: Any) -> tuple[float, Any]:
        """Return the sign and the bivector for which ``sign exp(B)`` is the versor, after Newton's steps, or NaN."""
        sign = 0.0
        for step in range(4):
            power, back = self.power(bivector), self.power(-bivector)
            if not step:
                scalar = self.product(self.row, back)[self.even.blades.index("1")]
                sign = 1.0 if scalar >= 0 else -1.0
            change = self.product(sign * self.row - power, back)[self.places]
            moved = np.linalg.solve(_phi(_adjoint(self.frame, bivector)), change)
            bivector = bivector + moved
            if step and np.max(np.abs(moved)) <= 2.0**-50 * np.max(np.abs(bivector)):
                break
        # Newton's method squares the residual, so that results are correct to rounding, or far from the limit.
        residual = np.max(np.abs(sign * self.row - self.power(bivector)))
        if not residual <= RESIDUAL * np.max(np.abs(self.row)):
            return sign, np.full(len(bivector), np.nan)
        return sign, bivector


def _bivector(frame: Frame, generator: Any) -> Any:
    """Return the bivector `B` with ``B x - x B = L x``: ``L = 2 b G`` with the antisymmetric matrix `b` of `B`."""
    b = generator @ np.linalg.inv(frame.metric) / 2
    return np.array([(b[i, j] - b[j, i]) / 2 for i, j in frame.pairs]) * frame.signs


def _generator(frame: Frame, bivector: Any) -> Any:
    b = np.zeros_like(frame.metric)
    for (i, j), value in zip(frame.pairs, bivector * frame.signs, strict=True):
        b[i, j], b[j, i] = value, -value
    return 2 * b @ frame.metric


def _half_turn(frame: Frame, matrix: Any, any_angle: bool = False) -> Any:
    """Return the unit bivector of the rotation whose angle is nearest to pi, if it is the only one near pi; or None.

    With `any_angle`, the angle need not be near pi, but must be larger than all others.
    """
    # Squared, this is the sum of an eigenvalue and its inverse, and 2. It is 2 or more for boosts.
    values = np.linalg.eigvals(matrix)
    distances = np.sort(np.abs(values + 1) / np.sqrt(np.abs(values)))
    first, second = max(distances[1], 2.0**-22), distances[2]
    if not second > first * (1 + 2.0**-10) or not (any_angle or (first < TURNED and second > 2 * first)):
        return None
    # A pair of eigenvalues on the unit circle with the distance d from -1 has the sum d**2 - 2.
    limit = np.sqrt(first * second)
    sums = matrix + np.linalg.inv(matrix) + (2 - limit**2) * np.eye(len(matrix))
    projector = (np.eye(len(matrix)) - _sign_of(sums)) / 2
    if abs(np.trace(projector) - 2) > 2.0**-10:
        return None
    u, _, _ = np.linalg.svd(projector)
    a, b = u[:, 0], u[:, 1]
    gram = np.array([[x @ frame.metric @ y for y in (a, b)] for x in (a, b)])
    area = np.linalg.det(gram)
    if not area > 0:  # A plane of signature + - has no half turn.
        return None
    found = np.array([a[i] * b[j] - a[j] * b[i] for i, j in frame.pairs]) * frame.signs / np.sqrt(area)
    # The orientation is that of the rotation by less than pi.
    turn = _generator(frame, found) @ (matrix - np.linalg.inv(matrix))
    return found if np.trace(turn) <= 0 else -found


def _sign_of(matrix: Any) -> Any:
    """Return the matrix sign function by Newton's method with scaling (Higham 2008, §5.5)."""
    for _ in range(STEPS):
        inverse = np.linalg.inv(matrix)
        scale = np.sqrt(np.linalg.norm(inverse) / np.linalg.norm(matrix))
        if abs(scale - 1) < 0.01:
            scale = 1.0
        following = (scale * matrix + inverse / scale) / 2
        change = np.linalg.norm(following - matrix)
        matrix = following
        if change <= 2.0**-50 * np.linalg.norm(matrix) * len(matrix):
            break
    return matrix


def _logarithm_of(matrix: Any) -> Any:
    """Return the principal logarithm by square roots, and the series of ``2 artanh((M - 1) / (M + 1))``."""
    one = np.eye(len(matrix))
    roots = 0
    while np.linalg.norm(matrix - one) > SMALL and roots < ROOTS:
        matrix = _root_of(matrix)
        roots += 1
    z = np.linalg.solve(matrix + one, matrix - one)
    square, found = z @ z, np.zeros_like(z)
    for k in range(TERMS, -1, -1):
        found = found @ square + one / (2 * k + 1)
    return 2.0 ** (roots + 1) * (found @ z)


def _root_of(matrix: Any) -> Any:
    """Return the principal square root by the product form of Denman & Beavers (Higham 2008, equation 6.29)."""
    root, product, one = matrix, matrix, np.eye(len(matrix))
    for _ in range(STEPS):
        inverse = np.linalg.inv(product)
        root = root @ (one + inverse) / 2
        following = (one + (product + inverse) / 2) / 2
        change = np.linalg.norm(following - product)
        product = following
        if change <= 2.0**-50 * len(matrix):
            break
    return root


def _adjoint(frame: Frame, bivector: Any) -> Any:
    """Return the matrix of ``X -> B X - X B`` on bivectors, from that on vectors, since it is a derivation."""
    generator, m = _generator(frame, bivector), len(frame.pairs)
    found = np.zeros((m, m))
    place = {pair: k for k, pair in enumerate(frame.pairs)}
    for column, (i, j) in enumerate(frame.pairs):
        for k in range(len(generator)):
            for first, second, value in ((k, j, generator[k, i]), (i, k, generator[k, j])):
                if first != second and value:
                    pair = (min(first, second), max(first, second))
                    found[place[pair], column] += value if first < second else -value
    return frame.signs[:, None] * found * frame.signs


def _phi(matrix: Any) -> Any:
    """Return ``(exp(A) - 1) / A`` by its series for a fraction of `A`, and ``phi(2 z) = phi(z) (exp(z) + 1) / 2``."""
    one = np.eye(len(matrix))
    doublings = max(int(np.frexp(np.linalg.norm(matrix))[1]) + 1, 0)
    small = matrix / 2.0**doublings
    found = one
    for k in range(_LAST, 1, -1):
        found = one + small @ found / k
    power = one + small @ found
    for _ in range(doublings):
        found = found @ (power + one) / 2
        power = power @ power
    return found


_LAST = 15
"""The last term of the series of `_phi`, whose argument has a norm of at most 1/2: ``0.5**15 / 16!`` is below 1e-17."""
