"""General arms with six joints: all variables but one are eliminated, and this one is found by eigenvalues.

``E3 E4 E5 x = E2^-1 E1^-1 G x`` holds for every ``x`` that is invariant under the sixth joint. A point of its axis,
with the axis as tangent, is represented in conformal geometry by a point and a bivector. These are 14 numbers, which
transform linearly under motions, and under a single joint by a trigonometric polynomial of degree one. This gives the
14 equations of Raghavan and Roth (*J. Mechanical Design* 115:502, 1993). The first two variables occur in eight
monomials on one side; projecting the 14 equations onto the complement of these eight leaves six equations in the other
three variables. In tangents of half angles their determinant is a polynomial, whose roots are eigenvalues (Manocha and
Canny, *IEEE Trans. Robotics Autom.* 10:648, 1994). Of the 24 roots, four are i and four -i for every goal. Their
vectors do not depend on the goal and are split off, so that up to 16 roots remain.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from generated import arms, pga3

from ...arguments import Reals
from .candidates import completed, gathered
from .chain import SAME, Chain, apart, chain_of, direction
from .solutions import Branches

_NOT_REAL = 1e-2
"""Imaginary parts up to this, relative to ``1 + |root|²``, may be rounding errors of a double root. Newton's method
decides."""
_ZERO = float(np.finfo(float).eps ** 0.5)
"""A root is real if the relative singular value of the equations, after refinement, is below this number: at a double
root, it is accurate to half the digits."""
_MOVED = 1e-6
"""Roots that differ by less than this, relative to ``1 + root²``, are the same."""
_ROUGH, _STEPS = 1e-7, 2
"""Candidates with a larger error than the first number are refined by this number of Newton steps."""
_TRIALS = 96
"""Number of random configurations that select one of four variants. These differ for arms with a nearly special
structure."""
_SURE = 1e-6
"""For a well conditioned variant, all trial configurations are found to this accuracy before improvement."""

_RARE = 0.1
"""Up to this part of the trial configurations may have doubtful branches, which take a second elimination."""

_TURN = np.array([[1, 1, 1], [2, -1, -1], [0, np.sqrt(3), -np.sqrt(3)]]) / 3
"""Coefficients of 1, cos, sin from values at 0, 120 and -120 degrees."""
_HALF = np.array([[1, 1, 0], [0, 0, 2], [1, -1, 0]])
"""Converts these to coefficients of 1, x, x², with the tangent x of half the angle, after multiplication by ``1 + x²``.
"""
_SLIDE = np.array([[0, 1, 0], [-0.5, 0, 0.5], [0.5, -1, 0.5]])
"""Coefficients of 1, t, t² from values at -1, 0, 1."""
_THIRDS, _UNITS = np.array([0, 2, -2]) * np.pi / 3, np.array([-1.0, 0, 1])
_ORIGINS = np.random.default_rng(1).uniform(-np.pi, np.pi, 5)
"""Origins of the angles, chosen at random so that no solution is at 180 degrees, where the tangent is infinite."""
_MIX = np.linalg.qr(np.random.default_rng(5).normal(size=(24, 24)))[0][:16]


@dataclass(frozen=True, slots=True, eq=False)
class Elimination:
    """Elimination for one arm.

    Attributes
    ----------
    chain : Chain
        Six joints, the last of which is revolute. Lengths are relative to the arm's size.
    whole : Chain
        The given arm; `chain` may be its reverse.
    backwards : bool
        Whether `chain` is the reverse of `whole`.
    factors : int
        Number of monomials that multiply the six equations: 2, or 4 if the equations are dependent.
    side : array, (3, 3, 3, 14)
        The side of the third to fifth joints, as polynomials of their variables.
    space : array, (2 M, 2 M)
        An orthogonal matrix. Its first `known` columns span the vectors of roots that are imaginary for every goal.
    known : int
    """

    chain: Chain
    whole: Chain
    backwards: bool
    factors: int
    side: Reals
    space: Reals
    known: int

    name = "elimination"

    @classmethod
    def of(cls, whole: Chain) -> Elimination | None:
        """Return the best variant for an arm, or None if no variant recovers most random configurations."""
        return _prepared(whole)

    @classmethod
    def made(cls, whole: Chain, backwards: bool, factors: int) -> Elimination:
        """Return one variant."""
        some = whole.backwards if backwards else whole
        axes = np.concatenate([some.axes[:, :3], some.axes[:, 3:] / whole.size], axis=-1)
        chain = chain_of(axes, some.slides)
        motion = pga3.motor_product(_sampled(chain, 2)[:, None], _sampled(chain, 3))
        values = _entity(chain, pga3.motor_product(motion[:, :, None], _sampled(chain, 4)))
        forms = [_SLIDE if slides else _HALF @ _TURN for slides in chain.slides[2:5]]
        side = np.einsum("ai,bj,ck,ijkx->abcx", *forms, values)
        size = 6 if factors == 2 else 8
        found = cls(chain, whole, backwards, factors, side, np.eye(4 * size), 0)
        if chain.slides[2]:
            return found
        q = np.random.default_rng(4).uniform(-np.pi, np.pi, (8, 6))
        space, known = _imaginary_space(found._equations(chain.motion_of_all(q))[0])
        return replace(found, space=space, known=known)

    def solve(self, goals: Reals) -> Branches:
        """As in `Closed`: 16 branches, NaN for missing ones, with discriminants that are 0 for coinciding ones."""
        return completed(self.whole, self._once, goals)

    def _once(self, goals: Reals, attempt: int) -> Branches:
        """Return the branches of one elimination, complete if every real root led to a branch of its own."""
        variant = (self._other_end() if attempt and attempt % 3 == 0 else None) or self
        which, q, real = variant.candidates(goals)
        branches, gap = gathered(self.whole, which, q, goals)
        count = np.isfinite(branches[..., 0]).sum(-1)
        complete = (np.bincount(which[real], minlength=len(goals)) <= count) & (count % 2 == 0)
        return Branches(branches, gap, complete)

    def _other_end(self) -> Elimination | None:
        """Return the variant from the other end, or None if the joint there is prismatic."""
        backwards = not self.backwards
        if self.whole.slides[0 if backwards else 5]:
            return None
        return _made(self.whole, backwards, 4)

    def candidates(self, goals: Reals) -> tuple[Reals, Reals, NDArray[np.bool_]]:
        """Return indices of goals, (K,), configurations of the given arm that may reach them, (K, 6), and real roots.

        The last result, (K,), says whether the candidate is a real root of the equations, up to rounding errors.
        """
        scale = np.array([1.0] * 4 + [1 / self.whole.size] * 4)
        which, q, real = self._candidates((pga3.motor_inverse(goals) if self.backwards else goals) * scale)
        q = np.where(self.chain.slides, q * self.whole.size, q)
        return which, q[:, ::-1] if self.backwards else q, real

    def _candidates(self, goals: Reals) -> tuple[Reals, Reals, NDArray[np.bool_]]:
        """As `candidates`, for `chain`."""
        chain = self.chain
        matrix, base, triangle, other = self._equations(goals)
        roots, vectors = _eigen(matrix, self.space, self.known)
        which, k = np.nonzero(np.abs(roots.imag) < _NOT_REAL * (1 + np.abs(roots) ** 2))
        sides = base[which][..., :8], triangle[which][:, :8], other[which, :, 0]
        q = self._configurations(roots[which, k].real, vectors[which, k], sides, goals[which])
        off = chain.distance(q, goals[which])
        # Eigenvectors of nearly equal roots, which occur for arms with a nearly special structure, are inaccurate.
        rough = np.flatnonzero(off > _ROUGH)
        start = roots[which, k].real[rough]
        root, vector, smallest = _sharper(matrix[which[rough]], start)
        better = self._configurations(root, vector, tuple(side[rough] for side in sides), goals[which[rough]])
        improved = chain.distance(better, goals[which[rough]]) < off[rough]
        q[rough[improved]] = better[improved]
        real = np.ones(len(which), bool)
        real[rough] = smallest < _ZERO
        # A complex root may be refined to a real one that is among the others.
        moved = rough[np.abs(root - start) > _MOVED * (1 + start * start)]
        x = roots[which, k].real
        x[rough] = root
        order = np.lexsort((x, which))
        apart_from_next = (np.diff(x[order]) > _MOVED * (1 + x[order[1:]] ** 2)) | (np.diff(which[order]) > 0)
        alone = np.ones(len(which), bool)
        alone[order[1:]] &= apart_from_next
        alone[order[:-1]] &= apart_from_next
        real[moved] &= alone[moved]
        return which, q, real

    def _equations(self, goals: Reals) -> tuple[Reals, Reals, Reals, Reals]:
        """Return the matrix polynomial of goals, factors of the side of the first two joints, and this side."""
        chain, many = self.chain, len(goals)
        motion = pga3.motor_product(_sampled(chain, 0)[:, None], _sampled(chain, 1))
        values = _entity(chain, pga3.motor_relative(motion, goals[:, None, None]))
        forms = [_SLIDE if slides else _TURN for slides in chain.slides[:2]]
        other = np.einsum("ai,bj,nijx->nxab", *forms, values).reshape(many, 14, 9)
        base, triangle = np.linalg.qr(other[..., 1:], mode="complete")
        ones = [np.array([1.0, 0, 0 if slides else 1]) for slides in chain.slides[2:5]]
        constant = np.einsum("a,b,c,nx->nabcx", *ones, other[..., 0])
        six = (self.side - constant).reshape(many, 27, 14) @ base[..., 8:]
        matrix = _matrix(np.moveaxis(six.reshape(many, 3, 3, 3, 6), -1, 2), self.factors)
        return matrix, base, triangle, other

    def _configurations(self, root: Reals, vector: Reals, sides: tuple[Reals, ...], goals: Reals) -> Reals:
        """Return configurations (K, 6) from values (K,) of the third variable and monomials (K, M) of the next two."""
        chain, (base, triangle, constant) = self.chain, sides
        monomials = vector.reshape(-1, 4, vector.shape[-1] // 4)[:, :3, :3]
        x = [root, _ratio(monomials), _ratio(monomials.swapaxes(-1, -2))]
        powers = [_powers(one, slides) for one, slides in zip(x, chain.slides[2:5], strict=True)]
        left = np.einsum("ka,kb,kc,abcx->kx", *powers, self.side) - constant
        along = np.einsum("kxa,kx->ka", base, left)
        # 1, c, s of the first joint times 1, c, s of the second, without the 1
        singles = _backward(triangle, along)
        q = np.empty((len(root), 6))
        for j, (c, s) in enumerate(((2, 5), (0, 1))):
            angle = _ORIGINS[j] + np.arctan2(singles[:, s], singles[:, c])
            q[:, j] = singles[:, c] if chain.slides[j] else angle
        for j, one in zip((2, 3, 4), x, strict=True):
            q[:, j] = one if chain.slides[j] else _ORIGINS[j] + 2 * np.arctan(one)
        rest = pga3.motor_relative(chain.part(0, 5).motion_of_all(q[:, :5]), goals)
        last = chain.axes[5]
        across = pga3.line_from_direction_moment(np.eye(3)[np.argmin(np.abs(direction(last)))], np.zeros(3))
        q[:, 5] = arms.turn_between_lines(last, across, pga3.move_line(rest, across))
        return q


@lru_cache(maxsize=64)
def _made(whole: Chain, backwards: bool, factors: int) -> Elimination:
    return Elimination.made(whole, backwards, factors)


@lru_cache(maxsize=64)
def _prepared(whole: Chain) -> Elimination | None:
    slides = whole.slides
    if len(whole) != 6:
        return None
    q = np.random.default_rng(2).uniform(-np.pi, np.pi, (_TRIALS, 6))
    q[:, list(np.flatnonzero(slides))] *= whole.size / np.pi
    goals = whole.motion_of_all(q)
    best, fewest = None, 2 * _TRIALS + 1
    for factors in (2, 4):
        for backwards in (False, True):
            if slides[0 if backwards else 5]:
                continue
            variant = _made(whole, backwards, factors)
            which, found, real = variant.candidates(goals)
            away = np.full(_TRIALS, np.inf)
            np.fmin.at(away, which, apart(found, q[which], np.array(slides)))
            # Some arms have real roots that lead to no configuration. They make every set of branches doubtful.
            spurious = np.bincount(which[real & ~(whole.distance(found, goals[which]) < _ROUGH)], minlength=_TRIALS) > 0
            unsure = int((away > _SURE).sum()) + (int(spurious.sum()) if spurious.mean() > _RARE else 0)
            if not unsure:
                return variant
            if unsure < fewest:
                best, fewest = variant, unsure
    # Inaccurate candidates may still converge when they are improved.
    found = np.full((_TRIALS, 1, 6), np.nan) if best is None else best.solve(goals)[0]
    lost = ~(apart(found, q[:, None], np.array(slides)) < SAME).any(-1)
    return best if lost.sum() < _TRIALS // 8 else None


def _sampled(chain: Chain, joint: int) -> Reals:
    """Return the motors of a joint at three values, (3, 8)."""
    return chain.motion(joint, _UNITS if chain.slides[joint] else _ORIGINS[joint] + _THIRDS)


def _entity(chain: Chain, motion: Reals) -> Reals:
    """Return the invariant of the last joint, moved by motors: (..., 8) to (..., 14)."""
    last = chain.axes[5]
    return arms.point_and_tangent(pga3.move_point(motion, pga3.line_support(last)), pga3.move_line(motion, last))


def _matrix(six: Reals, factors: int) -> Reals:
    """Return the six equations, multiplied by monomials, as a quadratic matrix polynomial: (N, 3, rows, monomials).

    ``six`` is (N, 3, 6, 3, 3): powers of the third variable, equations, powers of the fourth and fifth.
    """
    many, wide = len(six), 3 if factors == 2 else 4
    rows = np.zeros((many, 3, factors, 6, 4, wide))
    for k in range(factors):
        a, b = k % 2, k // 2
        rows[:, :, k, :, a : a + 3, b : b + 3] = six
    return rows.reshape(many, 3, 6 * factors, 4 * wide)


def _square(matrix: Reals) -> Reals:
    """Return as many equations as monomials."""
    return _MIX @ matrix if matrix.shape[2] > matrix.shape[3] else matrix


def _imaginary_space(matrix: Reals) -> tuple[Reals, int]:
    """Return an orthogonal matrix whose first columns span the vectors of the roots i and -i, and their number.

    There, an angle is that of an isotropic rotation, so that the equations do not contain the goal. The vectors are
    those common to the matrix polynomials of several goals, (N, 3, M, M).
    """
    at = _square(matrix)
    at = at[:, 0] - at[:, 2] + 1j * at[:, 1]
    _, values, vectors = np.linalg.svd(at.reshape(-1, at.shape[-1]))
    null = vectors[values < _ZERO * values[0]].conj()
    both = np.concatenate([null, 1j * null], axis=-1)
    basis = np.concatenate([both.real, both.imag]).T
    return np.linalg.qr(basis, mode="complete")[0], basis.shape[1]


def _eigen(matrix: Reals, space: Reals, known: int) -> tuple[Reals, Reals]:
    """Return roots of the third variable, (N, R), and the monomials of the fourth and fifth there, (N, R, M).

    The roots whose vectors are the first `known` columns of `space` are left out.
    """
    matrix = _square(matrix)
    size = matrix.shape[-1]
    highest = matrix[:, 2]
    singular = np.linalg.slogdet(highest)[0] == 0
    if singular.any():
        # perturb the matrix so that it is only ill conditioned
        highest[singular] += 1e-12 * _MIX[:size, :size]
    upper, lower = space[:size], space[size:]
    product = -np.linalg.solve(highest, matrix[:, 0] @ upper + matrix[:, 1] @ lower)
    companion = upper.T @ np.broadcast_to(lower, product.shape) + lower.T @ product
    companion[~np.isfinite(companion).all((1, 2))] = 0.0
    own, mixed = companion[:, :known, :known], companion[:, :known, known:]
    roots, vectors = np.linalg.eig(companion[:, known:, known:])
    # The square of `own` is -1, which gives its inverse after subtraction of a root.
    part = mixed @ vectors
    with np.errstate(divide="ignore", invalid="ignore"):
        part = (own @ part + part * roots[:, None]) / (1 + roots * roots)[:, None]
    return roots, (upper[:, :known] @ part + upper[:, known:] @ vectors).swapaxes(-1, -2)


def _sharper(matrix: Reals, root: Reals) -> tuple[Reals, Reals, Reals]:
    """Refine roots (K,) and their vectors (K, M) from all rows, by Newton's method on the smallest singular value.

    The last result, (K,), is this value relative to the largest one.

    Where roots are close to each other, eigenvalues of the companion matrix are much more accurate than eigenvectors.
    """
    for _ in range(_STEPS):
        left, values, vectors = np.linalg.svd(_at(matrix, root), full_matrices=False)
        matrix_derivative = matrix[:, 1] + 2 * root[:, None, None] * matrix[:, 2]
        derivative = np.einsum("ki,kij,kj->k", left[..., -1], matrix_derivative, vectors[:, -1])
        # Longer steps indicate that there is no root nearby; they are not taken.
        with np.errstate(divide="ignore", invalid="ignore"):
            step = values[:, -1] / derivative
        root = np.where(np.abs(step) < _NOT_REAL * (1 + root * root), root - step, root)
    _, values, vectors = np.linalg.svd(_at(matrix, root), full_matrices=False)
    return root, vectors[:, -1], values[:, -1] / np.maximum(values[:, 0], np.finfo(float).tiny)


def _at(matrix: Reals, root: Reals) -> Reals:
    """Evaluate matrix polynomials (K, 3, rows, M) at (K,)."""
    x = root[:, None, None]
    return np.asarray(matrix[:, 0] + x * (matrix[:, 1] + x * matrix[:, 2]))


def _ratio(monomials: Reals) -> Reals:
    """Return the first variable, (K,), from monomials (K, 3, 3), as a ratio of the largest of them."""
    size = np.abs(monomials)
    column = np.take_along_axis(monomials, np.argmax(size.max(1), axis=-1)[:, None, None], 2)[..., 0]
    top = np.abs(column[:, 2]) > np.abs(column[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.where(top, column[:, 2] / column[:, 1], column[:, 1] / column[:, 0]).real
    return np.asarray(np.nan_to_num(found, nan=0.0, posinf=1e8, neginf=-1e8))


def _powers(x: Reals, slides: bool) -> Reals:
    """Return 1, x, x², divided by ``1 + x²`` for angles."""
    found: Reals = np.stack([np.ones_like(x), x, x * x], -1)
    return found if slides else np.asarray(found / (1 + x * x)[:, None])


def _backward(triangle: Reals, right: Reals) -> Reals:
    """Solve triangular systems (K, 8, 8) with right-hand sides (K, 8)."""
    found = right.copy()
    for j in reversed(range(right.shape[-1])):
        pivot = triangle[:, j, j]
        found[:, j] /= np.where(np.abs(pivot) > 1e-14, pivot, np.inf)
        found[:, :j] -= triangle[:, :j, j] * found[:, j, None]
    return found
