"""How a hand opens before it closes on an object, and how fast its parts move meanwhile."""

from __future__ import annotations

import numpy as np

from generated import pga3

from ..arguments import Reals
from .hands import Hand

OPENINGS = 0.25, 0.5, 0.9, 3.0
"""Angles by which the bends of a grasp are reduced, in radians; the last one opens the hand completely."""
APPROACH = 0.08
"""The distance of a straight approach along the axis z of the hand, in metres."""


def opened(hand: Hand, joints: Reals, by: float) -> Reals:
    """Return the joints (4,) of a hand whose fingers are opened by an angle, within its limits."""
    found = joints.copy()
    found[1:] = np.maximum(joints[1:] - by, hand.limits[1:, 0])
    return found


def closing_speeds(hand: Hand) -> Reals:
    """Return bounds of the displacement of each capsule for a change of each joint by 1, (k, 4)."""
    found = np.zeros((len(hand.carriers), 4))
    for row, (carrier, ends) in enumerate(zip(hand.carriers, hand.capsules, strict=True)):
        if carrier < 0:
            continue
        finger, part = divmod(int(carrier), 3)
        length = np.zeros(2)
        points = ends
        for at in range(part, -1, -1):
            # A point of an axis is fixed in both links that it connects.
            feet = pga3.project_point_on_line(points, hand.axes[3 * finger + at])
            length = length + np.linalg.norm(points - feet, axis=1)
            found[row, 0 if at == 0 else finger + 1] += abs(hand.ratios[3 * finger + at]) * length.max()
            points = feet
    return found
