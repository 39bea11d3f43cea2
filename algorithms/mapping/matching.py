"""Motions between scans without a prior: votes for rotations and translations, scores, and robust alignment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import mapping as kernels
from generated import pga2

from ..arguments import Reals
from ..evidence import Noise, rank
from .agreement import agreement
from .alignment import Aligned, aligned, covariance_of
from .motions import are_near, unit_motor
from .outlines import Outline, outline_of
from .scan import Scan
from .status import MappingStatus
from .support import Support, support
from .votes import motion_votes, rotation_votes

FEWEST = 10
"""Valid readings that a scan needs."""
_COARSE, _FINE = [0.4, 0.25, 0.15], [0.15, 0.1, 0.07, 0.07]
"""Scales of residuals in metres: of the alignment of all hypotheses, and of the best one."""
_HYPOTHESES = 12
"""A limit on work: motions by votes that are aligned."""
_SLIDES = np.arange(-12, 13) * 0.1
"""Metres by which the best hypothesis is moved along its least certain direction."""
_FARTHER = np.arange(-60, 61) * 0.1
"""A limit on work: metres up to which rivals are looked for along it."""
_SOME = 4
"""A limit on work: motions are compared with every so many readings first."""
_SLIDE_SCALE, _SLIDE_POINTS, _SLID = 0.1, 45, 0.03
"""Scale in metres, points of a scan, and loss for a metre, with which these are compared."""
_TURNED_BY, _LEAST_RADIUS = np.array([0.0, -1.2, -0.9, -0.6, -0.3, 0.3, 0.6, 0.9, 1.2]), 1.2
"""Metres by which a scan is turned about the centre of a round room, at its wall; the radius below which it is less."""
_ROUND = 0.5
"""A limit on work: in a round room, normals pass the centre by less than this part of the radius; in a square room they
pass it by more."""
_PART = 6
"""A limit on work: every so many readings are compared with a turned scan before all are."""
_SHORTEST = 1e-9
"""From floating point: metres of a segment between two readings at the same place."""
_SLIDES_APART, _FLAT = 0.25, 0.01
"""Metres between two of these, and difference of their scores, from which on the direction is determined."""
LEAST_SCORE = 0.5
"""Score below which no motion explains the scans."""
EXPLAINED = 0.15
"""Metres from a line up to which a reading has a score."""
_MARGIN, _SWING = 0.04, 1.5
"""Difference of scores up to which two motions explain the scans equally well, and that between a reading on a line and
one where the other scan shows free space, see `sum_of_scores`."""
_TURNED, _FAR = 0.12, 0.03
"""What a hypothesis loses for a half turn, and for a metre: of two that agree equally, the smaller motion is chosen."""
_FARTHEST = 6.0
"""Metres up to which hypotheses lose by the length of the motion."""
_APART = 0.3, 0.1
"""Metres and radians from which on motions are different."""
_LEAST_SUPPORT = 2.5
"""Readings that have to determine each direction, see `support`."""
_LARGEST_RESIDUAL = 0.026
"""Root mean square of the distances of readings from lines, in metres, above which they contradict the motion."""
NOISE = 0.02
"""Least standard deviation of readings, in metres."""
_UNKNOWN = 30.0
"""Standard deviation, in metres and radians, of what the scans do not determine: as far as scanners reach."""


@dataclass(frozen=True, eq=False)
class Match:
    """The motion between two scans.

    Attributes
    ----------
    motor : array, (4,)
        Motor of `generated.pga2` that takes the coordinates of the second scan to those of the first; the identity if
        no motion was found.
    covariance : array, (3, 3)
        Of x, y (metres) and the angle (radians) of the error: a small motion of the first scan's frame that follows the
        motor. Deviations along degenerate directions are at least 30. Infinite on the diagonal if no motion was found.
    status : MappingStatus
    score : float
        The mean score of points: 1 if all are on lines of the other scan, negative if they are in its free space.
    residual : float
        Root mean square of the distances of points from their lines, in metres.
    degenerate : array, (k, 3)
        Unit directions of motions, by x, y and angle, that scans do not determine: along a corridor, or a turn about
        the centre of a round room.
    others : array, (h, 4)
        Motors of different motions that explain the scans almost as well.
    """

    motor: Reals
    covariance: Reals
    status: MappingStatus
    score: float
    residual: float
    degenerate: Reals
    others: Reals


def match_scans(a: Scan, b: Scan, guess: ArrayLike | None = None) -> Match:
    """Find the motor that takes the coordinates of scan `b` to those of scan `a`.

    Without a guess, rotations and translations are voted for; the best hypotheses are aligned and compared, including
    the free space that scans show. Of motions that explain the scans equally well, the smallest is returned.

    Parameters
    ----------
    a, b : Scan
    guess : array_like, (4,), optional
        A motor of `generated.pga2` near the motion, which is then the only hypothesis.

    Returns
    -------
    Match
        Its status is OK if the motion is determined by enough readings on walls of both scans, and no other motion is
        almost as good. It does not prove that both scans show the same place: rooms look alike.

    Notes
    -----
    A step between beams that is stated wrong makes each turn wrong by the same share, and scans that only turn agree
    as well as with the right one: no test of two scans shows it. A tilted scanner that sees a flat floor measures
    walls, too.
    """
    if min(len(a.beams), len(b.beams)) < FEWEST:
        return _nothing(MappingStatus.TOO_FEW_READINGS)
    one, two = outline_of(a), outline_of(b)
    if guess is not None:
        motors = unit_motor(guess, "guess")[None]
    else:
        motors = motion_votes(one, two, rotation_votes(one, two))
        if len(motors) > _HYPOTHESES:
            first = agreement(one, two, motors, 0.4, 40, coarse=True) - _size(motors)
            motors = motors[np.argsort(-first)[:_HYPOTHESES]]
    coarse = aligned(one, two, motors, _COARSE, 3)
    motors = coarse.motors
    scores = agreement(one, two, motors, EXPLAINED)
    order = np.argsort(_size(motors) - scores)
    best, loose = _best_along(one, two, Aligned(*(x[order[0]] for x in coarse)))
    found = aligned(one, two, best, _FINE)
    return _result(one, two, found, loose, motors[order], scores[order], guess is None)


def _best_along(a: Outline, b: Outline, found: Aligned) -> tuple[Reals, Reals]:
    """Return the motor of the best score among those that slide along the direction of least information.

    The second result is that direction (1, 3) if others score as much, as in a corridor, or has no rows.
    """
    direction = _least_certain(found.information)
    motors = _slid(found.motors, direction, _SLIDES)
    scores = agreement(a, b, motors, _SLIDE_SCALE, _SLIDE_POINTS)
    scores = scores - _SLID * np.abs(_SLIDES)
    best = int(np.argmax(scores))
    away = np.abs(_SLIDES - _SLIDES[best]) > _SLIDES_APART
    flat = scores[away].max() > scores[best] - _FLAT
    return motors[best], np.array([[*direction, 0.0]])[: int(flat)]


def _least_certain(information: Reals) -> Reals:
    """Return the unit direction (2,) of translations of least information."""
    xx, xy, _, yy, _, _ = information
    return np.asarray(np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))[1][:, 0])


def _slid(motor: Reals, direction: Reals, lengths: Reals) -> Reals:
    """Return a motor, moved by lengths along a direction."""
    return np.asarray(pga2.motor_product(pga2.motor_from_angle_translation(0.0, lengths[:, None] * direction), motor))


def _farther_along(a: Outline, b: Outline, found: Aligned) -> Reals:
    """Return motors (k, 4) farther along the least certain direction where scans agree better than beside them."""
    motors = _slid(found.motors, _least_certain(found.information), _FARTHER)
    scores = agreement(a, b, motors, _SLIDE_SCALE, _SLIDE_POINTS, coarse=True)
    is_peak = (scores[1:-1] > scores[:-2]) & (scores[1:-1] >= scores[2:]) & (scores[1:-1] > LEAST_SCORE)
    return np.asarray(motors[1:-1][is_peak])


def _loose_turn(a: Outline, b: Outline, motor: Reals) -> Reals:
    """Return the turn (1, 3) about the centre of a round room, by x, y and angle, if it changes no score, or no rows.

    The centre is nearest to the lines through the points along their normals. Lines of a few points are chords of the
    wall, whose normals alone would determine the turn, so that the points of `b` are compared with the chain of those
    of `a`: the turn is determined if their squared distances grow by more than noise explains.
    """
    tangents = np.stack([-a.normals[:, 1], a.normals[:, 0]], 1)
    squares = tangents.T @ tangents
    if rank(squares) < 2:
        return np.zeros((0, 3))
    centre = np.linalg.solve(squares, tangents.T @ np.einsum("ij,ij->i", tangents, a.points))
    arms = a.points - centre
    radius = _quadratic_mean(np.hypot(*arms.T))
    if _quadratic_mean(np.einsum("ij,ij->i", tangents, arms)) > _ROUND * radius:
        return np.zeros((0, 3))
    there = pga2.motor_from_angle_translation(0.0, centre)
    turns = pga2.motor_from_angle_translation(_TURNED_BY / max(radius, _LEAST_RADIUS), np.zeros(2))
    motors = pga2.motor_product(pga2.motor_product(pga2.motor_product(there, turns), pga2.motor_inverse(there)), motor)
    own = np.arctan2(a.points[:, 1], a.points[:, 0])
    chain = _chain(a.points)

    def compared(turned: Reals, points: Reals) -> tuple[Reals, Reals]:
        """Return squared distances from the chain, and which points are at angles that both scans show."""
        places = np.asarray(kernels.moved_points(turned, points))
        angles = np.arctan2(places[..., 1], places[..., 0])
        return kernels.nearest_segment(places, chain)[0], (angles >= own.min()) & (angles <= own.max())

    # Only readings of what both scans show count: others are far from the chain in any case.
    distances, shown = compared(motors[0], b.points)
    is_near = distances < _SLIDE_SCALE**2
    points, count = np.ascontiguousarray(b.points[is_near]), int((is_near & shown).sum())
    # The chords of two scans of a round wall differ, whatever the noise.
    variance = max(float(distances[is_near & shown].sum() / max(count, 1)), NOISE**2)
    noise = Noise(variance, float(count))
    # A part of the points contradicts most turns; the others are compared with all of them.
    for part in (np.ascontiguousarray(points[::_PART]), points):
        distances, shown = compared(motors[1:], part)
        counts = shown.sum(1) if part is points else np.full(len(motors) - 1, len(points))
        sums = (distances * shown).sum(1)
        alike = any(
            2 * n >= count and not noise.contradicted(each, n) for n, each in zip(counts.tolist(), sums, strict=True)
        )
        if not alike:
            break
    twist = np.array([[centre[1], -centre[0], 1.0]])
    return np.asarray(twist[: int(alike)] / np.linalg.norm(twist))


def _quadratic_mean(lengths: Reals) -> float:
    """Return the root of the mean square, without squares that overflow."""
    largest = max(float(np.abs(lengths).max()), _SHORTEST)
    return largest * float(np.sqrt(((lengths / largest) ** 2).mean()))


def _chain(points: Reals) -> Reals:
    """Return the segments (k - 1, 5) between consecutive points: middle, normal and half of the length."""
    steps = np.diff(points, axis=0)
    lengths = np.maximum(np.hypot(*steps.T), _SHORTEST)
    normals = np.stack([-steps[:, 1], steps[:, 0]], 1) / lengths[:, None]
    return np.column_stack([(points[1:] + points[:-1]) / 2, normals, lengths / 2])


def _result(
    a: Outline, b: Outline, found: Aligned, loose: Reals, motors: Reals, scores: Reals, has_rivals: bool
) -> Match:
    score = float(agreement(a, b, found.motors[None], EXPLAINED)[0])
    if not np.isfinite(found.motors).all():
        return _nothing(MappingStatus.NOT_MATCHED)
    held = support(a, b, found.motors, EXPLAINED)
    # Readings that contradict the motion score this much more for one that explains them.
    rivals = motors[1:][scores[1:] > score - max(_MARGIN, _SWING * float(held.share))]
    others = rivals[~are_near(found.motors, rivals, *_APART)] if len(rivals) else rivals
    weight, squares = float(found.sums[0]), float(found.sums[1])
    residual = float(np.sqrt(squares / max(weight, 1e-9)))
    # Distances are between readings of both scans, and each pair of readings counts in both directions.
    variance = 2 * max(residual**2, 2 * NOISE**2)
    covariance, degenerate = covariance_of(found.information, variance)
    turn = _loose_turn(a, b, found.motors)
    degenerate = np.concatenate([degenerate if len(degenerate) else loose, turn])
    # What nothing determines has the deviation of something unknown, whatever the noise of readings says.
    covariance = covariance + _UNKNOWN**2 * degenerate.T @ degenerate
    status = MappingStatus.OK
    if score < LEAST_SCORE:
        status = MappingStatus.NOT_MATCHED
    elif len(others):
        status = MappingStatus.AMBIGUOUS
    elif len(degenerate):
        status = MappingStatus.DEGENERATE
    elif residual > _LARGEST_RESIDUAL or held.readings < _LEAST_SUPPORT or held.is_outvoted:
        status = MappingStatus.WEAK
    elif has_rivals:
        others = _as_likely(a, b, found, held, motors[1:][scores[1:] > LEAST_SCORE])
        status = MappingStatus.AMBIGUOUS if len(others) else status
    return Match(found.motors, covariance, status, score, residual, degenerate, others)


def _as_likely(a: Outline, b: Outline, found: Aligned, held: Support, motors: Reals) -> Reals:
    """Return those of other motions that no more readings contradict, and whose distances noise explains as well.

    They may show less overlap, as where doors repeat: readings of what the other scan cannot show are no evidence.
    Motions farther along the least certain direction, which have too little overlap for votes, are tried, too.
    """
    apart = motors[~are_near(found.motors, motors, *_APART)] if len(motors) else motors
    most = max(float(held.contradicting), 1.0)
    # Pairs of readings count in both directions.
    noise = Noise(float(found.sums[1] / found.sums[0]), float(found.sums[0] / 2))
    starts = np.concatenate([apart, _farther_along(a, b, found)])
    for every in (_SOME, 1):
        starts = starts[support(a, b, starts, EXPLAINED, every).contradicting <= most]
        if not len(starts):
            return starts
    rivals, _, sums = aligned(a, b, starts, _FINE)
    held = support(a, b, rivals, EXPLAINED)
    possible = ~are_near(found.motors, rivals, *_APART) & (held.contradicting <= most)
    possible &= (held.readings >= _LEAST_SUPPORT) & (agreement(a, b, rivals, EXPLAINED) >= LEAST_SCORE)
    chosen = [k for k in np.flatnonzero(possible) if not noise.contradicted(sums[k, 1] / 2, int(sums[k, 0] / 2))]
    return rivals[chosen]


def _size(motors: Reals) -> Reals:
    """Return what hypotheses lose for the size of the motion."""
    angle, shift = pga2.motor_to_angle_translation(motors)
    far = np.minimum(np.linalg.norm(shift, axis=-1), _FARTHEST)
    return np.asarray(_TURNED * np.abs(angle) / np.pi + _FAR * far)


def _nothing(status: MappingStatus) -> Match:
    covariance = np.diag(np.full(3, np.inf))
    none = np.zeros((0, 4))
    return Match(np.array([1.0, 0, 0, 0]), covariance, status, 0.0, np.inf, np.zeros((0, 3)), none)
