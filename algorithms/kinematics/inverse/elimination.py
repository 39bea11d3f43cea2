"""General arms with six joints: all variables but one are eliminated, and this one is found from a polynomial.

``E3 E4 E5 x = E2^-1 E1^-1 G x`` holds for every ``x`` that is invariant under the sixth joint. A point of its axis,
with the axis as tangent, is represented in conformal geometry by a point and a bivector. These are 14 numbers, which
transform linearly under motions, and under a single joint by a trigonometric polynomial of degree one. This gives the
14 equations of Raghavan and Roth (*J. Mechanical Design* 115:502, 1993). The fifth and the fourth joint give such
equations, too, ``E2 E3 E4 x = E1^-1 G E6^-1 x`` and ``E1 E2 E3 x = G E6^-1 E5^-1 x``, and so does the arm from its
other end. For arms with parallel axes, some of these six variants are degenerate. The kernels of
`generated.eliminations` compute the zeros and their configurations.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from generated import arms, eliminations, pga3

from ...arguments import Reals
from ...precision import SINGLE
from .candidates import completed, gathered
from .chain import SAME, Chain, Method, apart, chain_of, direction
from .solutions import Branches

_NOT_REAL = 1e-2
"""Imaginary parts of angles up to this may be rounding errors of a double zero. Newton's method decides."""
_TRIALS = 96
"""Number of random configurations that select one of the variants."""
_BLOCK = 64
"""Number of goals in a block, such that the equations of all candidates fit into the second-level cache."""

_TURN = np.array([[1, 1, 1], [2, -1, -1], [0, np.sqrt(3), -np.sqrt(3)]]) / 3
"""Coefficients of 1, cos, sin from values at 0, 120 and -120 degrees."""
_HALF = np.array([[1, 1, 0], [0, 0, 2], [1, -1, 0]])
"""Converts these to coefficients of 1, x, x², with the tangent x of half the angle, after multiplication by ``1 + x²``.
"""
_SLIDE = np.array([[0, 1, 0], [-0.5, 0, 0.5], [0.5, -1, 0.5]])
"""Coefficients of 1, t, t² from values at -1, 0, 1."""
_THIRDS, _UNITS = np.array([0, 2, -2]) * np.pi / 3, np.array([-1.0, 0, 1])
_ORIGINS = np.random.default_rng(1).uniform(-np.pi, np.pi, 6)
"""Origins of the angles, chosen at random so that no solution is at 180 degrees, where the tangent is infinite."""
_DEGREE = 8
"""Degree of the trigonometric polynomial of the first variable."""
_CHECKS = np.array([2, 8, 13]) + 0.5
"""Where the polynomial is checked: half way between samples with these numbers."""
_SHARPENED = 12
"""Largest number of Newton steps that sharpen zeros."""
_MEANS = 8
"""Number of means that approximate the centre of zeros."""
_ONE = np.eye(8)[0]


