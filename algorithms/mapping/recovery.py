"""Where a scan was taken if odometry slips: matches without a prior with the last scan, and with earlier ones."""

from __future__ import annotations

import numpy as np

from generated import pga2

from ..arguments import Reals
from .keyframes import Keyframes
from .loops import StoredScans
from .matching import Match, match_scans
from .motions import are_near, length_and_angle, relative
from .rivals import RARE, Rivals
from .scan import Scan
from .status import MappingStatus
from .surfaces import Alignment, Reference, Surface, align

ENOUGH = 0.4
"""The share of readings on known surfaces below which a scan is refused."""
_AGREES, _OVERLAP = 0.7, 0.15
"""With odometry, a smaller share is enough if at least this part of the readings near known surfaces are on them."""
_MOST_TRIED, _APART, _AROUND = 5, 1.0, 12
"""A scan is matched with at most this many earlier scans, which are that far apart in metres, and aligned with so many
on each side of them."""
RESTING = 1e-6
"""From floating point: metres and radians below which odometry rests. Wheels that turn move it by more."""
_CHANGED = 0.06
"""From a probability: metres by which most of the differences of two readings with noise of 2 cm never differ."""
_NEAR = 0.5, 0.1
"""Metres and radians up to which motions are the same."""


def is_new_view(found: Alignment) -> bool:
    """Return whether readings near known surfaces are on them, though most readings are elsewhere."""
    return found.agreement >= _AGREES and found.share >= _OVERLAP


def contradicts(match: Match, found: Alignment, reference: Reference, seen: Surface, others: Rivals) -> bool:
    """Return whether the match with the last scan, without a prior, is another one that readings show to be right.

    Then odometry has slipped, or the robot was carried.
    """
    if match.status != MappingStatus.OK or are_near(match.motor, found.motor, *_NEAR):
        return False
    return others.are_unlike(align(reference, seen, match.motor).motor, found.motor)


def is_far(motion: Reals, deviations: Reals) -> bool:
    """Return whether a motion is larger than its deviations, angle, x and y, allow with a thousandth."""
    angle, shift = pga2.motor_to_angle_translation(motion)
    return bool((np.abs([angle, *shift]) > RARE * deviations).any())


def has_moved(last: Scan | None, scan: Scan) -> bool:
    """Return whether most beams of two scans differ by more than noise: then the scanner has moved between them."""
    if last is None or (len(last), last.angle_min, last.angle_step) != (len(scan), scan.angle_min, scan.angle_step):
        return False
    both = last.valid & scan.valid
    changes = np.abs(scan.ranges[both] - last.ranges[both])
    return bool(len(changes) and np.median(changes) > _CHANGED)


def earlier_match(
    path: Keyframes, scans: StoredScans, scan: Scan, seen: Surface, motion: Reals, with_last: Match
) -> tuple[int, Alignment] | None:
    """Return the row of an earlier scan with which a scan matches without a prior, and the alignment there.

    Parameters
    ----------
    path : Keyframes
    scans : StoredScans
        The scans at the poses.
    scan : Scan
    seen : Surface
        The surface of the scan.
    motion : array, (4,)
        The predicted motion since the last pose: nearest scans are tried first.
    with_last : Match
        The match with the last scan.

    Returns
    -------
    tuple of int and Alignment, or None

    Notes
    -----
    The last scan, which shows the same room, is enough. Rooms look alike: the place by an earlier one has to be one
    that the last scan leaves possible.
    """
    last = len(path) - 1
    distances, _ = length_and_angle(relative(pga2.motor_product(path.motors[last], motion), path.motors))
    tried: list[int] = []
    possible: list[Reals] = []
    for row in [last, *np.argsort(distances, kind="stable").tolist()]:
        apart, _ = length_and_angle(relative(path.motors[row], path.motors[tried]))
        if len(tried) == _MOST_TRIED or (len(tried) and apart.min() < _APART):
            continue
        tried.append(row)
        match = with_last if row == last else match_scans(scans[row], scan)
        if row == last and match.status not in (MappingStatus.NOT_MATCHED, MappingStatus.TOO_FEW_READINGS):
            motions = (match.motor, *match.others)
            possible = [np.asarray(pga2.motor_product(path.motors[last], each)) for each in motions]
        if match.status != MappingStatus.OK:
            continue
        rows = np.arange(max(row - _AROUND, 0), min(row + _AROUND, last) + 1)
        found = align(path.submap(rows, row), seen, match.motor)
        is_same = are_near(match.motor, found.motor, *_NEAR)
        if found.agreement < _AGREES or found.share < ENOUGH or not is_same:
            continue
        place = np.asarray(pga2.motor_product(path.motors[row], found.motor))
        if row == last or any(are_near(place, other, *_NEAR) for other in possible):
            return row, found
    return None
