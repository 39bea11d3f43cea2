"""Poses of a scan in a line map without a prior: votes, the free space, and the best hypotheses with their scores."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from generated import mapping as kernels
from generated import pga2

from ..arguments import Reals
from .alignment import covariance_of
from .cells import FAR, NEAR, Lines, MapCells, cells_of
from .matching import FEWEST, LEAST_SCORE, NOISE
from .motions import are_near
from .outlines import MOST_POINTS, still_points
from .scan import Scan
from .segments import Segments, segments
from .status import MappingStatus

_BINS = 180
"""Bins of the histogram of rotations: of two degrees."""
_ROTATION_SHARE, _ROTATION_GAP = 0.04, 3
"""The least votes of peaks of rotations, as a share of the most, and their distance in bins."""
_PARALLEL = np.cos(np.radians(6.0))
"""The least cosine of the angle between a line of the scan and one of the map that may be the same."""
_LINES, _CROSSING = 5, 4
"""The longest lines of the scan vote for translations, and of those that cross the longest one, these."""
_CROSSES = np.cos(np.radians(20.0))
"""The largest cosine of the angle between lines that cross each other: it is at least 20 degrees."""
_SHORTEST = 0.4
"""Metres of the shortest line of a map that is voted for."""
_SLACK = 0.5
"""Metres by which lines that were seen may extend beyond those of the map."""
_MOST_VOTES = 400_000
"""Meets of lines for one rotation; of more, only those of fewer lines of the scan are computed."""
_CELL = 0.4
"""The size of the cells in which translations are counted, in metres."""
_MOST_STEPS = 200
"""Steps along a constraint that votes alone."""
_CANDIDATES, _REFINED = 250, 40
"""Limits on work: the places with the most votes, and those with the best scores, which are aligned."""
_POINTS = 60
"""A limit on work: about the number of points of a scan that are aligned."""
_SCALES = [0.4, 0.3, 0.2, 0.15, 0.1, 0.07]
_SCALE = 0.1
"""The scale of distances of scores, in metres."""
_LEAST_SUPPORT = 3.0
"""Readings, of those that are aligned, that have to determine each direction."""
_MARGIN = 0.06
"""Difference of scores up to which two places explain a scan equally well: this, less for the means of several scans,
or the share of readings that the best one leaves unexplained. The map lacks as much there, and may lack as much where
the scan was taken."""
_APART = 0.5, 0.15
"""Metres and radians up to which places are the same."""


class Hypothesis(NamedTuple):
    """A pose of a scan in a map, its score of at most 1, and its covariance by x, y and angle."""

    motor: Reals
    score: float
    covariance: Reals


@dataclass(frozen=True, eq=False)
class Relocation:
    """Where a scan was taken in a map.

    Attributes
    ----------
    motor : array, (4,)
        Motor of `generated.pga2` from the coordinates of the scan to those of the map, of the best hypothesis; the
        identity if there is none.
    score : float
        The share of readings on lines of the map, less readings behind lines; at most 1. Narrow objects in front of
        others, such as people, are left out.
    covariance : array, (3, 3)
        Of the position x, y (metres) and the angle (radians) of the scanner in the map.
    status : MappingStatus
    hypotheses : tuple of Hypothesis
        Different poses, best first.
    """

    motor: Reals
    score: float
    covariance: Reals
    status: MappingStatus
    hypotheses: tuple[Hypothesis, ...]


def relocate(scan: Scan, line_map: Lines, *, n_hypotheses: int = 5) -> Relocation:
    """Find the pose of a scan in a map of lines, without a prior.

    Pairs of directions vote for rotations. Each line of the scan and parallel line of the map constrain the
    translation to a line; the meets of these lines vote for translations. The best candidates are aligned with the map
    and compared by the readings that they explain and those that would lie behind lines of the map.

    Parameters
    ----------
    scan : Scan
    line_map : Lines
        A `LineMap`, or anything with its normals, offsets and ends.
    n_hypotheses : int
        The most poses to return.

    Returns
    -------
    Relocation
        Its status is OK if one pose is better than all others, AMBIGUOUS if a different one is almost as good, WEAK if
        few readings determine the position in some direction, and NOT_MATCHED if none explains enough readings.

    Raises
    ------
    ValueError
        If `n_hypotheses` is not positive.
    """
    if n_hypotheses < 1:
        raise ValueError(f"n_hypotheses: {n_hypotheses}; expected at least 1")
    found = found_places(scan, cells_of(line_map), line_map)
    if isinstance(found, MappingStatus):
        return nowhere(found)
    return compared(*found, n_hypotheses)


def found_places(scan: Scan, cells: MapCells, line_map: Lines) -> tuple[Reals, Reals, Reals] | MappingStatus:
    """Return the best places of a scan: motors (c, 4), scores (c,) and information (c, 6); or why there are none."""
    seen = segments(scan)
    if len(scan.beams) < FEWEST or len(cells.far.segments) < 2 or len(seen) < 2:
        return MappingStatus.TOO_FEW_READINGS
    motors = _candidates(seen, line_map, 2 * cells.far.segments[:, 4])
    if not len(motors):
        return MappingStatus.NOT_MATCHED
    points = still_points(scan)
    few = points[:: max(1, len(points) // _POINTS)]
    motors = motors[np.argsort(-_scores(motors, few[::2], cells, 0.3))[:_REFINED]]
    return aligned_places(motors, points, cells)


def aligned_places(motors: Reals, points: Reals, cells: MapCells) -> tuple[Reals, Reals, Reals]:
    """Return motors aligned with a map, their scores, and the upper triangles of their information."""
    motors, information = _refined(motors, points[:: max(1, len(points) // _POINTS)], cells)
    return motors, scores_of(motors, points, cells), information


def scores_of(motors: Reals, points: Reals, cells: MapCells) -> Reals:
    """Return the share of points near lines of a map, less those that would be seen through lines."""
    return _scores(motors, points[:: 1 + len(points) // MOST_POINTS], cells, _SCALE)


def nowhere(status: MappingStatus) -> Relocation:
    """Return the result for a scan without a place."""
    return Relocation(np.eye(4)[0], 0.0, np.diag(np.full(3, np.inf)), status, ())


def _candidates(seen: Segments, line_map: Lines, lengths: Reals) -> Reals:
    """Return motors (c, 4) for which most meets of constraint lines vote."""
    found, votes = [], []
    chosen = _voters(seen)
    for angle in _rotations(seen, line_map.normals, lengths):
        constraints, owner = _constraints(seen, chosen, line_map, lengths, angle)
        shifts, weights = _meets(constraints, owner)
        if not len(weights):
            shifts, weights = _along(constraints)
        if not len(weights):
            continue
        place = np.floor(shifts / _CELL).astype(int)
        low = place.min(0)
        width, height = place.max(0) - low + 1
        cells = (place - low) @ np.array([height, 1])
        counts = np.bincount(cells, weights, width * height)
        best = np.argsort(-counts)[:_CANDIDATES]
        best = best[counts[best] > 0]
        # The mean of the votes of a cell is finer than the cell.
        mean = np.stack([np.bincount(cells, weights * shifts[:, k], width * height)[best] for k in (0, 1)], 1)
        found.append(pga2.motor_from_angle_translation(angle, mean / counts[best, None]))
        votes.append(counts[best])
    if not found:
        return np.zeros((0, 4))
    order = np.argsort(-np.concatenate(votes))[:_CANDIDATES]
    return np.asarray(np.concatenate(found)[order])


def _voters(seen: Segments) -> Reals:
    """Return the rows of the longest lines, and of the longest that are not parallel to the longest one."""
    order = np.argsort(-seen.lengths)
    normals = seen.normals[order]
    crossing = np.abs(normals @ normals[0]) < _CROSSES
    return np.unique(np.concatenate([order[:_LINES], order[crossing][:_CROSSING]]))


def _rotations(seen: Segments, normals: Reals, lengths: Reals) -> Reals:
    """Return the rotations for which most pairs of directions vote, weighted by lengths."""
    angles = np.arctan2(normals[:, 1], normals[:, 0]) - np.arctan2(seen.normals[:, 1], seen.normals[:, 0])[:, None]
    weights = np.minimum(lengths, seen.lengths[:, None])
    bins = np.floor(angles * (_BINS / (2 * np.pi))).astype(int) % _BINS
    counts = np.bincount(bins.ravel(), weights.ravel(), _BINS)
    smooth = counts + 0.5 * (np.roll(counts, 1) + np.roll(counts, -1))
    kept: list[int] = []
    for k in np.argsort(-smooth).tolist():
        if smooth[k] < _ROTATION_SHARE * smooth.max():
            break
        if all(abs((k - j + _BINS // 2) % _BINS - _BINS // 2) > _ROTATION_GAP for j in kept):
            kept.append(k)
    # The weighted circular mean around the peak is finer than the bins.
    result = []
    for k in kept:
        offset = (angles * (_BINS / (2 * np.pi)) - k - 0.5 + _BINS / 2) % _BINS - _BINS / 2
        near = np.abs(offset) < _ROTATION_GAP / 2
        result.append((k + 0.5 + np.average(offset[near], weights=weights[near])) * (2 * np.pi / _BINS))
    return np.array(result)


def _constraints(seen: Segments, chosen: Reals, line_map: Lines, lengths: Reals, angle: float) -> tuple[Reals, Reals]:
    """Return the constraints of pairs of parallel lines on translations, and which line of the scan they are of."""
    turn = pga2.motor_from_angle_translation(angle, np.zeros(2))
    normals = pga2.move_direction(turn, seen.normals[chosen])
    ends = pga2.move_point(turn, seen.ends[chosen])
    fits = lengths >= np.maximum(_SHORTEST, 0.6 * seen.lengths[chosen, None] - _SLACK)
    own, row = np.nonzero((normals @ line_map.normals.T > _PARALLEL) & fits)
    normal = line_map.normals[row]
    middle = ends[own].mean(1)
    # The line of the scan passes through the middle of what was seen, with the direction of the map.
    offset = line_map.offsets[row] - np.einsum("ij,ij->i", normal, middle)
    tangent = np.stack([normal[:, 1], -normal[:, 0]], 1)
    of_map = np.sort(np.einsum("ijk,ik->ij", line_map.ends[row], tangent), 1)
    of_scan = np.sort(np.einsum("ijk,ik->ij", ends[own], tangent), 1)
    low, high = np.sort(of_map - of_scan, 1).T
    weights = np.sqrt(np.minimum(lengths[row], seen.lengths[chosen][own]))
    return np.column_stack([normal, -offset, low - _SLACK, high + _SLACK, weights]), own


def _meets(constraints: Reals, owner: Reals) -> tuple[Reals, Reals]:
    """Return the translations of pairs of constraints of different lines of the scan, and their weights."""
    shifts, weights = [], []
    spent = 0
    n = int(owner.max()) + 1 if len(owner) else 0
    groups = [constraints[owner == k] for k in range(n)]
    for j in range(1, n):
        for i in range(j):
            a, b = groups[i], groups[j]
            if not len(a) or not len(b) or abs(a[0, 0] * b[0, 1] - a[0, 1] * b[0, 0]) < 0.2:
                continue
            if spent + len(a) * len(b) > _MOST_VOTES and spent:
                continue
            spent += len(a) * len(b)
            shift, weight = kernels.translation_votes(a[:, None], b)
            inside = weight > 0
            shifts.append(shift[inside])
            weights.append(weight[inside])
    if not weights:
        return np.zeros((0, 2)), np.zeros(0)
    return np.concatenate(shifts), np.concatenate(weights)


def _along(constraints: Reals) -> tuple[Reals, Reals]:
    """Return translations along constraints, where no two of them meet, as in a corridor, and their weights."""
    low, high = constraints[:, 3], constraints[:, 4]
    counts = np.clip(np.ceil((high - low) / _CELL), 1, _MOST_STEPS).astype(int)
    row = np.repeat(np.arange(len(counts)), counts)
    step = np.arange(len(row)) - (np.cumsum(counts) - counts)[row]
    positions = low[row] + (high - low)[row] * (step + 0.5) / counts[row]
    normal, offset = constraints[row, :2], -constraints[row, 2]
    tangent = np.stack([normal[:, 1], -normal[:, 0]], 1)
    return offset[:, None] * normal + positions[:, None] * tangent, constraints[row, 5]


def _scores(motors: Reals, points: Reals, cells: MapCells, scale: float) -> Reals:
    """Return the share of points near lines of the map, less those that would be seen through lines."""
    sums = kernels.sum_of_place_scores(motors, np.ascontiguousarray(points), *cells.near, scale)
    return np.asarray(sums) / len(points)


def _refined(motors: Reals, points: Reals, cells: MapCells) -> tuple[Reals, Reals]:
    """Return motors aligned with the map, and the upper triangles of their information."""
    points = np.ascontiguousarray(points)
    information = np.zeros((len(motors), 6))
    for scale in _SCALES:
        reach = min(3 * scale, FAR)
        listed = cells.near if reach < NEAR else cells.far
        motors, information, _ = kernels.step_to_map(motors, points, *listed, scale, reach)
    return motors, information


def different(motors: Reals, scores: Reals) -> list[int]:
    """Return the rows of different places, best first."""
    kept: list[int] = []
    near = are_near(motors[:, None], motors, *_APART)
    known = np.asarray(np.isfinite(motors).all(1))
    for k in np.argsort(-scores).tolist():
        if known[k] and not near[kept, k].any():
            kept.append(k)
    return kept


def compared(motors: Reals, scores: Reals, information: Reals, n_hypotheses: int, n_scans: int = 1) -> Relocation:
    """Return the best of several places that explain a share of the readings of some scans, with its status."""
    kept = different(motors, scores)
    if not kept:
        return nowhere(MappingStatus.NOT_MATCHED)
    hypotheses = []
    undetermined = []
    places = pga2.move_point(motors, np.zeros(2))
    for k in kept[:n_hypotheses]:
        covariance, degenerate = covariance_of(information[k], NOISE**2, places[k])
        hypotheses.append(Hypothesis(motors[k], float(scores[k]), covariance))
        undetermined.append(len(degenerate))
    best = hypotheses[0]
    status = MappingStatus.OK
    if best.score < LEAST_SCORE:
        status = MappingStatus.NOT_MATCHED
    elif len(kept) > 1 and scores[kept[1]] > best.score - max(_MARGIN / np.sqrt(n_scans), 1 - best.score):
        status = MappingStatus.AMBIGUOUS
    elif undetermined[0]:
        status = MappingStatus.DEGENERATE
    elif _support(information[kept[0]]) < _LEAST_SUPPORT:
        status = MappingStatus.WEAK
    return Relocation(best.motor, best.score, best.covariance, status, tuple(hypotheses))


def _support(triangle: Reals) -> float:
    """Return the least eigenvalue of the information of translations, in readings."""
    xx, xy, _, yy, _, _ = triangle
    return float((xx + yy) / 2 - np.hypot((xx - yy) / 2, xy))