@dataclass(frozen=True, slots=True, eq=False)
class Variant:
    """One of the six eliminations for an arm.

    Attributes
    ----------
    chain : Chain
        Six joints. Lengths are relative to the arm's size.
    whole : Chain
        The given arm; `chain` may be its reverse.
    backwards : bool
        Whether `chain` is the reverse of `whole`.
    zeros, configurations : Method
        The kernels `eliminated` and `branches_of_angles` for this arm.
    """

    chain: Chain
    whole: Chain
    backwards: bool
    zeros: Method
    configurations: Method

    @classmethod
    def of(cls, whole: Chain, backwards: bool, after: int) -> Variant | None:
        """Return the variant with `after` joints after the invariant one; None if a joint of it may not be a slide."""
        some = whole.backwards if backwards else whole
        chain = chain_of(np.concatenate([some.axes[:, :3], some.axes[:, 3:] / whole.size], axis=-1), some.slides)
        slides, first, last = chain.slides, 2 - after, 5 - after
        if slides[first] or slides[last]:
            return None
        pair, three = [*range(first), *range(last + 1, 6)], [first, first + 1, first + 2]
        line = chain.axes[last]
        point = pga3.line_support(line)
        ahead, behind = _products(chain, range(first)), _products(chain, range(last + 1, 6))
        motion = _products(chain, three).reshape(3, 3, 3, 8)
        values = arms.point_and_tangent(pga3.move_point(motion, point), pga3.move_line(motion, line))
        forms = [_SLIDE if slides[j] else _HALF @ _TURN for j in three[1:]]
        side = np.einsum("ai,bj,ck,ijkx->cabx", _TURN, *forms, values)
        ones = [np.array([1.0, 0, 0 if slides[j] else 1]) for j in three[1:]]
        shares = np.einsum("b,c,a->cab", *ones, np.array([1.0, 0, 0]))
        form = np.kron(*(_SLIDE if slides[j] else _TURN for j in pair))
        many = len(form)
        zeros = eliminations.eliminated.bind(
            before=np.repeat(ahead, many // len(ahead), axis=0), after=np.tile(behind, (many // len(behind), 1)),
            point=point, line=line, constant=form[0], pair=form[1:], side=side, shares=shares, **_polynomial(),
        )  # fmt: skip
        places = np.argsort([*pair, *three, last])
        configurations = eliminations.branches_of_angles.bind(
            slides=np.array([float(slides[j]) for j in (*pair, *three)]), places=places.astype(float),
            origins=np.where(np.array(slides) | (places == 5), 0.0, _ORIGINS), **chain.tables, last=float(last),
            line=line, across=_across(line),
        )  # fmt: skip
        return cls(chain, whole, backwards, zeros, configurations)

    def candidates(self, goals: Reals, sharp: bool = False) -> tuple[Reals, Reals]:
        """Return configurations of the given arm that may reach goals, (N, C, 6), and how many real zeros there are.

        Missing configurations are NaN; there are as many columns as the goal with most needs. `sharp` spends more time
        on zeros that are close to each other.
        """
        scale = np.array([1.0] * 4 + [1 / self.whole.size] * 4)
        ends = (pga3.motor_inverse(goals) if self.backwards else goals) * scale
        q, most = np.full((len(goals), 2 * _DEGREE, 6), np.nan), np.empty(len(goals), int)
        columns = 1
        for start in range(0, len(ends), _BLOCK):
            block = slice(start, start + _BLOCK)
            found, most[block] = self._block(ends[block], sharp)
            q[block, : found.shape[1]] = found
            columns = max(columns, found.shape[1])
        q = q[:, :columns]
        if any(self.chain.slides):
            q *= np.where(self.chain.slides, self.whole.size, 1.0)
        return q[..., ::-1] if self.backwards else q, most

    def _block(self, goals: Reals, sharp: bool) -> tuple[Reals, Reals]:
        """As `candidates`, for `chain` and a block of goals."""
        *equations, zeros = self.zeros(goals, np.zeros((len(goals), 2)))
        angle, away, real, doubtful = zeros.transpose(2, 0, 1)
        sure = (real > 0).sum(-1)
        if np.count_nonzero(doubtful):
            rows = np.flatnonzero(zeros[..., 3].any(-1))
            first = np.exp(1j * zeros[rows, :, 0] - np.abs(zeros[rows, :, 1]))
            zeros[rows] = self.zeros(goals[rows], _centres(first))[-1]
        counted = (real + doubtful) > 0
        may_be = (np.abs(away) < _NOT_REAL) | counted
        order = np.argsort(~may_be, axis=-1, kind="stable")
        count = may_be.sum(-1)
        order = order[:, : max(int(count.max()), 1)]
        if sharp:
            angle = angle + np.where(doubtful > 0, away, 0.0)
        angle = angle[np.arange(len(goals))[:, None], order]
        q = self.configurations(goals, angle, float(_SHARPENED if sharp else 0), *equations)
        q[np.arange(order.shape[1]) >= count[:, None]] = np.nan
        # Zeros that were real before the samples moved may have become complex by errors: then some are missing.
        return q, np.maximum(counted.sum(-1), sure)


@dataclass(frozen=True, slots=True, eq=False)
class Elimination:
    """The variants of an elimination for one arm, the best one first.

    Attributes
    ----------
    whole : Chain
        The arm.
    variants : tuple of Variant
        The eliminations.
    """

    whole: Chain
    variants: tuple[Variant, ...]

    name = "elimination"

    @classmethod
    def of(cls, whole: Chain) -> Elimination | None:
        """Return the elimination for an arm, or None if no variant recovers most random configurations."""
        return _prepared(whole)

    def solve(self, goals: Reals) -> Branches:
        """As in `Closed`: 16 branches, NaN for missing ones, with discriminants that are 0 for coinciding ones."""
        return completed(self.whole, self._once, goals)

    def _once(self, goals: Reals, attempt: int) -> tuple[Branches, Reals]:
        """Return the branches of one elimination, complete if every real zero led to a branch of its own."""
        # Both of a pair of neighbours are solved by one variant, at each of three distances.
        number = attempt if attempt < 2 else (attempt // 2 - 1) // 3
        q, zeros = self.variants[number % len(self.variants)].candidates(goals, attempt > 0)
        branches, gap, count = gathered(self.whole, q, goals)
        return Branches(branches, gap, (zeros == count) & (count % 2 == 0) & (gap > 0).all(-1)), zeros


@lru_cache(maxsize=64)
def _prepared(whole: Chain) -> Elimination | None:
    if len(whole) != 6:
        return None
    slides = np.array(whole.slides)
    q = np.random.default_rng(2).uniform(-np.pi, np.pi, (_TRIALS, 6))
    q[:, slides] *= whole.size / np.pi
    goals = whole.motion_of_all(q)
    usable = []
    for backwards in (False, True):
        for after in range(3):
            variant = Variant.of(whole, backwards, after)
            if variant is None:
                continue
            unsure = _TRIALS - int((apart(variant.candidates(goals)[0], q[:, None], slides) < SINGLE).any(-1).sum())
            if unsure < _TRIALS // 2:
                # Variants of arms with a nearly special structure have zeros that cannot be distinguished.
                complete = Elimination(whole, (variant,))._once(goals, 0)[0].complete
                usable.append((unsure + int((~complete).sum()), variant))
    if not usable:
        return None
    variants = tuple(variant for _, variant in sorted(usable, key=lambda pair: pair[0]))
    found = Elimination(whole, variants)
    # Inaccurate candidates may still converge when they are improved.
    lost = ~(apart(completed(whole, found._once, goals).q, q[:, None], slides) < SAME).any(-1)
    return found if lost.sum() < _TRIALS // 8 else None


def _centres(zeros: NDArray[np.complex128]) -> Reals:
    """Return the points (N, 2) such that the map of `eliminated` distributes zeros (N, 16) evenly, as seen from 0."""
    # A polynomial that vanishes, of an arm with dependent axes, has zeros that are not numbers.
    zeros = np.nan_to_num(zeros)
    centre = np.zeros(len(zeros), complex)
    for _ in range(_MEANS):
        images = (zeros - centre[:, None]) / (1 - centre.conj()[:, None] * zeros)
        mean = images.mean(-1)
        centre = (mean + centre) / (1 + centre.conj() * mean)
    return np.stack([centre.real, centre.imag], -1)


@lru_cache(maxsize=1)
def _polynomial() -> dict[str, Reals]:
    """Return the tables for a trigonometric polynomial: samples, its Fourier transform, and guesses of the zeros."""
    angles = 2 * np.pi * np.arange(2 * _DEGREE + 1) / (2 * _DEGREE + 1)
    waves = np.exp(-1j * np.outer(np.arange(_DEGREE, -_DEGREE - 1, -1), angles)) / len(angles)
    between = 2 * np.pi * _CHECKS / len(angles)
    # Alternately inside and outside of the unit circle: guesses on it would never leave it.
    turns = np.arange(2 * _DEGREE)
    guesses = np.exp(np.where(turns % 2, 0.25, -0.25) + 1j * np.pi * (turns + 0.5) / _DEGREE)
    return {
        "samples": np.stack([np.cos(angles), np.sin(angles)], -1),
        "waves": np.stack([waves.real, waves.imag], -1),
        "checks": np.stack([np.cos(between), np.sin(between)], -1),
        "guesses": np.stack([guesses.real, guesses.imag], -1),
    }


def _products(chain: Chain, joints: range | list[int]) -> Reals:
    """Return the motors of consecutive joints, three values for each joint, those of the last one fastest."""
    found = _ONE[None]
    for joint in joints:
        values = _UNITS if chain.slides[joint] else _ORIGINS[joint] + _THIRDS
        found = pga3.motor_product(found[:, None], chain.motion(joint, values)).reshape(-1, 8)
    return np.asarray(found)


def _across(line: Reals) -> Reals:
    """Return a line that is not parallel to another one."""
    return pga3.line_from_direction_moment(np.eye(3)[np.argmin(np.abs(direction(line)))], np.zeros(3))  # type: ignore[no-any-return]
